"""Compression to a jammed packing: spheres that move and grow until they cannot (the paper's sec. 8).

Every contact of growing spheres adds energy. So the run is cut into stretches of a fixed number of
collisions. After each stretch the velocities are scaled back to kT = 1, momentum is set to zero, and the
pressure of the stretch decides how to go on.
"""

from __future__ import annotations

import json
import math
import time as clock
from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from carom import checks
from carom.errors import FileError, InputError
from carom.io import checkpoint
from carom.io.paths import writing
from carom.models.obstacles.named_walls import Walls
from carom.notebook import by_stage, watchable
from carom.scene import lattices
from carom.scene.overlaps import rounding
from carom.scene.scene import Scene
from carom.scene.species import Species
from carom.simulation.simulation import Simulation
from carom.studies.packings.packing import HISTORY, Packing, parted
from carom.studies.runs.folder import RunFolder
from carom.studies.signals import Interrupted, Stop, stoppable

FAST, SLOW = 0.02, 1e-3
"""Default rates: fast while spheres could still order, then slow enough to close the contacts."""

DENSE = 1e3
"""Reduced pressure at which the slow rate replaces the fast one."""

PRESSURE = 1e10
"""Default reduced pressure at which a compression ends."""

HEATING = 0.4
"""Growth rate times collisions per particle between two rescalings: the energy grows by about a quarter."""

LONGEST = 100.0
"""Collisions per particle between two rescalings, at most."""

PART = 50_000
"""Collisions between two checks for Ctrl-C; they take some 50 ms."""

POINT = 1e-6
"""Diameter of a point [final diameters]: the first collisions happen at much larger diameters."""

CHECKPOINT_EVERY = 10.0
"""Seconds between checkpoints."""

Progress = Callable[[str, float], object]


class Stage(NamedTuple):
    """Part of a compression.

    Attributes
    ----------
    rate : float
        Growth rate of the mean diameter over the thermal speed.
    until_pressure : float or None
        Reduced pressure at which the stage ends.
    """

    rate: float
    until_pressure: float | None


class PackingInterrupted(Interrupted):
    """A compression was stopped by Ctrl-C or SIGTERM.

    Attributes
    ----------
    packing : Packing
        The packing so far.
    """

    packing: Packing


class PackingFolder(RunFolder):
    """The folder of a compression, and the names of its files."""

    kind = "a packing"

    def __init__(self, path: Path):
        super().__init__(path)
        self.checkpoint = path / "compression.h5"

    def _files(self) -> list[Path]:
        names = (
            "packing.h5md",
            "packing.extxyz",
            "history.csv",
            "packing.png",
            "gaps.png",
            "compression.png",
        )
        return [self.summary, self.checkpoint, *(self.path / name for name in names)]

    def clear(self) -> None:
        """Remove an older compression from the folder."""
        with writing(self.path):
            for path in self._files():
                path.unlink(missing_ok=True)


def points(
    n: int | None = None,
    dimension: int = 3,
    *,
    counts: Sequence[int] | None = None,
    diameters: Sequence[float] = (1.0,),
    walls: Walls = False,
    seed: int | np.random.Generator = 0,
) -> Scene:
    """Return random points that will grow into spheres: the start of the paper's sec. 8.

    Parameters
    ----------
    n, dimension : int
        Number of points, and of dimensions.
    counts, diameters : sequences
        Number of points of each species, instead of n, and their approximate final diameters [length].
    walls : str, True or sequence of str
        Axes with walls, as in :class:`carom.Scene`.
    seed : int or numpy.random.Generator
        Source of randomness.

    Returns
    -------
    Scene
        Its diameters are ``POINT`` times those given. The given diameters would fill 0.64 / 2^(d - 3) of the
        cubic box, so that the final diameters are close to them.

    Raises
    ------
    InputError
        If an argument is out of range.
    """
    if counts is None:
        counts = [checks.integer(n, "n", low=2)]
    sizes = [checks.positive(s, "diameters") for s in diameters]
    d = checks.integer(dimension, "dimension", low=1, high=lattices.MOST_DIMENSIONS)
    fraction = min(0.64 / 2.0 ** (d - 3), 0.9)
    return Scene.random(
        n=n,
        species=[Species(count=c, diameter=POINT * s) for c, s in zip(counts, sizes, strict=True)],
        dimension=d,
        packing_fraction=fraction * POINT**d,
        walls=walls,
        seed=seed,
    )


