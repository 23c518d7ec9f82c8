"""The viewer: what its page holds, what headless Chromium shows on the canvas, and the exact replay."""

import base64
import dataclasses
import json
import re
import shutil
import subprocess
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from helpers.browser import browser, shown, where
from helpers.faces import Flypaper
from helpers.frames import crystal, frame_of, frames_of, without, write
from helpers.refits import Drifting, Soft
from matplotlib.collections import EllipseCollection
from scipy.spatial import cKDTree

import carom
import carom.io
from carom.cli import files
from carom.drawing.page import of_frames, psi_6
from carom.drawing.shapes import shapes_of
from carom.errors import CaromWarning, FileError, InputError
from carom.figures.palette import FACES, rgb
from carom.io.events import read_events
from carom.models import (
    Arc,
    Ball,
    Cuboid,
    CylindricalContainer,
    Plane,
    Segment,
    SphericalContainer,
    Triangle,
    own,
    polygon,
)
from carom.models.contacts.losses import Loss
from carom.models.motions.free_flight import FreeFlight
from carom.models.obstacles.outlines import Hull
from carom.models.obstacles.paths import Sine
from carom.models.obstacles.with_properties import Shaken, Surface, Thermal
from carom.observables.packing import packing_network
from carom.pictures import plots, viewdata
from carom.simulation.replay import Replay
from carom.studies.packings.packing import HISTORY, Packing


def unpacked(text, kind):
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def dot(colors, positions, box, periodic=True):
    """Return a frame of disks or spheres of one size, a species for each color number."""
    frame = frame_of(positions, box, periodic=periodic, species=np.array(colors))
    return carom.Frame(**{**vars(frame), "species_names": tuple("abcdef"[: max(colors) + 1])})


# ----------------------------------------------------------------------------------------- the page


def test_the_page_is_one_file_that_asks_no_network_for_anything():
    page = carom.view(frames_of(2)).html
    assert not re.search(r'(src|href)="', page)
    assert not re.search(r"https?://", page)
    assert "@DATA@" not in page
    data = json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL)[1])
    frame = frames_of(2)[1]
    positions = unpacked(data["positions"], "<f4").reshape(3, 7, 3)
    np.testing.assert_array_equal(positions[1, :, :2], frame.positions.astype(np.float32))
    assert data["periodic"] == [True, False, False]
    assert data["names"] == ["small", "big"]
    assert unpacked(data["kinds"], "u1").tolist() == frame.species.tolist()
    assert unpacked(data["radii"], "<f4").tolist() == (0.5 * frame.diameters).astype("f4").tolist()
    assert data["times"] == [frame.time for frame in frames_of(2)]


def test_names_cannot_end_the_script_or_inject_markup():
    frame = carom.Frame(**{**vars(frames_of(3)[0]), "species_names": ("</script><b>", "x")})
    page = carom.view(frame, title="<i>").html
    assert "</script><b>" not in page
    assert "<title>&lt;i&gt;</title>" in page


def test_psi_6_of_a_triangular_lattice_is_one_and_turns_with_it():
    modulus = psi_6(crystal(2, 6))
    np.testing.assert_allclose(modulus[:, 1], 1.0, atol=1e-9)
    # Neighbors at 0, 60, ... degrees; float64 angles of neighbors are known to 2^-50 or so, times 6.
    assert np.ptp(np.cos(modulus[:, 0])) < 1e-6


def test_a_sheared_frame_is_shown_in_the_box_with_right_angles():
    # A crystal that slipped by a row's spacing is itself again: its tilted cell must look like its box.
    straight = crystal(2, 6)
    width, height = straight.box
    straight = carom.Frame(**{**vars(straight), "positions": straight.positions + 0.2})
    tilt = straight.diameters[0] / height
    places = straight.positions.copy()
    places[:, 0] = (places[:, 0] - tilt * places[:, 1]) % width + tilt * places[:, 1]
    assert (places[:, 0] > width).any()
    slipped = carom.Frame(**{**vars(straight), "positions": places, "tilt": tilt})
    np.testing.assert_allclose(psi_6(slipped)[:, 1], 1.0, atol=1e-9)
    data = of_frames([slipped], ())
    shown = unpacked(data["positions"], "<f4").reshape(-1, 3)[:, :2] - straight.positions
    np.testing.assert_allclose(np.sin(np.pi / width * shown), 0.0, atol=1e-6)
    copies, disks, moved_copies, moved_disks = (
        {(round(x, 5), round(y, 5)) for x, y in circles.get_offsets().tolist()}
        for frame in (straight, slipped)
        for circles in plots.snapshot(frame).axes[0].collections
        if isinstance(circles, EllipseCollection)
    )
    assert (moved_copies, moved_disks) == (copies, disks)
    assert len(disks) == straight.n


def test_rattlers_of_a_packing_are_those_of_its_network():
    network = packing_network(without(crystal(2, 6), 14))
    data = viewdata.of_network(network)
    assert unpacked(data["marks"], "u1").tolist() == (~network.backbone).astype(int).tolist()


