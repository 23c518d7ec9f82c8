"""Walls by name: what the keyword takes, what it refuses, and what a scene says of its walls."""

import numpy as np
import pytest
from helpers.frames import write

import carom
from carom import Scene, models
from carom.errors import InputError
from carom.models import Loss, Plane, Restitution, Sine, Wall
from carom.models.obstacles.box_walls import place_of, wall_name
from carom.models.obstacles.with_properties import Shaken, Surface, Thermal
from carom.scene.conversion import to_frame
from carom.scene.fields import standing
from carom.scene.storage import from_arrays, to_arrays

LOSS = Loss(0.8, contact_time=1e-3)
FLOOR = Wall(shake=Sine(0.3, period=2.0), impact=LOSS)


def alone(d, **keywords):
    return Scene(np.full((1, d), 3.0), 6.0, **keywords)


NAMES = {
    1: ["x_low", "x_high"],
    2: ["x_low", "x_high", "y_low", "y_high"],
    3: ["x_low", "x_high", "y_low", "y_high", "z_low", "z_high"],
    4: ["x_low", "x_high", "y_low", "y_high", "z_low", "z_high", "axis3_low", "axis3_high"],
}


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_all_walls_have_names_in_every_dimension(d):
    scene = alone(d, walls=True)
    assert list(scene.walls) == NAMES[d]
    assert scene.periodic == (False,) * d
    assert all(wall.is_plain for wall in scene.walls.values())
    assert standing(scene) == ()
    assert alone(d).walls == alone(d, walls=False).walls == alone(d, walls="").walls == {}
    for name in NAMES[d]:
        axis, side = place_of(name)
        assert wall_name(axis, side) == name


@pytest.mark.parametrize(
    ("d", "walls", "periodic"),
    [
        (1, "x", (False,)),
        (2, "y", (True, False)),
        (2, "yx", (False, False)),
        (3, "xz", (False, True, False)),
        (3, ("y",), (True, False, True)),
        (3, {"z_high": Wall()}, (True, True, False)),
        (4, ["x", "axis3"], (False, True, True, False)),
        (4, "axis3", (True, True, True, False)),
        (4, {"axis3_low": FLOOR}, (True, True, True, False)),
    ],
)
def test_walls_are_named_in_every_start(d, walls, periodic):
    for scene in (
        alone(d, walls=walls),
        Scene.random(3, 0.01, d, walls=walls),
        Scene.crystal(cells=3, packing_fraction=0.05, dimension=d, walls=walls),
        alone(d).replace(walls=walls),
        Scene.from_frame(to_frame(alone(d)), walls=walls),
    ):
        assert scene.periodic == periodic
        assert len(scene.walls) == 2 * periodic.count(False)
        assert scene.replace().walls == scene.walls


def test_the_other_wall_of_an_axis_is_plain():
    scene = alone(2, walls={"y_high": FLOOR})
    assert scene.walls == {"y_low": Wall(), "y_high": FLOOR}
    assert repr(scene).endswith("walls=y (y_high with properties))")
    assert scene.replace(walls="y").walls == {"y_low": Wall(), "y_high": Wall()}
    assert scene.replace(obstacles=[models.Ball((1.0, 3.0), 0.5)]).walls == scene.walls


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"walls": "z"}, "walls='z' names 'z', which is no axis in 2 dimensions: expected some of x, y"),
        ({"walls": "upper"}, "names 'u', which is no axis"),
        ({"walls": "xx"}, "names the axis x twice"),
        ({"walls": ["x_low"]}, "names 'x_low', which is no axis"),
        ({"walls": [True, False]}, "names True, which is no axis"),
        ({"walls": 3}, "walls must name axes"),
        ({"walls": {"y_lo": FLOOR}}, "no wall 'y_lo' in 2 dimensions; did you mean y_low"),
        ({"walls": {"z_low": FLOOR}}, "no wall 'z_low' in 2 dimensions"),
        ({"walls": {"lower": FLOOR}}, "no wall 'lower' in 2 dimensions"),
        ({"walls": {2: FLOOR}}, "no wall 2 in 2 dimensions"),
        ({"walls": {"y_low": Wall}}, "must be a Wall, found"),
        ({"walls": {"y_low": 0.9}}, "must be a Wall, found 0.9"),
        ({"wall": "y"}, "no keyword 'wall'; it is called walls"),
        ({"wals": "y"}, "no keyword 'wals'; did you mean walls"),
        ({"periodic": [True, False]}, "no keyword 'periodic'; give walls='y': axes without walls are"),
        ({"periodic": False}, "give walls=True"),
        ({"periodic": True}, "leave it out: axes without walls are periodic"),
        ({"periodic": "y"}, "axes without walls are periodic"),
        ({"walls": "y", "periodic": (True, False)}, "give walls='y'"),
        ({"restitution": 0.9}, "it is called impact: impact=0.9"),
        ({"gravity": (0, -1)}, "it is called motion: motion=models.Gravity"),
        ({"elastic_below": 0.1}, "Restitution"),
    ],
)
def test_wrong_walls_are_named_in_one_sentence(given, says):
    for make in (
        lambda **keywords: alone(2, **keywords),
        lambda **keywords: Scene.random(3, 0.05, 2, **keywords),
        lambda **keywords: Scene.crystal(cells=3, packing_fraction=0.05, dimension=2, **keywords),
        lambda **keywords: alone(2).replace(**keywords),
    ):
        with pytest.raises(InputError) as caught:
            make(**given)
        assert says in str(caught.value)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
