"""``carom.measure`` and ``carom measure``: all that frames give, and a sentence where they do not."""

import dataclasses
import json
import warnings

import numpy as np
import pytest
from helpers.commands import refused, typed
from helpers.frames import at_rest, write

import carom
from carom import io
from carom.errors import CaromWarning, FileError, InputError
from carom.models import Ball, Gravity, Plane
from carom.observables.rdf import PartialRDF
from carom.studies.measuring import QUANTITIES, WAVES, _System
from carom.studies.result_folders import TABLES

FRAMES = 24


def written(path, scene, count=FRAMES, every=0.25):
    """Write frames of a simulation of a scene to a file; return them."""
    sim = carom.Simulation(scene, seed=1)
    sim.write(path, every=every, count=count)
    return io.read(path, ":")


@pytest.fixture(scope="module")
def fluid(tmp_path_factory):
    """Return a file with frames of a fluid in space."""
    path = tmp_path_factory.mktemp("frames") / "fluid.h5md"
    written(path, carom.Scene.crystal(108, 0.3))
    return path


@pytest.fixture(scope="module")
def box(tmp_path_factory):
    """Return the folder of a run of disks with weight between two walls."""
    folder = tmp_path_factory.mktemp("runs") / "bed"
    scene = carom.Scene.random(24, 0.1, 2, walls="y", motion=carom.models.Gravity((0.0, -1.0)), seed=2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)  # so short a run is in no equilibrium
        carom.run(scene, folder, collisions_per_particle=30, equilibration=5, frames=12, pictures=False)
    return folder


def test_each_quantity_is_that_of_its_observable(fluid):
    frames = io.read(fluid, ":")
    found = carom.measure(fluid)
    assert [*found] == ["rdf", "structure", "msd", "order", "crystal"]
    assert found["rdf"] == carom.RDF().over(frames)
    assert found["msd"] == carom.Dynamics().over(frames)
    assert found["crystal"] == carom.observables.Crystallinity().over(frames)
    order = carom.BondOrder().over(frames)
    assert (found["order"].local_order, found["order"].global_order) == (
        order.local_order,
        order.global_order,
    )
    s = found["structure"]
    alike = carom.StructureFactor(kmax=float(s.k[-1])).over(frames)
    assert np.array_equal(alike.S, s.S)
    assert s.k[-1] > 2.0 * np.pi / frames[0].diameters[0], "beyond the first peak"
    assert 0.95 * WAVES < s.k[-1] * (np.prod(frames[0].box) / frames[0].n) ** (1 / 3) <= WAVES


def test_frames_are_read_once_and_may_come_from_anywhere(fluid):
    frames = io.read(fluid, ":")
    read = []

    def once():
        for frame in frames:
            read.append(frame.time)
            yield frame

    found = carom.measure(once(), "rdf", "msd", carom.BondOrder(4))
    assert read == [frame.time for frame in frames]
    assert [*found] == ["rdf", "msd", "order"]
    assert found["order"].l == 4
    with carom.open(fluid) as reader:
        assert carom.measure(reader, "rdf")["rdf"] == found["rdf"]


def test_progress_goes_to_its_end(fluid):
    seen = []
    carom.measure(fluid, "rdf", progress=lambda part, stage: seen.append(part))
    assert seen == sorted(seen)
    assert (len(seen), seen[-1]) == (FRAMES, 1.0)


def test_a_mixture_has_every_pair(tmp_path):
    large, small = carom.Species("large", count=20), carom.Species("small", count=40, diameter=0.6)
    scene = carom.Scene.random(species=[large, small], packing_fraction=0.2, seed=1)
    frames = written(tmp_path / "mixture.h5md", scene, count=4)
    found = carom.measure(tmp_path / "mixture.h5md", "rdf")["rdf"]
    right = PartialRDF(scene).over(frames)
    assert found == right
    assert [*found] == ["large-large", "large-small", "small-small"]
    done = typed("measure", tmp_path / "mixture.h5md", "rdf")
    assert done.exit_code == 0, done.output
    assert "rdf large-small: g(r)" in done.output
    assert "g large-small" in (tmp_path / "rdf.csv").read_text()
    again = typed("measure", tmp_path / "mixture.h5md", "rdf", "--pair", "large,small", "--json")
    pair = json.loads(again.stdout)["rdf"]
    assert pair["g"] == right["large-small"].to_dict()["g"]


