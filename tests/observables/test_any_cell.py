"""Observables of frames in random cells, tilted and small, beside sums over all images of all pairs."""

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.special import eval_chebyt, eval_legendre

import carom
from carom.drawing.page import psi_6
from carom.observables import BondOrder, Crystallinity, DensityProfile, packing_network
from carom.studies.eos import order

ROUNDING = 1e-9  # of sums over bonds, and of distances far from their cell; values are of the order of 1


def random_frame(d, seed):
    """Return a frame of points in a cell of two to four spacings, tilted by up to 1.6 edges."""
    rng = np.random.default_rng([d, seed])
    box = rng.uniform(1.3, 4.0, d)
    tilt = float(rng.uniform(-1.6, 1.6) * box[0] / box[1])
    n = int(rng.integers(3, 9 * d - 4))
    x = rng.random((n, d)) @ cell_of(box, tilt)
    species = np.arange(n) % 2
    return carom.Frame(0.0, 0, x, np.zeros((n, d)), box, np.zeros(n), np.ones(n), species=species, tilt=tilt)


def cell_of(box, tilt):
    cell = np.diag(box)
    cell[1, 0] = tilt * box[1]
    return cell


def vectors(frame):
    """Return the vectors (n, n, m, d) from each particle to all images of each, those far away too."""
    d = frame.dimension
    turns = np.array(list(itertools.product(range(-12, 13), range(-12, 13), *[range(-4, 5)] * (d - 2))))
    x = frame.positions
    return x[None, :, None] - x[:, None, None] + turns @ cell_of(frame.box, frame.tilt)


def bonds_of(frame, *, nearest=None, reach=None):
    """Return the neighbors and the vectors to them of each particle, in order of their distances."""
    found = []
    for i, around in enumerate(vectors(frame)):
        who, steps = np.repeat(np.arange(frame.n), around.shape[1]), around.reshape(-1, frame.dimension)
        lengths = np.linalg.norm(steps, axis=1)
        by_length = np.argsort(lengths)[1:]  # without the particle itself
        assert lengths[by_length[0]] > 0.0, i
        kept = by_length[:nearest] if reach is None else by_length[lengths[by_length] < reach]
        found.append((who[kept], steps[kept]))
    return found


def products(bonds, d, degree=6):
    """Return q_i . q_j (n, n), by the sum over pairs of bonds: Chebyshev's polynomials or Legendre's."""
    units = [steps / np.linalg.norm(steps, axis=1)[:, None] for _, steps in bonds]
    polynomial = eval_chebyt if d == 2 else eval_legendre
    one = [
        [polynomial(degree, np.clip(a @ b.T, -1, 1)).mean() if a.size and b.size else 0.0 for b in units]
        for a in units
    ]
    return np.array(one)


def voronoi_of(frame):
    """Return what :func:`bonds_of` does of neighbors in the tessellation of what is around each particle."""
    from scipy.spatial import Voronoi

    spacing = (np.prod(frame.box) / frame.n) ** (1.0 / frame.dimension)
    found = []
    for who, steps in bonds_of(frame, reach=6.0 * spacing):
        cells = Voronoi(np.concatenate([np.zeros((1, frame.dimension)), steps]))
        faces = [ridge for ridge in cells.ridge_points if 0 in ridge]
        corners = cells.vertices[cells.regions[cells.point_region[0]]]
        assert np.linalg.norm(corners, axis=1).max() < 3.0 * spacing  # none farther can cut it
        others = np.sort([max(ridge) - 1 for ridge in faces])
        found.append((who[others], steps[others]))
    return found


CELLS = pytest.mark.parametrize(("d", "seed"), list(itertools.product((2, 3), range(8))))


@CELLS
@pytest.mark.parametrize("pair", [None, (0, 1), (1, 0), (0, 0)])
def test_pair_distances_are_those_of_all_images(d, seed, pair):
    frame = random_frame(d, seed)
    found = carom.RDF(rmax=0.5 * min(frame.box), bins=7, pair=pair).over([frame])
    lengths = np.linalg.norm(vectors(frame), axis=-1)
    a, b = (frame.species == k if pair else frame.species >= 0 for k in pair or (0, 0))
    lengths = lengths[a][:, b]
    twice = 2 if pair in (None, (0, 0)) else 1
    right = np.histogram(lengths[lengths > 0.0], found.edges)[0]
    assert (twice * found.counts).tolist() == right.tolist()
    numbers, _ = found.coordination()
    np.testing.assert_allclose(numbers, np.cumsum(right) / a.sum())


