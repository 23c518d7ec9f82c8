"""How a team of workers is set, and where its time goes."""

from __future__ import annotations

from dataclasses import dataclass

LEAST_PER_WINDOW = 0.1
"""Collisions for each particle below which a stretch is not worth a window."""

LOOKAHEAD = 8.0
"""Widths of a bucket, of a few cycles each, that a part may be ahead of another."""

MANY = 100_000
"""Components below which that is less, in proportion: more often something comes late then."""


@dataclass
class Timings:
    """Where the time of a run in windows went, and what came of it.

    Attributes
    ----------
    windows, repeats : int
        Windows that were kept, and that were run again.
    collisions : int
        Collisions in windows that were kept.
    wall : float
        Wall time in windows [s].
    save_state, run, merge, epochs, rolled_back : float
        Of it: keeping the state that a window begins with, running, adding up, going over into the next
        epoch, and windows that were run again.
    busy : float
        CPU time of all workers together in ``run`` [s].
    """

    windows: int = 0
    repeats: int = 0
    collisions: int = 0
    wall: float = 0.0
    save_state: float = 0.0
    run: float = 0.0
    merge: float = 0.0
    epochs: float = 0.0
    rolled_back: float = 0.0
    busy: float = 0.0


@dataclass
class Settings:
    """How long windows are, how far parts may be ahead of each other, and whether there must be any.

    Attributes
    ----------
    collisions : float or None
        Collisions a particle that a window should hold, or None for what was measured to be good.
    lookahead : float or None
        Widths of a bucket that a part may be ahead of another at a border, or None for what was measured to
        be good. It becomes half as much where a window is lost by it.
    least : float
        Collisions a particle below which a stretch is left to the plain cycle.
    compare : bool
        Whether the plain cycle is timed now and then, and goes on where it is faster.
    """

    collisions: float | None = None
    lookahead: float | None = None
    least: float = LEAST_PER_WINDOW
    compare: bool = True
