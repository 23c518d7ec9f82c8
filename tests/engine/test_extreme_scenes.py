"""Extremes of growth, walls, obstacles and mixtures: a run ends, or one sentence says why it cannot.

As plain Python, which gives the same bits, but for one: too small to be worth compiling for.
"""

import re
import time

import pytest
from helpers.oracle_scenes import assert_no_overlap
from helpers.plain import plain_python

import carom
from carom.errors import InputError
from carom.models import Ball, CylindricalContainer, SphericalContainer

START = """
import warnings
import numpy as np
np.seterr(all="ignore")
import carom
from carom.simulation import run_loop
from helpers.oracle_scenes import assert_no_overlap
run_loop.CYCLES = 200  # looks now and then, in plain Python, too
"""


def said(program):
    """Return what a program prints."""
    return plain_python("-c", START + program).strip()


REFUSED = """
try:
    {run}
    print("no word")
except carom.InputError as error:
    print(error)
assert_no_overlap(scene, sim.frame())
"""

ROD = """
scene = carom.Scene([[1.0]], 3.0, walls=True, velocities=[[0.1]])
sim = carom.Simulation(scene, growth=1.0)
"""

DISKS = """
scene = carom.Scene([[0.8, 1.0], [2.2, 1.9]], 3.0, walls=True, diameter=0.9,
                    velocities=[[0.1, 0.2], [0.05, -0.1]])
sim = carom.Simulation(scene, growth=1.0)
"""


@pytest.mark.parametrize(
    ("start", "run"),
    [
        (ROD, "sim.run(time=50.0)"),
        (ROD, "list(sim.sample(every=25.0, count=2))"),
        (DISKS, "sim.run(time=50.0)"),
    ],
)
def test_what_grows_jams_before_the_time_asked_for(start, run):
    # The contacts pile up before the instant at which there is no room left, and the energy, too.
    found = said(start + REFUSED.format(run=run))
    assert re.fullmatch(r"The components jam: they fly \S+ diameters between contacts, and .*", found)


def test_growth_up_to_just_before_jamming_is_reached():
    # A rod as long as 0.99 of its box: no reason to give up.
    assert said(ROD + "sim.run(time=1.97); print(sim.time, sim.diameters)") == "1.97 [2.97]"


def test_disks_without_any_room_are_named_instead_of_a_stall():
    # Four disks that touch each other and the walls collide for ever at one instant.
    program = """
scene = carom.Scene([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5], [1.5, 1.5]], 2.0, walls=True)
sim = carom.Simulation(scene, seed=1)
"""
    found = said(program + REFUSED.format(run="sim.run(time=1e-14)"))
    assert found.startswith(
        "The run would take infinitely many collisions and crossings more; expected at most 1e+15."
    )
    # A number of collisions is something else.
    assert said(program + "print(sim.run(collisions=50).collisions)") == "50"


@pytest.mark.parametrize("run", ["sim.run(time=1.0)", "sim.run(collisions=5)"])
def test_a_disk_that_slides_along_its_container_is_named(run):
    # It touches and moves along exactly: the next hit is always now.
    program = """
from carom.models import SphericalContainer
ring = SphericalContainer((2.0, 2.0), 1.5)
scene = carom.Scene([[3.0, 2.0], [1.5, 2.0]], 4.0, walls=True, velocities=[[0.0, 1.0], [0.0, 0.0]],
                    obstacles=[ring])
sim = carom.Simulation(scene)
"""
    assert "slide along a container" in said(program + REFUSED.format(run=run))


def test_a_row_that_sorts_itself_out_at_one_instant_is_no_stall():
    # n touching rods that all move inwards meet n (n - 1) / 2 times at one time.
    program = """
from carom.simulation import stall_detector
stall_detector.WINDOW = 1
n = 20
scene = carom.Scene(0.5 + np.arange(n)[:, None], n + 50.0, velocities=np.linspace(1.0, -1.0, n)[:, None])
sim = carom.Simulation(scene)
sim.run(time=0.5)
print(sim.time, sim.collisions)
"""
    assert said(program) == "0.5 190"


def test_a_drift_that_hides_every_collision_is_named():
    program = """
scene = carom.Scene.random(4, 0.2, 2, seed=1)
velocities = 1e-12 * np.random.default_rng(1).normal(size=(4, 2)) + 1.0
sim = carom.Simulation(scene.replace(velocities=velocities))
"""
    assert "drift far faster" in said(program + REFUSED.format(run="sim.run(collisions=10)"))