def test_a_contact_with_a_wall_has_no_partner_on_the_page():
    network = packing_network(frame_of([[0.5, 0.5], [1.5, 0.5]], (2.0, 1.0), periodic=False))
    pairs = unpacked(viewdata.of_network(network)["pairs"], "<i4").reshape(-1, 2)
    assert sorted(map(tuple, pairs.tolist())) == [(0, -1)] * 3 + [(0, 1)] + [(1, -1)] * 3


def test_of_more_frames_than_fit_evenly_spaced_ones_are_kept(monkeypatch):
    monkeypatch.setattr("carom.drawing.page.MOST_PLACES", 7 * 4)
    data = of_frames(frames_of(2, count=10), ())
    assert data["times"] == pytest.approx([0.0, 0.3, 0.6, 0.9])


def test_a_page_has_room_for_the_largest_box_and_disk_of_its_frames():
    sizes = [((8.0, 4.0), 0.5), ((4.0, 6.0), 1.5), ((6.0, 5.0), 1.0)]
    frames = [frame_of([[1.0, 2.0]], box, diameter) for box, diameter in sizes]
    data = of_frames(frames, ())
    assert (data["box"], data["reach"]) == ([8.0, 6.0, 0.0], 0.75)
    assert data["boxes"] == [[*box, 0.0] for box, _ in sizes]
    assert unpacked(data["radii"], "<f4").tolist() == [0.25, 0.75, 0.5]


def test_velocities_that_nobody_has_are_not_shown():
    frame = frames_of(2)[0]
    assert carom.view(frame).data["velocities"]
    still = carom.Frame(**{**vars(frame), "velocities": np.zeros_like(frame.velocities)})
    assert carom.view(still).data["velocities"] is None


BALL_IN_SPACE = [Ball((1.0, 1.0, 1.0), 0.1)]


@pytest.mark.parametrize(
    ("show", "error", "says"),
    [
        (lambda log: carom.view(frames_of(4)), InputError, "one to three dimensions"),
        (lambda log: carom.view(5), InputError, "nothing to show"),
        (lambda log: carom.view([]), InputError, "no frames"),
        (lambda log: carom.view(Path(__file__).parent), FileError, "holds nothing to show"),
        (lambda log: carom.view([frames_of(d)[0] for d in (2, 3)]), InputError, "in their dimension"),
        (lambda log: carom.view(frames_of(2), begin=7.0), InputError, "No frame lies between t = 7 and inf"),
        (lambda log: carom.view(log, collisions=0), InputError, "collisions must be at least 1"),
        (lambda log: carom.view(log, collisions=-5), InputError, "collisions must be at least 1"),
        (lambda log: carom.view(log, begin=1e9), InputError, "no collision after t = 1e.09"),
        (lambda log: carom.view(log, begin=2.0, end=1.0), InputError, "before the begin"),
        (lambda log: carom.view(crystal(2, 3), obstacles=BALL_IN_SPACE), InputError, "center of ball"),
        (lambda log: plots.snapshot(crystal(2, 3), obstacles=BALL_IN_SPACE), InputError, "center of ball"),
        (lambda log: packing_network(crystal(2, 3), obstacles=BALL_IN_SPACE), InputError, "center of ball"),
    ],
)
def test_what_cannot_be_shown_is_refused(log, show, error, says):
    with pytest.raises(error, match=says):
        show(log)


def test_a_page_never_replaces_the_trajectory_that_it_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("q.extxyz", [frames_of(2)[0]])
    path = Path("q.extxyz")
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"expected \.html"):
        files.view.__wrapped__(path, path, overwrite=True)
    with pytest.raises(FileError, match="the source itself"):
        carom.io.convert(path, tmp_path / "q.extxyz", overwrite=True)
    assert path.read_bytes() == before


WITH_A_BALL = """
[scene]
n = 7
packing_fraction = 0.1
dimension = {dimension}
obstacles.ball = {{ type = "ball", center = {center}, radius = 0.5 }}
"""


def test_only_the_scene_of_a_run_says_which_obstacles_stand_beside_its_trajectory(tmp_path):
    frame = frames_of(2)[0]
    write(tmp_path / "trajectory.h5md", [frame])
    plan, summary = tmp_path / "scene.toml", tmp_path / "summary.json"

    def seen():
        return len(carom.view(tmp_path / "trajectory.h5md").data["obstacles"]["spheres"]) > 0

    plan.write_text(WITH_A_BALL.format(dimension=2, center=[1, 1]))
    assert not seen()  # a plan of some other run, as `carom init` writes it
    summary.write_text(json.dumps({"box": frame.box.tolist()}))
    assert seen()
    summary.write_text(json.dumps({"box": [2.0 * edge for edge in frame.box]}))
    assert not seen()
    summary.write_text("{}")
    plan.write_text(WITH_A_BALL.format(dimension=3, center=[1, 1, 1]))
    assert not seen()
    plan.write_text("[scene]\nnonsense = 1")
    with pytest.warns(CaromWarning, match="Obstacles of the run are not drawn: .*nonsense"):
        assert not seen()
    summary.unlink()
    assert not seen()  # nobody named this file


