"""Contacts on parabolas, function by function: planes, balls, containers, at rest and shaken, d = 1 to 4."""

import dataclasses
import json
import math
from fractions import Fraction

import numpy as np
import pytest

import carom
from carom.engine.obstacles import age_obstacles, make_obstacles
from carom.errors import InputError
from carom.models import Loss, Parabolas, Plane, Sine
from carom.models.files.tables import from_table, obstacle_to_table
from carom.models.interfaces.obstacle import ObstacleModel, PathModel
from carom.models.interfaces.particles import NEVER, Particles
from carom.models.mathematics.counter_random import normal, uniform
from carom.models.motions.gravity import Falling
from carom.models.obstacles.balls import SolidBall
from carom.models.obstacles.box_walls import cushions
from carom.models.obstacles.containers import Inside
from carom.models.obstacles.planes import HalfSpace
from carom.models.obstacles.with_properties import Shaken, Surface, Thermal, dressed
from carom.scene.fields import standing
from carom.scene.storage import from_arrays, to_arrays
from carom.units import TimeUnit

RADIUS = 0.5


def particles(d, n=3):
    return Particles((20.0,) * d, np.full(n, RADIUS), np.ones(n), None, None, True, TimeUnit())


def bodies(d):
    """Return a body of each kind, and the gap of a component at a place."""
    center = (0.0,) * d

    def radius_of(x, axes):
        return math.sqrt(sum(x[k] ** 2 for k in axes))

    every = range(d)
    found = [
        (HalfSpace((1.0,) + (0.0,) * (d - 1), -3.0), lambda x: x[0] + 3.0 - RADIUS),
        (SolidBall(center, 1.0), lambda x: radius_of(x, every) - 1.0 - RADIUS),
        (Inside(-1, center, 4.0), lambda x: 4.0 - RADIUS - radius_of(x, every)),
    ]
    if d > 1:
        across = range(1, d)
        found.append((Inside(0, center, 4.0), lambda x: 4.0 - RADIUS - radius_of(x, across)))
    return found


def first_sign_change(gap, x, v, g, away, until):
    """Return two times between which the gap goes below zero first, looked for at 1500 times."""
    times = np.linspace(0.0, until, 1501)
    values = [gap(x + (v + 0.5 * g * t) * t - away(t)) for t in times]
    for k in range(1, len(times)):
        if values[k] <= 0.0 < values[k - 1]:
            return times[k - 1], times[k]
    return None


def one_sided(sign):
    """A path that leaves its start to one side only, by 0.81."""
    return Parabolas([(0.225, 16.0 * sign), (0.45, -16.0 * sign), (0.225, 16.0 * sign)], speed=0.0)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
@pytest.mark.parametrize("path", [None, Sine(0.4, period=0.9, phase=0.2), one_sided(1.0), one_sided(-1.0)])
def test_contacts_are_those_found_by_looking_everywhere(d, path):
    rng = np.random.default_rng(d)
    motion = Falling(tuple(rng.normal(size=d).tolist()), 0.0)
    found = 0
    for body, gap in bodies(d):
        swing = path and path.model(TimeUnit())
        obstacle = body
        direction = rng.normal(size=d)
        direction /= np.linalg.norm(direction)

        if path:
            value = Shaken(Plane((1.0,) * d, 0.0), tuple(direction), path)
            obstacle = value.live(particles(d))._replace(body=body)

        def away(t, swing=swing, direction=direction):
            return swing.place(t) * direction if swing else 0.0 * direction

        for _ in range(4):
            x, v = rng.uniform(-2.0, 2.0, d), 2.0 * rng.normal(size=d)
            if gap(x - away(0.0)) < 0.1:
                continue
            t = motion.meeting(obstacle, x, v, RADIUS, 0.0, 0.0)
            between = first_sign_change(gap, x, v, np.array(motion.g), away, 6.0)
            if between is None:
                assert t > 6.0 - 1e-3 or abs(gap(x + (v + 0.5 * np.array(motion.g) * t) * t - away(t))) < 1e-7
                continue
            found += 1
            assert between[0] <= t <= between[1]
            # At contact the gap is zero but for the rounding of places.
            assert abs(gap(x + (v + 0.5 * np.array(motion.g) * t) * t - away(t))) < 1e-13
    assert found > 2


