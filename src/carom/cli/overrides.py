"""A plan with some of its values replaced by those of the command line."""

from __future__ import annotations

import dataclasses
from typing import Any

from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import SceneSpec
from carom.studies.runs.asked import changed

RIVALS = (("cells", "n"), ("packing_fraction", "density", "box"))
"""Groups of keys. A scene has one key of a group: a value for one of them replaces the others."""

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
    plan: SceneFile | None, *, scene: dict[str, Any], run: dict[str, Any], output: dict[str, Any]
) -> SceneFile:
    """Return the plan with the given values; None stands for those not given.

    Raises
    ------
    InputError
        If the values contradict each other or the plan, as a scene file's would.
    """
    given = {name: value for name, value in scene.items() if value is not None}
    if plan is None:
        plan = SceneFile()
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
    return changed(plan, run=run, output=output)