def test_walls_and_gravity_have_a_profile_and_no_g(box):
    with pytest.warns(CaromWarning) as said:
        found = carom.measure(box)
    assert [*found] == ["msd", "order", "profile"]
    assert found["profile"].axis == 1
    assert {str(each.message).split(":")[0] for each in said} == {"No rdf", "No structure"}
    assert all("walls" in str(each.message) for each in said)
    across = carom.measure(box, carom.DensityProfile(axis=0))["profile"]
    assert across.axis == 0
    frames = io.read(box, ":")
    # Of the run it is known that no axis keeps its momentum but x; of frames alone only that y has walls.
    right = carom.Dynamics(conserved=(True, False)).over(frames)
    assert found["msd"] == right


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ({}, (True, True)),
        ({"walls": "y"}, (True, False)),
        ({"obstacles": [Ball((2.0, 2.0), 0.5)]}, (False, False)),
        ({"walls": "x", "obstacles": [Plane((1.0, 0.0), 0.1)]}, (False, True)),
        ({"walls": "x", "motion": Gravity((-1.0, 0.0))}, (False, True)),
    ],
)
def test_displacements_of_a_run_are_about_the_momentum_that_its_scene_keeps(given, kept):
    scene = carom.Scene.random(8, 0.05, 2, seed=1, **given)
    frame = dataclasses.replace(at_rest(scene), images=np.zeros((8, 2), np.int32))
    assert tuple(QUANTITIES["msd"].make(_System(frame, scene)).conserved) == kept


def test_of_frames_of_another_program_no_momentum_is_taken_as_conserved(fluid, tmp_path):
    io.convert(fluid, tmp_path / "fluid.lammpstrj")
    found = carom.measure(tmp_path / "fluid.lammpstrj", "msd")["msd"]
    assert found == carom.Dynamics(conserved=(False,) * 3).over(tmp_path / "fluid.lammpstrj")
    assert found != carom.Dynamics().over(tmp_path / "fluid.lammpstrj")


def test_what_frames_cannot_give_is_said_and_the_rest_measured(fluid, tmp_path):
    frames = io.read(fluid, ":")
    cases = {
        "no image counts": [dataclasses.replace(frame, images=None) for frame in frames],
        "no times": [dataclasses.replace(frame, time=0.0) for frame in frames],
        "not at equal times": [dataclasses.replace(frame, time=frame.time**2) for frame in frames],
        "8 frames are too few": frames[:8],
    }
    for sentence, given in cases.items():
        with pytest.warns(CaromWarning, match=f"^No msd: .*{sentence}"):
            found = carom.measure(given, "rdf", "msd")
        assert [*found] == ["rdf"]
        assert found["rdf"] == carom.RDF().over(given)
    path = tmp_path / "still.extxyz"
    write(path, cases["no times"])
    done = typed("measure", path, "rdf", "msd")
    assert done.exit_code == 3
    assert "Note: No msd: the frames have no times." in done.stderr
    assert {each.name for each in tmp_path.iterdir()} == {"still.extxyz", "rdf.csv", "rdf.png"}
    done = typed("measure", path, "msd")
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1] == "Error: No msd: the frames have no times."


def test_of_a_packing_the_last_frame_is_measured(tmp_path):
    carom.pack(20, dimension=2, rate=0.1, until_Z=1e3, out=tmp_path / "pack", pictures=False)
    found = carom.measure(tmp_path / "pack", "order")["order"]
    last = io.read(tmp_path / "pack", -1)
    assert found.local_order.mean == carom.BondOrder().over([last]).local_order.mean


