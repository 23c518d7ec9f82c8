"""Compression to a jammed packing: spheres that move and grow until they cannot (the paper's sec. 9).

Every contact of growing spheres adds energy. So after each stretch of a fixed number of collisions velocities
are scaled back to kT = 1, momentum is set to zero, and the pressure decides how to go on.
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.geometry.overlaps import rounding
from carom.models.obstacles.named_walls import Walls
from carom.scene import lattices
from carom.scene.species import Species, checked_species
from carom.simulation.moves.growth import Scene
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.job import Job, Look
from carom.studies.packings.packing import HISTORY, Packing, parted
from carom.studies.result_folders import ResultFolder

if TYPE_CHECKING:
    from carom.studies.packings.spec import PackSpec

FAST, SLOW = 0.02, 1e-3
"""Default rates: fast while spheres could still order, then slow enough to close the contacts."""

DENSE = 1e3
"""Z = PV / NkT at which the slow rate replaces the fast one."""

PRESSURE = 1e10
"""Default Z at which a compression ends."""

HEATING = 0.4
"""Growth rate times collisions per particle between two rescalings: the energy grows by about a quarter."""

LONGEST = 100.0
"""Collisions per particle between two rescalings, at most."""

PER_FACTOR = {2: 2.3, 3: 3.4}
"""Growth rate times collisions per particle in which Z grows by a factor e, by dimension."""

N = 1000
"""Default number of points."""

PART = 50_000
"""Collisions between two checks for Ctrl-C; they take some 50 ms."""

POINT = 1e-6
"""Diameter of a point [final diameters]: the first collisions happen at much larger diameters."""

Progress = Callable[[float, str], object]


class Stage(NamedTuple):
    """Part of a compression."""

    rate: float  # growth rate of the mean diameter over the thermal speed
    until_Z: float | None  # Z = PV / NkT at which the stage ends


class PackingFolder(ResultFolder):
    """The folder of a compression."""

    kind = "a packing"
    files = (
        "summary.json", "compression.h5", "packing.h5md", "packing.extxyz", "history.csv", "packing.png",
        "gaps.png", "compression.png",
    )  # fmt: skip


def points(
    n: int | None,
    dimension: int = 3,
    *,
    species: Sequence[Species] | None = None,
    walls: Walls = False,
    packing_fraction: float | None = None,
    seed: int | np.random.Generator = 1,
) -> Scene:
    """Return random points that will grow into spheres: the start of the paper's sec. 9.

    Diameters of ``species`` are about the final ones [length]; points have ``POINT`` of them by default.
    """
    d = checks.integer(dimension, "dimension", low=1, high=lattices.MOST_DIMENSIONS)
    if species is None:
        species = [Species(count=checks.integer(n, "n", low=2))]
        n = None
    scale, fraction = 1.0, packing_fraction
    if fraction is None:
        scale = POINT
        fraction = min(0.64 / 2.0 ** (d - 3), 0.9) * POINT**d
    return Scene.random(
        n=n,
        species=[
            dataclasses.replace(each, diameter=scale * each.diameter) for each in checked_species(species)
        ],
        dimension=d,
        packing_fraction=fraction,
        walls=walls,
        seed=seed,
    )


def _digest(scene: Scene) -> str:
    """Return a digest of the particles, the box and the models of a scene."""
    models = scene.interaction, scene.motion, scene.impact, scene.drive
    words = repr((scene.box, scene.periodic, scene.obstacles, *models))
    arrays = scene.positions, scene.diameters, scene.masses, scene.velocities
    given = b"".join(each.tobytes() for each in arrays if each is not None)
    return hashlib.sha256(words.encode() + given).hexdigest()[:8]


def stages_of(rate: Any, until: Any, collisions: Any, stages: Any) -> tuple[Stage, ...]:
    """Return the stages that the arguments of :func:`pack` describe."""
    if stages is None:
        if until is None and collisions is None:
            until = PRESSURE
        stages = [(FAST, DENSE), (SLOW, until)] if rate is None else [(rate, until)]
        if rate is None and until is not None and until <= DENSE:
            stages = [(FAST, until)]
    elif rate is not None or until is not None:
        raise InputError("Give stages, or rate and until_Z, not both.")
    if not isinstance(stages, Sequence):
        raise InputError(f"stages must be a list of (rate, until_Z), found {checks.describe(stages)}.")
    result = []
    for each in stages:
        if not isinstance(each, Sequence) or len(each) != 2:
            raise InputError(f"A stage is (rate, until_Z), found {checks.describe(each)}.")
        speed = checks.number(each[0], "rate", low=1.0 / checks.MAGNITUDE, high=10.0)
        last = None if each[1] is None else checks.number(each[1], "until_Z", low=1.0)
        result.append(Stage(speed, last))
    if not result:
        raise InputError("stages must hold at least one (rate, until_Z).")
    if any(stage.until_Z is None for stage in result[:-1]):
        raise InputError("Only the last stage can do without a Z at which it ends.")
    if result[-1].until_Z is None and collisions is None:
        raise InputError("The last stage needs a Z at which it ends, or give collisions.")
    return tuple(result)


@dataclasses.dataclass
class Compression(Job):
    """A compression under way; plan, limit, seed and pictures are the arguments of :func:`pack`."""

    what: ClassVar[str] = "a packing"
    stage: ClassVar[str] = "Packing"

    plan: tuple[Stage, ...] = ()
    limit: int | None = None
    unit: Any = None  # growth rates of the diameters at a rate of 1, (n,) [length / time]
    seed: int = 1
    pictures: bool = False
    start: str = ""  # digest of the scene that it began from
    at: int = 0  # index of the present stage
    history: list[tuple[int, float, float, float]] = dataclasses.field(default_factory=list)
    """Rows of ``HISTORY``."""
    left: int = 0  # collisions left in the present stretch
    virial: float = 0.0  # of the present stretch so far
    duration: float = 0.0
    kT_time: float = 0.0  # integral of kT over time
    note: str = ""  # why the compression ended; empty before

    def __post_init__(self) -> None:
        self.plan = tuple(Stage(*each) for each in self.plan)
        self.history = [tuple(row) for row in self.history]  # type: ignore[misc]

    @classmethod
    def begun(cls, scene: Scene, asked: PackSpec) -> Self:
        """Return the compression of a scene at its start."""
        plan, seed, tuning = asked.plan, asked.seed, Tuning(neighbors=asked.neighbors)
        unit = np.full(scene.n, 1.0) if asked.common else scene.diameters / scene.diameters.mean()
        unit = unit / math.sqrt(scene.mass)
        sim = Simulation(scene, seed=seed, tuning=tuning, growth=plan[0].rate * unit)
        sim.rescale(1.0)
        return cls({}, sim, plan, asked.collisions, unit, seed, asked.pictures, _digest(scene))

    def settings(self) -> dict[str, Any]:
        """Return what decides every bit of the result."""
        return {
            "stages (rate, until_Z)": [tuple(stage) for stage in self.plan],
            "collisions": self.limit,
            "seed": self.seed,
            "the start": self.start,
            "rates of growth": hashlib.sha256(self.unit.tobytes()).hexdigest()[:8],
        }

    def step(self, look: Look) -> bool:
        """Run on for a part of a second; return whether it goes on."""
        if not self.history and not self.left:
            self._begin()
        self._part()
        return not self.note

    def finish(self, look: Look) -> Any:
        """Go on to the end, and return the result."""
        return self.result() if self.note else super().finish(look)

    def _begin(self) -> None:
        """Begin a stretch."""
        n, rate = self.sim.scene.n, self.plan[self.at].rate
        self.left = max(round(0.5 * n * min(max(HEATING / rate, 1.0), LONGEST)), 1)
        if self.limit is not None:
            self.left = min(self.left, self.limit - self.sim.collisions)
        self.virial = self.duration = self.kT_time = 0.0

    def _part(self) -> None:
        """Run on for at most PART collisions, and end the stretch if it is over."""
        block = self.sim.run(collisions=min(self.left, PART))
        self.left -= block.collisions
        self.virial += block.virial
        self.duration += block.duration
        assert block.kT_time is not None
        self.kT_time += block.kT_time
        if self.left:
            return
        sim, stage = self.sim, self.plan[self.at]
        pressure = math.inf
        if self.duration > 0.0:
            # In a very short stretch rounding hides the integral; then the final temperature is taken.
            heat = self.kT_time if self.kT_time > 0.0 else sim.kT * self.duration
            pressure = 1.0 + self.virial / (sim.scene.dimension * sim.scene.n * heat)
        self.history.append((sim.collisions, sim.packing_fraction, pressure, stage.rate))
        self._judge(pressure)
        sim.rescale(1.0, growth=self.plan[self.at].rate * self.unit)
        self._begin()

    def _judge(self, pressure: float) -> None:
        """Decide whether the stage, or the whole compression, is over."""
        sim = self.sim
        scene, diameters = sim.scene, sim.diameters
        # A gap is about a diameter over the pressure.
        finest = rounding(np.asarray(scene.box)) / float(diameters.min())
        until = self.plan[self.at].until_Z
        while until is not None and pressure >= until and not self.note:
            self.at += 1
            if self.at == len(self.plan):
                self.at -= 1
                self.note = f"Z = PV/NkT = {until:g} reached"
            until = self.plan[self.at].until_Z
        if self.note:
            return
        if self.limit is not None and sim.collisions >= self.limit:
            self.note = f"{self.limit} collisions reached"
        elif pressure * finest >= 1.0:
            self.note = (
                f"gaps are down to the rounding of coordinates at Z = PV/NkT = {pressure:.3g}, "
                "which grows no further"
            )

    @property
    def fraction(self) -> float:
        """Finished fraction, by the logarithm of Z or the number of collisions."""
        done = 0.0
        if self.history:
            collisions, _, pressure, _ = self.history[-1]
            until = self.plan[-1].until_Z
            if until is not None and until > 1.0 and pressure > 1.0:
                done = math.log(pressure) / math.log(until)
            if self.limit is not None:
                done = max(done, collisions / self.limit)
        return done

    def result(self) -> Any:
        """Return the packing."""
        return self.packing()

    def packing(self, note: str = "") -> Packing:
        """Return the packing so far; ``note`` says why it ended, if the compression does not."""
        scene = self.sim.scene
        frame, shrunk = parted(self.sim.frame(), scene.obstacles)
        return Packing(
            frame=frame,
            history=np.array(self.history, dtype=HISTORY),
            note=self.note or note,
            seed=self.seed,
            shrunk=shrunk,
            obstacles=scene.obstacles,
        )
