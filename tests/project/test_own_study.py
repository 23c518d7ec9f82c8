"""The section on a study of one's own: its file is short, and runs as the page says."""

import contextlib
import csv
import json
import re
import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from helpers.commands import WAIT, in_this_process

import carom
from carom.studies.at_path import info

PAGE = Path(__file__).parents[2] / "docs" / "studies.md"
(SCRIPT,) = (
    block
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    if "own.command" in block
)


class Moving:
    """Stands for a simulation, which would compile for a quarter of a minute."""

    def __init__(self, scene, seed):
        assert scene.n == 12

    def run(self, **how):
        assert how["collisions_per_particle"] > 0

    def measure(self, observable, **how):
        path = SimpleNamespace(mean=SimpleNamespace(mean=0.25, error=0.125))
        return SimpleNamespace(free_path=[path, path])


@pytest.fixture
def there(tmp_path):
    """A folder with the script of the page."""
    (tmp_path / "mean_free_path.py").write_text(SCRIPT, encoding="utf-8")
    return tmp_path


@pytest.fixture
def run(there, monkeypatch, capsys):
    """Return a function that runs the script with few particles: its exit code, and what it printed."""
    monkeypatch.setattr("carom.Simulation", Moving)

    def typed(*options):
        monkeypatch.setattr(sys, "argv", ["mean_free_path.py", "--n", "12", "-j", "1", *options])
        with contextlib.chdir(there), in_this_process(), pytest.raises(SystemExit) as ended:
            runpy.run_path("mean_free_path.py", run_name="__main__")
        return ended.value.code or 0, *capsys.readouterr()

    return typed


def test_the_script_is_short():
    assert len(SCRIPT.splitlines()) < 80


def test_the_script_has_folder_resume_table_picture_page_and_command(there, run):
    code, printed, errors = run("--ratio", "1", "--report")
    assert code == 0, errors
    folder = there / "carom-mean-free-path"
    names = {"study.toml", "study.json", "tasks", "mean-free-path.csv", "mean-free-path.png", "report.html"}
    assert names <= {path.name for path in folder.iterdir()}
    assert "ratio" in printed
    assert "σ is the small diameter." in printed
    done = {path: path.read_bytes() for path in (folder / "tasks").iterdir()}
    assert len(done) == 1
    code, printed, errors = run("--ratio", "1,2", "--json")
    assert code == 0, errors
    assert len(list((folder / "tasks").iterdir())) == 2
    assert all(path.read_bytes() == text for path, text in done.items()), "a finished task ran again"
    table = json.loads(printed)["table"]
    with (folder / "mean-free-path.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["path"]) for row in rows] == [row["path"] for row in table]
    assert {(row["path"], row["path_error"]) for row in table} == {(0.25, 0.125)}
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Mean free path" in page
    assert "python mean_free_path.py study.toml" in page
    # A study is known by its folder where its class was imported.
    for known in (carom.load(folder), carom.resume(folder)):
        assert (type(known).__name__, len(known.table)) == ("Paths", 4)
    assert info(folder).state == "finished"
    code, printed, errors = run("--ratio", "1", "--seed", "2")
    assert code == 2
    assert "seed was 1 and is 2 now" in errors


@pytest.mark.ci
def test_its_paths_are_those_of_enskog(there):
    words = ["mean_free_path.py", "--n", "60", "-j", "1", "--ratio", "1,2", "--json"]
    done = subprocess.run([sys.executable, *words], cwd=there, capture_output=True, text=True, timeout=WAIT)
    assert done.returncode == 0, done.stderr
    # Enskog's theory is good to some percent at this density; the rest is the error of so short a run.
    for row in json.loads(done.stdout)["table"]:
        assert abs(row["path"] - row["enskog"]) < 5.0 * row["path_error"] + 0.05 * row["enskog"], row


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--ratio", "0.5"), "ratio must be"),
        (("--ratio", "a"), "must be numbers with commas"),
        (("nowhere.toml",), "does not exist"),
        (("--seed", "-1"), "seed must be"),
    ],
)
def test_bad_input_is_one_sentence(run, options, said):
    code, printed, errors = run(*options)
    assert (code, printed) == (2, "")
    assert said in errors
    assert errors.startswith("Error: ")
    assert errors.count("\n") == 1
