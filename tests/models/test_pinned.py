"""Pinned components: fixed balls by the thousand, found like anyone else."""

import re
from pathlib import Path

import numpy as np
import pytest
from helpers.marks import slow
from helpers.naive.oracle import Oracle

import carom
from carom.errors import InputError, OverlapError
from carom.models import Ball
from carom.models.files.tables import obstacle_to_table
from carom.models.interactions.pinned import Pinned


def porous(dimension=2, n=40, fixed=15, packing_fraction=0.25, seed=3, **settings):
    """Return a scene of which the first are pinned, with velocities."""
    scene = carom.Scene.random(n, packing_fraction, dimension, seed=seed)
    v = np.random.default_rng(seed).normal(size=(n, dimension))
    v[:fixed] = 0.0
    return scene.replace(velocities=v, pinned=np.arange(fixed), **settings)


def as_balls(scene):
    """Return the movers of a scene, and its pinned components as obstacles."""
    free = ~scene.pinned
    balls = [
        Ball(tuple(x), 0.5 * d)
        for x, d in zip(
            scene.positions[scene.pinned].tolist(), scene.diameters[scene.pinned].tolist(), strict=True
        )
    ]
    return free, balls


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("neighbors", ["sectors", slow("lists")])
@pytest.mark.parametrize("dimension", [2, slow(3)])
def test_the_order_of_events_is_the_oracles_with_fixed_balls(dimension, neighbors, tmp_path):
    scene = porous(dimension, n=60 if dimension == 2 else 120, fixed=25, packing_fraction=0.15)
    free, balls = as_balls(scene)
    names = np.flatnonzero(free)
    oracle = iter(
        Oracle(
            scene.positions[free],
            scene.velocities[free],
            scene.box,
            obstacles=[obstacle_to_table(ball) for ball in balls],
            arithmetic="float",
        )
    )
    log = tmp_path / "log.h5"
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors=neighbors), event_log=log)
    sim.run(collisions=150)
    sim.close()
    events = carom.io.events.read_events(log)
    for k in range(150):
        event = next(oracle)
        i = names[event.i]
        # The oracle numbers its balls after the movers; in the scene they are the first.
        j = names[event.j] if event.j < len(names) else event.j - len(names)
        assert {int(events.i[k]), int(events.j[k])} == {int(i), int(j)}, k
        # Eight collisions a mover, each of which multiplies an error by ten or so: 1e-15 becomes 1e-7.
        assert events.time[k] == pytest.approx(float(event.time), abs=1e-6)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("dimension", [slow(1), 2, slow(3), slow(4)])
def test_pinned_components_stay_and_take_up_what_the_others_lose(dimension):
    n, fixed = (12, 3) if dimension == 1 else (40, 10)
    scene = porous(dimension, n=n, fixed=fixed, packing_fraction=0.1 if dimension > 1 else 0.4)
    sim = carom.Simulation(scene)
    sim.run(collisions=300)
    frame = sim.frame()
    assert (frame.positions[:fixed] == scene.positions[:fixed]).all()
    assert (frame.velocities[:fixed] == 0.0).all()
    assert sim.statistics.energy_drift < 1e-12
    assert np.isnan(sim.statistics.momentum_drift)  # it is not conserved
    taken = sim.pinned_impulse
    assert (taken[:fixed] > 0.0).any()
    assert (taken[fixed:] == 0.0).all()
    assert sim.kT == pytest.approx(float((scene.velocities**2).sum()) / (dimension * (n - fixed)), rel=1e-12)


@pytest.mark.parametrize(
    ("speed", "first", "impact"),
    [(1.0, True, None), (2.0**40, True, None), (1.0, False, None), (1.0, True, 0.8)],
)
def test_the_impulse_is_that_of_the_events(plain, tmp_path, speed, first, impact):
    """In the scene's unit of time, which is another one than the engine's where all is fast; and whether the
    pinned ones come first or last: an event is processed by the one that comes first.
    """
    scene = porous()
    order = np.arange(scene.n) if first else np.arange(scene.n)[::-1]
    scene = carom.Scene(
        scene.positions[order], scene.box, velocities=speed * scene.velocities[order],
        pinned=scene.pinned[order], impact=impact,
    )  # fmt: skip
    sim = carom.Simulation(scene, event_log=tmp_path / "log.h5")
    sim.run(collisions=120)
    sim.close()
    events = carom.io.events.read_events(tmp_path / "log.h5")
    taken = np.zeros(scene.n)
    for who in (events.i, events.j):
        np.add.at(taken, who, events.impulse)
    pinned = scene.pinned
    assert np.count_nonzero(taken[pinned]) > 10
    np.testing.assert_allclose(sim.pinned_impulse[pinned], taken[pinned], rtol=1e-12)


