"""Overlaps are seen in frames: ``carom.check`` of a scene, and ``carom run --check``."""

import dataclasses
import itertools

import numpy as np
import pytest
from helpers.oracle_scenes import CASES
from typer.testing import CliRunner

import carom
from carom.cli import app
from carom.cli.results import _health
from carom.errors import InputError
from carom.geometry.overlaps import Overlap
from carom.models import Ball, Bonds, Plane, Segment, Shear, SphericalContainer, SquareWell, chains
from carom.models.motions.gravity import Gravity
from carom.models.obstacles.paths import Sine
from carom.simulation.measuring.depths import in_frames
from carom.studies.runs import driver


def with_images(vectors, edges, tilt):
    """Return the shortest of all images of some vectors (..., d), each less than an edge long."""
    boxes = (-2, -1, 0, 1, 2) if tilt else (-1, 0, 1)
    steps = np.array(list(itertools.product(boxes, repeat=len(edges)))) * edges
    if tilt:
        steps[:, 0] += tilt * steps[:, 1]
    return np.sqrt(((vectors[..., None, :] + steps) ** 2).sum(axis=-1)).min(axis=-1)


def deepest_by_hand(frame, balls, tilt=0.0, pinned=()):
    """Return the deepest overlap of all pairs and with balls and walls, over the contact distance of two or
    over the diameter; those ``pinned`` may be in each other and in what stands.
    """
    x, radii, box = frame.positions, 0.5 * frame.diameters, np.array(frame.box)
    edges = np.where(frame.periodic, box, 1e9)
    contact = radii[:, None] + radii
    pairs = 1.0 - with_images(x[:, None] - x, edges, tilt) / contact
    np.fill_diagonal(pairs, 0.0)
    pairs[np.ix_(pinned, pinned)] = 0.0
    x, radii = np.delete(x, pinned, axis=0), np.delete(radii, pinned)
    found = [pairs.max()]
    for ball in balls:
        away = with_images(x - np.array(ball.center), edges, 0.0) - ball.radius
        found.append(((radii - away) / (2.0 * radii)).max())
    for axis in np.flatnonzero(~np.array(frame.periodic)):
        low = np.minimum(x[:, axis], box[axis] - x[:, axis])
        found.append(((radii - low) / (2.0 * radii)).max())
    return min(max(found), 1.0)


def changed(frame, rng, **more):
    """Return a frame with places anywhere, and with other diameters: those of a later time."""
    places = rng.uniform(0.0, 1.0, frame.positions.shape) * np.array(frame.box)
    sizes = rng.uniform(0.3, 0.2 + 0.5 * frame.dimension, frame.n)
    return dataclasses.replace(frame, positions=places, diameters=sizes, **more)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
@pytest.mark.parametrize("walled", [False, True])
@pytest.mark.parametrize("pinned", [[], [0, 3]])
@pytest.mark.filterwarnings("error")
def test_the_deepest_overlap_is_that_of_all_pairs_images_and_obstacles(unscheduled, d, walled, pinned):
    rng, box = np.random.default_rng(d), np.array((5.0, 4.3, 4.7, 4.1))[:d]
    # So many balls of one kind that those near are looked up; they are small, and may stand anywhere.
    balls = [Ball(tuple(x), 0.01 * (1 + k)) for k, x in enumerate(rng.uniform(0.0, box, (20, d)))]
    start = carom.Scene.random(
        6, box=box, diameter=0.02, seed=1, obstacles=balls, walls="x" if walled else "", pinned=pinned or None
    )
    frames = [changed(carom.Simulation(start).frame(), rng) for _ in range(20)]
    for frame in frames[10:] if pinned else ():  # small ones among large pinned ones
        frame.diameters[:] *= np.where(np.isin(range(6), pinned), 1.5, 0.1)
    seen = 0
    for frame, (_, found) in zip(frames, in_frames(start, frames), strict=True):
        depth = deepest_by_hand(frame, balls, pinned=pinned)
        assert (found is None) == (depth <= 0.0)
        assert found is None or found.relative == pytest.approx(depth, rel=1e-9)
        seen += found is not None
    assert seen > 5