def test_walls_of_the_box_are_met_on_parabolas():
    # Thrown up from 5 with 1 in a field of -1: down at RADIUS after 1 + sqrt(1 + 2 (5 - RADIUS)).
    walls, motion = cushions((10.0,), (False,)), Falling((-1.0,), 0.0)
    t, number = motion.wall_meeting(walls, np.array([5.0]), np.array([1.0]), RADIUS, 0.0)
    assert number == 0
    assert math.isclose(t, 1.0 + math.sqrt(1.0 + 2.0 * 4.5), rel_tol=1e-15)
    t, number = motion.wall_meeting(walls, np.array([5.0]), np.array([9.0]), RADIUS, 0.0)
    assert number == 1
    # A hair inside and on the way out: it lands when it comes back.
    t, number = motion.wall_meeting(walls, np.array([RADIUS - 1e-17]), np.array([2.0]), RADIUS, 0.0)
    assert (number, t) == (0, 4.0)


@pytest.mark.parametrize("g", [-1.0, 0.0, 1.0])
@pytest.mark.parametrize("speed", [-4.0, 4.0])
def test_what_grows_on_a_parabola_touches_a_wall_with_the_surface_of_then(speed, g):
    walls = cushions((10.0,), (False,))
    growth, edge = 0.25, 10.0
    t, number = Falling((g,), 0.0).wall_meeting(walls, np.array([4.0]), np.array([speed]), RADIUS, growth)
    gap = 4.0 + (speed + 0.5 * g * t) * t if number == 0 else edge - 4.0 - (speed + 0.5 * g * t) * t
    assert number == (0 if speed < 0.0 else 1)
    assert abs(gap - (RADIUS + growth * t)) < 1e-14 * edge


def test_straight_flight_meets_what_moves():
    floor = Shaken(Plane((1.0,), 0.0), (1.0,), Sine(0.5, period=1.0)).live(particles(1))
    # At rest at 0.8: the floor comes to 0.3, asin(0.6) / 2 pi after the start.
    t = floor.arrival(np.array([0.8]), np.array([0.0]), RADIUS, 0.0, 0.0)
    assert math.isclose(t, math.asin(0.6) / (2.0 * math.pi), rel_tol=1e-14)
    assert floor.arrival(np.array([1.2]), np.array([0.0]), RADIUS, 0.0, 0.0) == NEVER
    assert floor.arrival(np.array([5.0]), np.array([0.1]), RADIUS, 0.0, 0.0) == NEVER


class Bump(PathModel):
    """A path of one's own: exp(sin(w t)) / 4."""

    w: float

    def place(self, t):
        return 0.25 * math.exp(math.sin(self.w * t))

    def pace(self, t):
        return 0.25 * self.w * math.cos(self.w * t) * math.exp(math.sin(self.w * t))


class Bumps:
    lowest, highest = 0.25 / math.e, 0.25 * math.e
    period = 2.0
    acceleration = 0.25 * math.pi**2 * 2.0 * math.e  # |cos^2 - sin| <= 2

    def model(self, unit):
        return Bump(2.0 * math.pi / unit.to_kernel(self.period, 1))


def test_a_path_of_ones_own_is_met():
    floor = Shaken(Plane((1.0,), 0.0), (1.0,), Bumps()).live(particles(1))
    t = floor.fall((-1.0,), np.array([4.0]), np.array([0.0]), RADIUS, 0.0, 0.0)
    assert abs(4.0 - 0.5 * t * t - RADIUS - floor.course.path.place(t)) < 1e-14
    for s in np.linspace(0.0, t, 1000)[:-1]:
        assert 4.0 - 0.5 * s * s - RADIUS > floor.course.path.place(s)


def test_parabolas_close_and_know_their_bounds():
    path = Parabolas([(1.0, -2.0), (1.0, 2.0)], speed=1.0)
    model = path.model(TimeUnit())
    assert (path.lowest, path.highest, path.period) == (-0.25, 0.25, 2.0)
    for t in np.linspace(0.0, 4.0, 81):
        s = t % 2.0
        assert math.isclose(model.place(t), s - s * s if s < 1.0 else (s - 1.0) * (s - 2.0), abs_tol=1e-15)
    with pytest.raises(InputError, match="where it started"):
        Parabolas([(1.0, -2.0)], speed=1.0)


