"""Mixtures, walls, obstacles, lost energy and growth: the engine beside the oracle, and what always holds.

Compiling takes seconds for every combination of models, so that all runs as plain Python, which gives the
same bits; compiled, one of each kind with ``pytest -m slow``.
"""

from itertools import islice

import numpy as np
import pytest
from helpers import oracle_scenes
from helpers.inner import TESTS
from helpers.mixtures import mixed
from helpers.neighbors import check_invariants, check_lists, go
from helpers.oracle import oracle_of
from helpers.oracle_scenes import CASES, assert_no_overlap, compare, moving, placed
from helpers.plain import plain_python
from helpers.scripts import python

import carom
from carom.io.events import read_events
from carom.models import Ball, Gravity, Plane, Restitution
from carom.simulation.measuring import stretches


# In three and four dimensions sectors have many neighbors, and plain Python is slow.
def suits(name, scheme):
    dimension = int(name[-1])
    quick = scheme == "lists" or name[:-2] in ("lorentz", "flask", "boxed")
    return dimension <= 2 or (dimension == 3 and quick)


@pytest.mark.parametrize("kind", [make.__name__ for make in oracle_scenes.KINDS])
def test_events_come_in_the_oracle_s_order(plain, kind):
    names = [
        f"{name}-{scheme}"
        for name in CASES
        for scheme in ("sectors", "lists")
        if name.startswith(f"{kind}-") and suits(name, scheme)
    ]
    assert names
    for name in names:
        compare(name)


@pytest.mark.slow
@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("name", [name for name in CASES if not suits(name, "sectors")])
def test_events_come_in_the_oracle_s_order_in_more_dimensions(name):
    compare(f"{name}-sectors")
    if not suits(name, "lists"):
        compare(f"{name}-lists")


@pytest.mark.slow
@pytest.mark.parametrize("k", range(1, len(oracle_scenes.KINDS), 2))
def test_compiled_events_come_in_the_oracle_s_order(k):
    # One dimension and scheme of every other kind, each in turn: a kind takes half a minute to compile.
    make, dimensions = list(oracle_scenes.KINDS.items())[k]
    compare(f"{make.__name__}-{dimensions[k % len(dimensions)]}-{('sectors', 'lists')[k // 2 % 2]}")


def binary(n, ratio, eta, seed=1, mass=None, dimension=2):
    """Disks of two species, as much area of each."""
    small = round(n / (1 + ratio**-dimension))
    sizes = [1.0, 1.0 / ratio]
    scene = carom.Scene.random(
        species=mixed(counts=[n - small, small], diameters=sizes, masses=mass),
        packing_fraction=eta,
        dimension=dimension,
        seed=seed,
    )
    return moving(scene, seed)


def everything(n=16, seed=3):
    """Disks that grow at rates of their own, and lose energy, between walls, a fixed disk and a slope."""
    obstacles = (Ball((4.0, 3.0), 0.5), Plane((1.0, 1.0), 1.5, "slope"))
    scene = placed(n, (8.0, 7.0), seed, diameters=(0.3, 0.6), walls=True, obstacles=obstacles)
    return scene.replace(impact=Restitution(0.9, elastic_below=0.01)), 0.05 * scene.diameters


def growing_simulation(**settings):
    scene, growth = everything()
    return carom.Simulation(
        scene, growth=growth, tuning=carom.Tuning(neighbors="lists", shell=1.3), **settings
    )