@CELLS
@pytest.mark.parametrize("settings", [{}, {"nearest": 4}, {"reach": 1.4}, {"voronoi": True}])
def test_the_order_is_that_of_bonds_to_all_images(d, seed, settings):
    frame = random_frame(d, seed)
    rmax = 0.5 * min(frame.box)
    found = BondOrder(**settings, rmax=rmax, width=rmax / 3).over([frame])
    usual = {"nearest": {2: 6, 3: 12}[d]}
    bonds = voronoi_of(frame) if "voronoi" in settings else bonds_of(frame, **settings or usual)
    q = products(bonds, d)
    assert found.neighbors.mean == np.mean([len(who) for who, _ in bonds])
    assert found.local_order.mean == pytest.approx(np.sqrt(np.diag(q)).mean(), rel=ROUNDING)
    assert found.global_square.mean == pytest.approx(q.mean(), abs=ROUNDING)
    lengths = np.linalg.norm(vectors(frame), axis=-1)
    i, j, _ = np.nonzero((lengths > 0.0) & (lengths < rmax))
    bins = np.digitize(np.sort(lengths, axis=2)[i, j, 0], found.edges) - 1
    with np.errstate(invalid="ignore"):
        right = np.bincount(bins, q[i, j], 3) / np.bincount(bins, minlength=3)
    np.testing.assert_allclose(found.correlation, right, rtol=0.0, atol=ROUNDING)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("settings", [{"nearest": 12}, {"reach": 1.5}])
def test_solid_like_particles_are_those_with_bonds_to_all_images(seed, settings):
    frame = random_frame(3, seed)
    found = Crystallinity(**settings, likeness=0.2, connections=3).over([frame])
    bonds = bonds_of(frame, **settings)
    q = products(bonds, 3)
    size = np.sqrt(np.diag(q))
    alike = q > 0.2 * size[:, None] * size
    solid = np.array([alike[i, who].sum() >= 3 for i, (who, _) in enumerate(bonds)])
    clusters = [{i} for i in np.flatnonzero(solid)]
    for i in np.flatnonzero(solid):
        joined = [each for each in clusters if i in each or each & set(bonds[i][0].tolist())]
        clusters = [each for each in clusters if each not in joined] + [set().union(*joined)]
    assert found.solid.tolist() == [solid.sum()]
    assert found.largest_cluster.tolist() == [max(map(len, clusters), default=0)]


@CELLS
@pytest.mark.parametrize("pair", [None, (0, 1)])
def test_waves_are_those_of_the_reciprocal_lattice(d, seed, pair):
    frame = random_frame(d, seed)
    found = carom.StructureFactor(shells=9, pair=pair).over([frame])
    reciprocal = 2.0 * np.pi * np.linalg.inv(cell_of(frame.box, frame.tilt)).T
    turns = np.array(list(itertools.product(range(-15, 16), range(-15, 16), *[range(-9, 10)] * (d - 2))))
    k = turns[turns.any(axis=1)] @ reciprocal
    lengths = np.linalg.norm(k, axis=1)
    a, b = (frame.species == kind if pair else frame.species >= 0 for kind in pair or (0, 0))
    for at, length in enumerate(found.k):
        shell = k[np.abs(lengths - length) < 1e-7 * length]
        waves = np.exp(1j * shell @ frame.positions.T)
        square = (waves[:, a].sum(axis=1) * waves[:, b].sum(axis=1).conj()).real.mean()
        assert 2 * found.vectors[at] == len(shell)
        assert found.S[at] == pytest.approx(square / np.sqrt(a.sum() * b.sum()), abs=ROUNDING)
    assert np.sum(lengths <= found.k[-1] * (1.0 + 1e-9)) == 2 * found.vectors.sum()  # none is left out


@CELLS
def test_a_density_across_the_tilt_is_that_of_slabs(d, seed):
    frame = random_frame(d, seed)
    for axis in range(1, d):
        found = DensityProfile("xyz"[axis], bins=5).over([frame])
        numbers = np.bincount((frame.positions[:, axis] / frame.box[axis] * 5).astype(int), minlength=5)
        np.testing.assert_allclose(found.density, numbers / np.prod(frame.box) * 5)


