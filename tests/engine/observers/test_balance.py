"""Where contacts change the energy: sums that survive everything, beside exact cases and the oracle."""

import math

import numpy as np
import pytest
from helpers.naive.oracle import Oracle
from helpers.oracle_scenes import placed

import carom
from carom.models.contacts.restitution import Restitution
from carom.scene.velocities import degrees_of_freedom, peculiar, temperature
from carom.simulation.explanation import explain
from carom.simulation.measuring import stretches


def cooling_rods():
    """Two rods on a ring that lose half of their speed in every contact, until it is 2^-9 of the first.

    Their common velocity is no heat, however many epochs pass.
    """
    length, e, u, common = 5.0, 0.5, 2.0, 0.25
    velocities = [[common + u / 2], [common - u / 2]]
    scene = carom.Scene(
        [[0.75], [3.25]], length, velocities=velocities, impact=Restitution(e, elastic_below=1e-30)
    )
    sim = carom.Simulation(scene, seed=0)
    found, right = [], []
    for _ in range(9):
        # From the middle between two contacts to the next: m u^2 / 2 is kT, with one degree of freedom.
        half = 0.5 * (length - 2.0)
        block = sim.run(time=half / u + half / (e * u))
        found.append((block.kT_time, block.virial, sim.kT))
        right.append((0.5 * u * half * (1 + e), 0.5 * (1 + e) * u, 0.5 * (e * u) ** 2))
        u *= e
    assert sim.time > 10 * sim._state.epoch_length
    return found, right


def growing_rods():
    """Two rods on a ring that grow: contacts are elastic between surfaces that approach each other faster."""
    length, u, rate, duration = 50.0, 1.0, 0.25, 30.0
    scene = carom.Scene([[1.0], [26.0]], length, velocities=[[7.0 + u / 2], [7.0 - u / 2]])
    sim = carom.Simulation(scene, growth=rate, seed=0)
    block = sim.run(time=duration)
    # Both gaps of the ring close at once, each by the rate of growth and one of them by the centers.
    time = right = virial = 0.0
    gaps = [24.0, 24.0]
    while True:
        wait = gaps[0] / (u + rate)
        right += 0.5 * u * u * min(wait, duration - time)
        time += wait
        if time > duration:
            break
        gaps = [gaps[1] + (u - rate) * wait, 0.0]
        virial += (u + rate) * (1.0 + rate * time)
        u += 2 * rate
    return [(block.kT_time, block.virial, sim.kT)], [(right, virial, 0.5 * u * u)]


def growing_between_walls():
    """One rod that grows between two walls, which give it twice its rate of growth whenever they are hit."""
    length, v, rate, duration = 20.0, 1.0, 0.25, 40.0
    sim = carom.Simulation(carom.Scene([[10.0]], length, walls=True, velocities=[[v]]), growth=rate, seed=0)
    block = sim.run(time=duration)
    time = right = 0.0
    wait = 9.5 / (v + rate / 2)
    while True:
        right += v * v * min(wait, duration - time)
        time += wait
        if time > duration:
            break
        v += rate
        wait = (length - 1.0 - rate * time) / (v + rate / 2)
    return [(block.kT_time, block.virial, sim.kT)], [(right, 0.0, v * v)]


def everything(size, seed):
    """Return a scene of species that grow and lose energy, many of their contacts elastic, with a wall."""
    box, sizes = (6.0 * size, 5.0 * size), (0.6 * size, 1.1 * size)
    scene = placed(10, box, seed, diameters=sizes, walls="y")
    scene = scene.replace(velocities=scene.velocities + np.array([0.4, 0.0]), species=np.arange(10) % 3)
    return scene.replace(impact=Restitution(0.7, elastic_below=0.8)), 0.05 * scene.diameters / size