def assert_same(one, other):
    """Two simulations are in the same state, to the bit."""
    a, b = one.frame(), other.frame()
    for name in ("positions", "velocities", "images", "diameters"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert (a.time, a.step) == (b.time, b.step)
    assert stretches.tally(one) == stretches.tally(other)
    assert one.obstacles == other.obstacles
    assert one.statistics.spared_contacts == other.statistics.spared_contacts


@pytest.mark.slow
def test_compiled_and_plain_python_give_the_same_bits():
    program = (
        "import numpy, hashlib; numpy.seterr(all='ignore')\n"
        "from engine.test_engine_scenes import growing_simulation\n"
        "from carom.simulation.measuring import stretches\n"
        "sim = growing_simulation(); sim.run(time=3.0); frame = sim.frame()\n"
        "bits = frame.positions.tobytes() + frame.velocities.tobytes()\n"
        "print(hashlib.sha256(bits).hexdigest(), stretches.tally(sim))"
    )
    plain = plain_python("-c", program)
    assert python("-c", program, cwd=TESTS) == plain


@pytest.mark.usefixtures("both_ways")
def test_growth_goes_on_through_refits_without_overlap():
    sim = growing_simulation()
    scene, growth = everything()
    before = sim.packing_fraction
    bases = set()
    for frame in sim.sample(every=1.0, count=30):
        np.testing.assert_allclose(frame.diameters, scene.diameters + growth * frame.time, rtol=1e-13)
        assert_no_overlap(scene, frame)
        check_lists(sim)
        bases.add(sim._state.clock.base)
    assert len(bases) > 3, "the neighbor scheme was renewed on the way"
    assert sim.packing_fraction == pytest.approx(before * 2.5**2, rel=1e-12)  # 1 + 0.05 * 30
    assert sim.collisions > 5 * scene.n
    assert sum(impact.hits for impact in sim.obstacles) > 5 * scene.n


@pytest.mark.usefixtures("both_ways")
def test_a_checkpoint_of_everything_continues_with_the_same_bits(tmp_path):
    whole, parts = growing_simulation(), growing_simulation()
    whole.run(time=6.0)
    for k in range(4):
        parts.run(time=1.5)
        parts.save(tmp_path / f"{k}.h5")
        parts = carom.Simulation.load(tmp_path / f"{k}.h5")
        assert parts.obstacles
    assert_same(whole, parts)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("ratio", [2, 10])
def test_lists_of_several_levels_are_complete(ratio):
    scene = binary(80 if ratio == 2 else 303, ratio, 0.4)
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="lists"), seed=0)
    levels = sim._state.engine.neighbors.bounds.grids
    assert levels > 1 if ratio == 10 else levels >= 1
    for _ in range(6 if ratio == 2 else 2):
        check_lists(sim)
        if ratio == 2:
            check_invariants(sim)
        go(sim, 2 * scene.n)
    check_lists(sim)
    sim.run(collisions=1)  # the simulation did not know of those cycles
    assert sim.statistics.transits > scene.n // 2
    assert sim.statistics.energy_drift < 1e-12
    assert sim.statistics.worst_overlap < 1e-12
    assert_no_overlap(scene, sim.frame())


@pytest.mark.slow
def test_sizes_from_one_to_twenty_keep_their_cores():
    rng = np.random.default_rng(5)
    sizes = np.exp(rng.uniform(np.log(0.05), 0.0, 400))
    scene = carom.Scene.random(
        species=mixed(counts=[1] * 400, diameters=sizes), packing_fraction=0.5, dimension=2, seed=2
    )
    sim = carom.Simulation(moving(scene, 3), tuning=carom.Tuning(neighbors="lists"), seed=0)
    for _ in range(4):
        sim.run(collisions_per_particle=20)
        check_lists(sim)
        assert_no_overlap(scene, sim.frame())
    assert sim.statistics.energy_drift < 1e-12
    assert sim.statistics.worst_overlap < 1e-12


def test_masses_from_one_to_a_million_keep_energy_and_momentum(plain):
    sim = carom.Simulation(
        binary(100, 2, 0.4, mass=[1e6, 1.0]), tuning=carom.Tuning(neighbors="lists"), seed=0
    )
    sim.run(collisions=600)
    assert sim.statistics.energy_drift < 1e-12
    assert sim.statistics.momentum_drift < 1e-12
    assert sim.statistics.worst_overlap < 1e-12


def test_the_event_log_numbers_walls_and_obstacles_from_n_on(plain, tmp_path):
    # The kernel keeps obstacles by kind: two balls apart in the scene are neighbors there.
    scene, path = oracle_scenes.flask(2).scene, tmp_path / "events.h5"
    with carom.Simulation(scene, event_log=path, tuning=carom.Tuning(neighbors="sectors")) as sim:
        sim.run(collisions=4)
        logged = sim.collisions + sum(impact.hits for impact in sim.obstacles)
    events, right = read_events(path), list(islice(oracle_of(scene), logged))
    assert len(events.i) == logged
    pairs = list(zip(events.i.tolist(), events.j.tolist(), strict=True))
    assert pairs == [(event.i, event.j) for event in right]
    assert max(event.j for event in right) == scene.n + 4 + 3  # 4 walls and 4 obstacles, the last a plane
    np.testing.assert_allclose(events.impulse, [float(event.impulse) for event in right], rtol=1e-6)
    names = [impact.name for impact in sim.obstacles]
    assert names == ["x_low", "x_high", "y_low", "y_high", "ball", "sphere", "second", "floor"]


