"""A plan with some of its values replaced by those of the command line."""

from __future__ import annotations

import dataclasses
from typing import Any

from carom.plan.plan import Plan
from carom.plan.sections import SceneSpec

RIVALS = (("cells", "n"), ("packing_fraction", "density", "box"))
"""Groups of keys. A scene has one key of a group: a value for one of them replaces the others."""

LENGTHS = ("collisions_per_particle", "relative_error")
"""The same for a run."""

FLUIDS: dict[int, dict[str, Any]] = {
    1: {"initial": "cubic", "dimension": 1, "n": 1000, "packing_fraction": 0.5},
    2: {"initial": "triangular", "cells": 42, "packing_fraction": 0.6},
    3: {"initial": "fcc", "cells": 8, "packing_fraction": 0.45},
    4: {"initial": "dn", "dimension": 4, "cells": 4, "packing_fraction": 0.2},
    5: {"initial": "dn", "dimension": 5, "cells": 3, "packing_fraction": 0.1},
    6: {"initial": "dn", "dimension": 6, "cells": 2, "packing_fraction": 0.05},
}
"""Scenes for ``--dimension`` without ``--initial``: fluids of 1000 to 4000 particles, below freezing."""


def overridden(
    plan: Plan | None, *, scene: dict[str, Any], run: dict[str, Any], output: dict[str, Any]
) -> Plan:
    """Return the plan with the given values; None stands for those not given.

    Raises
    ------
    InputError
        If the values contradict each other or the plan, as a scene file's would.
    """
    given = {name: value for name, value in scene.items() if value is not None}
    if plan is None:
        plan = Plan()
        if given.get("dimension") in FLUIDS and "initial" not in given:
            fluid = FLUIDS[given.pop("dimension")]
            plan = dataclasses.replace(plan, scene=SceneSpec(**fluid))
    if given:
        cleared = {
            name: None
            for rivals in RIVALS
            if given.keys() & {*rivals}
            for name in rivals
        }  # fmt: skip
        if given.get("initial") == "random":
            cleared["cells"] = None
        plan = dataclasses.replace(plan, scene=dataclasses.replace(plan.scene, **{**cleared, **given}))
    for section, values in (("run", run), ("output", output)):
        kept = {name: value for name, value in values.items() if value is not None}
        if kept.keys() & {*LENGTHS}:
            kept = {**dict.fromkeys(LENGTHS), **kept}
            if kept["relative_error"] is None:
                kept.setdefault("walltime", None)
        if kept:
            spec = dataclasses.replace(getattr(plan, section), **kept)
            plan = dataclasses.replace(plan, **{section: spec})
    return plan
