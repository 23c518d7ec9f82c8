"""``carom info`` tells what lies at a path, ``carom resume`` goes on with it, ``carom view`` shows it."""

import json
import re
import shlex
import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest
from helpers.commands import in_this_process, refused, typed
from helpers.frames import write
from helpers.plain import uncompiled
from helpers.saved import one_of_each

import carom
from carom.studies.folder import Folder

MOST_LINES = 8


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with one of each that can be saved, stopped ones too."""
    where = one_of_each(tmp_path_factory.mktemp("saved"))
    for name, kept in (("run1", ["checkpoint.h5", "scene.toml", "trajectory.h5md"]),
                       ("pack1", ["compression.h5"]), ("eos1", ["study.json"])):  # fmt: skip
        (where / f"half-{name}").mkdir()
        for file in kept:
            shutil.copy(where / name / file, where / f"half-{name}")
    (where / "half-eos1" / "tasks").mkdir()
    shutil.copy(sorted((where / "eos1" / "tasks").iterdir())[0], where / "half-eos1" / "tasks")
    shutil.copytree(where / "run1", where / "begun", ignore=lambda *_: ["checkpoint.h5", "summary.json"])
    frames = carom.io.read(where / "run1", ":")
    write(where / "frames.gsd", frames)
    carom.RDF().over(frames).save(where / "rdf.npz")
    carom.load(where / "eos1").save(where / "eos.json")
    with (
        uncompiled(),
        carom.Simulation(
            carom.Scene.crystal(32, 0.3),
            seed=1,
            event_log=where / "events.h5",
            tuning=carom.Tuning(images=True),
        ) as sim,
    ):
        sim.run(collisions=20)
    (where / "study.toml").write_text("[study]\npacking_fraction = [0.1, 0.2]\nn = 32\n")
    (where / "search.toml").write_text("[code]\nn = 24\n")
    (where / "disks.toml").write_text("[scene]\nn = 50\ndimension = 2\npacking_fraction = 0.3\n")
    return where


THIRTY_TWO = {"n": 32, "dimension": 3}

KINDS = {
    "run1": ("a run", "finished", "carom view run1", {**THIRTY_TWO, "frames": 3, "periodic": [True] * 3}),
    "half-run1": ("a run", "not finished", "carom resume half-run1", {**THIRTY_TWO, "frames": 3}),
    "pack1": (
        "a packing", "finished", "carom view pack1", {"n": 20, "dimension": 2, "periodic": [True] * 2}
    ),
    "half-pack1": ("a packing", "not finished", "carom resume half-pack1", {"n": 20, "dimension": 2}),
    "eos1": (
        "a study", "finished", "carom view eos1",
        {"done": 2, "tasks": 2, "packing_fraction": [0.1, 0.2], "n": [32]},
    ),
    "half-eos1": (
        "a study", "not finished: 1 of 2 runs are done", "carom resume half-eos1", {"done": 1, "tasks": 2}
    ),
    "transport1": ("a study", "finished", "carom view transport1", {}),
    "plan1": ("a plan", "not run", "carom resume plan1", {"n": 32, "replicas": 1}),
    "begun": ("a run", "not begun", "carom resume begun", {}),
    "scene.toml": (
        "a scene file", "", "carom run scene.toml", {**THIRTY_TWO, "packing_fraction": pytest.approx(0.3)}
    ),
    "disks.toml": (
        "a scene file", "", "carom run disks.toml", {"n": 50, "dimension": 2, "packing_fraction": 0.3}
    ),
    "study.toml": ("a study file", "", "carom eos study.toml", {"done": 0, "tasks": 4}),
    "search.toml": ("a study file", "", "carom code search.toml", {"n": 24}),
    "run1/trajectory.h5md": ("a trajectory (h5md)", "", "carom measure run1/trajectory.h5md", {}),
    "run1/trajectory.extxyz": ("a trajectory (extxyz)", "", "carom measure run1/trajectory.extxyz", {}),
    "frames.gsd": ("a trajectory (gsd)", "", "carom measure frames.gsd", {}),
    "run1/summary.json": ("a run", "finished", "carom view run1", {}),
    "run1/checkpoint.h5": ("a checkpoint", "", "carom resume run1", {}),
    "state.h5": ("a checkpoint", "", "carom.load('state.h5')", THIRTY_TWO),
    "events.h5": ("an event log", "", "carom view events.h5", {**THIRTY_TWO, "events": 20}),
    "code.json": ("a saved result (SphericalCode)", "", "carom.load('code.json')", {}),
    "rdf.npz": ("a saved result (RDFResult)", "", "carom.load('rdf.npz')", {}),
    "eos.json": ("a saved result (EquationOfState)", "", "carom.load('eos.json')", {}),
}  # fmt: skip
"""What ``carom info`` says of each: what it is, its state, what to type next, and numbers as JSON."""


@pytest.mark.parametrize("name", KINDS)
def test_everything_is_told_in_a_few_lines_and_as_json(folder, name, monkeypatch):
    monkeypatch.chdir(folder)
    kind, state, after, right = KINDS[name]
    done = typed("info", name)
    assert done.exit_code == 0, done.output
    head, *lines = done.output.splitlines()
    assert f": {kind}" in head
    assert state in head
    assert len(lines) < MOST_LINES
    assert lines[-1].startswith("next")
    assert after in lines[-1]
    found = json.loads(typed("info", name, "--json").output)
    assert (found["kind"], found["next"].split("   ")[0].removesuffix(".plot()")) == (kind, after)
    assert found["state"].startswith(state)
    assert {key: found[key] for key in right} == right


def test_the_result_of_a_run_has_its_error(folder, monkeypatch):
    monkeypatch.chdir(folder)
    run = carom.load("run1")
    found = json.loads(typed("info", "run1", "--json").output)
    assert (found["Z"], found["Z_error"]) == (run.Z.mean, run.Z.error)
    assert f"Z = {run.Z.mean:.2f}"[:5] in typed("info", "run1").output


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("nothing", None), ("table.csv", b"a,b"), ("folder", None), ("bad.toml", b"[scene"),
        ("bad.toml", b"[scene]\nn = -3\n"), ("bad.json", b"{}"), ("bad.json", b"{"), ("bad.npz", b"PK"),
        ("bad.h5", b"carom"), ("bad.h5md", b"\x89HDF"), ("bad.extxyz", b"2\n"), ("bad.gsd", b""),
        ("bad.toml", b"[study]\nfoo = 1\n"), ("noise", b"\xff\xfe"),
    ],
)  # fmt: skip
def test_what_is_unknown_or_damaged_is_one_sentence(tmp_path, monkeypatch, name, content):
    monkeypatch.chdir(tmp_path)
    if name == "folder":
        (tmp_path / name).mkdir()
    if content is not None:
        (tmp_path / name).write_bytes(content)
    for words in ([], ["--json"]):
        assert name in refused("info", name, *words, cwd=tmp_path)


def test_a_study_of_ones_own_is_told_as_far_as_its_folder_tells(tmp_path):
    with Folder(tmp_path).begun(
        {"study": "a study that nobody imports", "version": carom.__version__}, {"ratio": [1, 2]}
    ):
        pass
    found = json.loads(typed("info", tmp_path, "--json").stdout)
    assert (found["kind"], found["study"], found["ratio"], found["done"]) == (
        "a study", "a study that nobody imports", [1, 2], 0,
    )  # fmt: skip
    for command in ("resume", "view"):
        assert "a study that nobody imports" in refused(command, tmp_path)


def test_a_damaged_folder_is_one_sentence(folder, tmp_path):
    shutil.copytree(folder / "run1", tmp_path / "run1")
    (tmp_path / "run1" / "summary.json").write_text("{")
    shutil.copytree(folder / "eos1", tmp_path / "eos1")
    (tmp_path / "eos1" / "study.json").write_text("{}")
    shutil.copytree(folder / "half-pack1", tmp_path / "pack1")
    (tmp_path / "pack1" / "compression.h5").write_bytes(b"carom")
    for name in ("run1", "eos1", "pack1"):
        assert refused("info", name, cwd=tmp_path)


@pytest.mark.parametrize(
    ("name", "printed"),
    [
        ("run1", "was finished already"), ("pack1", "Look: carom view"),
        ("half-eos1", "Results in half-eos1"), ("plan1", "promised"),
    ],
)  # fmt: skip
def test_anything_is_resumed_and_says_what_to_type_next(folder, tmp_path, monkeypatch, name, printed):
    shutil.copytree(folder / name, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    with in_this_process():
        done = typed("resume", name, "-j", "1")
    assert done.exit_code == 0, done.output
    assert printed in done.output
    whole = json.loads(typed("resume", name, "--json", "-q").stdout)
    assert whole
    if name == "half-eos1":
        again, uninterrupted = carom.load(name), carom.load(folder / "eos1")
        assert [r["result"] for r in again.records] == [r["result"] for r in uninterrupted.records]
        assert (tmp_path / name / "eos.csv").is_file()
    if name == "plan1":
        assert typed("info", name).output.splitlines()[0] == "plan1: a plan, finished"
        assert json.loads(typed("info", name, "--json").stdout)["value"] == whole["value"]


def test_the_report_of_a_study_is_shown_and_replaced(folder, tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr("typer.launch", opened.append)
    shutil.copytree(folder / "eos1", tmp_path / "eos1")
    for _ in range(2):
        done = typed("view", tmp_path / "eos1")
        assert done.exit_code == 0, done.output
    assert opened == 2 * [str(tmp_path / "eos1" / "report.html")]
    assert "Equation of state" in (tmp_path / "eos1" / "report.html").read_text(encoding="utf-8")
    assert typed("view", tmp_path / "eos1", "--out", tmp_path / "x.html", "--no-open").exit_code == 0
    (tmp_path / "x.html").write_text("mine")
    done = typed("view", tmp_path / "eos1", "--out", tmp_path / "x.html", "--no-open")
    assert (done.exit_code, (tmp_path / "x.html").read_text()) == (2, "mine")


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("run", ("--dry-run",)), ("pack", ("--collisions", "10", "--no-pictures", "--out", "p")),
        ("transport", ("-c", "20", "--equilibration", "2", "--replicas", "1", "--engine", "serial",
                       "--no-pictures", "--out", "t")),
    ],
)  # fmt: skip
def test_the_folder_of_a_run_stands_for_its_scene(folder, tmp_path, monkeypatch, command, words):
    monkeypatch.chdir(tmp_path)
    carom.run(
        folder / "scene.toml", "run2", collisions_per_particle=20, equilibration=5, frames=1, pictures=False
    )
    with uncompiled() if command == "pack" else nullcontext():
        done = typed(command, "run2", *words)
    assert done.exit_code in (0, 3), done.output
    assert typed(command, tmp_path, *words).stderr.splitlines()[-1].startswith("Error: ")


def test_the_folder_of_a_study_stands_for_its_file(folder, tmp_path):
    words = ("--engine", "serial", "--no-pictures", "-q")
    first, second = tmp_path / "one", tmp_path / "two"
    small = ("--eta", "0.1", "--n", "32", "--replicas", "1", "-c", "40", "--equilibration", "5")
    assert typed("eos", *small, *words, "--out", first).exit_code == 0
    assert typed("eos", first, *words, "--out", second).exit_code == 0
    assert (second / "eos.csv").read_bytes() == (first / "eos.csv").read_bytes()


def test_a_script_of_a_batch_system_starts_or_goes_on_by_one_line(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = ("run", folder / "scene.toml", "-c", "40", "--equilibration", "5", "--frames", "2",
            "--no-pictures", "--out", "out", "--resume")  # fmt: skip
    first, second = typed(*line), typed(*line)
    assert (first.exit_code, second.exit_code) == (0, 0), first.output + second.output
    assert "was finished already" not in first.output
    assert "was finished already" in second.output
    (tmp_path / "out" / "checkpoint.h5").unlink()
    (tmp_path / "out" / "summary.json").unlink()  # as if killed before the first checkpoint
    for name in ("trajectory.h5md", "trajectory.extxyz", "rdf.csv"):
        (tmp_path / "out" / name).unlink()
    assert typed(*line).exit_code == 0
    assert "of another run: [run] seed was 1 and is 7 now" in refused(*line, "--seed", "7")
    assert "contradict" in typed(*line, "--overwrite").stderr


STATES = [("run1/checkpoint.h5", "`carom resume run1` continues it"), ("state.h5", "carom.load('state.h5')")]
LOGS = [("events.h5", "`carom view events.h5` replays it")]


@pytest.mark.parametrize(
    ("words", "name", "after"),
    [
        *((words, *case) for words in (["measure"], ["run"], ["export"]) for case in STATES + LOGS),
        *((["view", "--no-open"], *case) for case in STATES),
    ],
)
def test_a_state_or_a_log_is_not_taken_for_a_damaged_trajectory(folder, words, name, after, monkeypatch):
    monkeypatch.chdir(folder)
    said = refused(words[0], name, *words[1:], *(["new.gsd"] if words[0] == "export" else []))
    assert "holds no frames" in said
    assert after in said.replace(f"{folder}/", "")


def test_resume_of_a_file_of_a_run_names_the_folder(folder, monkeypatch):
    monkeypatch.chdir(folder)
    for name in ("run1/checkpoint.h5", "run1/trajectory.h5md"):
        assert "expected its folder: `carom resume run1`" in refused("resume", name)


@pytest.mark.parametrize("name", ["-x", "two words", "it's $HOME"])
def test_every_command_that_is_told_can_be_typed_whatever_a_folder_is_called(
    folder, tmp_path, monkeypatch, name
):
    monkeypatch.chdir(tmp_path)
    for kind in ("run1", "half-run1", "pack1", "half-eos1", "plan1"):
        shutil.copytree(folder / kind, name)
        command, verb, *words = shlex.split(
            typed("info", f"./{name}").output.splitlines()[-1].removeprefix("next")
        )
        assert (command, verb) == ("carom", KINDS[kind][2].split()[1])
        assert typed("info", *words).output.splitlines()[0].startswith(f"{name}: {KINDS[kind][0]}")
        shutil.rmtree(name)
    done = typed("init", f"./{name}.toml")
    command = re.search("`(.*)`", done.output)[1]
    first = Path(f"{name}.toml").read_text()
    assert first.startswith(f"# {command}: ")
    assert typed(*shlex.split(command)[1:], "--dry-run").exit_code == 0


def test_a_sentence_about_a_folder_names_it_as_it_is_typed(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for kind in ("half-run1", "half-pack1"):
        shutil.copytree(folder / kind, "-x")
        with pytest.raises(carom.errors.FileError, match=r"`carom resume \./-x`"):
            carom.load("-x")
        assert "`carom resume ./-x`" in refused(
            "run" if "run" in kind else "pack", "--n", "8", "--out", "./-x"
        )
        shutil.rmtree("-x")
