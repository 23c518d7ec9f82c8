"""A run comes to equilibrium and to a temperature, or says that it does not."""

import math

import numpy as np
import pytest

import carom
from carom.errors import CaromWarning, InputError
from carom.models import Andersen, Gravity, Shear, WhiteNoise
from carom.simulation.measuring.equilibration import StructuralRelaxation


def test_hard_spheres_are_scaled_once_and_keep_their_temperature():
    sim = carom.Simulation(carom.Scene.random(32, 0.2, seed=1), seed=1)
    scalings = []
    sim._state.refit, plain = lambda *given: (scalings.append(1), plain(*given)), sim._state.refit
    sim.equilibrate(collisions_per_particle=20, kT=0.5)
    assert sim.kT == pytest.approx(0.5, rel=1e-12)
    assert len(scalings) == 1


def test_without_a_temperature_the_energy_stays():
    one, other = (carom.Simulation(carom.Scene.random(32, 0.2, seed=1), kT=2.0, seed=1) for _ in range(2))
    one.equilibrate(collisions_per_particle=60)
    other.run(collisions_per_particle=60)
    np.testing.assert_array_equal(one.positions, other.positions)


def test_a_column_under_gravity_comes_to_the_temperature_within_its_error():
    pulls = []
    for seed in range(6):
        scene = carom.Scene.random(40, 0.05, 2, seed=seed, walls="y", motion=Gravity((0.0, -0.3)))
        sim = carom.Simulation(scene, kT=1.0, seed=seed)
        sim.equilibrate(collisions_per_particle=400, kT=2.0)
        kT = sim.measure(carom.Energy(), collisions_per_particle=150).kT
        pulls.append((kT.mean - 2.0) / kT.error)  # what it misses is the error of a stretch as long
    # Six sums of two errors: their root mean square is sqrt(2), known to 29 %.
    assert math.sqrt(float(np.mean(np.square(pulls)))) < math.sqrt(2.0) * (1.0 + 3.0 * 0.29)


def test_a_crystal_below_freezing_goes_on_until_it_has_melted():
    sim = carom.Simulation(carom.Scene.crystal(108, 0.45), seed=1)
    start = StructuralRelaxation(sim._state)
    sim.equilibrate(collisions_per_particle=20)
    moved, needed = start.distances()
    assert moved >= needed > 0.0
    assert sim.collisions > 10 * sim.n


def test_near_freezing_it_says_where_it_gave_up():
    sim = carom.Simulation(carom.Scene.crystal(cells=(6, 4), dimension=2, packing_fraction=0.69), seed=1)
    for _ in range(2):  # however long the run was before
        before = sim.collisions
        with pytest.warns(CaromWarning, match="not in equilibrium"):
            sim.equilibrate(collisions_per_particle=2)
        assert sim.collisions - before == 16 * sim.n  # 16 times as long


def test_a_crystal_beyond_freezing_is_left_in_its_cages():
    sim = carom.Simulation(carom.Scene.crystal(108, 0.6), seed=1)
    sim.equilibrate(collisions_per_particle=20)
    assert sim.collisions == 10 * sim.n


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("d", [2, 3])
def test_whom_the_stream_carries_has_not_left_its_neighborhood(d):
    """Nobody meets anybody here, so that particles fly straight across the stream."""
    rng = np.random.default_rng(1)
    v = rng.normal(size=(6, d))
    v -= v.mean(axis=0)
    scene = carom.Scene(
        rng.uniform(0.0, 8.0, (6, d)), (8.0,) * d, diameter=1e-6, velocities=v, motion=Shear(2.0)
    )
    sim = carom.Simulation(scene)
    relaxation = StructuralRelaxation(sim._state)
    sim.run(time=3.0)
    assert sim.collisions == 0
    across = np.mean(np.sum(v[:, 1:] ** 2, axis=1)) * d / (d - 1)
    spacing = 8.0 / 6.0 ** (1.0 / d)
    assert relaxation.distances()[0] == pytest.approx(3.0 * np.sqrt(across) / spacing, rel=1e-12)


def test_a_drive_brings_its_own_temperature():
    scene = carom.Scene.random(32, 0.2, 2, seed=1, drive=Andersen(kT=2.0, rate=1.0))
    sim = carom.Simulation(scene, seed=1)
    sim.equilibrate(collisions_per_particle=30, kT=2.0)
    with pytest.raises(InputError, match="Andersen brings the particles to kT = 2"):
        sim.equilibrate(kT=1.0)
    noisy = carom.Simulation(scene.replace(drive=WhiteNoise(power=1.0, rate=1.0)), seed=1)
    with pytest.raises(InputError, match="WhiteNoise sets it"):
        noisy.equilibrate(kT=1.0)


def test_growing_diameters_come_to_no_equilibrium(unscheduled):
    sim = carom.Simulation(carom.Scene.random(16, 0.2, seed=1), growth=0.01)
    for given in ({}, {"kT": 1.0}):
        with pytest.raises(InputError, match="leave out growth"):
            sim.equilibrate(**given)
