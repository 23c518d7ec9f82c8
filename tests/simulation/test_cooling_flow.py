"""A gas that cools holds more energy in slow transverse flow than elastic spheres do, and Z says so."""

import itertools
import math

import numpy as np
import pytest

import carom
from carom import theory
from carom.simulation.measuring import stretches

ETA = 0.2
SHORTEST = 3.5
"""Shortest wavelength that counts as flow [diameters]: shorter ones know of single spheres."""


def waves(edge):
    """Return the wave vectors of the flow in a box [2 pi / edge], one of each pair, (m, 3)."""
    most = int(edge / SHORTEST)
    vectors = np.array([n for n in itertools.product(range(-most, most + 1), repeat=3) if n > (0, 0, 0)])
    return vectors[np.sum(vectors**2, axis=1) < (edge / SHORTEST) ** 2]


def transverse_energies(frame, k):
    """Return the energy of each wave's transverse flow, (m,), in units of that of elastic spheres."""
    v = frame.velocities - frame.velocities.mean(axis=0)
    currents = np.exp(2j * np.pi / frame.box[0] * frame.positions @ k.T).T @ v
    along = np.sum(currents * k, axis=1) / np.sum(k * k, axis=1)
    flow = currents - along[:, None] * k
    # n kT / m for each of two directions, but for S(k) / n, since all together have no momentum.
    mean_square = np.sum(v * v) / (3 * (len(v) - 1))
    return np.sum(np.abs(flow) ** 2, axis=1) / (2 * len(v) * mean_square)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "restitution", "runs"), [(108, 0.95, 120), (500, 0.95, 120), (500, 1.0, 150)])
def test_transverse_flow_accounts_for_the_pressure_of_a_cooling_gas(n, restitution, runs):
    k = waves((n * math.pi / 6.0 / ETA) ** (1.0 / 3.0))
    factors, energies = [], np.zeros((runs, len(k)))
    for seed in range(runs):
        scene = carom.Scene.random(n, ETA, seed=seed).replace(impact=restitution)
        sim = carom.Simulation(scene, seed=1000 + seed)
        sim.run(collisions_per_particle=20)
        blocks = []
        for block in range(100):
            blocks.append(sim.run(collisions=n // 2))
            if block % 4 == 0:
                energies[seed] += transverse_energies(sim.frame(), k) / 25
        factors.append(stretches.estimate(sim, carom.Pressure(), blocks).Z.mean)
    z, error = np.mean(factors), np.std(factors, ddof=1) / math.sqrt(runs)
    energy = np.mean(energies, axis=0)
    shift = theory.finite_size_shift(ETA, n, theory.best(3))
    enskog = 1 + 0.5 * (1 + restitution) * (theory.best(3)(ETA) + shift - 1)
    # A sine and a cosine of two directions. Neighbors flow alike: what flow holds too much, contacts lack.
    surplus = 4 * np.sum(energy - 1) / (3 * (n - 1))
    corrected = 1 + (enskog - 1) * (1 - surplus)
    of_runs = energies[:, np.sum(k**2, axis=1) == 1].mean(axis=1)
    longest, scatter = of_runs.mean(), of_runs.std(ddof=1) / math.sqrt(runs)
    print(f"N {n}, e {restitution}: Z {z:.4f} +- {error:.4f}, Enskog {enskog:.4f}, without the flow's")
    print(f"surplus {corrected:.4f}; the longest transverse waves hold {longest:.3f} +- {scatter:.3f} kT")
    assert abs(z - corrected) < 4 * error
    if restitution == 1.0:
        assert abs(longest - 1.0) < 4 * scatter
        assert scatter < 0.016
    else:
        assert z < enskog - 3 * error
        assert longest > 1.0 + 4 * scatter
