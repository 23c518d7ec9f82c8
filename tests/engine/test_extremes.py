"""The extremes: no stall, no lost particle, no silent overlap; right physics or a clear refusal.

The limits of docs/how.md, and more; ``pytest -m slow -s`` adds the long ones. Others stand in
test_engine_limits.py.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from helpers.marks import slow
from helpers.oracle import EPS, moving
from helpers.plain import uncompiled
from hypothesis import HealthCheck, given, settings, strategies as st

import carom
from carom.errors import CaromError
from carom.io.events import read_events, read_initial
from carom.models.contacts.restitution import Restitution
from carom.reference import NaiveSystem
from carom.simulation.measuring import stretches
from carom.simulation.replay import replay

FLOWN = 12
"""Boxes that a coordinate may be away, and as coarse as: a flight is four boxes long before its clock is set
back, and the fastest fly three times as far as the mean.
"""

WALL = 200.0
"""Seconds after which a run that should have ended stalls."""


def run(sim, **limits):
    """Run, and fail if the run stalls."""
    sim.run(collisions=0)  # compiles, which is no stall
    block = sim.run(walltime=WALL, **limits)
    collisions = limits.get("collisions", 0)
    assert block.collisions >= collisions, f"stalled after {block.collisions} collisions"
    return block


def assert_sound(sim, overlap=None):
    """Nobody is lost, nobody overlaps, energy is kept."""
    frame, found = sim.frame(), sim.statistics
    box = np.asarray(sim.scene.box)
    assert np.isfinite(frame.positions).all()
    assert np.isfinite(frame.velocities).all()
    assert ((frame.positions >= 0) & (frame.positions < box)).all()
    bound = 16 * EPS * FLOWN * max(sim.scene.box) / sim.scene.diameter if overlap is None else overlap
    assert found.worst_overlap <= bound
    # Each collision rounds the energy of two, and their errors add up like a random walk.
    assert found.energy_drift <= 8 * EPS * (1 + math.sqrt(found.collisions)) * math.sqrt(sim.scene.n)
    # The input's own check finds no overlap at the end.
    sim.scene.replace(positions=frame.positions, velocities=None)


# Dilute: flights through many boxes.


@pytest.mark.slow
@pytest.mark.parametrize("dimension", [2, 3])
def test_a_packing_fraction_of_1e_6_has_flights_through_many_boxes(dimension):
    scene = carom.Scene.random(20, dimension=dimension, packing_fraction=1e-6, seed=1)
    sim = carom.Simulation(scene, seed=1)
    run(sim, collisions=400)
    assert np.abs(sim.frame().images).max() > 100
    assert_sound(sim)
    rate = carom.theory.collision_rate(1 + 2 ** (dimension - 1) * 1e-6, dimension, n=20)
    expected = 0.5 * 20 * rate * sim.time
    assert abs(sim.collisions - expected) < 5 * math.sqrt(expected)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(
    ("box", "count", "growth"),
    [
        slow((4e3,) * 2, 20, None),
        slow((4e3,) * 2, 20, 1e-6),
        slow((4e5,) * 2, 10, None),
        slow((400.0,) * 3, 40, None),
        ((1e9,), 8, None),
    ],
    ids=["4e3, d = 2", "growth", "4e5, d = 2", "400, d = 3", "1e9, d = 1"],
)
def test_contacts_in_wide_boxes_are_as_sharp_as_coordinates(box, count, growth):
    """Not (L / sigma)^2 roundings deep, as they are where they are computed from a sector away."""
    scene = carom.Scene.random(count, dimension=len(box), box=box, seed=1)
    sim = carom.Simulation(scene, seed=1, growth=growth)
    for _ in range(12):  # at a collision, where two touch
        sim.run(collisions=1)
        frame = sim.frame()
        scene.replace(positions=frame.positions, diameter=frame.diameters)
    assert sim.explain().models["timing"] in ("FromRows", "FromCache")
    assert sim.collisions == 12
    assert sim.statistics.worst_overlap < 16 * EPS * FLOWN * max(box)


@pytest.mark.slow
def test_balls_in_wide_boxes_are_met_as_sharply():
    edge = 2.0**19
    scene = carom.Scene.random(
        10, dimension=2, box=edge, seed=1, obstacles=[carom.models.obstacles.Ball((edge / 2,) * 2, 0.5)]
    )
    towards = edge / 2 - scene.positions
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    sim = carom.Simulation(scene.replace(velocities=towards), seed=0)
    for distance in np.sort(np.linalg.norm(edge / 2 - scene.positions, axis=1)):
        frame = next(sim.sample(times=[distance - 1.0]))
        scene.replace(positions=frame.positions)
        gap = np.abs(np.linalg.norm(frame.positions - edge / 2, axis=1) - 1.0).min()
        assert gap < 16 * EPS * edge
    sim.run(time=16 * EPS * edge)  # the last may be a rounding later than its distance says
    assert sim.obstacles[0].hits == 10


@pytest.mark.usefixtures("both_ways")
def test_the_first_collisions_of_a_dilute_gas_are_the_oracles():
    scene = moving(carom.Scene.random(8, dimension=2, packing_fraction=1e-6, seed=3), 3)
    oracle = NaiveSystem(scene.positions, scene.velocities, scene.box)
    first = oracle.step()
    sim = carom.Simulation(scene, seed=0)
    run(sim, collisions=1)
    # The rounding of a box, over the sine of the angle at which the two meet, at the speed of some tenth.
    assert sim.time == pytest.approx(float(first.time), rel=1e-9)


# Close packing.


@pytest.mark.slow
@pytest.mark.parametrize("dimension", [2, 3])
def test_one_part_in_1e9_below_close_packing_has_the_free_volume_pressure(dimension):
    densest = {2: math.pi / (2 * math.sqrt(3)), 3: math.pi / (3 * math.sqrt(2))}[dimension]
    scene = carom.Scene.crystal(
        cells=6 if dimension == 2 else 3, dimension=dimension, packing_fraction=densest * (1 - 1e-9)
    )
    sim = carom.Simulation(scene, seed=1)
    run(sim, collisions=50 * scene.n)
    assert_sound(sim, overlap=64 * EPS * max(scene.box))
    z = sim.measure(carom.Pressure(), collisions=200 * scene.n).Z
    # Free volume: Z -> d / (1 - eta / eta_cp), times (n - 1) / n, up to a constant of order 1 beside 10^9.
    # Gaps of 10^-9 / d are known to 10^-16 times the box.
    limit = dimension / 1e-9 * (scene.n - 1) / scene.n
    assert abs(z.mean - limit) < 5 * z.error + 1e-6 * limit


# Few spheres in the smallest boxes.


@pytest.mark.parametrize("edge", [math.nextafter(1.0, 2.0), 1.5])
def test_one_sphere_in_the_smallest_box_flies_through_itself(plain, edge):
    scene = carom.Scene([[0.25, 0.5]], edge, velocities=[[1.0, -0.5]])
    sim = carom.Simulation(scene, seed=0)
    sim.run(time=100.0)
    assert sim.collisions == 0
    frame = sim.frame()
    np.testing.assert_allclose(frame.unwrapped, [[100.25, -49.5]], rtol=100 * 8 * EPS)


@pytest.mark.parametrize(("count", "gap"), [(2, 4 * EPS), (3, 4 * EPS), (3, 1e-6), (2, 0.1), (3, 0.1)])
def test_two_and_three_spheres_in_the_smallest_boxes(plain, count, gap):
    sim = carom.Simulation(tube(count, gap), seed=0)
    run(sim, collisions=150)
    assert_sound(sim, overlap=16 * EPS * 4 * count)


# A million.


@pytest.mark.slow
def test_a_million_spheres():
    scene = carom.Scene.crystal(cells=63, packing_fraction=0.4)
    assert scene.n == 1_000_188
    sim = carom.Simulation(scene, seed=1, tuning=carom.Tuning(images=False))
    sim.run(collisions_per_particle=4)
    bytes_ = sim.explain().bytes_per_particle
    print(f"{sim.statistics.collisions_per_second:.3g} collisions per second, {bytes_:.0f} bytes a particle")
    assert_sound(sim)


# Times and clocks.


def test_a_run_of_1e12_time_units_of_slow_spheres_keeps_its_bits():
    scene = moving(carom.Scene.random(20, 0.4, 2, seed=1), 2)
    slow = scene.replace(velocities=scene.velocities * 2.0**-40)
    fast_sim, slow_sim = carom.Simulation(scene, seed=0), carom.Simulation(slow, seed=0)
    fast_sim.run(time=2.0)
    slow_sim.run(time=2.0 * 2.0**40)
    assert slow_sim.time > 2e12
    assert slow_sim.collisions == fast_sim.collisions > 0
    np.testing.assert_array_equal(slow_sim.frame().positions, fast_sim.frame().positions)


# Velocities.


def power(exponent):
    """Return the power of two nearest to a power of ten, as its exponent."""
    return round(exponent * math.log2(10.0))


DISKS = moving(carom.Scene.random(20, 0.4, 2, seed=1), 2)
RANGE = [-150, -7, 20, 150]


@pytest.mark.parametrize("exponent", RANGE)
def test_velocities_from_1e_150_to_1e150_have_the_same_bits(exponent):
    k = power(exponent)
    one, two = (
        carom.Simulation(DISKS.replace(velocities=np.ldexp(DISKS.velocities, e)), seed=0) for e in (0, k)
    )
    for sim in (one, two):
        run(sim, collisions=2000)
        assert_sound(sim)
    assert two.time == math.ldexp(one.time, -k)
    assert two.kT == math.ldexp(one.kT, 2 * k)
    assert stretches.tally(two).virial == math.ldexp(stretches.tally(one).virial, k)
    assert two.statistics.energy_drift == one.statistics.energy_drift
    assert two.statistics.worst_overlap == one.statistics.worst_overlap
    np.testing.assert_array_equal(one.frame().positions, two.frame().positions)
    np.testing.assert_array_equal(np.ldexp(one.frame().velocities, k), two.frame().velocities)
    z = [sim.measure(carom.Pressure(), collisions=2000).Z for sim in (one, two)]
    assert z[0] == z[1]


@pytest.mark.slow
@pytest.mark.parametrize("exponent", [-150, 150])
def test_logs_checkpoints_and_samples_of_any_velocities_are_in_the_scenes_units(exponent, tmp_path):
    k = power(exponent)
    walls = DISKS.replace(
        positions=carom.Scene.random(20, 0.3, 2, walls=True, seed=1).positions,
        box=carom.Scene.random(20, 0.3, 2, walls=True, seed=1).box,
        walls=True,
        impact=Restitution(0.9, elastic_below=0.25),
    )
    found = []
    for e in (0, k):
        law = Restitution(0.9, elastic_below=math.ldexp(0.25, e))
        scene = walls.replace(velocities=np.ldexp(walls.velocities, e), impact=law)
        path = tmp_path / f"{e}.h5"
        with carom.Simulation(scene, event_log=path, seed=0) as sim:
            sim.run(time=math.ldexp(8.0, -e))
            sim.save(tmp_path / f"{e}.checkpoint")
            frame = list(sim.sample(every=math.ldexp(1.5, -e), count=2))[-1]
        again = carom.Simulation.load(tmp_path / f"{e}.checkpoint", event_log=tmp_path / f"{e}.h5")
        with again:
            resumed = list(again.sample(every=math.ldexp(1.5, -e), count=2))[-1]
        np.testing.assert_array_equal(resumed.velocities, frame.velocities)
        replayed = replay(path, time=math.ldexp(11.0, -e))
        np.testing.assert_array_equal(replayed.positions, frame.positions)
        np.testing.assert_array_equal(replayed.velocities, frame.velocities)
        assert sim.statistics.spared_contacts > 0
        found.append((sim, frame, path))
    (one, frame, path), (two, other, scaled) = found
    assert other.time == math.ldexp(frame.time, -k)
    np.testing.assert_array_equal(other.positions, frame.positions)
    np.testing.assert_array_equal(other.velocities, np.ldexp(frame.velocities, k))
    for a, b in zip(one.obstacles, two.obstacles, strict=True):
        assert (b.hits, b.impulse) == (a.hits, math.ldexp(a.impulse, k))
    assert float(read_initial(scaled)["epoch_length"]) == math.ldexp(one._state.epoch_length, -k)
    a, b = read_events(path), read_events(scaled)
    np.testing.assert_array_equal(b.time, np.ldexp(a.time, -k))
    np.testing.assert_array_equal(b.impulse, np.ldexp(a.impulse, k))
    np.testing.assert_array_equal(b.epoch, a.epoch)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("exponent", [-150, 150])
def test_growth_and_a_new_temperature_of_any_size(exponent):
    k = power(exponent)
    loose = moving(carom.Scene.random(30, 0.2, 2, seed=1), 2)
    one, two = (
        carom.Simulation(
            loose.replace(velocities=np.ldexp(loose.velocities, e)), growth=math.ldexp(0.1, e), seed=0
        )
        for e in (0, k)
    )
    for sim, e in ((one, 0), (two, k)):
        sim.run(time=math.ldexp(2.0, -e))
    np.testing.assert_array_equal(two.diameters, one.diameters)
    np.testing.assert_array_equal(two.frame().positions, one.frame().positions)
    # From one end of the range to the other, in the middle of a run: what was counted stays.
    before = stretches.tally(two)
    two.rescale(math.ldexp(1.0, -2 * k), growth=math.ldexp(0.1, -k))
    assert stretches.tally(two) == before
    assert two.kT == pytest.approx(math.ldexp(1.0, -2 * k), rel=1e-12)
    speed = float(two.diameters.mean())
    two.run(time=math.ldexp(0.5, k))
    assert float(two.diameters.mean()) - speed == pytest.approx(0.05, rel=1e-12)
    assert two.statistics.worst_overlap < 64 * EPS * max(loose.box)


def test_temperatures_of_any_size_are_drawn():
    still = carom.Scene.random(20, 0.4, 2, seed=1)
    for kT in (1e-300, 1e300):
        sim = carom.Simulation(still, kT=kT, seed=1)
        assert sim.kT == pytest.approx(kT, rel=64 * EPS)
        run(sim, collisions=200)
        assert_sound(sim)


@pytest.mark.parametrize("slow", [1e-150, 1e-8, 0.0])
def test_one_fast_mover_among_slow_ones_meets_them_all(slow):
    # The squares of the slow ones are nothing beside those of the fast one, or underflow altogether. They
    # count between two slow ones only, which would meet after more time than a clock can hold.
    velocities = slow * DISKS.velocities
    velocities[7] = [1e150, 3e149]
    sim = carom.Simulation(DISKS.replace(velocities=velocities), seed=0)
    np.testing.assert_array_equal(sim.frame().velocities[7], velocities[7])
    run(sim, collisions=2000)
    assert (np.abs(sim.frame().velocities).max(axis=1) > 1e147).all()
    assert_sound(sim)


def test_one_mover_among_resting_ones_wakes_them_all():
    sim = carom.Simulation(one_mover(), seed=0)
    run(sim, collisions=3000)
    assert (np.abs(sim.frame().velocities).max(axis=1) > 0).all()
    assert_sound(sim)


# Single precision.


def crystal(dimension, missing):
    """Return a crystal so far below close packing, in motion."""
    densest = {2: math.pi / (2 * math.sqrt(3)), 3: math.pi / (3 * math.sqrt(2))}[dimension]
    cells = 6 if dimension == 2 else 3
    return moving(
        carom.Scene.crystal(cells=cells, dimension=dimension, packing_fraction=densest * (1 - missing)), 1
    )


def tube(count, gap):
    """Return a row of disks that just fits, in a tube that is one disk wide."""
    positions = [[k * (1 + gap), 0.1 * gap * k] for k in range(count)]
    return moving(carom.Scene(positions, [count * (1 + gap), 1 + gap]), 1)


def one_mover():
    velocities = np.zeros((20, 2))
    velocities[3] = [1e-20, 2e-20]
    return DISKS.replace(velocities=velocities)


def scaled_disks(k):
    return carom.Scene(
        np.ldexp(DISKS.positions, k), np.ldexp(DISKS.box, k), diameter=2.0**k, mass=2.0**k,
        velocities=DISKS.velocities,
    )  # fmt: skip


def two_disks(offset, apart=4.0):
    positions = [[2.0, 2.0], [2.0 + apart, 2.0 + offset]]
    return carom.Scene(positions, 10.0, velocities=[[1.0, 0.0], [-1.0, 0.0]])


SINGLE = {
    "packing fraction 1e-6": (
        lambda: moving(carom.Scene.random(20, dimension=2, packing_fraction=1e-6, seed=1), 1),
        None,
    ),
    "packing fraction 1e-6, d = 3": (
        lambda: moving(carom.Scene.random(20, dimension=3, packing_fraction=1e-6, seed=1), 1),
        None,
    ),
    "1e-3 of close packing": (lambda: crystal(2, 1e-3), None),
    "1e-9 of close packing": (lambda: crystal(2, 1e-9), "close packing"),
    "1e-9 of close packing, d = 3": (lambda: crystal(3, 1e-9), "close packing"),
    "two in a tube": (lambda: tube(2, 0.1), None),
    "three in a tube": (lambda: tube(3, 1e-6), None),
    "1 : 8 000": (lambda: moving(carom.Scene.random(100, box=(8000.0, 1.5), seed=1), 1), None),
    "1 : 10 000": (lambda: moving(carom.Scene.random(100, box=(15000.0, 1.5), seed=1), 1), "a box of 15000"),
    "velocities 1e-150": (lambda: DISKS.replace(velocities=np.ldexp(DISKS.velocities, -498)), None),
    "velocities 1e150": (lambda: DISKS.replace(velocities=np.ldexp(DISKS.velocities, 498)), None),
    "one mover": (one_mover, None),
    "a graze": (lambda: two_disks(1.0 - 1e-9), None),
    "an overlap of 1e-15": (lambda: two_disks(0.0, apart=1.0 - 1e-15), None),
    "several at once": (lambda: figure_six(), None),
    "a whole lattice at once": (lambda: opposed_lattice(2), None),
    "a cradle": (lambda: cradle(2, 0.0), None),
    "units x 2^90": (lambda: scaled_disks(90), None),
    "units x 2^-90": (lambda: scaled_disks(-90), None),
    "a drift of 1e3": (lambda: DISKS.replace(velocities=DISKS.velocities + 1e3), None),
    "a drift of 1e6": (lambda: DISKS.replace(velocities=DISKS.velocities + 1e6), "drift at 1e"),
}


KERNELS = (
    "packing fraction 1e-6", "packing fraction 1e-6, d = 3", "two in a tube", "1 : 8 000",
    "1e-3 of close packing",
)  # fmt: skip
"""Cases that need kernels of their own."""


@pytest.mark.usefixtures("both_ways")
@pytest.mark.filterwarnings("ignore:No collision:carom.errors.CaromWarning")
@pytest.mark.parametrize("name", [slow(name) if name in KERNELS else name for name in SINGLE])
def test_single_precision_holds_or_is_refused(name):
    make, refusal = SINGLE[name]
    scene = make()
    if refusal is not None:
        with pytest.raises(carom.InputError, match=refusal):
            carom.Simulation(scene, tuning=carom.Tuning(precision="single"), seed=0)
        return
    sim = carom.Simulation(scene, tuning=carom.Tuning(precision="single"), seed=0)
    sim.run(time=1e-3 / np.abs(scene.velocities).max() * scene.diameter)
    sim.run(collisions=200, walltime=1.0)
    assert sim.collisions > 0
    frame, found = sim.frame(), sim.statistics
    assert np.isfinite(frame.positions).all()
    assert ((frame.positions >= 0) & (frame.positions < np.asarray(scene.box))).all()
    # As for doubles, with the spacing of single precision; a drift is as much faster than what moves apart.
    drift = max(1.0, float(np.abs(scene.velocities.mean(axis=0)).max() / np.std(scene.velocities)))
    eps = np.finfo(np.float32).eps
    assert found.worst_overlap <= 16 * eps * max(scene.box) / scene.diameter * drift
    assert found.energy_drift <= 8 * eps * (1 + math.sqrt(found.collisions)) * math.sqrt(scene.n)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("box", [None, slow((1500.0, 1.5))], ids=["cube", "tube"])
def test_single_precision_overlaps_by_its_own_rounding_of_the_box(box):
    scene = (
        carom.Scene.random(50, dimension=2, box=box, seed=1)
        if box
        else carom.Scene.random(50, dimension=2, seed=1)
    )
    sim = carom.Simulation(scene, seed=1, tuning=carom.Tuning(precision="single"))
    run(sim, collisions=500)
    rounding = np.finfo(np.float32).eps * 4 * max(scene.box)
    assert EPS < sim.statistics.worst_overlap < 16 * rounding
    assert sim.statistics.energy_drift < 500 * np.finfo(np.float32).eps


# Long boxes.


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("box", [(15000.0, 1.5), slow((1.5, 15000.0))])
def test_boxes_of_one_to_ten_thousand(box):
    scene = carom.Scene.random(100, box=box, seed=1)
    sim = carom.Simulation(scene, seed=1)
    run(sim, collisions=20)
    assert_sound(sim)


# Grazing.


def ulps(value, count):
    """Return the number so many representable ones away."""
    for _ in range(abs(count)):
        value = math.nextafter(value, math.copysign(math.inf, count))
    return value


@pytest.mark.parametrize("count", [*range(-8, 9), -1000, 1000])
def test_a_graze_within_ulps_is_a_touch_or_a_miss_and_changes_nothing_else(plain, count):
    # Offset so many roundings of the coordinates from contact; where exactly they are, the Fraction knows.
    scene = carom.Scene([[2.0, 2.0], [6.0, ulps(3.0, count)]], 10.0, velocities=[[1.0, 0.0], [-1.0, 0.0]])
    sim = carom.Simulation(scene, seed=0)
    sim.run(time=4.0)
    offset = Fraction(scene.positions[1, 1]) - Fraction(scene.positions[0, 1]) - 1
    # Whether they meet follows from r.r - (r.v)^2 / v.v - 1, whose rounding is that of r.r = 17.
    known = abs(offset) > Fraction(17 * EPS)
    if known:
        assert sim.collisions == (1 if offset < 0 else 0)
    found = sim.statistics
    assert found.worst_overlap <= max(float(-offset), 0.0) + 2 * EPS if not known else 17 * EPS
    assert found.energy_drift <= 2 * EPS
    assert found.momentum_drift <= 2 * EPS
    # A graze turns the velocities by sqrt(2 |offset|) per unit speed at most.
    turned = np.abs(sim.frame().velocities - scene.velocities).max()
    assert turned <= 2 * math.sqrt(2 * abs(float(offset)) + 34 * EPS)


# Several at once.


def figure_six():
    """The paper's Figure 7.1: two balls meet a third at the same time, mirror symmetrically."""
    aside, above = 0.75, 0.6614378277661477 + 1.5
    positions = [[5.0 - aside, 5.0 + above], [5.0, 5.0], [5.0 + aside, 5.0 + above]]
    velocities = [[0.0, -1.0], [0.0, 0.25], [0.0, -1.0]]
    return carom.Scene(positions, 10.0, velocities=velocities)