@CELLS
def test_contacts_and_orders_of_studies_and_pages_are_those_of_all_images(d, seed):
    frame = random_frame(d, seed)
    diameter = 1.5 * (np.prod(frame.box) / frame.n) ** (1.0 / d)
    touching = dataclasses.replace(frame, diameters=np.full(frame.n, diameter))
    steps = np.concatenate([steps for _, steps in bonds_of(frame, reach=1.3 * diameter)])
    right = np.sort(np.linalg.norm(steps, axis=1))[::2] / diameter - 1.0  # each is there from both ends
    np.testing.assert_allclose(packing_network(touching, gap=0.2).gaps, right, atol=ROUNDING)
    if d == 2:
        right = np.sqrt(products(voronoi_of(frame), d).mean())
        assert order.psi_6(frame) == pytest.approx(right, abs=ROUNDING)
        right = np.sqrt(np.diag(products(bonds_of(frame, nearest=6), d)))
        np.testing.assert_allclose(psi_6(frame)[:, 1], right, rtol=ROUNDING)
    else:
        reach = order.REACH * (np.prod(frame.box) / frame.n) ** (1 / 3)
        steps = np.concatenate([steps for _, steps in bonds_of(frame, reach=reach)])
        right = np.sqrt(products([(None, steps)], d)[0, 0])
        assert order.q_6(frame) == pytest.approx(right, abs=1e-7)  # the root of a difference


@CELLS
def test_the_shortest_wave_of_a_cell_is_measured_and_a_shorter_one_refused(d, seed):
    frame = random_frame(d, seed)
    found = carom.StructureFactor(shells=3).over([frame])
    again = carom.StructureFactor(kmax=found.k[2] * (1.0 + 1e-6)).over([frame])
    assert again.k.tolist() == found.k.tolist()
    assert carom.StructureFactor(kmax=found.k[0]).over([frame]).k == found.k[:1]
    with pytest.raises(carom.InputError, match="below the shortest wave vector of the box"):
        carom.StructureFactor(kmax=0.99 * found.k[0]).over([frame])


def test_waves_that_turn_are_refused_and_a_rounded_or_equal_tilt_is_none():
    frame = random_frame(2, 1)
    ratio = frame.box[0] / frame.box[1]
    same = [dataclasses.replace(frame, tilt=frame.tilt + shift) for shift in (0.0, ratio, 1e-8)]
    np.testing.assert_allclose(
        *[carom.StructureFactor().over(each).S for each in (same, same[:1])], atol=1e-5
    )
    with pytest.raises(carom.InputError, match="turn with the strain; measure S"):
        carom.StructureFactor().over([frame, dataclasses.replace(frame, tilt=frame.tilt + 0.1)])


@pytest.mark.parametrize("cells", [1, 2, 3])
def test_a_crystal_of_few_cells_has_the_order_of_a_large_one(cells):
    """Of hcp q_6 is .48476 (Steinhardt, Nelson and Ronchetti, 1983), and all is solid, in one cluster."""
    base = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 5 / 6, 0.5], [0, 1 / 3, 0.5]])
    edges = np.array([1.0, 3.0**0.5, (8.0 / 3.0) ** 0.5])
    steps = np.array(list(itertools.product(range(cells), repeat=3)))[:, None]
    x = (steps + base).reshape(-1, 3) * edges
    n = len(x)
    frame = carom.Frame(0.0, 0, x, np.zeros_like(x), cells * edges, np.full(n, 0.9), np.ones(n))
    for settings in ({"nearest": 12}, {"reach": 1.2}):
        found = BondOrder(6, **settings).over([frame])
        assert found.local_order.mean == pytest.approx(0.48476, abs=1e-5)
        assert found.neighbors.mean == 12
        assert Crystallinity(**settings).over([frame]).largest.mean == n
    assert order.q_6(frame) == pytest.approx(0.48476, abs=1e-5)
    if cells > 1:
        found = carom.measure([frame], "order", "crystal")
        assert found["order"].local_order.mean == pytest.approx(0.48476, abs=1e-5)
        assert found["crystal"].solid_fraction.mean == 1.0
