"""The parameters of an equation-of-state study as a frozen value: the section ``[study]``."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from carom import checks, densities, theory
from carom.errors import InputError
from carom.models import obstacles
from carom.models.files import to_tables
from carom.scene import lattices
from carom.scene_file.sections import SceneSpec, SpeciesSpec
from carom.studies.session import cost
from carom.studies.tasks import Task
from carom.version import __version__

DENSITIES: dict[int, tuple[float, ...]] = {
    1: tuple(round(0.075 * k, 3) for k in range(1, 13)),
    2: (0.025, *(round(0.05 * k, 2) for k in range(1, 10)), 0.475, 0.50),
    3: (0.025, *(round(0.05 * k, 2) for k in range(1, 10)), 0.475, 0.49),
    4: tuple(round(0.02 * k, 2) for k in range(1, 13)),
    5: tuple(round(0.012 * k, 3) for k in range(1, 13)),
    6: tuple(round(0.0075 * k, 4) for k in range(1, 13)),
}
"""Default packing fractions, by dimension: twelve of the fluid, up to where theory is known to 1e-4."""

N = 4000
"""Default number of particles: the finite-size correction is then below 2e-4, and its own error far below
that."""

RELATIVE_ERROR = 7e-5
"""Default relative error of Z: the default study of spheres then takes some ten minutes on two cores."""

EXCESS = 1.2
"""Relative error of Z - 1 after one collision. For independent collisions it is 2 / sqrt(pi) = 1.13, because
``|u_n|`` of a collision has the second moment 4 / pi, in squares of its mean. The rest is a margin, so that
most runs need not be lengthened."""

FEWEST = 200.0
"""Smallest number of measured collisions per particle, also for a large requested error."""

FRAMES = 8
"""Default number of frames for the order parameter near freezing; each takes some 0.04 s (N = 4000)."""

START = ("auto", "random", "fcc", "cubic", "triangular", "dn")

REFUSED = ("motion", "impact")
"""Keys of a scene with which there is no equation of state: nothing is uniform, or nothing keeps its kT."""

_SET_BY_GRID = ("packing_fraction", "n", "density", "cells", "box", "file", "frame", "initial", "dimension")


@dataclass(frozen=True)
class StudySpec:
    """A grid of simulations: packing fractions x numbers of particles x replicas.

    Parameters
    ----------
    packing_fraction : tuple of float
        Packing fractions; twelve of the fluid if left out.
    n : int or tuple of int
        Numbers of particles. On a lattice, the nearest number that fills it is taken.
    replicas : int
        Independent runs of each point.
    dimension : int
        d, 1 to 12.
    relative_error : float
        Relative error of Z at each point, all replicas together; 7e-5 if neither length is given.
    collisions_per_particle : float
        Alternatively, the length of each run.
    equilibration : float
        Collisions per particle before the measurement.
    seed : int
        Seed of the study; each run has its own random stream.
    initial : str
        "random", "fcc", "triangular", "cubic", "dn", or "auto": random up to the middle of the coexistence
        region, and the densest lattice above.
    blocks : int
        Blocks per run, which give error bars and drift.
    frames : int
        Frames per run for the order parameter and its drift. By default 8 from just below freezing on, and
        none at lower densities.
    neighbors : str
        As in :class:`carom.Simulation`.
    scene : mapping
        Further keys of ``[scene]``, e.g. diameter, mass or kT.

    Raises
    ------
    InputError
        If a value is out of range, keys contradict each other, or the scene has a `motion`, an `impact`, or
        an `interaction` other than steps that conserve the energy.
    """

    packing_fraction: tuple[float, ...] = ()
    n: tuple[int, ...] = (N,)
    replicas: int = 2
    dimension: int = 3
    relative_error: float | None = None
    collisions_per_particle: float | None = None
    equilibration: float = 1000.0
    seed: int = 1
    initial: str = "auto"
    blocks: int = 256
    frames: int | None = None
    neighbors: str = "auto"
    scene: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        put("dimension", checks.integer(self.dimension, "dimension", low=1, high=lattices.MOST_DIMENSIONS))
        put("scene", self._template())
        if self.packing_fraction is None or not _listed(self.packing_fraction):
            if self.dimension not in DENSITIES:
                raise InputError(f"packing_fraction are needed in {self.dimension} dimensions, found none.")
            put("packing_fraction", DENSITIES[self.dimension])
        limit = densities.CLOSEST_PACKING.get(self.dimension, 1.0)
        etas = [
            checks.number(eta, "packing_fraction", low=0.0, high=limit, open_low=True)
            for eta in _listed(self.packing_fraction)
        ]
        put("packing_fraction", _distinct("packing_fraction", etas))
        put("n", _distinct("n", [checks.integer(n, "n", low=2, high=lattices.MOST) for n in _listed(self.n)]))
        put("replicas", checks.integer(self.replicas, "replicas", low=1, high=10**6))
        put("seed", checks.integer(self.seed, "seed", low=0, high=2**63 - 1))
        put("blocks", checks.integer(self.blocks, "blocks", low=16, high=10**6))
        if self.frames is not None:
            put("frames", checks.integer(self.frames, "frames", low=0, high=self.blocks))
        if self.relative_error is not None and self.collisions_per_particle is not None:
            raise InputError("relative_error and collisions_per_particle contradict each other; remove one.")
        if self.collisions_per_particle is None:
            error = RELATIVE_ERROR if self.relative_error is None else self.relative_error
            put("relative_error", checks.number(error, "relative_error", low=1e-9, high=1.0))
        else:
            most = checks.number(
                self.collisions_per_particle, "collisions_per_particle", low=0, open_low=True
            )
            put("collisions_per_particle", most)
        put("equilibration", checks.number(self.equilibration, "equilibration", low=0.0))
        for name, known in (("initial", START), ("neighbors", ("auto", "lists", "sectors", "all"))):
            if getattr(self, name) not in known:
                raise InputError(
                    f"{name} must be one of {', '.join(known)}; found {checks.describe(getattr(self, name))}."
                )
        # All scenes are checked now, rather than in a worker an hour later.
        self.tasks()

    def _template(self) -> dict[str, Any]:
        """Return the keys of ``scene`` as plain values, without those that the grid sets."""
        if not isinstance(self.scene, Mapping):
            raise InputError(f"scene must be a table, found {checks.describe(self.scene)}.")
        known = [f.name for f in dataclasses.fields(SceneSpec)]
        template = {name: _plain(value) for name, value in self.scene.items()}
        for name in template:
            if name not in known:
                raise InputError(f"[scene] {name} is no known key{checks.suggestion(name, known)}.")
            if name in _SET_BY_GRID:
                raise InputError(f"[scene] {name} is for the section [study] to say; move or remove it.")
            if name in REFUSED:
                raise InputError(
                    f"[scene] {name} leaves no uniform phase at one temperature, of which a study could "
                    "measure Z; remove it, or use carom run."
                )
        if any(
            each.get("count") is not None
            for each in _listed(template.get("species", ()))
            if isinstance(each, Mapping)
        ):
            raise InputError(
                "[[scene.species]] of a study have no count, because n is for [study] to say; "
                "give each a fraction."
            )
        return template

    def tasks(self) -> list[Task]:
        """Return the tasks, the longest first."""
        tasks = [
            self._task(eta, n, replica)
            for eta in self.packing_fraction
            # Two values of n may give one number that fills the lattice; equal runs are no replicas.
            for n in dict.fromkeys(self._filling(eta, n) for n in self.n)
            for replica in range(self.replicas)
        ]
        return sorted(tasks, key=cost, reverse=True)

    def _filling(self, eta: float, n: int) -> int:
        """Return the number of particles of a run for which n are requested."""
        start = self._start(eta)
        return n if start == "random" else nearest_filling(start, self.dimension, n)

    def _task(self, eta: float, n: int, replica: int) -> Task:
        scene = scene_spec(
            {
                **self.scene,
                "initial": self._start(eta),
                "n": n,
                "packing_fraction": eta,
                "dimension": self.dimension,
            }
        )
        _refuse_other_interactions(scene)
        words = {
            f.name: _plain(getattr(scene, f.name))
            for f in dataclasses.fields(scene)
            if getattr(scene, f.name) not in (None, ())
        }
        return {
            "study": "equation of state",
            "version": __version__,
            "scene": words,
            "replica": replica,
            "seed": self.seed,
            "equilibration": self.equilibration,
            "collisions_per_particle": self._length(eta, n),
            "relative_error": self._error(),
            "blocks": self.blocks,
            "frames": self._frames(eta),
            "neighbors": self.neighbors,
        }

    def _start(self, eta: float) -> str:
        """Return ``initial`` of a scene; "auto" depends on the density."""
        if self.initial != "auto":
            return self.initial
        if "species" in self.scene:
            return "random"
        d = self.dimension
        middle = 0.5 * (theory.FREEZING.get(d, 1.0) + theory.MELTING.get(d, 1.0))
        return "random" if eta < middle else {2: "triangular", 3: "fcc"}.get(d, "dn")

    def _length(self, eta: float, n: int) -> float:
        """Return the collisions per particle that reach the error, rounded to four digits."""
        if self.collisions_per_particle is not None:
            return self.collisions_per_particle
        assert self.relative_error is not None
        collisions = (EXCESS * excess_part(eta, self.dimension) / self.relative_error) ** 2
        # Rounded, because powers and logarithms differ in the last bit between machines.
        return float(f"{max(2.0 * collisions / n / self.replicas, FEWEST):.4g}")

    def _error(self) -> float | None:
        """Return the relative error that each replica has to reach, so that their mean reaches the goal."""
        if self.relative_error is None:
            return None
        return float(f"{self.relative_error * math.sqrt(self.replicas):.6g}")

    def _frames(self, eta: float) -> int:
        if self.frames is not None:
            return self.frames
        return (
            min(FRAMES, self.blocks)
            if eta > theory.NEAR_FREEZING * theory.FREEZING.get(self.dimension, 1.0)
            else 0
        )

    def settings(self) -> dict[str, Any]:
        """Return the settings that all tasks share, which must be the same for all studies in one folder."""
        shared = {name: value for name, value in self.words().items() if name not in GRID}
        if self.relative_error is not None:
            # The length of a run then depends on the number of replicas.
            shared["replicas"] = self.replicas
        return {"study": "equation of state", "version": __version__, **shared}

    def words(self) -> dict[str, Any]:
        """Return the section ``[study]`` as JSON values."""
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in values.items()
            if value is not None
        }


GRID = ("packing_fraction", "n", "replicas")

LENGTHS = ("relative_error", "collisions_per_particle")
"""Fields of which each says how long runs are."""


def replaced(words: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a file, and in their place those that are given.

    A length takes the place of the other. The densities of one dimension mean nothing in another.
    """
    kept = dict(words)
    if any(given.get(name) is not None for name in LENGTHS):
        kept = {name: value for name, value in kept.items() if name not in LENGTHS}
    if given.get("dimension", words["dimension"]) != words["dimension"]:
        kept.pop("packing_fraction", None)
    return {**kept, **given}