@pytest.mark.usefixtures("both_ways")
def test_the_papers_figure_6_has_a_defined_outcome_that_keeps_energy_and_momentum():
    sims = [
        carom.Simulation(figure_six(), tuning=carom.Tuning(neighbors=kind), seed=0)
        for kind in ("sectors", "lists")
    ]
    for sim in sims:
        sim.run(time=2.0)
    frames = [sim.frame() for sim in sims]
    np.testing.assert_array_equal(frames[0].velocities, frames[1].velocities)
    # The pair of the smaller index goes first, as in the oracle; the outcome is not mirror symmetrical.
    before = figure_six().velocities
    oracle = NaiveSystem(figure_six().positions, before, [10.0, 10.0])
    realized = oracle.advance_to(2.0)
    assert [(c.i, c.j) for c in realized[:2]] == [(0, 1), (1, 2)]
    assert float(realized[1].time - realized[0].time) < 1e-15
    np.testing.assert_allclose(frames[0].velocities, oracle.velocities.astype(float), atol=64 * EPS)
    assert abs(frames[0].velocities[0, 0] + frames[0].velocities[2, 0]) > 0.05
    np.testing.assert_allclose(frames[0].velocities.sum(axis=0), before.sum(axis=0), atol=8 * EPS)
    assert sims[0].statistics.energy_drift <= 8 * EPS
    assert sims[0].collisions == len(realized)


