"""The oracle with walls, obstacles, growth, lost energy and contact matrices, beside what is known."""

import itertools
import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from helpers.naive.oracle import Oracle

from carom.errors import InputError, OverlapError
from carom.models import Ball
from carom.reference.arithmetic import make_arithmetic
from carom.reference.meeting import contact_time

# 50 digits less what a few hundred collisions amplify: each multiplies an error by some ten at most.
FORTY_DIGITS = mpmath.mpf(10) ** -40


def test_a_rod_between_walls_goes_to_and_fro_exactly():
    # Room for the center from 1/2 to 7/2: it reaches the upper wall after 2, then a wall every 3.
    rod = Oracle([["3/2"]], [[1]], [4], periodic=False, arithmetic="fraction")
    hits = list(itertools.islice(rod, 4))
    assert [(c.time, c.i, c.j) for c in hits] == [(2, 0, 2), (5, 0, 1), (8, 0, 2), (11, 0, 1)]
    assert [c.impulse for c in hits] == [2, 2, 2, 2]
    assert rod.hits.tolist() == [2, 2]
    assert rod.impulses.tolist() == [4, 4]


def test_chords_of_a_circle_are_all_as_long():
    # Distance from the center when nearest: 0.6 of a room of 2; chords of 2 * 1.6, at a speed of 1.
    jar = {"type": "sphere", "center": [3, 3], "radius": "5/2"}
    disk = Oracle([[3, "4.2"]], [[1, 0]], [6, 6], periodic=False, obstacles=[jar])
    times = [c.time for c in itertools.islice(disk, 50)]
    assert abs(times[0] * 10 - 16) < FORTY_DIGITS
    assert max(abs(5 * (b - a) - 16) for a, b in itertools.pairwise(times)) < FORTY_DIGITS
    assert all(hit == 0 for hit in disk.hits[:4])
    assert disk.hits[4] == 50


def test_a_cylinder_lets_go_along_its_axis():
    tube = {"type": "cylinder", "axis": 0, "center": [0, 2, 2], "radius": 2}
    ball = Oracle([[0, 2, 2]], [[7, 0, 1]], [4, 4, 4], periodic=[True, False, False], obstacles=[tube])
    hits = list(itertools.islice(ball, 3))
    # The cylinder touches the walls of its box: at the same instant the wall, which comes first, is met.
    assert [c.time for c in hits] == [mpmath.mpf("1.5"), mpmath.mpf("4.5"), mpmath.mpf("7.5")]
    assert ball.velocities[0].tolist() == [7, 0, -1]


def test_a_tilted_plane_reflects():
    # x + y >= 3 with radius sqrt(1/2): met by the center on x + y = 4, in a fall from (2, 4) at (2, 2).
    slope = {"type": "plane", "normal": [1, 1], "offset": 3}
    exact = make_arithmetic("mpmath")
    size = exact.sqrt(exact.number(2))
    disk = Oracle([[2, 4]], [[0, -1]], [10, 10], diameter=size, periodic=False, obstacles=[slope])
    hit = disk.step()
    assert hit.j == 1 + 4
    assert abs(hit.time - 2) < FORTY_DIGITS
    assert abs(disk.velocities[0] - [1, 0]).max() < FORTY_DIGITS


def first_ball(x, v, centers, reach, box, images):
    """Time to the first of all balls in a block of images, in doubles, by trying every one."""
    best = math.inf
    for center in centers:
        for shift in itertools.product(range(-images, images + 1), repeat=len(box)):
            delay = contact_time(center + np.array(shift) * box - x, -v, reach, math.sqrt)
            best = best if delay is None else min(best, delay)
    return best


@pytest.mark.parametrize(("dimension", "radius"), [(1, 0.2), (2, 0.3), (2, 1.3), (3, 0.8), (4, 1.2)])
def test_fixed_balls_are_met_under_all_images(dimension, radius):
    """Balls up to larger than half of the box, against a search over every image that can be reached."""
    rng = np.random.default_rng(dimension)
    box = 2.5 + rng.random(dimension)
    center, found = np.zeros(dimension), 0
    for _ in range(20):
        x, v = rng.random(dimension) * box, rng.normal(size=dimension)
        gap = Ball(tuple(center), radius).gap(x[None], np.array([0.1]), box, [True] * dimension)[0]
        if gap < 0:
            continue
        right = first_ball(x, v, [center], radius + 0.1, box, 4 if dimension < 4 else 3)
        if right * np.abs(v / box).max() > 2:
            continue  # beyond what the search has looked through
        found += 1
        ball = {"type": "ball", "center": center, "radius": radius}
        table = Oracle([x], [v], box, diameter=0.2, obstacles=[ball], arithmetic="float")
        hit = table.step()
        assert hit.j == 1
        assert hit.time == pytest.approx(right, rel=1e-9)
        away = table.positions[0] - (np.array(hit.image) * box + center)
        assert np.linalg.norm(away) == pytest.approx(radius + 0.1, rel=1e-9)
        assert away @ table.velocities[0] > 0
    assert found >= 3


