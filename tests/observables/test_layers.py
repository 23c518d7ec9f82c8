"""What a run shows of a bed in a field: the granular temperature by layers, weights borne, and work done."""

import json
import math

import numpy as np
import pytest
from helpers.bed import SCENE
from helpers.plain import plain_python
from helpers.screens import NOTHING, found, printed

import carom
from carom.cli import results
from carom.frame import Frame
from carom.models.motions.gravity import Gravity
from carom.observables.analysis.layers import GROUPS, MOST, Layers, weight
from carom.scene_file.scene_file import SceneFile
from carom.studies.job import Look
from carom.studies.runs.driver import Measured


def frame_of(scene, places, velocities, masses):
    n = len(places)
    return Frame(0.0, 0, places, velocities, scene.box, diameters=np.ones(n), masses=masses)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_layer_has_the_temperature_of_its_members_relative_to_their_mean(axis, sign):
    g = sign * np.eye(2)[axis]
    scene = carom.Scene([[2.0, 2.0]], (4.0, 4.0), motion=Gravity(g))
    rng, layers = np.random.default_rng(2), Layers(scene, [])
    n, kT, looks = 300, np.array([0.5, 2.0, 8.0]), 64
    masses = rng.uniform(0.5, 4.0, n)
    for k in range(looks):
        which = rng.integers(0, 3, n)
        heights = which + rng.uniform(0.01, 0.99, n)
        places = np.full((n, 2), 1.0)
        places[:, axis] = heights if sign < 0.0 else 4.0 - heights
        velocities = rng.normal(size=(n, 2)) * np.sqrt(kT[which] / masses)[:, None]
        velocities += np.array([3.0, -1.0]) * (1.0 + which)[:, None] * math.cos(k)  # every layer streams
        layers.look(frame_of(scene, places, velocities, masses), 1.0 + k)
    found = layers.found()
    assert [(each.low, each.high) for each in found] == [(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)]
    assert sum(each.members for each in found) == pytest.approx(n)
    assert layers.kT == pytest.approx(1.0 + 0.5 * (looks - 1))
    for each, right in zip(found, kT, strict=True):
        assert abs(each.kT.mean - right) < 5.0 * each.kT.error
    # Of 64 looks at 100 members in two dimensions. The square of an error is known to sqrt(2 / 63).
    squares = [(each.kT.error / right) ** 2 for each, right in zip(found, kT, strict=True)]
    assert np.mean(squares) == pytest.approx(1.0 / (looks * 99), rel=4.0 * math.sqrt(2.0 / 63 / 3))


def test_groups_of_looks_lose_nothing_and_are_continued():
    scene = carom.Scene([[2.0, 2.0]], (4.0, 4.0), motion=Gravity((0.0, -1.0)))
    rng, kept = np.random.default_rng(2), []
    for k in range(3 * GROUPS + 5):
        layers = Layers(scene, kept)  # as after a checkpoint
        speeds = rng.normal(size=(6, 2))
        layers.look(frame_of(scene, np.full((6, 2), 1.5), speeds, np.ones(6)), float(k))
    assert GROUPS // 2 <= len(kept) <= GROUPS
    assert sum(group[0][0] for group in kept) == 3 * GROUPS + 5
    assert layers.kT == pytest.approx(0.5 * (3 * GROUPS + 4))
    (only,) = layers.found()
    assert only.members == 6.0
    assert abs(only.kT.mean - 1.0) < 5.0 * only.kT.error


def test_a_high_box_has_so_many_layers_and_one_alone_has_no_temperature():
    scene = carom.Scene([[2.0, 2.0]], (4.0, 640.0), motion=Gravity((0.0, -1.0)))
    layers = Layers(scene, [])
    layers.look(frame_of(scene, np.array([[1.0, 639.9], [1.0, 0.1]]), np.ones((2, 2)), np.ones(2)), 1.0)
    low, high = layers.found()
    assert (low.kT, high.kT) == (None, None)
    assert (high.low, high.high) == (640.0 - 640.0 / MOST, 640.0)


def test_only_a_field_has_weights():
    still = carom.Scene([[1.0, 1.0], [3.0, 3.0]], 4.0, mass=[1.0, 2.0])
    assert weight(still) is None
    assert weight(still.replace(motion=Gravity((0.0, 0.0)))) is None
    assert weight(still.replace(motion=Gravity((3.0, -4.0)))) == 7.5
    layers = Layers(still, [])
    assert (layers.found(), layers.kT, layers.groups) == ([], None, [])


BED = {
    "reduced_pressure": NOTHING, "collision_rate": NOTHING, "Z": NOTHING,
    "Z_infinite": NOTHING, "thermal": False, "weight": 4.0, "kT": 1e-9,
    "obstacles": [
        {"name": "y_high", "force": {"mean": 0.0, "error": None},
         "pressure": {"mean": 0.0, "error": None}, "power": NOTHING},
        {"name": "floor", "force": {"mean": 80.0, "error": 0.8}, "pressure": {"mean": 8.0, "error": 0.08},
         "power": {"mean": -0.5, "error": 0.1}},
        {"name": "shelf", "force": {"mean": 8.0, "error": 0.08}, "pressure": NOTHING, "power": NOTHING},
    ],
    "layers": [
        {"low": 0.0, "high": 1.5, "members": 2.0, "kT": {"mean": 12.0, "error": 0.6}},
        {"low": 1.5, "high": 3.0, "members": 0.25, "kT": NOTHING},
    ],
}  # fmt: skip


