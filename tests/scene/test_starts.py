"""Ways to begin: any number of spheres at any density up to near jamming, lattices, and clear refusals."""

import math

import numpy as np
import pytest
from helpers.marks import slow
from scipy.spatial import cKDTree

import carom
from carom import Scene, Species
from carom.errors import InputError
from carom.geometry import overlaps
from carom.geometry.contacts import Contacts
from carom.models import Gravity
from carom.scene import starts


@pytest.mark.parametrize("n", [1, 10, 137, 1000])
@pytest.mark.parametrize(
    ("d", "fractions"), [(1, (0.1, 0.9)), (2, (0.05, 0.5)), slow(2, (0.8,)), (3, (0.01, 0.3, 0.6))]
)
def test_any_number_of_spheres_begins_at_random_up_to_near_jamming(n, d, fractions):
    for eta in fractions:
        if n <= 10 and eta > (0.5 if n == 1 else 0.7 if d == 2 else 0.5) and d > 1:
            continue  # few spheres jam in their small box
        scene = Scene.random(n, eta, d, seed=1)
        assert scene.n == n
        assert scene.packing_fraction == pytest.approx(eta, rel=1e-12)
        room = overlaps.Geometry(np.asarray(scene.box), np.asarray(scene.periodic), ())
        assert overlaps.deepest(scene.positions, room, Contacts(scene.diameters)) is None


@pytest.mark.parametrize(("d", "eta"), [(4, 0.23), (5, 0.155), (6, 0.1)])
def test_half_of_close_packing_begins_at_random_in_many_dimensions(d, eta):
    assert Scene.random(100, eta, d, seed=1).packing_fraction == pytest.approx(eta)


@pytest.mark.parametrize(
    "make",
    [
        lambda: starts._first_that_does_not_jam(lambda: (None, 0.4), 0.61, 5),
        slow(lambda: Scene.random(5, 0.61, seed=1)),
    ],
)
def test_what_jams_says_how_dense_it_became_and_how_to_go_on(make):
    with pytest.raises(InputError, match=r"jam at packing fraction 0\.4.*of 40 random starts.*carom\.pack"):
        make()


def test_a_crystal_has_the_number_of_spheres_or_the_nearest_that_fills_one():
    assert Scene.crystal(500, 0.6).n == 500
    for n, taken in ((1000, 864), (1200, 1372), (3, 4)):  # none is smaller than 4
        with pytest.warns(carom.CaromWarning, match=f"^{taken} particles were placed.* n = {n} "):
            assert Scene.crystal(n, 0.6, nearest=True).n == taken
    assert Scene.crystal(500, 0.6, nearest=True).n == 500
    assert Scene.crystal(cells=(2, 3, 4), packing_fraction=0.6).n == 96
    assert Scene.crystal(100, 0.6, 2, lattice="cubic").n == 100


def test_every_keyword_of_a_scene_goes_with_every_start():
    given = {"walls": "z", "impact": 0.9, "motion": Gravity((0, 0, -1))}
    for scene in (Scene.random(32, 0.2, **given), Scene.crystal(32, 0.2, **given)):
        assert scene.impact.restitution == 0.9
        assert scene.motion == Gravity((0, 0, -1))
        assert scene.periodic == (True, True, False)
    assert Scene.random(32, 0.2, pinned=[3]).pinned.nonzero()[0].tolist() == [3]


def test_species_are_a_list_of_species():
    large, small = Species("large", fraction=0.25), Species("small", fraction=0.75, diameter=0.5)
    for scene in (
        Scene.random(32, 0.2, species=[large, small]),
        Scene.crystal(32, 0.2, species=[large, small]),
    ):
        assert np.bincount(scene.species).tolist() == [8, 24]
        assert scene.species_names == ("large", "small")
        assert scene.packing_fraction == pytest.approx(0.2)
    for names in ((None, None), ("a", None), (None, "b")):
        scene = Scene.random(species=[Species(name, count=3 + k) for k, name in enumerate(names)])
        assert scene.n == 7
        told = tuple(name or str(k) for k, name in enumerate(names))
        assert scene.species_names == (told if any(names) else ())


