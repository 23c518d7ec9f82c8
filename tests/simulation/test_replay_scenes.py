"""Event logs of mixtures, walls, obstacles and lost energy hold all there is to know, to the bit."""

import ast
import importlib
import inspect
import json
import pkgutil
import textwrap
import types
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.mixtures import mixture
from helpers.oracle import moving
from helpers.replays import assert_same_frame, round_up

import carom.engine
import carom.models
from carom import Scene
from carom.compiling.registry import Questions
from carom.errors import FileError
from carom.models import Ball, CylindricalContainer, Plane, SphericalContainer
from carom.models.contacts.restitution import Restitution
from carom.models.interactions.wells import SquareWell
from carom.models.motions.gravity import Gravity
from carom.models.obstacles.paths import Sine
from carom.simulation.replay import Replay, replay, replays

MIXTURE = {"diameters": [1.0, 0.4], "masses": [3.0, 0.7], "seed": 2}


def scenes():
    """Return a scene of every kind."""
    return {
        "mixture": mixture([10, 30], **MIXTURE, packing_fraction=0.35),
        "small box": mixture([1, 6], **MIXTURE, box=(1.2, 2.5, 2.5), names=["a", "b"]),
        "contact": mixture(
            [4, 8], **MIXTURE, dimension=2, packing_fraction=0.3, contact=[[1.0, 0.9], [0.9, 0.4]]
        ),
        "masses": Scene.random(20, 0.4, 2, seed=0).replace(mass=1.0 + np.arange(20) % 3),
        "walls": mixture([3, 10], **MIXTURE, box=(5.0, 4.4), walls="y"),
        "hard box": Scene.random(20, 0.2, walls=True, seed=0),
        "balls": Scene.random(
            15, dimension=2, box=7.0, obstacles=[Ball((0.2, 6.8), 1.1), Ball((8.5, 3.0), 0.6, "far")], seed=0
        ),
        "plane": Scene.random(
            15, dimension=2, box=8.0, walls=True, obstacles=[Plane((1.0, 2.0), 5.0)], seed=0
        ),
        "jar": Scene.random(
            15, dimension=3, box=6.0, walls=True, obstacles=[SphericalContainer((3.0, 3.0, 3.0), 2.8)], seed=0
        ),
        "tube": Scene.random(
            15,
            dimension=3,
            box=(5.0, 6.0, 6.0),
            walls="yz",
            obstacles=[CylindricalContainer(0, (0.0, 3.0, 3.0), 2.7)],
            seed=0,
        ),
        "lossy": mixture([10, 20], **MIXTURE, dimension=2, packing_fraction=0.3).replace(impact=0.8),
        "lossy equals": Scene.random(12, 0.3, 2, seed=0).replace(impact=Restitution(0.7, elastic_below=0.5)),
    }