def test_a_folder_with_a_log_of_curved_flights_shows_its_trajectory(log, tmp_path, monkeypatch):
    shutil.copy(log, tmp_path / "events.h5")
    write(tmp_path / "trajectory.h5md", [frames_of(2)[0]])
    assert carom.view(tmp_path).data["replay"] is not None
    monkeypatch.setattr(FreeFlight, "straight", False, raising=False)
    assert carom.view(tmp_path).data["replay"] is None
    page = carom.view(tmp_path / "events.h5", collisions=10).data
    assert page["replay"] is None
    assert len(page["times"]) == 11  # the beginning, and after each collision
    run = Replay(log)
    for _ in range(10):
        run.step()
    last = unpacked(page["positions"], "<f4").reshape(11, -1, 3)[-1]
    np.testing.assert_array_equal(last, run.frame().positions.astype("f4"))


def test_frames_and_trajectories_show_themselves_in_notebooks(tmp_path):
    frames = frames_of(3)
    assert "<iframe srcdoc=" in frames[0]._repr_html_()
    write(tmp_path / "a.h5md", frames)
    with carom.io.open(tmp_path / "a.h5md") as reader:
        assert "<iframe srcdoc=" in reader._repr_html_()
    assert "<table" in frames_of(4)[0]._repr_html_()
    assert "text/html" in carom.view(frames[0])._repr_mimebundle_()


# ----------------------------------------------------------------------------------------- obstacles


def test_obstacles_become_spheres_segments_and_triangles_where_they_are():
    box, no = np.array([4.0, 5.0, 6.0]), (False,) * 3
    ball = shapes_of([Ball((1.0, 2.0, 3.0), 0.5)], box, no)
    np.testing.assert_array_equal(ball.spheres, [[1.0, 2.0, 3.0, 0.5]])
    plane = shapes_of([Plane((0.0, 0.6, 0.8), 2.0)], box, no).triangles
    np.testing.assert_allclose(plane @ [0.0, 0.6, 0.8], 2.0, rtol=1e-9)
    # The face is 4 wide, and in y and z goes from (10 / 3, 0) to (0, 2.5): sqrt(100 / 9 + 6.25) long.
    areas = 0.5 * np.linalg.norm(np.cross(plane[:, 1] - plane[:, 0], plane[:, 2] - plane[:, 0]), axis=1)
    assert areas.sum() == pytest.approx(4.0 * np.hypot(10.0 / 3.0, 2.5), rel=1e-6)
    globe = shapes_of([SphericalContainer((2.0, 2.0, 3.0), 1.5)], box, no).segments
    np.testing.assert_allclose(np.linalg.norm(globe - [2.0, 2.0, 3.0], axis=2), 1.5, rtol=1e-12)
    tube = shapes_of([CylindricalContainer(2, (2.0, 2.0, 3.0), 1.5)], box, no).segments
    np.testing.assert_allclose(np.linalg.norm(tube[..., :2] - 2.0, axis=2), 1.5, rtol=1e-12)


def test_an_obstacle_of_ones_own_is_drawn_if_it_says_how():
    class Mine:
        def surface(self, box, periodic):
            return [carom.models.obstacles.outlines.SolidSphere((1.0, 1.0, 1.0), 0.25)]

    assert shapes_of([Mine(), object()], np.ones(3), (True,) * 3).spheres.tolist() == [[1, 1, 1, 0.25]]


def area(triangles):
    sides = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()


BLOCK = Cuboid((4.0, 4.0), (6.0, 5.0), radius=0.5)


@pytest.mark.parametrize(
    ("obstacle", "covered"),
    [
        (Cuboid((4.0, 4.0), (6.0, 5.0)), 2.0),
        (BLOCK, 2.0 + 2 * 0.5 * 3.0 + np.pi / 4),
        (Triangle((4.0, 4.0), (6.0, 4.0), (4.0, 7.0)), 3.0),
        (Segment((4.0, 4.0), (7.0, 8.0), radius=1.0), 5.0 * 2.0 + np.pi),
        (Surface(BLOCK, Loss(0.9, contact_time=1e-3)), 2.0 + 2 * 0.5 * 3.0 + np.pi / 4),
    ],
)
def test_bodies_in_the_plane_cover_their_area_in_the_viewer_and_in_the_snapshot(obstacle, covered):
    box, no = np.array([10.0, 10.0]), (False, False)
    found = shapes_of([obstacle], box, no)
    # A circle of 96 corners has 7e-4 less area.
    assert area(found.triangles) == pytest.approx(covered, rel=1e-3)
    figure = plots.snapshot(frame_of([[1.0, 1.0]], (10.0, 10.0), periodic=False), obstacles=[obstacle])
    (patch,) = (p.get_xy() for p in figure.axes[0].patches if type(p).__name__ == "Polygon")
    x, y = patch.T
    assert 0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) == pytest.approx(covered, rel=1e-3)


