"""Compression to a jammed packing: spheres that move and grow until they cannot (the paper's sec. 8).

Every contact of growing spheres adds energy. So the run is cut into stretches of a fixed number of
collisions. After each stretch the velocities are scaled back to kT = 1, momentum is set to zero, and the
pressure of the stretch decides how to go on.
"""

from __future__ import annotations

import dataclasses
import hashlib
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
from carom.models.obstacles.named_walls import Walls
from carom.notebook import by_stage, watchable
from carom.paths import writing
from carom.scene import lattices
from carom.scene.overlaps import rounding
from carom.scene.scene import Scene
from carom.scene.species import Species, checked_species
from carom.scene_file.scene_file import SceneFile
from carom.simulation.checkpoint import save
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.arguments import refuse_unknown
from carom.studies.packings.packing import HISTORY, Packing, parted
from carom.studies.runs.folder import RunFolder
from carom.studies.signals import Interrupted, stoppable

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

N = 1000
"""Default number of points."""

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
    until_Z : float or None
        Z = PV / NkT at which the stage ends.
    """

    rate: float
    until_Z: float | None


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
    n: int | None,
    dimension: int = 3,
    *,
    species: Sequence[Species] | None = None,
    walls: Walls = False,
    packing_fraction: float | None = None,
    seed: int | np.random.Generator = 1,
) -> Scene:
    """Return random points that will grow into spheres: the start of the paper's sec. 8.

    Parameters
    ----------
    n, dimension : int
        Number of points, and of dimensions; n may be None where each species has a count.
    species : sequence of Species, optional
        Species of a mixture; their diameters are approximately the final ones [length].
    walls : str, True or sequence of str
        Axes with walls, as in :class:`carom.Scene`.
    packing_fraction : float, optional
        Of the start; by default that of diameters ``POINT`` times the final ones, and the final ones would
        fill 0.64 / 2^(d - 3) of the cubic box.
    seed : int or numpy.random.Generator
        Source of randomness.
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


@watchable("Packing", by_stage)
def pack(
    start: int | Scene | str | PathLike[str] | None = None,
    *,
    dimension: int | None = None,
    species: Sequence[Species] | None = None,
    walls: bool | None = None,
    packing_fraction: float | None = None,
    rate: float | None = None,
    until_Z: float | None = None,
    collisions: int | None = None,
    stages: Sequence[tuple[float, float | None]] | None = None,
    common: bool = False,
    seed: int = 1,
    neighbors: str = "auto",
    out: str | PathLike[str] | None = None,
    overwrite: bool = False,
    resume: bool = False,
    pictures: bool = True,
    progress: Progress | None = None,
    **others: Any,
) -> Packing:
    """Let particles grow while they move, until they jam (Lubachevsky and Stillinger; the paper's sec. 8).

    Parameters
    ----------
    start : int, Scene or path
        Number of random points in a cubic box; 1000 if neither it nor species with counts are given. Or the
        scene to start from, of any density and in a box of any kind; or its scene file (TOML).
    dimension : int
        d of the points; 3 if left out.
    species : sequence of :class:`carom.Species`, optional
        Species of the points, each with a ``count`` or a ``fraction``; their diameters are approximately the
        final ones [length].
    walls : bool
        Whether the box of the points has hard walls instead of periodic boundaries.
    packing_fraction : float, optional
        Packing fraction of the start, instead of points.
    rate : float, optional
        Growth rate of the mean diameter over the thermal speed, gamma. By default it is 0.02 up to Z = 1e3,
        then 1e-3.
    until_Z : float, optional
        Z = PV / NkT to reach; 1e10 if neither it nor a number of collisions is given. Beyond 1e13 gaps are
        lost in rounding.
    collisions : int, optional
        Number of pair collisions after which the compression ends, at any Z.
    stages : sequence of (rate, until_Z), optional
        Stages instead of one rate and Z, e.g. fast, then slow. The last Z may be None.
    common : bool
        Whether all diameters grow at one rate, instead of in proportion to themselves.
    seed : int
        Seed of the points, and of the velocities where the scene has none.
    neighbors : {"auto", "lists", "sectors"}
        As in :class:`carom.Simulation`.
    out : path, optional
        Folder for results and checkpoints; :func:`carom.resume` continues from there.
    overwrite : bool
        Whether a packing that the folder holds may be replaced.
    resume : bool
        Whether to go on with the packing that the folder holds, if it is this one.
    pictures : bool
        Whether to draw pictures in the folder.
    progress : callable, optional
        Called as ``progress("Packing", fraction)``; True shows a bar.
    **others
        None: any other argument is an error that names the right one.

    Returns
    -------
    Packing
        The final state, and the history of the compression.

    Raises
    ------
    InputError
        If an argument is unknown or out of range, nothing moves, the particles become as wide as the box, or
        the folder holds another packing than is to be resumed.
    FileError
        If the folder holds a packing and ``overwrite`` and ``resume`` are false, or it cannot be written.
    Interrupted
        After Ctrl-C; its ``so_far`` is the packing until then.

    Notes
    -----
    Between two rescalings there are ``HEATING / rate`` collisions per particle, at most ``LONGEST``. Z comes
    from the virial of each stretch, with the integral of kT over its time. An increase of Z by a factor e
    takes some ``3.4 / rate`` collisions per particle (d = 3). At the rate 1e-3, growth from Z = 1e3 to 1e12
    takes 70 000.

    Examples
    --------
    >>> import carom
    >>> packing = carom.pack(30, dimension=2, rate=0.1, until_Z=1e6)
    >>> packing.note
    'Z = PV/NkT = 1e+06 reached'
    """
    if "seeds" in others:
        raise InputError("pack() makes one packing; packings(..., seeds=8) makes several.")
    refuse_unknown("pack()", others, _ARGUMENTS)
    plan = stages_of(rate, until_Z, collisions, stages)
    limit = None if collisions is None else checks.integer(collisions, "collisions", low=1)
    of_points = {
        "dimension": dimension, "species": species, "walls": walls, "packing_fraction": packing_fraction,
    }  # fmt: skip
    scene = start_of(start, {name: value for name, value in of_points.items() if value is not None}, seed)
    if scene.n < 2:
        raise InputError("A packing needs at least two particles, found one.")
    if getattr(scene.motion, "curved", False):
        raise InputError("A packing is one of a box; for caps on a sphere there is spherical_code().")
    compression = Compression.begun(scene, plan, limit, common, seed, neighbors, pictures, progress)
    if out is None:
        return _carried_out(compression, None)
    folder = PackingFolder(Path(out))
    if resume and holds_packing(out):
        return _resumed(folder, progress, compression)
    folder.check_free(overwrite)
    folder.make()
    with folder.owned():
        folder.sweep()
        folder.clear()
        return _carried_out(compression, folder)


