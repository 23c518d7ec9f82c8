"""The command line as a person types it: results, tables, and one clear sentence when something is wrong."""

import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.commands import CAROM, carom, complaints, plan, refused, start, wait_for
from helpers.frames import crystal, write
from helpers.options import COMMANDS

import carom as library
from carom import io
from carom.scene_file.scene_file import SceneFile
from carom.studies.result_folders import LOCK

HELP_SECONDS = 0.5
"""From the issue of the first release: nobody waits for help."""

FOUR_ERRORS = 4.0
"""One run in 16 000 lies further off by chance."""

NAMES = {
    "checkpoint.h5", "pressure.png", "rdf.csv", "rdf.png", "scene.toml", "snapshot.png", "summary.json",
    "timing.json", "trajectory.extxyz", "trajectory.h5md",
}  # fmt: skip


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return the folder of a small run with everything, and what it printed."""
    folder = tmp_path_factory.mktemp("finished")
    done = carom(
        "run", "--lattice", "fcc", "--cells", "4", "--packing-fraction", "0.3", "--seed", "3",
        "--equilibration", "100", "--collisions-per-particle", "1000", "--frames", "20", "--out", "fluid",
        cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder / "fluid", done


# What a run leaves.


def test_a_run_leaves_all_its_files(finished):
    out, _ = finished
    assert {path.name for path in out.iterdir()} == {*NAMES, LOCK}
    for name in ("pressure.png", "rdf.png", "snapshot.png"):
        content = (out / name).read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) > 10_000, f"{name} is nearly empty"


def test_summary_has_its_numbers(finished):
    out, _ = finished
    found = json.loads((out / "summary.json").read_text(), parse_constant=pytest.fail)
    assert found["version"] == library.__version__
    assert (found["seed"], found["n"], found["dimension"], found["frames"]) == (3, 256, 3, 20)
    assert found["packing_fraction"] == pytest.approx(0.3)
    for name in ("mean", "error", "n_eff"):
        assert isinstance(found["Z"][name], float)
    for name in ("mean", "error"):
        assert isinstance(found["contact_value"][name], float)
    # About as many as were asked for: the rate while the lattice melts is off by some.
    assert found["collisions"] == pytest.approx(256 / 2 * 1000, rel=0.1)
    assert found["time"] > 0
    assert 0 <= found["energy_drift"] < 1e-12
    assert 0 <= found["momentum_drift"] < 1e-12
    assert 0 <= found["worst_overlap"] < 1e-12
    assert 0 < found["advancement_fraction"] < 0.15
    timing = json.loads((out / "timing.json").read_text())
    assert 0 < found["collisions"] / timing["collisions_per_second"] < timing["seconds"]


def test_the_pressure_agrees_with_theory(finished):
    out, _ = finished
    found = json.loads((out / "summary.json").read_text())
    z, best = found["Z"], found["theory"][-1]
    assert best["name"] == "Pieprzyk et al."
    assert abs(z["mean"] - best["Z"]) < FOUR_ERRORS * z["error"]
    # sigma(Z - 1) / (Z - 1) is about 1.1 / sqrt(collisions); within a factor of two that is the error bar.
    expected = 1.1 * (z["mean"] - 1) / found["collisions"] ** 0.5
    assert expected / 2 < z["error"] < 2 * expected
    contact, fitted = found["contact_value"], found["contact_value_from_rdf"]
    assert abs(contact["mean"] - fitted["mean"]) < FOUR_ERRORS * np.hypot(contact["error"], fitted["error"])


def test_the_table_tells_the_numbers_of_the_summary(finished):
    out, done = finished
    found = json.loads((out / "summary.json").read_text())
    assert complaints(done) == "", "no progress bar where nobody sees it"
    assert "256 hard spheres at packing fraction 0.3" in done.stdout
    for word in ("Carnahan", "Pieprzyk", "Energy kept to", "no overlap beyond rounding", "carom view fluid"):
        assert word in done.stdout
    mean, error = re.search(r"Z, N = 256 +([\d.]+) ± ([\d.]+)", done.stdout).groups()
    assert float(mean) == pytest.approx(found["Z"]["mean"], abs=float(error))
    assert float(error) == pytest.approx(found["Z"]["error"], rel=0.5)


def test_frames_are_equally_spaced(finished):
    times = [frame.time for frame in io.read(finished[0] / "trajectory.h5md", ":")]
    assert len(times) == 20
    assert len({b - a for a, b in itertools.pairwise(times)}) == 1


def test_overwrite_replaces_the_run_and_nothing_else(finished, tmp_path):
    out = tmp_path / "run"
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    for name in ("summary.json", "checkpoint.h5", "events.h5", "trajectory.gsd"):
        (out / name).write_text("old")
    done = carom(
        "run", "--lattice", "fcc", "--cells", "4", "--packing-fraction", "0.3", "--equilibration", "1",
        "--collisions-per-particle", "10", "--frames", "2", "--no-pictures", "--out", out, "--overwrite",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (out / "notes.txt").read_text() == "mine"
    assert {path.name for path in out.iterdir()} == {name for name in NAMES if not name.endswith("png")} | {
        "notes.txt",
        LOCK,
    }


# Scenes at the border of what there is.


def test_a_run_starts_from_a_data_file_of_lammps(tmp_path):
    places = [(x, y, z) for x in range(3) for y in range(3) for z in range(3)]
    rows = [f"{k + 1} 1 0.8 2.0 {1.1 * x} {1.1 * y} {1.1 * z}" for k, (x, y, z) in enumerate(places)]
    head = "spheres\n\n27 atoms\n1 atom types\n\n0 3.3 xlo xhi\n0 3.3 ylo yhi\n0 3.3 zlo zhi\n"
    (tmp_path / "sphere.data").write_text(head + "\nAtoms # sphere\n\n" + "\n".join(rows) + "\n")
    (tmp_path / "scene.toml").write_text(
        '[scene]\nfile = "sphere.data"\n[run]\nkT = 1.0\nequilibration = 5\n'
        "collisions_per_particle = 100\nframes = 2\npictures = false\n"
    )
    with pytest.warns(library.errors.CaromWarning, match=r"sphere.data \(LAMMPS data\): assumed every axis"):
        found = library.run(tmp_path / "scene.toml", tmp_path / "out")
    assert (found.n, found.summary["diameter"], found.summary["box"]) == (27, 0.8, [3.3] * 3)
    # The mass is that of the density 2 in the file.
    assert found.summary["mass"] == pytest.approx(2.0 * np.pi / 6.0 * 0.8**3)
    assert found.Z.mean > 1.0
    np.testing.assert_array_equal(found.frames[0].diameters, 0.8)


@pytest.mark.parametrize(
    ("scene", "z"),
    [
        # One sphere never meets anybody: Z = 1 exactly.
        ('lattice = "cubic"\nn = 1\npacking_fraction = 0.1', 1.0),
        # Nobody moves: there is no pressure to speak of.
        ("n = 8\n[run]\nkT = 0.0", None),
    ],
    ids=["one sphere", "nothing moves"],
)
@pytest.mark.usefixtures("plain")
def test_scenes_without_collisions_end_properly(tmp_path, scene, z):
    head = "" if "[run]" in scene else "[run]\n"
    (tmp_path / "scene.toml").write_text(
        f"[scene]\n{scene}\n{head}equilibration = 1\ncollisions_per_particle = 10\nframes = 3\n"
    )
    done = carom("run", "scene.toml", "--out", "run", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    found = json.loads((tmp_path / "run" / "summary.json").read_text(), parse_constant=pytest.fail)
    assert found["Z"]["mean"] == z
    assert found["collisions"] == 0
    assert len(io.read(tmp_path / "run" / "trajectory.h5md", ":")) == 3


# Bad input.


FILES = {
    "a_file": "mine",
    "mine.toml": "mine",
    "foreign.h5md": "nothing of the kind",
    "alone.toml": "[scene]\nn = 1\n",
    "bad.toml": "[pack]\nrates = 0.1\n",
    "gone.toml": "[scene]\nfile = 'missing.h5md'",
    "itself.toml": "[scene]\nfile = 'itself.toml'",
    "few.toml": "[run]\nneighbors = 'lists'\n[scene]\nlattice = 'fcc'\nn = 4\npacking_fraction = 0.3",
    "four.toml": "[run]\nwrite = ['extxyz']\n[scene]\ndimension = 4\nn = 16\npacking_fraction = 0.1",
}
"""What stands in a folder where commands are refused."""


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["run", "nowhere.toml"], "nowhere.toml does not exist"),
        (["run", "."], "scene.toml does not exist"),
        (["run", "gone.toml"], "missing.h5md"),
        (["run", "itself.toml"], "itself.toml"),
        (["run", "few.toml"], "neighbor"),
        (["run", "four.toml"], "h5md"),
        (["run", "--out", "a_file"], "a_file"),
        (["run", "--out", "a_file/run"], "a_file"),
        (["run", "--out", "full"], "--overwrite"),
        (["export", "nowhere.h5md", "x.gsd"], "nowhere.h5md"),
        (["export", "a_file", "x.h5md"], "tells no format"),
        (["export", "foreign.h5md", "x.extxyz"], "foreign.h5md"),
        (["export", "foreign.h5md", "foreign.h5md"], "--overwrite"),
        (["measure", "foreign.h5md"], "foreign.h5md"),
        (["eos", "--eta", "0.1:0.2:1"], "first:last:count"),
        (["eos", "--engine", "serial", "--scheduler", "tcp://x:1"], "contradict"),
        (["eos", "missing.toml"], "does not exist"),
        (["pack", "--report"], "--report is for several packings"),
        (["pack", "--cores", "2"], "--cores is for several packings"),
        (["pack", "--seeds", "2", "--overwrite"], "--overwrite is for one packing"),
        (["pack", "--seeds", "2", "--rate", "0.1", "--stage", "0.1:1e3"], "stages, or rate and until_Z"),
        (["pack", "--seeds", "2", "--n", "10", "--species", "5:1"], "counts add up to 5, but n is 10"),
        (["pack", "alone.toml", "--n", "30"], "leave out n, dimension"),
        (["pack", "bad.toml"], "did you mean rate"),
        (["plan", "--eta", "0.3", "--species", "1"], "FRACTION:DIAMETER"),
        (["plan", "nowhere.toml", "--eta", "0.3"], "leave out"),
        (["code", "eight"], "number of points"),
        (["code", "nowhere.toml"], "does not exist"),
        (["init", "a_file"], "expected .toml"),
        (["init", "mine.toml"], "--overwrite"),
        (["init", "--template", "wall"], "it is called walls"),
        (["init", "nowhere/scene.toml"], "nowhere"),
    ],
)
def test_bad_commands_are_refused_in_one_sentence(tmp_path, arguments, sentence):
    for name, content in FILES.items():
        (tmp_path / name).write_text(content)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "summary.json").write_text("{}")
    assert sentence in refused(*arguments, cwd=tmp_path)


@pytest.mark.needs("a user who is not root")
def test_an_unwritable_folder_is_refused(tmp_path):
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    assert "locked" in refused("run", "--out", "locked/run", cwd=tmp_path)


@pytest.mark.needs("Unix")
def test_a_full_disk_is_one_sentence_and_the_run_resumes(tmp_path, finished):
    """A limit on the size of a file stands for the end of the disk: the system says no in the same place."""
    import resource

    scene = plan(tmp_path, equilibration=100, measured=400, frames=50)
    whole, out = tmp_path / "whole", tmp_path / "run"
    assert carom("run", scene, "--out", whole).returncode == 0
    limit = (whole / "trajectory.extxyz").stat().st_size // 2
    assert limit > (whole / "checkpoint.h5").stat().st_size, "the limit must hit the trajectory"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        done = carom("run", scene, "--out", out)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert done.returncode == 2
    *before, error = done.stderr.strip().splitlines()
    assert all(" s: " in line for line in before), "a slow machine says how far it is"
    assert "trajectory.extxyz cannot be written" in error
    kept = len(io.read(out / "trajectory.extxyz", ":"))
    assert 20 <= kept <= 25
    assert carom("resume", out).returncode == 0
    assert (out / "trajectory.extxyz").read_bytes() == (whole / "trajectory.extxyz").read_bytes()


# The other commands.


def test_init_writes_the_default_plan_with_comments(tmp_path):
    done = carom("init", cwd=tmp_path)
    assert done.returncode == 0
    assert "carom run fluid.toml" in done.stdout
    text = (tmp_path / "fluid.toml").read_text()
    assert text.count("#") > 10
    assert SceneFile.from_toml(text) == SceneFile()


def test_export_keeps_every_bit(finished, tmp_path):
    source = finished[0] / "trajectory.h5md"
    assert carom("export", source, "a.extxyz", cwd=tmp_path).returncode == 0
    assert (tmp_path / "a.extxyz").read_bytes() == (finished[0] / "trajectory.extxyz").read_bytes()
    (tmp_path / "a.extxyz").write_text("old")
    done = carom("export", source, "a.extxyz", "--overwrite", cwd=tmp_path)
    assert "20 frames" in done.stdout
    assert len(io.read(tmp_path / "a.extxyz", ":")) == 20


def test_rdf_of_a_file_is_that_of_the_run(finished, tmp_path):
    frames = tmp_path / "trajectory.extxyz"
    shutil.copy(finished[0] / "trajectory.extxyz", frames)
    done = carom("measure", frames, "rdf", cwd=tmp_path)  # the table stands beside the frames
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "rdf.csv").read_bytes() == (finished[0] / "rdf.csv").read_bytes()
    assert (tmp_path / "rdf.png").stat().st_size > 10_000
    contact = json.loads((finished[0] / "summary.json").read_text())["contact_value_from_rdf"]
    assert f"contact value {contact['mean']:.2f}" in done.stdout


HELP = """
import contextlib, sys
from carom.cli import main

