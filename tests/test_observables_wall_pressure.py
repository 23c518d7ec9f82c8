"""The pressure on walls and obstacles from tallies, and the degrees of freedom that go with them."""

import math

import numpy as np
import pytest

import carom
from carom.block import Block
from carom.errors import CaromWarning, InputError
from carom.models.obstacles import Ball, CylindricalContainer, Plane, SphericalContainer
from carom.observables import WallPressure
from carom.scene.velocities import maxwell_velocities
from carom.simulation import preparation as contents


def blocks(impulses, count=64, duration=2.0):
    """Return blocks of independent impulses around those given, and the seeded numbers themselves."""
    rng = np.random.default_rng(1)
    values = np.array(impulses) * rng.uniform(0.5, 1.5, (count, len(impulses)))
    return [Block(duration, 0, 0.0, tuple(row)) for row in values.tolist()], values


def estimate(request, scene, series):
    return request.of_scene(series, scene, kT=1.0)


def test_force_by_area_of_every_kind_of_obstacle():
    obstacles = (
        Plane((0.0, 1.0, 0.0), 0.5, "floor"),
        Ball((5.0, 3.0, 5.0), 0.5),
        CylindricalContainer(2, (5.0, 5.0, 0.0), 4.9),
    )
    scene = carom.Scene(
        [[5.0, 5.0, 1.0]], (10.0, 10.0, 8.0), periodic=[False, False, True], obstacles=obstacles
    )
    series, values = blocks([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
    forces = values.mean(axis=0) / 2.0
    areas = [80.0, 80.0, 80.0, 80.0, 7.0, math.pi, 2 * math.pi * 4.9 * 8.0]
    names = ["lower wall of axis 0", "upper wall of axis 0", "lower wall of axis 1", "upper wall of axis 1"]
    for k, name in enumerate([*names, "floor", "ball", "cylinder"]):
        area = 7.0 if name == "floor" else None
        for which in (k, name):
            found = estimate(WallPressure(which, area), scene, series)
            assert found.pressure.mean == pytest.approx(forces[k] / areas[k], rel=1e-12)
            assert found.force.mean == pytest.approx(forces[k], rel=1e-12)
            assert found.primary == found.pressure
            assert found.name == name
            # 64 independent blocks: their error is known to 1 / sqrt(126), 9 %.
            assert found.force.error == pytest.approx(values[:, k].std() / 16.0, rel=6 * 0.09)
            assert str(found).startswith(f"P on {name} = ")


@pytest.mark.parametrize(("d", "area"), [(1, 2.0), (2, 4 * math.pi), (3, 16 * math.pi), (4, 16 * math.pi**2)])
def test_surface_of_a_spherical_container(d, area):
    scene = carom.Scene([[2.5] * d], 5.0, periodic=False, obstacles=(SphericalContainer((2.5,) * d, 2.0),))
    found = estimate(WallPressure("sphere"), scene, blocks([1.0] * (2 * d + 1))[0])
    assert found.area == pytest.approx(area, rel=1e-14)
    assert estimate(WallPressure(0), scene, blocks([1.0] * (2 * d + 1))[0]).area == 5.0 ** (d - 1)


def test_areas_of_walls_belong_to_their_axes():
    """The first axis is periodic, so that the second one has the first walls; no two faces are alike."""
    scene = carom.Scene([[1.0, 2.0, 3.0]], (3.0, 5.0, 7.0), periodic=[True, False, False])
    series, values = blocks([1.0, 2.0, 3.0, 4.0])
    forces = values.mean(axis=0) / 2.0
    for k, (name, area) in enumerate(
        [
            ("lower wall of axis 1", 3.0 * 7.0),
            ("upper wall of axis 1", 3.0 * 7.0),
            ("lower wall of axis 2", 3.0 * 5.0),
            ("upper wall of axis 2", 3.0 * 5.0),
        ]
    ):
        for which in (k, name):
            found = estimate(WallPressure(which), scene, series)
            assert (found.name, found.area) == (name, area)
            assert found.pressure.mean == pytest.approx(forces[k] / area, rel=1e-12)
    tube = carom.Scene(
        [[2.0, 2.0, 2.0]], (4.0, 7.0, 4.0), periodic=[False, True, False],
        obstacles=(CylindricalContainer(1, (2.0, 0.0, 2.0), 1.8),),
    )  # fmt: skip
    area = 2 * math.pi * 1.8 * 7.0
    assert estimate(WallPressure("cylinder"), tube, blocks([1.0] * 5)[0]).area == pytest.approx(area)


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        (WallPressure(5), "obstacle"),
        (WallPressure("roof"), "'roof'"),
        (WallPressure("ball"), "found 2"),
        (WallPressure("plane"), "area="),
    ],
)
def test_what_cannot_be_told_apart_or_has_no_area(request_, message):
    obstacles = (Ball((1.0, 1.0), 0.2), Ball((3.0, 3.0), 0.2), Plane((0.0, 1.0), 0.1))
    scene = carom.Scene([[2.0, 2.0]], (9.0, 9.0), periodic=[True, False], obstacles=obstacles)
    with pytest.raises(InputError, match=message):
        estimate(request_, scene, blocks([1.0] * 5)[0])


