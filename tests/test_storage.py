"""What a run keeps where nobody says how much: as many frames and formats as fit 200 MB."""

import json

import pytest

from carom import Scene, io, studies
from carom.plan.plan import OutputSpec, Plan, RunSpec, SceneSpec
from carom.studies.runs import storage


def plan(frames=None, trajectory=None):
    return Plan(run=RunSpec(frames=frames), output=OutputSpec(trajectory=trajectory))


def test_small_systems_have_a_hundred_frames_in_two_formats():
    assert storage.amount(plan(), Scene.fcc(5, packing_fraction=0.45)) == (("h5md", "extxyz"), 100)


def test_the_default_run_leaves_no_text_and_less_than_20_megabytes():
    scene = Scene.fcc(8, packing_fraction=0.45)  # 2048 spheres
    assert storage.amount(plan(), scene) == (("h5md",), 100)
    assert 100 * scene.n * 3 * storage.BYTES["h5md"] < 20e6


@pytest.mark.parametrize(("cells", "frames"), [(14, 100), (20, 100), (30, 30)])
def test_large_systems_have_what_fits(cells, frames):
    assert storage.amount(plan(), Scene.fcc(cells, packing_fraction=0.45)) == (("h5md",), frames)


def test_what_is_asked_for_is_written_whatever_its_size():
    scene = Scene.fcc(14, packing_fraction=0.45)
    assert storage.amount(plan(1000, ("extxyz", "gsd")), scene) == (("extxyz", "gsd"), 1000)
    assert storage.amount(plan(1000), scene) == (("h5md",), 1000)
    assert storage.amount(plan(7), scene) == (("h5md", "extxyz"), 7)
    assert storage.amount(plan(trajectory=()), scene) == ((), 100)


@pytest.mark.parametrize("form", ["h5md", "extxyz", "gsd"])
def test_a_frame_takes_about_as_many_bytes_as_is_thought(form, tmp_path):
    if form == "gsd":
        pytest.importorskip("gsd")
    scene = Scene.random(5000, packing_fraction=0.3)
    from carom import Simulation

    sizes = []
    for count in (4, 12):
        path = tmp_path / f"{count}.{form}"
        sim = Simulation(scene, kT=1.0, seed=1)
        with io.open(path, "w", scene) as writer:
            for frame in sim.sample(every=0.01, count=count):
                writer.write(frame)
        sizes.append(path.stat().st_size)
    # Text has numbers of any length, and images are one digit.
    found = (sizes[1] - sizes[0]) / (8 * 5000 * 3)
    assert found == pytest.approx(storage.BYTES[form], rel=0.15)


def test_a_run_says_what_it_kept(tmp_path, monkeypatch):
    small = Plan(
        scene=SceneSpec(cells=3, packing_fraction=0.3),
        run=RunSpec(equilibration=5.0, collisions_per_particle=20.0),
        output=OutputSpec(pictures=False),
    )
    # Two dozen frames of 108 spheres in one format.
    monkeypatch.setattr(storage, "SMALL", 0.0)
    monkeypatch.setattr(storage, "KEPT", 24.5 * 108 * 3 * storage.BYTES["h5md"])
    found = studies.run(small, tmp_path / "run")
    assert found.summary["frames"] == 24
    assert found.summary["trajectories"] == ["trajectory.h5md"]
    assert not (tmp_path / "run" / "trajectory.extxyz").exists()
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["frames"] == 24
    with io.open(tmp_path / "run" / "trajectory.h5md") as reader:
        assert len(reader) == 24
