"""Movies and pictures in space: light, depth, obstacles, what is hidden, and a file that others play."""

import itertools
import math
import time

import numpy as np
import pytest
from helpers.frames import crystal, frame_of, frames_of
from PIL import Image, ImageSequence

import carom
from carom.drawing import render
from carom.drawing.caption import Caption, decimals_of
from carom.drawing.render import Camera, rendered
from carom.errors import InputError
from carom.figures.palette import FACES, SEQUENTIAL, rgb
from carom.models import Ball, Plane
from carom.pictures import plots
from carom.pictures.movie import _caption, _colors


def camera_of(frame, size):
    """Return the camera of a movie, whose shorter edge has so many pixels."""
    square = Camera.on(frame, size)
    edges = square.width, square.height
    return Camera.on(frame, math.ceil(size * max(edges) / min(edges)))


def played(path):
    """Return the pictures of a movie."""
    with Image.open(path) as film:
        return [np.asarray(picture.convert("RGB"), int) for picture in ImageSequence.Iterator(film)]


def test_a_disk_covers_the_points_that_its_area_says_in_the_color_of_its_species():
    frame = frame_of([[2.0, 2.0]], (4.0, 4.0), 2.0)
    camera = Camera.on(frame, 200)
    picture = rendered(frame, camera) / 255.0
    covered = np.abs(picture - 1.0).max(axis=2) > 0.1
    reach = round(1.5 * camera.scale)
    inside = covered[100 - reach : 100 + reach, 100 - reach : 100 + reach]  # within the edges of the box
    # A pixel of the rim is wrong by one half at most: the circumference, in pixels.
    assert inside.sum() == pytest.approx(np.pi * camera.scale**2, abs=np.pi * camera.scale)
    middle = picture[camera.height // 2, camera.width // 2]
    np.testing.assert_allclose(middle / middle.sum(), np.array(rgb(FACES[0])) / sum(rgb(FACES[0])), atol=0.02)


def test_a_sphere_is_lit_from_the_upper_left():
    frame = frame_of([[2.0, 2.0, 2.0]], (4.0, 4.0, 4.0), 2.0)
    camera = Camera.on(frame, 200)
    picture = rendered(frame, camera).astype(float).sum(axis=2)
    row, column, off = camera.height // 2, camera.width // 2, round(0.6 * camera.scale)
    assert picture[row - off, column - off] > 1.3 * picture[row + off, column + off]


def test_obstacles_in_space_are_drawn_before_and_behind_spheres():
    frame = frame_of([[5.0, 5.0, 5.0]], (10.0, 10.0, 10.0), 1.0)
    camera = Camera.on(frame, 200)
    middle = camera.height // 2, camera.width // 2
    plain = rendered(frame, camera)[middle].astype(int)
    near, far = (tuple(5.0 + side * camera.axes[2]) for side in (2.0, -2.0))
    hidden = rendered(frame, camera, obstacles=[Ball(near, 1.0)])[middle].astype(int)
    assert np.ptp(hidden) < 20 < np.ptp(plain)  # gray before blue
    assert np.abs(rendered(frame, camera, obstacles=[Ball(far, 1.0)])[middle] - plain).max() == 0
    floor = rendered(frame, camera, obstacles=[Plane((0.0, 0.0, 1.0), 1.0)])
    assert (np.abs(floor.astype(int) - rendered(frame, camera)).max(axis=2) > 20).mean() > 0.05


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_picture_made_in_bands_is_that_made_at_once(dimension, monkeypatch):
    """Spheres, a ball, a face and the edges of the box cross the borders of bands."""
    places = np.random.default_rng(1).uniform(0.0, 5.0, (20, dimension))
    frame = frame_of(places, (5.0,) * dimension, 1.0)
    obstacles = [Ball((2.5,) * dimension, 1.0), Plane((0.0,) * (dimension - 1) + (1.0,), 1.0)]
    camera = Camera.on(frame, 300)
    assert render.FINE * camera.height > 2 * render.BAND
    pictures = [rendered(frame, camera, obstacles=obstacles)]
    monkeypatch.setattr(render, "BAND", render.FINE * camera.height)
    pictures.append(rendered(frame, camera, obstacles=obstacles))
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_movie_has_every_frame_at_its_time(tmp_path, suffix):
    if suffix == ".mp4":
        import imageio_ffmpeg
    frames = frames_of(3, count=5)
    done = []
    count = carom.movie(frames, tmp_path / f"a{suffix}", size=96, fps=10, progress=lambda *k: done.append(k))
    assert count == 5
    assert done == [(k, 5) for k in range(1, 6)]
    if suffix == ".gif":
        with Image.open(tmp_path / "a.gif") as film:
            assert film.n_frames == 5
            assert film.info["duration"] == 100
            assert film.convert("RGB").getcolors(100_000) is not None
    else:
        reader = imageio_ffmpeg.read_frames(str(tmp_path / "a.mp4"))
        facts = next(reader)
        assert facts["fps"] == 10
        pictures = [np.frombuffer(raw, np.uint8) for raw in reader]
        assert len(pictures) == 5
        assert not np.array_equal(pictures[0], pictures[4])


def test_colors_of_speed_and_of_psi_6_differ_from_those_of_species(tmp_path):
    frame = crystal(2, 6)
    moving = carom.Frame(**{**vars(frame), "velocities": np.random.default_rng(1).normal(size=(frame.n, 2))})
    pages = []
    for color in ("species", "speed", "psi_6"):
        carom.movie([moving], tmp_path / "a.gif", size=64, color=color)
        pages.append((tmp_path / "a.gif").read_bytes())
    assert len(set(pages)) == 3


def test_rattlers_have_a_color_of_their_own(tmp_path):
    frame = crystal(2, 6)
    diameters = np.full(frame.n, frame.diameters[0])
    diameters[14] *= 0.9  # held by nobody
    loose = carom.Frame(**{**vars(frame), "diameters": diameters})
    camera = camera_of(loose, 400)
    carom.movie([loose], tmp_path / "a.gif", size=400, color="rattlers")
    (picture,) = played(tmp_path / "a.gif")
    assert picture.shape[1] == camera.width
    assert camera.height < picture.shape[0] < 1.1 * camera.height  # the strip
    picture = picture[: camera.height]
    colors = picture / picture.sum(axis=2, keepdims=True)
    wanted = np.array(rgb(FACES[1])) / sum(rgb(FACES[1]))
    seen = (np.abs(colors - wanted).max(axis=2) < 0.03).sum()
    area = np.pi * (0.5 * diameters[14] * camera.scale) ** 2
    assert seen == pytest.approx(area, rel=0.2)  # one disk; its rim is mixed with what is behind


def test_a_gif_has_the_colors_of_all_its_frames(tmp_path):
    """At first one disk moves; later all do, at speeds that the first frame has no colors for."""
    start = crystal(2, 6)
    velocities = np.zeros_like(start.velocities)
    velocities[0] = 1.0, 0.0
    later = np.random.default_rng(1).normal(size=velocities.shape)
    frames = [carom.Frame(**{**vars(start), "velocities": v}) for v in (velocities, 0.5 * later, later)]
    carom.movie(frames, tmp_path / "a.gif", size=128, color="speed")
    top = 2.5 * np.sqrt(np.mean([np.sum(f.velocities**2, axis=1) for f in frames]))
    for frame, picture in zip(frames, played(tmp_path / "a.gif"), strict=True):
        wanted = rendered(frame, camera_of(frame, 128), colors=_colors(frame, "speed", top, ()))
        off = np.abs(picture[: len(wanted)] - wanted).max(axis=2)
        assert off.max() < 48  # 255 colors; with those of the first frame it was 88
        assert off.mean() < 6


def test_the_strip_under_a_movie_has_the_time_and_the_colors():
    frame = frames_of(2)[0]
    bare = np.zeros((10, 300, 3), np.uint8)
    strips = {}
    for color in ("species", "speed", "psi_6"):
        caption = _caption(frame, color, 2.5, 300, 2)
        early, late = (caption.under(bare, time)[10:] for time in (1.25, 1.5))
        differs = np.nonzero((early != late).any(axis=(0, 2)))[0]
        assert differs.max() < 100  # the time, at the left
        strips[color] = early[:, 100:]
    for color, name in (("species", FACES[1]), ("speed", SEQUENTIAL[-1]), ("psi_6", "#eb4a4a")):
        wanted = np.round(255 * np.array(rgb(name)))
        found = {c: np.abs(strip - wanted).max(axis=2).min() for c, strip in strips.items()}
        assert found[color] < 10  # a column of the bar has the color of its left border
        assert min(found[c] for c in found if c != color) > 10
    assert (decimals_of(0.0, 1.0, 11), decimals_of(0.0, 0.0, 1), decimals_of(3.0, 33.0, 2)) == (2, None, 0)


@pytest.mark.parametrize("fps", [24, 30, 50])
def test_a_gif_lasts_as_long_as_it_should(tmp_path, fps):
    frames = frames_of(2, count=13)
    carom.movie(frames, tmp_path / "a.gif", size=48, fps=fps)
    with Image.open(tmp_path / "a.gif") as film:
        each = [picture.info["duration"] for picture in ImageSequence.Iterator(film)]
    assert sum(each) == pytest.approx(1000 * 13 / fps, abs=5.0)  # half a hundredth of a second
    assert min(each) >= 20
    with pytest.raises(InputError, match="at most 50 frames a second"):
        carom.movie(frames, tmp_path / "b.gif", fps=51)


def test_what_makes_no_movie_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"expected one of .mp4, .gif"):
        carom.movie(frames_of(2), tmp_path / "a.avi")
    with pytest.raises(InputError, match="expected one of species"):
        carom.movie(frames_of(2), tmp_path / "a.gif", color="mood")
    with pytest.raises(InputError, match="psi_6"):
        carom.movie(frames_of(3), tmp_path / "a.gif", color="psi_6")
    apart = frame_of([[1.0, 1.0], [3.0, 3.0]], (4.0, 4.0), 0.5)
    with pytest.raises(InputError, match="this is no packing"):
        carom.movie([apart], tmp_path / "a.gif", color="rattlers")
    with pytest.raises(InputError, match="no frames"):
        carom.movie([], tmp_path / "a.gif")
    near = frame_of([[1.0, 1.0], [1.6, 1.0], [1.3, 1.5]], (4.0, 4.0), 0.5)  # a gas: nobody holds anybody
    with pytest.raises(InputError, match=r"Frame 0 .* this is no packing"):
        carom.movie([near], tmp_path / "a.gif", color="rattlers")
    with pytest.raises(InputError, match="psi_6 needs 7 disks at least, found 3"):
        carom.movie([near], tmp_path / "a.gif", color="psi_6")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("edges", "size"), [((8.0, 4.0), 60), ((60.0, 1.0), 400)])