def test_thin_walls_and_arcs_in_the_plane_are_lines():
    box, no = np.array([10.0, 10.0]), (False, False)
    house = [(4.0, 4.0), (8.0, 4.5), (6.0, 8.0)]
    lines = shapes_of(polygon(house), box, no).segments[..., :2]
    np.testing.assert_allclose(
        np.sort(lines, axis=1),
        np.sort([[a, b] for a, b in zip(house, house[1:] + house[:1], strict=True)], axis=1),
    )
    bow = shapes_of([Arc((5.0, 5.0), 2.0, start=0.0, angle=90.0)], box, no).segments[..., :2]
    np.testing.assert_allclose(np.linalg.norm(bow - 5.0, axis=2), 2.0)
    np.testing.assert_allclose(bow[[0, -1], [0, 1]], [[7.0, 5.0], [5.0, 7.0]])
    half = shapes_of([Segment((5.0, 5.0), (25.0, 5.0))], box, no).segments
    np.testing.assert_allclose(np.sort(half[0, :, 0]), [5.0, 10.4], rtol=1e-6)


def test_bodies_are_drawn_in_every_image_that_reaches_into_the_box():
    corner = Cuboid((-0.5, -1.0), (1.5, 1.0))
    found = shapes_of([corner], np.array([10.0, 10.0]), (True, True))
    # Four parts of the block, with 0.4 of what lies beyond the border.
    assert area(found.triangles) == pytest.approx((1.9 + 0.9) * (1.4 + 1.4))
    frame = frame_of([[5.0, 5.0]], (10.0, 10.0))
    patches = plots.snapshot(frame, obstacles=[corner]).axes[0].patches
    drawn = [p.get_xy()[:-1].mean(axis=0) for p in patches if type(p).__name__ == "Polygon"]
    assert sorted(np.round(drawn, 9).tolist()) == [[x, y] for x in (-9.5, 0.5, 10.5) for y in (-10, 0, 10)]
    elsewhere = Cuboid((29.5, -1.0), (31.5, 1.0))
    assert area(shapes_of([elsewhere], np.array([10.0, 10.0]), (True, True)).triangles) == pytest.approx(7.84)
    whole = shapes_of([Ball((-25.0, 5.0), 1.0)], np.array([10.0, 10.0]), (True, True)).spheres
    assert whole.tolist() == [[5.0, 5.0, 0.0, 1.0]]


def test_bodies_in_space_have_a_surface_and_edges():
    box, no = np.array([10.0, 10.0, 10.0]), (False,) * 3
    block = shapes_of([Cuboid((1.0, 1.0, 1.0), (2.0, 3.0, 4.0))], box, no)
    assert area(block.triangles) == pytest.approx(2 * (2.0 + 3.0 + 6.0))
    assert np.linalg.norm(np.diff(block.segments, axis=1), axis=2).sum() == pytest.approx(
        4 * (1.0 + 2.0 + 3.0)
    )
    facet = shapes_of([Triangle((1.0, 1.0, 1.0), (4.0, 1.0, 1.0), (1.0, 5.0, 1.0))], box, no)
    assert area(facet.triangles) == pytest.approx(6.0)
    assert np.linalg.norm(np.diff(facet.segments, axis=1), axis=2).sum() == pytest.approx(12.0)
    thin = shapes_of([Segment((1.0, 1.0, 1.0), (1.0, 1.0, 12.0))], box, no)
    np.testing.assert_allclose(np.sort(thin.segments[..., 2]), [[1.0, 10.0]], rtol=1e-6)
    tube = shapes_of([Segment((5.0, 5.0, 3.0), (5.0, 5.0, 7.0), radius=1.0)], box, no)
    assert area(tube.triangles) == pytest.approx(np.pi * 2.0 * 4.0 + 4 * np.pi, rel=0.05)
    assert not len(tube.segments)
    images = shapes_of([Cuboid((-1.0, 4.0, 4.0), (1.0, 5.0, 5.0))], box, (True,) * 3)
    assert np.unique(np.round(images.triangles[..., 0], 6)).tolist() == [0.0, 1.0, 9.0, 10.0]


def test_an_obstacle_with_another_surface_or_that_is_shaken_is_drawn_as_it_rests():
    box, no = np.array([4.0, 4.0, 4.0]), (False,) * 3
    for inner in (Ball((1.0, 2.0, 3.0), 0.5), Plane((0.0, 0.0, 1.0), 1.0)):
        expected = shapes_of([inner], box, no)
        moving = Shaken(inner, (0.0, 0.0, 1.0), Sine(0.2, period=1.5))
        for outer in (moving, Surface(moving, Loss(0.9, contact_time=1e-3)), Thermal(inner, kT=1.0)):
            for one, other in zip(shapes_of([outer], box, no), expected, strict=True):
                np.testing.assert_array_equal(one, other)
                assert sum(map(len, expected)) > 0


