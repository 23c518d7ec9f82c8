"""Bodies, spheres that bonds hold together, in a field: they fall, meet floors, are shaken."""

import math

import numpy as np
import pytest
from helpers.goes_on import assert_goes_on
from helpers.marks import slow
from helpers.naive.falling import over_a_floor as events_over_a_floor

import carom
from carom.errors import InputError
from carom.io.events import read_events
from carom.models import Bonds, Gravity, Plane, Sine, Steps, StepTable, Wall, chains, own
from carom.models.mathematics.parabolas import leaving
from carom.models.obstacles.named_walls import axes_without

LONGEST, HEIGHT, EDGE, OFFSET = 1.0625, 24.0, 8.0, 0.5
AMPLITUDE, PERIOD = 0.3, 2.0


def bodies(d, count=2, size=3, across=0.125, **keywords):
    """Return rows of spheres, one above the other; they move, and do not turn, if ``d`` is 1."""
    rng = np.random.default_rng(d)
    places = np.full((count * size, d), 2.5)
    for k in range(count * size):
        body, part = divmod(k, size)
        if d > 1:
            places[k, 0] += 1.03 * (part - 1)
            places[k, -1] = 1.6 + 1.4 * body
        else:
            places[k, 0] = 1.6 + 1.03 * part + (1.4 * size) * body
    cores = StepTable(Steps((1.0,), (math.inf,)))
    return carom.Scene(
        places, (*[EDGE] * (d - 1), HEIGHT), velocities=0.3 * rng.normal(size=places.shape),
        interaction=Bonds(chains(count, size), inner=1.0, outer=LONGEST, others=cores),
        motion=Gravity((*[across] * (d - 1), -1.0)), **keywords,
    )  # fmt: skip


def over_a_floor(d, restitution=0.9, **keywords):
    """Return bodies over a shaken floor, under a ceiling."""
    up = (*[0.0] * (d - 1), 1.0)
    floor = Plane(up, OFFSET, "floor", shake=Sine(AMPLITUDE, PERIOD), impact=restitution)
    return bodies(d, walls=axes_without((*[True] * (d - 1), False)), obstacles=[floor], **keywords)


def unwrapped(sim):
    frame = sim.frame()
    return frame.positions + frame.images * np.array(frame.box)


def oracle(scene, restitution):
    bonds = dict.fromkeys(scene.interaction.pairs, LONGEST)
    return events_over_a_floor(scene, OFFSET, AMPLITUDE, PERIOD, restitution, bonds=bonds)


@pytest.mark.parametrize(("d", "count"), [slow(1, 60), (2, 40), slow(3, 60), slow(4, 50)])
def test_events_of_bodies_over_a_shaken_floor_are_those_of_the_oracle(tmp_path, d, count):
    scene = over_a_floor(d)
    with carom.Simulation(scene, event_log=tmp_path / "log.h5", seed=0) as sim:
        sim.run(time=12.0)
        length = sim._state.epoch_length
    found = read_events(tmp_path / "log.h5")
    rows = zip(found.epoch, found.time, found.i, found.j, strict=True)
    events = [(epoch * length + t, i, j) for epoch, t, i, j in rows]
    assert len(events) >= count
    landed = 0
    for k, (step, (at, i, j)) in enumerate(zip(oracle(scene, 0.9), events[:count], strict=False)):
        assert {step.i, step.j} == {i, j}
        # Events of a bond follow each other at once: two of three amplify errors by some five.
        assert abs(float(step.time) - at) < 1e-14 * 5.0 ** (0.34 * k + 1), k
        landed += step.j >= scene.n
    assert landed


@pytest.mark.parametrize("d", [1, 2, 3])
def test_a_body_that_falls_turns_as_it_does_without_the_field(d):
    """Gravity cancels in the relative frame: the same contacts, at the same times, in a frame that falls."""
    falling, free = bodies(d, size=4), bodies(d, size=4).replace(motion=None)
    one, other = carom.Simulation(falling), carom.Simulation(free)
    one.run(time=6.0)
    other.run(time=6.0)
    assert one.collisions == other.collisions > 20
    shift = 0.5 * np.array(falling.motion.g) * 6.0**2
    moved = unwrapped(one) - unwrapped(other)
    assert moved == pytest.approx(np.broadcast_to(shift, moved.shape), abs=1e-9)


def test_bodies_keep_their_energy_and_their_bonds_on_a_floor_at_rest():
    scene = bodies(3, count=8, across=0.0, walls="z")
    sim = carom.Simulation(scene)
    sim.run(collisions=40_000)
    assert abs(sim.statistics.energy_drift) < 1e-12
    first, second = np.array(scene.interaction.pairs).T
    places = unwrapped(sim)
    lengths = np.linalg.norm(places[first] - places[second], axis=1)
    assert ((lengths > 1.0 - 1e-12) & (lengths < LONGEST + 1e-12)).all()
    assert sim.statistics.worst_overlap < 1e-12
    hits = {each.name: each.hits for each in sim.obstacles}
    assert hits["z_low"] > 400


