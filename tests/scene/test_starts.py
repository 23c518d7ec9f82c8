"""Ways to begin: any number of spheres at any density up to near jamming, lattices, and clear refusals."""

import numpy as np
import pytest
from helpers.marks import slow
from scipy.spatial import cKDTree

import carom
from carom.errors import InputError
from carom.geometry import overlaps
from carom.geometry.contacts import Contacts
from carom.models.motions.gravity import Gravity
from carom.scene import starts


@pytest.mark.parametrize("n", [1, 10, 137, 1000])
@pytest.mark.parametrize(
    ("d", "fractions"), [(1, (0.1, 0.9)), (2, (0.05, 0.5)), slow(2, (0.8,)), (3, (0.01, 0.3, 0.6))]
)
def test_any_number_of_spheres_begins_at_random_up_to_near_jamming(n, d, fractions):
    for eta in fractions:
        if n <= 10 and eta > (0.5 if n == 1 else 0.7 if d == 2 else 0.5) and d > 1:
            continue  # few spheres jam in their small box
        scene = carom.Scene.random(n, eta, d, seed=1)
        assert scene.n == n
        assert scene.packing_fraction == pytest.approx(eta, rel=1e-12)
        room = overlaps.Geometry(np.asarray(scene.box), np.asarray(scene.periodic), ())
        assert overlaps.deepest(scene.positions, room, Contacts(scene.diameters)) is None


@pytest.mark.parametrize(("d", "eta"), [(4, 0.23), (5, 0.155), (6, 0.1)])
def test_half_of_close_packing_begins_at_random_in_many_dimensions(d, eta):
    assert carom.Scene.random(100, eta, d, seed=1).packing_fraction == pytest.approx(eta)


@pytest.mark.parametrize(
    "make",
    [
        lambda: starts._first_that_does_not_jam(lambda: (None, 0.4), 0.61, 5),
        slow(lambda: carom.Scene.random(5, 0.61, seed=1)),
    ],
)
def test_what_jams_says_how_dense_it_became_and_how_to_go_on(make):
    with pytest.raises(InputError, match=r"jam at packing fraction 0\.4.*of 40 random starts.*carom\.pack"):
        make()


def test_a_crystal_has_the_number_of_spheres_or_names_those_that_fill_one():
    assert carom.Scene.crystal(500, 0.6).n == 500
    with pytest.raises(
        InputError, match=r"take n = 864 or 1372 \(nearest=True does, as an option --nearest\), or give cells"
    ):
        carom.Scene.crystal(1000, 0.6)
    for n, taken in ((1000, 864), (1200, 1372), (3, 4)):  # none is smaller than 4
        with pytest.warns(carom.CaromWarning, match=f"^{taken} particles were placed.* n = {n} "):
            assert carom.Scene.crystal(n, 0.6, nearest=True).n == taken
    assert carom.Scene.crystal(500, 0.6, nearest=True).n == 500
    assert carom.Scene.crystal(cells=(2, 3, 4), packing_fraction=0.6).n == 96
    assert carom.Scene.crystal(100, 0.6, 2, lattice="cubic").n == 100
    with pytest.raises(InputError, match="n is 5, and these cells have 32 places"):
        carom.Scene.crystal(5, 0.6, cells=2)
    with pytest.raises(InputError, match="needs n, or cells"):
        carom.Scene.crystal(packing_fraction=0.6)


def test_every_keyword_of_a_scene_goes_with_every_start():
    given = {"walls": "z", "impact": 0.9, "motion": Gravity((0, 0, -1))}
    for scene in (carom.Scene.random(32, 0.2, **given), carom.Scene.crystal(32, 0.2, **given)):
        assert scene.impact.restitution == 0.9
        assert scene.motion == Gravity((0, 0, -1))
        assert scene.periodic == (True, True, False)
    assert carom.Scene.random(32, 0.2, pinned=[3]).pinned.nonzero()[0].tolist() == [3]


def test_species_are_a_list_of_species():
    large, small = carom.Species("large", fraction=0.25), carom.Species("small", fraction=0.75, diameter=0.5)
    for scene in (
        carom.Scene.random(32, 0.2, species=[large, small]),
        carom.Scene.crystal(32, 0.2, species=[large, small]),
    ):
        assert np.bincount(scene.species).tolist() == [8, 24]
        assert scene.species_names == ("large", "small")
        assert scene.packing_fraction == pytest.approx(0.2)
    assert carom.Scene.random(species=[carom.Species(count=3), carom.Species(count=4)]).n == 7
    with pytest.raises(InputError, match="each species a fraction, or each a count"):
        carom.Scene.random(9, species=[carom.Species(count=3), small])
    with pytest.raises(InputError, match="list of Species, found 1"):
        carom.Scene.random(9, species=[1, 2])
    with pytest.raises(InputError, match="diameter of species small"):
        carom.Species("small", diameter=-1)


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("eta", "it is called packing_fraction"),
        ("phi", "it is called packing_fraction"),
        ("packing_fracton", "did you mean packing_fraction"),
        ("rho", "it is called density"),
        ("dim", "it is called dimension"),
        ("ndim", "it is called dimension"),
        ("num_particles", "it is called n"),
        ("sed", "did you mean seed"),
        ("wals", "did you mean walls"),
        ("interactoin", "did you mean interaction"),
        ("temperature", "kT is a keyword of carom.Simulation"),
        ("lattic", "did you mean lattice"),
        ("radius", "it is called diameter, twice the radius"),
        ("natoms", "it is called n"),
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
@pytest.mark.parametrize("make", [carom.Scene.random, carom.Scene.crystal])
def test_a_wrong_keyword_of_a_start_is_answered_by_the_one_that_is_meant(make, wrong, right):
    if (make, wrong) == (carom.Scene.crystal, "zzz"):
        right = "known: cells"
    with pytest.raises(InputError, match=f"no keyword '{wrong}'.*{right}"):
        make(32, **{wrong: 0.3})


@pytest.mark.parametrize(
    "change", [carom.Scene([[1.0]], [3.0]).replace, lambda **k: carom.Scene([[1.0]], [3.0], **k)]
)
def test_a_keyword_of_a_start_is_told_from_one_of_a_scene(change):
    with pytest.raises(InputError, match=r"'eta'; packing_fraction is a keyword of Scene\.random"):
        change(eta=0.3)
    with pytest.raises(InputError, match="'velocites'; did you mean velocities"):
        change(velocites=0.3)


def test_a_random_start_has_far_more_near_contacts_than_the_fluid():
    """Its docstring says so: such a start is to be equilibrated before anything is measured."""
    scene, near = carom.Scene.random(500, 0.3), 1.02
    pairs = cKDTree(scene.positions % scene.box, boxsize=scene.box).count_neighbors
    found = (pairs(cKDTree(scene.positions % scene.box, boxsize=scene.box), near) - scene.n) / 2
    shell = carom.theory.ball_volume(3, 2 * near) - carom.theory.ball_volume(3, 2.0)
    contact = (carom.theory.carnahan_starling(0.3) - 1) / (4 * 0.3)  # g(1+), from the virial
    assert found > 3 * 0.5 * scene.n**2 / np.prod(scene.box) * shell * contact
