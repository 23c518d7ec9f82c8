"""Order of bonds: crystals with known values, all pairs of bonds, faces of cells, rounding, what is solid."""

import math

import numpy as np
import pytest
from helpers import frames

import carom
from carom.frame import Frame
from carom.geometry import tessellation
from carom.geometry.overlaps import Geometry
from carom.geometry.tessellation import voronoi_bonds
from carom.observables import BondOrder, Crystallinity
from carom.observables.bond_order import gegenbauer, harmonics
from carom.scene import lattices


def frame_of(scene):
    """Return a scene at rest as a frame."""
    return frames.frame_of(scene.positions, scene.box, scene.diameters)


def gas(n, dimension, seed):
    """Return points at random, as a frame: an ideal gas."""
    rng = np.random.default_rng(seed)
    return frames.frame_of(rng.uniform(0.0, 10.0, (n, dimension)), (10.0,) * dimension)


def measured(frame, **settings):
    """Return the order of one frame."""
    order = BondOrder(**settings)
    order.add(frame)
    return order.result()


FCC = carom.Scene.crystal(cells=4, packing_fraction=0.6)
TRIANGULAR = carom.Scene.crystal(dimension=2, cells=(12, 12), packing_fraction=0.7)


@pytest.mark.parametrize(
    ("scene", "degree", "right"),
    [
        (FCC, 4, 0.1909407),  # q_l of the crystals: Mickel et al., J. Chem. Phys. 138, 044501 (2013)
        (FCC, 6, 0.5745243),
        (carom.Scene.crystal(lattice="cubic", cells=(5, 5, 5), packing_fraction=0.4), 4, 0.7637626),
        (TRIANGULAR, 6, 1.0),
        (TRIANGULAR, 4, 0.0),
    ],
)
def test_crystals_have_their_known_order(scene, degree, right):
    found = measured(frame_of(scene), l=degree, nearest=6 if scene.n == 125 else None)
    assert found.local_order.mean == pytest.approx(right, abs=1e-6)
    assert found.global_order.mean == pytest.approx(right, abs=1e-6)


@pytest.mark.parametrize("dimension", [2, 3, 4])
def test_local_order_is_the_mean_over_all_pairs_of_bonds(dimension):
    frame = gas(60, dimension, seed=dimension)
    found = measured(frame, l=6, nearest=5)
    gaps = frame.positions[:, None] - frame.positions
    gaps -= 10.0 * np.rint(gaps / 10.0)
    distances = np.sqrt(np.sum(gaps**2, axis=2))
    np.fill_diagonal(distances, np.inf)
    lengths = []
    for i in range(60):
        bonds = gaps[i, np.argsort(distances[i])[:5]]
        units = bonds / np.linalg.norm(bonds, axis=1)[:, None]
        values = np.polynomial.polynomial.polyval(units @ units.T, gegenbauer(6, dimension))
        lengths.append(math.sqrt(values.mean()))
    assert found.local_order.mean == pytest.approx(np.mean(lengths), rel=1e-11)


def test_harmonics_of_the_plane_and_of_space_are_cosines_and_legendre_polynomials():
    rng = np.random.default_rng(3)
    for d, polynomial in ((2, np.polynomial.chebyshev.Chebyshev), (3, np.polynomial.legendre.Legendre)):
        units = rng.standard_normal((50, d))
        units /= np.linalg.norm(units, axis=1)[:, None]
        values = harmonics(8, units)
        assert values.shape[1] == {2: 2, 3: 17}[d]
        assert values @ values.T == pytest.approx(polynomial.basis(8)(units @ units.T), abs=1e-12)