def cradle(dimension, gap):
    """Return five spheres in a row, and a sixth that is going to hit them."""
    x = np.zeros((6, dimension))
    x[:, 0] = np.concatenate([[0.0], 3.0 + np.arange(5) * (1.0 + gap)])
    x[:, 1:] = 2.0
    v = np.zeros_like(x)
    v[0, 0] = 1.0
    return carom.Scene(x, [20.0] + [4.0] * (dimension - 1), velocities=v)


def opposed_lattice(dimension):
    """Return a lattice in which neighbors move towards each other."""
    scene = carom.Scene.crystal(cells=4, lattice="cubic", dimension=dimension, packing_fraction=0.3)
    signs = (-1.0) ** np.indices((4,) * dimension).sum(axis=0).ravel()
    v = np.zeros_like(scene.positions)
    v[:, 0] = signs
    return scene.replace(velocities=v)


@pytest.mark.parametrize("gap", [0.0, EPS, 1e-9])
@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_newtons_cradle_passes_the_momentum_on(plain, dimension, gap):
    """Five touching spheres are hit by a sixth: the last one leaves, the others rest."""
    scene = cradle(dimension, gap)
    count = scene.n
    sim = carom.Simulation(scene, seed=0)
    sim.run(time=4.0, walltime=WALL)
    expected = np.zeros_like(scene.positions)
    expected[-1, 0] = 1.0
    np.testing.assert_allclose(sim.frame().velocities, expected, atol=8 * EPS)
    assert sim.time == 4.0
    assert sim.collisions == count - 1