class Own(Ball):
    """An obstacle of one's own, of which a file holds the name only."""


class Unseen:
    """An obstacle that does not say how it is drawn."""

    name = "unseen"

    def check(self, box, periodic):
        """Stand in any box."""


@pytest.mark.parametrize("dimension", [2, 3])
def test_what_does_not_say_how_it_is_drawn_is_not_and_what_is_no_shape_is_refused(dimension):
    class Wrong(Unseen):
        def outline(self, box, periodic):
            return [object()]

        surface = outline

    class Flat(Unseen):
        def outline(self, box, periodic):
            return [Hull(((1.0,) * dimension,) * 4)]

        surface = outline

    frame = frame_of([[2.0] * dimension], (4.0,) * dimension, periodic=False)
    for hidden in (Unseen(), Surface(Unseen(), Loss(0.9, contact_time=1e-3))):
        assert not any(carom.view(frame, obstacles=[hidden]).data["obstacles"].values())
        plots.snapshot(frame, obstacles=[hidden])
    for wrong, says in ((Wrong(), "returned a object, which cannot be drawn"), (Flat(), "is flat")):
        with pytest.raises(InputError, match=says):
            carom.view(frame, obstacles=[wrong])
        with pytest.raises(InputError, match=says):
            plots.snapshot(frame, obstacles=[wrong])


def test_the_folder_of_a_packing_is_shown_with_its_obstacles(tmp_path):
    # A disk of the lattice has become an obstacle: without it, its six neighbors have one contact less.
    frame = crystal(2, 6)
    ball = Ball(tuple(frame.positions[14].tolist()), 0.5, impact=Loss(0.9, contact_time=1e-3))
    packing = Packing(without(frame, 14), np.array([], HISTORY), "", 1, 0.0, (ball,))
    packing.save(tmp_path, pictures=False)
    expected, found = carom.view(packing).data, carom.view(tmp_path).data
    assert found["subtitle"] == expected["subtitle"]
    assert found["obstacles"] == expected["obstacles"]
    assert len(found["obstacles"]["spheres"]) == 1
    assert unpacked(found["bonds"], "<f4").size == unpacked(expected["bonds"], "<f4").size
    assert carom.view(tmp_path, obstacles=[]).data["obstacles"]["spheres"] == []
    other = Packing(packing.frame, packing.history, "", 1, 0.0, (Own(ball.center, ball.radius),))
    other.save(tmp_path, pictures=False)
    with pytest.raises(FileError, match="of the class Own, which no file holds"):
        carom.view(tmp_path)
    with pytest.raises(FileError, match="of the class Own, which no file holds"):
        carom.movie(tmp_path / "packing.h5md", tmp_path / "a.gif", color="rattlers")
    assert carom.view(tmp_path, obstacles=other.obstacles).data["subtitle"] == expected["subtitle"]
    (tmp_path / "summary.json").write_text("[1")
    with pytest.raises(FileError, match="not the summary of a packing"):
        carom.view(tmp_path)


# --------------------------------------------------------------------------------------------- Node

PLACES = Path(str(resources.files("carom.drawing"))) / "viewer" / "positions.js"

STAGE = """
const [n, count, periodic, flat, boxes] = %s, box = [...boxes[0]], look = {frame: 1}, replay = false;
const positions = new Float32Array(flat), radii = new Float32Array(n), velocities = null, grows = false;
%s
const paths = [];
for (look.frame = 1; look.frame <= count; look.frame++) { move(); paths.push(pathOf(1)); }
console.log(JSON.stringify(paths));
"""


@pytest.mark.needs("Node")
def test_a_path_goes_back_over_frames_of_other_boxes_in_parts_of_their_edges():
    rng = np.random.default_rng(3)
    boxes = np.array([[8.0, 6.0, 4.0], [4.0, 7.0, 5.0], [6.0, 3.0, 8.0], [5.0, 5.0, 5.0]])
    parts = 0.5 + np.cumsum(rng.uniform(-0.45, 0.45, (4, 2, 3)), axis=0)  # of the edges, across the faces
    parts[:, :, 2] = 0.5 + 0.1 * rng.uniform(-1.0, 1.0, (4, 2))  # between walls
    positions = (parts - np.floor(parts)) * boxes[:, None]
    given = [2, 4, [True, True, False], positions.ravel().tolist(), boxes.tolist()]
    script = STAGE % (json.dumps(given), PLACES.read_text(encoding="utf-8"))
    done = subprocess.run(
        [shutil.which("node"), "-"], input=script, capture_output=True, text=True, check=True, timeout=60
    )
    for k, path in enumerate(json.loads(done.stdout)):
        steps = (parts[k::-1, 1] - parts[k, 1]) * boxes[k]
        np.testing.assert_allclose(path, positions[k, 1] + steps, atol=1e-5)  # of float32


