"""Temperature and pressure are the same to everyone who moves along an axis of conserved momentum."""

import math

import numpy as np
import pytest
from helpers.marks import slow
from helpers.mixtures import mixed
from helpers.oracle_scenes import placed

import carom
from carom import theory
from carom.models import CylindricalContainer, Plane, Shear
from carom.models.obstacles.named_walls import axes_without
from carom.scene.velocities import conserved, peculiar, temperature
from carom.simulation.measuring import stretches
from carom.simulation.measuring.invariants import EnergyMomentum
from carom.units import TimeUnit

EPS = np.finfo(float).eps
SIX_SIGMA = 6.0


def boosted(scene, boost):
    """Return the scene as somebody sees it who moves at that speed along the axes of conserved momenta."""
    along = np.where(conserved(scene), boost, 0.0)
    return scene.replace(velocities=scene.velocities + along)


BOOSTS = (0.0, 0.3, 5.0)
BOXES = {1: (10.0,), 2: (4.0, 3.6), 3: (2.7, 2.6, 2.5), 4: (2.1, 2.2, 2.1, 2.2)}


def fluid(d):
    return placed(6, BOXES[d], d, diameters=None, masses=None)


def mixture(d):
    sizes, masses = [1.0, 0.6], [1.0, 20.0]
    rng = np.random.default_rng(3)
    scene = carom.Scene.random(
        species=mixed(counts=[2, 4], diameters=sizes, masses=masses), box=BOXES[d], seed=rng
    )
    return scene.replace(velocities=np.random.default_rng(4).normal(size=(6, d)))


def between_walls(d):
    return placed(6, BOXES[d], d, walls=axes_without([True] * (d - 1) + [False]))


def above_a_plane():
    return placed(5, (5.0, 4.0), 2, walls="y", obstacles=[Plane((0.0, 1.0), 0.2)])


def in_a_tube():
    tube = CylindricalContainer(0, (0.0, 2.0, 2.0), 1.9)
    return placed(5, (5.0, 4.0, 4.0), 3, walls="yz", obstacles=[tube])


SCENES = {
    **{f"equal, d = {d}": (fluid, d) for d in (1, 2, 3, 4)},
    **{f"mixture, d = {d}": (mixture, d) for d in (2, 3)},
    **{f"walls, d = {d}": (between_walls, d) for d in (2, 3)},
    "plane": (above_a_plane,),
    "tube": (in_a_tube,),
}


def measured(name, boost):
    """Return kT, Z and the pressure of walls from a short run, and what was seen of its chaos."""
    build, *arguments = SCENES[name]
    sim = carom.Simulation(boosted(build(*arguments), boost))
    kT = sim.kT
    blocks = list(stretches.blocks(sim, 0.1, 20))
    found = stretches.estimate(sim, carom.Pressure(), blocks)
    assert sim.collisions > 4
    assert sim.kT == pytest.approx(kT, rel=1e-12)
    sim.rescale(0.7)
    momentum = sim.scene.masses @ sim.frame().velocities
    assert np.abs(momentum[list(conserved(sim.scene))]).max() < 1e-13
    assert sim.kT == pytest.approx(0.7, rel=1e-13)
    z = found.Z
    return kT, z.mean, z.error, sim.collisions


@pytest.mark.filterwarnings("ignore::carom.CaromWarning")  # some twenty collisions are a guess
@pytest.mark.parametrize("name", [slow(name) if name == "equal, d = 4" else name for name in SCENES])
def test_a_net_momentum_changes_no_temperature_and_no_pressure(plain, name):
    # The same trajectories, seen by others: what differs is rounding, amplified by a few collisions each.
    rest, *moving = (measured(name, boost) for boost in BOOSTS)
    assert len(moving) == 2
    assert rest[1] > 1.0
    for found in moving:
        assert found[0] == pytest.approx(rest[0], rel=1e-13)
        assert found[1:3] == pytest.approx(rest[1:3], rel=1e-6)
        assert found[3] == rest[3]


@pytest.mark.filterwarnings("ignore::carom.CaromWarning")
@pytest.mark.parametrize("period", [None, 0.5])
def test_a_net_momentum_changes_nothing_in_a_shear_where_the_stream_changes_it(plain, period):
    found = []
    for boost in ([0.0, 0.0], [3.0, 0.0], [0.4, -5.0]):
        scene = boosted(fluid(2), boost).replace(motion=Shear(0.7, period=period))
        sim = carom.Simulation(scene)
        pressure, tensor = sim.measure(carom.Pressure(), carom.PressureTensor(), time=0.7, blocks=16)
        assert sim.statistics.momentum_drift < 1e-13
        assert period or sim.statistics.energy_drift < 1e-13
        found.append([pressure.Z.mean, pressure.kT, *tensor.tensor.ravel(), sim.kT, sim.collisions])
    assert found[0][-1] > 4
    # The same trajectories, seen by others: what differs is rounding, amplified by a few collisions each.
    assert found[1] == pytest.approx(found[0], rel=1e-9)
    assert found[2] == pytest.approx(found[0], rel=1e-9)


