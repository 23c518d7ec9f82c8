"""The pressure from tallies: identities, the exact Tonks gas, and too little data."""

import math

import numpy as np
import pytest

from carom import Scene, Simulation, theory
from carom.block import Block
from carom.errors import CaromWarning, InputError
from carom.models import Active, Andersen, Langevin
from carom.models.motions.gravity import Gravity
from carom.models.motions.great_circles import GreatCircles
from carom.observables import Pressure
from carom.simulation.measuring.measure import measure

SIX_SIGMA = 6.0


def synthetic_blocks(z, *, n, dimension, count, seed, duration=50.0, mass=1.0, kT=1.0, diameter=1.0):
    """Blocks of a fluid of compressibility factor `z`: independent collisions, the exact law of |u_n|.

    Canonical: normal relative speeds at collision have p(u) ~ u exp(-m u^2 / 4 kT), so that <m sigma u> over
    <collisions> ties the virial to the collision rate of the infinite fluid.
    """
    rng = np.random.default_rng(seed)
    rate = theory.collision_rate(z, dimension, diameter=diameter, mass=mass, kT=kT) * n / 2
    blocks = []
    for _ in range(count):
        t = duration * rng.uniform(0.5, 1.5)
        collisions = int(rng.poisson(rate * t))
        speeds = rng.rayleigh(math.sqrt(2 * kT / mass), collisions)
        blocks.append(Block(t, collisions, float(np.sum(mass * diameter * speeds))))
    return blocks


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_virial_and_collision_count_both_give_the_z_that_made_them(dimension):
    z, n, units = 3.2, 500, {"mass": 2.5, "kT": 1.7, "diameter": 0.4}
    blocks = synthetic_blocks(z, n=n, dimension=dimension, count=200, seed=dimension, duration=0.5, **units)
    volume = 1.3 * n * theory.ball_volume(dimension, units["diameter"]) / 0.2
    result = Pressure.estimate(blocks, n=n, dimension=dimension, volume=volume, **units)
    virial, count = result.Z, result.Z_from_rate
    assert abs(virial.mean - z) < SIX_SIGMA * virial.error
    if dimension == 1:
        assert math.isnan(count.mean)
    else:
        # The synthetic gas is the infinite one; the route through the count takes n for finite, by c_D.
        c = theory.speed_factor(dimension * (n - 1))
        assert abs(c * (count.mean - 1) - (z - 1)) < SIX_SIGMA * count.error
    # sigma(Z - 1) / (Z - 1): <u^2> / <u>^2 = 4 / pi for independent collisions, known as well as the error
    # itself.
    collisions = sum(block.collisions for block in blocks)
    expected = (z - 1) * math.sqrt(4 / math.pi / collisions)
    assert virial.error == pytest.approx(expected, rel=SIX_SIGMA / math.sqrt(2 * virial.blocks))


def test_every_field_follows_from_the_sums():
    blocks = [Block(2.0, 30, 45.0), Block(1.0, 14, 22.0), Block(3.0, 47, 70.0), Block(2.0, 31, 43.0)] * 8
    n, d, volume, diameter, kT = 20, 3, 60.0, 1.1, 2.0
    result = Pressure.estimate(blocks, n=n, dimension=d, volume=volume, diameter=diameter, kT=kT)
    z = 1 + 180.0 / (d * n * kT * 8.0)
    eta = n * math.pi / 6 * diameter**3 / volume
    assert result.Z.mean == pytest.approx(z, rel=1e-15)
    assert result.collision_rate.mean == pytest.approx(2 * 122 / (n * 8.0), rel=1e-15)
    assert result.reduced_pressure.mean == pytest.approx(z * n * diameter**3 / volume, rel=1e-15)
    assert result.contact_value.mean == pytest.approx((z - 1) * n / (n - 1) / (4 * eta), rel=1e-14)
    assert result.pressure.mean == pytest.approx(z * n * kT / volume, rel=1e-15)
    assert result.packing_fraction == pytest.approx(eta, rel=1e-15)
    total = np.dot(result.block_values, result.block_durations) / sum(result.block_durations)
    assert total == pytest.approx(z, rel=1e-14)


def test_contact_value_and_pressure_agree_for_rods():
    # Exact: n rods on a ring collide with Z - 1 = (1 - 1/n) rho / (1 - rho); g(sigma+) = 1 / (1 - rho).
    n, rho = 10, 0.5
    virial = (theory.tonks(rho, n) - 1) * n
    blocks = [Block(1.0, 100, virial + k) for k in (-1, 1, 1, -1)] * 4
    result = Pressure.estimate(blocks, n=n, dimension=1, volume=n / rho, diameter=1.0, kT=1.0)
    assert result.contact_value.mean == pytest.approx(1 / (1 - rho), rel=1e-14)
    # The differences in the shift are good to eps^(2/3), times derivatives of 1 / (1 - rho).
    assert result.infinite_size().mean == pytest.approx(1 / (1 - rho), rel=1e-9)
    assert result.infinite_size().error == result.Z.error


