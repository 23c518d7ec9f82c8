"""Scene: the one place where input is checked."""

from __future__ import annotations

import dataclasses
import itertools
import math

import ase
import numpy as np
import pytest
from helpers import refits
from helpers.marks import slow
from helpers.mixtures import mixed, mixture
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

from carom import Scene
from carom.errors import CaromWarning, InputError, OverlapError
from carom.frame import Frame
from carom.geometry import overlaps
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import Geometry
from carom.models import Ball, Shear
from carom.scene import placement
from carom.scene.box import LONGEST_EDGE
from carom.scene.conversion import to_frame
from carom.simulation.simulation import Simulation

EPS = np.finfo(float).eps


def frame_of(scene: Scene, **changes: object) -> Frame:
    return dataclasses.replace(to_frame(scene), **changes)


def test_positions_are_wrapped_copied_and_read_only():
    given = np.array([[-0.25, 5.5], [2.0, 9.0]])
    scene = Scene(given, (4.0, 5.0))
    np.testing.assert_array_equal(scene.positions, [[3.75, 0.5], [2.0, 4.0]])
    assert given[0, 0] == -0.25
    with pytest.raises(ValueError, match="read-only"):
        scene.positions[0, 0] = 1.0


def test_a_tiny_negative_coordinate_stays_inside_the_box():
    scene = Scene([[-1e-20, 5.0]], 5.0)
    np.testing.assert_array_equal(scene.positions, [[0.0, 0.0]])


def test_a_scalar_box_is_a_cube_and_properties_follow():
    scene = Scene([[0, 0, 0], [1, 1, 1]], 2, diameter=0.5, mass=3)
    assert scene.box == (2.0, 2.0, 2.0)
    assert (scene.n, scene.dimension, scene.volume, scene.number_density) == (2, 3, 8.0, 0.25)
    assert scene.packing_fraction == pytest.approx(2 * math.pi / 6 * 0.125 / 8, rel=4 * EPS)
    np.testing.assert_array_equal(scene.diameters, [0.5, 0.5])
    np.testing.assert_array_equal(scene.masses, [3, 3])
    assert "n=2" in repr(scene)
    assert "<table>" in scene._repr_html_()


