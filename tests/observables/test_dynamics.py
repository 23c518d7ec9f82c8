"""Correlations in time on the way: against sums over stored frames, exact limits, and files."""

import dataclasses
import math

import numpy as np
import pytest

import carom
from carom import theory
from carom.errors import InputError
from carom.frame import Frame
from carom.observables import Dynamics
from carom.observables.analysis.waves import Waves
from carom.observables.dynamics import KEPT, _non_gaussian

SIX = 6.0


@pytest.fixture(scope="module")
def frames():
    """Return 200 frames of a fluid."""
    sim = carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=1)
    sim.run(collisions_per_particle=30)
    return list(sim.sample(every=0.0625, count=200))


@pytest.fixture(scope="module")
def found(frames):
    dynamics = Dynamics(shells=3)
    for frame in frames:
        dynamics.add(frame)
    return dynamics.result()


def test_times_are_even_at_first_then_logarithmic_without_a_gap(found):
    lags = np.rint(found.times / 0.0625).astype(int)
    assert lags[: KEPT - 1].tolist() == list(range(1, KEPT))
    assert (np.diff(lags) > 0).all()
    assert (lags[1:] / lags[:-1] <= 1.125 + 1e-12)[KEPT:].all()
    assert lags[-1] > 100


def by_hand(frames, lag):
    """Return square, fourth power and product of velocities at a lag, over all frames."""
    values = []
    for one, two in zip(frames[:-lag], frames[lag:], strict=True):
        step = two.unwrapped - one.unwrapped
        square = np.sum(step**2, axis=1)
        values.append(
            [square.mean(), (square**2).mean(), np.mean(np.sum(one.velocities * two.velocities, axis=1))]
        )
    return np.mean(values, axis=0)


