"""Mixtures: who is what, when pairs touch, and where they are placed."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math

import ase
import numpy as np
import pytest
from helpers.mixtures import mixed, mixture

from carom import Species
from carom.errors import CaromWarning, InputError, OverlapError
from carom.geometry import overlaps
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import Geometry
from carom.models import Ball, Plane, Restitution
from carom.models.interfaces.particles import species_count
from carom.models.obstacles.named_walls import axes_without
from carom.scene import lattices
from carom.scene.conversion import to_frame
from carom.scene.fields import is_equal
from carom.scene.scene import Scene
from carom.scene.species import counts_of
from carom.scene.storage import from_arrays, to_arrays
from carom.scene_file.sections import SceneSpec
from carom.simulation.system_of_scene import prepare

EPS = np.finfo(float).eps


def relative_gaps(scene: Scene) -> np.ndarray:
    """Distance over contact distance (n, n) of all pairs, over all images one box away."""
    box = np.array(scene.box)
    turns = [(-1, 0, 1) if repeats else (0,) for repeats in scene.periodic]
    shifts = np.array(list(itertools.product(*turns))) * box
    separation = scene.positions[None, :, None, :] - scene.positions[:, None, None, :] + shifts
    distance = np.sqrt((separation**2).sum(axis=-1)).min(axis=-1)
    contact = 0.5 * (scene.diameters[:, None] + scene.diameters)
    if scene.contact is not None:
        contact = scene.contact[scene.species[:, None], scene.species]
    result = distance / contact
    np.fill_diagonal(result, np.inf)
    return result


def test_each_component_has_its_diameter_and_mass():
    scene = Scene([[1, 1], [3, 3], [5, 1]], 6, diameter=[1.0, 2.0, 0.5], mass=[1, 8, 3], species=[0, 1, 0])
    assert (scene.diameter, scene.mass, is_equal(scene)) == (2.0, 4.0, False)
    np.testing.assert_array_equal(scene.diameters, [1.0, 2.0, 0.5])
    np.testing.assert_array_equal(scene.masses, [1, 8, 3])
    assert scene.species.dtype == np.int64
    assert species_count(scene) == 2
    assert scene.packing_fraction == pytest.approx(math.pi / 4 * (1 + 4 + 0.25) / 36, rel=4 * EPS)
    for values in (scene.diameters, scene.masses, scene.species):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1


def test_equal_values_one_by_one_are_equal_spheres():
    scene = Scene([[1, 1], [3, 3]], 6, diameter=[0.1, 0.1], mass=[3, 3])
    assert (is_equal(scene), scene.diameter, scene.mass) == (True, 0.1, 3.0)
    assert scene.packing_fraction == Scene([[1, 1], [3, 3]], 6, diameter=0.1).packing_fraction
    assert not is_equal(Scene([[1, 1], [3, 3]], 6, species=[0, 1], contact=[[1, 2], [2, 1]]))


def test_a_scene_cannot_be_changed_but_another_can_be_made_of_it():
    scene = Scene.crystal(cells=2, packing_fraction=0.3)
    with pytest.raises(AttributeError, match="replace"):
        scene.impact = 0.5
    other = scene.replace(impact=0.5, mass=2.0)
    assert (other.impact.restitution, other.mass, scene.impact.restitution) == (0.5, 2.0, 1.0)
    assert other.replace(impact=1.0).impact.elastic_below == 0.0
    with pytest.raises(InputError, match="has no keyword 'speed'"):
        scene.replace(speed=1.0)


TWO = {"positions": [[1, 1], [4, 4]], "box": 6}


def test_elasticity_has_a_threshold_only_where_it_is_lost():
    assert Scene(**TWO).impact.elastic_below == 0.0
    assert Scene(**TWO, impact=0.9).impact.elastic_below is None
    assert Scene(**TWO, impact=Restitution(0.9, elastic_below=0.01)).impact.elastic_below == 0.01


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
@pytest.mark.parametrize("matrix", [False, True])
def test_overlaps_of_unequal_spheres_are_those_of_a_search_over_all_images(dimension, matrix):
    """Ratios to 1 : 20 in small boxes, walled and not; judged alike by brute force."""
    rng = np.random.default_rng(dimension)
    legal = 0
    for trial in range(150):
        n = int(rng.integers(2, 6))
        box = 1.01 + (1.0 if trial % 2 else 3.0) * rng.random(dimension)
        periodic = rng.random(dimension) < 0.5
        species = rng.integers(0, 2, n)
        table = np.array([[1.0, 0.8], [0.8, 0.05]]) if matrix else None
        diameters = np.array([1.0, 0.05])[species] if matrix else 0.05 ** rng.random(n)
        margin = np.where(periodic, 0.0, 0.5)
        positions = margin + rng.random((n, dimension)) * (box - 2 * margin)
        try:
            scene = Scene(
                positions, box, diameter=diameters, species=species, contact=table,
                walls=axes_without(periodic),
            )  # fmt: skip
        except OverlapError as error:
            i, j = (int(word) for word in str(error).split()[1:4:2])
            room = Geometry(box, periodic)
            pair = np.array([[i, j]])
            contacts = Contacts(diameters, species, table)
            assert room.distances(overlaps.wrapped(positions, box), pair) < contacts.of(pair)
            continue
        assert relative_gaps(scene).min() >= 1
        legal += 1
    assert 10 < legal < 140


@pytest.mark.parametrize("fractions", [(0.5, 0.3), (1, 3), (0.5, 0.5, 0.5), (0.99, 0.0)])
def test_fractions_that_do_not_add_up_to_one_are_refused(fractions):
    """They leave particles without a species, or are numbers of something else."""
    species = [Species(fraction=part) for part in fractions]
    for make in (
        lambda: Scene.random(100, 0.1, species=species),
        lambda: Scene.crystal(n=32, lattice="fcc", density=0.1, species=species),
        lambda: SceneSpec(n=100, species=species),
    ):
        with pytest.raises(InputError, match=f"add up to {sum(fractions):g}, and all particles are 1"):
            make()
    assert Scene.random(99, 0.1, species=[Species(fraction=0.333)] * 3).n == 99


def test_counts_follow_fractions_and_lose_nobody():
    assert counts_of([0.25, 0.75], 100) == (25, 75)
    assert counts_of([0.333, 0.333, 0.333], 10) == (4, 3, 3)
    assert counts_of([0, 1], 7) == (0, 7)
    rng = np.random.default_rng(1)
    for _ in range(50):
        shares, n = rng.dirichlet(np.ones(5)), int(rng.integers(1, 1000))
        counts = np.array(counts_of(shares, n))
        assert counts.sum() == n
        lost = np.modf(n * shares / shares.sum())[0]
        rounded = counts - n * shares / shares.sum() + lost  # 1 for those that got one more
        assert set(np.round(rounded, 9)) <= {0.0, 1.0}
        assert lost[rounded < 0.5].max() <= lost[rounded > 0.5].min(initial=1.0)


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_mixtures_are_placed_without_overlap(dimension):
    kinds = [Species("large", count=10, mass=2.0), Species("small", count=40, diameter=0.4)]
    scene = Scene.random(species=kinds, dimension=dimension, seed=0)
    assert relative_gaps(scene).min() >= 1 - 1e-12
    np.testing.assert_array_equal(np.bincount(scene.species), [10, 40])
    np.testing.assert_array_equal(scene.diameters, np.array([1.0, 0.4])[scene.species])
    np.testing.assert_array_equal(scene.masses, np.array([2.0, 1.0])[scene.species])
    assert scene.species_names == ("large", "small")


def test_a_ratio_of_one_to_twenty_is_placed_densely():
    scene = mixture([2, 700], diameters=[20.0, 1.0], dimension=2, packing_fraction=0.65, seed=2)
    assert scene.packing_fraction == pytest.approx(0.65, rel=1e-12)
    assert relative_gaps(scene).min() >= 1


def test_rods_of_two_lengths_fill_a_walled_line():
    scene = mixture([30, 30], diameters=[1.0, 2.0], dimension=1, packing_fraction=0.95, walls=True, seed=0)
    order = np.argsort(scene.positions[:, 0])
    half = 0.5 * scene.diameters[order]
    places = scene.positions[order, 0]
    gaps = places[1:] - places[:-1] - half[1:] - half[:-1]
    assert min(gaps.min(), places[0] - half[0], scene.box[0] - places[-1] - half[-1]) > -1e-12
    assert 5 < (np.diff(scene.diameters[order]) != 0).sum() < 55  # in random order: 29.5 changes in the mean


def test_species_that_touch_from_afar_are_placed_by_their_matrix():
    table = [[1.0, 1.4], [1.4, 1.0]]
    scene = mixture([20, 20], contact=table, dimension=2, packing_fraction=0.3, seed=5)
    assert relative_gaps(scene).min() >= 1


def test_a_lattice_is_filled_in_random_order():
    given = {"packing_fraction": 0.5, "seed": 1}
    species = mixed(fractions=[0.5, 0.5], diameters=[1.0, 0.9])
    scene = Scene.crystal(species=species, lattice="fcc", cells=3, **given)
    assert (scene.n, scene.packing_fraction) == (108, pytest.approx(0.5))
    assert 30 < (np.diff(scene.species) != 0).sum() < 77
    counted = mixed(counts=[54, 54], diameters=[1.0, 0.9])
    same = Scene.crystal(species=counted, lattice=lattices.dn(3), **given)
    np.testing.assert_array_equal(same.positions, scene.positions)
    np.testing.assert_array_equal(same.species, scene.species)


def everything() -> Scene:
    """Return a scene with one of everything."""
    start = mixture(
        [4, 9], names=["a", "b"], diameters=[1.0, 0.3], masses=[1.0, 1 / 3], contact=[[1.0, 0.6], [0.6, 0.3]],
        box=(6.1, 5.3), walls="y", seed=0,
        obstacles=[Ball((0.1, 2.7), 0.4, "pillar"), Plane((0.0, 3.0), 0.3)],
    )  # fmt: skip
    velocities = np.random.default_rng(3).standard_normal(start.positions.shape)
    return start.replace(impact=Restitution(0.9, elastic_below=1e-3), velocities=velocities)


def assert_same(a: Scene, b: Scene) -> None:
    for name in ("positions", "diameters", "masses", "velocities", "species", "contact"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    for name in ("box", "periodic", "walls", "obstacles", "impact", "species_names"):
        assert getattr(a, name) == getattr(b, name)


@pytest.mark.parametrize(
    "scene", [everything(), Scene.crystal(cells=2, packing_fraction=0.3), Scene(**TWO, impact=0.5)]
)
def test_a_scene_becomes_arrays_and_comes_back(scene):
    arrays, attributes = to_arrays(scene)
    assert_same(from_arrays(arrays, json.loads(json.dumps(attributes))), scene)
    assert_same(scene.replace(), scene)


def test_arrays_that_are_no_scene_are_refused():
    arrays, attributes = to_arrays(everything())
    for name in attributes:
        less = {key: value for key, value in attributes.items() if key != name}
        if name not in ("mass", "diameter", "impact"):
            with pytest.raises(InputError, match=f"no scene: '{name}'"):
                from_arrays(arrays, less)
    with pytest.raises(InputError, match="type of an obstacle"):
        from_arrays(arrays, {**attributes, "obstacles": [{"type": "hole"}]})
    with pytest.raises(InputError, match="has 2 obstacles, found 0"):
        from_arrays(arrays, attributes, obstacles=())


def test_a_frame_becomes_a_mixture_between_walls():
    scene = everything()
    frame = dataclasses.replace(to_frame(scene), velocities=scene.velocities)
    again = Scene.from_frame(frame, contact=scene.contact, obstacles=scene.obstacles)
    assert_same(again.replace(impact=Restitution(0.9, elastic_below=1e-3)), scene)


def test_a_frame_of_single_precision_is_moved_off_its_wall():
    positions = np.array([[0.35, 2.0], [5.0, 5.3 - 0.35]])
    scene = Scene(positions, (6.1, 5.3), diameter=0.7, walls=True)
    rounded = positions.astype(np.float32).astype(float)
    assert (rounded[0, 0] < 0.35) or (rounded[1, 1] > 5.3 - 0.35)
    with pytest.warns(CaromWarning, match="inside an obstacle, (x_low|y_high)"):
        moved = Scene.from_frame(dataclasses.replace(to_frame(scene), positions=rounded))
    assert np.abs(moved.positions - positions).max() < 1e-5


def test_atoms_of_two_kinds_become_two_species():
    atoms = ase.Atoms("ArNeAr", positions=[[1, 1, 1], [2.2, 1, 1], [4, 4, 4]], cell=[5, 6, 7], pbc=True)
    atoms.set_array("radius", np.array([0.8, 0.4, 0.8]))
    atoms.set_momenta(np.ones((3, 3)))
    scene = Scene.from_ase(atoms)
    assert scene.species_names == ("Ar", "Ne")
    np.testing.assert_array_equal(scene.species, [0, 1, 0])
    np.testing.assert_array_equal(scene.diameters, [1.6, 0.8, 1.6])
    np.testing.assert_array_equal(scene.masses, atoms.get_masses())
    np.testing.assert_array_equal(scene.velocities, 1 / scene.masses[:, None] + np.zeros((3, 3)))


def far_apart(**arguments):
    """Return a scene of two species of one diameter each, far from each other."""
    places = 10.0 * np.arange(4)[:, None] + np.full(3, 5.0)
    return Scene(places, 50.0, **{"species": [0, 0, 1, 1], **arguments})


def test_distances_of_contact_that_no_double_tells_apart_are_refused():
    small = 0.99 * 2.0**-20
    with pytest.raises(InputError, match=r"touch at 9\.4\S+, and others at 1; expected at least 9\.5e-07 of"):
        far_apart(contact=[[1.0, small], [small, 1.0]])
    with pytest.raises(InputError, match="touch at"):
        far_apart(diameter=[1.0, 1.0, small, small])
    near = 1.01 * 2.0**-20
    assert far_apart(contact=[[1.0, near], [near, 1.0]]).contact[0, 1] == near
    assert far_apart(diameter=[1.0, 1.0, near, near]).n == 4
    # One alone touches none of its kind, nor does a species that is not there.
    assert far_apart(diameter=[1.0, 1.0, 1.0, small]).n == 4
    absent = [[1.0, 1.0, small], [1.0, 1.0, small], [small, small, small]]
    assert far_apart(contact=absent).n == 4


def test_a_small_one_alone_may_touch_all_others_at_a_distance():
    small = 0.99 * 2.0**-20
    contact = [[small, 1.0], [1.0, 1.0]]
    assert far_apart(contact=contact, diameter=[small, 1.0, 1.0, 1.0], species=[0, 1, 1, 1]).n == 4
    with pytest.raises(InputError, match="touch at"):
        far_apart(contact=contact, diameter=[small, small, 1.0, 1.0])


@pytest.mark.parametrize("unlike", [0.3, 0.7, 1.3])
def test_the_reaches_of_a_mixture_are_as_short_as_its_widest_contact_allows(unlike):
    species = np.array([0, 0, 2, 2])  # nobody is of the second, whose contacts are wide
    contact = np.array([[1.0, 9.0, unlike], [9.0, 9.0, 9.0], [unlike, 9.0, 0.4]])
    places = [[1, 1], [4, 1], [1, 4], [4, 4]]
    scene = Scene(places, 8, diameter=[1, 1, 0.4, 0.4], species=species, contact=contact)
    system, touch = prepare(scene, np.ones((4, 2))), contact[np.ix_(species, species)]
    assert system.diameter == touch.max()
    assert system.smallest_contact == touch.min()
    sums = system.reaches[:, None] + system.reaches
    assert (touch / sums).max() == pytest.approx(1.0, rel=2 * EPS)