def test_a_bed_is_shown_in_weights_and_never_in_a_temperature():
    text = " ".join(printed(results._physics(found(**BED))).split())
    # 8 energy / length^2 times 1.5 / 4; 8 energy / length over 4.
    assert "P σ/mg on floor 3.00 ± 0.03" in text
    assert "force/mg on shelf 2.00 ± 0.02" in text
    assert "work of floor a time -0.50 ± 0.10" in text
    assert "mg = 4 the mean weight of one" in text
    for absent in ("kT", "upper wall", "?", "Z counts"):
        assert absent not in text
    layers = " ".join(printed(results._bed(found(**BED))).split())
    # 12 over 4 times 1.5.
    assert "0 to 1 2 2.00 ± 0.10 1 to 2 0.25 -" in layers


def test_where_there_is_no_one_temperature_a_pressure_is_in_units_of_the_scene():
    text = " ".join(printed(results._physics(found(**BED | {"weight": None}))).split())
    assert "P on floor 8.00 ± 0.08" in text
    assert "force on shelf 8.00 ± 0.08" in text
    assert "There is no one kT" in text


def test_a_run_shows_the_bed_and_a_resumed_one_the_same(tmp_path):
    printed_text = plain_python("-m", "helpers.bed", tmp_path)
    whole, cut = json.loads(printed_text.splitlines()[0])
    assert whole == cut
    scene = SceneFile.from_toml(SCENE).build_scene()
    assert whole["weight"] == 2.0 * 1.5
    assert not whole["thermal"]
    assert sum(layer["members"] for layer in whole["layers"]) == pytest.approx(scene.n)
    upper, floor = whole["obstacles"]  # the lower wall is none
    assert upper["name"] == "y_high"
    assert upper["force"]["error"] is None
    assert floor["pressure"]["mean"] == pytest.approx(floor["force"]["mean"] / 3.0)
    assert floor["power"]["mean"] != 0.0
    shown = printed_text.partition("\n")[2]
    assert "P σ/mg on floor" in shown
    assert "granular kT/mgσ" in shown
    assert "±  ?" not in shown
    assert "± ?" not in shown


def test_a_block_has_what_each_wall_took_up_and_gave_in_it(plain):
    walls = {"y_low": carom.models.Wall(kT=2.0), "y_high": carom.models.Wall()}
    scene = carom.Scene([[2.0, 2.0]], 4.0, walls=walls, velocities=[[0.0, 1.0]])
    sim = carom.Simulation(scene, seed=1)
    stretch = Measured({}, sim)
    stretch.cut(10.0)
    before = sim.obstacles
    stretch.run_block(Look())
    (block,) = stretch.blocks()
    pairs = list(zip(before, sim.obstacles, strict=True))
    assert block.impulses == tuple(after.impulse - early.impulse for early, after in pairs)
    assert block.works == tuple(after.work - early.work for early, after in pairs)
    assert any(block.impulses)
    assert any(block.works)
    assert len(block.momentum_changes) == len(pairs)


def test_a_pressure_on_what_nothing_hit_says_so():
    block = carom.Block(1.0, 0, 0.0, (0.0, 0.0), (0.0, 0.0))
    scene = carom.Scene([[2.0, 2.0]], 4.0, walls="y")
    found = carom.WallPressure(0).of_scene([block, block], scene, kT=1.0)
    assert str(found) == "P on y_low: nothing hit it"
    assert (found.pressure.mean, found.pressure.error) == (0.0, math.inf)
    assert "inf" not in found._repr_html_()
    hit = block._replace(impulses=(1.0, 2.0))
    blocks = [hit, block._replace(impulses=(2.0, 1.0))] * 8
    assert "nothing" not in str(carom.WallPressure(0).of_scene(blocks, scene, kT=1.0))


@pytest.mark.parametrize("small", [1.0, 0.25])
def test_layers_are_as_thick_as_the_largest_diameter_and_the_highest_is_what_is_left_of_the_box(small):
    two, sizes = [[2.0, 1.5], [3.5, 1.5]], [1.0, small]
    scene = carom.Scene(two, (4.0, 2.6), diameter=sizes, motion=Gravity((0.0, -1.0)), walls="y")
    layers, places = Layers(scene, []), np.array([[1.0, 0.5], [1.0, 1.5], [1.0, 2.3]])
    layers.look(frame_of(scene, places, np.ones((3, 2)), np.ones(3)), 1.0)
    found = layers.found()
    assert [(each.low, each.high, each.members) for each in found] == [
        (0.0, 1.0, 1.0),
        (1.0, 2.0, 1.0),
        (2.0, 2.6, 1.0),
    ]
