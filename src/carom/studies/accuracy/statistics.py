"""Where the CPU is best spent: the error of Z against N, and that of g(r) against the sampling interval."""

from __future__ import annotations

import math
import time as clock
import warnings
from collections.abc import Callable
from dataclasses import dataclass

from carom import theory
from carom.errors import CaromError, CaromWarning
from carom.observables import RDF, Pressure
from carom.scene import lattices
from carom.scene.scene import Scene
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning

SIZES = (108, 256, 500, 864, 2048, 4000, 10976, 32000)
"""Numbers of particles to compare; the nearest that fill a lattice are taken."""

INTERVALS = (0.1, 0.3, 1.0, 3.0, 10.0)
"""Sampling intervals to compare [mean free times]."""

MELTING = 100
"""Collisions per particle that melt a lattice."""


@dataclass(frozen=True)
class SizeRow:
    """Cost and error of Z at one N.

    Attributes
    ----------
    n : int
    collisions_per_second : float
        Per CPU second.
    z, error : float
        Compressibility factor and its standard error.
    relative_error_1s : float
        The relative error after one CPU second; it falls with the square root of the time.
    finite_size_bias : float
        Relative difference between Z of n particles and of infinitely many; nan without a theory.
    corrected_bias, corrected_error : float
        The same after the correction to leading order, measured against theory, and its standard error.
    break_even : float
        CPU seconds after which the uncorrected bias is larger than the statistical error.
    """

    n: int
    collisions_per_second: float
    z: float
    error: float
    relative_error_1s: float
    finite_size_bias: float
    corrected_bias: float
    corrected_error: float
    break_even: float


@dataclass(frozen=True)
class SamplingRow:
    """Cost and error of g(r) at one sampling interval.

    Attributes
    ----------
    interval : float
        Between two frames [mean free times].
    frames : int
    contact_error : float
        Relative error of the contact value from g(r).
    g_error : float
        Mean relative error of g in bins of 0.02 diameters, up to two diameters.
    cpu_seconds : float
        For the run, the frames and g(r) together.
    """

    interval: float
    frames: int
    contact_error: float
    g_error: float
    cpu_seconds: float


def sizes(
    dimension: int, packing_fraction: float, seed: int, seconds: float, progress: Callable[[float], object]
) -> list[SizeRow]:
    """Measure Z at different N, each for the same CPU time."""
    lattice = lattices.densest(dimension)
    rows, seen = [], set()
    for k, wanted in enumerate(SIZES):
        progress(k / len(SIZES))
        cells = round((wanted / len(lattice.basis) * math.prod(lattice.shape)) ** (1.0 / dimension))
        scene = Scene.crystal(cells=max(cells, 2), dimension=dimension, packing_fraction=packing_fraction)
        if scene.n not in seen:
            seen.add(scene.n)
            rows.append(_size(scene, seed, seconds))
    return rows


def _size(scene: Scene, seed: int, seconds: float) -> SizeRow:
    """Measure Z of a scene for so many CPU seconds."""
    sim = Simulation(scene, seed=seed, tuning=Tuning(images=False))
    sim.run(collisions=1)  # compiles
    sim.run(collisions_per_particle=MELTING)
    began, before = clock.process_time(), sim.collisions
    sim.run(walltime=0.1 * seconds)
    pace = (sim.collisions - before) / (clock.process_time() - began)
    began, before = clock.process_time(), sim.collisions
    # A run of less than twenty collisions per particle would not resolve the correlation of the virial.
    found = sim.measure(Pressure(), collisions=round(max(pace * seconds, 10.0 * scene.n)), blocks=512)
    spent = clock.process_time() - began
    z = found.Z
    relative = z.relative_error * math.sqrt(spent)
    try:
        equation = theory.best(scene.dimension)
        true = float(equation(scene.packing_fraction))
        bias = float(theory.finite_size_shift(scene.packing_fraction, scene.n, equation)) / true
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CaromWarning)  # small boxes are meant here
            corrected = found.infinite_size().mean / true - 1.0
    except CaromError:
        bias = corrected = math.nan
    return SizeRow(
        n=scene.n,
        collisions_per_second=(sim.collisions - before) / spent,
        z=z.mean,
        error=z.error,
        relative_error_1s=relative,
        finite_size_bias=bias,
        corrected_bias=corrected,
        corrected_error=z.relative_error,
        break_even=(relative / bias) ** 2 if bias else math.nan,
    )


def sampling(
    scene: Scene, mean_free_time: float, seed: int, frames: int, progress: Callable[[float], object]
) -> list[SamplingRow]:
    """Measure g(r) of one stretch of a run, sampled at different intervals."""
    rows = []
    duration = frames * INTERVALS[0] * mean_free_time
    for k, interval in enumerate(INTERVALS):
        progress(k / len(INTERVALS))
        sim = Simulation(scene, seed=seed, tuning=Tuning(images=False))
        sim.run(collisions_per_particle=MELTING)
        began = clock.process_time()
        every = interval * mean_free_time
        count = max(round(duration / every), 2)
        found = RDF(width=0.02 * scene.diameter).over(sim.sample(every=every, count=count))
        spent = clock.process_time() - began
        near = found.r < 2.0 * scene.diameter
        contact = found.contact_value
        rows.append(
            SamplingRow(
                interval=interval,
                frames=count,
                contact_error=math.nan if contact is None else contact.relative_error,
                g_error=float((found.error[near] / found.g[near]).mean()),
                cpu_seconds=spent,
            )
        )
    return rows
