"""The pressure on walls and obstacles from tallies, and the degrees of freedom that go with them."""

import dataclasses
import math
import warnings

import numpy as np
import pytest
from helpers.frames import at_rest
from scipy.stats import chi2

import carom
from carom.block import Block
from carom.errors import CaromWarning, InputError
from carom.frame import Frame
from carom.models import Ball, CylindricalContainer, Plane, SphericalContainer
from carom.models.obstacles.named_walls import axes_without
from carom.models.obstacles.segments import Segment
from carom.observables import WallPressure
from carom.observables.analysis.momentum_balance import weighted_momenta
from carom.observables.statistics import blocking
from carom.scene.velocities import conserved, velocities_of
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import RunSpec, SceneSpec
from carom.simulation.measuring.measure import measure
from carom.studies.runs import execution as runs


def blocks(impulses, count=64, duration=2.0):
    """Return blocks of independent impulses around those given, and the seeded numbers themselves."""
    rng = np.random.default_rng(1)
    values = np.array(impulses) * rng.uniform(0.5, 1.5, (count, len(impulses)))
    return [Block(duration, 0, 0.0, tuple(row)) for row in values.tolist()], values


def estimate(request, scene, series):
    return request.of_scene(series, scene, kT=1.0)


WALLED = carom.Scene([[1.0, 2.0, 3.0]], (3.0, 5.0, 7.0), walls="yz")
"""The first axis is periodic, so that the second one has the first walls; no two faces are alike."""

FURNISHED = carom.Scene(
    [[5.0, 5.0, 1.0]], (10.0, 10.0, 8.0), walls="xy",
    obstacles=(
        Plane((0.0, 1.0, 0.0), 0.5, "floor"), Ball((5.0, 3.0, 5.0), 0.5),
        CylindricalContainer(2, (5.0, 5.0, 0.0), 4.9),
    ),
)  # fmt: skip
AREAS = [
    (WALLED, {"y_low": 21.0, "y_high": 21.0, "z_low": 15.0, "z_high": 15.0}),
    (FURNISHED, dict.fromkeys(("x_low", "x_high", "y_low", "y_high"), 80.0)
     | {"floor": None, "ball": math.pi, "cylinder": 2 * math.pi * 4.9 * 8.0}),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "areas"), AREAS, ids=["walls", "obstacles"])
def test_the_pressure_is_force_by_area_on_every_wall_and_kind_of_obstacle(scene, areas):
    series, values = blocks(np.arange(1.0, 1.0 + len(areas)))
    forces = values.mean(axis=0) / 2.0
    for k, (name, area) in enumerate(areas.items()):
        for which in (k, name):
            found = estimate(WallPressure(which, None if area else 7.0), scene, series)
            assert (found.name, found.primary) == (name, found.pressure)
            assert found.area == pytest.approx(area or 7.0, rel=1e-14)
            assert found.pressure.mean == pytest.approx(forces[k] / found.area, rel=1e-12)
            assert found.force.mean == pytest.approx(forces[k], rel=1e-12)
            assert found.force.error == pytest.approx(blocking(values[:, k]).error / 2.0, rel=1e-9)
            assert found.pressure.error == pytest.approx(found.force.error / found.area, rel=1e-12)
            whole = np.dot(found.block_values, found.block_durations) / sum(found.block_durations)
            assert whole == pytest.approx(found.pressure.mean, rel=1e-12)
            assert str(found).startswith(f"P on {name} = ")


def test_a_plane_in_the_place_of_a_wall_has_its_area_and_a_tube_that_of_its_own_axis():
    floor = WALLED.replace(obstacles=(Plane((0.0, 0.0, 1.0), 0.0, "floor"),))
    assert estimate(WallPressure("floor"), floor, blocks([1.0] * 5)[0]).area == 15.0
    tube = carom.Scene(
        [[2.0, 2.0, 2.0]], (4.0, 7.0, 4.0), walls="xz",
        obstacles=(CylindricalContainer(1, (2.0, 0.0, 2.0), 1.8),),
    )  # fmt: skip
    area = 2 * math.pi * 1.8 * 7.0
    assert estimate(WallPressure("cylinder"), tube, blocks([1.0] * 5)[0]).area == pytest.approx(area)