def beside_the_oracle(size, seed, growing):
    """Return the integral of kT and how many contacts were spared, of the engine and of the oracle.

    Its other sums are in ``helpers.oracle_sums``.
    """
    scene, growth = everything(size, seed)
    growth = growth if growing else 0.0 * growth
    settings = {"tuning": carom.Tuning(neighbors="lists", shell=1.3)} if growing else {}
    # In doubles: both trajectories agree for the few collisions that are looked at.
    oracle = Oracle(
        scene.positions, scene.velocities, scene.box, diameter=scene.diameters, masses=scene.masses,
        growth=growth, periodic=scene.periodic, restitution=scene.impact.restitution,
        elastic_below=scene.impact.elastic_below, arithmetic="float",
    )  # fmt: skip
    end, spared, heat = 0.0, 0, 0.0
    while oracle.collisions < COLLISIONS:
        before, time = oracle.velocities.astype(float), float(oracle.time)
        event = oracle.step()
        end = float(oracle.time)
        heat += temperature(scene, before) * (end - time)
        if event.j < scene.n:
            # Which image of the other it was, both know: the nearest.
            r = (oracle.positions[event.j] - oracle.positions[event.i]).astype(float)
            r[0] -= scene.box[0] * round(r[0] / scene.box[0])
            approach = -(before[event.j] - before[event.i]) @ r / math.sqrt(r @ r)
            spared += approach + 0.5 * (growth[event.i] + growth[event.j]) < scene.impact.elastic_below
    sim = carom.Simulation(scene, growth=growth if growing else None, **settings)
    # Cut where nothing happens, saved, and resumed: nothing of the sums may be lost.
    sim.run(time=0.4 * end)
    sim.run(time=end * (1 + 1e-9) - sim.time)
    assert not growing or sim._state.clock.base > 0, "the engine was built anew on the way"
    return (stretches.tally(sim).kT_time, sim.statistics.spared_contacts), (heat, int(spared))


COLLISIONS = 50


@pytest.mark.parametrize("rods", [cooling_rods, growing_rods, growing_between_walls])
def test_the_integral_of_kT_is_exact(plain, rods):
    # The rods cool by five decades: no digit of what is left may be lost to the rounding of what was.
    found, right = rods()
    np.testing.assert_allclose(found, right, rtol=1e-11)


@pytest.mark.parametrize("growing", [False, True])
@pytest.mark.parametrize("size", [0.02, 1.0, 30.0])
def test_the_integral_of_kT_and_spared_contacts_agree_with_the_oracle(plain, size, growing):
    # Diameters from 0.02 to 30: what counts of a contact is the speed of the surfaces, r.v over r.
    (heat, spared), right = beside_the_oracle(size, 3, growing)
    assert heat == pytest.approx(right[0], rel=1e-6)
    assert spared == right[1]
    assert 5 < spared < 55


def test_rescaling_takes_the_momentum_away_where_it_is_conserved_and_leaves_the_rest(plain):
    scene, _ = everything(1.0, 3)
    sim = carom.Simulation(scene, seed=0)
    before = scene.masses @ scene.velocities
    assert abs(before[0]) > 1.0
    sim.rescale(kT=0.5)
    assert sim.kT == pytest.approx(0.5, rel=1e-14)
    after = sim.frame().velocities
    momentum = scene.masses @ after
    assert abs(momentum[0]) < 1e-14 * scene.masses.sum()
    # Across the walls every component keeps its direction and its part: nothing is subtracted there.
    factor = after[:, 1] / scene.velocities[:, 1]
    np.testing.assert_allclose(factor, factor[0], rtol=1e-13)
    np.testing.assert_allclose(after, factor[0] * peculiar(scene, scene.velocities), rtol=1e-12)
    twice = float(np.sum(scene.masses[:, None] * after**2))
    assert twice == pytest.approx(0.5 * degrees_of_freedom(scene), rel=1e-13)
    assert sim.run(collisions=20).collisions == 20


def test_a_plain_scene_has_no_balance():
    # Scenes whose energy is constant are compiled without it.
    found = explain(placed(6, (4.0, 4.0), 1, walls="y"))
    assert not {"impact", "observers"} & found.models.keys()
    assert not any("observers" in array.name for array in found.arrays)
