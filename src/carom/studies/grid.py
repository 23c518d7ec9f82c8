"""What studies of bulk fluids ask for: a grid of packing fractions x numbers of particles x replicas.

Scenes are imported when there is one to check: the help of a command reads the fields alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Annotated, Any, ClassVar, Self

from carom.declared import SEED, Opt, integer, number, option, several, word
from carom.errors import InputError
from carom.spec import Spec, integers_of, numbers_of
from carom.version import __version__

SYSTEM, LENGTH = "The system (overrides a scene file)", "How long"

POINT = ("n", "packing_fraction", "density", "box", "dimension", "lattice", "cells", "nearest")
"""Keys of ``[scene]`` that say how many particles there are and how dense: one point of a grid."""

MOST = 10**8
"""Most particles of a scene, as in :mod:`carom.scene.lattices`."""

SCENE = (
    "Scene file (TOML) with [scene] and the section of the command; other arguments replace its values. Or "
    "further keys of a scene, e.g. diameter and mass."
)
"""What the argument ``scene`` of a study is."""

# Fields of which each study has a default of its own.
Sizes = Annotated[
    tuple[int, ...],
    several(integer(low=2, high=MOST)),
    Opt("Number of particles, or several; as an option 500,1000,2000.", SYSTEM, ("--n",), integers_of("--n")),
]
Replicas = Annotated[int, integer(low=1, high=10**6), Opt("Independent runs of each point.", SYSTEM)]
Length = Annotated[
    float, number(low=0.0), Opt("Collisions per particle before anything is measured.", LENGTH)
]
Blocks = Annotated[
    int, integer(low=16, high=10**6), Opt("Blocks per run, which give error bars and drift.", flags=None)
]
Neighbors = Annotated[
    str,
    word("auto", "lists", "sectors", "all"),
    Opt("How pairs are found: auto, lists, sectors or all.", flags=None),
]


@dataclass(frozen=True)
class OfScene(Spec):
    """Base of specifications with ``[scene]`` in their files."""

    tables: ClassVar[tuple[str, ...]] = ("scene",)

    def to_toml(self) -> str:
        """Return the specification as TOML, from which :meth:`from_toml` makes an equal one."""
        from carom.io.records import toml_lines
        from carom.scene_file.words import scene_lines

        words = self.words()
        scene = words.pop("scene", {})
        lines = [f"[{self.section}]", *toml_lines(words)]
        return "\n".join([*lines, *(["", *scene_lines(scene)] if scene else [])]) + "\n"


@dataclass(frozen=True)
class SceneGrid(OfScene):
    """What all grids of simulations say: the scene of each point, replicas, and how exact the result is.

    On a lattice, the number of particles that fills it and is nearest to n is taken. A file may say in
    ``[scene]`` what there is, for all commands: what the section of the study leaves out is taken from there.
    """

    grid: ClassVar[tuple[str, ...]] = ("packing_fraction", "n", "replicas")
    resets: ClassVar[Mapping[str, tuple[str, ...]]] = {"dimension": ("packing_fraction", "lattice")}
    densities: ClassVar[Mapping[int, tuple[float, ...]]]
    """Default packing fractions, by dimension."""
    error: ClassVar[float]
    """Default relative error."""
    measured: ClassVar[str]
    """The field that says how long a run measures, instead of the error."""
    refused: ClassVar[Mapping[str, str]]
    """Keys of a scene with which there is nothing to measure, and why."""
    gone: ClassVar[Mapping[str, str]] = {"initial": 'give lattice = "fcc", "none" or "auto"'}

    packing_fraction: tuple[float, ...] = option(
        None,
        "Packing fractions; as an option 0.1,0.2,0.3 or 0.1:0.4:7 (7 from 0.1 to 0.4).",
        SYSTEM,
        read=numbers_of("--packing-fraction"),
        default=(),
    )
    n: Sizes = (500,)
    replicas: Replicas = 2
    dimension: int = option(integer(low=1, high=12), "Dimension of space, 1 to 12.", SYSTEM, default=3)
    kT: float = option(
        number(low=0.0, high=1e304, open_low=True),
        "Temperature kT, an energy; with wells held until equilibration ends.",
        SYSTEM,
        ("--kT",),
        default=1.0,
    )
    relative_error: float | None = option(
        None, "Relative error at every point, all replicas together.", LENGTH
    )
    equilibration: Length = 1000.0
    seed: int = option(SEED, "Seed of all random numbers.", SYSTEM, default=1)
    lattice: str = option(
        word("auto", "none", "fcc", "triangular", "cubic", "dn"),
        "How runs start: auto, none (random), fcc, triangular, cubic or dn; auto is random up to the "
        "middle of the coexistence, and the densest lattice above.",
        SYSTEM,
        default="auto",
    )
    blocks: Blocks = 256
    scene: Mapping[str, Any] = option(
        None, "Further keys of a scene, e.g. diameter, mass or kT.", flags=None, factory=dict
    )

    def complete(self) -> None:
        """Check the grid as a whole, and set what depends on several fields."""
        from carom import checks, densities

        self._put("scene", self._template())
        if self.packing_fraction == () or self.packing_fraction is None:
            if self.dimension not in self.densities:
                raise InputError(f"packing_fraction are needed in {self.dimension} dimensions, found none.")
            self._put("packing_fraction", self.densities[self.dimension])
        limit = densities.CLOSEST_PACKING.get(self.dimension, 1.0)
        fractions = several(number(low=0.0, high=limit, open_low=True))
        self._put("packing_fraction", fractions(self.packing_fraction, "packing_fraction"))
        length = getattr(self, self.measured)
        if self.relative_error is not None and length is not None:
            raise InputError(f"relative_error and {self.measured} contradict each other; remove one.")
        if length is None:
            error = self.error if self.relative_error is None else self.relative_error
            self._put("relative_error", checks.number(error, "relative_error", low=1e-9, high=1.0))
        else:
            self._put(self.measured, checks.number(length, self.measured, low=0, open_low=True))
        # All scenes are checked now, rather than in a worker an hour later.
        self.tasks()

    @classmethod
    def of(cls, source: Any, given: Mapping[str, Any]) -> Self:
        """Return what a command, or the function of the same name, is asked for.

        Raises
        ------
        InputError
            If a file stands where packing fractions are expected.
        """
        if isinstance(name := given.get("packing_fraction"), str | PathLike):
            raise InputError(
                f"packing_fraction must be numbers, found {str(name)!r}; a scene file is given as "
                f"scene={str(name)!r}."
            )
        return super().of(source, given)

    @classmethod
    def of_sections(cls, words: dict[str, Any], others: dict[str, Any]) -> dict[str, Any]:
        """Return the fields from the section of the study and, where it leaves them out, from ``[scene]``.

        Raises
        ------
        InputError
            If ``[scene]`` has an unknown key, or starts from a file.
        """
        from carom.scene_file.fields import tuples
        from carom.scene_file.sections import SceneSpec
        from carom.studies.scenes import point_of, with_fractions

        scene = others.get("scene", {})
        SceneSpec.check_file(scene)
        if "file" in scene:
            raise InputError(
                "[scene] file has no meaning in a study, whose runs each have a start of their own; say what "
                "there is."
            )
        rest = {name: value for name, value in tuples(scene).items() if name not in POINT}
        if "species" in scene:
            rest["species"] = with_fractions(SceneSpec(species=scene["species"]))
        return {**point_of(SceneSpec(**tuples(scene)), scene), **words, "scene": rest}

    def _template(self) -> dict[str, Any]:
        """Return the keys of ``scene`` as plain values, without those that the grid sets."""
        from carom import checks
        from carom.declared import checked
        from carom.scene_file.sections import SceneSpec
        from carom.studies.scenes import plain, refuse_other_interactions

        if not isinstance(self.scene, Mapping):
            raise InputError(f"scene must be a table, found {checks.describe(self.scene)}.")
        SceneSpec.check_words(self.scene)
        for name in self.scene:
            if name in (*POINT, "file", "frame"):
                raise InputError(
                    f"[scene] {name} is for the section [{self.section}] to say; move or remove it."
                )
            if name == "sizes":
                raise InputError("[scene] sizes are for carom run; remove them, or give species.")
            if name in self.refused:
                raise InputError(f"[scene] {name} {self.refused[name]}")
        given = {name: value for name, value in self.scene.items() if value is not None}
        if not isinstance(model := given.get("interaction"), Mapping):
            refuse_other_interactions(model, given.get("diameter"))
        template = {name: plain(checked(SceneSpec, name, value), name) for name, value in given.items()}
        if any(each.get("count") is not None for each in template.get("species", ())):
            raise InputError(
                "[scene] species of a study have no count, because n is for the study to say; give each a "
                "fraction."
            )
        return {name: value for name, value in template.items() if value not in (None, [], ())}

    def tasks(self) -> list[dict[str, Any]]:
        """Return the tasks."""
        return [
            self.task(eta, n, replica)
            for eta in self.packing_fraction
            # Two values of n may give one number that fills the lattice; equal runs are no replicas.
            for n in dict.fromkeys(self.taken(eta).values())
            for replica in range(self.replicas)
        ]

    def taken(self, eta: float) -> dict[int, int]:
        """Return the number of particles that runs at ``eta`` take for each n."""
        from carom.studies.scenes import nearest_filling

        return {n: nearest_filling(self._start(eta), self.dimension, n) for n in self.n}

    def task(self, eta: float, n: int, replica: int) -> dict[str, Any]:
        """Return one run (``eta``, ``n``, ``replica``); a study adds what else it needs."""
        from carom.scene_file.fields import tuples
        from carom.scene_file.sections import SceneSpec
        from carom.studies.scenes import refuse_other_interactions, words_of_task

        start = self._start(eta)
        scene = SceneSpec(
            n=n,
            packing_fraction=eta,
            dimension=self.dimension,
            lattice=None if start == "random" else start,
            **tuples(self.scene),
        )
        refuse_other_interactions(scene.interaction, scene.diameter)
        return {
            "study": self.study,
            "version": __version__,
            "scene": words_of_task(scene, self.kT),
            "replica": replica,
            "seed": self.seed,
            "equilibration": self.equilibration,
            "blocks": self.blocks,
        }

    def _start(self, eta: float) -> str:
        """Return from what a run starts, a lattice or "random"; "auto" depends on the density."""
        from carom import theory

        if self.lattice != "auto":
            return "random" if self.lattice == "none" else self.lattice
        d = self.dimension
        middle = 0.5 * (theory.FREEZING.get(d, 1.0) + theory.MELTING.get(d, 1.0))
        if "species" in self.scene or eta < middle:
            return "random"
        return {2: "triangular", 3: "fcc"}.get(d, "dn")

    def settings(self) -> dict[str, Any]:
        """Return what all tasks share; with an error also the replicas, on which the length then depends."""
        return super().settings() | ({} if self.relative_error is None else {"replicas": self.replicas})


@dataclass(frozen=True)
class GridSpec(SceneGrid):
    """A grid of simulations in equilibrium: packing fractions x numbers of particles x replicas."""

    rivals: ClassVar[tuple[tuple[str, ...], ...]] = (("relative_error", "collisions_per_particle"),)
    measured: ClassVar[str] = "collisions_per_particle"

    collisions_per_particle: float | None = option(
        None, "Instead of an error: collisions per particle of every run.", LENGTH
    )
    neighbors: Neighbors = "auto"

    def tasks(self) -> list[dict[str, Any]]:
        """Return the tasks, the longest first."""
        return sorted(super().tasks(), key=collisions, reverse=True)

    def task(self, eta: float, n: int, replica: int) -> dict[str, Any]:
        """Return one run (``eta``, ``n``, ``replica``); a study adds what else it needs."""
        length = self.collisions_per_particle or self.length(eta, n)
        task = super().task(eta, n, replica)
        return {**task, "collisions_per_particle": length, "neighbors": self.neighbors}

    def length(self, eta: float, n: int) -> float:
        """Return the collisions per particle that reach the error at ``eta`` with ``n``, to four digits."""
        raise NotImplementedError


def collisions(task: Mapping[str, Any]) -> float:
    """Return the work of a task [collisions]."""
    length = task["equilibration"] + task["collisions_per_particle"]
    return 0.5 * float(length) * int(task["scene"]["n"])