# ----------------------------------------------------------------------------------------- Chromium


def test_the_canvas_shows_each_species_in_its_color_where_it_is(tmp_path):
    frame = dot([0, 1], [[1.0, 3.0], [3.0, 1.0]], (4.0, 4.0))
    picture = shown(carom.view(frame), tmp_path)
    (x0, y0, many0), (x1, y1, many1) = (where(picture, rgb(FACES[k])) for k in (0, 1))
    assert x0 < x1
    assert y0 < y1  # y goes up on the canvas, and rows go down
    assert many0 == pytest.approx(many1, rel=0.2)
    # A disk of diameter 1 whose centers are 2 apart in x: its area in points.
    assert many1 == pytest.approx(np.pi / 4 * ((x1 - x0) / 2) ** 2, rel=0.25)


def test_frames_of_one_time_are_stepped_through_one_by_one(tmp_path):
    """At a time of 1e10, frames half a unit apart, and two frames of the same time."""
    frame = dot([0, 1], [[1.0, 3.0], [3.0, 1.0]], (4.0, 4.0))
    frames = [carom.Frame(**{**vars(frame), "time": 1e10 + t}) for t in (0.0, 0.5, 0.5, 1.0)]
    browser().open(carom.view(frames).save(tmp_path / "page.html"))
    seen = browser().run(
        "(() => { const seen = [], look = () => seen.push(document.getElementById('state').textContent);"
        "look(); for (const id of ['next', 'next', 'next', 'back', 'back']) {"
        " document.getElementById(id).click(); look(); } return seen; })()"
    )
    numbers = [int(re.search(r"frame (\d) of 4", text)[1]) for text in seen]
    assert numbers == [1, 2, 3, 4, 3, 2]


def test_each_frame_is_shown_in_its_own_box_and_a_path_in_the_one_that_is_shown(tmp_path):
    """Two disks at the same parts of the edges of a box that shrinks to half; one leaves by a face."""
    parts = [[[0.25, 0.75], [0.9, 0.25]], [[0.25, 0.75], [0.1, 0.25]]]
    frames = [
        dot([0, 1], edge * np.array(places), (edge, edge))
        for edge, places in zip((8.0, 4.0), parts, strict=True)
    ]
    page = carom.view(frames).save(tmp_path / "page.html")
    browser().open(page, "frame=1")
    one, first = (where(browser().picture(), rgb(FACES[k])) for k in (0, 1))
    browser().open(page, "frame=2&chosen=1")
    picture = browser().picture()
    other, second = (where(picture, rgb(FACES[k])) for k in (0, 1))
    assert one[2] == pytest.approx(other[2], rel=0.05)  # the disks keep their size
    # About the middle of the box, at which both look: twice as near.
    assert 0.5 * (one[1] - first[1]) == pytest.approx(other[1] - second[1], rel=0.03)
    middle = (first[0] - one[0]) / 0.65 * 0.25 + one[0]
    assert middle - other[0] == pytest.approx(0.5 * (middle - one[0]), rel=0.05)
    # From 0.9 of the edge to 1.1 of it: a fifth of 4 to the left, not four fifths to the right.
    pink = np.abs(picture - np.array([0.91, 0.27, 0.55])).max(axis=2) < 0.1
    pixels = (second[0] - other[0]) / ((0.1 - 0.25) * 4.0)  # of a length
    assert np.nonzero(pink)[1].min() == pytest.approx(second[0] - 0.2 * 4.0 * pixels, abs=3.0)


@pytest.mark.slow
def test_near_spheres_hide_far_ones_and_images_repeat_them(tmp_path):
    # From the camera's side, x to the right and -y towards the eye, the second stands before the first.
    frame = dot([0, 1], [[2.0, 2.6, 2.0], [2.0 + 0.45, 1.4, 2.0 + 0.3]], (4.0, 4.0, 4.0))
    plain = shown(carom.view(frame), tmp_path)
    (_, _, far), (_, _, near) = (where(plain, rgb(FACES[k])) for k in (0, 1))
    assert near > far
    is_periodic = shown(carom.view(frame), tmp_path, "images=1")
    assert np.abs(is_periodic - plain).mean() > 0.01
    dark = shown(carom.view(frame), tmp_path, "dark=1")
    assert dark[5, -5].mean() < 0.3 < 0.9 < plain[5, -5].mean()


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1200, 800), (390, 780)])
def test_ten_thousand_spheres_are_shown_at_the_width_of_a_desk_and_of_a_phone(tmp_path, size):
    frame = crystal(3, 14)  # 4 * 14^3 spheres
    assert frame.n > 10_000
    picture = shown(carom.view(frame), tmp_path, size=size)
    _, _, many = where(picture, rgb(FACES[0]))
    assert many > 0.08 * picture.shape[0] * picture.shape[1]


