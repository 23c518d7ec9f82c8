"""The words of a simulation: what there is, where it is, and what an old or wrong word is answered with."""

import numpy as np
import pytest

import carom
from carom.errors import InputError
from carom.models import SquareWell

SCENE = carom.Scene.random(16, 0.2, 2, seed=1)


def test_a_simulation_shows_its_particles(tmp_path):
    sim = carom.Simulation(SCENE, seed=1)
    sim.run(collisions=20)
    frame = sim.frame()
    assert sim.n == 16
    np.testing.assert_array_equal(sim.positions, frame.positions)
    np.testing.assert_array_equal(sim.velocities, frame.velocities)
    assert sim.view(tmp_path / "page.html").title == "16 disks"
    assert (tmp_path / "page.html").stat().st_size > 1000
    assert sim.plot(tmp_path / "picture.png").axes
    assert (tmp_path / "picture.png").exists()
    assert "Neighbors" in str(sim.explain())


@pytest.mark.usefixtures("unscheduled")
def test_the_picture_of_a_simulation_has_the_walls_that_its_scene_shows():
    scene = carom.Scene.random(16, 0.2, 2, walls={"y_low": carom.models.Wall(impact=0.5)}, seed=1)
    plain, of_scene, of_simulation = (
        len(x.plot().axes[0].patches) for x in (SCENE, scene, carom.Simulation(scene))
    )
    assert of_simulation == of_scene > plain


def test_the_face_is_no_longer_than_it_was_written():
    names = {name for name in dir(carom.Simulation) if not name.startswith("_")}
    assert names == {
        "scene", "n", "time", "collisions", "kT", "positions", "velocities", "diameters", "packing_fraction",
        "potential_energy", "degrees_of_freedom", "pinned_impulse", "collisions_by_species", "obstacles",
        "interaction", "drive", "observers", "statistics", "frame", "run", "rescale", "equilibrate", "sample",
        "measure", "write", "helfand", "kT_rotational", "view", "plot", "explain", "save", "load", "close",
    }  # fmt: skip


def test_what_the_interaction_adds_up_is_that_of_the_scene(unscheduled):
    assert carom.Simulation(SCENE).interaction is carom.Simulation(SCENE).drive is None
    wells = carom.Scene.crystal(cells=3, density=0.3, interaction=SquareWell(1.5, 1.0))
    sim = carom.Simulation(wells, seed=1)
    assert sim.interaction.n == wells.n


@pytest.mark.parametrize(
    ("word", "says"),
    [
        ("neighbors", r"tuning=carom\.Tuning\(neighbors=\.\.\.\)"),
        ("shell", r"Tuning\(shell=\.\.\.\)"),
        ("images", r"Tuning\(images=\.\.\.\)"),
        ("precision", r"Tuning\(precision=\.\.\.\)"),
        ("workers", "it is called cores"),
        ("seeds", "did you mean seed"),
        ("temperature", "it is called kT"),
        ("packing_fracton", "did you mean packing_fraction, a keyword of Scene.random and Scene.crystal"),
    ],
)
def test_an_old_or_wrong_word_is_answered_with_the_right_one(word, says):
    with pytest.raises(InputError, match=says):
        carom.Simulation(SCENE, **{word: 1})
    if word == "workers":
        with pytest.raises(InputError, match=says):
            carom.Simulation.load("state.h5", workers=2)
        with pytest.raises(InputError, match="it is called walltime"):
            carom.Simulation(SCENE).measure(carom.Pressure(), relative_error=0.1, max_walltime=1.0)


@pytest.mark.parametrize("wrong", [{"neighbors": "trees"}, {"precision": "half"}, {"shell": 1.0}])
def test_tuning_takes_what_there_is(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        carom.Tuning(**wrong)
    with pytest.raises(InputError, match="tuning must be"):
        carom.Simulation(SCENE, tuning="lists")


def test_a_generator_is_a_seed_and_the_default_is_one(unscheduled):
    default, one = carom.Simulation(SCENE), carom.Simulation(SCENE, seed=1)
    np.testing.assert_array_equal(default.velocities, one.velocities)
    drawn = [carom.Simulation(SCENE, seed=np.random.default_rng(5)).velocities for _ in range(2)]
    np.testing.assert_array_equal(*drawn)
    assert not (drawn[0] == one.velocities).any()
    np.testing.assert_array_equal(
        carom.Scene.random(9, 0.2).positions, carom.Scene.random(9, 0.2, seed=1).positions
    )
