"""Extremes of growth, walls, obstacles and mixtures: a run ends, or one sentence says why it cannot.

As plain Python, which gives the same bits, but for one: too small to be worth compiling for.
"""

import re
import time

import numpy as np
import pytest
from helpers.oracle_scenes import assert_no_overlap

import carom
from carom.errors import CaromWarning, InputError
from carom.models import Ball, CylindricalContainer, Restitution, SphericalContainer
from carom.simulation import run_loop
from carom.simulation.measuring import stall_detector


@pytest.fixture
def looking(plain, monkeypatch):
    """Let runs be plain Python, and look now and then whether they stall."""
    monkeypatch.setattr(run_loop, "CYCLES", 200)


pytestmark = pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")


def refusal(sim, **limits):
    """Return why a run cannot go on."""
    with pytest.raises(InputError) as found:
        sim.run(**limits)
    assert_no_overlap(sim.scene, sim.frame())
    return str(found.value)


def growing_rod():
    scene = carom.Scene([[1.0]], 3.0, walls=True, velocities=[[0.1]])
    return carom.Simulation(scene, growth=1.0)


def growing_disks():
    scene = carom.Scene(
        [[0.8, 1.0], [2.2, 1.9]], 3.0, walls=True, diameter=0.9, velocities=[[0.1, 0.2], [0.05, -0.1]]
    )
    return carom.Simulation(scene, growth=1.0)


JAM = r"The components jam: they fly \S+ diameters between contacts, and .*"


@pytest.mark.parametrize("make", [growing_rod, growing_disks])
def test_what_grows_jams_before_the_time_asked_for(looking, make):
    # The contacts pile up before the instant at which there is no room left, and the energy, too.
    assert re.fullmatch(JAM, refusal(make(), time=50.0))


def test_what_grows_jams_before_a_sample_and_not_long_before(looking):
    sim = growing_rod()
    with pytest.raises(InputError, match=JAM):
        list(sim.sample(every=25.0, count=2))
    # A rod as long as 0.99 of its box: no reason to give up.
    sim = growing_rod()
    sim.run(time=1.97)
    assert sim.time == 1.97
    assert sim.diameters == pytest.approx([2.97])


def test_disks_without_any_room_are_named_instead_of_a_stall(looking):
    # Four disks that touch each other and the walls collide for ever at one instant.
    scene = carom.Scene([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5], [1.5, 1.5]], 2.0, walls=True)
    said = refusal(carom.Simulation(scene, seed=1), time=1e-14)
    assert said.startswith(
        "The run would take infinitely many collisions and crossings more; expected at most 1e+15."
    )
    # A number of collisions is something else.
    assert carom.Simulation(scene, seed=1).run(collisions=50).collisions == 50


@pytest.mark.parametrize("limits", [{"time": 1.0}, {"collisions": 5}], ids=str)
def test_a_disk_that_slides_along_its_container_is_named(looking, limits):
    # It touches and moves along exactly: the next hit is always now.
    scene = carom.Scene(
        [[3.0, 2.0], [1.5, 2.0]], 4.0, walls=True, velocities=[[0.0, 1.0], [0.0, 0.0]],
        obstacles=[SphericalContainer((2.0, 2.0), 1.5)],
    )  # fmt: skip
    assert "slide along a container" in refusal(carom.Simulation(scene), **limits)


def test_a_row_that_sorts_itself_out_at_one_instant_is_no_stall(looking, monkeypatch):
    # n touching rods that all move inwards meet n (n - 1) / 2 times at one time.
    monkeypatch.setattr(stall_detector, "WINDOW", 1)
    n = 20
    velocities = np.linspace(1.0, -1.0, n)[:, None]
    sim = carom.Simulation(carom.Scene(0.5 + np.arange(n)[:, None], n + 50.0, velocities=velocities))
    sim.run(time=0.5)
    assert (sim.time, sim.collisions) == (0.5, 190)


