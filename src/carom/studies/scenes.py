"""The scene of a task as plain values, and the simulation that begins with it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.random import default_rng

from carom import checks
from carom.errors import InputError
from carom.models import obstacles
from carom.models.files import to_tables
from carom.scene import lattices
from carom.scene.scene import Scene
from carom.scene_file.sections import SceneSpec, SpeciesSpec
from carom.simulation.equilibration import Equilibration, exchanges
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.folder import Task, stream
from carom.studies.start import start


def simulation_of(task: Task, check: Callable[[Scene], None] | None = None, **settings: Any) -> Simulation:
    """Return the simulation of a task at its start.

    The start does not depend on the length of the run: a longer run begins like a shorter one.

    Parameters
    ----------
    task : dict
        With ``seed``, ``scene``, ``replica`` and ``neighbors``.
    check : callable, optional
        Called with the scene; it may raise InputError.
    **settings
        Further arguments of :class:`carom.Simulation`.

    Raises
    ------
    InputError
        If the scene cannot be made, or is refused.
    """
    places, speeds = stream(task["seed"], [task["scene"], task["replica"]]).spawn(2)
    asked = scene_spec(task["scene"])
    scene = start(asked, default_rng(places))
    if check is not None:
        check(scene)
    return Simulation(
        scene,
        kT=asked.kT if scene.velocities is None else None,
        seed=int(speeds.generate_state(1, np.uint64)[0]),
        tuning=Tuning(neighbors=task["neighbors"]),
        **settings,
    )


def equilibrate(sim: Simulation, task: Task, look: Callable[[float], object]) -> None:
    """Equilibrate the simulation of a task for its time; pairs on steps are brought to its temperature."""
    length, asked = task["equilibration"], sim.scene.velocities is None
    if asked and exchanges(sim):
        Equilibration(sim, task["scene"].get("kT", 1.0), checks.collisions_of(length, sim.n)).run(look)
    else:
        sim.run(collisions_per_particle=length, progress=look)


def refuse_other_interactions(scene: SceneSpec) -> None:
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


def nearest_filling(initial: str, dimension: int, n: int) -> int:
    """Return the number nearest to ``n`` that fills a lattice with equally many cells along every axis."""
    if initial == "random":
        return n
    lattice = {"cubic": lattices.cubic, "dn": lattices.dn, "fcc": lattices.dn}.get(initial)
    chosen = lattices.triangular() if lattice is None else lattice(dimension)
    edge = (n / len(chosen.basis) * math.prod(chosen.shape)) ** (1.0 / chosen.dimension)
    sizes = (chosen.count(lattices.cells_along(chosen, max(1, int(edge) + k))) for k in (-1, 0, 1, 2))
    return min(sizes, key=lambda size: (abs(size - n), size))


def plain(value: Any) -> Any:
    """Return a value of a scene as JSON values."""
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, SpeciesSpec):
        return {name: item for name, item in dataclasses.asdict(value).items() if item is not None}
    if isinstance(value, tuple(obstacles.KINDS.values())):
        return plain(to_tables.obstacle_to_table(value))  # type: ignore[arg-type]
    if hasattr(value, "to_table"):  # an interaction, as a file has it
        return plain(dict(value.to_table()))
    if isinstance(value, float) and math.isinf(value):  # a hard core; JSON knows no such number
        return str(value)
    return value


def _tuples(value: Any) -> Any:
    """Return a value with tuples in place of lists."""
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value