def test_the_phase_does_not_drift():
    floor = Shaken(Plane((1.0,), 0.0), (1.0,), Sine(0.5, period=0.7)).live(particles(1))
    for _ in range(100_000):
        floor.shift_epoch(4.0)
    exact = Fraction(4.0) * 100_000 % Fraction(0.7)
    assert floor.phase[0] == float(exact)


def test_a_surface_loses_in_its_own_frame():
    value = Surface(
        Shaken(Plane((0.0, 1.0), 0.0), (0.0, 1.0), Sine(0.5, period=2.0 * math.pi)),
        Loss(0.8, elastic_below=1e-6, at_speed=2.0, power=0.5),
    )
    floor, up = value.live(particles(2)), np.array([0.0, 1.0])
    v = np.array([0.3, -4.0])
    floor.recoil(Falling((0.0, -1.0), 0.0), 0, 1.0, np.zeros(2), v, up, 0.0, 0.0)
    # The floor moves up at 1/2: 4.5 before, and 1 - 0.2 sqrt(4.5 / 2) of it afterwards.
    assert floor.surface_speed(up, 0.0) == 0.5
    assert math.isclose(v[1] - 0.5, 4.5 * (1.0 - 0.2 * math.sqrt(4.5 / 2.0)), rel_tol=1e-14)
    assert v[0] == 0.3


@pytest.mark.parametrize("motion", [Falling((0.0, 0.0), 0.0), Falling((0.0, -1.0), 0.25)])
@pytest.mark.parametrize("loss", [None, Loss(0.8, contact_time=1e-3), Loss(0.8, contact_time=0.1)])
def test_what_hardly_touches_leaves_with_the_least_speed_of_field_and_floor(motion, loss):
    # A floor that accelerates would meet it again at once, without a field as well.
    up = np.array([0.0, 1.0])
    floor = Shaken(Plane((0.0, 1.0), 0.0), (0.0, 1.0), Sine(0.5, period=2.0 * math.pi))
    model = (floor if loss is None else Surface(floor, loss)).live(particles(2))
    v = np.array([0.3, model.surface_speed(up, 1.0)])
    model.recoil(motion, 0, 1.0, np.zeros(2), v, up, 0.0, 1.0)
    rest = floor.live(particles(2)).rest_speed()
    assert rest > 0.0
    least = max(motion.rest_speed(), rest, -0.25 * motion.g[1] * loss.contact_time if loss else 0.0)
    assert v[1] - model.surface_speed(up, 1.0) == pytest.approx(least, rel=1e-12)


def test_a_thermal_wall_draws_from_a_gas_of_its_temperature():
    wall = Thermal(Plane((0.0, 1.0), 0.0), kT=2.0, seed=5).live(particles(2))
    motion, up = Falling((0.0, 0.0), 0.0), np.array([0.0, 1.0])
    count = 4000
    speeds = np.empty((count, 2))
    for k in range(count):
        speeds[k] = (0.1, -1.0)
        wall.recoil(motion, k % 3, 0.5, np.zeros(2), speeds[k], up, 0.0, 0.0)
    assert (speeds[:, 1] > 0.0).all()
    # kT / m = 4: the mean square along the wall is 4, and 8 along the normal; six standard errors.
    for values, mean, spread in ((speeds[:, 0] ** 2, 4.0, math.sqrt(32.0)), (speeds[:, 1] ** 2, 8.0, 8.0)):
        assert abs(values.mean() - mean) < 6.0 * spread / math.sqrt(count)
    assert list(wall.drawn) == [1334 * 5, 1333 * 5, 1333 * 5, 0]