# Overlaps.


@pytest.mark.usefixtures("both_ways")
def test_an_overlap_of_1e_15_is_healed_and_reported():
    scene = carom.Scene([[2.0, 2.0], [3.0 - 1e-15, 2.0]], 10.0, velocities=[[1.0, 0.0], [-1.0, 0.0]])
    sim = carom.Simulation(scene, seed=0)
    sim.run(time=1.0)
    assert 0.5e-15 < sim.statistics.worst_overlap < 2e-15
    assert sim.statistics.clamped_roots >= 1
    np.testing.assert_array_equal(sim.frame().velocities, [[-1.0, 0.0], [1.0, 0.0]])
    assert np.diff(sim.frame().positions[:, 0])[0] > 2.5


# Units.


@settings(max_examples=25, deadline=None)
@given(length=st.integers(-90, 90), mass=st.integers(-90, 90), speed=st.integers(-60, 60))
def test_a_scene_scaled_by_powers_of_two_has_the_same_bits(length, mass, speed):
    scene = DISKS
    other = carom.Scene(
        np.ldexp(scene.positions, length), np.ldexp(scene.box, length), diameter=2.0**length, mass=2.0**mass,
        velocities=np.ldexp(scene.velocities, speed),
    )  # fmt: skip
    one, two = carom.Simulation(scene, seed=0), carom.Simulation(other, seed=0)
    one.run(collisions=200)
    two.run(collisions=200)
    assert two.time == math.ldexp(one.time, length - speed)
    np.testing.assert_array_equal(two.frame().positions, np.ldexp(one.frame().positions, length))
    np.testing.assert_array_equal(two.frame().velocities, np.ldexp(one.frame().velocities, speed))
    assert stretches.tally(two).virial == math.ldexp(stretches.tally(one).virial, mass + length + speed)