def excess_part(eta: float, dimension: int) -> float:
    """Return ``(Z - 1) / Z`` by theory, or its upper bound 1 where there is no theory."""
    if dimension > 6:
        return 1.0
    crystal = eta > theory.FREEZING.get(dimension, 1.0)
    z = float((theory.solid if crystal else theory.best)(dimension)(min(eta, 0.999 * _close(dimension))))
    return max(0.0, (z - 1.0) / z)


def _refuse_other_interactions(scene: SceneSpec) -> None:
    """Raise InputError if a scene has another interaction than steps that conserve the energy."""
    if scene.interaction is None:
        return
    if not hasattr(scene.interaction, "steps"):
        raise InputError(
            f"[scene] interaction of a study must be of steps, found {checks.describe(scene.interaction)}; "
            "leave it out for hard cores, or use carom run."
        )
    if not scene.interaction.conserves(scene.diameter or 1.0):
        raise InputError(
            "[scene] interaction has hysteretic steps, which lose energy and keep no temperature; leave out "
            "leaving, or use carom run."
        )


def scene_spec(words: Mapping[str, Any]) -> SceneSpec:
    """Return the scene that JSON values describe."""
    return SceneSpec(**{name: _tuples(value) for name, value in words.items()})


def nearest_filling(start: str, dimension: int, n: int) -> int:
    """Return the number nearest to ``n`` that fills a lattice with equally many cells along every axis."""
    lattice = {"cubic": lattices.cubic, "dn": lattices.dn, "fcc": lattices.dn}.get(start)
    chosen = lattices.triangular() if lattice is None else lattice(dimension)
    edge = (n / len(chosen.basis) * math.prod(chosen.shape)) ** (1.0 / chosen.dimension)
    sizes = (chosen.count(lattices.cells_along(chosen, max(1, int(edge) + k))) for k in (-1, 0, 1, 2))
    return min(sizes, key=lambda size: (abs(size - n), size))


