"""Random scenes of many components: pairs listed over sorted cells, pushed apart by compiled sweeps."""

import itertools

import numpy as np
import pytest
from helpers.mixtures import mixture
from scipy.spatial import cKDTree

import carom
from carom.cells import Grid, SortedCells
from carom.frame import Frame
from carom.geometry import overlaps
from carom.geometry.contacts import Contacts
from carom.geometry.nearby import near_pairs
from carom.geometry.overlaps import Geometry
from carom.observables import RDF
from carom.scene import placement


def as_set(pairs, alike):
    """Return the pairs as a sorted list without order within a pair of one set."""
    return sorted(map(tuple, np.sort(pairs, axis=1) if alike else pairs))


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_the_pairs_of_cells_are_those_of_a_tree(dimension):
    rng = np.random.default_rng(dimension)
    for periodic in itertools.product([True, False], repeat=dimension):
        box = rng.uniform(1.0, 2.0, dimension)
        x, y = rng.random((300, dimension)) * box, rng.random((90, dimension)) * box
        period = np.where(periodic, box, 0.0)
        trees = [cKDTree(points, boxsize=period) for points in (x, y)]
        for within in (0.02, 0.11, 0.31):
            found = near_pairs(box, np.array(periodic), x, None, within)
            assert as_set(found, True) == as_set(trees[0].query_pairs(within, output_type="ndarray"), True)
            found = near_pairs(box, np.array(periodic), x, y, within)
            near = trees[0].sparse_distance_matrix(trees[1], within, output_type="ndarray")
            assert as_set(found, False) == as_set(np.stack([near["i"], near["j"]], axis=1), False)


def test_more_pairs_than_a_gas_has_are_all_listed():
    x = np.full((40, 2), 0.25) + 1e-3 * np.random.default_rng(0).random((40, 2))
    assert len(near_pairs(np.full(2, 2.0), np.ones(2, bool), x, None, 0.1)) == 40 * 39 // 2


def test_a_drop_in_a_large_box_is_left_to_the_tree():
    x = np.random.default_rng(0).random((2000, 3))
    box, periodic = np.full(3, 1000.0), np.ones(3, bool)
    assert near_pairs(box, periodic, x, None, 0.05) is None
    n = overlaps.MANY
    x = np.random.default_rng(0).random((n, 3))
    found = Geometry(box, periodic).near(x, 0.01)
    assert as_set(found, True) == as_set(cKDTree(x).query_pairs(0.01, output_type="ndarray"), True)


def test_sorted_places_have_an_axis_after_the_other_in_memory():
    x = np.random.default_rng(0).random((50, 3))
    assert SortedCells.of(Grid.of(np.ones(3), np.ones(3, bool), 50, 0.3), x).places.flags.c_contiguous


@pytest.mark.parametrize(("dimension", "packing_fraction"), [(2, 0.5), (3, 0.3), (3, 0.45)])
def test_many_random_spheres_are_legal_disordered_and_repeat_with_their_seed(dimension, packing_fraction):
    n = overlaps.MANY
    first, again, other = (carom.Scene.random(n, packing_fraction, dimension, seed=s) for s in (1, 1, 2))
    np.testing.assert_array_equal(first.positions, again.positions)
    assert (first.positions != other.positions).any()
    x, box = first.positions, np.array(first.box)
    closest = cKDTree(x, boxsize=box).query(x, k=2)[0][:, 1].min()
    assert closest >= 1.0 - overlaps.tolerance(box)
    # No plane of any lattice: density waves up to a diameter long have amplitudes of a fluid, S(k) of a few.
    rng = np.random.default_rng(0)
    waves = rng.integers(-int(box[0]), int(box[0]) + 1, (300, dimension))
    amplitude = np.array([np.exp(2j * np.pi * (x @ (k / box))).sum() for k in waves if k.any()])
    assert (np.abs(amplitude) ** 2 / n).max() < 30.0
    # Far away g is that of a gas, to five times the counting error of 20 000 spheres.
    frame = Frame(0.0, 0, x, 0 * x, first.box, first.diameters, first.masses)
    far = RDF(rmax=6.0).over([frame])
    assert np.abs(far.g[far.r > 5.0] - 1.0).max() < 5.0 * far.error[far.r > 5.0].max()


def test_many_unequal_spheres_between_walls_are_placed_without_overlap():
    n = overlaps.MANY
    scene = mixture([n // 4, n], diameters=[1.0, 0.4], packing_fraction=0.35, walls="z", seed=1)
    room = Geometry(np.array(scene.box), np.array(scene.periodic))
    contacts = Contacts(scene.diameters)
    tree = cKDTree(scene.positions, boxsize=[*scene.box[:2], 0.0])
    pairs = tree.query_pairs(1.0, output_type="ndarray")
    gaps = room.distances(scene.positions, pairs) - contacts.of(pairs)
    assert gaps.min() >= -overlaps.tolerance(room.box)
    z = scene.positions[:, 2]
    assert (z >= 0.5 * scene.diameters - 1e-12).all()
    assert (z <= scene.box[2] - 0.5 * scene.diameters + 1e-12).all()


def test_an_overlap_among_many_is_found_and_named():
    scene = carom.Scene.crystal(cells=28, lattice="cubic", packing_fraction=0.3)
    assert scene.n >= overlaps.MANY
    x = scene.positions.copy()
    x[77] = np.mod(x[12345] + [0.3, 0.0, 0.0], scene.box)
    with pytest.raises(carom.errors.OverlapError, match="77 and 12345"):
        carom.Scene(x, scene.box)


def test_what_cannot_be_pushed_apart_ends():
    n = overlaps.MANY
    x = np.random.default_rng(0).random((n, 2)) * 100.0
    room, contacts = Geometry(np.full(2, 100.0), np.ones(2, bool)), Contacts(np.ones(n))
    # Packing fraction 1.6.
    assert placement.separated(x, room, contacts, np.full(n, 0.5), patience=3) is None


def test_of_two_that_overlap_the_heavier_gives_way_less():
    from carom.scene.placement import sweep

    start, edges = np.array([[0.2, 0.5], [9.9, 0.5], [5.0, 0.5]]), np.array([10.0, 10.0])
    weight, contact, clearance = np.array([1.0, 3.0, 1.0]), np.full(2, 1.0), 1.01
    places = start.copy()
    pairs = np.array([[0, 1], [1, 2]])
    assert sweep(places, pairs, contact, weight, edges, 1.0 / edges, clearance, np.empty(3)) == 1
    steps = places - start
    # They were 0.3 apart, across the border.
    assert steps[0, 0] - steps[1, 0] == pytest.approx(clearance - 0.3, rel=1e-12)
    assert steps[0, 0] == pytest.approx(-3.0 * steps[1, 0], rel=1e-12)
    assert not steps[2].any()
