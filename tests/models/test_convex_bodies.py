"""Falls upon segments, blocks, triangles and convex bodies of one's own, at rest and shaken."""

import itertools
import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from helpers.naive.bodies import Solid, square
from helpers.naive.falling import Floor, fall as oracle
from helpers.plain import uncompiled

import carom
from carom.errors import InputError
from carom.io.events import read_events
from carom.models import Ball, Cuboid, Gravity, Plane, Segment, Sine, Triangle, own
from carom.models.interfaces import convex
from carom.models.interfaces.particles import NEVER, Particles
from carom.models.obstacles.with_properties import Shaken, dressed
from carom.units import TimeUnit

EDGE, RADIUS, SWING = 6.0, 0.5, Sine(0.3, period=1.7)


@own.obstacle
class Lens:
    """A box about a center, rounded: all that it says is its closest point."""

    center: tuple
    half: tuple
    round: float

    def closest(self, x, axis):
        return min(max(x[axis], self.center[axis] - self.half[axis]), self.center[axis] + self.half[axis])

    def rounding(self):
        return self.round


def bodies(d):
    """Return obstacles of every kind, and the corners and the rounding that the oracle knows of each."""
    low, high = np.full(d, 2.1), np.array([3.4, 3.1, 3.7][:d])
    tips = np.array([[2.0, 2.2, 1.9], [4.1, 3.1, 2.6], [2.4, 3.9, 3.8]])[:, :d]
    box = list(itertools.product(*zip(low, high, strict=True)))
    found = [
        (Segment(tuple(tips[0]), tuple(tips[1])), tips[:2], 0.0),
        (Cuboid(tuple(low), tuple(high), 0.2), box, 0.2),
        (Lens(tuple(0.5 * (low + high)), tuple(0.5 * (high - low)), 0.3), box, 0.3),
    ]
    if d > 1:
        found.append((Triangle(*map(tuple, tips), 0.1), tips, 0.1))
    return found


def shaken(body, d):
    direction = (0.6, 0.8, 0.0)[:d] if d > 1 else (1.0,)
    return Shaken(body, direction, SWING), direction


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_events_are_those_of_an_oracle_that_knows_corners_only(plain, d, moves):
    count, g = (8, 8, 5)[d - 1], (-0.9, -0.2, 0.1)[:d]
    unit = np.eye(d, dtype=int)
    floors = [Floor(tuple(sign * each), -edge) for each in unit for sign, edge in ((1, 0), (-1, EDGE))]
    for body, corners, rounding in bodies(d):
        if moves:
            value, direction = shaken(body, d)
            solid = Solid(corners, rounding, direction, SWING.amplitude, SWING.period)
        else:
            value, solid = body, Solid(corners, rounding)
        x, v = np.array([[5.2, 3.5, 2.7][:d]]), np.array([[-0.4, -0.3, 0.1][:d]])
        scene = carom.Scene(x, EDGE, velocities=v, walls=True, motion=Gravity(g), obstacles=[value])
        with tempfile.TemporaryDirectory() as folder:
            with carom.Simulation(scene, event_log=Path(folder) / "log.h5") as sim:
                sim.run(time=25.0)
                length = sim._state.epoch_length
            log = read_events(Path(folder) / "log.h5")
        times = log.epoch * length + log.time
        assert len(times) >= count
        steps = itertools.islice(oracle(x.tolist(), v.tolist(), g, [*floors, solid]), count)
        touched = 0
        for k, step in enumerate(steps):
            assert step.j == log.j[k], (body.name, k)
            # A contact with a corner amplifies errors by some ten.
            assert abs(float(step.time) - times[k]) < 1e-14 * 10.0 ** (touched + 1), (body.name, k)
            touched += step.j == 1 + 2 * d
        assert touched, body.name


def particles(d, box=20.0):
    return Particles((box,) * d, np.full(3, RADIUS), np.ones(3), None, None, True, TimeUnit())