# Frames of reference.


def followed(scene, other, collisions, tmp_path):
    """Return how many collisions the two have in the same order."""
    orders = []
    for k, each in enumerate((scene, other)):
        path = tmp_path / f"{k}.h5"
        with carom.Simulation(each, event_log=path, seed=0) as sim:
            sim.run(collisions=collisions)
        events = read_events(path)
        orders.append([frozenset(pair) for pair in zip(events.i.tolist(), events.j.tolist(), strict=True)])
    return next((k for k, (a, b) in enumerate(zip(*orders, strict=True)) if a != b), collisions)


@pytest.mark.parametrize(
    ("speed", "collisions"),
    [(1.0, 1500), (1e3, 1500), pytest.param(1e6, 100, marks=pytest.mark.slow)],
)
def test_a_moving_frame_loses_the_digits_of_its_speed_and_no_more(speed, collisions, tmp_path):
    # All cross sectors all the time: a collision costs as many crossings as the frame is faster.
    scene = moving(carom.Scene.crystal(cells=3, packing_fraction=0.3), 3)
    drift = scene.replace(velocities=scene.velocities + speed)
    same = followed(scene, drift, collisions, tmp_path)
    # A collision multiplies an error by about e: each factor of 1000 in the speed costs ln(1000) = 7 of some
    # 30 collisions a particle, and then some.
    per_particle = 2 * same / scene.n
    print(f"a frame at {speed:g} thermal speeds: same order for {per_particle:.1f} collisions a particle")
    assert per_particle > min(24 - 1.3 * math.log(speed), 2 * collisions / scene.n - 1)
    sim = carom.Simulation(drift, seed=0)
    sim.run(collisions=collisions)
    print(f"worst overlap {sim.statistics.worst_overlap:.1e}, {sim.statistics.transits} crossings")
    assert_sound(sim, overlap=64 * EPS * max(scene.box) * max(1.0, speed))


