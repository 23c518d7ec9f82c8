"""The three sections of a plan as frozen dataclasses that check themselves: scene, run and output."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from carom import checks, seeds
from carom.errors import InputError
from carom.models.contacts.restitution import Restitution
from carom.models.files import tables
from carom.models.interactions.rule_files import RuleFile
from carom.models.obstacles import Obstacle, Wall, named_walls
from carom.scene import lattices
from carom.scene.lattices import Lattice
from carom.scene.scene import Scene
from carom.scene.species import Species
from carom.scene_file.fields import Fields

INITIAL = ("fcc", "cubic", "triangular", "dn", "random", "file")
NEIGHBORS = ("auto", "sectors", "lists", "all")
FORMATS = ("h5md", "extxyz", "gsd")

#: Keys of [scene] that go with every start: a trajectory does not hold them.
ADDED = (
    "walls",
    "contact",
    "obstacles",
    "interaction",
    "motion",
    "impact",
    "drive",
    "pinned",
)

#: Collisions per particle in the measurement, by default.
DEFAULT_COLLISIONS = 10000.0

#: More collisions per particle than any run reaches; their total still fits an integer of 64 bits.
MOST_COLLISIONS = 1e10


@dataclass(frozen=True)
class SpeciesSpec:
    """One species of a mixture: a table ``[[scene.species]]``.

    Parameters
    ----------
    name : str
        Name of the species; its number when left out.
    count : int
        Number of particles of the species. All species have a ``count``, or all have a ``fraction``.
    fraction : float
        Part of the n of the scene that this species has, in any ratio to the parts of the others.
    diameter, mass : float
        Diameter [length] and mass; 1 when left out.

    Raises
    ------
    InputError
        If a value has the wrong type or is out of range.
    """

    name: str | None = None
    count: int | None = None
    fraction: float | None = None
    diameter: float = 1.0
    mass: float = 1.0

    def __post_init__(self) -> None:
        check = Fields("scene.species", self)
        check.text("name")
        check.integer("count", low=0, high=lattices.MOST)
        check.number("fraction", low=0, high=checks.MAGNITUDE)
        for name in ("diameter", "mass"):
            check.number(name, low=1 / checks.MAGNITUDE, high=checks.MAGNITUDE)


@dataclass(frozen=True)
class SceneSpec:
    """What to simulate: the section ``[scene]``.

    A value that is None or empty is left out.

    Parameters
    ----------
    initial : str
        "fcc", "cubic", "triangular", "dn", "random" or "file".
    cells : int or tuple of ints
        Cells along each axis, for lattices.
    n : int
        Number of spheres: of "random", or of a lattice with equal cells along every axis.
    dimension : int
        d, for "cubic", "dn" and "random" (3 when left out).
    packing_fraction, density : float
        Fraction of the volume that is filled, or number of spheres per diameter^d.
    box : tuple of floats
        Edges [length], for "random", instead of a density.
    diameter, mass : float
        Diameter [length] and mass; 1 when left out.
    kT : float
        Temperature [energy]; 1 when left out. With "file" it replaces the velocities of the file.
    file : str
        Trajectory to start from.
    frame : int
        Number of its frame; -1, the last, when left out.
    walls : str, bool, tuple of str, or mapping of str to Wall or to its table
        Which axes have walls, and their properties, as in :class:`carom.Scene`; when left out all are
        periodic.
    contact : tuple of tuples of floats
        Contact distances between the species.
    species : tuple of SpeciesSpec, or of mappings with its fields
        Species of a mixture.
    obstacles : tuple of obstacles, or of mappings as ``{"type": "ball", "center": ..., "radius": ...}``
        See ``carom.models.obstacles``.
    interaction, motion, impact : values, or mappings such as ``{"type": "gravity", "g": (0.0, -1.0)}``
        How two particles act on each other, how all move, and what contacts lose: a number is a restitution.
        When left out, elastic hard cores in free flight (``carom.models.files.tables``).
    drive : value, or mapping such as ``{"type": "langevin", "kT": 1.0, "friction": 1.0, "step": 0.05}``
        What kicks single particles (``carom.models.drives``).
    pinned : int or tuple of ints
        Number of particles, drawn by the seed, that stay where they are, or their indices.

    Raises
    ------
    InputError
        If a value has the wrong type or is out of range, or keys contradict each other.
    """

    initial: str = "fcc"
    cells: int | tuple[int, ...] | None = None
    n: int | None = None
    dimension: int | None = None
    packing_fraction: float | None = None
    density: float | None = None
    box: tuple[float, ...] | None = None
    diameter: float | None = None
    mass: float | None = None
    kT: float | None = None
    file: str | None = None
    frame: int | None = None
    walls: bool | str | tuple[str, ...] | Mapping[str, Wall] | None = None
    contact: tuple[tuple[float, ...], ...] | None = None
    species: tuple[SpeciesSpec, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    interaction: Any = None
    motion: Any = None
    impact: Any = None
    drive: Any = None
    pinned: int | tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        check = Fields("scene", self)
        check.choice("initial", INITIAL)
        check.integers("cells", low=1, high=lattices.MOST)
        check.integer("n", low=1, high=lattices.MOST)
        check.integer("dimension", low=1, high=lattices.MOST_DIMENSIONS)
        check.number("packing_fraction", low=0, high=1, open_low=True)
        check.number("density", low=0, open_low=True)
        check.edges("box")
        for name in ("diameter", "mass"):
            check.number(name, low=1 / checks.MAGNITUDE, high=checks.MAGNITUDE)
        check.number("kT", low=0, high=checks.HOTTEST)
        check.text("file")
        check.integer("frame", low=-(2**31), high=2**31)
        check.walls("walls")
        check.indices("pinned", high=lattices.MOST)
        check.table("contact")
        check.each("species", _species)
        check.each("obstacles", _obstacle)
        for name in ("interaction", "motion", "impact", "drive"):
            check.value(name)
        self._check_together()
        self._check_species()
        # Defaults are made explicit, so that equal scenes are equal values.
        defaults: dict[str, Any] = {"kT": 1.0}
        if self.initial == "file":
            defaults = {"frame": -1}
        elif not self.species:
            defaults |= {"diameter": 1.0, "mass": 1.0}
        fixed = {"fcc": 3, "triangular": 2}.get(self.initial)
        axes = fixed or (self.dimension or 3 if self.box is None else len(self.box))
        if self.walls is not None and self.initial != "file":
            try:
                walls = named_walls.shortest(named_walls.named(self.walls, axes), axes)
            except InputError as problem:
                raise InputError(f"[scene] {problem}") from problem
            object.__setattr__(self, "walls", walls or None)
        if isinstance(self.impact, Restitution) and self.impact.elastic:
            object.__setattr__(self, "impact", None)
        for name, value in defaults.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)

    def _given(self, *names: str) -> list[str]:
        """Return which of these keys are given."""
        return [name for name in names if getattr(self, name) not in (None, ())]

    def _check_together(self) -> None:
        """Raise InputError if keys contradict each other, or one is missing."""
        every = tuple(f.name for f in dataclasses.fields(self))
        needed, unused = {
            "file": (
                ("file",),
                tuple(name for name in every if name not in ("initial", "file", "frame", "kT", *ADDED)),
            ),
            "random": (("n",), ("cells", "file", "frame")),
        }.get(self.initial, ((), ("box", "file", "frame")))
        where = f'with initial = "{self.initial}"'
        if extra := self._given(*unused):
            raise InputError(f"[scene] {extra[0]} has no meaning {where}; remove it.")
        counted = bool(self.species) and self.species[0].count is not None
        for name in needed:
            if getattr(self, name) is None and not (name == "n" and counted):
                raise InputError(f"[scene] {name} is needed {where}, found none.")
        if self.initial == "file":
            return
        for group in (("cells", "n"), ("packing_fraction", "density", "box")):
            if len(both := self._given(*group)) > 1:
                raise InputError(f"[scene] {both[0]} and {both[1]} contradict each other; remove one.")
        if self.initial != "random":
            if not self._given("cells", "n") and not counted:
                raise InputError(f"[scene] cells or n is needed {where}, found neither.")
            if not self._given("packing_fraction", "density"):
                raise InputError(f"[scene] packing_fraction or density is needed {where}, found neither.")
        fixed = {"fcc": 3, "triangular": 2}.get(self.initial)
        if fixed is not None and self.dimension not in (None, fixed):
            raise InputError(f"[scene] dimension is {fixed} {where}, found {self.dimension}.")
        if self.initial == "dn" and self.dimension is not None and self.dimension < 3:
            raise InputError(f"[scene] dimension must be at least 3 {where}, found {self.dimension}.")
        if self.box is not None and self.dimension not in (None, len(self.box)):
            raise InputError(f"[scene] box must have {self.dimension} edges, found {len(self.box)}.")

    def _check_species(self) -> None:
        """Raise InputError if species contradict each other or the rest of the section."""
        if not self.species:
            if self.contact is not None and self.initial != "file":
                raise InputError("[scene] contact needs [[scene.species]], found none.")
            return
        if extra := self._given("diameter", "mass"):
            raise InputError(f"[scene] {extra[0]} has no meaning with [[scene.species]]; give each its own.")
        counts = [each.count is not None for each in self.species]
        fractions = [each.fraction is not None for each in self.species]
        if any(a == b for a, b in zip(counts, fractions, strict=True)) or len({*counts}) > 1:
            raise InputError("[[scene.species]] needs a count for each, or a fraction for each.")
        if counts[0] and self.n is not None:
            raise InputError("[scene] n has no meaning with the counts of [[scene.species]]; remove it.")
        if len({name for each in self.species if (name := each.name)}) < sum(
            each.name is not None for each in self.species
        ):
            raise InputError("[[scene.species]] must have different names.")

    def build(self, seed: Any) -> Scene:
        """Return the scene; ``seed`` (int or Generator) is used by "random" and by mixtures.

        Raises
        ------
        InputError
            If the scene is impossible, for example packed too densely.
        FileError
            If the file to start from cannot be read.
        """
        if self.initial == "file":
            from carom.io import read

            frame = read(self.file or "", -1 if self.frame is None else self.frame)
            if self.kT is not None:  # a pinned one may have flown in the file
                frame = dataclasses.replace(frame, velocities=np.zeros_like(frame.velocities))
            given = {"contact": self.contact, "obstacles": self.obstacles, **self._added(frame.n, seed)}
            scene = Scene.from_frame(frame, **given, **self._walls())
            return scene if self.kT is None else scene.replace(velocities=None)
        walls: dict[str, Any] = {**self._walls(), "obstacles": self.obstacles}
        if self.species:
            return self._with_added(self._mixture(walls, seed), seed)
        assert self.diameter is not None
        assert self.mass is not None
        if self.initial == "random":
            return self._with_added(
                Scene.random(
                    self.n or 1,
                    dimension=self.dimension,
                    packing_fraction=self.packing_fraction,
                    density=self.density,
                    box=self.box,
                    diameter=self.diameter,
                    mass=self.mass,
                    seed=seed,
                    **walls,
                ),
                seed,
            )
        lattice = self._lattice()
        cells = lattices.cells_for(lattice, self.n) if self.cells is None else self.cells
        return self._with_added(
            Scene.crystal(
                lattice=lattice,
                cells=cells,
                packing_fraction=self.packing_fraction,
                density=self.density,
                diameter=self.diameter,
                mass=self.mass,
                **walls,
            ),
            seed,
        )

    def _mixture(self, walls: dict[str, Any], seed: Any) -> Scene:
        """Return the scene of several species."""
        kinds = [Species(**dataclasses.asdict(each)) for each in self.species]
        common: dict[str, Any] = {
            "n": self.n,
            "species": kinds,
            "contact": self.contact,
            "seed": seed,
            **walls,
        }
        common |= {"packing_fraction": self.packing_fraction, "density": self.density}
        if self.initial == "random":
            return Scene.random(dimension=self.dimension, box=self.box, **common)
        return Scene.crystal(lattice=self._lattice(), cells=self.cells, **common)

    def _added(self, n: int, seed: Any) -> dict[str, Any]:
        """Return the interaction, motion, impact, drive and pinned particles given, by argument name."""
        given = {
            name: getattr(self, name) for name in self._given("interaction", "motion", "impact", "drive")
        }
        given |= self.own()
        if self.pinned is not None:
            given["pinned"] = self._who_is_pinned(n, seed)
        return given

    def _walls(self) -> dict[str, Any]:
        """Return the walls given, by argument name."""
        return {} if self.walls is None else {"walls": self.walls}

    def _with_added(self, scene: Scene, seed: Any) -> Scene:
        """Return the scene with them."""
        given = self._added(scene.n, seed)
        return scene.replace(**given) if given else scene

    def own(self) -> dict[str, Any]:
        """Return what checkpoints and event logs do not hold: range rules from a file, by argument name.

        Raises
        ------
        InputError
            If the code of the rule was not allowed to run (:meth:`SceneFile.trusted`), or fails.
        """
        rules = self.interaction
        return {"interaction": rules.ranges()} if isinstance(rules, RuleFile) else {}

    def _who_is_pinned(self, n: int, seed: Any) -> np.ndarray:
        """Return the numbers of the particles that are pinned."""
        if isinstance(self.pinned, tuple):
            return np.array(self.pinned, np.int64)
        if self.pinned is None or self.pinned > n:
            raise InputError(f"[scene] pinned is {self.pinned}, and there are {n} components.")
        return np.sort(seeds.generator(seed, "pinned").permutation(n)[: self.pinned])

    def _lattice(self) -> Lattice:
        if self.initial == "triangular":
            return lattices.triangular()
        dimension = 3 if self.dimension is None else self.dimension
        return lattices.cubic(dimension) if self.initial == "cubic" else lattices.dn(dimension)


@dataclass(frozen=True)
class RunSpec:
    """How long to simulate: the section ``[run]``.

    Parameters
    ----------
    seed : int
        Source of all randomness.
    equilibration : float
        Collisions per particle before the measurement.
    collisions_per_particle : float
        Collisions per particle during the measurement; 10 000 when left out.
    relative_error : float
        Alternatively, measure until the standard error of Z is this fraction of Z.
    walltime : float
        Wall time of all sessions, without that of compiling, after which the run ends even if
        ``relative_error`` is not reached [s].
    frames : int
        Number of frames to sample. When left out 100, or as many fewer, or none, as keep all files within
        200 MB.
    checkpoint_every : float
        Wall time between two checkpoints [s].
    neighbors : str
        "auto", "sectors", "lists" or "all".

    Raises
    ------
    InputError
        If a value has the wrong type or is out of range, or keys contradict each other.
    """

    seed: int = 1
    equilibration: float = 200.0
    collisions_per_particle: float | None = None
    relative_error: float | None = None
    walltime: float | None = None
    frames: int | None = None
    checkpoint_every: float = 10.0
    neighbors: str = "auto"

    def __post_init__(self) -> None:
        check = Fields("run", self)
        check.integer("seed", low=0, high=2**63 - 1)
        check.number("equilibration", low=0, high=MOST_COLLISIONS)
        check.number("collisions_per_particle", low=0, high=MOST_COLLISIONS, open_low=True)
        check.number("relative_error", low=checks.FINEST_ERROR, high=1)
        check.number("walltime", low=0, high=1e9, open_low=True)
        if self.relative_error is None:
            if self.walltime is not None:
                raise InputError("[run] walltime goes with relative_error, which is missing.")
            if self.collisions_per_particle is None:
                object.__setattr__(self, "collisions_per_particle", DEFAULT_COLLISIONS)
        elif self.collisions_per_particle is not None:
            raise InputError(
                "[run] has collisions_per_particle and relative_error: each says how long; leave one out."
            )
        check.integer("frames", low=1, high=10**9)
        check.number("checkpoint_every", low=0, high=1e9, open_low=True)
        check.choice("neighbors", NEIGHBORS)


@dataclass(frozen=True)
class OutputSpec:
    """What to write: the section ``[output]``.

    Parameters
    ----------
    trajectory : tuple of str
        Formats: "h5md", "extxyz", "gsd". When left out the first two, or H5MD alone if both exceed 20 MB.
    event_log : bool
        Whether to write every collision.
    pictures : bool
        Whether to draw pictures.

    Raises
    ------
    InputError
        If a value has the wrong type, or a format is unknown.
    """

    trajectory: tuple[str, ...] | None = None
    event_log: bool = False
    pictures: bool = True

    def __post_init__(self) -> None:
        check = Fields("output", self)
        check.choices("trajectory", FORMATS)
        check.switch("event_log")
        check.switch("pictures")


def _species(value: Any, key: str) -> SpeciesSpec:
    """Return a species from its table."""
    if isinstance(value, SpeciesSpec):
        return value
    if not isinstance(value, Mapping):
        raise InputError(f"{key} must be a table, found {checks.describe(value)}.")
    known = {field.name for field in dataclasses.fields(SpeciesSpec)}
    for name in value:
        if name not in known:
            raise InputError(f"{key} has no {str(name)[:40]!r}; known are {', '.join(sorted(known))}.")
    return SpeciesSpec(**value)


def _obstacle(value: Any, key: str) -> Obstacle:
    """Return an obstacle from its table."""
    if isinstance(value, Mapping):
        try:
            return tables.obstacle_from_table(dict(value))
        except InputError as problem:
            raise InputError(f"{key}: {problem}") from problem
    if isinstance(value, type) or not isinstance(value, Obstacle):
        raise InputError(f"{key} must be an obstacle, found {checks.describe(value)}.")
    return value