def _close(dimension: int) -> float:
    return theory.CLOSE_PACKING[dimension]


def _plain(value: Any) -> Any:
    """Return a value of a scene as JSON values."""
    if isinstance(value, Mapping):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, SpeciesSpec):
        return {name: item for name, item in dataclasses.asdict(value).items() if item is not None}
    if isinstance(value, tuple(obstacles.KINDS.values())):
        return _plain(to_tables.obstacle_to_table(value))  # type: ignore[arg-type]
    if hasattr(value, "to_table"):  # an interaction, as a file has it
        return _plain(dict(value.to_table()))
    if isinstance(value, float) and math.isinf(value):  # a hard core; JSON knows no such number
        return str(value)
    return value


def _tuples(value: Any) -> Any:
    """Return a value with tuples in place of lists."""
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value


def _listed(values: Any) -> list[Any]:
    """Return one value, or several, as a list."""
    if isinstance(values, Iterable) and not isinstance(values, str | Mapping):
        return [value.item() if hasattr(value, "item") else value for value in values]
    return [values.item() if hasattr(values, "item") else values]


def _distinct(name: str, values: list[Any]) -> tuple[Any, ...]:
    """Return the values sorted; none or a repeated one is an error."""
    if not values:
        raise InputError(f"{name} must hold at least one value, found none.")
    if len(set(values)) < len(values):
        raise InputError(f"{name} names a value twice; replicas= repeats a point.")
    return tuple(sorted(values))
