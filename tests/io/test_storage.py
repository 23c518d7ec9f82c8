"""What a run keeps where nobody says how much: as many frames and formats as fit 200 MB."""

import json
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.mixtures import mixed

import carom
from carom import Frame, Scene, Simulation, io
from carom.scene_file.scene_file import RunSpec, SceneFile, SceneSpec
from carom.simulation.files import checkpoint
from carom.studies.runs import driver, storage


def plan(frames=None, trajectory=None):
    return SceneFile(run=RunSpec(frames=frames, write=trajectory))


def amount(asked, scene, checkpoint=0):
    return storage.amount(asked, scene, checkpoint)


def short(per_particle=20.0, **run):
    """Return a plan of 108 spheres, of a moment."""
    return SceneFile(
        scene=SceneSpec(lattice="fcc", cells=3, packing_fraction=0.3),
        run=RunSpec(equilibration=5.0, collisions_per_particle=per_particle, pictures=False, **run),
    )


def fluid(n, dimension=3):
    return SimpleNamespace(n=n, dimension=dimension)


@pytest.mark.parametrize(
    ("asked", "scene", "state", "found"),
    [
        (plan(), fluid(500), 0, (("h5md", "extxyz"), 100)),
        (SceneFile(), fluid(2048), 0, (("h5md", "extxyz"), 100)),  # the default run: OVITO and ASE read text
        (plan(), fluid(2500), 0, (("h5md",), 100)),
        # Files have three coordinates. So the half of 200 MB that a checkpoint leaves hold 16 frames of 10^5.
        (plan(), fluid(100_000), 100e6, (("h5md",), 16)),
        (plan(), fluid(100_000, 2), 100e6, (("h5md",), 16)),
        # What is asked for is written whatever its size.
        (plan(1000, ("extxyz", "gsd")), fluid(10_976), 0, (("extxyz", "gsd"), 1000)),
        (plan(1000), fluid(10_976), 0, (("h5md",), 1000)),
        (plan(7), fluid(10_976), 0, (("h5md", "extxyz"), 7)),
        (plan(trajectory=()), fluid(10_976), 0, ((), 100)),
    ],
)
def test_a_run_keeps_what_is_asked_for_or_as_much_as_fits(asked, scene, state, found):
    assert amount(asked, scene, state) == found


def size(scene, formats, frames, state):
    """Bytes of all files, as the rule counts them."""
    coordinates = sum(storage.BYTES[form] for form in formats) * 3 * scene.n
    return state + frames * coordinates + storage.FIXED * scene.n * len(formats) + storage.OTHERS


@pytest.mark.parametrize(("cells", "frames"), [(3, 100), (6, 100), (14, 100), (29, 28)])
def test_the_files_of_a_run_take_200_megabytes(cells, frames):
    """From 10^2 to 10^5 spheres, with the checkpoint."""
    scene = Scene.crystal(cells=cells, packing_fraction=0.45)
    state = checkpoint.size_of_file(Simulation(scene, seed=1)._state)
    formats, found = amount(plan(), scene, state)
    assert found == frames
    assert storage.without_trajectory(plan(), scene, formats, state) is None
    assert size(scene, formats, found, state) <= 200e6
    assert size(scene, formats, found + 1, state) > 200e6 or found == 100


def kept(scene, state):
    """The formats of a default run, and why there are none."""
    formats, frames = amount(plan(), scene, state)
    assert frames == 1
    assert amount(plan(1), scene, state) == (("h5md",), 1), "who asks for a frame has it"
    assert amount(plan(trajectory=("gsd",)), scene, state) == (("gsd",), 1)
    return formats, storage.without_trajectory(plan(), scene, formats, state)


