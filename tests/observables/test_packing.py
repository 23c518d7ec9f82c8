"""Contact networks of packings that are known: crystals, with and without vacancies, and rattlers."""

import itertools
import math

import numpy as np
import pytest
from helpers.frames import TOUCHING, crystal, frame_of, without
from helpers.mixtures import mixture

import carom
from carom.errors import InputError
from carom.frame import Frame
from carom.models import Ball, SphericalContainer
from carom.observables.packing import REACH, is_held, packing_network
from carom.pictures import plots
from carom.scene import lattices
from carom.studies.packings.packing import HISTORY, Packing


@pytest.mark.parametrize(
    ("dimension", "cells", "kissing"), [(1, 7, 2), (2, 6, 6), (3, 3, 12), (4, 2, 24), (5, 2, 40)]
)
def test_every_sphere_of_a_crystal_touches_its_kissing_number(dimension, cells, kissing):
    frame = crystal(dimension, cells)
    network = packing_network(frame)
    n = frame.n
    assert network.contacts == len(network.bonds) == n * kissing // 2
    assert network.coordination == kissing
    assert network.rattlers.size == 0
    assert network.isostatic == dimension * (n - 1) + 1
    assert network.packing_fraction == pytest.approx(
        lattices.densest(dimension).limit * (1 + TOUCHING) ** -dimension, rel=1e-12
    )
    assert network.void[0] < 2 * TOUCHING < network.gap < 0.1 < network.void[1] <= REACH
    np.testing.assert_allclose(np.linalg.norm(network.vectors, axis=1), 1 + TOUCHING, rtol=1e-14)


def test_small_boxes_have_a_bond_for_each_image():
    # Two cells of the triangular lattice along x: each disk touches its two neighbors there from both sides.
    frame = crystal(2, (2, 1))
    network = packing_network(frame)
    assert (frame.n, network.contacts, network.coordination) == (4, 12, 6.0)


def test_vectors_go_from_the_first_of_a_bond_to_the_second_whichever_is_larger():
    # Rods of three lengths that fill a ring. Each is in a class of size of its own, and the
    # smallest are searched first. The bond of the first and the last goes across the border.
    diameters = np.array([1.0, 0.25, 0.5, 0.25])
    places = np.cumsum(diameters) - 0.5 * diameters
    frame = frame_of(places[:, None], (2.0,), diameters=diameters)
    network = packing_network(frame, gap=1e-9)
    found = {tuple(bond): x for bond, (x,) in zip(network.bonds.tolist(), network.vectors, strict=True)}
    assert found == {(0, 1): 0.625, (1, 2): 0.375, (2, 3): 0.375, (0, 3): -0.625}
    assert network.rattlers.size == 0


def test_a_vacancy_costs_its_neighbors_a_contact_and_frees_nobody():
    frame = without(crystal(2, 6), 14)
    network = packing_network(frame)
    assert network.rattlers.size == 0
    assert network.contacts == 3 * 36 - 6
    assert sorted(np.bincount(network.bonds.ravel()).tolist()) == [5] * 6 + [6] * 29


def test_vacancies_apart_hold_and_vacancies_side_by_side_unravel_the_crystal():
    frame = crystal(2, 8)
    middle = int(np.argmin(np.linalg.norm(frame.positions - 0.5 * np.array(frame.box), axis=1)))
    separation = frame.positions - frame.positions[middle]
    around = np.flatnonzero(np.abs(np.linalg.norm(separation, axis=1) - 1) < 0.1)
    ring = around[np.argsort(np.arctan2(separation[around, 1], separation[around, 0]))]
    assert len(ring) == 6
    held = packing_network(without(frame, *ring[::2]))
    assert held.rattlers.size == 0
    # A disk beside two that are missing has contacts at 0, 60, 120 and 180 degrees only and can move away; so
    # can then the next one.
    pair = packing_network(without(frame, *ring[:2]))
    assert not pair.backbone.any()


def test_a_disk_put_into_a_vacancy_of_a_larger_one_rattles():
    frame = crystal(2, 6)
    sizes = np.ones(frame.n)
    sizes[14] = 0.9
    network = packing_network(frame_of(frame.positions, frame.box, sizes))
    assert network.rattlers.tolist() == [14]
    assert network.rattler_fraction == pytest.approx(1 / 36)
    assert network.contacts == 3 * 36 - 6
    assert network.isostatic == 2 * 34 + 1
    assert network.coordination == pytest.approx(2 * 102 / 35)
    # Its neighbors have no contact at all with it: the gaps of 0.05 lie above the void.
    assert network.void[1] == pytest.approx(1 / 0.95 - 1, rel=1e-6)


