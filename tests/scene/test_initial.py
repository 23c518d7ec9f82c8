"""Lattices, random placement and Maxwell velocities."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.spatial import cKDTree

from carom import densities, seeds
from carom.errors import InputError
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import Geometry
from carom.models import Plane
from carom.scene import lattices, placement
from carom.scene.scene import Scene
from carom.scene.velocities import velocities_of
from carom.simulation.system_of_scene import prepare

EPS = np.finfo(float).eps

#: A packing fraction is a product of some ten factors, each rounded, one a d-th root taken to the power d.
TEN_ROUNDINGS = 10 * EPS

#: Chance of a false alarm of the statistical tests; seeds are fixed, so they either always pass or never.
UNLIKELY = 1e-4

SQUARE, FCC, HEXAGONAL = math.pi / 4, math.pi / math.sqrt(18), math.pi / math.sqrt(12)

#: Arguments of a crystal, its particles, the neighbors of each, and its closest packing.
LATTICES = {
    "cubic 1": ({"cells": 7, "lattice": "cubic", "dimension": 1}, 7, 2, 1.0),
    "cubic 2": ({"cells": (4, 6), "lattice": "cubic", "dimension": 2}, 24, 4, SQUARE),
    "cubic 3": ({"cells": 5, "lattice": "cubic"}, 125, 6, math.pi / 6),
    "cubic 4": ({"cells": 4, "lattice": "cubic", "dimension": 4}, 256, 8, math.pi**2 / 32),
    "triangular": ({"cells": (5, 3), "dimension": 2}, 30, 6, HEXAGONAL),
    "fcc": ({"cells": 4}, 256, 12, FCC),
    "fcc oblong": ({"cells": (3, 4, 5)}, 240, 12, FCC),
    "d4": ({"cells": 3, "lattice": "dn", "dimension": 4}, 648, 24, math.pi**2 / 16),
    "d5": ({"cells": 2, "lattice": "dn", "dimension": 5}, 512, 40, math.pi**2 / (15 * math.sqrt(2))),
    "d6": ({"cells": 2, "lattice": "dn", "dimension": 6}, 2048, 60, math.pi**3 / 96),
    "dense 1": ({"cells": 5, "dimension": 1}, 5, 2, 1.0),
    "dense 2": ({"cells": 5, "dimension": 2}, 30, 6, HEXAGONAL),
    "dense 4": ({"cells": 3, "dimension": 4}, 648, 24, math.pi**2 / 16),
}


def drawn(n, dimension, masses=1.0, kT=1.0, seed=0, **others):
    """Return Maxwell velocities of n disks in a row."""
    places = np.full((n, dimension), 1.0)
    places[:, 0] += 1.5 * np.arange(n)
    box = (1.5 * n + 1.0, *[2.0] * (dimension - 1))
    return velocities_of(Scene(places, box, mass=masses, **others), kT, seed)


@pytest.mark.parametrize("name", LATTICES)
def test_every_lattice_has_its_number_neighbors_and_packing_fraction(name):
    """Kissing numbers and closest packings: Conway and Sloane, Sphere Packings, Lattices and Groups."""
    given, n, neighbors, limit = LATTICES[name]
    fraction, dimension = 0.6 * limit, given.get("dimension", 3)
    scene = Scene.crystal(packing_fraction=fraction, **given)
    assert (scene.n, scene.dimension) == (n, dimension)
    assert scene.packing_fraction == pytest.approx(fraction, rel=TEN_ROUNDINGS)
    # Spheres that touch at the limit are (limit / fraction)^(1/d) diameters apart below it.
    nearest = (limit / fraction) ** (1 / dimension)
    tree = cKDTree(scene.positions, boxsize=scene.box)
    distances, _ = tree.query(scene.positions, k=2)
    np.testing.assert_allclose(distances[:, 1], nearest, rtol=100 * EPS)
    around = tree.query_ball_point(scene.positions, nearest * (1 + 1e-9), return_length=True)
    assert (around == neighbors + 1).all()


@pytest.mark.parametrize("name", LATTICES)
def test_every_lattice_can_be_closest_packed_and_no_closer(name):
    given, n, _, limit = LATTICES[name]
    assert Scene.crystal(packing_fraction=limit, **given).n == n
    with pytest.raises(InputError, match=f"{limit:.6f}"):
        Scene.crystal(packing_fraction=limit * (1 + 1e-9), **given)


@pytest.mark.parametrize(("packing_fraction", "moved"), [(0.45, True), (0.3, True), (0.2, False)])
def test_a_lattice_between_walls_keeps_half_a_diameter_from_them(packing_fraction, moved):
    # The outermost layers of fcc are a fourth of a cell from the faces of the box: 0.42, 0.48 and 0.55.
    scene = Scene.crystal(cells=3, packing_fraction=packing_fraction)
    found = lattices.between_walls(scene.positions, scene.box, (True, True, False), 1.0)
    np.testing.assert_array_equal(found[:, :2], scene.positions[:, :2])
    assert bool((found != scene.positions).any()) is moved
    assert found[:, 2].min() >= 0.5 * (1 - 4 * EPS)
    assert found[:, 2].max() <= scene.box[2] - 0.5 * (1 - 16 * EPS)
    ends = found[:, 2].min(), scene.box[2] - found[:, 2].max()
    if moved:
        np.testing.assert_allclose(ends, 0.5, rtol=16 * EPS)
    else:
        assert min(ends) >= 0.5


@pytest.mark.parametrize("scale", [2.0**-40, 1.0, 2.0**13])
def test_the_diameter_scales_a_lattice_bit_for_bit(scale):
    unit = Scene.crystal(cells=3, packing_fraction=0.5)
    scaled = Scene.crystal(cells=3, packing_fraction=0.5, diameter=scale)
    np.testing.assert_array_equal(scaled.positions / scale, unit.positions)
    np.testing.assert_array_equal(np.array(scaled.box) / scale, unit.box)


def test_a_density_is_the_number_of_spheres_in_a_volume_of_a_diameter_cubed():
    scene = Scene.crystal(cells=3, density=0.9, diameter=0.5)
    assert scene.number_density * 0.5**3 == pytest.approx(0.9, rel=TEN_ROUNDINGS)


def test_one_number_of_triangular_cells_makes_the_box_nearly_square():
    scene = Scene.crystal(cells=30, dimension=2, packing_fraction=0.7)
    assert scene.n == 2 * 30 * 17
    assert scene.box[1] / scene.box[0] == pytest.approx(17 * math.sqrt(3) / 30, rel=TEN_ROUNDINGS)


@pytest.mark.parametrize("dimension", range(1, 9))
def test_the_unit_ball_has_its_known_volume(dimension):
    """V_d = 2 pi / d V_(d-2), from V_0 = 1 and V_1 = 2."""
    volumes = [1.0, 2.0]
    for d in range(2, dimension + 1):
        volumes.append(2 * math.pi / d * volumes[d - 2])
    assert densities.unit_ball_volume(dimension) == pytest.approx(volumes[dimension], rel=TEN_ROUNDINGS)


@pytest.mark.parametrize("dimension", range(1, 7))
@pytest.mark.parametrize("part", [0.2, 0.6, 0.98])
def test_random_spheres_do_not_overlap_up_to_the_limit(dimension, part):
    """Scene checks overlaps itself; here the distances are taken once more, by an independent route."""
    fraction = part * placement.random_limit(dimension)
    scene = Scene.random(300, fraction, dimension, seed=7)
    assert scene.packing_fraction == pytest.approx(fraction, rel=TEN_ROUNDINGS)
    box = np.array(scene.box)
    for k in range(1, scene.n):
        separation = scene.positions[k] - scene.positions[:k]
        separation -= box * np.rint(separation / box)
        assert np.sqrt((separation**2).sum(axis=1)).min() > 1 - 1e-12


@pytest.mark.parametrize("n", [1, 2, 3, 4, 8])
@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_few_random_spheres_fit_small_boxes(n, dimension):
    box = [1.05 * max(n, 2) if dimension == 1 else 1.1 + n ** (1 / dimension)] * dimension
    scene = Scene.random(n, box=box, seed=3)
    assert (scene.n, scene.dimension) == (n, dimension)


def test_random_scenes_repeat_with_their_seed_only():
    first, again, other = (Scene.random(50, dimension=2, seed=s).positions for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    generator = seeds.generator(1, "places")
    np.testing.assert_array_equal(Scene.random(50, dimension=2, seed=generator).positions, first)
    assert (Scene.random(50, dimension=2, seed=generator).positions != first).any()


@pytest.mark.parametrize("placed", ["by Scene.random", "by numpy"])
def test_speeds_do_not_follow_from_places_of_the_same_seed(placed):
    places, speeds = [], []
    for seed in range(40):
        if placed == "by numpy":
            x = np.random.default_rng(seed).random((100, 3))
        else:
            scene = Scene.random(100, dimension=3, packing_fraction=1e-4, seed=seed)
            x = scene.positions / np.array(scene.box)
        places.append(x)
        speeds.append(np.abs(drawn(100, 3, seed=seed)))
    # Normal numbers come from the last digits of the words whose first digits are the uniform ones.
    digits = (8.0 * np.array(places)) % 1.0
    found = float(np.corrcoef(digits.ravel(), np.ravel(speeds))[0, 1])
    assert abs(found) < 5.0 / math.sqrt(digits.size)


def test_each_purpose_has_a_stream_of_its_own():
    streams = [seeds.generator(7, purpose) for purpose in seeds.PURPOSES] + [np.random.default_rng(7)]
    assert len({int(stream.integers(2**62)) for stream in streams}) == len(seeds.PURPOSES) + 1
    floor = Plane((0.0, 1.0), 0.25, "floor", kT=1.0, seed=7)
    gas = Scene([[1.0, 1.0]], 4.0, walls="y", obstacles=(floor,))
    model = prepare(gas, np.ones((1, 2))).obstacle_models[0]
    assert model.seed != 7  # range rules draw from the seed itself, by the same hash


def test_random_scenes_scale_with_the_diameter_bit_for_bit():
    unit, scaled = (Scene.random(100, dimension=3, seed=4, diameter=s) for s in (1.0, 0.125))
    np.testing.assert_array_equal(scaled.positions / 0.125, unit.positions)


def test_random_rods_are_the_equilibrium_gas():
    """Gaps of n rods on a ring of free length F: P(gap > x) = (1 - x / F)^(n - 1), exactly (Tonks 1936)."""
    n, edge, gaps = 8, 10.0, []
    rng = np.random.default_rng(21)
    for sample in range(4000):
        places = placement.random_positions(
            Geometry(np.array([edge]), np.array([True])), Contacts(np.ones(n)), rng
        )[:, 0]
        # One gap a sample, after each rod in turn: those of one sample add up to F and are not independent.
        k = sample % n
        gaps.append(((places[(k + 1) % n] - places[k]) % edge - 1) / (edge - n))
    assert stats.kstest(gaps, stats.beta(1, n - 1).cdf).pvalue > UNLIKELY


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
@pytest.mark.parametrize("n", [2, 3, 100])
@pytest.mark.parametrize("kT", [1.0, 0.37])
def test_maxwell_velocities_have_no_momentum_and_an_exact_temperature(n, dimension, kT):
    masses = 0.5 + np.random.default_rng(0).random(n)
    velocities = drawn(n, dimension, masses, kT, seed=5)
    assert velocities.shape == (n, dimension)
    kinetic = 0.5 * math.fsum((masses[:, None] * velocities**2).ravel())
    assert 2 * kinetic / (dimension * (n - 1)) == pytest.approx(kT, rel=8 * EPS)
    # Each of n terms is rounded to eps / 2 of at most the largest momentum, and so is their sum's every step.
    largest = np.abs(masses[:, None] * velocities).max()
    for k in range(dimension):
        assert abs(math.fsum(masses * velocities[:, k])) <= n * EPS * largest


def test_one_particle_keeps_its_momentum_and_has_d_kT_over_2():
    velocities = drawn(1, 3, 2.0, 0.5, seed=1)
    assert 0.5 * 2.0 * (velocities**2).sum() == pytest.approx(3 * 0.5 / 2, rel=8 * EPS)


def test_no_temperature_is_rest():
    assert not drawn(10, 3, kT=0.0).any()


def test_velocities_are_maxwellian():
    """With n = 20000 the constraints change the distribution by 1 / n, far below what the test resolves."""
    velocities = drawn(20_000, 2, 4.0, 9.0, seed=11)
    assert stats.kstest(velocities.ravel(), stats.norm(scale=1.5).cdf).pvalue > UNLIKELY
    speeds = np.sqrt((velocities**2).sum(axis=1))
    assert stats.kstest(speeds, stats.rayleigh(scale=1.5).cdf).pvalue > UNLIKELY


def test_heavier_components_are_slower_by_the_root_of_the_mass():
    masses = np.repeat([1.0, 100.0], 20_000)
    velocities = drawn(40_000, 3, masses, seed=2)
    light, heavy = velocities[:20_000], velocities[20_000:]
    # The variance of a variance of m normal numbers is 2 / m.
    six_sigma = 6 * math.sqrt(2 * 2 / light.size)
    assert light.var() / heavy.var() == pytest.approx(100.0, rel=six_sigma)


@pytest.mark.parametrize("arguments", [{"kT": -1}, {"kT": math.nan}, {"kT": "1"}, {"seed": "one"}])
def test_a_temperature_or_a_seed_that_is_none_is_refused(arguments):
    with pytest.raises(InputError):
        drawn(3, 3, **arguments)


@pytest.mark.parametrize("pinned", [[True, False, False, False], [0]])
def test_velocities_of_pinned_components_are_zero_however_they_are_named(pinned):
    velocities = drawn(4, 2, kT=2.0, pinned=pinned, seed=1)
    assert not velocities[0].any()
    assert velocities[1:].all()
    assert (velocities**2).sum() == pytest.approx(2.0 * 2 * 3, rel=1e-14)  # kT for each of 6 coordinates


@pytest.mark.parametrize("dimension", range(1, 9))
def test_a_scene_is_filled_to_three_tenths_or_half_of_random_close_packing_if_nothing_is_said(dimension):
    half = 0.5 * placement.RANDOM_CLOSE_PACKING.get(dimension, 0.2 / 2 ** max(dimension - 6, 0))
    expected = 0.3 if dimension < 4 else half
    assert placement.default_fraction(dimension) == pytest.approx(expected, rel=TEN_ROUNDINGS)
    if dimension < 5:
        found = Scene.random(4, dimension=dimension, seed=1).packing_fraction
        assert found == pytest.approx(expected, rel=TEN_ROUNDINGS)