NAN, INF = math.nan, math.inf
TWO = {"positions": [[1, 1], [4, 4]], "box": 6}
BAD = [
    ({"positions": []}, "shape"),
    ({"positions": np.zeros((0, 3))}, "at least one particle"),
    ({"positions": np.zeros((3, 0))}, "at least one particle and one dimension"),
    ({"positions": [[1.0] * 13]}, "dimension must be between 1 and 12, found 13"),
    ({"positions": [0.0, 1.0]}, r"shape \(n, d\)"),
    ({"positions": [[0.0, NAN]]}, r"nan at \[0, 1\]"),
    ({"positions": [[INF, 0.0]]}, r"inf at \[0, 0\]"),
    ({"positions": [[0, 0], [0]]}, "unequal length"),
    ({"positions": [["0", "1"]]}, "strings"),
    ({"positions": "atoms"}, "strings"),
    ({"positions": [[True, 2.0]]}, "booleans"),
    ({"positions": np.ones((1, 2), dtype=bool)}, "booleans"),
    ({"positions": [[1j, 0]]}, "complex"),
    ({"positions": None}, "no numbers"),
    ({"box": 0}, "positive, found 0"),
    ({"box": (5, -1)}, "positive, found -1"),
    ({"box": (5, NAN)}, "finite"),
    ({"box": (5, INF)}, "finite"),
    ({"box": (5, 5, 5)}, "one edge or 2"),
    ({"box": np.eye(2) * 5}, "number"),
    ({"box": [[5], [5, 5]]}, "number"),
    ({"box": "5"}, "reduced units"),
    ({"box": True}, "boolean"),
    ({"box": None}, "found nothing"),
    ({"box": 1.0}, "greater than the diameter"),
    ({"box": 0.9}, "greater than the diameter"),
    ({"box": 2 * LONGEST_EDGE}, "at most 1e"),
    ({"diameter": 0}, "positive"),
    ({"diameter": -1}, "positive"),
    ({"diameter": "1 nm"}, "reduced units"),
    ({"diameter": 1e-200}, "at least 1e-30"),
    ({"mass": 0}, "mass must be positive"),
    ({"mass": NAN}, "finite"),
    ({"mass": 10**400}, "finite"),
    ({"velocities": [[1]]}, "shape of positions"),
    ({"positions": [[0, 0]], "velocities": [[1, NAN]]}, "velocities must be finite"),
    ({"positions": [[0, 0]], "velocities": [[1, 1e200]]}, "at most"),
    ({"diameter": [1.0]}, "one number or 2"),
    ({"diameter": [1.0, 0.0]}, "diameter of component 1 must be positive"),
    ({"diameter": [1.0, math.nan]}, "finite"),
    ({"diameter": [1.0, 6.0]}, "greater than the diameter"),
    ({"diameter": [1e-10, 1.0]}, "at most 1e"),
    ({"mass": [1.0, -1.0]}, "mass of component 1"),
    ({"mass": [[1.0, 1.0]]}, "shape"),
    ({"mass": [1.0, [1.0, 2.0]]}, "mass must be an array"),
    ({"species": [0, [1, 2]]}, "2 integers"),
    ({"species": [0]}, "2 integers"),
    ({"species": [0, -1]}, "found -1"),
    ({"species": [0, 5000]}, "found 5000"),
    ({"species": [0.0, 1.0]}, "float64"),
    ({"species": [True, False]}, "bool"),
    ({"contact": [[1.0]]}, "needs species"),
    ({"contact": [[1.0]], "species": [0, 1]}, "found species 1"),
    ({"contact": [[1, 2], [1.5, 1]], "species": [0, 1]}, "symmetric"),
    ({"contact": [[1, 2], [2, 1.5]], "species": [0, 1]}, r"contact\[1\]\[1\] must be the diameter"),
    ({"contact": [[1, 0], [0, 1]], "species": [0, 1]}, "contact must be positive"),
    ({"contact": [[1, 2]], "species": [0, 1]}, "K x K"),
    ({"species_names": ["a", "b"]}, "need species"),
    ({"species_names": ["a"], "species": [0, 1]}, "Species 1 has no name"),
    ({"species_names": ["a", "a"], "species": [0, 1]}, "differ"),
    ({"species_names": ["a", ""], "species": [0, 1]}, "1 to 40"),
    ({"species_names": "ab", "species": [0, 1]}, "list of names"),
    ({"impact": 0.0}, "greater than 0"),
    ({"impact": 1.5}, "at most 1"),
    ({"impact": True}, "impact must be a value"),
    ({"obstacles": Ball((1, 1), 1)}, "tuple of obstacles"),
    ({"obstacles": [Ball]}, "Obstacle 0 must be"),
    ({"obstacles": [3]}, "Obstacle 0 must be"),
]


@pytest.mark.parametrize(("arguments", "says"), BAD)
def test_bad_input_is_named_in_one_sentence(arguments, says):
    with pytest.raises(InputError, match=says) as caught:
        Scene(**{**TWO, **arguments})
    assert "\n" not in str(caught.value)


anything = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=5),
    st.lists(st.floats() | st.integers() | st.booleans() | st.text(max_size=2), max_size=4),
    st.lists(st.lists(st.floats(-5, 5) | st.booleans(), max_size=3), max_size=4),
    hnp.arrays(
        st.sampled_from(["f8", "f4", "i8", "u1", "?", "c16", "U3", "M8[s]"]),
        hnp.array_shapes(min_dims=0, max_dims=3, max_side=4),
    ),
)


@settings(max_examples=200, deadline=1000)
@given(positions=anything, box=anything | st.just(5.0), diameter=anything | st.just(1.0), velocities=anything)
def test_whatever_is_given_becomes_a_scene_or_an_input_error(positions, box, diameter, velocities):
    try:
        scene = Scene(positions, box, diameter=diameter, velocities=velocities)
    except InputError:
        return
    assert (scene.positions >= 0).all()
    assert (scene.positions < scene.box).all()
    assert min(scene.box) > scene.diameter


@settings(max_examples=200, deadline=1000)
@given(
    positions=hnp.arrays(
        "f8", st.tuples(st.integers(1, 4), st.integers(1, 4)), elements=st.floats(-1e300, 1e300)
    ),
    edge=st.floats(1e-300, 1e300),
    diameter=st.floats(1e-300, 1e300),
)
def test_numbers_of_any_size_become_a_scene_or_an_input_error(positions, edge, diameter):
    try:
        scene = Scene(positions, edge, diameter=diameter)
    except InputError:
        return
    assert 0 < scene.packing_fraction < math.inf
    assert (scene.positions < scene.box).all()