def _carried_out(compression: Compression, folder: PackingFolder | None) -> Packing:
    """Run a compression to the end, and write the results to the folder if there is one."""
    kept = None if folder is None else folder.checkpoint
    with stoppable() as stop:
        stop.deferred = True
        if not compression.run(kept, lambda: stop.asked):
            text = "Stopped." if folder is None else f"Stopped; `carom resume {folder.path}` goes on."
            raise Interrupted(text, compression.packing("stopped"))
        packing = compression.packing()
        if folder is not None:
            compression.save(folder.checkpoint)
            stop.deferred = False
            packing.save(folder.path, pictures=compression.pictures)
    return packing


_ARGUMENTS = (
    "dimension", "species", "walls", "packing_fraction", "rate", "until_Z", "collisions", "stages", "common",
    "seed", "neighbors", "out", "overwrite", "resume", "pictures", "progress",
)  # fmt: skip
"""Keywords of :func:`pack`."""


def start_of(start: Any, of_points: dict[str, Any], seed: int) -> Scene:
    """Return the scene from which a compression begins; the arguments are as in :func:`pack`."""
    if start is None or isinstance(start, int | np.integer):
        species = of_points.get("species")
        counted = species is not None and checked_species(species)[0].count is not None
        if start is None and not counted:
            start = N
        return points(start, seed=seed, **of_points)
    if of_points:
        raise InputError(f"{min(of_points)} is for points, and pack() starts from a scene: leave it out.")
    if isinstance(start, Scene):
        return start
    if isinstance(start, str | PathLike):
        return SceneFile.load(Path(start)).build_scene()
    raise InputError(
        f"pack() starts from a number of particles, a Scene or a scene file (TOML), found "
        f"{checks.describe(start)}."
    )


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
    Interrupted
        As in :func:`pack`.
    """
    folder = PackingFolder(Path(out))
    if not holds_packing(out):
        raise FileError(f"{out} holds no packing of Carom; start one with `carom pack --out {out}`.")
    return _resumed(folder, progress)


def _resumed(folder: PackingFolder, progress: Progress | None, asked: Compression | None = None) -> Packing:
    """Continue the compression in a folder, which must be the one that is asked for, if any is."""
    with folder.owned():
        folder.sweep()
        kept = Compression.load(folder.checkpoint, progress)
        if asked is not None:
            asked.check_same(kept, folder.path)
        return _carried_out(kept, folder)


def _digest(scene: Scene) -> str:
    """Return a digest of the particles, the box and the models of a scene."""
    words = repr((scene.box, scene.periodic, scene.obstacles, scene.interaction, scene.motion, scene.impact))
    arrays = scene.positions, scene.diameters, scene.masses, scene.velocities
    given = b"".join(each.tobytes() for each in arrays if each is not None)
    return hashlib.sha256(words.encode() + given).hexdigest()[:8]


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


class Compression:
    """A compression under way.

    Attributes
    ----------
    plan, limit, seed, pictures
        The arguments of :func:`pack`.
    unit : (n,) array
        Growth rate of each diameter at a ``rate`` of 1 [length / time].
    sim : Simulation
        What grows.
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
    start : str
        Digest of the scene that it began from.
    """

    PROGRESS = ("stage", "left", "virial", "duration", "kT_time", "note", "start")
    """Attributes that a checkpoint keeps, beside the arguments and the history."""

    def __init__(
        self,
        sim: Simulation,
        plan: tuple[Stage, ...],
        limit: int | None,
        unit: np.ndarray,
        seed: int,
        pictures: bool,
        progress: Progress | None,
    ):
        self.sim, self.plan, self.limit, self.unit = sim, plan, limit, unit
        self.seed, self.pictures, self.progress = seed, pictures, progress
        self.start = ""
        self.stage = 0
        self.history: list[tuple[int, float, float, float]] = []
        self.left = 0
        self.virial = self.duration = self.kT_time = 0.0
        self.note = ""

    @classmethod
    def begun(
        cls,
        scene: Scene,
        plan: tuple[Stage, ...],
        limit: int | None,
        common: bool,
        seed: int,
        neighbors: str,
        pictures: bool = False,
        progress: Progress | None = None,
    ) -> Compression:
        """Return the compression of a scene at its start; the arguments are as in :func:`pack`."""
        unit = np.full(scene.n, 1.0) if common else scene.diameters / scene.diameters.mean()
        unit = unit / math.sqrt(scene.mass)
        checks.integer(seed, "seed", low=0)
        sim = Simulation(scene, seed=seed, tuning=Tuning(neighbors=neighbors), growth=plan[0].rate * unit)
        self = cls(sim, plan, limit, unit, seed, pictures, progress)
        self.start = _digest(scene)
        return self

    def check_same(self, kept: Compression, where: Path) -> None:
        """Raise InputError if a compression that was kept has other settings, or began from another scene."""
        ours, theirs = self._settings(), kept._settings()
        if other := [name for name in ours if ours[name] != theirs[name]]:
            raise InputError(
                f"{where} holds a packing with {other[0]} = {theirs[other[0]]}, found {ours[other[0]]}: "
                "`carom resume` goes on with that; for another packing choose another --out."
            )

    def _settings(self) -> dict[str, Any]:
        """Return what decides every bit of the result."""
        return {
            "stages (rate, until_Z)": [tuple(stage) for stage in self.plan],
            "collisions": self.limit,
            "seed": self.seed,
            "the start": self.start,
            "rates of growth": hashlib.sha256(self.unit.tobytes()).hexdigest()[:8],
        }

    @classmethod
    def load(cls, path: Path, progress: Progress | None = None) -> Compression:
        """Return the compression that :meth:`save` wrote.

        Raises
        ------
        FileError
            If the file is missing, damaged, of another version of Carom, or holds something else.
        """
        _, attributes = checkpoint.load(path)
        try:
            notes = json.loads(attributes["extra"])
            plan = tuple(Stage(*stage) for stage in notes["plan"])
            arguments = plan, notes["limit"], np.array(notes["unit"]), notes["seed"], notes["pictures"]
            history = [tuple(row) for row in notes["history"]]
            values = {name: notes[name] for name in cls.PROGRESS}
        except (KeyError, TypeError, ValueError) as error:
            raise FileError(f"{path} is not the checkpoint of a packing: {error}.") from None
        self = cls(Simulation.load(path), *arguments, progress)
        self.history = history
        for name, value in values.items():
            setattr(self, name, value)
        return self

    def save(self, path: Path) -> None:
        """Write a checkpoint."""
        names = ("plan", "limit", "seed", "pictures", "history", *self.PROGRESS)
        notes = {"unit": self.unit.tolist(), **{name: getattr(self, name) for name in names}}
        save(path, self.sim._state, notes)

    def run(self, kept: Path | None, stop: Callable[[], bool]) -> bool:
        """Run on; return whether the end was reached.

        Parameters
        ----------
        kept : Path or None
            File for a checkpoint from time to time, and when it is stopped.
        stop : callable
            Asked from time to time whether to stop.
        """
        self._report()
        if not self.history and not self.left:
            self.sim.rescale(1.0)
            self._begin()
        due = -math.inf
        while not self.note:
            asked = stop()
            if kept is not None and (asked or clock.perf_counter() >= due):
                self.save(kept)
                due = clock.perf_counter() + CHECKPOINT_EVERY
            if asked:
                return False
            self._part()
        return True

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
        until = self.plan[self.stage].until_Z
        while until is not None and pressure >= until and not self.note:
            self.stage += 1
            if self.stage == len(self.plan):
                self.stage -= 1
                self.note = f"Z = PV/NkT = {until:g} reached"
            until = self.plan[self.stage].until_Z
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
            until = self.plan[-1].until_Z
            if until is not None and until > 1.0 and pressure > 1.0:
                done = math.log(pressure) / math.log(until)
            if self.limit is not None:
                done = max(done, collisions / self.limit)
        self.progress("Packing", min(done, 1.0))

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
