"""Neighbors by sorted cells: those of a k-d tree and of all pairs, in any dimension, box and mixture."""

import numpy as np
import pytest
from helpers.frames import at_rest
from helpers.mixtures import mixture

from carom.errors import InputError
from carom.geometry import neighbors
from carom.geometry.overlaps import Geometry
from carom.observables import BondOrder


def squares(room, places):
    """Return the squared distances (n, n) of nearest images, infinite on the diagonal."""
    gaps = places[:, None] - places
    gaps -= np.where(room.periodic, room.box * np.rint(gaps / room.box), 0.0)
    found = np.sum(gaps**2, axis=2)
    np.fill_diagonal(found, np.inf)
    return found


def nearest(room, places, count):
    """Return the nearest of each particle, (n, count)."""
    pairs, _ = neighbors.nearest(room, places, count)
    assert (pairs[:, 0] == np.repeat(np.arange(len(places)), count)).all()
    return pairs[:, 1].reshape(-1, count)


@pytest.mark.parametrize("walls", ["none", "last", "all"])
@pytest.mark.parametrize(("dimension", "n", "count"), [(1, 40, 2), (2, 500, 6), (3, 700, 12), (4, 1200, 24)])
def test_the_nearest_are_those_of_all_pairs(dimension, n, count, walls):
    rng = np.random.default_rng(dimension)
    box = rng.uniform(6.0, 14.0, dimension)
    axes = np.arange(dimension)
    periodic = {"none": axes >= 0, "last": axes < dimension - 1, "all": axes < 0}[walls]
    room, places = Geometry(box, periodic), rng.uniform(0.0, box, (n, dimension))
    found = nearest(room, places, count)
    all_pairs = squares(room, places)
    assert (found == np.argsort(all_pairs, axis=1)[:, :count]).all()


def test_crowds_far_apart_have_their_neighbors_too():
    rng = np.random.default_rng(2)
    # A drop, a thread and a few alone in a large box: some find nobody in the first reach.
    drop = 50.0 + rng.normal(0.0, 0.3, (300, 3))
    thread = np.stack([rng.uniform(0.0, 100.0, 50), np.full(50, 20.0), np.full(50, 99.9)], axis=1)
    alone = rng.uniform(0.0, 100.0, (9, 3))
    places, room = np.concatenate([drop, thread, alone]), Geometry(np.full(3, 100.0), np.ones(3, bool))
    found = nearest(room, places, 12)
    right = np.sort(squares(room, places), axis=1)[:, :12]
    assert np.take_along_axis(squares(room, places), found, axis=1) == pytest.approx(right, rel=1e-12)


def test_where_a_tree_takes_over_the_neighbors_are_the_same(monkeypatch):
    rng = np.random.default_rng(3)
    room, places = Geometry(np.full(3, 10.0), np.array([True, True, False])), rng.uniform(0.0, 10.0, (200, 3))
    by_cells = nearest(room, places, 5)
    monkeypatch.setattr(neighbors, "WIDE", 0)
    assert (nearest(room, places, 5) == by_cells).all()


def test_one_neighbor_fewer_than_there_are_others_is_everybody_between_walls():
    rng = np.random.default_rng(4)
    room, places = Geometry(np.full(2, 3.0), np.zeros(2, bool)), rng.uniform(0.0, 3.0, (13, 2))
    found = nearest(room, places, 12)
    assert (np.sort(found, axis=1) == [[j for j in range(13) if j != i] for i in range(13)]).all()
    with pytest.raises(InputError, match="13 neighbors are asked for, and there are 12 others"):
        neighbors.nearest(room, places, 13)


def test_the_order_of_a_species_between_walls_is_that_of_its_own_pairs():
    scene = mixture([150, 150], diameters=[1.0, 0.5], dimension=2, packing_fraction=0.4, seed=1)
    order = BondOrder(6, nearest=6, species=1, rmax=2.0)
    order.add(at_rest(scene, periodic=(True, False)))
    room, places = Geometry(np.array(scene.box), np.array([True, False])), scene.positions[scene.species == 1]
    near = np.argsort(squares(room, places), axis=1)[:, :6]
    bonds = places[near] - places[:, None]
    bonds[..., 0] -= scene.box[0] * np.rint(bonds[..., 0] / scene.box[0])
    psi = np.exp(6j * np.arctan2(bonds[..., 1], bonds[..., 0])).mean(axis=1)
    found = order.result()
    assert found.local_order.mean == pytest.approx(np.abs(psi).mean(), rel=1e-12)
    assert found.global_order.mean == pytest.approx(abs(psi.mean()), rel=1e-11)
    i, j = np.nonzero(np.triu(squares(room, places) < 1.0))
    right = np.real(psi[i] * psi[j].conj()).sum() / len(i)
    within = order._samples[0][3][:10].sum() / order._samples[0][4][:10].sum()  # ten bins of 0.1
    assert within == pytest.approx(right, rel=1e-11)