@pytest.mark.parametrize(("d", "area"), [(1, 2.0), (2, 4 * math.pi), (3, 16 * math.pi), (4, 16 * math.pi**2)])
def test_surface_of_a_spherical_container(d, area):
    scene = carom.Scene([[2.5] * d], 5.0, walls=True, obstacles=(SphericalContainer((2.5,) * d, 2.0),))
    found = estimate(WallPressure("sphere"), scene, blocks([1.0] * (2 * d + 1))[0])
    assert found.area == pytest.approx(area, rel=1e-14)
    assert estimate(WallPressure(0), scene, blocks([1.0] * (2 * d + 1))[0]).area == 5.0 ** (d - 1)


CROWDED = carom.Scene(
    [[2.0, 2.0]], (9.0, 9.0), walls="y",
    obstacles=(Ball((1.0, 1.0), 0.2), Ball((3.0, 3.0), 0.2), Plane((0.0, 1.0), 0.1)),
)  # fmt: skip
WIRE = carom.Scene([[1.0] * 3], 6.0, obstacles=[Segment((2.0, 3.0, 3.0), (4.0, 3.0, 3.0), name="wire")])
FIVE = blocks([1.0] * 5)[0]


@pytest.mark.parametrize(
    ("which", "area", "scene", "series", "says"),
    [
        (5, None, CROWDED, FIVE, "obstacle"),
        ("roof", None, CROWDED, FIVE, "'roof'"),
        ("ball", None, CROWDED, FIVE, "found 2"),
        ("plane", None, CROWDED, FIVE, "area="),
        ("wire", None, WIRE, FIVE, "area of wire is not known"),
        (0, None, carom.Scene([[2.0]], 9.0), FIVE, "neither walls nor obstacles"),
        (
            0,
            None,
            carom.Scene([[2.0]], 9.0, walls=True),
            [Block(0.0, 0, 0.0, (0.0, 0.0))],
            "positive duration",
        ),
        (0, 0.0, CROWDED, FIVE, "area"),
        (0, "1", CROWDED, FIVE, "area"),
    ],
)
def test_what_has_no_pressure_on_it_is_said(which, area, scene, series, says):
    with pytest.raises(InputError, match=says):
        estimate(WallPressure(which, area), scene, series)


def test_a_segment_without_a_radius_has_an_area_in_two_dimensions_only(unscheduled):
    with pytest.raises(InputError, match="area of wire is not known"):  # before the run
        measure(carom.Simulation(WIRE), WallPressure("wire"), time=1.0)
    assert estimate(WallPressure("wire", area=2.0), WIRE, FIVE).area == 2.0
    flat = carom.Scene([[1.0, 1.0]], 6.0, obstacles=[Segment((2.0, 3.0), (4.0, 3.0))])
    assert estimate(WallPressure("segment"), flat, FIVE).area == pytest.approx(4.0)


GLIDING = [
    # d, periodic axes, obstacles, axes along which momentum is conserved
    (3, (True, True, True), (), 3),
    (3, (True, True, False), (), 2),
    (3, (False, False, False), (), 0),
    (2, (True, True), (Ball((1.0, 1.0), 0.2),), 0),
    (3, (True, False, False), (Plane((0.0, 1.0, 1.0), 0.1),), 1),
    (3, (False, True, False), (CylindricalContainer(1, (4.0, 4.0, 4.0), 3.9),), 1),
]


