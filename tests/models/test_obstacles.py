"""Obstacles as values: gaps, what they refuse, and what a scene refuses because of them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from helpers.plain import plain_python

from carom.engine.obstacles import make_obstacles, numbers_of
from carom.errors import InputError, OverlapError
from carom.models.files.tables import from_table
from carom.models.obstacles import Arc, Ball, CylindricalContainer, Obstacle, Plane, SphericalContainer, walls
from carom.scene.scene import Scene
from carom.scene.storage import from_arrays, to_arrays

EPS = np.finfo(float).eps
OPEN = (False, False, False)
BOX = (4.0, 5.0, 6.0)


def gap(obstacle: Obstacle, center: tuple, radius: float = 0.5, periodic: tuple = OPEN) -> float:
    return float(obstacle.gap(np.array([center]), np.array([radius]), BOX, periodic)[0])


def test_a_plane_is_as_far_as_its_normal_says_whatever_its_length():
    near = math.sqrt(0.5) * 3.0 - 0.5
    assert gap(Plane((1, 0, 1), 0.0), (2, 9, 1)) == pytest.approx(near, rel=4 * EPS)
    assert gap(Plane((5, 0, 5), 0.0), (2, 9, 1)) == pytest.approx(near, rel=4 * EPS)
    assert gap(Plane((0, -2, 0), -4.0), (0, 1.75, 0)) == -0.25


def test_a_ball_is_met_under_its_nearest_image():
    ball = Ball((0.5, 1.0, 1.0), 0.75)
    assert gap(ball, (3.5, 1, 1)) == 1.75
    assert gap(ball, (3.5, 1, 1), periodic=(True, False, False)) == -0.25
    assert gap(ball, (3.5, 6.0, 7.0), periodic=(True, True, True)) == -0.25


def test_containers_are_met_from_inside():
    assert gap(SphericalContainer((2, 2, 2), 3.0), (2, 4, 2)) == 0.5
    assert gap(CylindricalContainer(2, (2, 2, 0), 3.0), (2, 4, 99)) == 0.5


def test_the_number_of_an_obstacle_leads_to_it_among_those_of_its_kind():
    """Three kinds of one or two each: the second arc is asked third, and has the number of its place then."""
    given = (
        Arc((1.0, 1.0), 0.5), Plane((0.0, 1.0), 0.0), Ball((3.0, 3.0), 0.5), Arc((1.0, 3.0), 0.5, 0.0, 90.0),
        Ball((3.0, 1.0), 0.25), Plane((0.0, -1.0), -4.0),
    )  # fmt: skip
    models = [each.model() for each in given]
    chain, found = make_obstacles(2, None, models).chain, {}
    while hasattr(chain, "head"):
        found |= dict(enumerate(chain.head, chain.number))
        chain = chain.tail
    assert [found[number] for number in numbers_of((True, True), models)] == models
    assert numbers_of((True, False), models)[:2] == [2, 3]


def test_walls_come_axis_after_axis_lower_first():
    names = [wall.name for wall in walls(BOX, (False, True, False))]
    assert names == ["x_low", "x_high", "z_low", "z_high"]
    assert [gap(wall, (1.0, 0.0, 5.0)) for wall in walls(BOX, (False, True, False))] == [0.5, 2.5, 4.5, 0.5]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Plane((0, 0, 0), 1.0), "must not be zero"),
        (lambda: Plane("x", 1.0), "list of numbers"),
        (lambda: Plane((1, "y"), 1.0), "number"),
        (lambda: Plane((), 1.0), "found none"),
        (lambda: Plane((1, 0), math.nan), "finite"),
        (lambda: Plane((1, 0), 0.0, name=""), "name"),
        (lambda: Plane((1, 0), 0.0, name=81 * "n"), "1 to 80 printable characters"),
        (lambda: Plane((1, 0), 0.0, name="a\nb"), "1 to 80 printable characters"),
        (lambda: Ball((0, 0), 0.0), "radius of a ball must be positive"),
        (lambda: Ball((0, math.inf), 1.0), "center of a ball must be finite"),
        (lambda: SphericalContainer(3.0, 1.0), "list of numbers"),
        (lambda: SphericalContainer((0, 0), -1.0), "positive"),
        (lambda: CylindricalContainer(3, (0, 0, 0), 1.0), "between 0 and 2"),
        (lambda: CylindricalContainer(0, (0,), 1.0), "two dimensions"),
        (lambda: Plane((1, 0), 0.0).check(BOX, OPEN), "3 coordinates, found 2"),
        (lambda: Plane((1, 0, 0), 0.0).check(BOX, (True, False, False)), "along x, which is periodic"),
        (lambda: Ball((0, 0), 1.0).check(BOX, OPEN), "center of ball must have 3"),
        (lambda: SphericalContainer((0, 0, 0), 1.0, "jar").check(BOX, (False, True, False)), "Around jar"),
        (lambda: CylindricalContainer(0, (0, 0, 0), 1.0).check(BOX, (True, True, False)), "found y. Give"),
    ],
)
def test_an_obstacle_that_cannot_be_is_named_in_one_sentence(make, says):
    with pytest.raises(InputError, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("length", [1, 80])
def test_a_name_may_have_one_character_or_eighty(length):
    assert Ball((0.0, 0.0), 1.0, length * "n").name == length * "n"


@pytest.mark.parametrize(
    ("center", "obstacle", "says"),
    [
        ((0.4, 3, 3), None, "sphere 1 is inside an obstacle, x_low, by 0.1"),
        ((3, 4.75, 3), None, "y_high, by 0.25"),
        ((3, 3, 3), Ball((3, 4, 3), 0.75, "pillar"), "pillar, by 0.25"),
        ((3, 3, 3), Plane((0, 0, -1), -3.25), "plane, by 0.25"),
        ((2, 4, 3), SphericalContainer((2, 2.5, 3), 1.75), "sphere, by 0.25"),
        ((2, 4, 3), CylindricalContainer(0, (2, 2.5, 3), 1.75), "cylinder, by 0.25"),
    ],
)
def test_a_component_that_starts_inside_an_obstacle_is_refused_by_name(center, obstacle, says):
    standing = () if obstacle is None else (obstacle,)
    with pytest.raises(OverlapError, match=says) as caught:
        Scene([[2, 2, 3], center], BOX, walls=True, obstacles=standing)
    assert "\n" not in str(caught.value)


def test_touching_a_wall_or_an_obstacle_is_legal():
    touching = [Ball((2.0, 2.0, 2.0), 0.5), Plane((1, 1, 0), 1.0 - math.sqrt(0.5))]
    Scene([[0.5, 0.5, 0.5], [3.5, 4.5, 5.5], [3.0, 2.0, 2.0]], BOX, walls=True, obstacles=touching)


def test_one_component_may_just_fit_between_two_walls():
    assert Scene([[0.505, 1.0]], (1.01, 3.0), walls=True).n == 1
    with pytest.raises(InputError, match="both walls"):
        Scene([[0.5, 1.0]], (1.0, 3.0), walls=True)


@pytest.mark.parametrize(
    ("box", "walls", "obstacle"),
    [
        ((9.0, 9.0), False, Ball((0.0, 4.0), 2.0)),
        ((9.0, 9.0), True, Plane((1.0, -1.0), -2.0)),
        ((9.0, 9.0, 9.0), True, SphericalContainer((4.5, 4.5, 4.5), 4.0)),
        ((12.0, 8.0, 8.0), "yz", CylindricalContainer(0, (0.0, 4.0, 4.0), 3.5)),
        ((4.5, 4.5, 4.5, 4.5), False, Ball((0.0, 4.0, 1.0, 1.0), 1.0)),
    ],
)
def test_spheres_are_placed_outside_of_obstacles(box, walls, obstacle):
    scene = Scene.random(40, dimension=len(box), box=box, walls=walls, obstacles=[obstacle], seed=4)
    gaps = obstacle.gap(scene.positions, 0.5 * scene.diameters, scene.box, scene.periodic)
    assert gaps.min() >= 0
    assert gaps.min() < 1


def test_a_container_without_room_is_refused():
    with pytest.raises(InputError, match="No random placement"):
        Scene.random(
            40, dimension=2, box=20.0, walls=True, obstacles=[SphericalContainer((9, 9), 2.0)], seed=0
        )


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"type": "ball", "center": [0, 0]}, "needs radius"),
        ({"type": "ball", "center": [0, 0], "radius": 1, "color": 3}, "has no 'color'"),
        ({"kind": "ring"}, "must be one of plane, ball, sphere, cylinder"),
        ({}, "found nothing"),
        (3, "must be a table"),
    ],
)
def test_json_that_is_no_obstacle_is_refused(values, says):
    with pytest.raises(InputError, match=says):
        from_table(values, "obstacle")


@dataclass(frozen=True)
class Ceiling:
    """An obstacle of one's own, as good as those of the package."""

    height: float
    name: str = "ceiling"

    def gap(self, positions, radii, box, periodic):
        return self.height - positions[:, -1] - radii

    def check(self, box, periodic):
        if periodic[-1]:
            raise InputError("A ceiling needs a last axis that is not periodic.")

    def model(self):
        return None


def test_an_obstacle_of_ones_own_is_checked_and_kept():
    scene = Scene([[1.0, 1.0]], 4.0, walls="y", obstacles=[Ceiling(2.0)])
    assert scene.obstacles[0].height == 2.0
    with pytest.raises(OverlapError, match=r"ceiling, by 0\.5"):
        scene.replace(positions=[[1.0, 2.0]])
    with pytest.raises(InputError, match="last axis"):
        scene.replace(walls=False)
    arrays, attributes = to_arrays(scene)
    with pytest.raises(InputError, match="ceiling is of the class Ceiling, which no file holds"):
        from_arrays(arrays, attributes)
    assert from_arrays(arrays, attributes, obstacles=scene.obstacles).obstacles == (Ceiling(2.0),)


def test_the_first_cell_of_the_page_runs_as_plain_python():
    page = Path(__file__).parents[2].joinpath("docs", "obstacles.md").read_text(encoding="utf-8")
    printed = plain_python("-c", re.search(r"```python\n(.*?)```", page, re.DOTALL)[1])
    assert printed.startswith("P on y_high = ")
    assert printed.count("Impacts(") == 3