SHORT = ("contact", "balls", "plane", "lossy equals", "walls")
"""Of these default tests look at short runs, as plain Python: each is compiled for itself."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", scenes())
def test_every_frame_of_every_kind_of_scene_is_rebuilt_to_the_bit(kind, tmp_path):
    assert_rebuilt(scenes()[kind], tmp_path / "events.h5", 5)


def more_scenes():
    """Return others, of which the compiled kernels are for tests of their own."""
    floor = Plane((0.0, 1.0), 0.5, shake=Sine(0.3, 2.0))
    places = [[1.0 + 1.6 * (k % 3), 2.0 + 1.6 * (k // 3)] for k in range(8)]
    falling = {"motion": Gravity((0.0, -1.0)), "obstacles": [floor], "walls": "y"}
    return {
        "rods": Scene.random(10, 0.5, 1, seed=0),
        "small box with walls": Scene.random(5, dimension=2, box=(2.1, 5.0), walls="y", seed=0),
        "small box with a ball": Scene.random(
            3, dimension=2, box=(2.6, 3.2), obstacles=[Ball((0.1, 0.2), 0.3)], seed=0
        ),
        "well": Scene.random(12, 0.2, 2, seed=0).replace(interaction=SquareWell(1.5, 1.0)),
        "shaken floor": Scene(places, (5.0, 9.0), **falling),
    }


@pytest.mark.parametrize("kind", [*SHORT, *more_scenes()])
def test_short_runs_of_many_kinds_of_scenes_are_rebuilt_in_plain_python(plain, kind, tmp_path):
    assert_rebuilt((scenes() | more_scenes())[kind], tmp_path / "events.h5", 1)


def test_a_thousand_contacts_with_balls_and_containers_are_rebuilt_from_compiled_code(tmp_path):
    """Of a thousand squares ``x**2`` one or two are rounded otherwise by Python than by compiled code."""
    ball, jar = Ball((3.0, 3.0), 0.8), SphericalContainer((3.0, 3.0), 2.9)
    scene = moving(Scene.random(6, dimension=2, box=6.0, walls=True, obstacles=[ball, jar], seed=0), 3)
    with carom.Simulation(scene, event_log=tmp_path / "events.h5", seed=0) as sim:
        sim.run(collisions=600)
        (frame,) = sim.sample(times=[round_up(sim)])
        assert sum(impact.hits for impact in sim.obstacles) > 1000
    assert_same_frame(replay(tmp_path / "events.h5", time=frame.time), frame)


def asked_in_a_run():
    """Yield what is compiled: methods of models and of parts of the engine, and functions without types."""
    for package in (carom.engine, carom.models):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            for value in vars(importlib.import_module(found.name)).values():
                asks = isinstance(value, type) and issubclass(value, Questions)
                made = (value, *(vars(value).values() if asks else ()))
                for each in (each for each in made if isinstance(each, types.FunctionType)):
                    written = Path(each.__code__.co_filename).is_file()  # and not made by NamedTuple
                    if written and not {*each.__annotations__} - {"return"}:
                        yield each


def test_nothing_that_is_asked_in_a_run_takes_a_whole_power():
    """The last bit of ``x**2`` is another in plain Python, where replays run; ``x * x`` has one value."""
    asked, found = {*asked_in_a_run()}, []
    for function in asked:
        for each in ast.walk(ast.parse(textwrap.dedent(inspect.getsource(function)))):
            if isinstance(each, ast.BinOp) and isinstance(each.op, ast.Pow):
                of_constant, whole = (isinstance(end, ast.Constant) for end in (each.left, each.right))
                found += [(function.__qualname__, ast.unparse(each))] if whole and not of_constant else []
    assert len(asked) > 500
    assert not found


def assert_rebuilt(scene, path, collisions):
    """Run a scene for so many collisions a component, and compare its frames with those of the replay."""
    scene = moving(scene, 3)
    with carom.Simulation(scene, event_log=path, seed=0) as sim:
        frames = [sim.frame(), *sim.sample(times=[0.2719 * k for k in range(1, 4)])]
        sim.run(collisions=collisions * scene.n)
        frames += sim.sample(times=[round_up(sim), round_up(sim) + 2.0 * sim._state.epoch_length])
        hits = sum(impact.hits for impact in sim.obstacles) if scene.walls or scene.obstacles else 0
    assert sim.collisions > 0
    assert hits > 0 or not (scene.walls or scene.obstacles)
    for mine, right in zip(replays(path, [f.time for f in frames]), frames, strict=True):
        assert_same_frame(mine, right)
        np.testing.assert_array_equal(mine.species, right.species)
        assert (mine.species_names, mine.periodic) == (right.species_names, right.periodic)


@pytest.fixture
def of_walls(plain, tmp_path):
    """Return a scene between walls, the log of a run, and how often walls were hit."""
    scene, path = moving(scenes()["walls"], 1), tmp_path / "events.h5"
    with carom.Simulation(scene, event_log=path, seed=0) as sim:
        sim.run(collisions=50)
        return scene, path, sum(impact.hits for impact in sim.obstacles)


def test_the_log_counts_what_hits_a_wall_apart(of_walls):
    _, path, hits = of_walls
    run, steps = Replay(path), 0
    while run.step():
        steps += 1
    assert hits > 0
    assert (run.collisions, steps) == (50, 50 + hits)


def test_a_changed_impulse_on_a_wall_is_found(of_walls):
    scene, path, _ = of_walls
    with h5py.File(path, "r+") as file:
        k = int(np.flatnonzero(file["j"][:] >= scene.n)[3])
        file["impulse"][k] *= 1 + 2.0**-40
    with pytest.raises(FileError, match=f"impulse of collision {k} between .* and y_"):
        replay(path, time=1e3)


def test_an_obstacle_of_one_s_own_cannot_be_replayed(of_walls):
    _, path, _ = of_walls
    with h5py.File(path, "r+") as file:
        attributes = json.loads(bytes(file["initial/scene"][:]))
        attributes["obstacles"] = [{"type": "own", "class": "Mine", "name": "mine"}]
        del file["initial/scene"]
        file["initial/scene"] = np.frombuffer(json.dumps(attributes).encode(), np.uint8)
    with pytest.raises(FileError, match="class Mine, which no file holds"):
        Replay(path)
