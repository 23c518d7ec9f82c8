"""The section on a study of one's own: its file is short, and runs as the page says."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.commands import WAIT

PAGE = Path(__file__).parents[2] / "docs" / "studies.md"
(SCRIPT,) = (
    block
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    if "own.command" in block
)


@pytest.fixture(scope="module")
def there(tmp_path_factory):
    """A folder with the script of the page."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "mean_free_path.py").write_text(SCRIPT, encoding="utf-8")
    return folder


def run(there, *options):
    """Run the script with few particles."""
    command = [sys.executable, "mean_free_path.py", "--n", "60", "-j", "1", *options]
    return subprocess.run(command, cwd=there, capture_output=True, text=True, timeout=WAIT)


def test_the_script_is_short():
    assert len(SCRIPT.splitlines()) < 80


def test_the_script_has_folder_resume_table_picture_page_and_command(there):
    first = run(there, "--ratio", "1,2", "--report")
    assert first.returncode == 0, first.stderr
    folder = there / "carom-mean-free-path"
    names = {"study.toml", "study.json", "tasks", "mean-free-path.csv", "mean-free-path.png", "report.html"}
    assert names <= {path.name for path in folder.iterdir()}
    assert "ratio" in first.stdout
    assert "σ is the small diameter." in first.stdout
    done = {path: path.read_bytes() for path in (folder / "tasks").iterdir()}
    assert len(done) == 2
    more = run(there, "--ratio", "1,2,4", "--json")
    assert more.returncode == 0, more.stderr
    assert len(list((folder / "tasks").iterdir())) == 3
    assert all(path.read_bytes() == text for path, text in done.items()), "a finished task ran again"
    table = json.loads(more.stdout)["table"]
    with (folder / "mean-free-path.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["path"]) for row in rows] == [row["path"] for row in table]
    # Enskog's theory is good to some percent at this density; the rest is the error of so short a run.
    for row in table:
        assert abs(row["path"] - row["enskog"]) < 5.0 * row["path_error"] + 0.05 * row["enskog"], row
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Mean free path" in page
    assert "python mean_free_path.py study.toml" in page


def test_bad_input_is_one_sentence(there):
    for options, said in (
        (("--ratio", "0.5"), "ratio must be"),
        (("--ratio", "a"), "must be numbers with commas"),
        (("nowhere.toml",), "does not exist"),
        (("--seed", "-1"), "seed must be"),
    ):
        done = run(there, *options)
        assert (done.returncode, done.stdout) == (2, ""), options
        assert said in done.stderr, options
        assert done.stderr.startswith("Error: ")
        assert done.stderr.count("\n") == 1


def test_another_seed_needs_a_folder_of_its_own(there):
    assert run(there, "--ratio", "1", "--out", "a").returncode == 0
    done = run(there, "--ratio", "1", "--out", "a", "--seed", "2")
    assert done.returncode == 2
    assert "seed was 1 and is 2 now" in done.stderr