@pytest.mark.parametrize("boost", [0.0, 0.3, 5.0])
def test_two_rods_on_a_ring_have_the_exact_pressure_in_every_frame(plain, boost):
    # They meet 2 v / (L - 2) times a time, with a virial of 2 m v each: Z = 1 + 1 / (L - 2), for any N the
    # Tonks gas of N rods on a ring. The temperature has one degree of freedom, not two.
    length, speed = 5.0, 0.75
    scene = carom.Scene([[1.0], [3.0]], length, velocities=[[speed + boost], [boost - speed]])
    sim = carom.Simulation(scene)
    assert sim.kT == pytest.approx(2 * speed**2, rel=4 * EPS * (1 + boost / speed))
    period = (length - 2) / (2 * speed)
    found = stretches.estimate(sim, carom.Pressure(), list(stretches.blocks(sim, 2 * period, 16)))
    assert found.Z.mean == pytest.approx(1 + 1 / (length - 2), rel=1e-12 * (1 + boost))


@pytest.mark.parametrize(("d", "boost"), [slow(2, 5.0), (3, 5.0)])
def test_two_spheres_have_the_exact_pressure_by_virial_and_by_count(d, boost):
    # The configurations of one beside the other fill V - v, v being the ball of radius sigma: canonical
    # Z = 1 + v / (V - v) / 2. A degree of freedom more or less would be a half, or a third, of Z - 1.
    edge = 2.6
    volume, excluded = edge**d, theory.ball_volume(d, 2.0)
    velocities = np.array([[0.3, 0.8, -0.5][:d], [-0.4, 0.1, 0.7][:d]]) + boost
    scene = carom.Scene([[0.2] * d, [1.5] * d], edge, velocities=velocities)
    sim = carom.Simulation(scene)
    found = sim.measure(carom.Pressure(), collisions=40_000)
    exact = 1 + excluded / (volume - excluded) / 2
    for z in (found.Z, found.Z_from_rate):
        assert abs(z.mean - exact) < SIX_SIGMA * z.error
        assert z.error < 0.01 * (exact - 1)


def test_equal_velocities_have_no_temperature_at_all():
    scene = carom.Scene.random(40, 0.1, seed=1).replace(mass=np.linspace(0.1, 7.0, 40))
    velocities = np.tile([0.1, 1e9 / 3.0, -7e-5], (40, 1))
    assert temperature(scene, velocities) == 0.0
    assert not peculiar(scene, velocities).any()


@pytest.mark.parametrize("boost", [1.0, 1e4, 1e8])
def test_a_huge_boost_costs_the_digits_that_the_velocities_have_lost_and_no_more(boost):
    scene = carom.Scene.random(200, 0.1, seed=1)
    velocities = np.random.default_rng(2).normal(size=(200, 3))
    right = temperature(scene, velocities)
    # Every velocity is rounded to eps / 2 of the boost, at random: 600 of them, of one size.
    lost = EPS * boost * 2 / math.sqrt(600)
    assert temperature(scene, velocities + boost) == pytest.approx(right, rel=SIX_SIGMA * (lost + EPS))


def test_along_an_axis_with_walls_a_common_velocity_is_heat():
    scene = between_walls(2)
    still = scene.velocities
    for axis, heat in ((0, 0.0), (1, 1.0)):
        rest = peculiar(scene, still)
        moving = rest + np.where(np.arange(2) == axis, 3.0, 0.0)
        cross = 2 * 3.0 * float(scene.masses @ rest[:, 1])
        added = heat * (scene.masses.sum() * 9.0 + cross) / (2 * scene.n - 1)
        assert temperature(scene, moving) == pytest.approx(temperature(scene, rest) + added, rel=1e-13)


def test_what_a_run_should_keep_does_not_depend_on_the_unit_of_time_of_the_engine():
    rng = np.random.default_rng(1)
    masses, velocities, kick = rng.uniform(0.5, 2.0, 9), rng.normal(size=(9, 3)), np.array([0.1, 0.0, 0.2])
    found = []
    for unit in (TimeUnit(0), TimeUnit(40)):
        start, end = (
            EnergyMomentum.of(masses, unit.to_kernel(v, -1), unit) for v in (velocities, velocities + kick)
        )
        found.append((start.energy, start.momentum.tolist(), start.scale, end.momentum_drift(start)))
    assert found[0] == found[1]
    speeds = np.linalg.norm(velocities, axis=1)
    drift = masses.sum() * np.linalg.norm(kick) / np.sum(masses * speeds)
    assert found[0][3] == pytest.approx(drift, rel=1e-12)
