"""A gas that cools holds more energy in slow transverse flow than elastic spheres do, and Z says so."""

import itertools
import math

import numpy as np
import pytest

import carom
from carom import theory

ETA = 0.2
WAVES = [n for n in itertools.product(range(-1, 2), repeat=3) if n > (0, 0, 0)]
"""Wave vectors of the three longest wavelengths [2 pi / edge], one of each pair: 3, 6 and 4 of them."""


def transverse_energies(frame):
    """Return the energy of each wave's transverse flow, (13,), in units of that of elastic spheres."""
    v = frame.velocities - frame.velocities.mean(axis=0)
    k = np.array(WAVES)
    currents = np.exp(2j * np.pi / frame.box[0] * frame.positions @ k.T).T @ v
    along = np.sum(currents * k, axis=1) / np.sum(k * k, axis=1)
    flow = currents - along[:, None] * k
    # n kT / m for each of two directions, but for S(k) / n, since all together have no momentum.
    mean_square = np.sum(v * v) / (3 * (len(v) - 1))
    return np.sum(np.abs(flow) ** 2, axis=1) / (2 * len(v) * mean_square)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "restitution", "runs"), [(108, 0.95, 120), (500, 0.95, 40), (500, 1.0, 40)])
def test_transverse_flow_accounts_for_the_pressure_of_a_cooling_gas(n, restitution, runs):
    factors, energies = [], []
    for seed in range(runs):
        scene = carom.Scene.random(n, 3, packing_fraction=ETA, seed=seed).with_(restitution=restitution)
        sim = carom.Simulation(scene, seed=1000 + seed)
        sim.run(collisions_per_particle=20)
        blocks = []
        for k in range(100):
            blocks.append(sim.run(collisions=n // 2))
            if k % 4 == 0:
                energies.append(transverse_energies(sim.frame()))
        factors.append(sim.estimate(carom.Pressure(), blocks).compressibility_factor.mean)
    z, error = np.mean(factors), np.std(factors, ddof=1) / math.sqrt(runs)
    energy = np.mean(energies, axis=0)
    shift = theory.finite_size_shift(ETA, n, theory.carnahan_starling)
    enskog = 1 + 0.5 * (1 + restitution) * (theory.carnahan_starling(ETA) + shift - 1)
    # A sine and a cosine of two directions. Neighbours flow alike: what flow holds too much, contacts lack.
    surplus = 4 * np.sum(energy - 1) / (3 * (n - 1))
    corrected = 1 + (enskog - 1) * (1 - surplus)
    longest = energy[[sum(map(abs, k)) == 1 for k in WAVES]].mean()
    print(f"N {n}, e {restitution}: Z {z:.4f} +- {error:.4f}, Enskog {enskog:.4f}, without the flow's")
    print(f"surplus {corrected:.4f}; the longest transverse waves hold {longest:.3f} kT")
    assert abs(z - corrected) < 4 * error
    if restitution == 1.0:
        assert longest == pytest.approx(1.0, abs=0.03)
    else:
        assert z < enskog - 3 * error
        assert longest > 1.05