# ----------------------------------------------------------------------------------------- replay


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "events.h5"
    scene = carom.Scene.crystal(cells=2, packing_fraction=0.3)
    with carom.Simulation(scene, seed=1, event_log=path) as sim:
        sim.run(collisions=400)
    return path


def test_flights_between_the_records_of_a_replay_are_the_run_at_any_time(log):
    data = viewdata.of_replay(Replay(log), 400)
    records = data["replay"]
    starts, times = unpacked(records["starts"], "<i4"), unpacked(records["times"], "<f8")
    places = unpacked(records["places"], "<f4").reshape(-1, 3)
    velocities = unpacked(records["velocities"], "<f4").reshape(-1, 3)
    contacts = unpacked(records["contacts"], "<f8")
    assert len(contacts) == 400
    assert len(times) == data["n"] + 2 * 400
    owners = np.repeat(np.arange(data["n"]), np.diff(starts))
    partners = unpacked(records["partners"], "<i4")
    met = np.stack([owners, partners], axis=1)[np.lexsort((owners, times))][data["n"] :]
    events = read_events(log)
    np.testing.assert_array_equal(met[::2], np.sort(np.stack([events.i, events.j], axis=1), axis=1))
    np.testing.assert_array_equal(met[1::2], met[::2, ::-1])
    # A second shows half of a mean free time, and the end half a second of none.
    free_time = contacts[-1] * data["n"] / (2.0 * 400)
    assert records["pace"] == pytest.approx(0.5 * free_time)
    assert records["end"] == pytest.approx(contacts[-1] + 0.5 * free_time)
    box = np.array(data["box"])
    run = Replay(log)
    for time in np.linspace(0.0, contacts[-1], 7):
        run.advance_to(float(time))
        frame = run.frame()
        for k in range(frame.n):
            r = starts[k] + np.searchsorted(times[starts[k] : starts[k + 1]], time, side="right") - 1
            off = places[r] + velocities[r] * (time - times[r]) - frame.positions[k]
            # float32 places up to the box, and velocities of order one over at most the run's time.
            assert np.abs(off - box * np.rint(off / box)).max() < 2.0**-21 * (box.max() + contacts[-1])


def test_the_first_collisions_of_a_log_make_a_shorter_page(log, tmp_path):
    page = carom.view(log, tmp_path / "page.html", collisions=10)
    assert len(unpacked(page.data["replay"]["contacts"], "<f8")) == 10
    assert (tmp_path / "page.html").read_text() == page.html


def test_a_log_and_frames_are_shown_between_two_times_and_a_log_says_so(log):
    times = unpacked(carom.view(log).data["replay"]["contacts"], "<f8")
    begin, end = 0.5 * (times[99] + times[100]), 0.5 * (times[199] + times[200])
    data = carom.view(log, begin=begin, end=end).data
    np.testing.assert_array_equal(unpacked(data["replay"]["contacts"], "<f8"), times[100:200])
    assert data["times"] == [pytest.approx(begin, rel=2.0**-50)]
    assert data["notes"] == [f"from t = {begin:.6g}"]
    assert data["replay"]["pace"] == pytest.approx(0.5 * (times[199] - begin) / 100 * data["n"] / 2.0)
    frames = [dataclasses.replace(frames_of(2)[0], time=float(k)) for k in range(6)]
    assert carom.view(frames, begin=2.0, end=4.5).data["times"] == [2.0, 3.0, 4.0]


def test_the_log_of_a_run_is_shown_from_where_its_measurement_begins(log, tmp_path):
    shutil.copy(log, tmp_path / "events.h5")
    times = unpacked(carom.view(log).data["replay"]["contacts"], "<f8")
    first = 0.5 * (times[149] + times[150])
    write(
        tmp_path / "trajectory.h5md",
        [dataclasses.replace(frames_of(3)[0], time=first + (k + 1) * times[-1] / 8) for k in range(3)],
    )
    (tmp_path / "scene.toml").write_text("[scene]\nn = 32\n")
    for source in (tmp_path, tmp_path / "events.h5"):
        data = carom.view(source).data
        np.testing.assert_array_equal(unpacked(data["replay"]["contacts"], "<f8"), times[150:])
        assert data["notes"] == [f"from t = {first:.6g}, where the measurement begins"]
    assert len(unpacked(carom.view(tmp_path, begin=0.0).data["replay"]["contacts"], "<f8")) == 400


@own.impact
class Law:
    def transfer(self, rr, rv):
        return 0.95


@own.motion
class Drift:
    def position(self, axis, x, v, t):
        return x + v * t

    def velocity(self, axis, v, t):
        return v


OWN = {
    "impact": {"impact": Law()},
    "motion": {"motion": Drift()},
    "interaction": {"interaction": Soft(1.0, least=0.0)},
    "obstacles": {"obstacles": [Flypaper(1.0)]},
    "bent": {"motion": Drifting(0.25)},
}