def test_what_only_rattlers_hold_rattles_too():
    # A chain of disks: each end has one contact, and losing it frees the next.
    chain = [[1.0 + k, 1.0] for k in range(5)]
    network = packing_network(frame_of(chain, (20.0, 20.0)))
    assert len(network.bonds) == 4
    assert network.rattlers.tolist() == [0, 1, 2, 3, 4]
    assert (network.contacts, network.isostatic) == (0, 0)
    assert math.isnan(network.coordination)


def test_walls_hold_as_well():
    # Four disks fill a square box: each touches two walls and two others.
    corners = [[0.5, 0.5], [1.5, 0.5], [0.5, 1.5], [1.5, 1.5]]
    network = packing_network(frame_of(corners, (2.0, 2.0), periodic=False))
    assert network.rattlers.size == 0
    assert network.contacts == 4 + 8
    assert network.coordination == 4.0
    assert network.isostatic == 2 * 4 + 1
    # A single disk between two walls is held along one axis alone.
    alone = packing_network(frame_of([[0.5, 2.0]], (1.0, 4.0), periodic=False))
    assert alone.rattlers.tolist() == [0]


def test_gaps_to_walls_and_obstacles_are_parts_of_the_diameter_of_each_disk():
    places, ball = [[1.5, 0.501], [4.0, 1.004], [6.012, 6.0]], Ball((4.0, 6.0), 0.5)
    frame = frame_of(places, (9.0, 9.0), [1.0, 2.0, 3.0], periodic=False)
    network = packing_network(frame, gap=0.01, obstacles=[ball])
    assert network.gaps == pytest.approx([0.001, 0.002, 0.004])
    assert network.bonds[:, 0].tolist() == [0, 1, 2]


def test_obstacles_hold_as_well():
    # Three disks that touch each other fill a round container, wherever in the box it stands.
    angles = np.array([0.3, 0.3 + 2 * np.pi / 3, 0.3 + 4 * np.pi / 3])
    ring = 3.0 + np.stack([np.cos(angles), np.sin(angles)], axis=1) / math.sqrt(3.0)
    container = SphericalContainer((3.0, 3.0), 0.5 + 1.0 / math.sqrt(3.0))
    frame = frame_of(ring, (6.0, 6.0), periodic=False)
    network = packing_network(frame, obstacles=[container])
    assert network.rattlers.size == 0
    # All three can be turned together.
    assert network.contacts == network.isostatic == 3 + 3
    # Two rods on a ring, and a fixed one between them, met across the border by one of the two.
    frame = frame_of([[0.5], [1.5]], (3.0,))
    network = packing_network(frame, obstacles=[Ball((2.5,), 0.5)])
    assert network.bonds.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert network.vectors.ravel().tolist() == [1.0, -0.5, 0.5]
    assert network.rattlers.size == 0
    assert network.contacts == network.isostatic == 2 + 1
    assert packing_network(frame).rattlers.size == 2


def test_a_matrix_of_contacts_replaces_the_diameters():
    species = np.array([0, 1])
    frame = frame_of([[1.0, 1.0], [1.8, 1.0]], (9.0, 9.0), species=species)
    assert packing_network(frame, contact=[[1.0, 0.8], [0.8, 1.0]]).gaps == pytest.approx([0.0], abs=1e-15)
    assert packing_network(frame).gaps == pytest.approx([-0.2])