def test_neither_walls_nor_blocks():
    with pytest.raises(InputError, match="neither walls nor obstacles"):
        estimate(WallPressure(), carom.Scene([[2.0]], 9.0), blocks([])[0])
    with pytest.raises(InputError, match="positive duration"):
        estimate(WallPressure(), carom.Scene([[2.0]], 9.0, periodic=False), [Block(0.0, 0, 0.0, (0.0, 0.0))])
    for wrong in ({"area": 0.0}, {"area": "1"}, {"blocks": 1}):
        with pytest.raises(InputError):
            WallPressure(0, **wrong)


def test_a_wall_that_nobody_met_has_no_error_bar():
    scene = carom.Scene([[2.0]], 9.0, periodic=False)
    found = estimate(WallPressure(), scene, [Block(1.0, 0, 0.0, (0.0, 0.0))] * 8)
    assert found.pressure.mean == 0.0
    assert found.pressure.error == math.inf


def test_few_blocks_warn():
    scene = carom.Scene([[2.0]], 9.0, periodic=False)
    with pytest.warns(CaromWarning):
        estimate(WallPressure(), scene, blocks([1.0, 1.0], count=1)[0])


GLIDING = [
    # d, periodic axes, obstacles, axes along which momentum is conserved
    (3, (True, True, True), (), 3),
    (3, (True, True, False), (), 2),
    (3, (False, False, False), (), 0),
    (2, (True, True), (Ball((1.0, 1.0), 0.2),), 0),
    (3, (True, False, False), (Plane((0.0, 1.0, 1.0), 0.1),), 1),
    (3, (False, True, False), (CylindricalContainer(1, (4.0, 4.0, 4.0), 3.9),), 1),
]


@pytest.mark.parametrize(("d", "periodic", "obstacles", "conserved"), GLIDING)
def test_degrees_of_freedom_and_the_temperature_drawn(d, periodic, obstacles, conserved):
    masses = [1.0, 2.0, 5.0]
    places = np.array([[2.0] * d, [4.0] * d, [5.5] * d])
    scene = carom.Scene(places, 8.0, mass=masses, periodic=periodic, obstacles=obstacles)
    still = contents.conserved(scene)
    assert sum(still) == conserved
    velocities = maxwell_velocities(3, d, np.array(masses), 0.7, 1, still)
    momentum = np.array(masses) @ velocities
    assert ((np.abs(momentum) < 1e-14) == still).all()
    twice = np.array(masses) @ (velocities**2).sum(axis=1)
    assert twice == pytest.approx(0.7 * (3 * d - conserved), rel=1e-14)


def test_velocities_of_a_periodic_box_are_those_of_before():
    np.testing.assert_array_equal(
        maxwell_velocities(9, 2, 1.5, 0.3, 7),
        maxwell_velocities(9, 2, 1.5, 0.3, 7, (True, True)),
    )