@watchable("Packing", by_stage)
def pack(
    scene: Scene,
    *,
    rate: float | None = None,
    until_pressure: float | None = None,
    collisions: int | None = None,
    stages: Sequence[tuple[float, float | None]] | None = None,
    common: bool = False,
    seed: int = 0,
    neighbors: str = "auto",
    out: str | PathLike[str] | None = None,
    overwrite: bool = False,
    pictures: bool = True,
    progress: Progress | None = None,
) -> Packing:
    """Let spheres grow while they move, until they jam (Lubachevsky and Stillinger; the paper's sec. 8).

    Parameters
    ----------
    scene : Scene
        The start: :func:`points`, or spheres of any density, in a box of any kind.
    rate : float, optional
        Growth rate of the mean diameter over the thermal speed, gamma. By default it is 0.02 up to a reduced
        pressure of 1e3, then 1e-3.
    until_pressure : float, optional
        Reduced pressure PV / NkT to reach; 1e10 if neither it nor a number of collisions is given. Beyond
        1e13 gaps are lost in rounding.
    collisions : int, optional
        Number of pair collisions after which the compression ends, at any pressure.
    stages : sequence of (rate, until_pressure), optional
        Stages instead of one rate and pressure, e.g. fast, then slow. The last pressure may be None.
    common : bool
        Whether all diameters grow at one rate, instead of in proportion to themselves.
    seed : int
        Seed of the velocities, where the scene has none.
    neighbors : {"auto", "lists", "sectors"}
        As in :class:`carom.Simulation`.
    out : path, optional
        Folder for results and checkpoints; :func:`resume_packing` continues from there.
    overwrite : bool
        Whether a packing that the folder holds may be replaced.
    pictures : bool
        Whether to draw pictures in the folder.
    progress : callable, optional
        Called as ``progress("Packing", fraction)``; True shows a bar.

    Returns
    -------
    Packing
        The final state, and the history of the compression.

    Raises
    ------
    InputError
        If an argument is out of range, nothing moves, or the spheres become as wide as the box.
    FileError
        If the folder holds a packing and ``overwrite`` is false, or it cannot be written.
    PackingInterrupted
        After Ctrl-C; its ``packing`` is the packing so far.

    Notes
    -----
    Between two rescalings there are ``HEATING / rate`` collisions per particle, at most ``LONGEST``. Z comes
    from the virial of each stretch, with the integral of kT over its time. An increase of Z by a factor e
    takes some ``3.4 / rate`` collisions per particle (d = 3). At the rate 1e-3, growth from Z = 1e3 to 1e12
    takes 70 000.

    Examples
    --------
    >>> packing = pack(points(30, dimension=2, seed=1), rate=0.1, until_pressure=1e6, seed=1)
    >>> packing.note
    'Z = PV/NkT = 1e+06 reached'
    """
    plan = _stages(rate, until_pressure, collisions, stages)
    limit = None if collisions is None else checks.integer(collisions, "collisions", low=1)
    if scene.n < 2:
        raise InputError("A packing needs at least two components, found one.")
    if getattr(scene.motion, "curved", False):
        raise InputError("A packing is one of a box; for caps on a sphere there is spherical_code().")
    unit = np.full(scene.n, 1.0) if common else scene.diameters / scene.diameters.mean()
    unit = unit / math.sqrt(scene.mass)
    compression = _Compression(plan, limit, unit, checks.integer(seed, "seed", low=0), pictures, progress)
    sim = Simulation(scene, seed=seed, neighbors=neighbors, growth=plan[0].rate * unit)
    if out is None:
        with stoppable() as stop:
            return compression.run(sim, None, stop)
    folder = PackingFolder(Path(out))
    folder.check_free(overwrite)
    folder.make()
    with folder.owned(), stoppable() as stop:
        folder.sweep()
        folder.clear()
        return compression.run(sim, folder, stop)


