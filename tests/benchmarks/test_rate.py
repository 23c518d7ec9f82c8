"""Pair collisions per second: `pytest tests/benchmarks`. Only ratios within one run mean anything."""

import time

import numpy as np
import pytest

import carom
from carom.reference import NaiveSystem

COLLISIONS = 200_000

# Cells of the densest lattice along an edge, and packing fractions: some 4000 and 32 000 components.
GRID = {
    1: ((4000, 32_000), (0.3, 0.7)),
    2: ((45, 126), (0.3, 0.69)),
    3: ((10, 20), (0.05, 0.30, 0.49, 0.60)),
    4: ((5, 8), (0.05, 0.20)),
}
CASES = [(d, cells, eta) for d, (sizes, etas) in GRID.items() for cells in sizes for eta in etas]


def measure(benchmark, sim):
    sim.run(collisions_per_particle=40)  # compiled, and no longer a lattice
    began, before = time.process_time(), sim.collisions
    benchmark.pedantic(lambda: sim.run(collisions=COLLISIONS), rounds=3)
    rate = (sim.collisions - before) / (time.process_time() - began)
    benchmark.extra_info["million collisions per CPU second"] = round(rate / 1e6, 3)
    assert sim.collisions - before == 3 * COLLISIONS


@pytest.mark.parametrize(("dimension", "cells", "packing_fraction"), CASES)
def test_rate_of_equal_spheres(benchmark, dimension, cells, packing_fraction):
    scene = carom.Scene.crystal(cells=cells, dimension=dimension, packing_fraction=packing_fraction)
    measure(benchmark, carom.Simulation(scene, seed=1))


@pytest.mark.parametrize(
    ("dimension", "packing_fraction"), [(2, 0.3), (2, 0.6), (3, 0.05), (3, 0.3), (3, 0.49)]
)
@pytest.mark.parametrize("ratio", [1.4, 5.0])
def test_rate_of_unequal_spheres(benchmark, dimension, packing_fraction, ratio):
    big = round(4000 / (1 + ratio**dimension)) if ratio > 2 else 2000
    scene = carom.Scene.random(
        species=[
            carom.Species(count=big),
            carom.Species(count=4000 - big, diameter=1.0 / ratio, mass=ratio**-dimension),
        ],
        dimension=dimension,
        packing_fraction=packing_fraction,
        seed=1,
    )
    measure(benchmark, carom.Simulation(scene, seed=1))


def test_rate_of_the_naive_algorithm(benchmark):
    scene = carom.Scene.random(100, packing_fraction=0.3, seed=1)
    velocities = carom.Simulation(scene, seed=1).frame().velocities
    system = NaiveSystem(scene.positions, velocities, scene.box, arithmetic="float")

    def run():
        for _ in range(20):
            system.step()

    benchmark.pedantic(run, rounds=3)
    assert system.collisions == 60
    assert np.isfinite(system.positions.astype(float)).all()