def test_without_names_nothing_is_said_about_what_never_applies(fluid):
    with warnings.catch_warnings():
        warnings.simplefilter("error", CaromWarning)
        carom.measure(fluid)


@pytest.mark.parametrize(
    ("given", "quantities", "sentence"),
    [
        ([], (), "no frame"),
        (3, (), "frames must be"),
        ([1], (), "frames must hold"),
        (None, ("rfd",), "did you mean rdf"),
        (None, (3,), "names of quantities"),
        (None, ("rdf", "rdf"), "named twice"),
        (None, ("rdf", carom.RDF(bins=3)), "named twice"),
    ],
)
def test_what_is_no_measurement_is_refused_in_a_sentence(fluid, given, quantities, sentence):
    with pytest.raises(InputError, match=f"(?i){sentence}"):
        carom.measure(fluid if given is None else given, *quantities)
    with pytest.raises(FileError):
        carom.measure(fluid.parent / "nowhere.h5md", "rdf")


def test_the_command_writes_a_table_and_a_picture_of_each_and_replaces_its_own(fluid, tmp_path):
    frames = tmp_path / "fluid.h5md"
    frames.write_bytes(fluid.read_bytes())
    for _ in range(2):
        done = typed("measure", frames)
        assert done.exit_code == 0, done.output
    told, lines = done.stdout.splitlines()[:-6], done.stdout.splitlines()[-6:]
    assert told[0].startswith(str(frames))  # what the file holds, as carom info says it
    assert [line.split(":")[0] for line in lines[:-1]] == ["rdf", "structure", "msd", "order", "crystal"]
    assert all("+-" in line for line in lines[:-1])
    for name in ("rdf", "structure", "msd", "order", "crystal"):
        assert f"{name}.csv  {name}.png" in lines[-1]
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        rows = (tmp_path / f"{name}.csv").read_text().splitlines()
        assert next(row for row in rows if not row.startswith("#")).startswith(TABLES[name])
    (tmp_path / "msd.csv").write_text("mine")
    assert "--overwrite" in refused("measure", frames, "rdf", "msd", cwd=tmp_path)
    assert typed("measure", frames, "msd", "--overwrite").exit_code == 0


def test_a_run_that_is_replaced_loses_what_was_measured_from_it_and_no_file_of_the_user(tmp_path):
    scene = carom.Scene.crystal(32, 0.3)
    short = {"collisions_per_particle": 30, "equilibration": 5, "frames": 2, "pictures": False}
    carom.run(scene, tmp_path / "run", **short)
    assert typed("measure", tmp_path / "run", "order", "crystal").exit_code == 0
    assert (tmp_path / "run" / "order.csv").is_file()
    (tmp_path / "run" / "profile.csv").write_text("mine")
    (tmp_path / "run" / "crystal.csv").write_text("mine")
    carom.run(scene, tmp_path / "run", overwrite=True, **short)
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert {"profile.csv", "crystal.csv"} <= names
    assert not {"order.csv", "order.png"} & names


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--bins", "5"], "go with its name"),
        (["rdf", "--axis", "x"], "go with its name"),
        (["profile", "--axis", "7"], "axes 0 to 2"),
        (["rdf", "--out", "table.csv"], "names a folder"),
        (["rdf", "--rmax", "900"], "half of the shortest"),
        (["rdf", "--pair", "0,1"], "species"),
        (["dmsd"], "did you mean msd"),
    ],
)
def test_bad_words_are_one_sentence_and_write_nothing(fluid, tmp_path, words, sentence):
    out = [] if "--out" in words else ["--out", tmp_path / "out"]
    assert sentence in refused("measure", fluid, *words, *out, cwd=tmp_path)


def test_every_quantity_has_a_table_of_its_own_head():
    assert QUANTITIES.keys() == TABLES.keys()