ONE, HALF = Species(count=5), Species(count=5, diameter=0.5)
MIXED = {"species": [ONE, HALF]}
BAD = {
    Scene.random: [
        ({"n": 0}, "n must be"),
        ({"n": 10, "packing_fraction": 0.7}, "Start from a lattice"),
        ({"n": 10, "packing_fraction": 0.75}, "0.740480"),
        ({"n": 10, "packing_fraction": 1.0, "dimension": 1}, "Start from a lattice"),
        ({"n": 10, "box": [4, 4, 4], "density": 0.1}, "found both"),
        ({"n": 10, "dimension": 2, "box": [4, 4, 4]}, "one edge or 2"),
        ({"n": 10, "box": "4"}, "reduced units"),
        ({"n": 10, "seed": -1}, "seed"),
        ({"n": 10, "seed": 1.5}, "seed"),
        ({"n": 10, "seed": None}, "seed"),
        ({"n": 1, "packing_fraction": 0.53}, "own image"),
        ({"species": [Species()]}, "each species a fraction, or each a count"),
        ({"species": [Species(count=1, fraction=1)]}, "each species a fraction, or each a count"),
        ({"species": [ONE, Species(fraction=1)]}, "each species a fraction, or each a count"),
        ({"species": []}, "each species a fraction, or each a count"),
        ({"species": [Species(fraction=1)] * 2}, "n must be an integer"),
        ({"species": [Species(fraction=0)] * 2, "n": 5}, "not all of them zero"),
        (MIXED | {"n": 12}, "add up to 10"),
        ({"species": [Species(count=0)] * 2}, "at least one component"),
        ({"species": 2.0}, "species must be a list"),
        ({"species": [1, 2]}, "list of Species, found 1"),
        ({"species": [Species("a", count=5)] * 2}, "must differ"),
        (MIXED | {"packing_fraction": 0.7}, "up to packing fraction 0.614 in 3 dimensions, found 0.7. Start"),
        (MIXED | {"packing_fraction": 0.3, "box": 5.0}, "found both"),
    ],
    Scene.crystal: [
        ({"cells": 4}, "exactly one of packing_fraction and density, found neither"),
        ({"cells": 4, "packing_fraction": 0.4, "density": 0.8}, "found both"),
        ({"cells": 4, "density": 1.5}, "0.740480"),
        ({"cells": 4, "lattice": "cubic", "packing_fraction": 0.6}, "cubic lattice .* 0.523599"),
        ({"cells": 4, "packing_fraction": 0.0}, "greater than 0"),
        ({"cells": 4, "packing_fraction": -0.1}, "greater than 0"),
        ({"cells": 4, "packing_fraction": math.nan}, "finite"),
        ({"cells": 4, "packing_fraction": "0.4"}, "string"),
        ({"cells": 4, "packing_fraction": True}, "boolean"),
        ({"cells": 4, "density": 1e-300}, "at most 1e"),
        ({"cells": 4, "density": 5e-324}, "finite"),
        ({"cells": 0, "packing_fraction": 0.4}, "at least|between"),
        ({"cells": 2.5, "packing_fraction": 0.4}, "integer"),
        ({"cells": (4, 4), "packing_fraction": 0.4}, "3 of them"),
        ({"cells": "444", "packing_fraction": 0.4}, "integer"),
        ({"cells": 10**6, "packing_fraction": 0.4}, "at most 100000000 components"),
        ({"cells": 2, "lattice": "dn", "dimension": 2, "density": 0.4}, "dn .dimension 3 and up"),
        ({"cells": 2, "lattice": "cubic", "dimension": 40, "density": 0.4}, "must be between 1"),
        ({"n": 1000, "packing_fraction": 0.6}, "take n = 864 or 1372 .nearest=True does, .* or give cells"),
        ({"n": 5, "packing_fraction": 0.6, "cells": 2}, "n is 5, and these cells have 32 places"),
        ({"packing_fraction": 0.6}, "needs n, or cells"),
        (MIXED | {"lattice": "bcc"}, "lattice must be"),
        (MIXED | {"lattice": ["fcc"]}, "lattice must be"),
        (MIXED | {"packing_fraction": 0.3}, "does not fill"),
        (MIXED | {"lattice": "cubic", "cells": 2, "packing_fraction": 0.3}, "add up to 10, but n is 8"),
        (MIXED | {"lattice": "cubic", "cells": 2, "box": 5.0}, "no keyword 'box'"),
    ],
    Species: [
        ({"fraction": -1}, "fraction of a Species"),
        ({"count": -1}, "count of a Species must be at least 0"),
        ({"count": 1.5}, "count of a Species"),
        ({"name": "a", "mass": 0}, "mass of species a"),
        ({"name": "small", "diameter": -1}, "diameter of species small must be positive"),
        ({"name": 2.0}, "name of a Species must be a string"),
    ],
}


