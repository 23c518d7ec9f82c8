"""Helfand's moments in the engine: exact against the moments of positions, and no trace in the run."""

import math

import numpy as np
import pytest

import carom
from carom.engine.build import arrays
from carom.errors import InputError
from carom.models import Kind, Ranges
from carom.observables import HelfandCurrents
from carom.simulation.files.checkpoint_validation import following
from carom.simulation.measuring import stretches

EPS = np.finfo(float).eps


def cluster(dimension, seed=3):
    """Return unlike spheres in the middle of a box that nobody leaves, with a drift."""
    rng = np.random.default_rng(seed)
    n, wide = 16, 4.0
    small = carom.Scene.random(n, dimension=dimension, box=(wide,) * dimension, diameter=1.0, seed=seed)
    box = 60.0
    return carom.Scene(
        small.positions + 0.5 * (box - wide), box, diameter=rng.uniform(0.6, 1.0, n),
        mass=rng.uniform(0.5, 3.0, n), species=np.arange(n) % 2,
        velocities=rng.standard_normal((n, dimension)) + 0.7 - 2.0 * (small.positions - 0.5 * wide),
    )  # fmt: skip


def position_moments(frame, drift):
    """Return sum x_a p_b, sum x_a m v^2 / 2 and the sum of x of both species, in the frame that drifts."""
    x, m = frame.unwrapped - drift * frame.time, frame.masses
    v = frame.velocities - drift
    energies = 0.5 * m * np.sum(v * v, axis=1)
    species = [x[frame.species == k].sum(axis=0) for k in (0, 1)]
    return np.einsum("i,ia,ib->ab", m, x, v), energies @ x, np.array(species)


@pytest.mark.usefixtures("both_ways")
def test_the_moments_are_those_of_positions_where_nobody_goes_round_the_box():
    scene = cluster(2)
    drift = scene.masses @ scene.velocities / scene.masses.sum()
    sim = carom.Simulation(scene, observers=[HelfandCurrents()], seed=0)
    frames = []
    found = sim.helfand(every=0.05, count=101, look=frames.append, look_every=10)
    assert sim.collisions > 20
    assert len(frames) == 11
    before = position_moments(frames[0], drift)
    scale = 60.0 * 16 * 10.0  # coordinates of 60, of 16 components, with energies of some 10
    tolerance = 1000 * EPS * scale  # of so many roundings
    for k, frame in enumerate(frames):
        after = position_moments(frame, drift)
        assert frame.time == pytest.approx(0.5 * k)
        stress, heat = found.stress[:, 10 * k].sum(axis=0), found.heat[:, 10 * k].sum(axis=0)
        assert stress == pytest.approx(after[0] - before[0], abs=tolerance)
        assert heat == pytest.approx(after[1] - before[1], abs=tolerance)
        assert found.displacement[:, 10 * k] == pytest.approx(after[2] - before[2], abs=tolerance)


FLUID = carom.Scene.random(32, 0.3, seed=5)


def fluid(**settings):
    return carom.Simulation(FLUID, seed=2, **settings)


@pytest.mark.usefixtures("plain")
def test_currents_leave_no_trace_in_the_run():
    plain, counted = fluid(), fluid(observers=[HelfandCurrents()])
    plain.run(collisions=150)
    counted.helfand(every=0.01, count=30)
    counted.run(collisions=150 - counted.collisions)
    assert (plain.frame().velocities == counted.frame().velocities).all()
    assert plain.time == counted.time
    assert stretches.tally(plain).virial == stretches.tally(counted).virial


@pytest.mark.usefixtures("both_ways")
def test_the_trace_of_the_collisional_stress_is_the_virial():
    sim = fluid(observers=[HelfandCurrents()])
    found = sim.helfand(every=0.125, count=11)
    virial = np.trace(found.stress[1, -1])
    assert virial == pytest.approx(stretches.tally(sim).virial, rel=1e-12)
    # The kinetic part is twice the energy times the time, for ever.
    twice = sim.kT * sim.degrees_of_freedom
    assert np.trace(found.stress[0], axis1=1, axis2=2) == pytest.approx(
        twice * 0.125 * np.arange(11), rel=1e-12
    )