def test_a_movie_of_boxes_that_change_has_room_for_the_largest(tmp_path, edges, size):
    small, large = (
        frame_of([[0.5 * part * edge for edge in edges]], tuple(part * edge for edge in edges), 0.5)
        for part in (0.5, 1.0)
    )
    carom.movie([small, large], tmp_path / "a.gif", size=size)
    pictures = played(tmp_path / "a.gif")
    height, width, _ = pictures[0].shape
    if edges[0] > 10 * edges[1]:
        assert width == 1920, "an edge is as long as can be played"
    else:
        assert size <= height - 2 * max(round(width / 26), 9) <= size + 4, "without the strip"
    columns = [
        np.flatnonzero((picture[: height - 2 * max(round(width / 26), 9)] < 200).all(axis=2).any(axis=0))
        for picture in pictures
    ]
    lengths = [found[-1] - found[0] for found in columns]
    assert lengths[0] == pytest.approx(0.5 * lengths[1], abs=6)
    assert sum(columns[0][[0, -1]]) == pytest.approx(sum(columns[1][[0, -1]]), abs=6), "both in the middle"


def test_a_caption_names_colors_in_their_order():
    colors = np.eye(3)
    caption = Caption(600, 1, entries=[(tuple(color), f"kind {k}") for k, color in enumerate(colors)])
    strip = caption.under(np.zeros((4, 600, 3), np.uint8), 0.0)[4:]
    places = [np.flatnonzero((strip == 255 * color).all(axis=2).any(axis=0)) for color in colors]
    assert all(before.max() < after.min() for before, after in itertools.pairwise(places))


