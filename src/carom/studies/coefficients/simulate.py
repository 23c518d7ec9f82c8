"""One task of a transport study: a scene, equilibrated and measured, by a plain function."""

from __future__ import annotations

import os
import platform
import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.random import default_rng

import carom
from carom.errors import InputError
from carom.frame import Frame
from carom.observables.dynamics import Dynamics
from carom.observables.moments import HelfandMoments, mean_squares
from carom.simulation.simulation import Simulation
from carom.studies.coefficients import windows
from carom.studies.eos.spec import scene_spec
from carom.studies.eos.start import start
from carom.studies.executors import Stopped
from carom.studies.tasks import Record, Task, stream


def simulate(task: Task, stop: Callable[[], bool] = lambda: False) -> Record:
    """Equilibrate and measure one run.

    Parameters
    ----------
    task : dict
        As :meth:`TransportSpec.tasks` makes it.
    stop : callable, optional
        Asked now and then; if true, the run ends with :class:`Stopped`.

    Returns
    -------
    dict
        ``task``; ``result``, whose bits depend on the task alone; and ``provenance``: where and how long.

    Raises
    ------
    InputError
        If the scene cannot be made, or the worker has another version of Carom than the task asks for.
    """
    began, clock_time = clock.perf_counter(), clock.time()
    if task["version"] != carom.__version__:
        raise InputError(
            f"This worker has Carom {carom.__version__} and the study is of {task['version']}; "
            "install the same version everywhere."
        )

    def look(_: object = None) -> None:
        if stop():
            raise Stopped

    places, speeds = stream(task["seed"], [task["scene"], task["replica"]]).spawn(2)
    asked = scene_spec(task["scene"])
    scene = start(asked, default_rng(places))
    if not scene.usual("interaction"):
        raise InputError(
            "Transport is measured of hard cores only: with another interaction components carry potential "
            "energy along, which is not in the heat current."
        )
    sim = Simulation(
        scene,
        kT=asked.kT if scene.velocities is None else None,
        seed=int(speeds.generate_state(1, np.uint64)[0]),
        neighbors=task["neighbors"],
        currents=True,
    )
    sim.run(collisions_per_particle=task["equilibration"], progress=look)
    every = task["every"]
    duration = sim.time_for(0.5 * scene.n * task["collisions_per_particle"]) / task["blocks"]
    count = max(int(duration / every), windows.SHORTEST)
    blocks = [_block(sim, every, count, look) for _ in range(task["blocks"])]
    statistics = sim.statistics
    result = {
        "n": scene.n,
        "dimension": scene.dimension,
        "box": list(scene.box),
        "packing_fraction": scene.packing_fraction,
        "kT": sim.kT,
        "masses": [float(m) for m in _by_species(scene, scene.masses)],
        "diameters": [float(s) for s in _by_species(scene, scene.diameters)],
        "counts": [int(c) for c in _counts(scene)],
        "simple": scene.simple,
        "every": every,
        "samples": count,
        "wave_time": windows.wave_time(scene, sim.kT),
        "blocks": blocks,
        "worst_overlap": statistics.worst_overlap,
        "energy_drift": statistics.energy_drift,
    }
    return {
        "task": task,
        "result": result,
        "provenance": {
            "began": clock_time,
            "seconds": clock.perf_counter() - began,
            "engine_seconds": sim.seconds,
            "host": platform.node(),
            "process": os.getpid(),
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
    }


def _block(sim: Simulation, every: float, count: int, look: Callable[[object], None]) -> dict[str, Any]:
    """Run on for a block, and return its mean squares, displacements and collisions as plain values."""
    kinds = sim.scene.species_count if sim.scene.species is not None else 0
    dynamics = [Dynamics(species=k if kinds else None) for k in range(max(kinds, 1))]

    def see(frame: Frame) -> None:
        look(None)
        for each in dynamics:
            each.update(frame)

    before = sim.tally
    moments: HelfandMoments = sim.helfand(every=every, count=count, look=see, look_every=windows.FRAME)
    after = sim.tally
    lags = [lag for lag in windows.LAGS if lag * windows.SHORTEST <= count]
    change = moments.pressure[-1] - moments.pressure[0]
    rate = float(f"{change / (every * (count - 1)):.6g}")  # near the mean, so that squares keep their digits
    found = mean_squares(moments, lags, rate)
    longest = every * count / windows.SHORTEST
    moved = []
    for each in dynamics:
        times, means = each.means()
        kept = times <= longest
        moved.append({"times": times[kept].tolist(), "means": means[kept].tolist()})
    return {
        "collisions": after.collisions - before.collisions,
        "virial": after.virial - before.virial,
        "duration": after.duration - before.duration,
        "change": float(change),
        "rate": rate,
        "shear": found.shear.tolist(),
        "heat": found.heat.tolist(),
        "bulk": found.bulk.tolist(),
        "fluxes": found.fluxes.tolist(),
        "moved": moved,
    }


def _by_species(scene: carom.Scene, values: np.ndarray) -> list[float]:
    """Return the value of each species."""
    if scene.species is None:
        return [float(values[0])]
    return [float(values[scene.species == k][0]) for k in range(scene.species_count)]


def _counts(scene: carom.Scene) -> np.ndarray:
    return np.array([scene.n]) if scene.species is None else np.bincount(scene.species)