@pytest.mark.parametrize("rate", [0.5, -0.5])
def test_the_images_of_a_frame_are_those_of_its_tilt(unscheduled, rate):
    rng = np.random.default_rng(3)
    scene = carom.Scene.random(6, box=(4.0, 5.0), diameter=0.1, motion=Shear(rate), seed=1)
    for tilt in (0.45, -0.3, 0.2):
        frame = changed(carom.Simulation(scene).frame(), rng, tilt=tilt)
        ((_, found),) = in_frames(scene, [frame])
        depth = deepest_by_hand(frame, (), tilt)
        assert (found is None) == (depth <= 0.0)
        assert found is None or found.relative == pytest.approx(depth, rel=1e-9)


def test_an_overlap_of_images_in_a_small_sheared_frame_is_seen(unscheduled):
    """The images that are nearest along the axes of the cell are 1.07 apart, others .966."""
    scene = carom.Scene([[0.5, 0.5], [1.55, 1.55]], 2.1, motion=Shear(1.0))
    frame = carom.Simulation(scene, seed=1).frame()
    for tilt in (0.5, 1.5, -0.5):
        places = np.array([[1.614, 0.429], [0.6925, 0.7191]])
        moved = dataclasses.replace(frame, positions=places, tilt=tilt)
        ((_, found),) = in_frames(scene, [moved])
        nearest = with_images(places[1] - places[0], np.full(2, 2.1), tilt)
        assert (found is not None) == (nearest < 1.0)
        assert found is None or found.distance == pytest.approx(nearest)
    assert with_images(places[1] - places[0], np.full(2, 2.1), 0.5) == pytest.approx(0.96608, abs=1e-5)


def test_an_obstacle_is_where_it_is_at_the_time_of_the_frame():
    floor = Plane((0.0, 1.0), 0.5, shake=Sine(0.25, 4.0))  # at .75 a unit of time later
    scene = carom.Scene([[1.0, 1.1]], (3.0, 4.0), diameter=1.0, walls="y", obstacles=[floor])
    start = carom.Simulation(scene).frame()
    report = carom.check(scene, frames=[start, dataclasses.replace(start, time=1.0)])
    (failure,) = report.failures
    assert report.tried == {"overlap": 2}
    assert failure.numbers["time"] == 1.0
    assert failure.numbers["depth"] == pytest.approx(0.15, rel=1e-12)
    assert "sphere 0 is inside an obstacle, plane, by 0.15 (distance 0.3500, contact 0.5000)" in str(report)


