"""Where the CPU is best spent: the error of Z against N, and that of g(r) against the sampling interval."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from typing import Any

from carom.frame import Frame
from carom.observables import RDF, Pressure
from carom.scene.scene import Scene
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.phase import finite, finite_size_shift
from carom.studies.trade.measures import theory_of

MELTING = 100
"""Collisions per particle that melt a lattice."""


def size(scene: Scene, seed: int, seconds: float, look: Callable[..., object]) -> dict[str, Any]:
    """Measure Z of a scene for so many CPU seconds."""
    sim = Simulation(scene, seed=seed, tuning=Tuning(images=False))
    sim.run(collisions=1)  # compiles
    sim.run(collisions_per_particle=MELTING, progress=look)
    began, before = clock.process_time(), sim.collisions
    sim.run(walltime=0.1 * seconds)
    pace = (sim.collisions - before) / (clock.process_time() - began)
    look()
    began, before = clock.process_time(), sim.collisions
    # A run of less than twenty collisions per particle would not resolve the correlation of the virial.
    found = sim.measure(Pressure(), collisions=round(max(pace * seconds, 10.0 * scene.n)), blocks=512)
    spent = clock.process_time() - began
    bias = corrected = None
    if (there := theory_of(scene)) is not None:
        state, equation = there
        true = float(equation(scene.packing_fraction))
        shift = finite_size_shift(state, scene.packing_fraction, scene.n, equation)
        bias, corrected = finite(shift / true), finite((found.Z.mean - shift) / true - 1.0)
    return {
        "n": scene.n,
        "Z": [found.Z.mean, found.Z.error],
        "bias": bias,
        "corrected": corrected,
        "timings": {"collisions_per_second": (sim.collisions - before) / spent, "cpu_seconds": spent},
    }


def sampling(
    scene: Scene,
    mean_free_time: float,
    seed: int,
    duration: float,
    interval: float,
    look: Callable[..., object],
) -> dict[str, Any]:
    """Measure g(r) of a stretch of a run, sampled at an interval; both in mean free times."""
    sim = Simulation(scene, seed=seed, tuning=Tuning(images=False))
    sim.run(collisions_per_particle=MELTING, progress=look)
    count = max(round(duration / interval), 2)

    def frames() -> Iterator[Frame]:
        for frame in sim.sample(every=interval * mean_free_time, count=count):
            look()
            yield frame

    began = clock.process_time()
    found = RDF(width=0.02 * scene.diameter).over(frames())
    spent = clock.process_time() - began
    near = found.r < 2.0 * scene.diameter
    contact = found.contact_value
    return {
        "interval": interval,
        "frames": count,
        "contact_error": None if contact is None else finite(contact.relative_error),
        "g_error": float((found.error[near] / found.g[near]).mean()),
        "timings": {"cpu_seconds": spent},
    }
