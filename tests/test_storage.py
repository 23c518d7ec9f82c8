"""What a run keeps where nobody says how much: as many frames and formats as fit 200 MB."""

import json

import numpy as np
import pytest

from carom import Frame, Scene, Simulation, io, studies
from carom.plan.plan import OutputSpec, Plan, RunSpec, SceneSpec
from carom.simulation import checkpoint
from carom.studies.runs import storage


def plan(frames=None, trajectory=None):
    return Plan(run=RunSpec(frames=frames), output=OutputSpec(trajectory=trajectory))


def amount(asked, scene, checkpoint=0):
    return storage.amount(asked, scene, checkpoint)


def test_small_systems_have_a_hundred_frames_in_two_formats():
    assert amount(plan(), Scene.fcc(5, packing_fraction=0.45)) == (("h5md", "extxyz"), 100)


def test_the_default_run_leaves_no_text_and_less_than_20_megabytes():
    scene = Scene.fcc(8, packing_fraction=0.45)  # 2048 spheres
    assert amount(plan(), scene) == (("h5md",), 100)
    assert 100 * scene.n * 3 * storage.BYTES["h5md"] < 20e6


@pytest.mark.parametrize(("cells", "frames"), [(3, 100), (6, 100), (14, 100), (29, 28), (63, 1)])
def test_the_files_of_a_run_of_any_size_take_200_megabytes_or_hold_one_frame(cells, frames):
    """From 10^2 to 10^6 spheres, with the checkpoint: a million leave no room."""
    scene = Scene.fcc(cells, packing_fraction=0.45)
    state = checkpoint.size(Simulation(scene, seed=1).machine)
    formats, found = amount(plan(), scene, state)
    assert found == frames
    coordinates = sum(storage.BYTES[form] for form in formats) * 3 * scene.n

    def size(count):
        return storage.GROWTH * state + count * coordinates + storage.FIXED * scene.n * len(formats) + 1e6

    assert size(found) <= 200e6 or found == 1
    assert size(found + 1) > 200e6 or found == 100


def test_disks_take_as_much_as_spheres():
    """Files have three coordinates. So the half of 200 MB that a checkpoint leaves hold 16 frames of 10^5."""
    spheres = Scene.random(100_000, packing_fraction=0.1)
    disks = Scene.random(100_000, packing_fraction=0.1, dimension=2)
    half = int(100e6 / storage.GROWTH)
    assert amount(plan(), spheres, half) == amount(plan(), disks, half) == (("h5md",), 16)


def test_what_is_asked_for_is_written_whatever_its_size():
    scene = Scene.fcc(14, packing_fraction=0.45)
    assert amount(plan(1000, ("extxyz", "gsd")), scene) == (("extxyz", "gsd"), 1000)
    assert amount(plan(1000), scene) == (("h5md",), 1000)
    assert amount(plan(7), scene) == (("h5md", "extxyz"), 7)
    assert amount(plan(trajectory=()), scene) == ((), 100)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("form", ["h5md", "extxyz", "gsd"])
def test_a_frame_takes_about_as_many_bytes_as_is_thought(form, dimension, tmp_path):
    if form == "gsd":
        pytest.importorskip("gsd")
    scene, dice = Scene.random(5000, packing_fraction=0.3, dimension=dimension), np.random.default_rng(1)
    ones = np.ones(5000)
    sizes = []
    for count in (4, 12):
        path = tmp_path / f"{count}.{form}"
        with io.open(path, "w", scene) as writer:
            for k in range(count):
                positions = dice.uniform(0.0, 1.0, (5000, dimension)) * scene.box
                velocities = dice.normal(size=(5000, dimension))
                images = dice.integers(-2, 3, (5000, dimension), dtype=np.int32)
                writer.write(Frame(k, k, positions, velocities, scene.box, ones, ones, images))
        sizes.append(path.stat().st_size)
    found = (sizes[1] - sizes[0]) / (8 * 5000 * 3)
    if form == "extxyz" and dimension == 2:
        assert found < storage.BYTES[form], "a missing coordinate is one digit of text"
    else:
        # Text has numbers of any length, and images are one digit.
        assert found == pytest.approx(storage.BYTES[form], rel=0.15)


def test_a_run_says_what_it_kept(tmp_path, monkeypatch):
    small = Plan(
        scene=SceneSpec(cells=3, packing_fraction=0.3),
        run=RunSpec(equilibration=5.0, collisions_per_particle=20.0),
        output=OutputSpec(pictures=False),
    )
    # Two dozen frames of 108 spheres in one format, beside a checkpoint.
    monkeypatch.setattr(storage, "SMALL", 0.0)
    state = checkpoint.size(Simulation(small.build_scene(), seed=1).machine)
    frames = 24.5 * 108 * 3 * storage.BYTES["h5md"] + storage.FIXED * 108
    monkeypatch.setattr(storage, "KEPT", frames + storage.GROWTH * state + storage.OTHERS)
    found = studies.run(small, tmp_path / "run")
    assert found.summary["frames"] == 24
    assert found.summary["trajectories"] == ["trajectory.h5md"]
    assert not (tmp_path / "run" / "trajectory.extxyz").exists()
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["frames"] == 24
    with io.open(tmp_path / "run" / "trajectory.h5md") as reader:
        assert len(reader) == 24
    assert sum(path.stat().st_size for path in (tmp_path / "run").iterdir()) < storage.KEPT