def test_a_thermal_wall_prefers_no_direction_and_no_draw_is_used_twice():
    wall = Thermal(Plane((0.0, 0.0, 1.0), 0.0), kT=1.0, seed=5).live(particles(3))
    count = 6000
    v = np.empty((count, 3))
    for k in range(count):
        v[k] = (0.1, 0.2, -1.0)
        wall.recoil(Falling((0.0, 0.0, 0.0), 0.0), k % 3, 1.0, np.zeros(3), v[k], np.eye(3)[2], 0.0, 0.0)
    # By reflection x y^2 is nothing on average, for any two axes along the wall; its variance is 3. Numbers
    # that share a draw have 0.28. Along the normal the mean square is 2: x z^2 has the variance 8.
    for a, b, variance in ((0, 1, 3.0), (1, 0, 3.0), (0, 2, 8.0), (1, 2, 8.0)):
        assert abs((v[:, a] * v[:, b] ** 2).mean()) < 6.0 * math.sqrt(variance / count)
    assert abs((v[:, 0] * v[:, 1]).mean()) < 6.0 / math.sqrt(count)


def test_draws_are_uniform_and_of_their_own():
    draws = np.array([uniform(7, i, k) for i in range(40) for k in range(250)])
    counts = np.histogram(draws, 20, (0.0, 1.0))[0]
    # Chi square of 19 degrees of freedom: below 60 but once in 10^5 seeds; this is one seed.
    assert ((counts - 500.0) ** 2 / 500.0).sum() < 60.0
    assert len(set(draws.tolist())) == len(draws)
    assert uniform(7, 3, 5) != uniform(8, 3, 5)
    numbers = np.array([normal(7, 1, 2 * k) for k in range(4000)])
    assert abs(numbers.mean()) < 6.0 / math.sqrt(4000)
    assert abs(numbers.var() - 1.0) < 6.0 * math.sqrt(2.0 / 4000)


def test_normals_follow_what_moves():
    ball = Shaken(Plane((1.0, 0.0), 0.0), (1.0, 0.0), Sine(0.5, period=4.0)).live(particles(2))
    ball = ball._replace(body=SolidBall((0.0, 0.0), 1.0))

    ball.at_time(1.0)  # displaced by 1/2
    x = np.array([0.5, 1.5])
    assert [ball.outward(x, axis) for axis in range(2)] == [0.0, 1.0]


def test_a_nesting_that_would_lose_a_layer_is_refused():
    floor, up, path, loss = Plane((0.0, 1.0), 0.0), (0.0, 1.0), Sine(0.1, 2.0), Loss(0.3, contact_time=1e-3)
    for inside in (Surface(floor, loss), Thermal(floor, 5.0), Shaken(floor, up, path)):
        with pytest.raises(InputError, match=r"Surface\(Shaken\(\.\.\.\), loss\)"):
            Shaken(inside, up, path)
    for inside in (Surface(floor, loss), Thermal(floor, 5.0)):
        with pytest.raises(InputError, match=r"Surface\(Shaken\(\.\.\.\), \.\.\.\)"):
            Surface(inside, loss)
        with pytest.raises(InputError, match=r"Thermal\(Shaken\(\.\.\.\), \.\.\.\)"):
            Thermal(inside, 5.0)
    assert Surface(Shaken(floor, up, path), loss).name == Thermal(Shaken(floor, up, path), 5.0).name


def test_two_thermal_walls_of_one_seed_draw_different_numbers():
    floor, ceiling = Plane((0.0, 1.0), 0.5, "floor"), Plane((0.0, -1.0), -5.5, "ceiling")
    given = (
        dataclasses.replace(floor, kT=1.0),
        dataclasses.replace(ceiling, kT=1.0),
        Plane((0.0, 1.0), 0.4, kT=1.0, seed=1),
    )
    scene = carom.Scene([[50.0, 3.0]], (100.0, 6.0), walls="y", obstacles=given)
    last = Thermal(Plane((0.0, 1.0), 0.4), 1.0, seed=1)
    assert standing(scene) == (Thermal(floor, kT=1.0), Thermal(ceiling, kT=1.0, seed=2), last)
    motion, down = Falling((0.0, 0.0), 0.0), np.array([0.0, -1.0])
    rebound_speed = np.empty((2, 500))
    for wall, speeds in zip(standing(scene)[:2], rebound_speed, strict=True):
        model = wall.live(particles(2))
        for k in range(len(speeds)):
            v = np.array([0.1, 1.0])
            model.recoil(motion, 0, 1.0, np.zeros(2), v, down, 0.0, 0.0)
            speeds[k] = v[0]
    assert abs(np.corrcoef(rebound_speed)[0, 1]) < 6.0 / math.sqrt(500)
    # Scenes made of it, and its files, have the same seeds.
    assert standing(scene.replace(box=(100.0, 7.0))) == standing(scene)
    arrays, attributes = to_arrays(scene)
    assert standing(from_arrays(arrays, attributes)) == standing(scene)
    assert standing(from_arrays(arrays, attributes, obstacles=given)) == standing(scene)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.6, 0.8), (0.0, 1.0)])
