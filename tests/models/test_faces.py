"""Obstacles at the walls of the box: they stand for a wall, or lie in its plane, and none is dead."""

import math

import numpy as np
import pytest
from helpers.faces import EDGE, LOSS, Flypaper, beds, every_shape, every_wall, floor_at, growing
from helpers.magnetic import Magnetic
from helpers.plain import uncompiled

import carom
from carom.compiling.entry import entry
from carom.errors import InputError
from carom.models import Ball, Cuboid, Gravity, Loss, Plane, Segment, Sine, SphericalContainer, polygon
from carom.models.interfaces.walls import soonest_wall
from carom.models.obstacles.box_walls import ROUNDING_MARGIN, cushions
from carom.models.obstacles.faces import stand_ins, yielding
from carom.models.obstacles.with_properties import Shaken, Surface, Thermal

EPS = np.finfo(float).eps
OPEN = (False, False)


@pytest.fixture(scope="module")
def rested():
    with uncompiled():
        return beds()


def test_a_floor_in_a_wall_takes_the_hits_of_every_wall_in_every_dimension(plain):
    found = every_wall()
    assert len(found) == 28
    assert all(each == ({"floor": 1}, 0.5) for each in found)


def test_whatever_lies_in_the_plane_of_a_wall_is_met_where_it_is(plain):
    found = every_shape()
    assert found.pop("beside") == ({"y_low": 1}, 1.0)
    left = {"plain plane": 1.0, "plain patch": 1.0, "own": 0.1, "own, before": 0.1}
    # From a height h with speed v and g = 0.01 it hits with sqrt(v^2 + 2 g h), leaves with a tenth of that,
    # and falls back to it: between hits its speed is below.
    hits, speed = found.pop("own, falling")
    assert hits == {"floor": 1}
    assert speed < 0.1 * math.sqrt(1.0 + 0.02 * 0.5 * EDGE)
    assert found
    for name, (hits, speed) in found.items():
        assert hits == {"floor": 1}, name
        assert speed == pytest.approx(left.get(name, 0.5), rel=4 * EPS), name


def test_a_bed_rests_on_a_floor_in_the_wall_which_bears_its_weight(rested):
    for d in (2, 3):
        hits, lowest, force, area = rested[f"rest {d}"]
        assert list(hits) == ["floor"]
        assert 0.0 <= min(lowest) <= max(lowest) < 0.01
        # Two of mass 1 in a field of 1; the momentum of small hops is left out of a balance of 8 times.
        assert force == pytest.approx(2.0, abs=0.04)
        assert area == pytest.approx(EDGE ** (d - 1), rel=4 * EPS)


def test_a_shaken_floor_that_dips_behind_a_wall_is_met_there(rested):
    for period in (2, 1):
        hits, works, _ = rested[f"shaken {period}"]
        assert set(hits) == {"y_high", "floor"}
        assert works


def test_what_grows_meets_what_lies_in_a_wall(plain):
    for hits, least in growing().values():
        assert hits["floor"] > 0
        assert hits["ceiling"] > 0
        assert "y_low" not in hits
        assert least > -EDGE * ROUNDING_MARGIN


@entry
def ask(walls, x, v, radius, growth):
    return soonest_wall(walls, x, v, radius, growth)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_compiled_walls_are_met_as_in_plain_python(side, way):
    v = np.array([0.3, 0.7 * way])
    for where in ({"replaced": [(1, side)]}, {"yielding": [(1, side)]}):
        walls = cushions((EDGE, EDGE), OPEN, **where)
        x, growth = np.array([2.0, 2.5]), 0.1
        assert ask(walls, x, v, 0.5, growth) == soonest_wall(walls, x, v, 0.5, growth)
    both = soonest_wall(cushions((EDGE, EDGE), OPEN), x, v, 0.5, growth)
    assert soonest_wall(walls, x, v, 0.5, growth) == both
    gone = cushions((EDGE, EDGE), OPEN, replaced=[(1, side)])
    assert (soonest_wall(gone, x, v, 0.5, growth) == both) == (both[1] != 2 + side)


def scene(*obstacles, **more):
    settings = {"walls": True, "obstacles": obstacles} | more
    return carom.Scene([[2.0, 2.0], [2.0, 4.0]], EDGE, diameter=[1.0, 0.6], **settings)


def test_an_obstacle_stands_for_the_walls_that_it_gets_to():
    def standing(*obstacles, periodic=OPEN):
        return stand_ins(obstacles, (EDGE, EDGE), periodic)

    floor = floor_at(2, 1, 0)
    hidden = {(1, 0): 0}
    assert standing(floor) == standing(Surface(floor, LOSS)) == standing(Thermal(floor, 1.0)) == hidden
    assert standing(Ball((1.0, 1.0), 0.1), floor) == {(1, 0): 1}
    assert standing(Plane((0.0, 7.0), 7.0 * 2.0**-49), periodic=(True, False)) == hidden
    assert standing(floor_at(2, 1, 0, 1e-9)) == {}
    assert standing(Plane((1.0, 1.0), 0.0)) == {}
    # At rest before the wall, and behind it for a part of every period; sideways, in its plane.
    assert standing(Shaken(floor_at(2, 1, 0, 0.3), (0.0, 1.0), Sine(0.3, 1.0))) == hidden
    assert standing(Shaken(floor_at(2, 1, 0, 0.3), (0.0, 1.0), Sine(0.29, 1.0))) == {}
    assert standing(Shaken(floor, (1.0, 0.0), Sine(0.3, 1.0))) == hidden
    for way in (-1.0, 1.0):
        for side in (0, 1):
            before = floor_at(2, 1, side, 0.3)
            assert standing(Surface(Shaken(before, (0.0, way), Sine(0.4, 1.0)), LOSS)) == {(1, side): 0}
            assert standing(Shaken(before, (0.0, way), Sine(0.2, 1.0))) == {}
    assert len(standing(SphericalContainer((0.5 * EDGE,) * 2, 0.5 * EDGE))) == 4
    assert standing(SphericalContainer((0.5 * EDGE,) * 2, 0.4 * EDGE)) == {}
    assert standing(Flypaper()) == hidden
    assert standing(Flypaper(0.2)) == {}


