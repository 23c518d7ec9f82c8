"""The measured stretch of a run, in segments of equal time, of which a whole number lies between two frames.

One loop then serves the pressure, with sums over each segment, and the trajectory. Segments have a length of
12 binary digits, begin at its multiples, and run in parts of 1/1024: all these times are exact in a double,
so that a run interrupted between any two parts resumes bit-identically.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import Any

from carom.block import Block, EnergySample, VolumeSums, weighted_sum
from carom.observables.analysis.momentum_balance import weighted_momenta
from carom.observables.analysis.precision import FLOOR
from carom.simulation.measuring import readings, stretches
from carom.simulation.moves.barostat import volume_sums
from carom.simulation.simulation import Simulation

SEGMENTS = 1024
"""Least number of segments of a run: ten times as many as an error bar needs, to resolve correlations."""

PILOT = FLOOR
"""Segments of the pilot that predicts the length of a run to a relative error."""

PARTS = 1024
"""Parts of a segment: with 1024 segments of 1024 parts, each part is short even in a run of days."""

DIGITS = 12
"""Binary digits of a segment's length."""


@dataclass
class Stretch:
    """The state of a run that a checkpoint keeps in addition to the simulation."""

    frames: int  # of a run of given length
    per_frame: int  # segments per frame
    segments: int  # to measure, by present knowledge
    pilot: bool = False  # whether the segments are those of the pilot, which has no frames
    step: float = 0.0  # duration of a segment [time]
    part: int = 0  # finished parts of the present segment
    marks: list[Any] = field(default_factory=list)
    """At the beginning of every segment: collisions, virial and integral of kT so far (None where kT is
    constant), and potential energy and kT now (None where there is no potential energy). With walls or
    obstacles also the impulse on each so far, the weighted momentum of each, and the energy that each
    gave."""
    rounds: list[Any] = field(default_factory=list)
    """Beginnings of rounds that bring pairs on steps to a temperature (``measuring.equilibration``)."""
    temperatures: list[Any] = field(default_factory=list)
    """Of species at the end of every segment, if their masses differ."""
    layers: list[Any] = field(default_factory=list)
    """Sums over layers along a field (``carom.observables.analysis.layers``), at the same times."""
    volumes: list[Any] = field(default_factory=list)
    """Sums under a barostat (:class:`carom.block.VolumeSums`) at the beginning of every segment."""
    overlaps: list[Any] = field(default_factory=list)
    """Time of a frame, and its deepest overlap, of all that were looked at and have one."""
    equilibrated: tuple[int, float] | None = None  # collisions and time of the equilibration, once it is over
    seconds: float = 0.0  # spent, in all sessions
    engine_seconds: float = 0.0  # in the engine since the equilibration

    @classmethod
    def of(cls, frames: int) -> Stretch:
        """Return a stretch with so many frames, before any measurement."""
        per_frame = math.ceil(SEGMENTS / frames)
        return cls(frames, per_frame, per_frame * frames)

    def begin(self, sim: Simulation, segments: int, duration: float) -> None:
        """Run on to the beginning of a stretch; its segments depend only on the present state."""
        self.segments, self.step = segments, _rounded(duration / segments)
        # Two segments further is later than the present, whatever its rounding.
        first = math.floor(sim.time / self.step) + 2
        for _ in sim.sample(times=[first * self.step]):
            self.marks = [_sums(sim)]
            self.temperatures.clear()
            self.layers.clear()
            self.volumes.clear()
            self._mark_volume(sim)

    def mark(self, sim: Simulation) -> None:
        """End a segment."""
        self.part = 0
        self.marks.append(_sums(sim))
        self._mark_volume(sim)

    def _mark_volume(self, sim: Simulation) -> None:
        """Keep the sums under a barostat, if there is one."""
        sums = volume_sums(sim._state)
        if sums is not None:
            self.volumes.append(sums)

    @property
    def measured(self) -> int:
        """Segments measured so far."""
        return len(self.marks) - 1

    @property
    def written(self) -> int:
        """Number of frames written up to the last mark."""
        return 0 if self.pilot else max(self.measured, 0) // self.per_frame

    def energy_drift(self, sim: Simulation) -> float:
        """Return the change of the energy from the first mark to the last, over the kinetic one."""
        half = 0.5 * sim.degrees_of_freedom
        (first, kT), (last, later) = self.marks[0][3], self.marks[-1][3]
        return abs(last + half * later - first - half * kT) / (half * kT)

    def blocks(self, sim: Simulation) -> list[Block]:
        """Return the sums over each segment of a simulation."""
        blocks = []
        for before, after in zip(self.marks, self.marks[1:], strict=False):
            walls = [b - a for a, b in zip(before[4:], after[4:], strict=True)]
            third = len(walls) // 3
            block = Block(
                self.step,
                int(after[0] - before[0]),
                after[1] - before[1],
                tuple(walls[:third]),
                tuple(walls[third : 2 * third]),
                None if after[2] is None else after[2] - before[2],
                works=tuple(walls[2 * third :]),
            )
            first, last = (None if mark[3] is None else EnergySample(*mark[3]) for mark in (before, after))
            blocks.append(
                block._replace(energy=readings.mean_energy(first, last, block, sim.degrees_of_freedom))
            )
        for k, (before, after) in enumerate(itertools.pairwise(self.volumes)):
            blocks[k] = blocks[k]._replace(
                volumes=weighted_sum(VolumeSums(*after), VolumeSums(*before), 1, -1)
            )
        return blocks


def _sums(sim: Simulation) -> tuple[Any, ...]:
    """Return sums since the start; their differences do not depend on interruptions of a segment."""
    tally, scene = stretches.tally(sim), sim.scene
    sums = int(tally.collisions), float(tally.virial), tally.kT_time, readings.energy_now(sim._state)
    if not (scene.walls or scene.obstacles):
        return sums
    found = sim.obstacles
    record_impulse, given = (each.impulse for each in found), (each.work for each in found)
    return *sums, *record_impulse, *weighted_momenta(sim.frame(), scene), *given


def _rounded(duration: float) -> float:
    """Return the nearest number of ``DIGITS`` binary digits."""
    mantissa, exponent = math.frexp(duration)
    return math.ldexp(round(math.ldexp(mantissa, DIGITS)), exponent - DIGITS)