def state_of(sim):
    engine = sim._state.engine
    found = arrays(engine)
    return {name: found[name] for name in set(found) - set(following(engine, found))}


def test_moments_go_on_in_a_run_that_was_saved(plain, tmp_path):
    sim = fluid(observers=[HelfandCurrents()])
    sim.run(time=0.25)
    sim.save(tmp_path / "run.h5")
    again = carom.Simulation.load(tmp_path / "run.h5")
    during = tmp_path / "during.h5"
    one = sim.helfand(every=0.05, count=10, look=lambda frame: sim.save(during), look_every=9)
    two = again.helfand(every=0.05, count=10)
    third = carom.Simulation.load(during)
    for saved, value in state_of(sim).items():
        np.testing.assert_array_equal(state_of(third)[saved], value, saved)
    assert (one.stress == two.stress).all()
    assert (one.heat == two.heat).all()


def test_units_of_time_scale_the_moments_exactly(plain):
    slow = fluid(kT=1.0, observers=[HelfandCurrents()])
    factor = 2.0**40  # of speeds: the engine's unit of time is another one then
    faster = FLUID.replace(velocities=slow.frame().velocities * factor)
    fast = carom.Simulation(faster, observers=[HelfandCurrents()], seed=0)
    one = slow.helfand(every=0.0625, count=9)
    two = fast.helfand(every=0.0625 / factor, count=9)
    assert (two.stress == one.stress * factor).all()
    assert (two.heat == one.heat * factor**2).all()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"walls": "z"}, "periodic"),
        ({"impact": 0.9}, "elastic"),
        ({"pinned": [0]}, "conserved momentum"),
        ({"interaction": Ranges([Kind("a", circles=[1.5])], lambda unit, event: None)}, "conserved momentum"),
    ],
)
def test_currents_are_refused_where_helfand_does_not_hold(unscheduled, change, says):
    scene = carom.Scene.random(8, 0.1, seed=1)
    # Far from every face, where some are walls.
    made = carom.Scene(scene.positions + np.array(scene.box) / 2, tuple(2 * e for e in scene.box), **change)
    with pytest.raises(InputError, match=says):
        carom.Simulation(made, observers=[HelfandCurrents()], seed=0)
    with pytest.raises(InputError, match="HelfandCurrents"):
        carom.Simulation(scene, seed=0).helfand(every=0.1, count=5)


def test_mean_squares_of_a_random_walk_are_known():
    from carom.observables.analysis.moments import HelfandMoments, mean_squares

    rng = np.random.default_rng(1)
    count, d = 20_000, 3
    steps = rng.standard_normal((2, count, d, d))
    stress = np.cumsum(0.5 * (steps + np.swapaxes(steps, 2, 3)), axis=1)
    heat = np.cumsum(rng.standard_normal((2, count, d)), axis=1)
    displacement = np.cumsum(rng.standard_normal((1, count, d)), axis=1)
    found = mean_squares(HelfandMoments(0.5, stress, heat, displacement), [1, 4], 0.3)
    trace = np.trace(stress.sum(axis=0), axis1=1, axis2=2) / d - 0.3 * 0.5 * np.arange(count)
    # Off the diagonal a step has the variance 1/2; in every direction, as the tensor is isotropic.
    six_sigma = 6.0 * math.sqrt(2.0 * 4 / count)
    for k, lag in enumerate((1, 4)):
        assert found.shear[:, k] == pytest.approx([0.5 * lag, 0.0, 0.5 * lag], abs=lag * six_sigma)
        assert found.heat[:, k] == pytest.approx([lag, 0.0, lag], abs=lag * six_sigma)
        assert found.times[k] == 0.5 * lag
        moved = trace[lag:] - trace[:-lag]
        assert found.bulk[:, k] == pytest.approx([moved.mean(), np.mean(moved**2)], rel=1e-12)
        # Of one component: heat is the sum of two parts, and independent of the displacement.
        expected = np.diag([2.0, 1.0]) * lag
        assert found.fluxes[:, :, k] == pytest.approx(expected, abs=2.0 * lag * six_sigma)