def scenes():
    """Return scenes of each kind, and how they are simulated; those of the oracle are among them."""
    fluid = carom.Scene.random(12, 0.3, 2, seed=1)
    bars = [Segment((1.0, 1.0 + 0.3 * k), (1.5, 1.1 + 0.3 * k)) for k in range(18)]
    jar = [
        SphericalContainer((3.0, 3.0), 2.9),
        Ball((3.0, 3.0), 0.5, shake=Sine(0.2, 3.0), direction=(1.0, 0.0)),
    ]
    floor = Plane((0.0, 1.0), 0.4, shake=Sine(0.3, 2.0))
    places = [[1.0 + 2.0 * (k % 3), 1.0 + 2.0 * (k // 3)] for k in range(9)]
    kinds = {
        "shear": (fluid.replace(motion=Shear(0.8)), {}),
        "shear backwards": (carom.Scene.random(12, box=(6.0, 4.0), seed=1, motion=Shear(-0.8)), {}),
        "growth in shear": (fluid.replace(motion=Shear(-0.5)), {"growth": 0.02}),
        "a barostat": (fluid, {"barostat": carom.Barostat(3.0, 0.2, 0.2)}),
        "swaps": (fluid.replace(diameter=np.linspace(0.7, 1.0, 12)), {"swaps": carom.Swaps(0.5)}),
        "bars": (
            carom.Scene.random(8, box=(7.0, 8.0), seed=1, obstacles=bars, diameter=0.6),
            {"growth": 0.05},
        ),
        "a jar": (carom.Scene.random(8, box=6.0, dimension=2, diameter=0.5, walls=True, obstacles=jar), {}),
        "a bed": (
            carom.Scene.random(6, box=(5.0, 9.0), walls="y", motion=Gravity((0.0, -1.0)), obstacles=[floor]),
            {},
        ),
        "pinned": (fluid.replace(pinned=[0, 5]), {}),
        "wells": (fluid.replace(interaction=SquareWell(1.3, 1.0)), {}),
        "chains": (carom.Scene(places, 6.0, interaction=Bonds(chains(3, 3), 0.8, 2.4)), {}),
    }
    for name, (make, d) in CASES.items():
        if d == 2:
            case = make(d)
            kinds[name] = case.scene, case.settings
    return kinds


@pytest.mark.parametrize("name", scenes())
def test_nothing_overlaps_in_frames_of_any_kind_of_scene(plain, name):
    scene, settings = scenes()[name]
    sim = carom.Simulation(scene, seed=1, **settings)
    report = carom.check(scene, frames=sim.sample(every=0.11, count=15))
    assert report.passed, report
    assert report.tried == {"overlap": 15}


def test_a_scene_is_run_to_be_checked(plain):
    report = carom.check(carom.Scene.random(12, 0.3, 2, seed=1), pairs=10)
    assert report.passed
    assert report.tried == {"overlap": 10}
    still = carom.Scene([[1.0], [3.0]], 6.0, velocities=[[0.0], [0.0]])
    assert carom.check(still).tried == {"overlap": 1}


def test_positions_of_single_precision_are_rounded_to_it(unscheduled):
    scene = carom.Scene.crystal(cells=3, dimension=2, packing_fraction=0.9, lattice="triangular")
    frame = carom.Simulation(scene).frame()
    places = frame.positions.astype(np.float32).astype(float)
    closer = dataclasses.replace(frame, diameters=frame.diameters * (np.pi / 12**0.5 / 0.9) ** 0.5)
    assert carom.check(scene, frames=[closer, dataclasses.replace(closer, positions=places)]).passed
    places[0] += 1e-7
    assert not carom.check(scene, frames=[dataclasses.replace(closer, positions=places)]).passed


def test_what_cannot_be_checked_is_one_sentence(unscheduled):
    scene = carom.Scene.random(12, 0.3, 2, seed=1)
    frame = carom.Simulation(scene).frame()
    with pytest.raises(InputError, match="A frame has 12 particles in 2 dimensions, and the scene 5 in 2"):
        carom.check(carom.Scene.random(5, 0.3, 2), frames=[frame])
    with pytest.raises(InputError, match="frames= goes with a scene, found a Ball"):
        carom.check(Ball((0.0, 0.0), 1.0), frames=[frame])


OPTIONS = "--n 2 -d 1 --eta 0.3 --equilibration 1 --time 5 --frames 3 --no-pictures --check"


def test_a_run_that_is_checked_says_what_overlaps(plain, monkeypatch, tmp_path):
    looked, planted = [], Overlap(0, 1, 0.95, 1.0)

    def deepest(run_state, state):
        looked.append(float(state.instant))
        return planted if len(looked) == 2 else None

    monkeypatch.setattr(driver, "deepest", deepest)
    done = CliRunner().invoke(app, ["run", *OPTIONS.split(), "--out", str(tmp_path)])
    assert done.exit_code == 2
    when = f"{looked[1]:.6g}"
    said = f"In 1 of 3 frames there are overlaps, the first at time {when}: at time {when} {planted}."
    assert said in " ".join(done.output.split())
    # The results are there all the same.
    found = carom.load(tmp_path)._found
    assert found.frames == len(looked) == 3
    assert found.frames_with_overlaps == 1
    assert "in 1 of 3 checked frames" in _health(found)
    none, unknown = (dataclasses.replace(found, frames_with_overlaps=count) for count in (0, None))
    assert "no overlap beyond rounding in 3 checked frames" in _health(none)
    assert "checked" not in _health(unknown)
