"""`carom eos` as a person types it."""

import csv
import json

import pytest
from helpers.commands import carom, refused

from carom.errors import InputError
from carom.studies import EquationOfState

SHORT = ["--eta", "0.1:0.3:3", "--n", "108", "--collisions-per-particle", "100", "--engine", "serial"]


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    out = tmp_path_factory.mktemp("eos") / "study"
    finished = carom("eos", *SHORT, "--out", out, "--report")
    assert finished.returncode == 0, finished.stderr
    return out, finished.stdout


def test_a_study_leaves_tables_pictures_and_a_report(done):
    out, printed = done
    names = {path.name for path in out.iterdir()}
    assert names == {"study.json", "study.toml", "tasks", "eos.csv", "eos.png", "report.html", ".lock"}
    with (out / "eos.csv").open() as file:
        rows = list(csv.DictReader(file))
    # As typed, whatever the rounding of the scenes.
    assert [row["packing_fraction"] for row in rows] == ["0.1", "0.2", "0.3"]
    assert len(list((out / "tasks").iterdir())) == 6
    for text in ("theory", "0.2", "Mean squared deviation", str(out)):
        assert text in printed.replace("\n", "")


def test_its_file_repeats_it_and_its_folder_needs_no_second_run(done, tmp_path):
    out, _ = done
    before = {path: path.stat().st_mtime_ns for path in (out / "tasks").iterdir()}
    again = carom("eos", out / "study.toml", "--out", out, "--engine", "serial")
    assert again.returncode == 0, again.stderr
    assert {path: path.stat().st_mtime_ns for path in (out / "tasks").iterdir()} == before
    other = carom(
        "eos", out / "study.toml", "--out", tmp_path / "other", "--engine", "serial", "--no-pictures"
    )
    assert other.returncode == 0, other.stderr
    # Nothing in a table is about time on the clock.
    assert (out / "eos.csv").read_bytes() == (tmp_path / "other" / "eos.csv").read_bytes()
    printed = [carom("eos", out / "study.toml", "--out", path, "--json", "--no-pictures").stdout
               for path in (out, tmp_path / "other")]  # fmt: skip
    assert printed[0] == printed[1]
    assert not (tmp_path / "other" / "eos.png").exists()


def test_json_is_all_that_standard_output_holds(done):
    out, _ = done
    finished = carom("eos", out / "study.toml", "--out", out, "--json")
    found = json.loads(finished.stdout)
    assert [row["n"] for row in found["table"]] == [108] * 3
    assert found["runs"] == found["runs_asked_for"] == 6
    assert found["failures"] == []
    assert "null" in finished.stdout or all(row["infinite"] for row in found["table"])


def test_a_table_that_cannot_be_written_is_shown_all_the_same(tmp_path):
    """With a full disk it is all that there is of a long study."""
    short = ["--eta", "0.1", "--n", "32", "--collisions-per-particle", "50", "--engine", "serial"]
    out = tmp_path / "out"
    assert carom("eos", *short, "--out", out, "--no-pictures").returncode == 0
    (out / "eos.csv").unlink()
    (out / "eos.csv").mkdir()
    for options in ([], ["--json"]):
        finished = carom("eos", *short, "--out", out, "--no-pictures", *options)
        assert finished.returncode == 2
        assert "eos.csv" in finished.stderr
        assert "theory" in finished.stdout
    assert len(json.loads(finished.stdout)["table"]) == 1


def test_files_of_the_user_in_the_folder_of_a_study_stay(tmp_path):
    text = (
        "# Mine.\n[study]\npacking_fraction = [0.1]  # first try\nn = 32\nreplicas = 1\n"
        "collisions_per_particle = 50\n"
    )
    (tmp_path / "study.toml").write_text(text)
    (tmp_path / "tasks").mkdir()
    mine = [".notes.tmp", ".draft.tmp.txt", ".study.tmp.json", "tasks/.notes.1.tmp.json", "eos.txt"]
    for name in mine:
        (tmp_path / name).write_text("mine")
    left = [".study.77.tmp.json", f"tasks/.{'0' * 20}.77.tmp.json"]
    for name in left:
        (tmp_path / name).write_text("half")
    finished = carom("eos", "study.toml", "--engine", "serial", "--out", ".", "--no-pictures", cwd=tmp_path)
    assert finished.returncode == 0, finished.stderr
    assert (tmp_path / "study.toml").read_text() == text
    assert all((tmp_path / name).read_text() == "mine" for name in mine)
    assert not any((tmp_path / name).exists() for name in left)
    # Another study, which would need another file of this name.
    said = refused("eos", "study.toml", "--eta", "0.2", "--out", ".", cwd=tmp_path)
    assert "study.toml was written or annotated by somebody" in said


def test_flags_take_the_place_of_what_the_file_says(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(
        "[study]\npacking_fraction = [0.1]\nn = 108\nreplicas = 1\nrelative_error = 0.01\n"
        "equilibration = 20\n[scene]\nmass = 2.0\n"
    )
    finished = carom(
        "eos", file, "--collisions-per-particle", "60", "--replicas", "2", "--engine", "serial",
        "--out", tmp_path / "out", "--no-pictures",
    )  # fmt: skip
    assert finished.returncode == 0, finished.stderr
    tasks = [json.loads(path.read_text())["task"] for path in (tmp_path / "out" / "tasks").iterdir()]
    assert len(tasks) == 2
    assert {task["collisions_per_particle"] for task in tasks} == {60.0}
    assert {task["scene"]["mass"] for task in tasks} == {2.0}


def test_a_run_that_fails_is_told_with_exit_code_3_and_tried_again(tmp_path, monkeypatch):
    """The other density goes on."""

    def measure(task, look, do=EquationOfState.measure):
        if task["scene"]["packing_fraction"] == 0.6:
            raise InputError("no room")
        return do(task, look)

    monkeypatch.setattr(EquationOfState, "measure", staticmethod(measure))
    file = tmp_path / "study.toml"
    file.write_text(
        "[study]\npacking_fraction = [0.1, 0.60]\nn = 32\nreplicas = 1\ncollisions_per_particle = 50\n"
    )
    for options in ([], ["--json"]):
        finished = carom(
            "eos", file, "--engine", "serial", "--out", tmp_path / "out", "--no-pictures", *options
        )
        assert finished.returncode == 3
        assert "Note: 1 of 2 runs failed" in finished.stderr
        assert "1 of 2 runs are done; the same command tries the rest again" in finished.stderr
        assert len(list((tmp_path / "out" / "tasks").glob("*.json"))) == 1
    found = json.loads(finished.stdout)
    assert (found["runs"], found["runs_asked_for"], len(found["failures"])) == (1, 2, 1)
