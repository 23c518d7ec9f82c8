"""Keywords of obstacles: what moves, what contacts lose, a temperature; and what the engine makes of them."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import carom
from carom import models
from carom.errors import InputError
from carom.models import (
    Arc,
    Ball,
    Cuboid,
    CylindricalContainer,
    Loss,
    Plane,
    Restitution,
    Segment,
    Sine,
    SphericalContainer,
    Triangle,
    Wall,
    polygon,
)
from carom.models.files.tables import from_table, obstacle_to_table
from carom.models.obstacles.properties import Properties
from carom.models.obstacles.with_properties import Shaken, Surface, Thermal, dressed
from carom.scene.fields import standing

PATH = Sine(0.2, period=1.5)
LOSS = Loss(0.8, contact_time=1e-3)
EVERY = [
    Plane((3.0, 4.0), 1.0, "it"), Ball((2.0, 2.0), 0.5, "it"), Cuboid((1.0, 1.0), (2.0, 2.0), 0.1, "it"),
    Segment((1.0, 1.0), (2.0, 2.0), 0.1, "it"), Arc((4.0, 4.0), 1.0, 0.0, 90.0, "it"),
    Triangle((1.0, 1.0), (2.0, 1.0), (1.0, 2.0), 0.0, "it"), SphericalContainer((4.0, 4.0), 4.0, "it"),
    CylindricalContainer(0, (4.0, 4.0), 3.0, "it"),
]  # fmt: skip


@pytest.mark.parametrize("body", EVERY, ids=lambda body: type(body).__name__)
def test_every_obstacle_takes_every_keyword_and_becomes_what_encloses_it(body):
    up = (0.0, 1.0)
    moved = Shaken(body, up, PATH)
    for given, made in (
        ({}, body),
        ({"impact": LOSS}, Surface(body, LOSS)),
        ({"impact": 0.9}, Surface(body, Restitution(0.9))),
        ({"impact": Restitution(0.9, 0.1)}, Surface(body, Restitution(0.9, 0.1))),
        ({"impact": 1.0}, body),
        ({"kT": 2.0}, Thermal(body, 2.0)),
        ({"kT": 2, "seed": 5}, Thermal(body, 2.0, 5)),
        ({"shake": PATH, "direction": up}, moved),
        ({"shake": PATH, "direction": (0, 3), "impact": LOSS}, Surface(moved, LOSS)),
        ({"shake": PATH, "direction": up, "kT": 2.0}, Thermal(moved, 2.0)),
    ):
        value = replace(body, **given)
        assert dressed(value) == made
        assert dressed(made) is made
        assert value.name == "it"
        assert from_table(obstacle_to_table(value), "obstacle") == value


def test_a_plane_is_shaken_along_its_normal_and_others_are_told():
    assert dressed(Plane((3.0, 4.0), 1.0, shake=PATH)).direction == (0.6, 0.8)
    assert dressed(Plane((3.0, 4.0), 1.0, shake=PATH, direction=(1.0, 0.0))).direction == (1.0, 0.0)
    for body in EVERY[1:]:
        with pytest.raises(InputError, match="shake of it needs direction=, one number an axis"):
            dressed(replace(body, shake=PATH))


def test_a_polygon_gives_its_keywords_to_its_sides():
    sides = polygon([(0, 0), (1, 0), (0, 1)], impact=0.9)
    assert all(side.impact == Restitution(0.9) for side in sides)
    assert [side.kT for side in polygon([(0, 0), (1, 0), (0, 1)], kT=2.0)] == [2.0] * 3


@pytest.mark.parametrize("make", [lambda **given: Ball((2.0, 2.0), 0.5, **given), Wall])
@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"impact": 0.9, "kT": 1.0}, "has impact or kT, found both"),
        ({"impact": 1.5}, "at most 1"),
        ({"impact": 0}, "greater than 0"),
        ({"impact": "high"}, "must be a number, a Restitution or a Loss"),
        ({"impact": True}, "must be a number, a Restitution or a Loss"),
        ({"kT": 0.0}, "kT of a"),
        ({"kT": -1.0}, "kT of a"),
        ({"kT": 1.0, "seed": -1}, "seed of a"),
        ({"seed": 3}, "goes with kT, which is missing"),
        ({"direction": (0.0, 1.0)}, "goes with shake, which is missing"),
        ({"shake": 0.3}, r"shake must be a path.*such as Sine\(0\.2, period=1\.5\); found 0\.3"),
        ({"shake": Sine}, "shake must be a path"),
    ],
)
def test_what_is_impossible_is_one_sentence(make, given, says):
    with pytest.raises(InputError, match=says) as caught:
        make(**given)
    assert "\n" not in str(caught.value)


def test_only_what_can_move_is_shaken():
    arc = Arc((3.0, 3.0), 1.0, shake=PATH, direction=(0.0, 1.0))
    with pytest.raises(InputError, match=r"shake moves all obstacles but arcs.*found Arc"):
        carom.Scene([[5.0, 5.0]], 9.0, obstacles=[arc])
    with pytest.raises(InputError, match="direction of shake must have 2 coordinates"):
        carom.Scene([[5.0, 5.0]], 9.0, obstacles=[Ball((2.0, 2.0), 0.5, shake=PATH, direction=(1.0,))])
    with pytest.raises(InputError, match="direction of shake must not be zero"):
        carom.Scene([[5.0, 5.0]], 9.0, obstacles=[Ball((2.0, 2.0), 0.5, shake=PATH, direction=(0, 0))])


def test_an_obstacle_of_ones_own_may_take_the_keywords():
    @dataclass(frozen=True, repr=False)
    class Shelf(Properties):
        name: "Word" = "shelf"

    Word = str
    assert dressed(Shelf(impact=LOSS)) == Surface(Shelf(), LOSS)
    assert repr(Shelf(kT=2.0)) == "Shelf(name='shelf', kT=2.0)"
    with pytest.raises(InputError, match="kT of Thermal must be"):
        Thermal(Shelf(), -2.0)


def bed(**settings):
    """Return grains over a floor, in a field."""
    places = [[1.0 + 1.6 * (k % 5), 2.0 + 1.6 * (k // 5)] for k in range(6)]
    velocities = np.random.default_rng(1).normal(size=(6, 2))
    motion = models.Gravity((0.0, -1.0))
    return carom.Scene(places, (8.5, 12.0), velocities=velocities, motion=motion, impact=LOSS, **settings)


def final(scene, time=5.0):
    sim = carom.Simulation(scene)
    sim.run(time=time)
    return sim


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("kind", ["lossy", "hot", "shaken"])
def test_keywords_and_walls_have_the_bits_of_the_nested_form(kind):
    given = {
        "lossy": {"impact": LOSS},
        "hot": {"kT": 1.5, "seed": 3},
        "shaken": {"shake": Sine(0.3, 2.0), "impact": LOSS},
    }[kind]
    floor = Plane((0.0, 1.0), 0.0, "y_low")
    nested = {
        "lossy": Surface(floor, LOSS),
        "hot": Thermal(floor, 1.5, 3),
        "shaken": Surface(Shaken(floor, (0.0, 1.0), Sine(0.3, 2.0)), LOSS),
    }[kind]
    scenes = (
        bed(walls="y", obstacles=[nested]),
        bed(walls="y", obstacles=[replace(floor, **given)]),
        bed(walls={"y_low": Wall(**given)}),
    )
    assert standing(scenes[0]) == standing(scenes[1]) == standing(scenes[2])
    before, *others = map(final, scenes)
    for sim in others:
        np.testing.assert_array_equal(sim.frame().velocities, before.frame().velocities)
        np.testing.assert_array_equal(sim.frame().positions, before.frame().positions)
        assert sim.obstacles == before.obstacles
    assert [each.name for each in before.obstacles] == ["plain y_low", "y_high", "y_low"]
    assert before.obstacles[0].hits == 0 < before.obstacles[2].hits


@pytest.mark.usefixtures("both_ways")
def test_a_shaken_floor_by_name_drives_a_bed_and_bears_it(tmp_path):
    sim = final(bed(walls={"y_low": Wall(shake=Sine(0.3, 2.0), impact=LOSS)}), time=10.0)
    floor = next(each for each in sim.obstacles if each.name == "y_low")
    assert floor.work > 0.0
    # The floor bears the weight and the change of the momentum; the ceiling is never hit.
    gained = (sim.frame().velocities[:, 1] - sim.scene.velocities[:, 1]).sum()
    assert floor.impulse == pytest.approx(6.0 * sim.time + gained, rel=1e-12)
    pressure = sim.measure(carom.WallPressure("y_low"), time=5.0, blocks=16)
    assert (pressure.name, pressure.area) == ("y_low", 8.5)
    with pytest.raises(InputError, match=r"y_low stands for the wall plain y_low.*measure 'y_low'"):
        carom.WallPressure(0).begin(sim.scene)
    with pytest.raises(InputError, match="there are plain y_low, y_high, y_low"):
        carom.WallPressure("floor").begin(sim.scene)
    # Saved and loaded, it goes on with the same bits.
    sim.save(tmp_path / "bed.h5")
    again = carom.Simulation.load(tmp_path / "bed.h5")
    for each in (sim, again):
        each.run(time=2.0)
    np.testing.assert_array_equal(again.frame().velocities, sim.frame().velocities)


@pytest.mark.usefixtures("both_ways")
def test_the_threshold_of_a_restitution_follows_the_thermal_speed_and_is_kept(tmp_path):
    floor = Wall(impact=0.9)

    def thresholds(sim):
        return [each.loss.elastic_below for each in sim._state.system.obstacles]

    scene = bed(walls={"y_low": floor, "y_high": Wall(impact=Restitution(0.9, 0.25))})
    sim = carom.Simulation(scene.replace(velocities=None), kT=4.0, seed=1)
    assert thresholds(sim) == [pytest.approx(2e-3), 0.25]
    sim.run(time=2.0)
    sim.rescale(1.0)
    assert thresholds(sim) == [pytest.approx(1e-3), 0.25]
    sim.run(time=2.0)
    sim.save(tmp_path / "half.h5")
    again = carom.Simulation.load(tmp_path / "half.h5")
    assert thresholds(again) == thresholds(sim)
    for each in (sim, again):
        each.run(time=2.0)
    np.testing.assert_array_equal(again.frame().velocities, sim.frame().velocities)


def test_a_surface_of_a_given_restitution_has_the_bits_of_a_loss(plain):
    laws = Restitution(0.9, 0.1), Loss(0.9, elastic_below=0.1)
    scenes = [bed(walls={"y_low": Wall(impact=law)}) for law in laws]
    one, two = map(final, scenes)
    np.testing.assert_array_equal(one.frame().velocities, two.frame().velocities)


def test_a_hot_wall_heats_a_gas_to_its_temperature(plain):
    # Points, nearly, of kT = 0.25 between walls of kT = 2. A mean over M independent looks has the standard
    # error kT sqrt(2 / (f M)), of f = 60 degrees of freedom; looks are a flight apart. Four are 21 %.
    hot = Wall(kT=2.0)
    scene = carom.Scene.random(30, diameter=1e-3, box=(1.5, 1.0), walls={"y_low": hot, "y_high": hot}, seed=1)
    sim = carom.Simulation(scene, kT=0.25, seed=2)
    sim.run(time=3.0)
    found = []
    for _ in range(12):
        sim.run(time=1.5)
        found.append(sim.kT)
    assert np.mean(found) == pytest.approx(2.0, abs=4.0 * 2.0 * (2.0 / (60 * len(found))) ** 0.5)