@pytest.mark.slow  # for its memory
def test_a_million_spheres_leave_no_room_for_a_frame_and_of_two_million_the_checkpoint_is_too_large():
    """What a state takes is in proportion to N."""
    scene = Scene.crystal(cells=63, packing_fraction=0.45)
    sim = Simulation(scene, seed=1)
    sim.run(time=0.0)
    state = checkpoint.size_of_file(sim._state)
    assert state < 0.8 * checkpoint.size(sim._state)
    formats, sentence = kept(scene, state)
    assert formats == ()
    assert "with one frame the files of 1000188 particles would take more than 200 MB" in sentence
    assert size(scene, (), 0, state) <= 200e6 < size(scene, ("h5md",), 1, state)
    formats, sentence = kept(SimpleNamespace(n=2 * scene.n, dimension=3), 2 * state)
    assert formats == ()
    assert f"the checkpoint alone takes up to {2 * state / 1e6:.0f} MB" in sentence
    assert 2 * state > 200e6


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["spheres", "dilute", "dilute disks", "a mixture of disks"])
def test_a_million_of_any_kind_take_200_megabytes(kind, tmp_path):
    """Written, and in random order: diffusion makes neighbors as random, and checkpoints as large."""
    m = 10**6
    scene = {
        "spheres": lambda: Scene.crystal(cells=63, packing_fraction=0.45),
        "dilute": lambda: Scene.crystal(cells=63, packing_fraction=0.1),
        "dilute disks": lambda: Scene.random(m, 0.2, 2, seed=0),
        "a mixture of disks": lambda: Scene.random(
            species=mixed(counts=[m // 2] * 2, diameters=[1.0, 0.7]),
            dimension=2,
            packing_fraction=0.5,
            seed=0,
        ),
    }[kind]()
    order = np.random.default_rng(1).permutation(scene.n)
    species = None if scene.species is None else scene.species[order]
    shuffled = Scene(scene.positions[order], scene.box, diameter=scene.diameters[order], species=species)
    sim = Simulation(shuffled, seed=1)
    sim.run(collisions_per_particle=2)
    state = checkpoint.size_of_file(sim._state)
    sim.save(tmp_path / "c")
    written = (tmp_path / "c").stat().st_size
    formats, frames = amount(plan(), scene, state)
    print(kind, scene.n, checkpoint.size(sim._state) / 1e6, state / 1e6, written / 1e6, formats)
    assert written <= state
    # Disks that are dilute leave room for a frame.
    assert size(scene, formats, frames if formats else 0, written) <= 200e6


@pytest.mark.parametrize(
    ("count", "frames"), [(400_000, 2), (500_000, 3), (600_000, 2), (750_000, 1), (800_000, 0)]
)
def test_frames_become_fewer_the_larger_a_system_is(count, frames):
    scene = SimpleNamespace(n=count, dimension=3)
    state = 300 * count if count < 420_000 else 182 * count
    formats, found = amount(plan(), scene, state)
    assert (len(formats), found) == ((1, frames) if frames else (0, 1))
    assert size(scene, formats, frames, state) <= 200e6


@pytest.mark.parametrize("equal", [True, False])
def test_a_packed_checkpoint_holds_the_same_bits_and_is_as_small_as_is_thought(equal, tmp_path, monkeypatch):
    """In random order, as diffusion makes it: numbers of neighbors are then as random as they can be."""
    scene = Scene.crystal(cells=10, packing_fraction=0.45)
    order = np.random.default_rng(1).permutation(scene.n)
    sim = Simulation(Scene(scene.positions[order], scene.box), seed=1)
    sim.run(time=0.0)
    state = checkpoint.size(sim._state)
    sim.save(tmp_path / "plain")
    monkeypatch.setattr(io.checkpoint, "LARGE", 0.0)
    sim.save(tmp_path / "packed")
    sizes = [(tmp_path / name).stat().st_size for name in ("plain", "packed")]
    assert sizes[0] == pytest.approx(state, abs=3e4)
    assert sizes[1] == pytest.approx(checkpoint.size_of_file(sim._state), rel=0.1, abs=3e4)
    assert sizes[1] < 0.8 * state
    (plain, notes), (packed, same) = (io.checkpoint.load(tmp_path / name) for name in ("plain", "packed"))
    assert notes.keys() == same.keys()
    assert plain.keys() == packed.keys()
    for name, array in plain.items():
        assert (array.dtype, array.shape) == (packed[name].dtype, packed[name].shape)
        assert array.tobytes() == packed[name].tobytes()


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("form", ["h5md", "extxyz", "gsd"])
def test_a_frame_takes_about_as_many_bytes_as_is_thought(form, dimension, tmp_path):
    scene, dice = Scene.random(5000, 0.3, dimension, seed=0), np.random.default_rng(1)
    ones, sizes = np.ones(5000), []
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
    small = short()
    # Two dozen frames of 108 spheres in one format, beside a checkpoint.
    monkeypatch.setattr(storage, "SMALL", 0.0)
    state = checkpoint.size_of_file(Simulation(small.build_scene(), seed=1)._state)
    frames = 24.5 * 108 * 3 * storage.BYTES["h5md"] + storage.FIXED * 108
    monkeypatch.setattr(storage, "KEPT", frames + state + storage.OTHERS)
    found = carom.run(small, tmp_path / "run")
    assert found.summary["frames"] == 24
    assert found.summary["trajectories"] == ["trajectory.h5md"]
    assert not (tmp_path / "run" / "trajectory.extxyz").exists()
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["frames"] == 24
    with io.open(tmp_path / "run" / "trajectory.h5md") as reader:
        assert len(reader) == 24
    assert sum(path.stat().st_size for path in (tmp_path / "run").iterdir()) < storage.KEPT


def everything_is_large(monkeypatch):
    """What is done with states of more than 100 MB is done with any."""
    for module in (io.checkpoint, driver):
        monkeypatch.setattr(module, "LARGE", 0.0)


def test_a_run_with_no_room_for_a_frame_says_so_and_has_all_else(tmp_path, monkeypatch):
    """Its g(r) is that of the state at the end: what the one frame would have held."""
    small = short()
    one = carom.run(short(frames=1), tmp_path / "one")
    everything_is_large(monkeypatch)
    sim = Simulation(small.build_scene(), seed=1)
    sim.run(time=0.0)
    monkeypatch.setattr(storage, "KEPT", checkpoint.size_of_file(sim._state) + 3e3 + storage.OTHERS)
    with pytest.warns(
        carom.errors.CaromWarning, match="No trajectory: with one frame the files of 108 particles"
    ):
        found = carom.run(small, tmp_path / "none")
    assert found.summary["trajectories"] == []
    assert "Set frames = 1 for a frame." in found.summary["without_trajectory"]
    assert one.summary["without_trajectory"] is found.summary["without_rdf"] is None
    assert sorted(path.name for path in (tmp_path / "none").iterdir() if not path.name.startswith(".")) == [
        "checkpoint.h5", "rdf.csv", "scene.toml", "summary.json", "timing.json",
    ]  # fmt: skip
    assert (tmp_path / "none" / "rdf.csv").read_bytes() == (tmp_path / "one" / "rdf.csv").read_bytes()
    with io.open(tmp_path / "one" / "trajectory.h5md") as reader:
        last, now = reader[0], Simulation.load(tmp_path / "none" / "checkpoint.h5").frame()
    assert np.array_equal(last.positions, now.positions)
    assert np.array_equal(last.velocities, now.velocities)


def test_a_run_without_frames_goes_on_from_a_packed_checkpoint_bit_for_bit(tmp_path, monkeypatch):
    small = short(200.0, checkpoint_every=1e-3)
    everything_is_large(monkeypatch)
    monkeypatch.setattr(storage, "KEPT", 0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", carom.errors.CaromWarning)
        whole = carom.run(small, tmp_path / "whole")

        def stop(part, stage):
            if stage == "Measuring" and part > 0.5:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            carom.run(small, tmp_path / "stopped", progress=stop)
        assert not (tmp_path / "stopped" / "summary.json").exists()
        again = carom.resume(tmp_path / "stopped")
    assert whole.summary == again.summary
    arrays = [io.checkpoint.load(tmp_path / name / "checkpoint.h5")[0] for name in ("whole", "stopped")]
    assert arrays[0].keys() == arrays[1].keys()
    assert all(np.array_equal(arrays[0][name], arrays[1][name]) for name in arrays[0])
