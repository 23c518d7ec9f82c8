"""Pair collisions per second: `pytest tests/benchmarks`. Only ratios within one run mean anything."""

import time

import pytest

import carom
from carom.reference import NaiveSystem

COLLISIONS = 200_000


@pytest.mark.parametrize("packing_fraction", [0.05, 0.30, 0.49])
def test_rate_at_4000_spheres(benchmark, packing_fraction):
    scene = carom.Scene.fcc(cells=10, packing_fraction=packing_fraction)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=60)  # compiled, and no longer a lattice
    began, before = time.process_time(), sim.collisions
    benchmark.pedantic(lambda: sim.run(collisions=COLLISIONS), rounds=3)
    rate = (sim.collisions - before) / (time.process_time() - began)
    benchmark.extra_info["million collisions per CPU second"] = round(rate / 1e6, 3)
    assert sim.collisions - before == 3 * COLLISIONS


def test_rate_of_the_naive_algorithm(benchmark):
    scene = carom.Scene.random(100, packing_fraction=0.3, seed=1)
    velocities = carom.Simulation(scene, seed=1).frame().velocities
    system = NaiveSystem(scene.positions, velocities, scene.box, arithmetic="float")

    def run():
        for _ in range(20):
            system.step()

    benchmark.pedantic(run, rounds=3)
    assert system.collisions == 60