def test_a_wall_yields_where_something_lies_in_its_plane_only():
    def yields(*obstacles):
        return yielding(obstacles, (EDGE, EDGE), OPEN)

    assert yields(Segment((0.0, 0.0), (0.0, EDGE))) == {(0, 0)}  # it stands on the others
    assert yields(*polygon([(0.0, EDGE), (1.0, EDGE), (0.5, 4.0)])) == {(1, 1)}
    assert yields(Cuboid((1.0, 0.0), (2.0, 1.0)), Ball((2.0, 2.0), 1.0)) == set()
    assert yields(Cuboid((-1.0, 1.0), (0.0, 2.0))) == {(0, 0)}


BEHIND = [
    Plane((0.0, 1.0), -0.1, "floor"),
    Plane((-1.0, 0.0), -EDGE - 1e-6, "floor"),
    Plane((1.0, 1.0), -0.1, "floor"),
    Shaken(Plane((0.0, 1.0), -0.5, "floor"), (0.0, 1.0), Sine(0.4, 1.0)),
    SphericalContainer((0.5 * EDGE,) * 2, EDGE, "floor"),
    Ball((-0.3, 2.0), 0.2, "floor"),
    Shaken(Ball((2.0, -0.5), 0.2, "floor"), (0.0, 1.0), Sine(0.2, 1.0)),
    Segment((0.0, -0.1), (EDGE, -0.1), 0.05, "floor"),
    Cuboid((0.0, EDGE + 0.1), (EDGE, EDGE + 1.0), 0.0, "floor"),
]


@pytest.mark.parametrize("hidden", BEHIND)
def test_what_is_behind_the_walls_is_refused_whatever_its_surface(hidden):
    for obstacle in (hidden, Surface(hidden, LOSS), Thermal(hidden, 1.0)):
        with pytest.raises(InputError, match="floor lies behind the walls of the box"):
            scene(obstacle)


def test_a_floor_that_takes_centers_out_of_the_box_is_refused():
    floor = floor_at(2, 1, 0)
    scene(Shaken(floor, (0.0, 1.0), Sine(0.3, period=1.0)))
    with pytest.raises(InputError, match=r"floor stands for the wall y_low and moves up to 0\.31"):
        scene(Shaken(floor, (0.0, 1.0), Sine(0.31, period=1.0)))


def test_two_floors_in_one_wall_are_refused():
    with pytest.raises(InputError, match="floor and lid both stand for the wall y_low"):
        scene(floor_at(2, 1, 0), Thermal(Plane((0.0, 1.0), 0.0, "lid"), 1.0))


def test_the_pressure_on_a_wall_is_that_on_what_stands_for_it():
    standing = scene(Surface(floor_at(2, 1, 0), LOSS))
    with pytest.raises(InputError, match=r"floor stands for the wall y_low.*measure 'floor'"):
        carom.WallPressure("y_low").begin(standing)
    carom.WallPressure("y_high").begin(standing)
    carom.WallPressure("floor").begin(standing)
    with pytest.raises(InputError, match="area of floor is not known"):
        carom.WallPressure("floor").begin(scene(Surface(floor_at(2, 1, 0, 0.1), LOSS)))
    ball = Thermal(Ball((4.0, 2.0), 0.5, "ball"), 1.0)
    carom.WallPressure("ball").begin(scene(ball))


def test_a_motion_that_answers_for_all_walls_is_refused_with_one_that_is_none(unscheduled):
    carom.Simulation(scene(motion=Magnetic(1.5)), seed=0)
    for obstacle in (floor_at(2, 1, 0), Ball((2.0, -0.5), 0.5)):
        with pytest.raises(InputError, match=r"y_low.*Magnetic answers wall_meeting"):
            carom.Simulation(scene(obstacle, motion=Magnetic(1.5)), seed=0)


@pytest.mark.usefixtures("both_ways")
def test_gravity_meets_the_walls_that_are_left():
    loss = Loss(0.5, contact_time=0.1)
    obstacles = Surface(floor_at(2, 1, 0), loss), Ball((-0.5, 2.0), 0.5)  # it touches a wall
    sim = carom.Simulation(scene(*obstacles, motion=Gravity((-0.2, -1.0))), kT=1.0, seed=1)
    sim.run(time=6.0)
    hits = {each.name: each.hits for each in sim.obstacles}
    assert hits.pop("y_low") == 0
    assert hits["floor"] > 3
    assert hits["x_low"] > 0