@pytest.mark.parametrize("scale", [2.0**-200, 1.0, 2.0**200])
def test_first_contacts_are_those_found_by_looking_everywhere_in_any_unit_of_length(scale):
    rng, found, missed = np.random.default_rng(5), 0, 0
    times = np.linspace(0.0, 4.0, 4001)
    for d, moves, (number, grows) in itertools.product(
        (2, 3), (False, True), itertools.product(range(4), (0, 1))
    ):
        body, corners, rounding = bodies(d)[number]
        growth = 0.0 if moves else 0.1 * grows
        model, direction = body.model(), np.zeros(d)
        scaled = model._replace(
            **{
                name: tuple(scale * each for each in value) if isinstance(value, tuple) else scale * value
                for name, value in model._asdict().items()
                if name not in ("square", "uu", "uv", "vv")
            },
            **{
                name: scale**2 * getattr(model, name)
                for name in ("square", "uu", "uv", "vv")
                if hasattr(model, name)
            },
        )
        if moves:
            value, way = shaken(Plane((1.0,) * d, 0.0), d)
            direction = np.array(way)
            live = value.live(particles(d))
            swing = live.course.path
            course = live.course._replace(
                path=swing._replace(amplitude=scale * swing.amplitude),
                lowest=scale * live.course.lowest,
                highest=scale * live.course.highest,
                bend=scale * live.course.bend,
            )
            scaled = live._replace(body=scaled, course=course)
        for _ in range(6):
            x, v, g = rng.uniform(0.0, 6.0, d), 2.0 * rng.normal(size=d), rng.normal(size=d)

            def gap(
                ts, x=x, v=v, g=g, corners=corners, rounding=rounding, growth=growth, direction=direction
            ):
                t = np.atleast_1d(ts)[:, None]
                bob = SWING.amplitude * np.sin(2.0 * math.pi / SWING.period * t) * direction
                distance = np.sqrt(square(x + (v + 0.5 * g * t) * t - bob, np.array(corners)))
                return distance - rounding - RADIUS - growth * t[:, 0]

            gaps = gap(times)
            if gaps[0] < 0.01:
                continue
            t = scaled.fall(tuple(scale * g), scale * x, scale * v, scale * RADIUS, scale * growth, 0.0)
            if gaps.min() > 0.0:
                missed += 1
                assert t > times[-1] or abs(gap(t)) < 1e-12
                continue
            found += 1
            # What nobody sees between two times is a graze.
            assert t <= times[int(np.argmax(gaps <= 0.0))]
            assert abs(gap(t)) < 1e-12
    assert found > 25
    assert missed > 25


def test_a_graze_touches_or_misses_by_a_hair():
    """Thrown along a parabola whose top is beside a corner, a hair nearer or farther than a radius."""
    block = Cuboid((0.0, -5.0), (5.0, 0.0)).model()
    for hair in (1e-6, 1e-12):
        for side in (-1.0, 1.0):
            # At t = 1 the top is straight above the block's edge, flying along it.
            x, v = np.array([1.0, RADIUS + side * hair - 0.5]), np.array([1.0, 1.0])
            x[0] = -2.0 * RADIUS
            t = block.fall((0.0, -1.0), x, v, RADIUS, 0.0, 0.0)
            height = x[1] + (v[1] - 0.5 * t) * t
            reach = math.hypot(min(x[0] + v[0] * t, 0.0), height) if t < NEVER else None
            assert t < NEVER
            assert abs(reach - RADIUS) < 1e-15
    # A ball passes an end of a stick at the distance of contact.
    stick = Segment((0.0, 0.0), (0.0, -3.0)).model()
    for hair in (1e-6, 1e-12):
        x, v = np.array([-1.0, RADIUS - 0.5]), np.array([1.0, 1.0])
        over = np.array([0.0, hair])
        assert stick.fall((0.0, -1.0), x + over, v, RADIUS, 0.0, 0.0) == NEVER
        assert abs(stick.fall((0.0, -1.0), x - over, v, RADIUS, 0.0, 0.0) - 1.0) < 4.0 * hair**0.5