@pytest.mark.parametrize("crowd", [1.0, 0.1])  # of the box; around an empty one, distant images are neighbors
@pytest.mark.parametrize("periodic", [(True, True), (True, False), (True, True, True), (False, False, True)])
def test_neighbors_share_a_face_of_their_cells(periodic, crowd):
    d, n, box = len(periodic), 20, np.array((4.0, 7.0, 5.0)[: len(periodic)])
    places = np.random.default_rng(d).uniform(0.0, crowd * box, (n, d))
    pairs, bonds = voronoi_bonds(Geometry(box, np.array(periodic)), places)
    # The cell that a random point of the box lies in is that of its nearest component: the two nearest
    # components of a point on a line between cells are neighbors.
    ways = np.stack(np.meshgrid(*[range(-2, 3) if axis else (0,) for axis in periodic]), -1).reshape(-1, d)
    images = (places[:, None] + ways * box).reshape(-1, d)
    rng, seen = np.random.default_rng(5), set()
    for _ in range(6000 if crowd == 1.0 and d == 2 else 2000):
        start, way = rng.uniform(0.0, box), rng.standard_normal(d)
        gaps = start - images
        # Walking along a way, the first component that is as near as the nearest one of the start.
        i = int(np.argmin(np.sum(gaps**2, axis=1)))
        speeds = 2.0 * (images - images[i]) @ way
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = (np.sum(gaps**2, axis=1) - np.sum(gaps[i] ** 2)) / speeds
        steps[(speeds <= 0.0) | (np.arange(len(images)) == i)] = math.inf
        j = int(np.argmin(steps))
        end = start + steps[j] * way
        if math.isfinite(steps[j]) and (periodic | ((end >= 0.0) & (end <= box))).all():
            seen.add((i // len(ways), j // len(ways), *np.round(images[j] - images[i], 9)))
    found = {(int(i), int(j), *np.round(bond, 9)) for (i, j), bond in zip(pairs, bonds, strict=True)}
    assert seen <= found
    assert len(seen) > (0.9 if d == 2 else 0.6) * crowd * len(found)  # small faces are rarely crossed
    assert {(j, i, *(-x for x in bond)) for i, j, *bond in found} == found


@pytest.mark.parametrize("crowd", [1.0, 0.1])
@pytest.mark.parametrize("periodic", [(True, True), (True, False), (True, True, True)])
def test_neighbors_do_not_depend_on_the_first_layer_of_images(periodic, crowd, monkeypatch):
    d = len(periodic)
    room = Geometry(np.array((4.0, 7.0, 5.0)[:d]), np.array(periodic))
    places = np.random.default_rng(d).uniform(0.0, crowd * room.box, (24, d))
    found = []
    for first in (0.5, 1.0, 1.5, 2.5, 20.0 if d == 2 else 6.0):
        monkeypatch.setattr(tessellation, "FIRST", first)
        pairs, bonds = voronoi_bonds(room, places)
        found.append(sorted(zip(pairs.tolist(), np.round(bonds, 9).tolist(), strict=True)))
    assert all(each == found[-1] for each in found)


def test_a_point_that_two_cells_share_makes_no_neighbors():
    for d in (2, 3):
        scene = carom.Scene.crystal(lattice=lattices.cubic(d), cells=4, packing_fraction=0.3)
        assert measured(frame_of(scene), l=4, voronoi=True).neighbors.mean == 2 * d
        room, rng = Geometry(np.full(d, 4.0), np.full(d, True)), np.random.default_rng(1)
        rounded = np.indices((4,) * d).reshape(d, -1).T + 0.5 + 1e-12 * rng.standard_normal((4**d, d))
        pairs, _ = voronoi_bonds(room, rounded)
        assert (np.bincount(pairs[:, 0]) == 2 * d).all()


def test_the_error_of_a_correlation_is_that_of_a_ratio_of_sums():
    """Of products over pairs, both of which scatter: the delta method, as for all ratios."""
    from carom.observables.bond_order import _ratio
    from carom.observables.statistics import ratio

    rng = np.random.default_rng(5)
    counts = rng.integers(20, 60, 256).astype(float)
    sums = 0.3 * counts + rng.normal(0.0, 2.0, 256)
    mine, its = _ratio(sums, counts), ratio(sums, counts)
    assert (mine.mean, mine.error) == pytest.approx((its.mean, its.error), rel=1e-12)


def _rounded(way, x, edge):
    """Return coordinates as files hold them."""
    if way == "single":
        return x.astype(np.float32).astype(float)
    if way == "centered":  # GSD
        return (x - 0.5 * edge).astype(np.float32).astype(float) + 0.5 * float(np.float32(edge))
    if way == "xtc":
        return np.round(x, 3).astype(np.float32).astype(float)
    return np.array([[float(format(c, way)) for c in row] for row in x])


WAYS = ("single", "centered", "xtc", ".9g", ".6g", ".8f", ".3f")


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("unit", [1.0, 0.1, 3.4, 10.0])
def test_faces_that_only_rounding_makes_are_no_neighbors(way, unit):
    """In fcc six cells share a corner, in a square lattice four; rounding may make faces of it."""
    crystal = carom.Scene.crystal(108, 0.6)
    a = 1.1234567891
    square = a * np.stack(np.meshgrid(*[np.arange(12)] * 2), axis=-1).reshape(-1, 2) + 0.123456789
    for places, box, neighbors in ((crystal.positions, crystal.box, 12), (square, (12 * a,) * 2, 4)):
        n, d = places.shape
        edges = np.array(box) * unit
        x = _rounded(way, places * unit, edges[0]) % edges
        frame = Frame(0.0, 0, x, np.zeros((n, d)), edges, np.ones(n), np.ones(n))
        found = measured(frame, voronoi=True, l=6 if d == 3 else 4)
        assert found.neighbors.mean == neighbors
        known = 0.57452 if d == 3 else 1.0
        assert found.local_order.mean == pytest.approx(known, abs=1e-5 if way not in ("xtc", ".3f") else 0.02)


@pytest.mark.parametrize("way", WAYS)
def test_narrow_faces_of_a_fluid_are_neighbors_however_it_is_rounded(way):
    """Points in the plane have six neighbors on average, exactly, by Euler's formula."""
    fluid = gas(2000, 2, 5)
    x = _rounded(way, fluid.positions, 10.0) % 10.0
    for places in (fluid.positions, x):
        frame = Frame(0.0, 0, places, fluid.velocities, fluid.box, fluid.diameters, fluid.masses)
        assert measured(frame, voronoi=True).neighbors.mean == 6.0


def test_a_strain_by_a_millionth_is_seen_in_double_precision():
    """A square lattice stretched along a diagonal has six neighbors."""
    a = 1.1234567891
    along = np.array([[1.0, 1e-6], [1e-6, 1.0]]) * a
    cells = np.stack(np.meshgrid(*[np.arange(9)] * 2), axis=-1).reshape(-1, 2)
    inner = np.flatnonzero(((cells > 2) & (cells < 6)).all(axis=1))
    pairs, _ = voronoi_bonds(Geometry(np.full(2, 12.0), np.zeros(2, bool)), cells @ along + 0.5)
    assert (np.bincount(pairs[:, 0])[inner] == 6).all()


FEW = 0.02
"""Solid-like part of a fluid at packing fraction 0.40, at most: few, as ten Wolde et al. (1996) find."""


@pytest.mark.parametrize("eta", [0.545, 0.7])
def test_a_crystal_is_solid_in_one_cluster_also_when_it_moves(eta):
    sim = carom.Simulation(carom.Scene.crystal(256, eta), seed=1)
    assert Crystallinity().over([sim.frame()]).largest.mean == 256
    sim.run(collisions_per_particle=20)
    found = sim.measure(Crystallinity(), collisions_per_particle=20)
    assert found.solid_fraction.mean > 1.0 - FEW
    assert found.largest.mean > 256 * (1.0 - FEW)


def test_solid_particles_that_are_neighbors_are_in_one_cluster_alike_or_not():
    """Of points at random, with each rule of the definition as one matrix."""
    n, reach = 150, 2.4
    frame = gas(n, 3, 1)
    r = frame.positions[None] - frame.positions[:, None]
    r -= 10.0 * np.rint(r / 10.0)
    apart = np.sqrt(np.sum(r**2, axis=2)) + reach * np.eye(n)
    near = apart < reach
    order = np.array([harmonics(6, r[i, near[i]] / apart[i, near[i], None]).mean(axis=0) for i in range(n)])
    order /= np.linalg.norm(order, axis=1)[:, None]
    alike = near & (order @ order.T > 0.5)
    solid = alike.sum(axis=1) >= 2

    def largest(joined):
        joined = (joined & solid & solid[:, None]) | np.eye(n, dtype=bool)
        for _ in range(8):
            joined = joined @ joined
        return joined[solid].sum(axis=1).max()

    found = Crystallinity(reach=reach, connections=2).over([frame])
    assert (found.solid[0], found.largest_cluster[0]) == (solid.sum(), largest(near))
    assert largest(alike) < largest(near) < solid.sum() < n


def test_a_box_half_crystal_and_half_fluid_is_half_one_cluster():
    """Of the crystal the two layers at the interfaces, of 8 along the axis, may be solid-like or not."""
    crystal, fluid = carom.Scene.crystal(256, 0.545), carom.Scene.random(256, 0.4, seed=1)
    edge = crystal.box[0]
    places = fluid.positions * (edge / fluid.box[0]) + [edge, 0.0, 0.0]
    frame = frames.frame_of(np.concatenate([crystal.positions, places]), (2.0 * edge, edge, edge))
    found = Crystallinity().over([frame])
    assert 0.75 * 256 - FEW * 512 <= found.largest_cluster[0] <= 1.25 * 256 + FEW * 512