def test_two_spheres_give_the_exact_table():
    # few_body_exact.json, torus, d = 3, sigma = 0.3: Z and the mean time between collisions. A virial of
    # the exact mean at every collision is all that enters.
    z, time, n, d, sigma = 1.0637597224899795, 1.280583649114921, 2, 3, 0.3
    virial = (z - 1) * d * n * time
    result = Pressure.estimate(
        [Block(100 * time, 100, 100 * virial)] * 8, n=n, dimension=d, volume=1.0, diameter=sigma, kT=1.0
    )
    assert result.Z.mean == pytest.approx(z, rel=1e-14)
    assert result.Z_from_rate.mean == pytest.approx(z, rel=1e-14)


def test_one_particle_has_z_one_exactly():
    result = Pressure.estimate([Block(1.0, 0, 0.0)] * 4, n=1, dimension=3, volume=2.0, diameter=1.0, kT=1.0)
    z = result.Z
    assert (z.mean, z.error) == (1.0, 0.0)
    assert result.reduced_pressure.mean == 0.5
    assert math.isnan(result.contact_value.mean)
    assert str(result).startswith("Z = 1 +- 0")


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("n", [1, 2])
def test_the_pressure_of_few_particles_in_a_bath_is_that_of_its_temperature_and_has_its_error(n):
    kT, edge, friction, duration = 2.0, 5.0, 1.0, 1000.0
    scene = Scene([[1.0, 1.0, 1.0], [3.0, 3.0, 3.0]][:n], edge, drive=Langevin(kT, friction, step=0.2))
    sim = Simulation(scene, seed=1)
    sim.run(time=5.0)
    found = sim.measure(Pressure(), time=duration, blocks=128)
    # Two spheres exclude each other from one volume: the integral over places is V (V - v).
    z = 1.0 if n == 1 else 0.5 * (1.0 + 1.0 / (1.0 - 4.0 * math.pi / 3.0 / edge**3))
    p = found.pressure.scaled(edge**3 / n)
    assert abs(p.mean - z * kT) < SIX_SIGMA * p.error
    # kT has the variance 2 kT^2 / d n, and is correlated over 1 / (2 friction).
    expected = kT * math.sqrt(2.0 / (3 * n * friction * duration))
    assert p.error == pytest.approx(expected, rel=SIX_SIGMA / math.sqrt(2 * p.blocks))


def test_no_collision_leaves_the_error_infinite_and_warns():
    with pytest.warns(CaromWarning, match="0 collisions in all"):
        result = Pressure.estimate(
            [Block(1.0, 0, 0.0)] * 32, n=2, dimension=3, volume=1e6, diameter=1.0, kT=1.0
        )
    assert result.Z.mean == 1.0
    assert result.Z.error == math.inf
    assert result.contact_value.error == math.inf
    assert "inf" in str(result)


def test_blocks_without_duration_are_left_out():
    blocks = synthetic_blocks(2.0, n=50, dimension=2, count=64, seed=9)
    kwargs = {"n": 50, "dimension": 2, "volume": 100.0, "diameter": 1.0, "kT": 1.0}
    assert Pressure.estimate([Block(0.0, 0, 0.0), *blocks], **kwargs) == Pressure.estimate(blocks, **kwargs)
    with pytest.raises(InputError, match="positive duration"):
        Pressure.estimate([Block(0.0, 0, 0.0)], **kwargs)


