"""The scene of a task as plain values, and the simulation that begins with it."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.random import default_rng

from carom import checks
from carom.errors import InputError
from carom.models.interactions.bonds import Bonds
from carom.models.interfaces.particles import species_count
from carom.scene import lattices
from carom.scene.scene import Scene
from carom.scene.species import Species
from carom.scene_file import words
from carom.scene_file.fields import tuples
from carom.scene_file.sections import SceneSpec
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.folder import Task, stream
from carom.studies.start import start


def simulation_of(task: Task, check: Callable[[Scene], None] | None = None, **settings: Any) -> Simulation:
    """Return the simulation of a task at its start, which does not depend on the length of the run.

    The task has ``seed``, ``scene``, ``replica`` and perhaps ``neighbors``; ``check`` may raise InputError.
    """
    places, speeds, kicks = stream(task["seed"], [task["scene"], task["replica"]]).spawn(3)
    scene = start(scene_spec(task["scene"]), default_rng(places))
    drive: Any = scene.drive
    if hasattr(drive, "seed"):  # replicas with the same kicks would not be independent
        own = int(kicks.generate_state(1, np.uint64)[0] >> np.uint64(1))
        scene = scene.replace(drive=replace(drive, seed=own))
    if check is not None:
        check(scene)
    return Simulation(
        scene,
        kT=task["scene"]["kT"] if scene.velocities is None else None,
        seed=int(speeds.generate_state(1, np.uint64)[0]),
        tuning=Tuning(neighbors=task.get("neighbors", "auto")),
        **settings,
    )


def by_species(scene: Scene, values: np.ndarray) -> np.ndarray:
    """Return one of the values of each species; of a species without particles that of the first particle."""
    if scene.species is None:
        return values[:1]
    return values[[int(np.argmax(scene.species == k)) for k in range(species_count(scene))]]


def counts(scene: Scene) -> list[int]:
    """Return the number of particles of each species."""
    found: list[int] = [scene.n] if scene.species is None else np.bincount(scene.species).tolist()
    return found


def refuse_other_interactions(interaction: Any, diameter: float | None) -> None:
    """Raise InputError if an interaction is none of steps, without bonds, that conserve the energy."""
    if interaction is None:
        return
    if not hasattr(interaction, "steps"):
        raise InputError(
            f"[scene] interaction of a study must be of steps, found {checks.describe(interaction)}; "
            "leave it out for hard cores, or use carom run."
        )
    if isinstance(interaction, Bonds):
        raise InputError(
            "[scene] interaction has bonds, whose particles no study can place beside each other; use carom "
            "run with a start of your own."
        )
    if not interaction.conserves(diameter or 1.0):
        raise InputError(
            "[scene] interaction has hysteretic steps, which lose energy and keep no temperature; leave out "
            "leaving, or use carom run."
        )


def words_of_task(scene: SceneSpec, kT: float) -> dict[str, Any]:
    """Return a scene as the JSON values of a task.

    The random stream of a task follows from these words: other words would be other runs.
    """
    found = {name: value for name, value in plain(scene).items() if name != "lattice"}
    return {**found, "initial": scene.start, "kT": kT}


def with_fractions(scene: SceneSpec) -> tuple[Species, ...]:
    """Return the species of a scene, each with a fraction: a study says how many particles there are."""
    if not scene.counted:
        return scene.species
    total = sum(each.count for each in scene.species)
    return tuple(replace(each, count=None, fraction=each.count / total) for each in scene.species)


def refuse_long_boxes(scene: SceneSpec) -> None:
    """Raise InputError for a box with edges of its own: runs of a study are made in boxes near a cube."""
    name, edges, usual = "box", scene.box or (), (scene.box or ())[:1] * len(scene.box or ())
    if isinstance(scene.cells, tuple):
        name, edges = "cells", scene.cells
        usual = lattices.cells_along(lattices.named(scene.lattice, scene.dimension), scene.cells[0])
    if edges != usual:
        raise InputError(
            f"[scene] {name} makes a box with edges of its own, and a study makes boxes that are cubes, or "
            "nearly so on a lattice; give n and packing_fraction instead, or use carom run."
        )


def point_of(scene: SceneSpec, given: Container[str]) -> dict[str, Any]:
    """Return the point of a grid that a scene is: what it says of n, packing fraction, dimension and lattice.

    The scene is not from a file. Keys that are not ``given`` have defaults, and are for the study to say.
    """
    refuse_long_boxes(scene)
    found: dict[str, Any] = {}
    if scene.lattice is not None:
        found = {"lattice": scene.lattice}
    if "dimension" in given or "box" in given or scene.lattice is not None:
        found["dimension"] = scene.dimension
    if scene.counted or any(name in given for name in ("density", "box", "cells")):
        made = scene.build(1)
        asked = scene.packing_fraction  # which the places have to rounding
        found["packing_fraction"] = made.packing_fraction if asked is None else asked
        if scene.counted or any(name in given for name in ("n", "box", "cells")):
            found["n"] = made.n
        return found
    return found | {name: getattr(scene, name) for name in ("n", "packing_fraction") if name in given}


def scene_spec(task_words: Mapping[str, Any]) -> SceneSpec:
    """Return the scene of the words of a task."""
    kept = {name: value for name, value in task_words.items() if name not in ("initial", "kT")}
    lattice = None if task_words["initial"] == "random" else task_words["initial"]
    return SceneSpec(**tuples(kept), lattice=lattice)


def nearest_filling(start: str, dimension: int, n: int) -> int:
    """Return the number nearest to ``n`` that fills a lattice with equally many cells along every axis."""
    if start == "random":
        return n
    lattice = {"cubic": lattices.cubic, "dn": lattices.dn, "fcc": lattices.dn}.get(start)
    chosen = lattices.triangular() if lattice is None else lattice(dimension)
    edge = (n / len(chosen.basis) * math.prod(chosen.shape)) ** (1.0 / chosen.dimension)
    sizes = (chosen.count(lattices.cells_along(chosen, max(1, int(edge) + k))) for k in (-1, 0, 1, 2))
    return min(sizes, key=lambda size: (abs(size - n), size))


def plain(value: Any, name: str = "") -> Any:
    """Return a scene, or the value of one of its keys, as JSON values."""
    return _json(words.words_of(value) if isinstance(value, SceneSpec) else words.plain(value, name))


def _json(value: Any) -> Any:
    """Return a value with the infinite diameters of hard cores as text, because JSON has no such number."""
    if isinstance(value, dict):
        return {name: _json(each) for name, each in value.items()}
    if isinstance(value, list):
        return [_json(each) for each in value]
    return str(value) if isinstance(value, float) and math.isinf(value) else value
