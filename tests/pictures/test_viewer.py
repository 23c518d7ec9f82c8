"""The viewer in the hands of a user, in headless Chromium: choosing, hiding, colors, keys, links, files."""

import re
import time
from importlib import resources

import numpy as np
import pytest
from helpers.browser import browser, where
from helpers.frames import crystal, frame_of

import carom
from carom.drawing.page import FAST, of_frames
from carom.figures.palette import DIVERGING, FACES, SEQUENTIAL, rgb
from carom.pictures import viewdata
from carom.simulation.replay import Replay

BOX = (8.0, 6.0)
PLACES = np.array([[1.5, 1.5], [4.0, 3.0], [6.5, 4.5], [6.5, 1.5]])
KINDS = np.array([0, 1, 2, 0])
SPEEDS = np.array([[0.0, 0.0], [0.0, 2.0], [-2.0, 0.0], [2.0, 0.0]])
"""Four disks, of which three have a color of their own as species."""


def disks(**changes):
    frame = frame_of(PLACES, BOX, species=KINDS)
    values = {"species_names": ("a", "b", "c"), "velocities": SPEEDS, **changes}
    return carom.Frame(**{**vars(frame), **values})


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Return a page of three frames, in which all disks move by (0.5, 0) from each to the next."""
    frames = [disks(time=float(k), positions=PLACES + np.array([0.5 * k, 0.0])) for k in range(3)]
    return carom.view(frames, title="Four disks").save(tmp_path_factory.mktemp("page") / "page.html")


def text(name):
    return browser().run(f"document.getElementById('{name}').innerText")


def link():
    time.sleep(0.3)  # the address follows a little later than the hand
    return browser().run("location.hash.slice(1)")


def face(kind):
    """Return where the middle of the disk of a species is on the screen."""
    x, y, _ = where(browser().picture(), rgb(FACES[kind]))
    return x, y


def color_at(picture, place, name):
    """Return whether the points around one on the screen have a color, up to the light on it."""
    column, row = (round(x) for x in place)
    found = picture[row - 1 : row + 2, column - 1 : column + 2].mean(axis=(0, 1))
    asked = np.array(rgb(name))
    return np.abs(found / np.linalg.norm(found) - asked / np.linalg.norm(asked)).max() < 0.05


def test_a_press_chooses_the_disk_that_is_there_and_escape_leaves_it(page):
    browser().open(page)
    browser().click(*face(1))
    assert text("number") == "particle 1"
    facts = dict(zip(*[iter(text("facts").split("\n"))] * 2, strict=True))
    assert facts == {"species": "b", "position": "4, 3", "velocity": "0, 2", "speed": "2", "diameter": "1"}
    # The other three are as far apart as nearest images are: sqrt(2.5^2 + 1.5^2) - 1, all of them.
    assert sorted(text("partners").split()) == ["0", "2", "3", "nearest"]
    assert link() == "chosen=1"
    browser().key("f")
    before = face(2)
    browser().key("ArrowRight")
    assert text("facts").startswith("species\nb\nposition\n4.5, 3")
    # Disk 1 keeps its place on the screen, and with it all that move as it does.
    browser().key("ArrowRight")
    assert face(2) == pytest.approx(before, abs=1.0)
    assert link() == "frame=3&chosen=1&follow=1"
    followed = face(2)
    browser().key("f")
    assert face(2)[0] - followed[0] > 10
    browser().key("Escape")
    assert browser().run("document.getElementById('who').hidden")
    browser().touch("touchStart", face(2))
    browser().touch("touchEnd")
    assert text("number") == "particle 2"
    browser().click(5, 200)
    assert browser().run("document.getElementById('who').hidden")


def test_slabs_and_hidden_species_leave_out_who_is_not_asked_for(page):
    def counts(state):
        browser().open(page, state)
        picture = browser().picture()
        return [where(picture, rgb(FACES[kind]))[2] for kind in range(3)]

    a, b, c = counts("")
    assert min(a, b, c) > 500
    assert counts("hidden=1") == [
        pytest.approx(a, rel=0.01),
        pytest.approx(0, abs=20),
        pytest.approx(c, rel=0.01),
    ]
    # Around x = 4, of the width 4.8: disk 1 alone, the others are 2.5 away.
    assert counts("slab=x&middle=0.5&thick=0.6") == [
        pytest.approx(0, abs=20),
        pytest.approx(b, rel=0.01),
        pytest.approx(0, abs=20),
    ]
    # Around y = 6, which is y = 0: disks 0 and 3 below it, disk 2 above it.
    around = counts("slab=y&middle=1&thick=0.6")
    assert around == [pytest.approx(a, rel=0.01), pytest.approx(0, abs=20), pytest.approx(c, rel=0.01)]


def test_speeds_have_a_sequential_map_and_components_one_about_zero(page):
    browser().open(page, "color=species")
    (x1, y1), (x2, y2) = face(1), face(2)
    unit = np.array([(x2 - x1) / 2.5, (y2 - y1) / 1.5])
    middles = [x1, y1] + (PLACES - PLACES[1]) * unit
    top = of_frames([disks()], ())["top"]
    assert top == pytest.approx(FAST * np.sqrt(3.0))  # of squares 0, 4, 4, 4

    def between(stops, part):
        at = part * (len(stops) - 1)
        low = min(int(at), len(stops) - 2)
        mixed = np.array(rgb(stops[low])) + (at - low) * (np.array(rgb(stops[low + 1])) - rgb(stops[low]))
        return "#" + "".join(f"{round(255 * x):02x}" for x in mixed)

    for color, stops, parts in (
        ("speed", SEQUENTIAL, np.array([0.0, 2.0, 2.0, 2.0]) / top),
        ("v_x", DIVERGING, 0.5 + np.array([0.0, 0.0, -2.0, 2.0]) / (2 * top)),
    ):
        browser().open(page, f"color={color}")
        picture = browser().picture()
        for middle, part in zip(middles, parts, strict=True):
            assert color_at(picture, middle, between(stops, part)), (color, part)


def test_a_link_restores_what_was_seen(page):
    browser().open(page)
    for key in ("End", "ArrowUp", "c", "d", "i", "s"):
        browser().key(key)
    browser().click(320, 230)
    state, before = link(), browser().picture()
    assert "frame=3" in state
    assert "color=speed" in state
    browser().open(page, state)
    assert np.abs(browser().picture() - before).max() < 0.02
    browser().open(page, "frame=99&color=nothing&slab=w&chosen=-7&zoom=x")
    assert text("state").startswith("4 disks \u00b7 frame 3 of 3")
    assert browser().run("document.getElementById('color').value") == "species"


def test_keys_play_step_and_list_themselves(page):
    browser().open(page)
    seen = []
    for key in ("ArrowRight", "End", "ArrowLeft", "Home"):
        browser().key(key)
        seen.append(text("state").split("frame ")[1])
    assert seen == ["2 of 3", "3 of 3", "2 of 3", "1 of 3"]
    browser().key("?")
    assert "Space play" in text("help")
    browser().key("Escape")
    assert browser().run("document.getElementById('help').hidden")
    browser().key(" ")
    browser().wait("document.getElementById('state').textContent.includes('frame 2')")


@pytest.mark.parametrize("width", [400, 1600])
def test_every_control_has_a_name_and_no_text_covers_another(page, width):
    browser().open(page, "color=psi_6&chosen=1", (width, 800))
    browser().key("v")
    tree = browser().ask("Accessibility.getFullAXTree")["nodes"]
    roles = ("button", "slider", "checkbox", "combobox")
    controls = [n for n in tree if not n["ignored"] and n.get("role", {}).get("value") in roles]
    assert len(controls) > 15
    assert all(node["name"]["value"].strip(" \u203a\u2039\u25b6\u00d7") for node in controls)
    boxes = browser().run(
        "[...document.querySelectorAll('header, #who, #panel, footer, footer > *')].map((e) => { const r ="
        " e.getBoundingClientRect(); return [e.id || e.tagName, r.left, r.top, r.right, r.bottom]; })"
    )
    assert all(0 <= left <= right <= width and bottom <= 800 for _, left, _, right, bottom in boxes)
    named = {name: rest for name, *rest in boxes}
    parts = ["HEADER", "who", "panel", "FOOTER"]
    inside = [name for name in named if name not in parts]
    for names in (parts, inside):
        for k, one in enumerate(names):
            for other in names[:k]:
                a, b = named[one], named[other]
                apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
                assert apart or 0.0 in (a[2] - a[0], b[2] - b[0]), (one, other)


def test_the_card_of_a_particle_leaves_the_scene_of_a_phone_in_sight(page):
    browser().open(page, "chosen=1", (390, 844))
    low, high, scene = browser().run(
        "(() => { const box = (name) => document.querySelector(name).getBoundingClientRect();"
        " return [box('#who').top, box('header').bottom, box('footer').top]; })()"
    )
    assert low - high > 0.6 * (scene - high)


def test_two_fingers_zoom_and_the_theme_is_that_of_the_system(page):
    browser().open(page, dark=True)
    assert browser().picture()[2, -2].mean() < 0.2
    browser().touch("touchStart", (250, 240), (350, 240))
    browser().touch("touchMove", (200, 240), (400, 240))
    browser().touch("touchEnd")
    assert link().startswith("zoom=2")


def test_a_page_says_what_it_leaves_out_and_how_it_draws(tmp_path, monkeypatch):
    monkeypatch.setattr("carom.drawing.page.MOST_PLACES", 8)
    frames = [disks(time=float(k), diameters=np.full(4, 0.5 + 0.1 * k)) for k in range(6)]
    browser().open(carom.view(frames).save(tmp_path / "page.html"), "size=0.5")
    said = text("state")
    assert "drawn with half of the diameters" in said
    assert "diameters change" in said
    assert "one of 3 of 6 frames" in said


def test_a_replay_knows_whom_each_disk_met(tmp_path):
    path = tmp_path / "events.h5"
    scene = carom.Scene.crystal(cells=2, packing_fraction=0.3)
    with carom.Simulation(scene, seed=1, event_log=path) as sim:
        sim.run(collisions=100)
    data = viewdata.of_replay(Replay(path), 60)
    assert data["notes"] == ["the log goes on after these 60 collisions"]
    browser().open(carom.view(path, collisions=60).save(tmp_path / "page.html"), "chosen=3")
    assert "met nobody yet" in text("partners")
    run, met = Replay(path), []
    for _ in range(60):
        before = run.frame().velocities
        run.step()
        changed = np.flatnonzero((run.frame().velocities != before).any(axis=1)).tolist()
        if 3 in changed:
            met.append(next(k for k in changed if k != 3))
    browser().key("End")
    assert text("partners").split()[2:] == [str(k) for k in met[:-7:-1]]
    assert f"collisions\n{len(met)}" in text("facts")


@pytest.mark.slow
def test_of_many_spheres_those_on_the_surface_are_seen_and_no_others(tmp_path):
    """More than are drawn as squares, so that points are drawn, and hidden ones are not."""
    frame = crystal(3, 9)
    middle = np.argmin(np.linalg.norm(frame.positions - frame.box / 2, axis=1))
    # The near corner: x to the right, -y towards the eye, z up.
    corner = np.argmin(np.linalg.norm(frame.positions - np.array([1.0, 0.0, 1.0]) * frame.box, axis=1))
    seen = []
    for special in (middle, corner):
        species = np.zeros(frame.n, dtype=np.int64)
        species[special] = 1
        path = carom.view(carom.Frame(**{**vars(frame), "species": species, "species_names": ("a", "b")}))
        for state in ("", "parallel=1", "zoom=1.7"):
            browser().open(path.save(tmp_path / "page.html"), state)
            seen.append(where(browser().picture(), rgb(FACES[1]))[2])
    assert seen[:3] == [0, 0, 0]
    assert min(seen[3:]) > 15


@pytest.mark.slow
def test_pictures_and_videos_are_saved(page):
    browser().open(page)
    browser().key("p")
    browser().key("w")
    browser().wait("document.getElementById('state').textContent.includes('recording')")
    browser().wait("!document.getElementById('state').textContent.includes('recording')")
    folder = browser().downloads
    for suffix, beginning in ((".png", b"\x89PNG"), (".webm", b"\x1a\x45\xdf\xa3")):
        path = folder / f"Four_disks{suffix}"
        for _ in range(500):
            if path.exists() and path.stat().st_size:
                break
            time.sleep(0.02)
        assert path.read_bytes().startswith(beginning)
    from matplotlib.image import imread

    saved = imread(folder / "Four_disks.png")
    assert saved.shape[:2] == (480, 640)
    assert where(saved[..., :3], rgb(FACES[1]))[2] > 500


TURNING = """(() => {
  const c = document.getElementById('canvas'), gl = c.getContext('webgl2'), clear = gl.clear.bind(gl);
  window.drawn = 0;
  gl.clear = (what) => {  // before a frame is begun, the last one has been drawn
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    window.drawn++;
    clear(what);
  };
  c.setPointerCapture = () => {};
  let x = 600;
  const drag = (kind) => c.dispatchEvent(new PointerEvent(kind, {pointerId: 1, clientX: x, clientY: 400}));
  drag('pointerdown');
  setInterval(() => { x += 2; drag('pointermove'); }, 4);
})()"""


@pytest.mark.timing
@pytest.mark.parametrize("dimension", [2, 3])
def test_a_hundred_thousand_particles_are_turned_without_a_graphics_card(tmp_path, dimension):
    edge = {2: 312, 3: 46}[dimension]
    cells = np.stack(np.meshgrid(*[np.arange(edge)] * dimension), axis=-1).reshape(-1, dimension)
    shaken = 1.1 * (cells + 0.5) + 0.02 * np.random.default_rng(1).normal(size=cells.shape)
    frame = frame_of(shaken, (1.1 * edge,) * dimension)
    browser().open(carom.view(frame).save(tmp_path / "page.html"), size=(1280, 800))
    browser().run(TURNING)
    time.sleep(1.0)
    start, before = time.perf_counter(), browser().run("drawn")
    time.sleep(5.0)
    rate = (browser().run("drawn") - before) / (time.perf_counter() - start)
    print(f"{frame.n} particles in {dimension}D: {rate:.1f} frames a second")
    assert rate > 5.0


def test_the_track_of_a_slider_is_light_on_a_light_ground():
    """A browser makes it dark where white is hard to tell from the accent: below a contrast of 4.5."""
    text = (
        resources.files("carom.drawing").joinpath("viewer").joinpath("viewer.css").read_text(encoding="utf-8")
    )
    accent = re.search(r":root \{.*--accent: #(\w{6});", text)[1]
    parts = [int(accent[k : k + 2], 16) / 255 for k in (0, 2, 4)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    assert 1.05 / (np.dot(linear, (0.2126, 0.7152, 0.0722)) + 0.05) > 4.5