ROW = np.arange(20)[:, None] * [2.0, 0.0] + [0.5, 0.5]
ROW[17] = ROW[3] + [0.0, 0.987]


@pytest.mark.parametrize(
    ("positions", "box", "diameter", "says"),
    [
        (ROW, (40.0, 5.0), 1.0, "spheres 3 and 17 overlap by 0.013 (distance 0.98700, contact 1.0000). Take "
         "smaller diameters (these two touch if the largest is 0.986995, now 1)"),
        ([[1.0, 1.0], [5.0, 5.0], [5.0, 5.7]], 8.0, [1.0, 1.0, 0.5], "spheres 1 and 2 overlap by 0.05 "
         "(distance 0.70000, contact 0.75000). Take smaller diameters (these two touch if the largest is "
         "0.933329, now 1)"),
        ([[0.0, 0.0], [0.9, 0.0], [3.0, 3.0], [3.0, 3.75]], 6.0, 1.0, "spheres 2 and 3 overlap by 0.25"),
        ([[0.25, 2.0], [4.625, 2.0]], 5.0, 1.0, "spheres 0 and 1 overlap by 0.375 (distance 0.6250,"),
    ],
    ids=["equal", "unequal", "of several the deepest", "across the faces"],
)  # fmt: skip
def test_the_error_names_the_pair_the_distance_and_the_depth(positions, box, diameter, says):
    with pytest.raises(OverlapError) as caught:
        Scene(positions, box, diameter=diameter)
    assert str(caught.value).startswith(says)


@pytest.mark.parametrize("unit", [2.0**-70, 2.0**-60, 1.0, 2.0**7, 2.0**60, 2.0**70])
@pytest.mark.parametrize("small", [1.0, 0.5])
def test_contact_is_legal_in_any_unit_and_rounding_is_let_through_but_no_more(unit, small):
    """The bound is ENGINE_OVERLAP of the contact distance and 64 eps |L|."""
    contact = 0.5 * (1.0 + small)
    bound = overlaps.tolerance(np.array([5.0, 5.0]), contact)
    assert overlaps.ENGINE_OVERLAP * contact < bound < 2 * overlaps.ENGINE_OVERLAP * contact
    for part in (0.0, 0.5, 0.9, 1.2, 2.0):
        positions = np.array([[1.0, 1.0], [1.0 + contact - part * bound, 1.0]])
        given = {"box": 5.0 * unit, "diameter": np.array([1.0, small]) * unit}
        if part < 1.0:
            np.testing.assert_array_equal(Scene(positions * unit, **given).positions / unit, positions)
        else:
            with pytest.raises(OverlapError):
                Scene(positions * unit, **given)


def test_contacts_far_from_the_origin_are_legal():
    """Coordinates of 10^8 are spaced by 1.5e-8; touching rods rounded to them must pass."""
    rng = np.random.default_rng(5)
    starts = 1e8 + rng.random(50)[:, None] * 2 + np.arange(50)[:, None] * 5
    positions = np.concatenate([starts, starts + 1.0])
    Scene(positions, 2e8)


def nearest_of_all_images(positions: np.ndarray, box: np.ndarray, tilt: float = 0.0) -> np.ndarray:
    """Distances (n, n) over all images up to two boxes away, along axis 0 of a tilted one five."""
    turns = [range(-2, 3)] * len(box)
    shifts = np.array(list(itertools.product(range(-5, 6) if tilt else turns[0], *turns[1:]))) * box
    if tilt:
        shifts[:, 0] += tilt * shifts[:, 1]
    separation = positions[None, :, None, :] - positions[:, None, None, :] + shifts
    return np.sqrt((separation**2).sum(axis=-1)).min(axis=-1)