@pytest.mark.parametrize("name", ["volume", "diameter", "kT", "mass"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_impossible_parameters_are_refused(name, value):
    kwargs = {"n": 5, "dimension": 2, "volume": 9.0, "diameter": 1.0, "kT": 1.0, "mass": 1.0, name: value}
    with pytest.raises(InputError, match=name):
        Pressure.estimate([Block(1.0, 5, 5.0)], **kwargs)


def test_the_correction_to_infinite_size_warns_where_images_are_felt():
    def measured(n, rho):
        return Pressure.estimate(
            [Block(1.0, 100, 300.0)] * 32, n=n, dimension=3, volume=n / rho, diameter=1.0, kT=1.0
        )

    with pytest.warns(CaromWarning, match=r"box of 5\.1 diameters is too small"):
        measured(108, 0.8).infinite_size()
    measured(108, 0.4).infinite_size()
    measured(256, 0.8).infinite_size()


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("scene", "solid"),
    [
        (Scene.crystal(32, 0.6), True),
        (Scene.crystal(16, 0.8, 2, nearest=True), True),
        (Scene.crystal(32, 0.3), False),
        (Scene.crystal(32, 0.6, impact=0.9), False),  # nothing is known of it
    ],
    ids=str,
)
def test_a_measurement_knows_whether_particles_beyond_freezing_stay_where_they_began(scene, solid):
    found = Simulation(scene, seed=1).measure(Pressure(), time=0.1, blocks=4)
    assert found.solid is solid
    if solid:  # exact for n - 1 oscillators
        n = found.n
        assert found.infinite_size().mean == pytest.approx(
            1.0 + (found.Z.mean - 1.0) * n / (n - 1), rel=1e-12
        )
        law = theory.solid(found.dimension)
        shift = -theory.crystal_finite_size_shift(found.packing_fraction, n, law)
        assert found.infinite_size(law).mean == pytest.approx(found.Z.mean + shift, rel=1e-12)
    else:
        law = theory.carnahan_starling
        shift = -theory.finite_size_shift(found.packing_fraction, found.n, law)
        assert found.infinite_size(law).mean == pytest.approx(found.Z.mean + shift, rel=1e-12)


def test_where_fluid_and_solid_coexist_there_is_no_correction_to_infinite_size():
    volume = 100 * theory.ball_volume(2, 1.0) / 0.71
    found = Pressure.estimate(
        [Block(1.0, 100, 300.0)] * 32, n=100, dimension=2, volume=volume, diameter=1.0, kT=1.0
    )
    with pytest.raises(InputError, match="side by side"):
        found.infinite_size()


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"drive": Active(1.0, persistence=5.0, step=0.1)}, "The drive Active changes the energy (kT"),
        ({"drive": Andersen(1.0, rate=0.5)}, "The drive Andersen changes the energy (kT"),
        ({"drive": Andersen(1.0, rate=0.5), "impact": 0.9}, "Contacts and the drive Andersen change the en"),
        ({"impact": 0.9}, "Contacts change the energy (kT"),
        ({}, ""),
    ],
    ids=str,
)
def test_the_note_names_what_changes_the_energy(given, said):
    scene = Scene([[1.0, 1.0], [2.5, 1.2], [1.4, 3.0], [3.1, 3.2]], (4.2, 4.0), **given)
    found = Simulation(scene, seed=1).measure(Pressure(), time=4.0, blocks=4)
    assert found.note.startswith(said)
    assert bool(found.note) == bool(said)


def test_the_error_of_the_contact_value_is_that_of_z():
    blocks = synthetic_blocks(3.2, n=500, dimension=3, count=200, seed=3)
    found = Pressure.estimate(blocks, n=500, dimension=3, volume=900.0, diameter=1.0, kT=1.0)
    z, contact = found.Z, found.contact_value
    assert contact.error / contact.mean == pytest.approx(z.error / (z.mean - 1), rel=1e-12)


def test_pulls_of_the_pressure_have_unit_variance():
    pulls = []
    for seed in range(200):
        blocks = synthetic_blocks(3.2, n=50, dimension=3, count=128, seed=seed, duration=1.0)
        z = Pressure.estimate(blocks, n=50, dimension=3, volume=90.0, diameter=1.0, kT=1.0).Z
        pulls.append((z.mean - 3.2) / z.error)
    # chi squared of 200, at 1e-4 on either side, and t of some 40 degrees of freedom: 2 %.
    assert 0.82 < np.std(pulls) < 1.21


class Drift:
    """A motion of one's own that says nothing of momentum."""

    def model(self, particles):
        raise NotImplementedError


def test_there_is_no_pressure_where_a_motion_changes_the_momentum(unscheduled):
    places = [[4.0, 4.0, 5.0], [4.0, 4.0, 3.0]]
    scene = Scene(places, 8.0, walls="z", motion=Gravity((0.0, 0.0, -1.0)))
    blocks = [Block(1.0, 20, 3.0)] * 4
    with pytest.raises(InputError, match=r"Gravity changes the total momentum.*WallPressure\(\)"):
        Pressure().of_scene(blocks, scene, kT=1.0)
    with pytest.raises(InputError, match="Gravity changes"):  # before the run, not after it
        measure(Simulation(scene), Pressure(), time=1.0)
    with pytest.raises(InputError, match="GreatCircles bends"):
        Pressure().of_scene(blocks, Scene(places, 8.0, diameter=0.5, motion=GreatCircles()), kT=1.0)
    for motion in (None, Gravity((0.0, 0.0, 0.0)), Drift()):
        z = Pressure().of_scene(blocks, scene.replace(motion=motion), kT=1.0).Z
        assert z.mean == 1.5
