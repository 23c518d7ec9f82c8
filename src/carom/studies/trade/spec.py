"""What a comparison of methods asks for: the section ``[trade]``, and ``[scene]``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from carom.declared import SEED, described, number, option
from carom.errors import InputError
from carom.studies.grid import OfScene

STEPS = (1e-1, 1e-2, 1e-3, 1e-4)
"""Steps of the time-driven method [mean free times]."""

VERLET = (5e-4, 1e-3, 2e-3)
"""Steps of pseudo hard spheres [sigma sqrt(m / epsilon)]: at 4e-3 their energy diverges."""

SIZES = (108, 256, 500, 864, 2048, 4000, 10976, 32000)
"""Numbers of particles to compare; the nearest that fill a lattice are taken."""

INTERVALS = (0.1, 0.3, 1.0, 3.0, 10.0)
"""Sampling intervals to compare [mean free times]."""

ENGINE = {"kind": "event-driven", "precision": "double"}
"""The method that others are compared with."""

DEFAULT = {"lattice": "fcc", "cells": 8, "density": 0.5}
"""Without a scene file: 2048 spheres."""

REFUSED = (
    "species", "sizes", "contact", "walls", "obstacles", "interaction", "motion", "impact", "drive", "pinned",
    "file",
)  # fmt: skip
"""Keys of a scene that the other methods do not know."""


@described
@dataclass(frozen=True)
class TradeSpec(OfScene):
    """Methods to compare by speed and accuracy, on one scene of equal spheres.

    Raises
    ------
    InputError
        If a value is out of range, or the scene is not one of equal spheres in a periodic box.
    """

    study: ClassVar[str] = "speed and accuracy"
    section: ClassVar[str] = "trade"
    serial: ClassVar[bool] = True
    argument: ClassVar[str] = (
        r"Scene file (TOML): \[scene] and \[trade]. Without: 2048 spheres at density 0.5."
    )
    about: ClassVar[str] = """Compare methods by speed and accuracy, on this machine.

    The engine, the naive algorithm in 50 digits, compiled time-driven stepping, and pseudo hard spheres (Mie
    50-49) move the same spheres. The folder then holds study.toml, a result file for each row in tasks/,
    trade.csv, sizes.csv, sampling.csv and trade.png. The same command continues a comparison that was
    stopped.

    [bold]Examples[/bold]

    carom trade
    carom trade scene.toml --out mine --report
    carom trade --seconds 1 --out quick
    """

    seconds: float = option(
        number(low=0.0, open_low=True),
        "CPU seconds for the statistics of a row; the whole takes some forty times as long, and a minute "
        "more.",
        default=8.0,
    )
    seed: int = option(SEED, "Seed of all random numbers.", default=1)
    scene: Mapping[str, Any] = option(None, "Keys of a scene.", flags=None, factory=dict)

    def complete(self) -> None:
        """Check the scene; errors are those of :class:`TradeSpec`."""
        from carom.scene_file.fields import tuples
        from carom.scene_file.sections import SceneSpec
        from carom.studies.scenes import plain
        from carom.studies.trade.scenes import small_scene

        SceneSpec.check_words(self.scene)
        spec = SceneSpec(**tuples(dict(self.scene) or DEFAULT))
        for name in REFUSED:
            if getattr(spec, name) not in (None, ()):
                raise InputError(
                    "carom trade compares elastic, equal spheres in a periodic box; leave out "
                    f"[scene] {name}."
                )
        made = None if spec.lattice is None else spec.build(self.seed)
        if (spec.n if made is None else made.n) == 1:
            raise InputError("A scene of one particle has nothing to compare; take more.")
        if made is not None:  # places at random are never too dense
            small_scene(made)
        self._put("scene", plain(spec))

    def tasks(self) -> list[dict[str, Any]]:
        """Return what all are compared with, and the rows: methods, sizes, intervals of sampling."""
        shared, d = self.settings(), int(self.scene["dimension"])
        rows: list[dict[str, Any]] = [
            {"row": "reference"},
            *({"row": "method", "method": words} for words in methods()),
            *({"row": "size", "cells": cells} for cells in sizes(d)),
            *({"row": "interval", "interval": interval} for interval in INTERVALS),
        ]
        return [{**shared, **row} for row in rows]


def methods() -> list[dict[str, Any]]:
    """Return the methods to compare, as plain values."""
    return [
        ENGINE,
        {"kind": "event-driven", "precision": "single"},
        {"kind": "naive", "digits": 50},
        *({"kind": "time-driven", "step": step} for step in STEPS),
        *({"kind": "pseudo-hard", "step": step} for step in VERLET),
    ]


def sizes(dimension: int) -> list[int]:
    """Return the cells of the lattices whose numbers of particles are nearest to ``SIZES``."""
    from carom.scene import lattices

    lattice = lattices.densest(dimension)
    count = len(lattice.basis) / math.prod(lattice.shape)
    return list(dict.fromkeys(max(round((n / count) ** (1.0 / dimension)), 2) for n in SIZES))