def test_bodies_on_a_shaken_floor_go_on_from_a_checkpoint(tmp_path):
    assert_goes_on(over_a_floor(2, count=6), tmp_path, 4000)


@pytest.mark.parametrize("d", [2, 3])
def test_lists_in_a_field_find_the_contacts_that_sectors_find(d):
    """A bound on the acceleration ends a stay in a list in time."""
    rng = np.random.default_rng(5)
    across = round(60 ** (1 / d))
    grid = np.stack(np.meshgrid(*[np.arange(across)] * d, indexing="ij"), -1).reshape(-1, d)
    scene = carom.Scene(
        0.8 + 1.4 * grid, (1.4 * across + 0.4,) * d, velocities=rng.normal(size=grid.shape),
        walls=axes_without((*[True] * (d - 1), False)), motion=Gravity((*[0.5] * (d - 1), -4.0)),
    )  # fmt: skip
    found = {}
    for neighbors in ("lists", "sectors"):
        with carom.Simulation(scene, tuning=carom.Tuning(neighbors=neighbors)) as sim:
            sim.run(collisions=300)
            found[neighbors] = sim.time, unwrapped(sim)
            sim.run(collisions=20_000)
            assert sim.statistics.worst_overlap < 1e-12
    assert found["lists"][0] == pytest.approx(found["sectors"][0], rel=1e-9)
    assert found["lists"][1] == pytest.approx(found["sectors"][1], abs=1e-6)


@pytest.mark.parametrize("size", [2, 3])
def test_heights_of_bodies_follow_the_barometric_law(size):
    """Beyond the reach of a floor at kT the centers of bodies of k spheres have mean heights kT / (k m g)."""
    count, kT, g = 48, 3.0, 1.0
    x, y = np.divmod(np.arange(count), 8)
    places = np.stack([np.repeat(2.0 * y + 1.0, size), np.repeat(2.0 * x + 1.0, size)], axis=1)
    places[:, 1] += np.tile(1.03 * np.arange(size), count)
    rng = np.random.default_rng(size)
    scene = carom.Scene(
        places,
        (16.0, 60.0),
        velocities=math.sqrt(kT) * rng.normal(size=places.shape),
        interaction=Bonds(chains(count, size), inner=1.0, outer=LONGEST),  # ideal: bodies do not meet
        motion=Gravity((0.0, -g)),
        walls={"y_low": Wall(kT=kT), "y_high": Wall()},
    )
    reach = size * LONGEST
    with carom.Simulation(scene, seed=3) as sim:
        sim.run(time=60.0)
        heights = [
            frame.positions[:, 1].reshape(count, size).mean(axis=1)
            for frame in sim.sample(every=8.0, count=100)
        ]
    beyond = [each[each > reach] - reach for each in heights]
    sums, numbers = np.array([each.sum() for each in beyond]), np.array([len(each) for each in beyond])
    mean = sums.sum() / numbers.sum()
    error = np.sqrt(np.sum((sums - mean * numbers) ** 2)) / numbers.sum()
    assert error < 0.05 * mean
    assert abs(mean - kT / (size * g)) < 4.0 * error


def falling(told=None):
    """Return a motion of one's own that tells so many times its acceleration along an axis, or nothing."""

    class Fall:
        g: own.Acceleration
        straight = False

        def conserves(self, axis):
            return False

        def position(self, axis, x, v, t):
            return x + (v - 0.5 * self.g * t) * t

        def velocity(self, axis, v, t):
            return v - self.g * t

        def exit_time(self, axis, x, v, low, high):
            return leaving(x, v, -self.g, low, high)

    if told is not None:
        Fall.bend = lambda self: told * self.g
    return own.motion(Fall)(1.0)


def test_a_motion_of_ones_own_has_lists_if_it_tells_a_bound():
    bounded, careless = falling(2.0), falling(1.2)  # of up to four axes
    assert carom.check(bounded).passed
    assert {each.condition for each in carom.check(careless).failures} == {"bend"}
    scene = bodies(2, across=-1.0)
    with pytest.raises(InputError, match="Fall does not tell: give it a method bend"):
        carom.Simulation(scene.replace(motion=falling()))
    one, other = carom.Simulation(scene), carom.Simulation(scene.replace(motion=bounded))
    one.run(time=4.0)
    other.run(time=4.0)
    assert one.collisions == other.collisions > 5
    assert unwrapped(one) == pytest.approx(unwrapped(other), abs=1e-10)