def test_spheres_at_rest_grow_into_each_other_and_part():
    # A gap of 2 closes at (1 + 1/3) / 2; then they part at twice that.
    pair = Oracle([[1], [4]], [[0], [0]], [10], growth=[1, "1/3"], arithmetic="fraction")
    hit = pair.step()
    assert (hit.time, hit.i, hit.j, hit.image) == (3, 0, 1, (0,))
    assert pair.velocities.tolist() == [[Fraction(-2, 3)], [Fraction(2, 3)]]
    assert pair.diameters.tolist() == [4, 2]


def test_a_growing_sphere_is_thrown_back_from_a_wall():
    rod = Oracle([[5]], [[-1]], [10], growth=1, periodic=False, arithmetic="fraction")
    hit = rod.step()  # its radius grows by 1/2: a gap of 4.5 closes at 1.5
    assert (hit.time, hit.j) == (3, 1)
    assert rod.velocities.tolist() == [[2]]  # 2 (1/2) - (-1)
    assert hit.impulse == 3


def test_a_sphere_that_grows_into_its_own_image_is_reported():
    rod = Oracle([[5]], [[-1]], [10], growth=1, arithmetic="fraction")
    assert rod.advance_to(9) == []
    with pytest.raises(OverlapError, match="overlaps its own image"):
        rod.advance_to(10)


def test_parting_spheres_that_grow_faster_are_caught_up_with():
    zero, sqrt = np.array([Fraction(1)]), make_arithmetic("fraction").sqrt
    # In contact at 1, parting at 1, growing at 2: never apart. Parting at 3: never together.
    assert contact_time(zero, np.array([Fraction(3)]), Fraction(1), sqrt, Fraction(2)) is None
    assert contact_time(zero, np.array([Fraction(1)]), Fraction(1), sqrt, Fraction(2)) == 0
    # Touching, moving sideways at 1 and growing at 1/2: they would overlap at once.
    sideways = np.array([Fraction(0), Fraction(1)]), Fraction(1)
    r = np.array([Fraction(1), Fraction(0)])
    assert contact_time(r, *sideways, sqrt, Fraction(1, 2)) == 0
    number = make_arithmetic("mpmath").number
    apart = contact_time(np.array([number(2)]), np.array([number(1)]), number(1), mpmath.sqrt, number(3))
    assert apart * 2 == 1  # 2 + t = 1 + 3 t


@pytest.mark.parametrize("restitution", ["1/2", "9/10"])
def test_a_collision_leaves_part_of_the_normal_velocity(restitution):
    e = Fraction(restitution)
    pair = Oracle([[1], [4]], [[1], [0]], [10], masses=[1, 2], restitution=restitution, arithmetic="fraction")
    assert pair.step().impulse == (1 + e) * Fraction(2, 3)
    a, b = pair.velocities[:, 0]
    assert (b - a, a + 2 * b) == (e, 1)


def test_slow_contacts_are_elastic():
    for threshold, kept in ((1, Fraction(1, 2)), ("1001/1000", 1)):
        pair = Oracle(
            [[1], [4]], [[1], [0]], [10], restitution="1/2", elastic_below=threshold, arithmetic="fraction"
        )
        pair.step()
        assert pair.velocities[1, 0] - pair.velocities[0, 0] == kept


def test_restitution_and_growth_act_on_the_surfaces():
    pair = Oracle([[1], [4]], [[1], [0]], [10], growth=1, restitution="1/2", arithmetic="fraction")
    pair.step()
    # Surfaces approach at 1 + 1 and part at half of that, the centers at 1 more.
    assert pair.velocities[1, 0] - pair.velocities[0, 0] == 2


def test_species_touch_where_their_matrix_says():
    table = [[1, "3/2"], ["3/2", 2]]
    line = Oracle([[1], [6], [12]], [[1], [0], [0]], [30], diameter=[1, 1, 2], species=[0, 0, 1],
                  contact=table, arithmetic="fraction")  # fmt: skip
    assert [(c.time, c.i, c.j) for c in itertools.islice(line, 2)] == [(4, 0, 1), (4 + Fraction(9, 2), 1, 2)]


@pytest.mark.parametrize(
    ("settings", "error", "says"),
    [
        ({"growth": -1}, InputError, "at least zero"),
        ({"growth": 1, "species": [0, 0], "contact": [[1]]}, InputError, "no contact matrix"),
        ({"contact": [[1]]}, InputError, "belong together"),
        ({"obstacles": [{"type": "ring", "center": [0, 0], "radius": 1}]}, InputError, "is a 'ring'"),
        ({"obstacles": [{"type": "ball", "center": [0, 0]}]}, InputError, "lacks 'radius'"),
        ({"obstacles": [{"type": "ball", "center": [0], "radius": 1}]}, InputError, "1 coordinates"),
        ({"obstacles": [{"type": "ball", "center": [1, 1], "radius": 1}]}, OverlapError, "obstacle 0"),
        ({"periodic": False, "diameter": 3}, OverlapError, "wall or obstacle 0"),
    ],
)
def test_what_does_not_fit_is_refused(settings, error, says):
    with pytest.raises(error, match=says):
        Oracle([[1, 1], [5, 5]], [[0, 1], [0, 0]], [8, 8], **settings)