@pytest.mark.parametrize(
    ("make", "given", "says"), [(make, *row) for make, rows in BAD.items() for row in rows]
)
def test_a_start_that_cannot_be_is_refused_in_one_sentence(make, given, says):
    with pytest.raises(InputError, match=says) as caught:
        make(**given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("eta", "it is called packing_fraction"),
        ("packing_fracton", "did you mean packing_fraction"),
        ("rho", "it is called density"),
        ("dim", "it is called dimension"),
        ("temperature", "kT is a keyword of carom.Simulation"),
        ("lattic", "did you mean lattice"),
        ("radius", "it is called diameter, twice the radius"),
        ("N_particles", "it is called n"),
        ("pbc", "axes without walls are periodic"),
        ("cell", "box|did you mean cells"),
        ("momenta", "velocities"),
        ("symbols", "it is called species"),
        ("elasticity", "it is called impact: impact=0.9"),
        ("pressure", "barostat is a keyword of carom.Simulation"),
        ("kt", "kT is a keyword of carom.Simulation"),
        ("timestep", "there is none, as events are computed"),
        ("ensemble", "a drive keeps a temperature"),
        ("zzz", "known: box"),
    ],
)
@pytest.mark.parametrize("make", [Scene.random, Scene.crystal])
def test_a_wrong_keyword_of_a_start_is_answered_by_the_one_that_is_meant(make, wrong, right):
    if (make, wrong) == (Scene.crystal, "zzz"):
        right = "known: cells"
    with pytest.raises(InputError, match=f"no keyword '{wrong}'.*{right}"):
        make(32, **{wrong: 0.3})


@pytest.mark.parametrize("change", [Scene([[1.0]], [3.0]).replace, lambda **k: Scene([[1.0]], [3.0], **k)])
def test_a_keyword_of_a_start_is_told_from_one_of_a_scene(change):
    with pytest.raises(InputError, match=r"'eta'; packing_fraction is a keyword of Scene\.random"):
        change(eta=0.3)
    with pytest.raises(InputError, match="'velocites'; did you mean velocities"):
        change(velocites=0.3)


def test_a_random_start_has_far_more_near_contacts_than_the_fluid():
    """Its docstring says so: such a start is to be equilibrated before anything is measured."""
    scene, near = Scene.random(500, 0.3), 1.02
    pairs = cKDTree(scene.positions % scene.box, boxsize=scene.box).count_neighbors
    found = (pairs(cKDTree(scene.positions % scene.box, boxsize=scene.box), near) - scene.n) / 2
    shell = carom.theory.ball_volume(3, 2 * near) - carom.theory.ball_volume(3, 2.0)
    contact = (carom.theory.carnahan_starling(0.3) - 1) / (4 * 0.3)  # g(1+), from the virial
    assert found > 3 * 0.5 * scene.n**2 / np.prod(scene.box) * shell * contact