@pytest.mark.parametrize("side", [0, 1])
def test_a_wall_with_properties_is_the_plane_that_stands_for_it(d, side):
    for axis in range(d):
        name = wall_name(axis, side)
        normal = tuple((-1.0) ** side * (k == axis) for k in range(d))
        plane = Plane(normal, -6.0 * side, name)
        moving = Shaken(plane, normal, Sine(0.3, 2.0))
        for wall, made in (
            (Wall(impact=LOSS), Surface(plane, LOSS)),
            (Wall(impact=0.9), Surface(plane, Restitution(0.9))),
            (Wall(kT=1.5), Thermal(plane, 1.5)),
            (Wall(shake=Sine(0.3, 2.0)), moving),
            (FLOOR, Surface(moving, LOSS)),
        ):
            scene = alone(d, walls={name: wall})
            assert standing(scene) == (made,)
            assert scene.obstacles == ()


def test_a_wall_that_swings_far_needs_an_offset():
    with pytest.raises(InputError, match=r"y_low stands for the wall y_low and moves up to 0\.8 .*offset"):
        alone(2, walls={"y_low": Wall(shake=Sine(0.8, 2.0))})
    scene = alone(2, walls={"y_low": Wall(shake=Sine(0.8, 2.0), offset=0.5)})
    assert standing(scene)[0].obstacle.offset == 0.5
    assert alone(2, walls={"y_high": Wall(shake=Sine(0.8, 2.0), offset=0.8)}).periodic == (True, False)
    with pytest.raises(InputError, match=r"gets there while it is shaken; found offset 0\.9"):
        Wall(shake=Sine(0.8, 2.0), offset=0.9)
    with pytest.raises(InputError, match=r"found offset 0\.1"):
        Wall(offset=0.1)


def test_two_hot_walls_draw_different_numbers():
    scene = alone(2, walls={"y_low": Wall(kT=1.0), "y_high": Wall(kT=1.0)})
    assert [each.seed for each in standing(scene)] == [0, 1]


def test_an_obstacle_has_the_name_of_a_wall_only_where_it_stands_for_it():
    alone(2, walls="y", obstacles=[Plane((0.0, 1.0), 0.0, "y_low")])
    alone(2, walls="y", obstacles=[Plane((0.0, 1.0), 0.5, "z_low")])  # there is no such wall
    with pytest.raises(InputError, match="y_low is the name of a wall, for which this obstacle does not"):
        alone(2, walls="y", obstacles=[Plane((0.0, 1.0), 0.5, "y_low")])
    with pytest.raises(InputError, match="y_low and floor both stand for the wall y_low"):
        alone(2, walls={"y_low": FLOOR}, obstacles=[Plane((0.0, 1.0), 0.0, "floor")])


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_walls_come_back_from_arrays(d):
    scene = alone(d, walls={"x_low": FLOOR, "x_high": Wall(kT=2.0, seed=7)}, impact=0.9)
    again = from_arrays(*to_arrays(scene))
    assert again.walls == scene.walls
    assert standing(again) == standing(scene)
    assert again.impact == scene.impact == Restitution(0.9)


def test_a_wall_with_a_path_of_ones_own_fits_no_file():
    class Bumps:
        lowest, highest, period, acceleration = -0.1, 0.1, 1.0, 4.0

        def model(self, unit):
            return Sine(0.1, 1.0).model(unit)

    scene = alone(2, walls={"y_low": Wall(shake=Bumps())})
    with pytest.raises(InputError, match="shake of y_low is of a class of one's own"):
        to_arrays(scene)


@pytest.mark.parametrize("suffix", ["extxyz", "h5md"])
@pytest.mark.parametrize("walls", ["y", "xy", {"y_low": FLOOR}])
def test_walls_are_read_back_from_a_trajectory(tmp_path, suffix, walls):
    scene = Scene.random(6, 0.1, 2, walls=walls, seed=1)
    frame = carom.io.read(write(tmp_path / f"walls.{suffix}", [to_frame(scene)]))
    assert frame.periodic == scene.periodic
    assert Scene.from_frame(frame).walls == dict.fromkeys(scene.walls, Wall())
    assert Scene.from_frame(frame, walls=scene.walls).walls == scene.walls


def test_atoms_have_the_walls_that_pbc_leaves():
    import ase

    atoms = ase.Atoms("Ar2", [[1, 1, 1], [3, 3, 4]], cell=[6, 6, 6], pbc=[True, True, False])
    for walls in (True, "z", {"z_low": FLOOR}):
        scene = Scene.from_ase(atoms, diameter=1.0, walls=walls, impact=0.9)
        assert scene.periodic == (True, True, False)
        assert scene.impact == Restitution(0.9)
    with pytest.raises(InputError, match="walls=True"):
        Scene.from_ase(atoms, diameter=1.0)
    with pytest.raises(InputError, match="pbc of atoms leaves walls='z', found walls='y'"):
        Scene.from_ase(atoms, diameter=1.0, walls="y")
    with pytest.raises(InputError, match=r"no keyword 'periodic'; give walls='z'"):
        Scene.from_ase(atoms, diameter=1.0, periodic=[True, True, False])


def test_a_scene_shows_itself(tmp_path):
    scene = Scene.random(6, 0.1, 2, walls={"y_low": FLOOR}, seed=1)
    assert scene.view().title == "6 disks"
    scene.plot(tmp_path / "scene.png")
    assert (tmp_path / "scene.png").stat().st_size > 0