@pytest.mark.parametrize("name", OWN)
def test_a_log_is_shown_with_values_of_ones_own(plain, tmp_path, name):
    places, velocities = [[1.0, 5.0], [3.0, 5.2], [5.0, 4.8]], [[1.0, 0.1], [-1.0, 0.2], [-1.0, -0.9]]
    given, path = OWN[name], tmp_path / "events.h5"
    here = carom.Scene(places, 6.0, velocities=velocities, walls="y" if name == "obstacles" else "", **given)
    with carom.Simulation(here, event_log=path, tuning=carom.Tuning(neighbors="sectors")) as sim:
        sim.run(collisions=5)
    with pytest.raises(FileError, match=f"{next(iter(given))}=.* where the file is loaded"):
        carom.view(path)
    page = carom.view(path, **given)
    assert (page.data["replay"] is None) == (name == "bent")
    assert page.data["n"] == 3


@pytest.mark.slow
def test_two_spheres_flash_when_they_meet(log, tmp_path):
    page = carom.view(log)
    contacts = unpacked(page.data["replay"]["contacts"], "<f8")
    before = shown(page, tmp_path, "time=0")
    met = shown(page, tmp_path, f"time={contacts[0]!r}".replace("np.float64(", "").replace(")", ""))
    yellow = (1.0, 0.78, 0.2)
    assert where(before, yellow)[2] < 20 < 100 < where(met, yellow)[2]


@pytest.mark.parametrize("periodic", [True, False])
def test_psi_6_in_a_replay_is_that_of_a_frame(periodic):
    rng = np.random.default_rng(1)
    box = (5.0, 3.0)
    frame = frame_of(rng.uniform(size=(40, 2)) * box, box, periodic=periodic)
    script = resources.files("carom.drawing").joinpath("viewer", "hexatic.js").read_text(encoding="utf-8")
    centers = np.column_stack([frame.positions, np.zeros(40)]).ravel().tolist()
    call = f"hexatic(40, {centers}, {[*box, 0]}, {json.dumps([periodic] * 2 + [False])}, psi)"
    found = browser().run(
        f"(() => {{ {script}\nconst psi = new Float64Array(80); {call}; return [...psi]; }})()"
    )
    found = np.array(found).reshape(40, 2)
    # Doubles on both sides: rounding of angles, times six.
    np.testing.assert_allclose(
        found[:, 1] * np.exp(1j * found[:, 0]),
        (lambda psi: psi[:, 1] * np.exp(1j * psi[:, 0]))(psi_6(frame)),
        atol=1e-12,
    )


@pytest.mark.slow
def test_a_replay_of_disks_is_shown_by_psi_6(tmp_path):
    path = tmp_path / "events.h5"
    scene = carom.Scene.crystal(cells=6, dimension=2, packing_fraction=0.68)
    with carom.Simulation(scene, seed=1, event_log=path) as sim:
        sim.run(collisions=300)
    plain = shown(carom.view(path), tmp_path, "time=0&color=species")
    ordered = shown(carom.view(path), tmp_path, "time=0&color=psi_6")
    # On the lattice psi_6 is 1: every disk has the color of no angle.
    red = (0.92, 0.29, 0.29)
    assert where(plain, red)[2] < 20 < 5000 < where(ordered, red)[2]


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_bond_across_the_border_begins_at_both_of_its_ends(dimension):
    network = packing_network(crystal(dimension, 4))
    frame, box = network.frame, np.asarray(network.frame.box)
    drawn = unpacked(viewdata.of_network(network)["bonds"], "<f4").reshape(-1, 2, 3)[:, :, :dimension]
    ends, steps = frame.positions[network.bonds], network.vectors
    crosses = (np.abs(ends[:, 0] + steps - ends[:, 1]) > 0.5 * box).any(axis=1)
    assert 0 < crosses.sum() < len(steps)
    both = [
        np.stack([ends[:, 0], ends[:, 0] + steps], axis=1),
        np.stack([ends[:, 1], ends[:, 1] - steps], axis=1)[crosses],
    ]
    wanted = np.concatenate(both).reshape(-1, 2 * dimension)
    off, _ = cKDTree(drawn.reshape(-1, 2 * dimension)).query(wanted, p=np.inf)
    assert off.max() < 1e-5  # single precision, over lengths of some diameters


def test_the_summary_of_a_packing_names_obstacles_of_its_own_box_only(tmp_path):
    packing = Packing(crystal(2, 6), np.array([], HISTORY), "", 1, 0.0, (Ball((1.0, 1.0), 0.1),))
    packing.save(tmp_path, pictures=False)
    summary = json.loads((tmp_path / "summary.json").read_text())
    summary["obstacles"][0]["center"] = [1.0] * 3
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    with pytest.raises(FileError, match=r"summary\.json: .*center of ball"):
        carom.view(tmp_path)
