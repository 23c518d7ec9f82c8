"""The sections of a scene file that say what there is and how to run it: ``[scene]`` and ``[run]``.

The help of a command reads these fields, so that nothing slow is imported here before a value is checked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

from carom.declared import SEED, described, fields_of, integer, number, option, positive, switch, word
from carom.errors import InputError
from carom.scene_file import fields
from carom.scene_file.fields import FORMATS, LATTICES
from carom.spec import Spec, edges_in, tables_of

if TYPE_CHECKING:
    from carom.scene.scene import Scene

__all__ = ["ADDED", "FORMATS", "RunSpec", "SceneSpec"]

SYSTEM, LENGTH, OUTPUT = "The system (overrides a scene file)", "How long", "What to write"

N = 2048  # number of particles where a scene says none

FRACTIONS = {1: 0.5, 2: 0.6, 3: 0.45, 4: 0.2, 5: 0.1, 6: 0.05}
"""Packing fraction where a scene says none, by dimension: fluids below freezing. Beyond, half of random close
packing."""

BAROSTAT = "{ pressure = 10.0, interval = 0.2 }"  # how constant pressure is asked for

FIXED = {"fcc": 3, "triangular": 2}  # lattices of one dimension

ADDED = ("walls", "contact", "obstacles", "interaction", "motion", "impact", "drive", "pinned")
"""Keys of [scene] that go with every start: a trajectory does not hold them."""

DEFAULT_COLLISIONS = 10000.0  # collisions per particle in the measurement, by default

MOST_COLLISIONS = 1e10
"""More collisions per particle than any run reaches; their total still fits an integer of 64 bits."""

OF_A_COMMAND = {
    "kT": 2.0, "seed": 2, "equilibration": 500, "collisions_per_particle": 1000, "frames": 50, "time": 100.0,
    "barostat": BAROSTAT,
}  # fmt: skip
"""Keys that are none of [scene], with a value."""

WITH_FILE = ("file", "frame", "diameter", "box", *ADDED)  # keys of [scene] that go with a start from a file

LENGTHS = ("collisions_per_particle", "time", "relative_error")
"""Keys of [run] of which each says how long a run is."""


@described
@dataclass(frozen=True)
class SceneSpec(Spec):
    """What there is: the section ``[scene]``.

    A value that is None or empty is left out. In a file, species, walls and obstacles are tables with names;
    in Python species and obstacles may be lists as well.

    Raises
    ------
    InputError
        If a value has the wrong type or is out of range, or keys contradict each other.
    """

    section: ClassVar[str] = "scene"
    before: ClassVar[str] = "[scene] "
    gone: ClassVar[Mapping[str, str]] = {
        "initial": 'places are random; give lattice = "fcc" for a crystal, or file = "run1/trajectory.h5md"',
        **{
            name: f"the section of a command has it, such as [run] {name} = {value}"
            for name, value in OF_A_COMMAND.items()
        },
        "positions": 'give file = "start.extxyz", a file with frames',
        "periodic": 'axes without walls are periodic: give walls = "y", say',
        "restitution": "give impact = 0.9, say",
        "elastic_below": "give impact = { restitution = 0.9, elastic_below = 0.01 }, say",
    }
    rivals: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("cells", "n"),
        ("cells", "nearest"),
        ("packing_fraction", "density", "box"),
        ("diameter", "sizes"),
    )
    resets: ClassVar[Mapping[str, tuple[str, ...]]] = {"lattice": ("cells", "nearest")}

    n: int | None = option(integer(low=1, high=fields.MOST), "Number of particles.", SYSTEM, ("--n",))
    packing_fraction: float | None = option(
        number(low=0, high=1, open_low=True), "Fraction of the volume that particles fill.", SYSTEM
    )
    density: float | None = option(
        number(low=0, open_low=True), "Or: number density, N diameter^d / V.", SYSTEM
    )
    box: tuple[float, ...] | None = option(
        fields.edges, "Or: edges of the box, also for a file that holds none.", SYSTEM, read=edges_in
    )
    dimension: int | None = option(
        integer(low=1, high=fields.MOST_DIMENSIONS), "Dimension of space, 1 to 12.", SYSTEM
    )
    lattice: str | None = option(
        word("none", *LATTICES), "Start from a crystal: fcc, triangular, cubic or dn.", SYSTEM
    )
    cells: int | tuple[int, ...] | None = option(
        fields.each_axis(integer(low=1, high=fields.MOST)),
        "Cells of the lattice along each axis, instead of n.",
        SYSTEM,
    )
    nearest: bool | None = option(
        switch, "Take the number nearest to n that fills the lattice.", SYSTEM, ("--nearest",)
    )
    diameter: float | None = option(
        positive, "Diameter of all particles, also for a file without any.", SYSTEM
    )
    sizes: Any = option(
        fields.sizes, "Or: diameters of many sizes, with the mean 1: power, uniform or gaussian.", flags=None
    )
    mass: float | None = option(positive, "Mass of all particles.", flags=None)
    species: tuple[Any, ...] = option(
        fields.species,
        "Species by name: fraction of n (or count), diameter, mass; as an option FRACTION:DIAMETER or "
        "FRACTION:DIAMETER:MASS, for each.",
        SYSTEM,
        read=tables_of("--species", "FRACTION:DIAMETER", "FRACTION:DIAMETER:MASS"),
        many=True,
        default=(),
    )
    contact: tuple[tuple[float, ...], ...] | None = option(
        fields.contact, "Contact distances of species [length], by default mean diameters.", flags=None
    )
    file: str | None = option(fields.file_name, "Trajectory to start from, seen from this file.", flags=None)
    frame: int | None = option(integer(low=-(2**31), high=2**31), "Frame of file to start from.", flags=None)
    walls: Any = option(fields.walls, 'Axes with walls, "xz" or true, or walls by name.', flags=None)
    obstacles: tuple[Any, ...] = option(
        fields.obstacles, "Obstacles by name: type and geometry.", flags=None, default=()
    )
    interaction: Any = option(fields.model("interaction"), "What pairs feel besides hard cores.", flags=None)
    motion: Any = option(fields.model("motion"), "How particles move between events.", flags=None)
    impact: Any = option(fields.model("impact"), "What contacts lose: a restitution, or a table.", flags=None)
    drive: Any = option(fields.model("drive"), "What kicks single particles.", flags=None)
    pinned: int | tuple[int, ...] | None = option(
        fields.indices, "Particles that stay in place: how many, or their indices.", flags=None
    )

    @classmethod
    def check_file(cls, words: Mapping[str, Any]) -> None:
        """Raise InputError for a key that is unknown, or for parts of a file without names.

        Parameters
        ----------
        words : mapping
            The section as the file has it.
        """
        cls.check_words(words)
        for name, example in (("species", "small"), ("obstacles", "pillar")):
            if isinstance(words.get(name), list):
                raise InputError(
                    f"[scene] {name} must be tables with names, as [scene.{name}.{example}]; found a list."
                )

    def complete(self) -> None:
        """Check what concerns several keys; defaults are made explicit, so that equal scenes are equal.

        Raises
        ------
        InputError
            If keys contradict each other, or the box has no such walls.
        """
        if self.lattice == "none":
            self._put("lattice", None)
        self._put("nearest", self.nearest or None)
        self._check_together()
        self._check_species()
        if self.impact is not None:
            from carom.models.contacts.restitution import Restitution

            if isinstance(self.impact, Restitution) and self.impact.elastic:
                self._put("impact", None)
        if self.file is not None:
            self._default("frame", -1)
            return
        self._default("dimension", FIXED.get(self.lattice or "", 3) if self.box is None else len(self.box))
        if not self._given("cells", "n") and not self.counted:
            self._put("n", N)
        if self.nearest and self.n is not None:
            from carom.scene import lattices

            lattice = lattices.named(self.lattice, self.dimension)
            self._put("n", lattice.count(lattices.cells_for(lattice, self.n, True)))
        if not self._given("packing_fraction", "density", "box"):
            self._put("packing_fraction", self._usual_fraction())
        if not self.species:
            if self.sizes is None:
                self._default("diameter", 1.0)
            self._default("mass", 1.0)
        if self.walls is not None:
            from carom.models.obstacles import named_walls

            assert self.dimension is not None
            try:
                walls = named_walls.named(self.walls, self.dimension)
            except InputError as problem:
                raise InputError(f"[scene] {problem}") from problem
            self._put("walls", named_walls.shortest(walls, self.dimension) or None)

    @property
    def counted(self) -> bool:
        """Whether each species has a count."""
        return bool(self.species) and self.species[0].count is not None

    @property
    def start(self) -> str:
        """From what the scene starts: "file", the name of a lattice, or "random"."""
        return "file" if self.file is not None else self.lattice or "random"

    def _default(self, name: str, value: Any) -> None:
        """Set a value that is left out."""
        if getattr(self, name) is None:
            self._put(name, value)

    def _usual_fraction(self) -> float:
        assert self.dimension is not None
        if self.dimension in FRACTIONS:
            return FRACTIONS[self.dimension]
        from carom.scene import placement

        return float(placement.default_fraction(self.dimension))

    def _given(self, *names: str) -> list[str]:
        """Return which of these keys are given."""
        return [name for name in names if getattr(self, name) not in (None, ())]

    def _check_together(self) -> None:
        """Raise InputError if keys contradict each other."""
        if self.file is not None:
            every = [name for name in fields_of(SceneSpec) if name not in WITH_FILE]
            where, unused = "with file", every
        elif self.lattice is None:
            where, unused = "without a lattice", ["cells", "nearest"]
        else:
            where, unused = f'with lattice = "{self.lattice}"', ["box", "sizes"]
        unused += [] if self.file is not None else ["frame"]
        if extra := self._given(*unused):
            if extra[0] == "cells" and self.file is None:
                raise InputError('[scene] cells needs a lattice (lattice = "fcc"); a random start takes n.')
            where = "without a file" if extra[0] == "frame" else where
            raise InputError(f"[scene] {extra[0]} has no meaning {where}; remove it.")
        for group in self.rivals:
            if len(both := self._given(*group)) > 1:
                raise InputError(f"[scene] {both[0]} and {both[1]} contradict each other; remove one.")
        fixed = FIXED.get(self.lattice or "")
        if fixed is not None and self.dimension not in (None, fixed):
            raise InputError(f"[scene] dimension is {fixed} {where}, found {self.dimension}.")
        if self.lattice == "dn" and self.dimension is not None and self.dimension < 3:
            raise InputError(f"[scene] dimension must be at least 3 {where}, found {self.dimension}.")
        if self.box is not None and self.dimension not in (None, len(self.box)):
            raise InputError(f"[scene] box must have {self.dimension} edges, found {len(self.box)}.")

    def _check_species(self) -> None:
        """Raise InputError if species contradict each other or the rest of the section."""
        if not self.species:
            if self.contact is not None and self.file is None:
                raise InputError("[scene] contact needs species, found none.")
            return
        if extra := self._given("diameter", "sizes", "mass"):
            raise InputError(f"[scene] {extra[0]} has no meaning with species; give each its own.")
        counts = [each.count is not None for each in self.species]
        fractions = [each.fraction is not None for each in self.species]
        if any(a == b for a, b in zip(counts, fractions, strict=True)) or len({*counts}) > 1:
            raise InputError("[scene] species need a count for each, or a fraction for each.")
        if counts[0] and self.n is not None:
            raise InputError("[scene] n has no meaning with the counts of species; remove it.")
        if fractions[0]:
            from carom import checks

            checks.shares([each.fraction for each in self.species])
        names = [each.name or str(k) for k, each in enumerate(self.species)]
        if len({*names}) < len(names):
            raise InputError("[scene] species must have different names.")

    def build(self, seed: Any, kT: float | None = None) -> Scene:
        """Return the scene, placed and checked.

        Parameters
        ----------
        seed : int or Generator
            Source of places and of who is pinned.
        kT : float, optional
            With ``file``, it replaces the velocities of the file: the scene has none then.

        Raises
        ------
        InputError
            If the scene is impossible, for example packed too densely.
        FileError
            If the file to start from cannot be read.
        """
        from carom.scene_file.build import build

        return build(self, seed, kT)

    def own(self) -> dict[str, Any]:
        """Return what checkpoints and event logs do not hold: range rules from a file, by argument name.

        Raises
        ------
        InputError
            If the code of the rule was not allowed to run (:meth:`SceneFile.trusted`), or fails.
        """
        from carom.models.interactions.rule_files import RuleFile

        return {"interaction": self.interaction.ranges()} if isinstance(self.interaction, RuleFile) else {}


def formats_of(text: str) -> list[str]:
    """Return the formats that an option names: with commas between them."""
    return [part.strip() for part in text.split(",")]


@described
@dataclass(frozen=True)
class RunSpec(Spec):
    """How to run it: the section ``[run]``.

    Raises
    ------
    InputError
        If a value has the wrong type or is out of range, or keys contradict each other.
    """

    section: ClassVar[str] = "run"
    before: ClassVar[str] = "[run] "
    gone: ClassVar[Mapping[str, str]] = {
        "trajectory": 'give write = ["h5md"], say',
        "pressure": f"give barostat = {BAROSTAT}, say",
        **{name: f"in [scene], {text}" for name, text in SceneSpec.gone.items() if name not in OF_A_COMMAND},
        **{name: f"{name} is a key of [scene]" for name in fields_of(SceneSpec)},
        "initial": "what the run starts from stands in [scene]",
    }
    rivals: ClassVar[tuple[tuple[str, ...], ...]] = (LENGTHS,)

    kT: float | None = option(
        number(low=0, high=1e304),
        "Temperature kT, an energy; with wells held until equilibration ends.",
        SYSTEM,
        ("--kT",),
    )
    seed: int = option(SEED, "Seed of all random numbers.", default=1)
    equilibration: float = option(
        number(low=0, high=MOST_COLLISIONS),
        "Collisions per particle before anything is measured.",
        LENGTH,
        default=200.0,
    )
    collisions_per_particle: float | None = option(
        number(low=0, high=MOST_COLLISIONS, open_low=True),
        "Collisions per particle in the measurement.",
        LENGTH,
    )
    time: float | None = option(
        number(low=0, high=1e300, open_low=True), "Or: duration of the measurement, a time.", LENGTH
    )
    relative_error: float | None = option(
        number(low=1e-9, high=1), "Or: measure until Z has this relative error.", LENGTH
    )
    walltime: float | None = option(
        number(low=0, high=1e9, open_low=True), "Limit of wall time for this, in seconds.", LENGTH
    )
    frames: int | None = option(
        integer(low=1, high=10**9), "Number of frames; 100, or fewer within 200 MB of files.", LENGTH
    )
    write: tuple[str, ...] | None = option(
        fields.formats, "Trajectories: h5md, extxyz, gsd; large runs h5md alone.", OUTPUT, (), formats_of
    )
    event_log: bool = option(
        switch, "Write every collision to events.h5.", OUTPUT, ("--event-log/--no-event-log",), default=False
    )
    pictures: bool = option(switch, "Three PNG files.", OUTPUT, ("--pictures/--no-pictures",), default=True)
    check: bool = option(
        switch, "Look for overlaps in every frame.", OUTPUT, ("--check/--no-check",), default=False
    )
    checkpoint_every: float = option(
        number(low=0, high=1e9, open_low=True), "Seconds between checkpoints.", OUTPUT, default=10.0
    )
    neighbors: str = option(
        word("auto", "sectors", "lists", "all"),
        "How pairs are found: auto, lists, sectors or all.",
        flags=None,
        default="auto",
    )
    swaps: Any = option(
        fields.swaps,
        "Exchanges of diameters: interval, attempts, within and seed of carom.Swaps.",
        flags=None,
    )
    barostat: Any = option(
        fields.barostat, "Constant pressure: pressure, interval, step and seed of carom.Barostat.", flags=None
    )

    def words(self) -> dict[str, Any]:
        """Return the fields as JSON values, without those that are None."""
        words = super().words()
        return {**words, **{name: asdict(words[name]) for name in ("swaps", "barostat") if name in words}}

    def complete(self) -> None:
        """Check that one key says how long the run is; by default collisions per particle do.

        Raises
        ------
        InputError
            If several keys do, or an event log is to hold swaps or a box that changes.
        """
        given = [name for name in LENGTHS if getattr(self, name) is not None]
        if len(given) > 1:
            raise InputError(f"[run] has {given[0]} and {given[1]}: each says how long; leave one out.")
        if self.walltime is not None and self.relative_error is None:
            raise InputError("[run] walltime goes with relative_error, which is missing.")
        if self.swaps is not None and self.event_log:
            raise InputError(
                "[run] event_log holds one diameter a particle and goes without swaps; leave one out."
            )
        for name in ("event_log", "swaps"):
            if self.barostat is not None and getattr(self, name):
                raise InputError(f"[run] {name} goes without a barostat; leave one of the two out.")
        if not given:
            self._put("collisions_per_particle", DEFAULT_COLLISIONS)

    def replaced(self, **given: Any) -> RunSpec:
        """Return the section with other values; a walltime goes with the relative error that it limits.

        Parameters
        ----------
        **given
            Keys and values; None stands for those not given.
        """
        other = given.get("relative_error") is None and any(given.get(name) for name in LENGTHS)
        return super(RunSpec, replace(self, walltime=None) if other else self).replaced(**given)
