"""How a team of workers is set, and where its time goes."""

from __future__ import annotations

from dataclasses import dataclass

SHARE = 0.02
"""Collisions for each particle below which a stretch is not worth a window."""


@dataclass
class Shares:
    """Where the time of a run in windows went, and what came of it.

    Attributes
    ----------
    windows, repeats : int
        Windows that were kept, and that were run again.
    collisions : int
        Collisions in windows that were kept.
    processed : int
        Collisions that the workers went through for them, rims included.
    wall : float
        Wall time in windows [s].
    load, run, compare, store, merge, turn, lost : float
        Of it: filling rims, running, comparing, handing back, adding up, going over into the next epoch, and
        windows that were run again.
    busy : float
        CPU time of all workers together in ``run`` [s]: what is missing to ``run`` times the workers is
        waiting.
    """

    windows: int = 0
    repeats: int = 0
    collisions: int = 0
    processed: int = 0
    wall: float = 0.0
    load: float = 0.0
    run: float = 0.0
    compare: float = 0.0
    store: float = 0.0
    merge: float = 0.0
    turn: float = 0.0
    lost: float = 0.0
    busy: float = 0.0


@dataclass
class Settings:
    """How long windows are and how deep rims.

    Attributes
    ----------
    collisions : float or None
        Collisions a particle that a window should hold, or None for what was measured to be good.
    depth : float or None
        Depth of the rims beyond what a part touches [length], or None for as deep as needed.
    least : float
        Collisions a particle below which a stretch is left to the plain cycle.
    """

    collisions: float | None = None
    depth: float | None = None
    least: float = SHARE