for command in sys.argv[1:]:
    sys.argv = ["carom", command, "--help"]
    with contextlib.suppress(SystemExit):
        main()
    print("Loaded", [m for m in ("numpy", "numba", "h5py", "matplotlib", "scipy") if m in sys.modules])
"""


def test_help_has_examples_and_loads_nothing_heavy():
    """Every option and an example, without the engine, h5py or matplotlib."""
    command = [sys.executable, "-c", HELP, *COMMANDS]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    *pages, end = done.stdout.split("Loaded []")
    assert not end.strip()
    for name, page in zip(COMMANDS, pages, strict=True):
        assert f"carom {name}" in page.split("Examples")[1], name


@pytest.mark.timing
def test_help_answers_at_once():
    def seconds():
        began = time.perf_counter()
        subprocess.run([*CAROM, "run", "--help"], capture_output=True, check=True)
        return time.perf_counter() - began

    # The least of several: the others measure what else the machine does.
    assert min(seconds() for _ in range(5)) < HELP_SECONDS


@pytest.mark.ci
@pytest.mark.needs("Unix")
def test_progress_is_shown_on_a_terminal(tmp_path):
    import pty

    ours, theirs = pty.openpty()
    command = [
        *CAROM, "run", "--n", "256", "--packing-fraction", "0.4", "--equilibration", "1",
        "--collisions-per-particle", "300", "--frames", "2", "--no-pictures", "--json",
    ]  # fmt: skip
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=theirs, text=True)
    os.close(theirs)
    seen = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:  # Linux reports the end of a terminal so.
            break
        if not part:
            break
        seen += part
    os.close(ours)
    printed, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    assert json.loads(printed)["n"] == 256
    assert b"Measuring" in seen or b"Equilibrating" in seen


def test_ctrl_c_before_anything_is_kept_leaves_quietly(tmp_path):
    words = ("--lattice", "fcc", "--cells", "4", "--packing-fraction", "0.3", "--equilibration", "1e5")
    process = start("run", *words, "--out", "run", cwd=tmp_path)
    wait_for(lambda: (tmp_path / "run" / "scene.toml").exists(), process)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert complaints(SimpleNamespace(stderr=errors)).startswith("Stopped")


def test_the_picture_of_g_is_not_replaced_unasked(tmp_path):
    write(tmp_path / "a.extxyz", [crystal(3, 2)])
    (tmp_path / "rdf.png").write_text("old")
    assert "rdf.png" in refused("measure", "a.extxyz", "rdf", cwd=tmp_path)