# Adversarial input.

ANY = st.floats(allow_nan=True, allow_infinity=True, allow_subnormal=True)
EXTREME = st.sampled_from(
    [0.0, -0.0, 5e-324, 2.2e-308, 1e-300, 1e-160, 1e-30, EPS, 1.0, 1.0 + EPS, 1e15, 1e30, 1e160, 1.7e308]
)
NUMBER = st.one_of(ANY, EXTREME, st.floats(-10.0, 10.0))


def assert_run_or_one_sentence(positions, box, **arguments):
    with uncompiled():
        try:
            sim = carom.Simulation(carom.Scene(positions, box, **arguments), seed=0)
        except CaromError as error:
            message = str(error)
        else:
            sim.run(collisions=20, walltime=1.0)
            assert_sound(sim)
            return
    assert len(message.splitlines()) == 1


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    positions=st.lists(st.tuples(NUMBER, NUMBER), min_size=1, max_size=4),
    velocities=st.lists(st.tuples(NUMBER, NUMBER), min_size=4, max_size=4),
    box=st.tuples(NUMBER, NUMBER),
    diameter=NUMBER,
    mass=NUMBER,
)
@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_any_numbers_make_a_run_or_one_sentence(positions, velocities, box, diameter, mass):
    assert_run_or_one_sentence(
        positions, box, diameter=diameter, mass=mass, velocities=velocities[: len(positions)]
    )


@settings(max_examples=25, deadline=None)
@given(data=st.data())
@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_legal_scenes_of_extreme_numbers_run(data):
    """Spheres on a grid with little room, with velocities of any size."""
    scale = 2.0 ** data.draw(st.integers(-90, 90))
    gap = data.draw(st.sampled_from([0.0, EPS, 1e-12, 1e-6, 0.1, 3.0]))
    side = data.draw(st.integers(1, 3))
    edge = (1.0 + gap) * side + data.draw(st.sampled_from([EPS * 8, 0.01, 1.0]))
    count = data.draw(st.integers(1, side * side))
    places = [[k % side * (1.0 + gap), k // side * (1.0 + gap)] for k in range(count)]
    sizes = st.sampled_from([0.0, 5e-324, 1e-200, 1e-90, 1e-12, 1.0, -1.0, 1e6, 1e29])
    v = [[data.draw(sizes), data.draw(sizes)] for _ in range(count)]
    assert_run_or_one_sentence(np.multiply(places, scale), edge * scale, diameter=scale, velocities=v)