@pytest.mark.parametrize(
    ("dimension", "tilted"),
    [(1, 0), (2, 0), (3, 0), (4, 0), (2, 0.5), (3, 0.5), (2, 1.4), (3, 1.4), (4, 0.5)],
)
def test_overlaps_in_small_boxes_are_those_of_a_search_over_all_images(dimension, tilted):
    """Also in those that are tilted by up to so many edges: the nearest along the axes is not the nearest."""
    rng = np.random.default_rng(dimension)
    legal = 0
    for _ in range(150):
        box = 1.01 + 2.5 * rng.random(dimension)
        positions = rng.random((rng.integers(2, 5), dimension)) * box
        tilt = tilted * rng.uniform(-1.0, 1.0) * box[0] / box[1] if tilted else 0.0
        distances = nearest_of_all_images(positions, box, tilt)
        np.fill_diagonal(distances, np.inf)
        closest = distances.min()
        found = overlaps.deepest(
            positions, Geometry(box, np.ones(len(box), bool), tilt=tilt), Contacts(np.ones(len(positions)))
        )
        if closest >= 1:
            assert found is None
            legal += 1
        else:
            assert found is not None
            assert found.distance == pytest.approx(closest, rel=1e-12)
            assert distances[found.i, found.other] == pytest.approx(found.distance, rel=1e-12)
    assert 5 < legal < 145


@pytest.mark.parametrize("tilt", [0.5, -0.3, 1.2])
def test_a_random_start_in_a_small_sheared_box_has_no_overlap(tilt):
    motion, box = Shear(1.0, tilt=tilt), (2.1, 2.3)
    for seed in range(40):
        scene = Scene.random(3, box=box, motion=motion, seed=seed)
        distances = nearest_of_all_images(scene.positions, np.array(box), tilt)
        assert distances[np.triu_indices(3, 1)].min() >= 1.0
    crowd = [[1.614, 0.429], [0.6925, 0.7191]]
    with pytest.raises(OverlapError, match=r"overlap by 0.0339 \(distance 0.96609"):
        Scene(crowd, 2.1, motion=Shear(1.0, tilt=0.5))


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_near_pairs_are_those_of_a_search_over_all_pairs_and_each_is_found_once(dimension):
    """In boxes from half of the distance asked for to ten times as wide, with walls along some axes."""
    rng = np.random.default_rng(dimension)
    for trial in range(60):
        box = (0.5, 4.1, 10.0)[trial % 3] * (1.0 + rng.random(dimension))
        room = Geometry(box, rng.random(dimension) < 0.7)
        places = rng.random((100, dimension)) * box
        places[: 2 * dimension] *= np.repeat([0.0, 1.0 - 2.0**-53], dimension)[:, None]
        every = np.stack(np.triu_indices(100, 1), axis=1)
        expected = every[room.distances(places, every) < 1.0]
        found = np.sort(room.near(places, 1.0), axis=1)
        assert len(expected) > 0
        np.testing.assert_array_equal(found[np.lexsort(found.T[::-1])], expected)


@pytest.mark.parametrize(("size", "depth"), [(1.0, "1"), (0.05, "0.05")])
def test_a_crowd_of_spheres_in_one_place_is_refused_quickly(size, depth):
    diameters = np.full(200_000, size)
    diameters[0] = 1.0
    with pytest.raises(OverlapError, match=f"overlap by {depth} "):
        Scene(np.full((200_000, 3), 1.5), 100.0, diameter=diameters)


@pytest.mark.parametrize("masses_given", [True, False])
def test_atoms_with_momenta_masses_and_radii_become_a_scene(masses_given):
    atoms = ase.Atoms("Ar3", positions=[[0, 0, 0], [2, 0, 0], [-1.5, 3, 0]], cell=[5, 6, 7], pbc=True)
    if masses_given:
        atoms.set_masses([2.0, 2.0, 2.0])
    atoms.set_momenta([[1, 2, 3], [4, 5, 6], [7, 8, 9]])
    atoms.set_array("radius", np.full(3, 0.25))
    scene = Scene.from_ase(atoms)
    assert scene.box == (5.0, 6.0, 7.0)
    assert scene.diameter == 0.5
    assert scene.mass == (2.0 if masses_given else atoms.get_masses()[0])
    np.testing.assert_array_equal(scene.velocities, atoms.get_momenta() / scene.mass)
    np.testing.assert_array_equal(scene.positions[2], [3.5, 3, 0])