def test_a_drift_that_hides_every_collision_is_named(looking):
    scene = carom.Scene.random(4, 0.2, 2, seed=1)
    velocities = 1e-12 * np.random.default_rng(1).normal(size=(4, 2)) + 1.0
    sim = carom.Simulation(scene.replace(velocities=velocities))
    assert "drift far faster" in refusal(sim, collisions=10)


def test_collisions_that_come_are_waited_for_however_slow_they_may_get(looking, monkeypatch):
    # Contacts count down to a speed of 1e-30, and it would take that long to give up.
    monkeypatch.setattr(stall_detector, "WINDOW", 1)
    monkeypatch.setattr(stall_detector, "CLUSTER", 1)
    scene = carom.Scene.random(4, 0.6, 1, seed=1).replace(impact=Restitution(0.9, elastic_below=1e-30))
    assert carom.Simulation(scene, seed=1).run(collisions=60).collisions == 60


@pytest.mark.parametrize("walls", [True, False])
def test_one_component_alone_is_not_waited_for(looking, walls):
    scene = carom.Scene([[1.0, 1.0]], 1e3, walls=walls, velocities=[[1.0, 0.3]])
    with pytest.warns(CaromWarning, match="One component alone meets nobody"):
        assert carom.Simulation(scene).run(collisions=1).collisions == 0


@pytest.mark.parametrize("axis", [None, 0])
def test_a_container_that_fits_like_a_skin_is_refused(axis):
    # The center cannot move, and a hit there has no direction.
    around = [SphericalContainer((1.0,) * 3, 0.5)]
    if axis is not None:
        around = [CylindricalContainer(axis, (1.0,) * 3, 0.5)]
    with pytest.raises(InputError, match=r"must be wider than the largest diameter \(1\)"):
        carom.Scene([[1.0, 1.0, 1.0]], 2.0, walls=True, obstacles=around)


def test_contacts_beyond_the_sum_of_radii_are_met_under_every_image(looking):
    # Lists name a pair under one image for as long as it is listed: here from further away than half a box.
    species = [carom.Species(count=2), carom.Species(count=2, diameter=0.3)]
    scene = carom.Scene.random(species=species, contact=[[1.0, 1.1], [1.1, 0.3]], box=(2.6, 2.4), seed=3)
    sim = carom.Simulation(scene, seed=1)
    for frame in sim.sample(every=0.05, count=30):
        assert_no_overlap(scene, frame)
    assert sim._state.scheme.kind == "sectors"
    with pytest.raises(InputError, match="need box edges of at least"):
        carom.Simulation(scene, tuning=carom.Tuning(neighbors="lists"))


@pytest.mark.parametrize("near", [0.1, 2e-6])
def test_unlike_rods_keep_a_distance_far_below_their_diameters(looking, near):
    n = 12
    scene = carom.Scene(
        np.arange(n)[:, None] * 1.1 + 0.6, (n * 1.1 + 0.2,), species=np.arange(n) % 2,
        contact=[[1, near], [near, 1]], velocities=np.random.default_rng(2).normal(size=(n, 1)),
    )  # fmt: skip
    sim = carom.Simulation(scene)
    sim.run(collisions=400)
    # Off by some roundings of the box, 13 diameters long, and by no more.
    assert sim.statistics.worst_overlap < 64.0 * 2.0**-53 * 13.4 / near


@pytest.mark.slow
def test_a_thousand_fixed_disks_compile_as_quickly_as_a_few():
    # Much longer where each is compiled for itself.
    balls = [Ball((2.0 * (k % 32), 2.0 * (k // 32)), 0.5) for k in range(1024)]
    scene = carom.Scene([[1.0, 1.0]], 64.0, diameter=0.5, velocities=[[1.0, 0.3]], obstacles=balls)
    sim = carom.Simulation(scene, seed=0)
    began = time.process_time()
    sim.run(time=1.0)
    assert time.process_time() - began < 60.0
    for frame in sim.sample(every=1.5, count=500):
        assert_no_overlap(scene, frame)
    assert sum(impacts.hits for impacts in sim.obstacles) > 100
    assert sim.statistics.energy_drift < 1e-13