@pytest.mark.parametrize("ratio", [1.4, 20.0])
def test_near_pairs_of_unequal_disks_are_all_found(ratio):
    """Against every pair one by one, over all images."""
    scene = mixture([10, 40], diameters=[ratio, 1.0], dimension=2, packing_fraction=0.6, seed=2, walls="y")
    frame = frame_of(scene.positions, scene.box, scene.diameters)
    network = packing_network(frame, gap=0.01)
    i, j = np.triu_indices(scene.n, 1)
    images = np.array(list(itertools.product((-1, 0, 1), repeat=2)))[:, None] * scene.box
    lengths = np.linalg.norm(scene.positions[j] - scene.positions[i] + images, axis=2)
    expected = np.sort((lengths / (0.5 * (scene.diameters[i] + scene.diameters[j])) - 1).ravel())
    np.testing.assert_allclose(network.gaps, expected[expected < REACH], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("contacts_apart", [1e-13, 1e-9, 1e-6])
def test_the_gap_is_chosen_in_the_void_between_contacts_and_near_contacts(contacts_apart):
    """A crystal with contacts spread over a decade, and eight smaller disks, no two of them side by side."""
    rng = np.random.default_rng(1)
    frame = crystal(2, 20, apart=0.0)
    sizes = 1.0 - contacts_apart * 10 ** rng.random(frame.n)
    small = np.arange(0, frame.n, frame.n // 8)
    assert np.linalg.norm(np.diff(frame.positions[small], axis=0), axis=1).min() > 2
    sizes[small] = 1.0 - 10.0 ** -rng.uniform(2, 3, 8)
    network = packing_network(frame_of(frame.positions, frame.box, sizes))
    assert 10 * contacts_apart < network.gap < 5e-4
    assert len(network.rattlers) == 8


def test_directions_hold_from_all_sides_or_not():
    three = np.array([[math.cos(a), math.sin(a)] for a in (0.1, 2.2, 4.3)])
    assert is_held(three)
    assert not is_held(three[:2])
    # Opposite ones hold along a line; a third one across still leaves a way out, a fourth does not.
    cross = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    assert not is_held(cross[:3])
    assert is_held(cross)
    assert not is_held(np.abs(three))
    for d in (1, 2, 3, 5):
        simplex = np.vstack([np.eye(d), -np.ones(d) / math.sqrt(d)])
        assert is_held(simplex)
        assert not is_held(simplex[:-1])
        assert not is_held(np.pad(simplex, ((0, 0), (0, 1))))


def compressed(frame: Frame, fractions, pressure) -> Packing:
    """A packing whose last two stretches ended at these packing fractions, the second at this pressure."""
    rows = [(100, fractions[0], 0.5 * pressure, 0.1), (200, fractions[1], pressure, 0.1)]
    return Packing(frame, np.array(rows, dtype=HISTORY), "made up", 0, 0.0)


@pytest.mark.parametrize("n", [2, 3, 7])
@pytest.mark.parametrize("room", [1e-3, 1e-6])
def test_a_few_rods_on_a_ring_jam_where_they_fill_it(n, room):
    # Tonks on a ring: Z = 1 + (n - 1) / n eta / (1 - eta), exactly. The free-volume law lacks a term of order
    # room / n of Z, so that its jamming fraction is 1 - room^2 / (n - 1): with n for n - 1 it would be off by
    # room / n.
    frame = frame_of(np.arange(n)[:, None] + 0.5, (n,), diameters=1 - room)
    pressure = 1 + (n - 1) / n * (1 - room) / room
    rods = compressed(frame, (1 - room, 1 - room), pressure)
    eps = np.finfo(float).eps
    assert rods.jamming_fraction == pytest.approx(1.0, abs=1.1 * room**2 / (n - 1) + 8 * eps)


def test_the_free_volume_law_counts_the_backbone_alone():
    frame = crystal(2, 6)
    sizes = np.ones(frame.n)
    sizes[14] = 0.9
    jamming, middle = 0.9, 0.9 * (1 - 1e-6)
    # Z = d (N_b - 1) / N / (1 - eta / eta_J), eta in the middle of the stretch, with 35 of 36 that hold.
    pressure = 2 * 34 / 36 / 1e-6
    packing = compressed(
        frame_of(frame.positions, frame.box, sizes), (middle - 1e-9, middle + 1e-9), pressure
    )
    assert packing.jamming_fraction == pytest.approx(jamming, rel=1e-9)
    # Too early to tell rattlers: all are taken for the backbone.
    early = compressed(frame_of(frame.positions, frame.box, sizes), (0.8, 0.8), 100.0)
    assert early.jamming_fraction == pytest.approx(0.8 / (1 - 2 * 35 / 36 / 100), rel=1e-12)
    assert math.isnan(compressed(frame, (0.1, 0.1), 1.5).jamming_fraction)


@pytest.mark.parametrize(
    ("ask", "says"),
    [
        *((lambda gap=gap: packing_network(crystal(2, 4), gap=gap), "gap is") for gap in (0.0, -1.0, REACH)),
        (lambda: packing_network(frame_of([[1.0, 1.0], [5.0, 5.0]], (9.0, 9.0))), "no packing"),
        (lambda: plots.packing(packing_network(crystal(4, 2))), "two or three"),
    ],
)
def test_what_is_no_gap_no_packing_or_cannot_be_drawn_is_refused(ask, says):
    with pytest.raises(InputError, match=says):
        ask()


@pytest.mark.parametrize("dimension", [2, 3])
def test_networks_and_gaps_are_drawn(dimension, tmp_path):
    frame = crystal(dimension, 3)
    sizes = np.ones(frame.n)
    sizes[3] = 0.8
    network = packing_network(frame_of(frame.positions, frame.box, sizes))
    figure = plots.packing(network, path=tmp_path / "packing.png")
    lines = [c for c in figure.axes[0].collections if type(c).__name__ == "LineCollection"]
    # From both ends.
    assert max(len(c.get_paths()) for c in lines) == 2 * network.contacts
    dotted = [c for c in figure.axes[0].collections if c.get_linestyle()[0][1] is not None]
    assert any(len(c.get_offsets()) == 1 for c in dotted)
    plots.gaps(network, path=tmp_path / "gaps.png")
    assert (tmp_path / "gaps.png").stat().st_size > 1000


@pytest.mark.parametrize("dimension", [2, 3])
def test_two_spheres_in_a_small_box_touch_each_others_images(dimension):
    # One in the middle and one in the corners: square and body-centered cubic, 2^d images touch. A run ends
    # with a collision, so that one of these gaps is zero.
    places = np.array([np.full(dimension, 0.25), np.full(dimension, 0.75)])
    off = 1e-7 * np.arange(1, dimension + 1)
    places[1] += off
    nearest = math.hypot(*(0.5 - off))
    network = packing_network(frame_of(places, (1.0,) * dimension, diameters=nearest))
    assert network.gaps[0] == pytest.approx(0.0, abs=1e-15)
    assert network.distinct
    assert network.contacts == 2**dimension
    assert network.coordination == 2**dimension
    assert not len(network.rattlers)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_sphere_as_wide_as_the_box_touches_its_own_images(dimension):
    network = packing_network(frame_of(np.full((1, dimension), 0.3), (1.0,) * dimension, diameters=1 - 1e-9))
    assert network.bonds.tolist() == [[0, 0]] * dimension
    np.testing.assert_allclose(np.sort(np.abs(network.vectors).sum(axis=1)), 1.0)
    assert network.coordination == 2 * dimension
    assert network.backbone.all()


def test_contacts_that_are_not_distinct_are_nowhere_counted_as_contacts():
    # Gaps spread evenly over the decades have no void.
    frame = crystal(2, (5, 4))
    sizes = frame.diameters * (1.0 - np.geomspace(1e-5, 0.2, frame.n))
    network = packing_network(frame_of(frame.positions, frame.box, diameters=sizes), gap=0.05)
    assert not network.distinct
    title = plots.packing(network).axes[0].get_title()
    for text in (network.counted, str(network), title, carom.view(network).data["subtitle"]):
        assert "not distinct" in text
        assert "contacts in the backbone" not in text
    told = str(packing_network(frame))
    assert "0 rattlers of 40" in told
    assert "coordination 6.0000" in told
    for one in (network, packing_network(frame)):  # the line that a packing prints
        packing = Packing(one.frame, np.array([], HISTORY), "", 1, 0.0)
        packing.__dict__["network"] = one
        assert one.counted in str(packing)


def test_without_a_backbone_no_contacts_are_distinct():
    # Two disks touch in a wide box: a void follows, but nothing holds them.
    network = packing_network(frame_of([[1.0, 1.0], [2.0, 1.0], [2.0, 2.2]], (9.0, 9.0)), gap=1e-3)
    assert network.contacts == 0
    assert network.separated
    assert not network.distinct
    assert "nothing is held" in network.note


@pytest.mark.parametrize("leading", [3.0, 1.2])
def test_the_law_of_a_compression_is_drawn_through_its_points(leading):
    jammed, pressure = 0.64, np.geomspace(10.0, 1e8, 40)
    history = np.zeros(40, dtype=HISTORY)
    history["Z"] = pressure
    # A pressure is that of a stretch, and obeys the law at its middle; the density is that of its end.
    left = [leading / pressure[0]]
    for z in pressure[1:]:
        left.append(2.0 * leading / z - left[-1])
    history["packing_fraction"] = jammed * (1.0 - np.array(left))
    (dots, law) = plots.compression(history, jammed, 3).axes[0].get_lines()
    x, z = law.get_data()
    np.testing.assert_allclose(x * z, leading, rtol=1e-6)
    np.testing.assert_allclose(np.multiply(*dots.get_data())[1:], leading, rtol=1e-6)
