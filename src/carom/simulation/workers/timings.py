"""How a team of workers is set, and where its time goes."""

from __future__ import annotations

from dataclasses import dataclass

LEAST_PER_WINDOW = 0.1  # collisions for each particle below which a stretch is not worth a window

LOOKAHEAD = 8.0  # widths of a bucket, of a few cycles each, that a part may be ahead of another

MANY = 100_000
"""Components below which that is less, in proportion: more often something comes late then."""


@dataclass
class Timings:
    """Where the time of a run in windows went [s], and what came of it."""

    windows: int = 0  # kept
    repeats: int = 0  # run again
    collisions: int = 0  # in windows that were kept
    wall: float = 0.0  # in windows
    save_state: float = 0.0  # keeping what a window begins with
    run: float = 0.0
    merge: float = 0.0  # adding up
    epochs: float = 0.0  # going over into the next
    rolled_back: float = 0.0  # windows that were run again
    busy: float = 0.0  # CPU time of all workers in ``run``


@dataclass
class Settings:
    """How long windows are, how far parts may be ahead, and whether there must be any; None: as measured."""

    collisions: float | None = None  # a particle, in a window
    lookahead: float | None = None  # widths of a bucket at a border; halved where it loses a window
    least: float = LEAST_PER_WINDOW  # a particle, below which the plain cycle runs
    compare: bool = True  # time the plain cycle now and then