def test_what_touches_now_and_what_leaves():
    for body in (
        Segment((0.0, 0.0), (4.0, 0.0)),
        Cuboid((0.0, -1.0), (4.0, 0.0)),
        Lens((2.0, -0.5), (2.0, 0.5), 0.0),
    ):
        model, hair = body.model(), 2.0**-53
        for height in (RADIUS, RADIUS - hair):
            x = np.array([2.0, height])
            assert model.fall((0.0, -1.0), x, np.array([0.3, -1.0]), RADIUS, 0.0, 0.0) == 0.0
            assert model.fall((0.0, -1.0), x, np.array([0.3, 0.0]), RADIUS, 0.0, 0.0) == 0.0
            back = model.fall((0.0, -1.0), x, np.array([0.3, 1.0]), RADIUS, 0.0, 0.0)
            assert abs(back - 2.0) < 1e-15
            # On its way over the end it does not come back to the side, but to the corner, or beside it.
            assert model.fall((0.0, -1.0), x, np.array([3.0, 1.0]), RADIUS, 0.0, 0.0) == NEVER
            assert model.outward(x, 1) == 1.0


def test_what_is_at_rest_beside_what_swings_is_asked_for_one_period(monkeypatch):
    swinging = dressed(Segment((0.0, 0.0), (0.0, 1.0), shake=SWING, direction=(1.0, 0.0))).live(particles(2))
    for x, touches in (([0.9, 0.5], False), ([0.7, 0.5], True), ([0.2, 1.6], False), ([0.2, 1.4], True)):
        t = swinging.arrival(np.array(x), np.zeros(2), RADIUS, 0.0, 0.0)
        assert (t < NEVER) == touches
        assert t == NEVER or t < SWING.period
    # It goes to and fro below, and is expected again and again.
    wide = Segment((0.0, 0.0), (0.0, 1.0), shake=Sine(2.0, period=1.7), direction=(1.0, 0.0))
    swinging, steps, step = dressed(wide).live(particles(2)), [], convex.time_to_plane
    monkeypatch.setattr(convex, "time_to_plane", lambda *asked: steps.append(asked) or step(*asked))
    assert swinging.arrival(np.array([0.2, 1.52]), np.zeros(2), RADIUS, 0.0, 0.0) == NEVER
    assert 3 < len(steps) < 20
    assert swinging.arrival(np.array([0.2, 1.48]), np.zeros(2), RADIUS, 0.0, 0.0) < 0.2


def test_planes_and_balls_are_met_alike_as_closest_points():
    """Carom's closed forms, and the same shapes as closest points only."""

    @own.obstacle
    class Point:
        center: tuple
        thick: float

        def closest(self, x, axis):
            return self.center[axis]

        def rounding(self):
            return self.thick

    rng, met = np.random.default_rng(3), 0
    for d in (1, 2, 3, 4):
        center = tuple(rng.normal(size=d))
        pairs = [(Ball(center, 0.7), Point(center, 0.7))]
        for (known, mine), moves in itertools.product(pairs, (False, True)):
            models = [
                shaken(each, d)[0].live(particles(d)) if moves and d < 4 else each.model()
                for each in (known, mine)
            ]
            for _ in range(40):
                x, v, g = rng.uniform(-4, 4, d), rng.normal(size=d), tuple(rng.normal(size=d).tolist())
                if np.linalg.norm(x - center) < 1.7:
                    continue
                first, second = (each.fall(g, x, v, RADIUS, 0.0, 0.0) for each in models)
                met += first < NEVER
                assert first == second or abs(first - second) < 1e-12 * first
    assert met > 20


