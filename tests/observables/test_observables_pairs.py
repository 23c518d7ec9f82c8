"""Counts of pair distances over sorted cells: those of a k-d tree and numpy's histogram, to the last pair."""

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest
from helpers.frames import at_rest
from helpers.mixtures import mixture
from helpers.scripts import python
from scipy.spatial import cKDTree

import carom
from carom.cells import Grid, SortedCells
from carom.errors import InputError
from carom.observables import RDF
from carom.observables.analysis.pair_counts import distance_counts
from carom.observables.rdf import PartialRDF


def by_tree(ours, theirs, box, periodic, edges):
    """Return the counts in each bin, and of pairs closer than all, by another way."""
    period = np.where(periodic, box, 0.0)
    trees = [cKDTree(x, boxsize=period) for x in (ours, ours if theirs is None else theirs)]
    pairs = trees[0].sparse_distance_matrix(trees[1], edges[-1], output_type="ndarray")
    r = pairs["v"] if theirs is not None else pairs["v"][pairs["i"] < pairs["j"]]
    return np.histogram(r, bins=len(edges) - 1, range=(edges[0], edges[-1]))[0], int((r < edges[0]).sum())


def agree(ours, theirs, box, periodic, edges, threads=1):
    box, periodic = np.asarray(box, dtype=float), np.asarray(periodic)
    grid = Grid.of(box, periodic, len(ours), edges[-1])
    cells = [None if x is None else SortedCells.of(grid, x) for x in (ours, theirs)]
    counts, closer = distance_counts(*cells, edges, threads=threads)
    expected, below = by_tree(ours, theirs, box, periodic, edges)
    np.testing.assert_array_equal(counts, expected)
    assert closer == below


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
@pytest.mark.parametrize("reach", [0.5, 0.27, 0.06])
def test_every_pair_of_a_gas_is_counted_once_in_its_bin(dimension, reach):
    rng = np.random.default_rng([dimension, int(100 * reach)])
    for n in (2, 3, 40, 700):
        box = rng.uniform(1.0, 3.0, dimension)
        x = rng.random((n, dimension)) * box
        for start, bins in ((0.0, 50), (0.1, 7)):
            agree(x, None, box, [True] * dimension, np.linspace(start * reach, reach * box.min(), bins + 1))


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_axes_with_walls_have_no_images(dimension):
    rng = np.random.default_rng(dimension)
    box = rng.uniform(1.0, 2.0, dimension)
    x = rng.random((300, dimension)) * box
    for periodic in itertools.product([True, False], repeat=dimension):
        agree(x, None, box, periodic, np.linspace(0.05, 0.5 * box.min(), 31))


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_pairs_of_two_sets_are_counted_once(dimension):
    rng = np.random.default_rng(10 + dimension)
    box = rng.uniform(1.0, 2.0, dimension)
    x = rng.random((260, dimension)) * box
    for split in (1, 60, 259):
        for reach in (0.5, 0.2):
            edges = np.linspace(0.02, reach * box.min(), 41)
            agree(x[:split], x[split:], box, [True] * dimension, edges)


@pytest.mark.parametrize(("dimension", "cells"), [(1, 8), (2, 6), (2, 5), (3, 4), (3, 5), (4, 4)])
@pytest.mark.parametrize("shift", [0.0, 0.75])
def test_lattices_whose_distances_are_edges_of_bins_keep_their_counts(dimension, cells, shift):
    sites = np.array(list(itertools.product(range(cells), repeat=dimension)), dtype=float) + shift
    box = np.full(dimension, float(cells))
    # Half of an even lattice's edge is the distance of two images at once: one pair.
    for bins in (1, 4, 20, 21):
        agree(sites, None, box, [True] * dimension, np.linspace(0.0, 0.5 * cells, bins + 1))
        agree(sites, None, box, [True] * dimension, np.linspace(1.0, 0.5 * cells, bins + 1))


def test_threads_change_no_count():
    rng = np.random.default_rng(5)
    box = np.array([7.0, 8.0, 9.0])
    x = rng.random((3000, 3)) * box
    edges = np.linspace(0.0, 2.0, 101)
    for threads in (1, 2, 3, 7):
        agree(x, None, box, [True] * 3, edges, threads)
        agree(x[:1000], x[1000:], box, [True] * 3, edges, threads)


def test_any_unit_of_length_gives_the_same_counts():
    rng = np.random.default_rng(6)
    x = rng.random((500, 3))
    edges = np.linspace(0.1, 0.5, 41)
    counts = []
    for unit in (1.0, 2.0**-300, 2.0**300):
        grid = Grid.of(np.full(3, unit), np.ones(3, bool), 500, 0.5 * unit)
        counts.append(distance_counts(SortedCells.of(grid, unit * x), None, unit * edges)[0])
    np.testing.assert_array_equal(counts[1], counts[0])
    np.testing.assert_array_equal(counts[2], counts[0])


def test_pairs_that_overlap_by_less_than_allowed_are_in_the_first_bin():
    x = np.array([[0.0], [0.99], [3.0], [3.97]])
    cells = SortedCells.of(Grid.of(np.array([10.0]), np.array([True]), 4, 2.0), x)
    counts, closer = distance_counts(cells, None, np.linspace(1.0, 1.5, 6), closest=0.98)
    assert counts.tolist() == [1, 0, 0, 0, 0]
    assert closer == 1


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_positions_that_are_no_numbers_are_refused(bad):
    x = np.ones((5, 2))
    x[3, 1] = bad
    with pytest.raises(InputError, match="Position 3"):
        SortedCells.of(Grid.of(np.ones(2), np.ones(2, bool), 5, 0.5), x)


def test_positions_outside_of_walls_are_refused():
    with pytest.raises(InputError, match="axis 0, which has walls"):
        SortedCells.of(Grid.of(np.ones(2), np.array([False, True]), 1, 0.5), np.array([[1.5, 0.5]]))


def test_a_mixture_is_read_once_and_has_the_counts_of_each_pair_alone():
    scene = mixture([40, 60, 1], diameters=[1.0, 0.5, 0.8], packing_fraction=0.2, seed=1)
    rng = np.random.default_rng(0)
    frames = []
    for k in range(3):
        # Any valid frame will do: the scene's own, moved as a whole.
        x = np.mod(scene.positions + rng.random(3) * scene.box, scene.box)
        frames.append(dataclasses.replace(at_rest(scene, float(k)), positions=x))
    passes = []

    def once():
        passes.append(1)
        return iter(frames)

    together = PartialRDF(scene).over(once())
    assert len(passes) == 1
    assert set(together) == {"0-0", "0-1", "0-2", "1-1", "1-2"}
    for name, found in together.items():
        alone = RDF(pair=tuple(map(int, name.split("-")))).over(frames)
        np.testing.assert_array_equal(found.counts, alone.counts)
        np.testing.assert_array_equal(found.g, alone.g)


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    code = (
        "import numpy as np; from carom.cells import *; from carom.observables.analysis.pair_counts import *;"
        "grid = Grid.of(np.ones(1), np.ones(1, bool), 2, 0.5);"
        "cells = SortedCells.of(grid, np.array([[0.1], [0.3]]));"
        "print(distance_counts(cells, None, np.array([0.0, 0.25, 0.5]))[0].tolist())"
    )
    # Neither the package's folder nor a home is offered: a folder below a file cannot be made.
    places = {"NUMBA_CACHE_DIR": str(blocked / "cache"), "PYTHONPATH": str(Path(carom.__file__).parents[1])}
    assert python("-c", code, **places).strip() == "[1, 0]"