@watchable("Packing", by_stage)
def resume_packing(out: str | PathLike[str], *, progress: Progress | None = None) -> Packing:
    """Continue the compression in a folder; the result is bit-identical to an uninterrupted one.

    Parameters
    ----------
    out : path
        The folder of the compression.
    progress : callable, optional
        As in :func:`pack`.

    Raises
    ------
    FileError
        If the folder holds no compression, or its checkpoint is damaged or of another version of Carom.
    PackingInterrupted
        As in :func:`pack`.
    """
    folder = PackingFolder(Path(out))
    if not holds_packing(out):
        raise FileError(f"{out} holds no packing of Carom; start one with `carom pack --out {out}`.")
    _, attributes = checkpoint.load(folder.checkpoint)
    with folder.owned(), stoppable() as stop:
        folder.sweep()
        try:
            compression = _Compression.restored(json.loads(attributes["extra"]), progress)
        except (KeyError, TypeError, ValueError) as error:
            raise FileError(f"{folder.checkpoint} is not the checkpoint of a packing: {error}.") from None
        return compression.run(Simulation.load(folder.checkpoint), folder, stop)


def holds_packing(out: str | PathLike[str]) -> bool:
    """Return whether the folder ``out`` holds a compression that can be continued.

    Raises
    ------
    FileError
        If it holds a run as well: then nobody can know which of them is meant.
    """
    folder = PackingFolder(Path(out))
    there = folder.checkpoint.is_file()
    if there and (other := RunFolder(folder.path).checkpoint).is_file():
        raise FileError(
            f"{out} holds a run ({other.name}) and a packing ({folder.checkpoint.name}), so it cannot be "
            "resumed; move the files of one of them to another folder."
        )
    return there


def _stages(rate: Any, until: Any, collisions: Any, stages: Any) -> tuple[Stage, ...]:
    """Return the stages that the arguments of :func:`pack` describe."""
    if stages is None:
        if until is None and collisions is None:
            until = PRESSURE
        stages = [(FAST, DENSE), (SLOW, until)] if rate is None else [(rate, until)]
        if rate is None and until is not None and until <= DENSE:
            stages = [(FAST, until)]
    elif rate is not None or until is not None:
        raise InputError("Give stages, or rate and until_pressure, not both.")
    result = []
    for each in stages:
        if not isinstance(each, Sequence) or len(each) != 2:
            raise InputError(f"A stage is (rate, until_pressure), found {checks.describe(each)}.")
        speed = checks.number(each[0], "rate", low=1.0 / checks.MAGNITUDE, high=10.0)
        last = None if each[1] is None else checks.number(each[1], "until_pressure", low=1.0)
        result.append(Stage(speed, last))
    if not result:
        raise InputError("stages must hold at least one (rate, until_pressure).")
    if any(stage.until_pressure is None for stage in result[:-1]):
        raise InputError("Only the last stage can do without a pressure at which it ends.")
    if result[-1].until_pressure is None and collisions is None:
        raise InputError("The last stage needs a pressure at which it ends, or give collisions.")
    return tuple(result)


