"""The common part of all tasks on a worker: their start and their record."""

from __future__ import annotations

import os
import platform
import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.random import default_rng

from carom import checks
from carom.errors import InputError
from carom.scene.scene import Scene
from carom.simulation.equilibration import Equilibration, exchanges
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.eos.spec import scene_spec
from carom.studies.eos.start import start
from carom.studies.tasks import Record, Task, stream
from carom.version import __version__


def refuse_other_version(task: Task) -> None:
    """Raise InputError if the worker has another version of Carom than the task asks for."""
    if task["version"] != __version__:
        raise InputError(
            f"This worker has Carom {__version__} and the study is of {task['version']}; "
            "install the same version everywhere."
        )


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
        collisions = checks.collisions_of(length, sim.n)
        Equilibration(sim, task["scene"].get("kT", 1.0), collisions).run(look)
    else:
        sim.run(collisions_per_particle=length, progress=look)


class Stopwatch:
    """The time at which a task began; :meth:`record` notes its duration and its machine."""

    def __init__(self) -> None:
        self._began, self._clock_time = clock.perf_counter(), clock.time()

    def record(self, task: Task, result: dict[str, Any], sim: Simulation) -> Record:
        """Return the record of a finished task."""
        return {
            "task": task,
            "result": result,
            "provenance": {
                "began": self._clock_time,
                "seconds": clock.perf_counter() - self._began,
                "engine_seconds": sim._state.seconds,
                "host": platform.node(),
                "process": os.getpid(),
                "python": platform.python_version(),
                "numpy": np.__version__,
            },
        }