@pytest.mark.parametrize(("d", "periodic", "obstacles", "kept"), GLIDING)
def test_degrees_of_freedom_and_the_temperature_drawn(d, periodic, obstacles, kept):
    masses = [1.0, 2.0, 5.0]
    places = np.array([[2.0] * d, [4.0] * d, [5.5] * d])
    scene = carom.Scene(places, 8.0, mass=masses, walls=axes_without(periodic), obstacles=obstacles)
    still = conserved(scene)
    assert sum(still) == kept
    velocities = velocities_of(scene, 0.7, 1)
    momentum = np.array(masses) @ velocities
    assert ((np.abs(momentum) < 1e-14) == still).all()
    twice = np.array(masses) @ (velocities**2).sum(axis=1)
    assert twice == pytest.approx(0.7 * (3 * d - kept), rel=1e-14)


# A component of diameter 1 in an edge of 8: which obstacle, where it touches that, the normal there, out of
# the fluid; the axes whose motion the balance sees, and the free length.
ROUND = (SphericalContainer((4.0,) * 3, 3.5),)
LONG = (CylindricalContainer(1, (4.0,) * 3, 3.5),)
FREE = [
    ((False,), (), 1, [7.5], [1.0], (0,), 7.0),
    ((True, False), (), 0, [3.0, 0.5], [0.0, -1.0], (1,), 7.0),
    ((False, False, False), (), 4, [3.0, 5.0, 0.5], [0.0, 0.0, -1.0], (2,), 7.0),
    ((False,) * 3, ROUND, 6, [4.0, 7.0, 4.0], [0, 1, 0], (0, 1, 2), 3.0),
    ((False, True, False), LONG, 4, [4, 5, 1], [0, 0, -1], (0, 2), 3.0),
    ((True, True), (Ball((7.0, 4.0), 1.0),), 0, [0.5, 4.0], [-1.0, 0.0], None, None),
    ((True, False), (Plane((0.0, -1.0), -7.0),), 2, [1.0, 6.5], [0.0, 1.0], None, None),
]  # fmt: skip


@pytest.mark.parametrize(("periodic", "obstacles", "k", "touching", "normal", "axes", "free"), FREE)
def test_the_balance_of_a_contact_and_of_free_flight(periodic, obstacles, k, touching, normal, axes, free):
    d = len(periodic)
    velocity = np.array([0.7, 0.45, -0.3])[:d]
    scene = carom.Scene(
        [[3.3] * d], 8.0, mass=2.0, velocities=[velocity], walls=axes_without(periodic), obstacles=obstacles
    )

    def weighted(place):
        still = at_rest(scene, periodic=periodic)
        frame = dataclasses.replace(still, positions=np.array([place]), velocities=velocity[None])
        return weighted_momenta(frame, scene)[k]

    # What the obstacle takes up at the contact, M loses.
    assert weighted(touching) == pytest.approx(2.0 * velocity @ normal, rel=1e-14)
    if axes is not None:
        # In free flight the stress is m v v, here with the same weight everywhere.
        gain = weighted(np.full(d, 3.3) + 0.5 * velocity) - weighted(np.full(d, 3.3))
        assert gain == pytest.approx(0.5 * 2.0 * np.sum(velocity[list(axes)] ** 2) / free, rel=1e-13)