@pytest.mark.parametrize("up", [(0.0, 1.0), (0.8, -0.6)])
def test_a_thermal_wall_is_cold_in_its_own_frame_along_the_wall_too(direction, up):
    # It moves at 10 pi: sideways, slanting or along the normal. At kT = 1e-6 a component goes with it.
    floor = Shaken(Plane(up, 0.0), direction, Sine(5.0, period=1.0))
    model, v = Thermal(floor, kT=1e-6).live(particles(2)), np.array([0.0, -1.0])
    model.recoil(Falling((0.0, 0.0), 0.0), 0, 1.0, np.zeros(2), v, np.array(up), 0.0, 0.0)
    left = v - 10.0 * math.pi * np.array(direction)
    assert 0.0 < left @ up < 0.01
    assert abs(left @ (up[1], -up[0])) < 0.01


@pytest.mark.parametrize("speed", [0.0, 0.05])
def test_a_component_that_grows_is_met_without_a_field_too(speed):
    # Beside a ball of radius 1, 2 away from its center; in containers of 4, 2 away from their center or axis.
    x, v, size = np.array([0.0, 2.0]), np.array([0.0, -speed]), 0.2
    ball = SolidBall((0.0, 0.0), 1.0).fall((0.0, 0.0), x, v, RADIUS, size, 0.0)
    assert math.isclose(ball, 0.5 / (size + speed), rel_tol=1e-12)
    receding = SolidBall((0.0, 0.0), 1.0).fall((0.0, 0.0), x, -v, RADIUS, size, 0.0)
    assert math.isclose(receding, 0.5 / (size - speed), rel_tol=1e-12)
    for body, g in ((Inside(-1, (0.0, 0.0), 4.0), (0.0, 0.0)), (Inside(0, (0.0, 0.0), 4.0), (-1.0, 0.0))):
        t = body.fall(g, x, -v, RADIUS, size, 0.0)
        assert math.isclose(t, 1.5 / (size + speed), rel_tol=1e-12)


class Piston(ObstacleModel):
    """A wall of one's own that moves up at a constant speed, and does not say what a contact does."""

    speed: float
    begun: np.ndarray

    def encounter(self, x, v, radius, growth):
        return NEVER

    def surface_speed(self, up, now):
        return self.speed * up[1]

    def shift_epoch(self, duration):
        self.begun[0] += duration


class Clock(ObstacleModel):
    """An obstacle of one's own that has a memory, and no more."""

    told: np.ndarray

    def copy_state(self, before, instant, passed, slower):
        self.told[0] = before.told[0]


def test_an_obstacle_is_live_whichever_question_it_answers():
    piston, clock, rests = Piston(0.5, np.zeros(1)), Clock(np.zeros(1)), HalfSpace((0.0, 1.0), 0.0)
    assert make_obstacles(2, None, (rests,)).live is None
    for model in (piston, clock):
        obstacles = make_obstacles(2, None, (rests, model))
        assert obstacles.live is not None
        age_obstacles(obstacles, 3.0)
    assert piston.begun[0] == 3.0
    v = np.array([0.3, -1.0])
    piston.recoil(Falling((0.0, 0.0), 0.0), 0, 1.0, np.zeros(2), v, np.array([0.0, 1.0]), 0.0, 0.0)
    assert list(v) == [0.3, 2.0]


def test_a_direction_is_the_same_from_a_file():
    directions = np.random.default_rng(1).normal(size=(200, 3))
    for direction in directions:
        shaken = Plane((0.0, 0.0, 1.0), 0.0, shake=Sine(0.1, 2.0), direction=tuple(direction))
        again = from_table(json.loads(json.dumps(obstacle_to_table(shaken))), "obstacle")
        assert again == shaken
        assert dressed(again) == dressed(shaken)