class _Compression:
    """A compression under way.

    Attributes
    ----------
    plan, limit, seed, pictures
        The arguments of :func:`pack`.
    unit : (n,) array
        Growth rate of each diameter at a ``rate`` of 1 [length / time].
    stage : int
        Index of the present stage.
    history : list
        Rows of HISTORY.
    left : int
        Collisions left in the present stretch.
    virial, duration, kT_time : float
        Virial, time and integral of kT over time, of the present stretch so far.
    note : str
        Why the compression ended; empty before.
    """

    def __init__(
        self,
        plan: tuple[Stage, ...],
        limit: int | None,
        unit: np.ndarray,
        seed: int,
        pictures: bool,
        progress: Progress | None,
    ):
        self.plan, self.limit, self.unit = plan, limit, unit
        self.seed, self.pictures, self.progress = seed, pictures, progress
        self.stage = 0
        self.history: list[tuple[int, float, float, float]] = []
        self.left = 0
        self.virial = self.duration = self.kT_time = 0.0
        self.note = ""
        self.sim: Simulation

    @classmethod
    def restored(cls, notes: dict[str, Any], progress: Progress | None) -> _Compression:
        """Return the compression that the notes of a checkpoint describe."""
        plan = tuple(Stage(*stage) for stage in notes["plan"])
        self = cls(plan, notes["limit"], np.array(notes["unit"]), notes["seed"], notes["pictures"], progress)
        self.history = [tuple(row) for row in notes["history"]]
        for name in ("stage", "left", "virial", "duration", "kT_time", "note"):
            setattr(self, name, notes[name])
        return self

    def _save(self, folder: PackingFolder) -> None:
        self.sim.save(
            folder.checkpoint,
            plan=self.plan,
            limit=self.limit,
            unit=self.unit.tolist(),
            seed=self.seed,
            pictures=self.pictures,
            history=self.history,
            stage=self.stage,
            left=self.left,
            virial=self.virial,
            duration=self.duration,
            kT_time=self.kT_time,
            note=self.note,
        )

    def run(self, sim: Simulation, folder: PackingFolder | None, stop: Stop) -> Packing:
        """Run to the end, and write the results to the folder if there is one."""
        self.sim = sim
        self._report()
        if not self.history and not self.left:
            sim.rescale(1.0)
            self._begin()
        due = -math.inf
        stop.deferred = True
        while not self.note:
            if folder is not None and (stop.asked or clock.perf_counter() >= due):
                self._save(folder)
                due = clock.perf_counter() + CHECKPOINT_EVERY
            if stop.asked:
                raise self._interrupted(folder)
            self._part()
        packing = self._packing(self.note)
        if folder is not None:
            self._save(folder)
            stop.deferred = False
            packing.save(folder.path, pictures=self.pictures)
        return packing

    def _interrupted(self, folder: PackingFolder | None) -> PackingInterrupted:
        text = "Stopped." if folder is None else f"Stopped; `carom resume {folder.path}` goes on."
        interrupted = PackingInterrupted(text)
        interrupted.packing = self._packing("stopped")
        return interrupted

    def _begin(self) -> None:
        """Begin a stretch."""
        n, rate = self.sim.scene.n, self.plan[self.stage].rate
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
        sim, stage = self.sim, self.plan[self.stage]
        pressure = math.inf
        if self.duration > 0.0:
            # In a very short stretch rounding hides the integral; then the final temperature is taken.
            heat = self.kT_time if self.kT_time > 0.0 else sim.kT * self.duration
            pressure = 1.0 + self.virial / (sim.scene.dimension * sim.scene.n * heat)
        self.history.append((sim.collisions, sim.packing_fraction, pressure, stage.rate))
        self._judge(pressure)
        sim.rescale(1.0, growth=self.plan[self.stage].rate * self.unit)
        self._begin()
        self._report()

    def _judge(self, pressure: float) -> None:
        """Decide whether the stage, or the whole compression, is over."""
        sim = self.sim
        scene, diameters = sim.scene, sim.diameters
        # A gap is about a diameter over the pressure.
        finest = rounding(np.asarray(scene.box)) / float(diameters.min())
        until = self.plan[self.stage].until_pressure
        while until is not None and pressure >= until and not self.note:
            self.stage += 1
            if self.stage == len(self.plan):
                self.stage -= 1
                self.note = f"Z = PV/NkT = {until:g} reached"
            until = self.plan[self.stage].until_pressure
        if self.note:
            return
        if self.limit is not None and sim.collisions >= self.limit:
            self.note = f"{self.limit} collisions reached"
        elif pressure * finest >= 1.0:
            self.note = (
                f"gaps are down to the rounding of coordinates at Z = PV/NkT = {pressure:.3g}, "
                "which grows no further"
            )

    def _report(self) -> None:
        if self.progress is None:
            return
        done = 0.0
        if self.history:
            collisions, _, pressure, _ = self.history[-1]
            until = self.plan[-1].until_pressure
            if until is not None and until > 1.0 and pressure > 1.0:
                done = math.log(pressure) / math.log(until)
            if self.limit is not None:
                done = max(done, collisions / self.limit)
        self.progress("Packing", min(done, 1.0))

    def _packing(self, note: str) -> Packing:
        scene = self.sim.scene
        frame, shrunk = parted(self.sim.frame(), scene.obstacles)
        return Packing(
            frame=frame,
            history=np.array(self.history, dtype=HISTORY),
            note=note,
            seed=self.seed,
            shrunk=shrunk,
            obstacles=scene.obstacles,
        )
