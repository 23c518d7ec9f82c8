"""The engine against exact and published values.

The long ones: ``pytest -m slow tests/validation/test_validation.py``.
"""

import csv
import json
import math
from pathlib import Path

import pytest

import carom

DATA = Path(__file__).parents[1] / "data"
FOUR_ERRORS = 4.0
TORUS = json.loads((DATA / "few_body_exact.json").read_text())["torus_N2"]


def fluid(name, column):
    with (DATA / name).open() as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return {row[column]: row for row in rows}


def two_on_a_torus(row, collisions):
    """Return Z of two spheres in a cubic box, many starts: two spheres alone need not be ergodic."""
    starts = 64
    values = []
    d, edge = row["d"], row["L"]
    scene = carom.Scene([[0.0] * d, [edge / 2] * d], edge, diameter=row["sigma"])
    for seed in range(starts):
        sim = carom.Simulation(scene, seed=seed)
        sim.run(collisions=100)
        block = sim.run(time=collisions / starts * row["mean_time_between_collisions"])
        values.append(1.0 + block.virial / (2 * d * sim.kT * block.duration))
    mean = math.fsum(values) / starts
    error = math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (starts * (starts - 1)))
    return mean, error


@pytest.mark.parametrize("row", TORUS[:2], ids=lambda row: f"d={row['d']} sigma={row['sigma']}")
def test_two_disks_on_a_torus(row):
    mean, error = two_on_a_torus(row, 100_000)
    assert abs(mean - row["Z_canonical"]) < FOUR_ERRORS * error


@pytest.mark.slow
@pytest.mark.parametrize("row", TORUS, ids=lambda row: f"d={row['d']} sigma={row['sigma']}")
def test_two_spheres_on_a_torus_to_a_thousandth(row):
    mean, error = two_on_a_torus(row, 4_000_000)
    print(f"d={row['d']} sigma={row['sigma']}: Z = {mean:.6f} +- {error:.6f}, exact {row['Z_canonical']:.6f}")
    assert error < 1e-3 * mean
    assert abs(mean - row["Z_canonical"]) < FOUR_ERRORS * error


@pytest.mark.parametrize(("n", "density", "exact"), [(10, 0.5, 1.9), (10, 0.8, 4.6), (50, 0.5, 1.98)])
def test_tonks_gas(n, density, exact):
    scene = carom.Scene.random(n, dimension=1, density=density, seed=n)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=100)
    found = sim.measure(carom.Pressure(), collisions=400_000).Z
    assert abs(found.mean - exact) < FOUR_ERRORS * found.error


def check_fluid(dimension, row, scene, collisions_per_particle, target):
    sim = carom.Simulation(scene, seed=4)
    sim.run(collisions_per_particle=300)
    estimate = sim.measure(carom.Pressure(), collisions_per_particle=collisions_per_particle, blocks=512)
    found = estimate.infinite_size()
    reference = float(row["Zref_mKLM"] if dimension == 3 else row["Zref"])
    uncertainty = float(row["uncert"])
    print(f"d={dimension} eta={row['eta']}: Z = {found.mean:.5f} +- {found.error:.5f}, reference {reference}")
    assert found.error < target * found.mean
    assert abs(found.mean - reference) < FOUR_ERRORS * math.hypot(found.error, uncertainty)
    assert sim.statistics.advancement_fraction < 0.15


def test_the_fluid_of_spheres_quickly():
    row = fluid("hard_spheres_fluid.csv", "rho")["0.5000000"]
    scene = carom.Scene.crystal(cells=6, packing_fraction=float(row["eta"]))
    check_fluid(3, row, scene, 400, 5e-3)


SPHERES = ["0.1000000", "0.3000000", "0.5000000", "0.7000000", "0.8000000", "0.8500000"]


@pytest.mark.slow
@pytest.mark.parametrize("density", SPHERES)
def test_the_fluid_of_spheres(density):
    row = fluid("hard_spheres_fluid.csv", "rho")[density]
    scene = carom.Scene.crystal(cells=8, packing_fraction=float(row["eta"]))
    check_fluid(3, row, scene, 8000, 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("eta", ["0.100", "0.300", "0.400", "0.500"])
def test_the_fluid_of_disks(eta):
    row = fluid("hard_disks_fluid.csv", "eta")[eta]
    scene = carom.Scene.crystal(dimension=2, cells=32, packing_fraction=float(eta))
    check_fluid(2, row, scene, 8000, 1e-3)


@pytest.mark.slow
def test_the_fluid_in_four_dimensions_follows_its_virial_series():
    eta = 0.05
    scene = carom.Scene.crystal(cells=5, lattice="dn", dimension=4, packing_fraction=eta)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=200)
    estimate = sim.measure(carom.Pressure(), collisions_per_particle=2000)
    found = estimate.infinite_size()
    reference = carom.theory.virial_series(eta, 4)
    print(f"d=4 eta={eta}: Z = {found.mean:.5f} +- {found.error:.5f}, virial series {reference:.5f}")
    # The last known term of the series bounds what is left out of it.
    left_out = abs(reference - carom.theory.virial_series(eta, 4, order=9))
    assert abs(found.mean - reference) < FOUR_ERRORS * math.hypot(found.error, left_out)


@pytest.mark.slow
@pytest.mark.parametrize("eta", [0.05, 0.30, 0.49])
def test_ten_million_collisions_keep_energy_and_cores(eta):
    sim = carom.Simulation(carom.Scene.crystal(cells=10, packing_fraction=eta), seed=1)
    sim.run(collisions=10_000_000)
    found = sim.statistics
    print(
        f"eta={eta}: overlap {found.worst_overlap:.1e}, energy {found.energy_drift:.1e}, "
        f"momentum {found.momentum_drift:.1e}, advancements {found.advancement_fraction:.3f}"
    )
    assert found.worst_overlap < 1e-12
    assert found.energy_drift < 1e-12
    assert found.advancement_fraction < 0.15