@pytest.mark.parametrize("kept", [(0, 1), (0, 2), (1, 2), (0,), (1,), (2,)])
def test_atoms_in_any_plane_or_on_any_line_become_disks_or_rods(kept):
    flags = np.isin(range(3), kept)
    places, momenta = np.array([[1, 2, 3], [1, 2, 3]]), np.array([[1, 2, 3], [4, 5, 6]])
    places[1, kept[-1]] += 2
    atoms = ase.Atoms("X2", positions=places, cell=[5, 6, 7] * flags, pbc=flags)
    with pytest.warns(CaromWarning, match="diameter of 1 was assumed"):
        scene = Scene.from_ase(atoms)
    assert scene.box == tuple(np.array([5.0, 6.0, 7.0])[flags])
    assert (scene.diameter, scene.mass, scene.velocities) == (1.0, 1.0, None)
    np.testing.assert_array_equal(scene.positions, places[:, flags])
    atoms.set_masses([2.0, 4.0])
    atoms.set_momenta(momenta)
    scene = Scene.from_ase(atoms, diameter=0.5)
    assert scene.diameter == 0.5
    np.testing.assert_array_equal(scene.velocities, momenta[:, flags] / [[2.0], [4.0]])


def atoms_with(**changes: object) -> ase.Atoms:
    base = {"symbols": "Ar2", "positions": [[0, 0, 0], [2, 0, 1]], "cell": [5, 6, 7], "pbc": True}
    return ase.Atoms(**{**base, **changes})


@pytest.mark.parametrize(
    ("atoms", "says"),
    [
        (atoms_with(pbc=False), "no periodic axis"),
        (atoms_with(pbc=[True, True, False]), "differ along z"),
        (atoms_with(cell=[[5, 0, 0], [1, 6, 0], [0, 0, 7]]), "right angles"),
        (atoms_with(cell=None), "positive, found 0"),
        (ase.Atoms(cell=[5, 5, 5], pbc=True), "at least one particle"),
        ([[0, 0, 0]], "must be an ase.Atoms"),
    ],
)
def test_atoms_that_are_no_scene_are_refused(atoms, says):
    with pytest.raises(InputError, match=says):
        Scene.from_ase(atoms, diameter=1.0)


def test_radii_and_a_diameter_contradict_each_other():
    atoms = atoms_with()
    atoms.set_array("radius", np.full(2, 0.5))
    with pytest.raises(InputError, match="leave one of them out"):
        Scene.from_ase(atoms, diameter=1.0)


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_a_frame_becomes_a_scene_bit_for_bit(dimension):
    scene = Scene.random(20, dimension=dimension, diameter=0.7, mass=2.0, seed=1)
    velocities = np.random.default_rng(0).standard_normal(scene.positions.shape)
    again = Scene.from_frame(frame_of(scene, velocities=velocities))
    np.testing.assert_array_equal(again.positions, scene.positions)
    np.testing.assert_array_equal(again.velocities, velocities)
    assert (again.box, again.diameter, again.mass) == (scene.box, 0.7, 2.0)


def test_the_frame_of_a_scene_is_that_of_its_simulation_at_the_start(unscheduled):
    tilted = Scene.random(6, box=(5.0, 4.0), motion=Shear(0.5, tilt=1.5), seed=1)
    tilted = tilted.replace(velocities=np.ones((6, 2)))
    for scene in (tilted, *(make(1.0)[0] for make in refits.ROWS.values())):
        found, begun = to_frame(scene), Simulation(scene).frame()
        for name in {*vars(found)} - ({"images"} if scene.spins is not None else {"images", "spins"}):
            np.testing.assert_array_equal(getattr(found, name), getattr(begun, name), err_msg=name)


def test_a_frame_without_a_mass_for_each_is_refused():
    scene = Scene.crystal(cells=2, density=0.5)
    with pytest.raises(InputError, match="masses must hold one value"):
        Scene.from_frame(frame_of(scene, masses=np.ones(3)))