def test_a_movie_of_disks_that_grow_has_room_for_the_largest(tmp_path):
    small, large = (frame_of([[0.5, 2.0]], (8.0, 4.0), diameter) for diameter in (0.5, 3.0))
    for name, frames in (("both", [small, large]), ("large", [large])):
        carom.movie(frames, tmp_path / f"{name}.gif", size=60)
    both, alone = (played(tmp_path / f"{name}.gif")[-1] for name in ("both", "large"))
    np.testing.assert_array_equal(both < 128, alone < 128)


def test_a_disc_is_hidden_by_a_later_one_that_lies_on_it_and_not_by_an_earlier_one(monkeypatch):
    monkeypatch.setattr(render, "FEW", 0)
    centers = np.array([[0.0, 0.0], [5.0, 5.0], [5.1, 5.0], [0.05, 0.0], [9.0, 0.0]])
    radii = np.array([1.0, 0.5, 1.0, 1.2, 1.0])
    assert render.visible(centers, radii).tolist() == [False, False, True, True, True]
    assert render.visible(centers[::-1], radii[::-1]).tolist() == [True, True, True, True, True]


def test_a_disc_is_seen_if_and_only_if_a_point_shows_it(monkeypatch):
    monkeypatch.setattr(render, "FEW", 0)
    rng = np.random.default_rng(1)
    centers, radii = rng.random((200, 2)) * 5.6, rng.uniform(0.3, 1.5, 200)
    seen = render.visible(centers, radii)
    # A grid of other points, ten times finer: what shows there by a thirtieth of the disc must be seen.
    points = np.stack(np.meshgrid(*[np.arange(-1.5, 7.1, 0.02)] * 2, indexing="ij"), axis=-1)
    last = np.full(points.shape[:2], -1)
    for k, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        last[((points - center) ** 2).sum(axis=-1) < radius**2] = k
    shown = np.bincount(last[last >= 0], minlength=200) * 0.02**2 / (np.pi * radii**2)
    assert seen[shown > 1 / 10].all()
    assert not seen[shown == 0.0].any()
    assert seen.sum() < 100


def test_a_picture_without_the_hidden_spheres_is_the_same(monkeypatch):
    rng, edge = np.random.default_rng(2), (1500 * np.pi / 6 / 0.45) ** (1 / 3)
    frame = frame_of(rng.random((1500, 3)) * edge, (edge,) * 3, rng.choice([1.0, 0.4], 1500))
    camera = render.Camera.on(frame, 300)
    whole = render.rendered(frame, camera).astype(float)
    monkeypatch.setattr(render, "FEW", 0)
    left = render.rendered(frame, camera).astype(float)
    # One pixel in a hundred may show a sliver of what is left out.
    assert (np.abs(left - whole).max(axis=2) > 16).mean() < 0.01


@pytest.mark.timing
def test_a_snapshot_of_2048_spheres_takes_less_than_three_tenths_of_a_second(tmp_path):
    frame = crystal(3, 8)
    assert frame.n == 2048
    plots.snapshot(frame, path=tmp_path / "a.png")  # imports matplotlib
    began = time.process_time()
    plots.snapshot(frame, path=tmp_path / "a.png")
    assert time.process_time() - began < 0.3
