"""Scene files of mixtures, walls and obstacles: the same words as in Python, and back again."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.frames import at_rest, write

from carom.errors import InputError
from carom.models import Ball, Plane, Restitution
from carom.scene.scene import Scene
from carom.scene.species import Species
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import SceneSpec

EVERYTHING = """
[scene]
n = 40
dimension = 2
box = [9.0, 8]
walls = "y"
impact = { restitution = 0.9, elastic_below = 0.01 }
contact = [[1.0, 0.7], [0.7, 0.5]]
species.large = { fraction = 0.25, diameter = 1.0, mass = 8.0 }
species.small = { fraction = 0.75, diameter = 0.5 }

[scene.obstacles.pillar]
type = "ball"
center = [4.5, 4]
radius = 1.5

[scene.obstacles.plane]
type = "plane"
normal = [0, 2]
offset = 1.0

[run]
kT = 2.0
seed = 3
"""


def test_a_scene_file_says_what_python_says():
    plan = SceneFile.from_toml(EVERYTHING)
    scene = plan.build_scene()
    assert scene.species_names == ("large", "small")
    np.testing.assert_array_equal(np.bincount(scene.species), [10, 30])
    np.testing.assert_array_equal(scene.masses, np.array([8.0, 1.0])[scene.species])
    assert scene.periodic == (True, False)
    assert scene.obstacles == (Ball((4.5, 4.0), 1.5, "pillar"), Plane((0.0, 2.0), 1.0))
    assert (scene.impact.restitution, scene.impact.elastic_below) == (0.9, 0.01)
    np.testing.assert_array_equal(scene.contact, [[1.0, 0.7], [0.7, 0.5]])
    large, small = Species("large", fraction=0.25, mass=8.0), {"fraction": 0.75, "diameter": 0.5}
    in_python = SceneSpec(
        n=40, dimension=2, box=(9.0, 8.0), walls="y", impact=Restitution(0.9, elastic_below=0.01),
        contact=((1.0, 0.7), (0.7, 0.5)), species=(large, {"name": "small", **small}),
        obstacles=(Ball((4.5, 4.0), 1.5, "pillar"), Plane((0, 2), 1)),
    )  # fmt: skip
    assert in_python == plan.scene


@pytest.mark.parametrize(
    "text",
    [
        EVERYTHING,
        "[scene]\nlattice = 'fcc'\ncells = 2\npacking_fraction = 0.3\nwalls = true",
        "[scene]\nlattice = 'fcc'\npacking_fraction = 0.3\n"
        "species = {a = {count = 30}, 'b c' = {count = 2, mass = 3}}",
        "[scene]\nlattice = 'cubic'\ncells = 3\ndensity = 0.3\n"
        "species = {a = {fraction = 0.25}, b = {fraction = 0.75}}",
        "[scene]\nn = 5\nimpact = 0.5",
        "[scene]\nn = 5\npacking_fraction = 0.1\n"
        "walls.z_low = { impact = 0.8, shake = { amplitude = 0.1, period = 1 } }",
    ],
)
def test_a_plan_comes_back_from_its_own_toml(text):
    plan = SceneFile.from_toml(text)
    again = SceneFile.from_toml(plan.to_toml())
    assert again == plan
    np.testing.assert_array_equal(again.build_scene().positions, plan.build_scene().positions)


def test_species_and_obstacles_without_names_of_their_own_come_back_as_they_were():
    bare = (Species(fraction=0.25), Species("1-", fraction=0.5, diameter=0.5), Species(fraction=0.25))
    twice = (Ball((1.0, 1.0), 0.3), Ball((4.0, 4.0), 0.4), Ball((6.0, 1.0), 0.4, "a.b"))
    plan = SceneFile(SceneSpec(n=20, box=(8.0, 8.0), species=bare, obstacles=twice))
    text = plan.to_toml()
    assert 'species."0" = ' in text
    assert "[scene.obstacles.ball-1]" in text
    again = SceneFile.from_toml(text)
    assert again == plan
    assert [each.name for each in again.scene.species] == [None, "1-", None]
    assert [each.name for each in again.scene.obstacles] == ["ball", "ball", "a.b"]


def test_all_axes_periodic_is_the_default_however_it_is_said():
    base = "[scene]\nn = 32\npacking_fraction = 0.3\n"
    for said in ("walls = false", 'walls = ""', "walls = []", "impact = 1.0"):
        assert SceneFile.from_toml(base + said) == SceneFile.from_toml(base)


def test_what_a_trajectory_does_not_hold_can_be_added_to_its_frame(tmp_path):
    scene = Scene.random(5, dimension=2, box=6.0, walls=True, obstacles=[Ball((3.0, 3.0), 1.0)], seed=0)
    write(tmp_path / "start.h5md", [at_rest(scene, periodic=scene.periodic, species=None)])
    spec = SceneSpec(file=str(tmp_path / "start.h5md"), obstacles=scene.obstacles, impact=0.8)
    built = spec.build(0)
    assert built.obstacles == scene.obstacles
    assert built.periodic == (False, False)
    assert built.impact == Restitution(0.8)


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ("obstacles.a = {type = 'ball', center = [0, 0], radius = 1}", "must have 3 coordinates"),
        ("obstacles.a = {type = 'ball', center = [1, 1, 1], radius = 3}", "inside an obstacle"),
        (
            "obstacles.a = { type = 'ball', center = [1, 1, 1], radius = 1, "
            "shake = { amplitude = 1, period = 1 } }",
            "needs direction",
        ),
    ],
)
def test_what_does_not_fit_the_box_is_said_when_the_scene_is_built(lines, says):
    plan = SceneFile.from_toml("[scene]\nlattice = 'fcc'\ncells = 3\npacking_fraction = 0.4\n" + lines)
    with pytest.raises(InputError, match=says):
        plan.build_scene()
