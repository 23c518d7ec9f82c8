"""The order of collisions against the naive algorithm with 50 digits, the paper's correct trajectory."""

from itertools import islice, product

import numpy as np
import pytest
from helpers.marks import slow
from helpers.oracle import assert_equal_to_oracle, engine_collisions, moving, oracle_of

import carom

PER_PARTICLE = 10
MOST = 80
"""Collisions that are compared of one scene: lists are renewed by then, and partners lost to third ones."""


def packed(n, dimension, packing_fraction, seed):
    return moving(carom.Scene.random(n, packing_fraction, dimension, seed=seed), seed + 100)


def follow(case, folder, **tuning):
    dimension, n, packing_fraction = case
    scene = packed(n, dimension, packing_fraction, seed=n)
    assert_equal_to_oracle(scene, min(PER_PARTICLE * n // 2, MOST), folder, tuning=carom.Tuning(**tuning))


# Dimension, n, packing fraction: as dilute as double precision can follow for 10 collisions a particle (a
# longer flight amplifies rounding more), fluid, nearly all that random placement can do.
FEW = [
    *((1, n, eta) for n in (2, 17) for eta in (0.05, 0.5, 0.9)),
    *((2, n, eta) for n in (2, 9) for eta in (0.15, 0.3)),
    (2, 9, 0.6),
    *((3, n, eta) for n in (2, 8) for eta in (0.05, 0.3) if (n, eta) != (2, 0.3)),
    (4, 2, 0.08),
]
MANY = [(1, 64, 0.1), (2, 32, 0.2), (2, 32, 0.65), (3, 32, 0.1), (3, 32, 0.45)]
SLOW = [(4, 2, 0.03), (4, 16, 0.2), (4, 64, 0.05)]


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("case", [*FEW, *MANY, *map(slow, SLOW)], ids=str)
def test_collisions_come_in_the_oracle_s_order(case, tmp_path):
    follow(case, tmp_path, neighbors="sectors")


@pytest.mark.parametrize("shell", [None, 1.2])
@pytest.mark.parametrize("case", [(1, 12, 0.3), (2, 32, 0.3), (2, 64, 0.65), (3, 64, 0.45)], ids=str)
def test_lists_give_the_oracle_s_order(plain, case, shell, tmp_path):
    follow(case, tmp_path, neighbors="lists", shell=shell)


@pytest.mark.slow
@pytest.mark.parametrize("neighbors", ["sectors", "lists"])
@pytest.mark.parametrize("case", [(1, 64, 0.7), (2, 64, 0.6), (3, 64, 0.45), (4, 64, 0.05)], ids=str)
def test_compiled_collisions_come_in_the_oracle_s_order(case, neighbors, tmp_path):
    """Of one scene a dimension and scheme: the others see the same functions as plain Python."""
    follow(case, tmp_path, neighbors=neighbors)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("edge", "other", "dimension"),
    [
        slow(edge, other, d) if (d == 4 and other > edge) or (d > 2 and other > 7.0 - d) else (edge, other, d)
        for edge, other, d in product([1.05, 1.5, 2.05, 3.05, 3.9, 4.1], [1.05, 2.3, 7.0], [2, 3, 4])
        if edge**2 + (d - 1) * other**2 > 4.0  # half a diagonal has room for two spheres
    ],
)
def test_two_spheres_in_small_boxes(dimension, edge, other, tmp_path):
    # The other edges: 1, 2, 3 or more sectors. Centers half a box apart along the longest edge never overlap,
    # or along all edges where the box is small.
    box = np.array([edge] + [other] * (dimension - 1))
    scene = moving(carom.Scene([0.1 * box, 0.6 * box], tuple(box)), seed=int(100 * edge + other))
    # Up to a hundred diameters of flight between two collisions: rounding grows as much at each.
    assert_equal_to_oracle(scene, 8, tmp_path, at_least=4, tuning=carom.Tuning(neighbors="sectors"))


@pytest.mark.parametrize(
    ("n", "box"),
    [
        (3, (1.05, 4.0)),
        (4, (1.05, 1.05, 6.0)),
        (6, (2.1, 4.2)),
        (5, (2.2, 1.1, 5.0)),
        (10, (2.5, 2.5, 3.7)),
        (2, (1.05, 2.05, 3.05, 2.0)),
        (5, (7.3,)),
        (2, (2.0000001,)),
    ],
)
def test_few_spheres_in_small_boxes_with_different_edges(plain, n, box, tmp_path):
    scene = moving(carom.Scene.random(n, box=box, seed=4), seed=5)
    assert_equal_to_oracle(scene, PER_PARTICLE * n // 2 + 2, tmp_path, at_least=n)


@pytest.mark.slow
@pytest.mark.parametrize(("dimension", "n"), [(5, 8), (6, 4)])
def test_five_and_six_dimensions(dimension, n, tmp_path):
    scene = packed(n, dimension, 0.02, seed=1)
    assert_equal_to_oracle(scene, 3 * n // 2, tmp_path)


def test_two_spheres_collide_under_two_images_at_one_time(plain, tmp_path):
    # 5 = |(3, 4)|: sphere 1 is met above and below at once, and the first impulse drives it into the other.
    velocities = [[1.0, 0.0], [-1.0, 0.0]]
    scene = carom.Scene([[1.0, 1.0], [12.0, 5.0]], (32.0, 8.0), diameter=5.0, velocities=velocities)
    sim, _, times = engine_collisions(scene, 6, tmp_path)
    right = [float(c.time) for c in islice(oracle_of(scene), 6)]
    assert times[0] == times[1] == 4.0
    np.testing.assert_allclose(times, right, rtol=1e-9)  # 4 free flights of up to 5 diameters
    assert sim.statistics.worst_overlap < 1e-14
