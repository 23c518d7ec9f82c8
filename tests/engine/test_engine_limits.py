"""What a run is asked for and cannot do ends with one sentence; extreme but legal scenes run."""

import itertools

import numpy as np
import pytest
from helpers.marks import slow
from helpers.oracle import EPS, moving

import carom
from carom.errors import InputError


@pytest.fixture(scope="module")
def scene():
    return moving(carom.Scene.random(20, 0.4, 2, seed=1), 2)


@pytest.fixture
def sim(scene):
    return carom.Simulation(scene)


def test_a_time_beyond_the_clock_is_an_error(sim):
    with pytest.raises(InputError, match="epochs"):
        sim.run(time=1e300)


@pytest.mark.parametrize("shape", [slow((4000,)), (64, 64), (16, 16, 16)])
def test_thousands_collide_at_the_same_instant(shape):
    # The colors of a checkerboard move to the right and to the left: all pairs meet at once, and again.
    cells = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, len(shape))
    velocities = np.zeros(cells.shape)
    velocities[:, 0] = np.where(cells.sum(axis=1) % 2, 1.0, -1.0)
    scene = carom.Scene(cells * 1.5 + 0.5, tuple(1.5 * size for size in shape), velocities=velocities)
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"))
    for k in range(3):
        sim.run(collisions=scene.n // 2)
        assert sim.time == 0.25 + 0.5 * k
        velocities *= -1.0
        np.testing.assert_array_equal(sim.frame().velocities, velocities)
    assert sim.statistics.worst_overlap == 0.0


def test_more_collisions_than_can_be_counted_end_with_the_wall_time(sim):
    block = sim.run(collisions=1e30, walltime=0.05)
    assert block.collisions > 0


@pytest.mark.parametrize(
    "request_",
    [
        {},
        {"every": 0.1, "times": [1.0]},
        {"every": 0.0},
        {"every": 0.1, "count": -1},
        {"every": 0.1, "count": 2.5},
        {"times": [np.nan]},
        {"times": [np.inf]},
        {"times": [-1.0]},
        {"times": [0.2, 0.1]},
    ],
)
def test_impossible_samples(sim, request_):
    with pytest.raises(InputError):
        list(sim.sample(**request_))


@pytest.mark.parametrize("nothing", [None, "scene.toml", {}])
def test_what_is_no_scene_is_named(nothing):
    with pytest.raises(InputError, match="needs a Scene"):
        carom.Simulation(nothing)


@pytest.mark.parametrize("growth", [["1"] * 20, [True] * 20, [[1.0], [1.0, 2.0]], [{}] * 20, [-1.0] * 20])
def test_impossible_growth(scene, growth):
    with pytest.raises(InputError, match="growth"):
        carom.Simulation(scene, growth=growth)


def test_samples_come_exactly_at_their_times(sim):
    times = [0.0, 0.1, 0.1, 1.0 / 3.0, 7.0]
    assert [frame.time for frame in sim.sample(times=iter(times))] == times
    assert [frame.time for frame in sim.sample(every=0.25, count=3)] == [7.25, 7.5, 7.75]


def test_sample_times_without_end_are_taken_one_by_one(scene):
    frames = carom.Simulation(scene).sample(times=(0.25 * k for k in itertools.count()))
    assert [frame.time for frame in itertools.islice(frames, 3)] == [0.0, 0.25, 0.5]
    with pytest.raises(InputError, match="a sample's time"):
        list(carom.Simulation(scene).sample(times=iter([0.0, np.nan])))


@pytest.mark.parametrize("scale", [5e-324, 1e-300, 1e-153])
def test_velocities_too_small_for_their_squares_are_an_error(scene, scale):
    with pytest.raises(InputError, match=r"kinetic energy .* another unit of time"):
        carom.Simulation(scene.replace(velocities=np.sign(scene.velocities) * scale))


def test_velocities_too_large_for_their_squares_are_an_error(scene):
    with pytest.raises(InputError, match=r"velocities must be at most 1e\+152"):
        scene.replace(velocities=scene.velocities * 1e153)
    heavy = scene.replace(velocities=scene.velocities * 1e140, mass=1e30)
    with pytest.raises(InputError, match=r"kinetic energy .* another unit of time or of mass"):
        carom.Simulation(heavy)


def test_time_is_as_sharp_at_1e12_as_at_0(scene, sim):
    late = carom.Simulation(scene)
    epoch = round(1e12 / late._state.epoch_length)
    late._state.engine.state.clock[0].epoch = epoch
    late._state.clock.epoch = epoch
    sim.run(collisions=1000)
    late.run(collisions=1000)
    assert late.time > 1e12
    np.testing.assert_array_equal(late.frame().positions, sim.frame().positions)
    block = late.run(time=0.125)
    assert block.duration == 0.125


@pytest.mark.parametrize("dimension", [slow(1), 2, 3, slow(4)])
@pytest.mark.parametrize("speeds", ["along an axis", "diagonal"])
def test_lattices_full_of_ties_keep_their_cores(dimension, speeds):
    # Whole layers meet at the same time, and triples of spheres, up to rounding or exactly.
    rng = np.random.default_rng(dimension)
    lattice = carom.Scene.crystal(
        cells=12 if dimension == 1 else 4 if dimension < 4 else 2,
        lattice="cubic",
        dimension=dimension,
        packing_fraction=0.2 / dimension,
    )
    shape = lattice.positions.shape
    velocities = rng.choice([-1.0, 1.0], size=shape)
    if speeds == "along an axis":
        velocities *= np.eye(dimension)[rng.integers(dimension, size=shape[0])]
    sim = carom.Simulation(carom.Scene(lattice.positions, lattice.box, velocities=velocities))
    sim.run(collisions=30 * lattice.n)
    assert sim.statistics.worst_overlap < 64 * EPS * max(lattice.box)
    assert sim.statistics.energy_drift < 64 * EPS