@pytest.mark.parametrize(("lag", "every"), [(1, 1), (15, 1), (24, 2), (48, 4)])
def test_correlations_are_those_of_stored_frames(frames, found, lag, every):
    k = int(np.flatnonzero(np.rint(found.times / 0.0625) == lag)[0])
    first = every if every > 1 else 0  # a longer spacing begins with its first multiple
    values = by_hand(frames[first::every], lag // every)
    assert found.mean_square[k] == pytest.approx(values[0], rel=1e-12)
    assert found.velocity_autocorrelation[k] == pytest.approx(values[2] / 3.0, rel=1e-9)
    right = 3.0 * values[1] / (5.0 * values[0] ** 2) - 1.0
    assert found.non_gaussian[k] == pytest.approx(right, abs=1e-12)


def test_the_running_diffusion_is_the_slope_of_the_mean_square(found):
    slope = np.gradient(found.mean_square, found.times) / 6.0
    running = found.running_diffusion
    assert running[3:12] == pytest.approx(slope[3:12], rel=0.02)  # differences over three frames


def test_scattering_begins_with_the_structure_factor(frames, found):
    waves = Waves.of(frames[0].box, 3)
    assert waves.lengths[0] == pytest.approx(2.0 * np.pi / frames[0].box[0])
    assert np.bincount(waves.shell).tolist() == [3, 6, 4]
    q = 2.0 * np.pi * waves.numbers / np.array(frames[0].box)
    values = [np.abs(np.exp(1j * frame.positions @ q.T).sum(axis=0)) ** 2 / frame.n for frame in frames]
    by_shell = [np.mean([v[waves.shell == s].mean() for v in values]) for s in range(3)]
    assert found.structure_factor == pytest.approx(by_shell, rel=1e-9)
    for s in range(3):
        assert found.scattering[0, s] < found.structure_factor[s]
        assert (
            abs(found.scattering[-1, s])
            < SIX * found.scattering_error[-1, s] + 0.1 * found.structure_factor[s]
        )


@pytest.mark.parametrize(("start", "count"), [(0.0, 40), (1e4, 40)])
def test_times_in_single_precision_are_equally_spaced_and_a_lost_frame_is_seen(frames, start, count):
    def correlated(steps):
        dynamics = Dynamics()
        for k in steps:
            time = float(np.float32(start + 0.1 * k))
            dynamics.add(dataclasses.replace(frames[k % 2], time=time))

    correlated(range(count))
    with pytest.raises(InputError, match="equal spacing"):
        correlated([*range(count), count + 1])


@pytest.mark.slow
def test_the_long_time_tail_of_the_velocity_autocorrelation_is_that_of_mode_coupling():
    # J. J. Erpenbeck and W. W. Wood, Phys. Rev. A 32, 412 (1985): from 15 to 30 mean free times on, spheres
    # follow mode coupling with Enskog's coefficients, summed over the waves of the periodic box. Here the
    # function is above it: by 0.42 +- 0.01 at 15, and 0.28 +- 0.02 from 25 to 36, in six runs half as long.
    # At 40 sound has crossed the box and adds to it.
    density = 0.5
    eta = density * math.pi / 6.0
    z = theory.best(3)(eta)
    enskog = theory.enskog(z, eta, 3)
    diffusion = enskog.self_diffusion * theory.erpenbeck_wood(eta)
    sim = carom.Simulation(carom.Scene.crystal(cells=10, packing_fraction=eta), seed=1)
    sim.run(collisions_per_particle=100)
    found = sim.measure(Dynamics(), time=3000.0, blocks=12000)
    octant = np.indices((15, 15, 15)).reshape(3, -1)
    squares = (2.0 * math.pi / sim.scene.box[0]) ** 2 * np.sum(octant**2, axis=0)
    weights = np.prod(np.where(octant > 0, 2, 1), axis=0) * (squares > 0.0)
    ratios, errors = {}, {}
    columns = found.times, found.velocity_autocorrelation, found.velocity_autocorrelation_error
    for t, value, scatter in zip(*columns, strict=True):
        free_times = t / theory.mean_free_time(z, 3)
        if 15.0 < free_times < 36.0:
            decay = np.exp(-(diffusion + enskog.shear_viscosity / density) * squares * t)
            expected = 2.0 / 3.0 / sim.scene.n * float(weights @ decay)
            endless = theory.velocity_tail(density, diffusion, enskog.shear_viscosity, 3) * t**-1.5
            print(f"{free_times:.1f} {value:.5f} +- {scatter:.5f} waves {expected:.5f} endless {endless:.5f}")
            assert expected == pytest.approx(endless, rel=0.15)  # the box is felt a little
            ratios[free_times], errors[free_times] = value / expected, scatter / expected
    late = [k for k in ratios if k > 25.0]
    print({round(k, 1): f"{ratios[k]:.2f} +- {errors[k]:.2f}" for k in ratios})
    # Neighboring times share their frames: the mean of all is counted as no better than one.
    mean, error, first = np.mean([ratios[k] for k in late]), min(errors[k] for k in late), min(ratios)
    assert error < 0.05
    assert 1.0 - 4.0 * error < mean < 4.0 / 3.0 + 4.0 * error
    assert ratios[first] > mean + 2.0 * min(errors.values())


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_the_non_gaussian_parameter_is_that_of_its_dimension(d):
    square, fourth = np.random.default_rng(d).uniform(1.0, 2.0, (2, 32))
    found = _non_gaussian(square, fourth, d).mean
    assert found == pytest.approx(d * fourth.mean() / ((d + 2) * square.mean() ** 2) - 1.0)


def test_error_bars_of_the_non_gaussian_parameter_cover_what_is_zero():
    """Displacements of 50 components, each Gaussian. <r^4> and <r^2>^2 scatter together, which a linear error
    has to know: with half of the coefficient bars are half as wide again."""
    dice, d = np.random.default_rng(1), 3
    pulls = []
    for _ in range(400):
        square = np.sum(dice.normal(size=(256, 50, d)) ** 2, axis=2)
        found = _non_gaussian(square.mean(axis=1), (square**2).mean(axis=1), d)
        pulls.append(found.mean / found.error)
    # The spread of 400 pulls is known to 3.5 %; 1 / n is the bias of the mean of products.
    assert 0.86 < np.std(pulls) < 1.14
    assert abs(np.mean(pulls)) < 4.0 / np.sqrt(400)


def of_frames(sim, time, frames):
    """Return the mean square displacement over a quarter of a unit of time, from unwrapped positions."""
    x = np.array([frame.unwrapped for frame in sim.sample(every=time / frames, count=frames)])
    return np.mean(np.sum((x[1:] - x[:-1]) ** 2, axis=(1, 2))) / x.shape[1]


LORENTZ = carom.Scene(
    [[0.5, 3.5]], (4.0, 4.0), diameter=0.5, velocities=[[0.8, 0.6]],
    obstacles=[carom.models.Ball((2.0, 2.0), 1.0)],
)  # fmt: skip
SLIT = carom.Scene(
    [[1.0, 1.0], [3.0, 1.0], [1.0, 3.0], [3.0, 3.0]], (4.0, 4.0), walls="y",
    velocities=[[2.0, 0.1], [2.1, -0.2], [1.9, 0.3], [2.0, -0.2]],
)  # fmt: skip


@pytest.mark.slow
def test_one_between_obstacles_has_no_center_of_mass_to_subtract():
    found = carom.Simulation(LORENTZ, seed=0).measure(Dynamics(), time=64.0, blocks=256)
    expected = of_frames(carom.Simulation(LORENTZ, seed=0), 64.0, 256)
    assert found.mean_square[0] == pytest.approx(expected, rel=0.02)  # one frame more or less of 256
    assert (found.mean_square / found.times**2).max() <= 1.0 + 1e-9


@pytest.mark.slow
def test_a_drift_along_a_slit_is_subtracted_and_none_across():
    found = carom.Simulation(SLIT, seed=0).measure(Dynamics(), time=32.0, blocks=64)
    at_rest = SLIT.velocities - [2.0, 0.0]
    same = carom.Simulation(SLIT.replace(velocities=at_rest), seed=0).measure(
        Dynamics(), time=32.0, blocks=64
    )
    assert found.mean_square == pytest.approx(same.mean_square, rel=1e-9)


def ballistic(velocities, turned=()):
    """Frames of free flight, in which the velocities of some components are turned round half-way."""
    v, frames = np.array(velocities, dtype=float), []
    x, ones, masses = np.full(v.shape, 50.0), np.ones(len(v)), 1.0 + np.arange(len(v))
    for k in range(16):
        if k == 8:
            v[list(turned)] *= -1.0
        images = np.zeros(v.shape, np.int32)
        frames.append(Frame(0.5 * k, k, x, v.copy(), (100.0, 100.0), ones, masses, images))
        x = x + 0.5 * v
    return frames


@pytest.mark.parametrize(
    ("scene", "axes"),
    [
        (LORENTZ, (False, False)),
        (SLIT, (True, False)),
        (carom.Scene([[1.0, 1.0], [3.0, 3.0]], 4.0), (True, True)),
        (carom.Scene([[1.0, 1.0], [3.0, 3.0]], 4.0, pinned=[1]), (False, False)),
        (carom.Scene([[1.0, 1.0]], 4.0), (False, False)),
    ],
)
def test_the_motion_of_the_center_of_mass_is_subtracted_where_momentum_is_conserved(scene, axes):
    frames = ballistic([[2.0, 0.5], [1.0, 0.25], [3.0, -0.5]])
    dynamics = Dynamics()
    dynamics.begin(scene)
    for frame in frames:
        dynamics.add(frame)
    v, masses = frames[0].velocities, frames[0].masses
    v = v - np.where(axes, np.average(v, axis=0, weights=masses), 0.0)
    found = dynamics.result()
    for t, square in zip(found.times, found.mean_square, strict=True):
        assert square == pytest.approx(t * t * np.mean(np.sum(v * v, axis=1)), rel=1e-12)


def test_frames_whose_momentum_changes_are_refused_unless_the_axes_are_named():
    frames = ballistic([[2.0, 0.5], [1.0, 0.25]], turned=[1])
    first, second = Dynamics(), Dynamics(conserved=(False, False))
    for frame in frames[:8]:
        first.add(frame)
    with pytest.raises(InputError, match=r"momentum changed along axis 0.*Dynamics\(conserved="):
        first.add(frames[8])
    for frame in frames:
        second.add(frame)
    x = np.array([frame.unwrapped for frame in frames])
    expected = np.mean(np.sum((x[1:] - x[:-1]) ** 2, axis=2))
    assert second.result().mean_square[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("kind", [0, 1])
def test_scattering_of_one_species_is_that_of_its_components_alone(frames, kind):
    kinds = (np.arange(frames[0].n) % 4 == 0).astype(np.int64)
    dynamics, alone = Dynamics(shells=3, species=kind, conserved=(True,) * 3), []
    for frame in frames[:40]:
        dynamics.add(dataclasses.replace(frame, species=kinds))
        alone.append(frame.positions[kinds == kind])
    found, waves = dynamics.result(), Waves.of(frames[0].box, 3)
    moves = [np.mean(frame.velocities[kinds == kind] ** 2) for frame in frames[:40]]
    assert found.velocity_square.mean == pytest.approx(np.mean(moves), rel=1e-9)
    q = 2.0 * np.pi * waves.numbers / np.array(frames[0].box)
    rho = np.array([np.exp(1j * places @ q.T).sum(axis=0) for places in alone])
    for lag, values in ((0, found.structure_factor), (1, found.scattering[0])):
        pairs = (rho[lag:] * rho[: len(rho) - lag].conj()).real.mean(axis=0) / np.sum(kinds == kind)
        by_shell = [pairs[waves.shell == s].mean() for s in range(3)]
        assert values == pytest.approx(by_shell, rel=1e-9)


def walk(dice, memory, frames=50, n=60):
    """Return frames of particles in a plane whose velocities forget a part in each step of time 1, and D."""
    v, x = dice.normal(size=(n, 2)), np.zeros((frames, n, 2))
    for k in range(1, frames):
        x[k] = x[k - 1] + v
        v = memory * v + np.sqrt(1.0 - memory**2) * dice.normal(size=(n, 2))
    box, zero, one = (1e3, 1e3), np.zeros((n, 2)), np.ones(n)
    rest = {"images": np.zeros((n, 2), np.int32), "lacks": frozenset({"velocities"})}
    found = [Frame(2.0 * k, k, place, zero, box, one, one, **rest) for k, place in enumerate(x)]
    return found, 0.5 * (1.0 + memory) / (1.0 - memory) / 2.0  # a frame takes a time 2


@pytest.mark.parametrize("memory", [0.0, 0.4, 0.7])
def test_the_coefficient_of_diffusion_is_that_of_a_random_walk_within_its_error(memory):
    dice, pulls, errors = np.random.default_rng(3), [], []
    for _ in range(80):
        frames, diffusion = walk(dice, memory)
        found = Dynamics().over(frames)
        assert 2.0 <= found.fit_first < found.fit_last <= found.times[-1]
        pulls.append((found.diffusion.mean - diffusion) / found.diffusion.error)
        errors.append(found.diffusion.error / diffusion)
    # Of 80 pulls the mean is known to 0.11, their spread to 8 %, and 95 % +- 2.4 % are below 2. Errors of few
    # frames are estimated from above.
    assert abs(np.mean(pulls)) < 4 * 0.11
    assert 0.5 < np.std(pulls) < 1.32
    assert np.mean(np.abs(pulls) < 2.0) > 0.95 - 4 * 0.024
    assert np.median(errors) < 0.2


def test_the_coefficient_of_diffusion_of_a_species_is_that_of_its_particles_alone():
    frames, _ = walk(np.random.default_rng(4), 0.0)
    kinds = np.arange(60) % 6
    mixed = [dataclasses.replace(frame, species=kinds) for frame in frames]
    fields = ("positions", "velocities", "diameters", "masses", "images")
    alone = [
        dataclasses.replace(frame, **{name: getattr(frame, name)[kinds == 1] for name in fields})
        for frame in frames
    ]
    found, expected = Dynamics(species=1).over(mixed), Dynamics().over(alone)
    assert (found.fit_first, found.fit_last) == (expected.fit_first, expected.fit_last)
    assert found.diffusion.mean == pytest.approx(expected.diffusion.mean, rel=1e-12)
    assert found.diffusion.error == pytest.approx(expected.diffusion.error, rel=1e-12)


def test_the_coefficient_of_diffusion_is_in_the_sentence_the_table_and_the_picture(tmp_path):
    found = Dynamics().over(walk(np.random.default_rng(7), 0.0)[0])
    value = found.diffusion.value_text
    assert f"D [length^2 / time] is {value} by a line from time 4 to 8" in str(found)
    assert ("D [length^2 / time]", f"{value} by a line from time 4 to 8") in found._rows()[1]
    found.save(tmp_path / "msd.csv")
    assert f"# diffusion: {found.diffusion.mean}\n" in (tmp_path / "msd.csv").read_text()
    labels = [line.get_label() for line in found.plot().axes[0].lines]
    assert f"2dDt + c, D = {value.replace('+-', '±')}" in labels
    fitted = (found.times >= 4.0) & (found.times <= 8.0)
    line = np.polyfit(found.times[fitted], found.mean_square[fitted], 1)
    # The fit takes displacements that end with those over the longest of its times: a few more or less.
    assert line[0] == pytest.approx(4.0 * found.diffusion.mean, rel=0.1)


def test_there_is_no_coefficient_of_diffusion_where_no_line_is_seen():
    frames, _ = walk(np.random.default_rng(5), 0.99, frames=30)  # in all they fly for half of their memory
    walled = [
        dataclasses.replace(frame, periodic=(True, False)) for frame in walk(np.random.default_rng(6), 0.0)[0]
    ]
    for each in (frames, walled):
        found = Dynamics().over(each)
        assert math.isnan(found.diffusion.mean)
        assert math.isnan(found.fit_first)
        assert "D [length^2 / time] is unknown" in str(found)
        assert not any("D =" in line.get_label() for line in found.plot().axes[0].lines)
