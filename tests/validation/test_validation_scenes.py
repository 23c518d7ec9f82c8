"""Mixtures, walls, obstacles and lost energy against exact and published values.

The long ones, whose figures docs/how.md and docs/benchmarks.md show:
``pytest -m slow -s tests/validation/test_validation_scenes.py``.
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from helpers.mixtures import mixed, mixture
from helpers.oracle_scenes import moving

import carom
from carom import theory
from carom.models import Ball
from carom.observables import blocking
from carom.simulation.measuring import stretches

DATA = Path(__file__).parents[1] / "data"
FOUR_ERRORS = 4.0
MIXTURE = json.loads((DATA / "mixtures.json").read_text())["data"][0]
BOX = json.loads((DATA / "few_body_exact.json").read_text())["box_N2"]

BMCSL_ACCURACY = 4e-3
"""Of Z, as `tests/data/mixtures.json` has it."""

CONTACT_ACCURACY = 1.5e-2
"""Of the contact values that go with it: those of the smaller pairs, with fewer digits than Z."""

DISKS_ACCURACY = 2e-3
"""Of Z of disks; at a packing fraction of 0.6 and a ratio of 1.4 it is 1e-3."""


def scatter(values):
    """Return mean and error of independent values."""
    values = np.array(values)
    return values.mean(), values.std(ddof=1) / math.sqrt(len(values))


# Mixtures.


def check_mixture(scene, collisions, expected, accuracy, error=0.0):
    sim = carom.Simulation(scene, seed=5, tuning=carom.Tuning(neighbors="lists"))
    sim.run(collisions_per_particle=200)
    counts, began = sim.collisions_by_species, sim.time
    found = sim.measure(carom.Pressure(), collisions=collisions).Z
    rates = (sim.collisions_by_species - counts) / (sim.time - began)
    print(f"d={scene.dimension}: Z = {found.mean:.4f} +- {found.error:.4f}, expected {expected:.4f}")
    assert abs(found.mean - expected) < FOUR_ERRORS * math.hypot(found.error, error) + accuracy * expected
    assert sim.statistics.worst_overlap < 1e-12
    return sim, rates, found


def disks(n, eta, ratio=1.4):
    scene = mixture(
        fractions=[0.5, 0.5],
        diameters=[ratio, 1.0],
        masses=[2.0, 0.5],
        n=n,
        dimension=2,
        packing_fraction=eta,
        seed=1,
    )
    return scene, theory.santos_yuste_lopez_de_haro(eta, [0.5, 0.5], [ratio, 1.0], 2)


def test_binary_disks_quickly():
    scene, expected = disks(256, 0.45)
    check_mixture(scene, 200_000, expected, DISKS_ACCURACY)


@pytest.mark.slow
@pytest.mark.parametrize("eta", [0.3, 0.5, 0.6])
def test_binary_disks(eta):
    scene, expected = disks(1024, eta)
    check_mixture(scene, 4_000_000, expected, DISKS_ACCURACY)


@pytest.mark.slow
def test_binary_spheres():
    row = MIXTURE
    half = row["N"] // 2
    scene = carom.Scene.random(
        species=mixed(counts=[half, half], diameters=row["sigma"], masses=row["m"]),
        packing_fraction=row["eta"],
        seed=1,
    )
    sim, rates, found = check_mixture(scene, 6_000_000, row["Z"], 0.0, row["err"])
    bmcsl = float(theory.bmcsl(row["eta"], row["x"], row["sigma"]))
    assert abs(found.mean - bmcsl) < FOUR_ERRORS * found.error + BMCSL_ACCURACY * bmcsl
    contact = theory.bmcsl_contact_value(row["eta"], row["x"], row["sigma"])
    factor = theory.speed_factor(sim.degrees_of_freedom)
    for i, j in ((0, 0), (0, 1), (1, 1)):
        diameter = 0.5 * (row["sigma"][i] + row["sigma"][j])
        reduced = row["m"][i] * row["m"][j] / (row["m"][i] + row["m"][j])
        others = half - (i == j)
        each = theory.species_collision_rate(
            others / scene.volume, contact[i, j], diameter, reduced, 3, kT=sim.kT
        )
        expected = each * half * (0.5 if i == j else 1.0) * factor
        print(f"species {i} and {j}: {rates[i, j]:.2f} collisions a time, with BMCSL's g {expected:.2f}")
        assert abs(rates[i, j] - expected) < CONTACT_ACCURACY * expected


@pytest.mark.slow
@pytest.mark.parametrize("number", range(10))
def test_mixtures_drawn_at_random(number):
    rng = np.random.default_rng([2026, number])
    dimension = 2 if number % 2 else 3
    ratio, part = math.exp(rng.uniform(math.log(1.2), math.log(5.0))), rng.uniform(0.1, 0.9)
    eta, n = rng.uniform(0.1, 0.6 if dimension == 2 else 0.45), int(rng.integers(500, 2001))
    masses = np.exp(rng.uniform(-2.0, 2.0, 2))
    scene = carom.Scene.random(
        n=n,
        species=mixed(fractions=[part, 1.0 - part], diameters=[ratio, 1.0], masses=masses),
        dimension=dimension,
        packing_fraction=eta,
        seed=rng,
    )
    eta, x = scene.packing_fraction, np.bincount(scene.species) / n
    theories = {"SYH": theory.santos_yuste_lopez_de_haro(eta, x, [ratio, 1.0], dimension)}
    if dimension == 3:
        theories["BMCSL"] = theory.bmcsl(eta, x, [ratio, 1.0])
    sim = carom.Simulation(scene, kT=1.0, seed=rng)
    sim.run(collisions_per_particle=500)
    z = sim.measure(carom.Pressure(), collisions=1_500_000).Z
    # What N costs a mixture is not known here; it is what it costs a fluid of equal spheres, twice at most.
    shift = 2.0 * abs(theory.finite_size_shift(eta, n, theory.best(dimension)))
    beside = ", ".join(f"{name} {value:.4f} ({value / z.mean - 1:+.2%})" for name, value in theories.items())
    print(
        f"d={dimension} N={n} ratio {ratio:.2f} large {x[0]:.3f} eta {eta:.4f}: "
        f"Z = {z.mean:.4f} +- {z.error:.4f}, {beside}, 1/N at most {shift / z.mean:.2%}"
    )
    best = theories.get("BMCSL", theories["SYH"])
    assert abs(z.mean - best) < FOUR_ERRORS * z.error + shift + BMCSL_ACCURACY * best


def test_equipartition_of_few_unequal_disks():
    # <m_i v_i^2> = d kT (1 - m_i / M) where the momentum is zero: 13 % less for these heavy ones than d kT.
    scene = mixture(
        [4, 20], diameters=[1.0, 0.8], masses=[8.0, 1.0], dimension=2, packing_fraction=0.4, seed=2
    )
    sim = carom.Simulation(scene, seed=3, tuning=carom.Tuning(neighbors="lists"))
    sim.run(collisions=1000)
    energies = []
    for frame in sim.sample(every=0.5, count=4000):
        each = scene.masses * (frame.velocities**2).sum(axis=1)
        energies.append([each[scene.species == k].mean() for k in (0, 1)])
    for k, mass in ((0, 8.0), (1, 1.0)):
        found = blocking(np.array(energies)[:, k])
        exact = 2.0 * sim.kT * (1.0 - mass / scene.masses.sum())
        assert found.error < 0.02 * exact
        assert abs(found.mean - exact) < FOUR_ERRORS * found.error


# Walls. A ball in a corner that nobody reaches makes the scenes of the fast tests of one type.


def boxed(n, d, diameter, edge=1.0, seed=1, ball=None):
    """Return n spheres in a box with walls on all sides, and a fixed ball."""
    if ball is None:
        ball = Ball((0.0,) * d, 0.05 * diameter, "corner")
    scene = carom.Scene.random(
        n, dimension=d, box=edge, diameter=diameter, walls=True, obstacles=(ball,), seed=seed
    )
    return carom.Simulation(scene, seed=seed, tuning=carom.Tuning(neighbors="sectors", images=False))


def two_in_a_box(row, collisions, starts=32):
    """Return pressures on the walls, virials, and rates of collisions, as (mean, error), from many starts."""
    found = []
    d = row["d"]
    time = collisions / starts / row["pair_collisions_per_time"]
    for seed in range(starts):
        sim = boxed(2, d, row["sigma"], seed=seed)
        sim.run(time=10.0)
        before = [impact.hits for impact in sim.obstacles]
        block = sim.run(time=time)
        hits = [impact.hits - old for impact, old in zip(sim.obstacles, before, strict=True)]
        assert hits[-1] == 0
        assert block.impulses[-1] == 0.0
        pressure = sum(block.impulses) / (2 * d * time * sim.kT)
        virial = 1.0 + block.virial / (2 * d * sim.kT * time)
        found.append((pressure, virial, sum(hits) / time, block.collisions / time))
    return [scatter(values) for values in zip(*found, strict=True)]


def check_box(row, collisions):
    found = two_in_a_box(row, collisions)
    exact = [
        row[name] for name in ("betaP_wall", "R", "wall_collisions_per_time", "pair_collisions_per_time")
    ]
    for name, (mean, error), right in zip(("P / kT", "Z", "hits", "collisions"), found, exact, strict=True):
        print(f"d={row['d']} sigma={row['sigma']}: {name} = {mean:.5f} +- {error:.5f}, exact {right:.5f}")
        assert abs(mean - right) < FOUR_ERRORS * error
        assert error < 0.05 * right
    return found


@pytest.mark.parametrize("row", BOX[:1], ids=lambda row: f"d={row['d']} sigma={row['sigma']}")
def test_two_disks_in_a_box(row):
    check_box(row, 40_000)


@pytest.mark.slow
@pytest.mark.parametrize("row", BOX, ids=lambda row: f"d={row['d']} sigma={row['sigma']}")
def test_two_spheres_in_a_box_to_a_thousandth(row):
    found = check_box(row, 4_000_000)
    assert all(error < 2e-3 * mean for mean, error in found)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_disks_in_a_box_obey_the_virial_theorem_of_the_walls(n):
    # Summed over the axes, force on a wall times free length is 2 K + W / t, but for what a path of finite
    # length leaves at its ends: n d m v (L - sigma) once, at most twice over.
    sim = boxed(n, 2, 0.3, edge=1.2, seed=n)
    sim.run(time=10.0)
    time = 2000.0
    block = sim.run(time=time)
    free = 1.2 - 0.3
    twice_kinetic = sim.degrees_of_freedom * sim.kT
    walls = 0.5 * free * sum(block.impulses) / time
    ends = 2.0 * math.sqrt(n * 2 * twice_kinetic) * free / time
    assert abs(walls - twice_kinetic - block.virial / time) < ends
    assert sim.degrees_of_freedom == 2 * n


def free_path(make, starts, time):
    """Return the mean length of flight between two hits, and its error, of single components."""
    lengths = []
    for seed in range(starts):
        sim = make(seed)
        speed = float(np.linalg.norm(sim.frame().velocities[0]))
        sim.run(time=time / speed)
        lengths.append(time / sum(impact.hits for impact in sim.obstacles))
    return scatter(lengths)


def check_path(name, make, exact, starts, time):
    mean, error = free_path(make, starts, time)
    print(f"{name}: mean free path {mean:.5f} +- {error:.5f}, exact {exact:.5f}")
    assert abs(mean - exact) < FOUR_ERRORS * error
    return error / mean


def sinai(seed, edge=2.0, diameter=0.2, radius=0.5):
    return boxed(1, 2, diameter, edge=edge, seed=seed, ball=Ball((edge / 2, edge / 2), radius))


def sinai_path(edge=2.0, diameter=0.2, radius=0.5):
    """Return pi A / perimeter of what a center can reach."""
    room, contact = edge - diameter, radius + 0.5 * diameter
    return math.pi * (room**2 - math.pi * contact**2) / (4.0 * room + 2.0 * math.pi * contact)


def test_the_free_path_in_sinai_s_billiard():
    assert check_path("Sinai's billiard", sinai, sinai_path(), 16, 4000.0) < 0.01


@pytest.mark.slow
def test_the_free_path_in_sinai_s_billiard_to_a_thousandth():
    assert check_path("Sinai's billiard", sinai, sinai_path(), 64, 100_000.0) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
def test_the_free_path_of_a_lorentz_gas(d):
    # Balls so large that no straight line of infinite length is free, nearly: pi A / perimeter, 4 V / S.
    edge, radius, size = 1.0, 0.3, 0.06
    contact = radius + 0.5 * size
    centers = [(0.1,) * d, (0.6,) * d]

    def make(seed):
        scene = carom.Scene.random(
            1,
            dimension=d,
            box=edge,
            diameter=size,
            obstacles=[Ball(center, radius) for center in centers],
            seed=seed,
        )
        return carom.Simulation(scene, seed=seed, tuning=carom.Tuning(neighbors="sectors"))

    room = edge**d - 2 * theory.ball_volume(d, 2 * contact)
    surface = 2 * d * theory.ball_volume(d, 2 * contact) / contact
    exact = (math.pi if d == 2 else 4.0) * room / surface
    assert check_path(f"Lorentz gas, d={d}", make, exact, 64, 50_000.0) < 1e-3


@pytest.mark.slow
def test_the_density_at_a_wall_is_the_pressure_over_kT():
    sigma = 1.0
    scene = moving(carom.Scene.random(400, box=(14.0, 34.0), walls="y", seed=1), 2)
    sim = carom.Simulation(scene, seed=0)
    sim.run(collisions_per_particle=200)
    heights, blocks, width = [], [], 0.02
    edges = np.arange(0.0, 0.3 + 0.5 * width, width)
    for _ in range(64):
        counts = np.zeros(len(edges) - 1)
        start = sim.time
        hits = np.array([impact.impulse for impact in sim.obstacles])
        for frame in sim.sample(every=0.2, count=500):
            y = frame.positions[:, 1] - 0.5 * sigma
            counts += np.histogram(np.concatenate([y, scene.box[1] - sigma - y]), edges)[0]
        heights.append(counts / (500 * 2 * scene.box[0] * width))
        taken = np.array([impact.impulse for impact in sim.obstacles]) - hits
        blocks.append(taken.mean() / (sim.time - start) / scene.box[0])
    pressure, error = scatter(blocks)
    # The profile falls from its contact value as smoothly as g(r); a parabola in ln n over 0.3 diameters.
    middle = 0.5 * (edges[1:] + edges[:-1])
    density, off = scatter([math.exp(np.polyfit(middle, np.log(row), 2)[-1]) for row in heights])
    print(f"density at the wall {density:.4f} +- {off:.4f}, P / kT {pressure / sim.kT:.4f} +- {error:.4f}")
    assert off < 5e-3 * density
    # A cubic differs from the parabola by what is left of the profile: 2e-3.
    assert abs(density - pressure / sim.kT) < FOUR_ERRORS * math.hypot(off, error / sim.kT) + 2e-3 * density


@pytest.mark.slow
def test_the_pressure_on_far_walls_is_the_virial_pressure_of_the_bulk():
    # A bulk at the density between the walls far from them, in a periodic box.
    scene = moving(carom.Scene.random(2000, box=(30.0, 105.0), walls="y", seed=1), 2)
    sim = carom.Simulation(scene, seed=0)
    sim.run(collisions_per_particle=300)
    inner = []
    blocks = []
    for _ in range(32):
        # As long as sound takes to cross the box: what strikes a wall in less is paid back in the next block.
        blocks.extend(stretches.blocks(sim, 20.0, 1))
        y = sim.frame().positions[:, 1]
        inner.append(np.count_nonzero(np.abs(y - 52.5) < 45.0) / (30.0 * 90.0))
    density, spread = scatter(inner)
    walls = [stretches.estimate(sim, carom.WallPressure(k), blocks).pressure for k in (0, 1)]
    eta = density * math.pi / 4.0
    z = float(theory.best(2)(eta))
    step = 1e-4
    slope = (float(theory.best(2)(eta + step)) * (eta + step) - z * eta) / step  # of P / kT by the density
    for pressure in walls:
        found, expected = pressure.mean / sim.kT, density * z
        error = math.hypot(pressure.error / sim.kT, slope * spread)
        print(f"P / kT at a wall {found:.4f} +- {error:.4f}, of the bulk at {density:.4f}: {expected:.4f}")
        assert error < 0.01 * expected
        assert abs(found - expected) < FOUR_ERRORS * error


# Lost energy.


HAFF_ACCURACY = 0.01
"""Of the temperature with the first Sonine coefficient, at a restitution of 0.9."""


@pytest.mark.slow
def test_granular_gas_cools_by_haff_s_law():
    # T = T0 exp(-(1 - e^2) C / d) with C collisions a particle, for a Maxwellian. The first Sonine
    # coefficient a2 of the cooling state takes the loss to (1 + 3 a2 / 16) and the rate to (1 - a2 / 16) of
    # that.
    e, d = 0.9, 3
    a2 = 16 * (1 - e) * (1 - 2 * e * e) / (9 + 24 * d + 8 * d * e - 41 * e + 30 * e * e * (1 - e))
    loss = (1.0 - e * e) / d * (1.0 + 0.25 * a2)
    logarithms = []
    for seed in range(8):
        sim = carom.Simulation(
            carom.Scene.random(1000, dimension=d, density=0.1, seed=seed).replace(impact=e), seed=seed
        )
        start, row = sim.kT, []
        for _ in range(6):
            sim.run(collisions_per_particle=20)
            row.append(math.log(sim.kT / start))
        logarithms.append(row)
        assert sim.statistics.worst_overlap < 1e-12
        assert sim.statistics.spared_contacts < 0.05 * sim.collisions
    for k, column in enumerate(np.transpose(logarithms), start=1):
        mean, error = scatter(column)
        exact = -loss * 20 * k
        print(
            f"{20 * k} collisions a particle: T / T0 = {math.exp(mean):.3e} ({error:.1%}), "
            f"Haff {math.exp(exact):.3e}"
        )
        assert abs(mean - exact) < FOUR_ERRORS * error + HAFF_ACCURACY