def test_collisions_that_come_are_waited_for_however_slow_they_may_get():
    # Contacts count down to a speed of 1e-30, and it would take that long to give up.
    program = """
from carom.models import Restitution
scene = carom.Scene.random(4, 0.6, 1, seed=1).replace(impact=Restitution(0.9, elastic_below=1e-30))
print(carom.Simulation(scene, seed=1).run(collisions=60).collisions)
"""
    impatient = "from carom.simulation import stall_detector as s\ns.WINDOW = s.CLUSTER = 1\n"
    assert said(impatient + program) == "60"


@pytest.mark.parametrize("periodic", [True, False])
def test_one_component_alone_is_not_waited_for(periodic):
    program = f"""
scene = carom.Scene([[1.0, 1.0]], 1e3, walls={not periodic}, velocities=[[1.0, 0.3]])
sim = carom.Simulation(scene)
with warnings.catch_warnings(record=True) as found:
    warnings.simplefilter("always")
    assert sim.run(collisions=1).collisions == 0
print(*[warning.message for warning in found])
"""
    assert said(program).startswith("One component alone meets nobody")


@pytest.mark.parametrize("axis", [None, 0])
def test_a_container_that_fits_like_a_skin_is_refused(axis):
    # The centre cannot move, and a hit there has no direction.
    around = [SphericalContainer((1.0,) * 3, 0.5)]
    if axis is not None:
        around = [CylindricalContainer(axis, (1.0,) * 3, 0.5)]
    with pytest.raises(InputError, match=r"must be wider than the largest diameter \(1\)"):
        carom.Scene([[1.0, 1.0, 1.0]], 2.0, walls=True, obstacles=around)


CONTACTS = """
contact = [[1.0, 1.1], [1.1, 0.3]]
species = [carom.Species(count=2), carom.Species(count=2, diameter=0.3)]
scene = carom.Scene.random(species=species, contact=contact, box=(2.6, 2.4), seed=3)
"""


def test_contacts_beyond_the_sum_of_radii_are_met_under_every_image():
    # Lists name a pair under one image for as long as it is listed: here from further away than half a box.
    program = """
sim = carom.Simulation(scene, seed=1)
for frame in sim.sample(every=0.05, count=30):
    assert_no_overlap(scene, frame)
print(sim._state.scheme.kind)
"""
    assert said(CONTACTS + program) == "sectors"
    sentence = said(
        CONTACTS + "sim = carom.Simulation\ntry:\n    sim(scene, tuning=carom.Tuning(neighbors='lists'))\n"
        "except carom.InputError as error:\n    print(error)"
    )
    assert "need box edges of at least" in sentence


UNLIKE = """
n, near = 12, {near}
places = np.arange(n)[:, None] * 1.1 + 0.6
velocities = np.random.default_rng(2).normal(size=(n, 1))
scene = carom.Scene(places, (n * 1.1 + 0.2,), species=np.arange(n) % 2, contact=[[1, near], [near, 1]],
                    velocities=velocities)
sim = carom.Simulation(scene)
sim.run(collisions=800)
print(sim.statistics.worst_overlap)
"""


@pytest.mark.parametrize("near", [0.1, 1e-3, 2e-6])
def test_unlike_rods_keep_a_distance_far_below_their_diameters(near):
    # Off by some roundings of the box, 13 diameters long, and by no more.
    assert float(said(UNLIKE.format(near=near))) < 64.0 * 2.0**-53 * 13.4 / near


CROWD = """
import sys
from carom.engine import obstacles as obstacle
from carom.models import Ball, Plane
from carom.models.contacts.restitution import Restitution
from carom.models.obstacles.named_walls import axes_without
obstacle.CROWD_FROM = int(sys.argv[1])
balls = [Ball((2.0 * (k % 3) + 1.0, 2.0 * (k // 3) + 1.0), 0.5 + 0.02 * k) for k in range(9)]
floor = Plane((0.0, 1.0), 0.1)
scene = carom.Scene.random(3, box=(6.0, 6.0), diameter=0.3, walls="y", seed=4,
                           obstacles=[*balls[:4], floor, *balls[4:]])
sim = carom.Simulation(scene, seed=1)
for frame in sim.sample(every=1.0, count=12):
    assert_no_overlap(scene, frame)
print(frame.positions.tobytes().hex(), [impacts.hits for impacts in sim.obstacles])
"""


def test_many_fixed_disks_are_met_as_few_are():
    crowd, few = (plain_python("-c", START + CROWD, size) for size in ("1", "100"))
    assert crowd == few


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