def test_a_frame_of_single_precision_is_moved_apart_with_a_warning():
    """Forty touching pairs in random directions, three diameters apart; rounded, about half overlap."""
    rng = np.random.default_rng(2)
    angles = rng.random(40) * 2 * math.pi
    first = np.stack([1.5 + 3.0 * np.arange(40), np.full(40, 4.0)], axis=1)
    start = np.concatenate([first, first + np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    exact = Scene(start, (121.0, 8.0))
    assert Scene.from_frame(frame_of(exact)).n == 80
    rounded = start.astype(np.float32).astype(float)
    with pytest.raises(OverlapError):
        Scene(rounded, exact.box)
    with pytest.warns(CaromWarning, match="single precision"):
        moved = Scene.from_frame(frame_of(exact, positions=rounded))
    # Each of a pair moves by half of what is missing to the clearance, twice the bound.
    bound = overlaps.rounding(np.array(exact.box), np.finfo(np.float32).eps)
    assert 0 < np.abs(moved.positions - start).max() < 2 * bound
    assert bound < 1e-4
    with pytest.raises(OverlapError):
        Scene.from_frame(frame_of(exact, positions=start * (1 - 1e-4)))


@pytest.mark.parametrize("many", [1, placement.MANY])
def test_pinned_ones_stay_where_a_frame_of_single_precision_has_them(plain, monkeypatch, many):
    """The first reaches into a wall and into the second; the fourth touches the third, but for rounding."""
    monkeypatch.setattr(placement, "MANY", many)
    start = np.array([[0.2, 1.0], [0.6, 1.0], [3.0, 1.0], [4.0 - 4e-8, 1.0]])
    exact = Scene(np.round(start, 6), (6.0, 3.0), walls="x", pinned=[0, 1, 2])
    with pytest.warns(CaromWarning, match="spheres 2 and 3 overlap"):
        moved = Scene.from_frame(frame_of(exact, positions=start), pinned=[0, 1, 2])
    np.testing.assert_array_equal(moved.positions[:3], start[:3])
    assert 0.0 < moved.positions[3, 0] - start[3, 0] < 1e-4


@pytest.mark.parametrize(
    ("n", "dimension", "fraction"), [slow(300, 2, 0.79), (300, 3, 0.6), slow(100, 4, 0.43)]
)
def test_dense_random_scenes_are_grown(n, dimension, fraction):
    scene = Scene.random(n, fraction, dimension, seed=1)
    assert scene.packing_fraction == pytest.approx(fraction, rel=1e-12)
    again = Scene.random(n, fraction, dimension, seed=1)
    assert (again.positions == scene.positions).all()
    other = Scene.random(n, fraction, dimension, seed=2)
    assert (other.positions != scene.positions).any()
    assert scene.velocities is None


@pytest.mark.slow
def test_dense_random_mixtures_between_walls_are_grown():
    scene = mixture(
        [150, 150], diameters=[1.0, 0.5], masses=[1.0, 0.1], packing_fraction=0.56, walls=True, seed=1
    )
    assert scene.packing_fraction == pytest.approx(0.56, rel=1e-12)
    assert sorted(set(scene.diameters.tolist())) == [0.5, 1.0]
    assert sorted(set(scene.masses.tolist())) == [0.1, 1.0]


@pytest.mark.slow
def test_spheres_that_jam_on_the_way_are_refused():
    with pytest.raises(InputError, match="jam at packing fraction"):
        Scene.random(100, 0.605, walls=True, seed=1)


def test_positions_put_in_order_are_the_same_of_each_kind():
    from carom.scene import placement

    rng = np.random.default_rng(1)
    positions, kinds = rng.random((500, 3)), rng.integers(0, 3, 500)
    ordered = placement.ordered(positions, np.ones(3), kinds)
    for kind in range(3):
        before, after = positions[kinds == kind], ordered[kinds == kind]
        assert (np.unique(before, axis=0) == np.unique(after, axis=0)).all()
    apart = np.linalg.norm(np.diff(ordered[kinds == 0], axis=0), axis=1).mean()
    assert apart < 0.7 * np.linalg.norm(np.diff(positions[kinds == 0], axis=0), axis=1).mean()


def test_neighbors_in_a_large_random_scene_are_neighbors_in_memory():
    from carom.scene import placement

    counts = [placement.MANY // 2] * 2
    scene = Scene.random(
        species=mixed(counts=counts, diameters=[1.0, 1.0], masses=[1.0, 2.0]), packing_fraction=0.1, seed=1
    )
    edge = scene.box[0]
    for kind in range(2):
        places = scene.positions[scene.species == kind]
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        # Most steps are of the size of a cell of eight, far below a random one (0.66 edges).
        assert np.median(steps) < 2.0 * edge * (8.0 / scene.n) ** (1.0 / 3.0)
        # Each kind is everywhere: its mean place is the middle, to 5 standard errors.
        assert np.abs(places.mean(axis=0) / edge - 0.5).max() < 5.0 * (12.0 * len(places)) ** -0.5