def test_a_fall_among_bodies_keeps_its_energy_and_a_shaken_one_gives_what_it_says(plain):
    places = [[1.5, 8.5], [4.0, 8.0], [6.2, 7.9], [8.0, 8.3]]
    still = [Cuboid((2, 2), (4, 3)), Segment((5, 3), (8, 5)), Triangle((5, 1), (8, 1), (8, 2.5), 0.1)]
    mine = Lens((2.0, 5.0), (0.8, 0.1), 0.2)
    scene = carom.Scene(places, 10.0, walls=True, motion=Gravity((0, -1)), obstacles=[*still, mine])
    sim = carom.Simulation(scene, kT=1.0, seed=1)
    sim.run(time=30.0)
    assert sim.statistics.energy_drift < 1e-13
    assert all(each.hits > 2 for each in sim.obstacles[4:])
    shaking = [each.__class__(**{**vars(each), "shake": SWING, "direction": (0.0, 1.0)}) for each in still]
    sim = carom.Simulation(
        scene.replace(obstacles=[*shaking, Shaken(mine, (1.0, 0.0), SWING)]), kT=1.0, seed=1
    )

    def energy():
        frame = sim.frame()
        heights = frame.positions[:, 1]
        return float((0.5 * (frame.velocities**2).sum(axis=1) + heights).sum())

    before = energy()
    sim.run(time=30.0)
    work = sum(each.work for each in sim.obstacles)
    assert abs(energy() - before - work) < 1e-12 * energy()
    assert abs(work) > 0.1


def test_what_is_shaken_across_the_edge_of_a_periodic_box_is_met_in_its_nearest_image(plain):
    block = Cuboid((-1.0, 3.0), (1.5, 4.0), shake=Sine(1.4, period=1.7), direction=(1.0, 0.0))
    places = [[1.5, 6.5], [4.0, 7.0], [6.2, 1.9], [4.0, 1.0]]
    scene = carom.Scene(places, 8.0, walls="y", motion=Gravity((0.2, -1.0)), obstacles=[block])
    sim, (standing,) = carom.Simulation(scene, kT=1.0, seed=1), scene.obstacles
    for frame in sim.sample(every=0.25, count=60):
        gaps = dressed(standing).gap(frame.positions, 0.5, (8.0, 8.0), (True, False), frame.time)
        assert gaps.min() > -1e-12
    assert sim.obstacles[-1].hits > 10
    wide = Cuboid((2.0, 2.0), (6.0, 4.0), shake=Sine(1.9, period=1.7), direction=(1.0, 0.0))
    with pytest.raises(InputError, match="expected room for the largest diameter"):
        carom.Scene([[1.5, 6.5]], 8.0, walls="y", obstacles=[wide])


def test_a_shape_of_ones_own_is_its_closest_point():
    assert carom.check(Lens((5.0, 4.0), (1.0, 0.2), 0.3)).passed

    @own.obstacle
    class Wrong(Lens):
        def closest(self, x, axis):
            return min(max(x[axis], self.center[axis] - self.half[axis]), self.center[axis])  # the near half

        def gap(self, positions, radii, box, periodic):
            return Lens(self.center, self.half, self.round).gap(positions, radii, box, periodic)

    assert not carom.check(Wrong((5.0, 4.0), (1.0, 0.2), 0.3)).passed

    @own.obstacle
    class Horizon:
        def closest(self, x, axis):
            return x[axis] + 1.0

    with pytest.raises(InputError, match="must return a point of the obstacle"):
        carom.check(Horizon())
    (hull,) = Lens((5.0, 4.0), (1.0, 0.2), 0.3).outline((10.0, 10.0), (False, False))
    assert np.ptp(hull.corners, axis=0) == pytest.approx([2.0, 0.4])
    assert hull.radius == 0.3


@pytest.mark.slow
def test_compiled_they_fly_as_in_plain_python():
    places = [[1.5, 8.5], [4.0, 8.0], [6.2, 7.9], [8.0, 8.3]]
    standing = [Cuboid((2, 2), (4, 3)), Lens((2.0, 5.0), (0.8, 0.1), 0.2)]
    moving = Segment((5, 3), (8, 5), shake=SWING, direction=(0.0, 1.0))
    scene = carom.Scene(places, 10.0, walls=True, motion=Gravity((0, -1)), obstacles=[*standing, moving])

    def flown():
        sim = carom.Simulation(scene, kT=1.0, seed=1)
        sim.run(time=20.0)
        return sim.frame().positions

    compiled = flown()
    with uncompiled():
        assert (flown() == compiled).all()