def test_the_default_threshold_follows_the_thermal_speed(unscheduled):
    scene = carom.Scene.crystal(cells=3, packing_fraction=0.3).replace(impact=0.7)

    def threshold(scene, kT=None, rescale=None, **settings):
        sim = carom.Simulation(scene, kT=kT, seed=1, **settings)
        if rescale is not None:
            sim.rescale(rescale)
        return sim._state.system.impact.elastic_below

    assert threshold(scene, 1.0) == pytest.approx(1e-3)
    assert threshold(scene, 1.0, rescale=1e-8) == pytest.approx(1e-7)
    assert threshold(scene.replace(impact=Restitution(0.7, elastic_below=0.5)), 1.0, rescale=1e-8) == 0.5
    still = scene.replace(velocities=np.zeros((scene.n, 3)))
    assert threshold(still) == 0.0  # nothing will ever move
    assert threshold(still, growth=0.25) == 0.25e-3
    assert threshold(still.replace(motion=Gravity((0.0, 0.0, -4.0)))) == 2e-3


def test_no_collapse_at_a_restitution_of_a_tenth(plain):
    # Rods collapse from a few on at so low a restitution: without the elastic contacts the run would not end.
    scene = moving(carom.Scene.random(6, 0.5, 1, seed=1), 2).replace(impact=0.1)
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"))
    before = sim.kT
    block = sim.run(time=50.0 / before**0.5, collisions=5000)
    assert block.collisions < 5000, "the time was reached"
    assert sim.statistics.spared_contacts > 0, "reported"
    assert sim._state.system.threshold == pytest.approx(1e-3 * before**0.5)
    assert sim.kT < 0.05 * before


def test_sectors_that_are_renewed_leave_no_trace_of_samples_and_checkpoints(plain, tmp_path):
    # One component outgrows sectors that fitted all of them, and those after.
    scene = placed(12, (6.0, 5.2), 1, diameters=(0.2, 0.3), walls="y")
    growth = np.zeros(12)
    growth[3] = 0.3
    sectors = carom.Tuning(neighbors="sectors")
    whole, parts = (carom.Simulation(scene, tuning=sectors, growth=growth) for _ in range(2))
    whole.run(time=9.0)
    for k in range(6):
        next(parts.sample(times=[1.5 * k + 0.7]))
        parts.run(collisions=1, time=0.5)
        parts.save(tmp_path / "parts.h5")
        parts = carom.Simulation.load(tmp_path / "parts.h5")
        next(parts.sample(times=[1.5 * (k + 1)]))
    assert_same(whole, parts)
    assert whole._state.clock.base > 0, "sectors were renewed"
    assert whole.collisions > 10


def test_fixed_balls_are_seen_from_a_face_of_the_box(plain):
    # One that rounding leaves a hair before the face that it passes flies through all of the next box.
    obstacles = [Ball((0.1, 0.1, 0.1), 0.3), Ball((0.6, 0.6, 0.6), 0.3)]
    scene = carom.Scene.random(1, dimension=3, box=1.0, diameter=0.06, obstacles=obstacles, seed=0)
    sim = carom.Simulation(scene, seed=0, tuning=carom.Tuning(neighbors="sectors"))
    for frame in sim.sample(every=0.1, count=400):
        assert_no_overlap(scene, frame)
    assert sum(impact.hits for impact in sim.obstacles) > 40


def test_the_threshold_of_elastic_contacts_in_a_log_is_in_the_unit_of_the_scene(unscheduled):
    from carom.simulation.files.recorder import _header

    scene = carom.Scene.crystal(cells=3, packing_fraction=0.3).replace(impact=0.7)
    for kT in (1.0, 1e30):
        sim = carom.Simulation(scene, kT=kT, seed=1)
        assert (sim._state.unit.exponent == 0) == (kT == 1.0)
        assert _header(sim._state)["thresholds"] == pytest.approx([1e-3 * kT**0.5])
