"""The measured stretch of a run, in segments of equal time: what was counted, and how far it has come.

There is a whole number of segments to a frame. One loop then serves the pressure, which needs the sums over
each segment, and the trajectory, which needs the frames between them.

Times are chosen so that a resumed run sees the same bits: the length of a segment has 12 binary digits,
segments begin at its multiples, and are run in parts of 1/1024. All of these times are exact in a double, so
it does not matter where a run was cut.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from carom.block import Block
from carom.observables.momentum_balance import weighted_momenta
from carom.observables.precision import FLOOR
from carom.simulation.simulation import Simulation

SEGMENTS = 1024
"""Segments of a run, at least: ten times what an error bar needs, so that correlations are seen."""

PILOT = FLOOR
"""Segments of the pilot that finds out how long a run to a relative error takes."""

PARTS = 1024
"""Parts of a segment: 1024 segments of 1024 parts leave none that takes long in a run of days."""

DIGITS = 12
"""Binary digits of a segment's length."""


@dataclass
class Stretch:
    """All that a checkpoint keeps of a run beside the simulation.

    Attributes
    ----------
    frames, per_frame, segments : int
        Frames of a run whose length is given; segments to a frame; segments to measure, as far as is known
        yet.
    pilot : bool
        Whether the segments are those of the pilot, which has no frames.
    step : float
        A segment lasts so long [time].
    part : int
        Parts done of the present segment.
    marks : list of (int, float, ...)
        Collisions and virial so far at the beginning of every segment reached; with walls or obstacles also
        what each took up so far, and the weighted momentum that belongs to each then.
    temperatures : list of tuple of float
        Temperatures of species at the end of every segment, if their masses differ.
    equilibrated : tuple of int and float, or None
        Collisions and time of the equilibration, once it is over.
    seconds, engine_seconds : float
        Seconds spent, in all sessions; those in the engine since the equilibration.
    """

    frames: int
    per_frame: int
    segments: int
    pilot: bool = False
    step: float = 0.0
    part: int = 0
    marks: list[Any] = field(default_factory=list)
    temperatures: list[Any] = field(default_factory=list)
    equilibrated: tuple[int, float] | None = None
    seconds: float = 0.0
    engine_seconds: float = 0.0

    @classmethod
    def of(cls, frames: int) -> Stretch:
        """Return a stretch with so many frames, of which nothing is measured yet."""
        per_frame = math.ceil(SEGMENTS / frames)
        return cls(frames, per_frame, per_frame * frames)

    def begin(self, sim: Simulation, segments: int, duration: float) -> None:
        """Run on to the beginning of a stretch; its segments depend on nothing but the state so far."""
        self.segments, self.step = segments, _rounded(duration / segments)
        # Two segments further lies ahead, whatever the rounding of the present time.
        first = math.floor(sim.time / self.step) + 2
        for _ in sim.sample(times=[first * self.step]):
            self.marks = [_sums(sim)]
            self.temperatures.clear()

    def mark(self, sim: Simulation) -> None:
        """Note that a segment is over."""
        self.part = 0
        self.marks.append(_sums(sim))

    @property
    def measured(self) -> int:
        """Segments measured so far."""
        return len(self.marks) - 1

    @property
    def written(self) -> int:
        """Frames that belong to the marks."""
        return 0 if self.pilot else max(self.measured, 0) // self.per_frame

    def blocks(self) -> list[Block]:
        """Return what each segment added up to."""
        blocks = []
        for before, after in zip(self.marks, self.marks[1:], strict=False):
            walls = [b - a for a, b in zip(before[3:], after[3:], strict=True)]
            half = len(walls) // 2
            blocks.append(
                Block(
                    self.step,
                    int(after[0] - before[0]),
                    after[1] - before[1],
                    tuple(walls[:half]),
                    tuple(walls[half:]),
                    None if after[2] is None else after[2] - before[2],
                )
            )
        return blocks


def _sums(sim: Simulation) -> tuple[Any, ...]:
    """Return sums since the start: differences of them do not depend on where a segment was cut."""
    tally, scene = sim.tally, sim.scene
    sums = int(tally.collisions), float(tally.virial), tally.kT_time
    if not (scene.walls or scene.obstacles):
        return sums
    taken_up = (impacts.impulse for impacts in sim.obstacles)
    return *sums, *taken_up, *weighted_momenta(sim.frame(), scene)


def _rounded(duration: float) -> float:
    """Return the nearest number of few binary digits."""
    mantissa, exponent = math.frexp(duration)
    return math.ldexp(round(math.ldexp(mantissa, DIGITS)), exponent - DIGITS)