def test_pinned_components_may_overlap_each_other_and_nobody_else(plain):
    places = [[1.0, 1.0], [1.5, 1.0], [4.0, 4.0]]
    scene = carom.Scene(places, 6.0, pinned=[True, True, False])
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions=60)
    assert sim.statistics.worst_overlap < 1e-12
    with pytest.raises(OverlapError, match="spheres 0 and 2 overlap"):
        carom.Scene([[1.0, 1.0], [1.5, 1.0], [0.5, 1.0]], 6.0, pinned=[True, True, False])
    with pytest.raises(OverlapError, match="spheres 1 and 2 overlap"):
        carom.Scene([[1.0, 1.0], [4.0, 4.0], [4.5, 4.0]], 6.0, pinned=[0])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"pinned": [True]}, "40 bools"),
        ({"pinned": np.ones(40, bool)}, "nothing can move"),
        ({"pinned": [40]}, "from 0 to 39"),
        ({"pinned": "all"}, "found"),
        ({"velocities": np.ones((40, 2))}, "pinned, and has a velocity"),
        ({"motion": carom.models.FreeFlight()}, "motion is given"),
    ],
)
def test_what_does_not_go_together_is_refused(change, says):
    with pytest.raises(InputError, match=says):
        porous().replace(**change)


def test_no_pressure_is_made_up(unscheduled):
    sim = carom.Simulation(porous())
    with pytest.raises(InputError, match="pinned_impulse"):
        sim.measure(carom.Pressure(), collisions=1000)
    with pytest.raises(InputError, match="growth"):
        carom.Simulation(porous(), growth=0.1)
    with pytest.raises(InputError, match="no pinned"):
        carom.Simulation(carom.Scene.crystal(cells=2, packing_fraction=0.3)).pinned_impulse  # noqa: B018


@pytest.mark.slow
def test_the_example_of_the_page_runs(capsys):
    page = Path(__file__).parents[2].joinpath("docs", "obstacles.md").read_text(encoding="utf-8")
    (block,) = (each for each in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "pinned" in each)
    exec(block, {"carom": carom, "np": np})  # the page has imported them before
    assert capsys.readouterr().out == "True True\n"


def test_nobody_pinned_is_the_scene_without():
    scene = carom.Scene.random(20, 0.3, 2, seed=1)
    assert scene.replace(pinned=np.zeros(20, bool)).pinned is None
    assert scene.replace(pinned=[]).pinned is None
    assert isinstance(porous().interaction, Pinned)
    assert "pinned=15" in repr(porous())


def test_one_ball_between_pinned_ones_loses_by_every_contact_what_restitution_says(plain):
    """In one dimension, bounce after bounce between two that stay: v e^k, in closed form."""
    scene = carom.Scene(
        [[1.0], [4.0], [7.0]], 20.0, velocities=[[0.0], [1.0], [0.0]], pinned=[0, 2], impact=0.5
    )
    sim = carom.Simulation(scene)
    sim.run(collisions=6)
    assert abs(sim.frame().velocities[1, 0]) == 0.5**6
    # Impulse m (1 + e) v of contacts 0, 2, 4 at the right, of 1, 3, 5 at the left.
    taken = 1.5 * 0.5 ** np.arange(6)
    assert sim.pinned_impulse[2] == pytest.approx(taken[::2].sum(), rel=1e-15)
    assert sim.pinned_impulse[0] == pytest.approx(taken[1::2].sum(), rel=1e-15)


def test_a_scene_file_says_how_many_are_pinned_or_who():
    from carom.scene_file.scene_file import SceneFile

    text = "[scene]\nn = 30\ndimension = 2\npacking_fraction = 0.2\npinned = {}\n"
    plan = SceneFile.from_toml(text.format(12))
    scene = plan.scene.build(5)
    assert scene.pinned.sum() == 12
    assert (plan.scene.build(5).pinned == scene.pinned).all()
    assert (plan.scene.build(6).pinned != scene.pinned).any()
    assert SceneFile.from_toml(plan.to_toml()) == plan
    named = SceneFile.from_toml(text.format([3, 4])).scene.build(5)
    assert np.flatnonzero(named.pinned).tolist() == [3, 4]
    for wrong, says in ((31, "there are 30"), (-1, "pinned"), ("'all'", "pinned"), ([30], "from 0 to 29")):
        with pytest.raises(InputError, match=says):
            SceneFile.from_toml(text.format(wrong)).scene.build(5)