@pytest.mark.parametrize("d", [2, 3])
def test_the_field_around_a_ball_has_a_constant_divergence(d):
    """Then sound, which changes the density alone, is seen in the mean only: r^(d-1) u is linear in r^d."""
    ball, r = Ball((4.0,) * d, 1.0), np.linspace(1.5, 4.0, 6)  # from contact to half of the edge
    scene = carom.Scene([[1.0] * d], 8.0, obstacles=(ball,))
    field = []
    for distance in r:
        place, velocity = np.full((1, d), 4.0), np.zeros((1, d))
        place[0, 0], velocity[0, 0] = 4.0 + distance, -1.0
        frame = Frame(0.0, 0, place, velocity, scene.box, scene.diameters, scene.masses)
        field.append(weighted_momenta(frame, scene)[0])
    flux = np.array(field) * r ** (d - 1)
    expected = 1.5 ** (d - 1) * (4.0**d - r**d) / (4.0**d - 1.5**d)
    np.testing.assert_allclose(flux, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_the_force_of_one_component_has_no_noise():
    scene = carom.Scene([[3.7, 3.7]], 8.0, mass=2.0, velocities=[[0.7, 0.45]], walls="y")
    found = carom.Simulation(scene, seed=0).measure(WallPressure("y_high"), time=300.0)
    # Sums of a hundred contacts and of positions within the box, each within a few roundings.
    assert found.force.mean == pytest.approx(2.0 * 0.45**2 / 7.0, rel=1e-12)
    assert found.force.error < 1e-12 * found.force.mean


def pulls_of_walls(d, n, eta, periodic, seeds, which=0, per_particle=128, obstacles=()):
    """Return (measured - mean of all) / error of runs that differ in their seed."""
    found = []
    for seed in range(seeds):
        scene = carom.Scene.random(
            n, dimension=d, packing_fraction=eta, walls=axes_without(periodic), seed=seed, obstacles=obstacles
        )
        sim = carom.Simulation(scene, seed=seed)
        sim.run(collisions_per_particle=30)
        with warnings.catch_warnings():
            # One of a thousand sound runs is called drifting, and there are many here.
            warnings.simplefilter("ignore", CaromWarning)
            found.append(sim.measure(WallPressure(which, 1.0), collisions_per_particle=per_particle).force)
    means = np.array([force.mean for force in found])
    # The mean of all leaves seeds - 1 degrees of freedom.
    return (means - means.mean()) / [force.error for force in found] * math.sqrt(seeds / (seeds - 1))


def assert_of_unit_variance(pulls):
    """Bounds that chi squared leaves in two of a thousand cases, and 10 % for what errors are known to."""
    low, high = np.sqrt(chi2.ppf([1e-3, 1 - 1e-3], len(pulls) - 1) / (len(pulls) - 1))
    assert 0.9 * low < math.sqrt(np.mean(pulls**2)) < 1.1 * high


def test_error_bars_of_walls_cover_although_sound_carries_blocks():
    # Of the momentum taken up alone they would be 4 times too wide: pulls of 0.25.
    assert_of_unit_variance(pulls_of_walls(2, 40, 0.3, (True, False), 16))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("d", "n", "eta", "periodic", "which", "obstacles"),
    [
        (2, 200, 0.1, (False, False), 0, ()),
        (2, 200, 0.4, (True, False), 1, ()),
        (3, 200, 0.1, (True, True, False), 0, ()),
        (3, 200, 0.3, (False, False, False), 3, ()),  # at 0.4 walls on all sides leave a fluid near freezing
        (2, 200, 0.3, (True, True), "ball", (Ball((6.0, 6.0), 2.0),)),
        (2, 200, 0.2, (True, False), "roof", (Plane((0.0, -1.0), -20.0, "roof"),)),
    ],
)
def test_error_bars_cover_at_any_density(d, n, eta, periodic, which, obstacles):
    assert_of_unit_variance(pulls_of_walls(d, n, eta, periodic, 60, which, 256, obstacles))


def test_a_run_measures_walls_as_measure_does(tmp_path):
    plan = SceneFile(
        scene=SceneSpec(n=40, dimension=2, packing_fraction=0.3, walls="y"),
        run=RunSpec(collisions_per_particle=100, equilibration=30, frames=1, write=(), pictures=False),
    )
    lower, upper = runs.run(plan, tmp_path / "run").summary["obstacles"]
    # Of equal disks the balance is the same for both walls, to rounding; what they took up is not.
    assert lower["force"]["mean"] == pytest.approx(upper["force"]["mean"], rel=1e-12)
    # 2000 collisions of independent stress: 1 / sqrt(2000) times a factor of the order of one.
    assert 0.01 < lower["force"]["error"] / lower["force"]["mean"] < 0.05
