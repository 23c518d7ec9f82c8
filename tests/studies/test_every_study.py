"""What holds of every study: one table, a folder that goes on, refusals, ``--json`` and exit codes.

Each runs once, small, as its command runs it. Its folder is copied then, and tasks that run again give what
they gave before, so that nothing is simulated twice.
"""

import contextlib
import csv
import dataclasses
import json
import shutil
import signal
from types import SimpleNamespace
from typing import Any, NamedTuple

import pytest
import typer
from helpers.commands import content, in_this_process
from helpers.plain import uncompiled
from helpers.roots import Roots, RootSpec
from helpers.saved import plan_of_a_moment
from typer.testing import CliRunner

import carom
from carom import cli, spec as specs, studies
from carom.cli import study as command_line
from carom.errors import CaromWarning, FileError, InputError
from carom.observables.statistics import unwarned
from carom.studies import own
from carom.studies.folder import Folder, key
from carom.studies.signals import Interrupted
from carom.studies.study import REGISTERED, perform
from carom.studies.study_registry import STUDIES
from carom.studies.trade import spec


def caps(task, look):
    """Stand for a search: both tries find six points on the axes."""
    points = [[s * (k == axis) for k in range(3)] for axis in range(3) for s in (1.0, -1.0)]
    pairs = [[i, j] for i in range(6) for j in range(i + 1, 6) if i // 2 != j // 2]
    return {"points": [*points], "cosine": 0.0, "contacts": pairs, "forces": [1.0] * len(pairs)}


class Case(NamedTuple):
    """A study of two tasks or more."""

    study: Any
    part: dict[str, Any]  # a grid with a part of the tasks
    other: dict[str, Any] = {"seed": 2}  # noqa: RUF012 - settings that do not mix with those of the study
    said: str = "seed was 1 and is 2 now"
    measure: Any = None  # what stands for a search of seconds
    code: int = 0  # with which its command ends: 3 where a point is flagged
    repeats: bool = True  # whether a result depends on its task alone, and not on how fast this machine is


SMALL = {"n": (32,), "replicas": 1, "collisions_per_particle": 40.0, "equilibration": 5.0}
FLOW = {"n": (12,), "dimension": 2, "replicas": 1, "strains": 0.5, "equilibration": 2.0, "blocks": 16}
GROWING = {"n": 8, "dimension": 2, "rate": 1.0, "until_Z": 100.0, "seeds": 2}
DISKS = {"dimension": 2, "n": 16, "packing_fraction": 0.3}
CASES = {
    "eos": Case(
        studies.EquationOfState(studies.StudySpec((0.1, 0.2), **SMALL)), {"packing_fraction": (0.2,)}
    ),
    "transport": Case(
        studies.Transport(studies.TransportSpec((0.1, 0.2), **SMALL)), {"packing_fraction": (0.2,)}, code=3
    ),
    "shear": Case(
        studies.ShearFlow(studies.ShearSpec((0.1,), rate=(0.5, 1.0), restitution=0.9, **FLOW)),
        {"rate": (1.0,)}, {"restitution": 0.8}, "restitution was 0.9 and is 0.8 now", code=3,
    ),
    "code": Case(
        studies.Codes(studies.CodeSpec(7, tries=2)), {"tries": 1}, {"n": 8}, "n was 7 and is 8 now", caps
    ),
    "pack": Case(
        studies.Packings(studies.PackSpec(pictures=False, **GROWING)),
        {"seeds": 1},
        {"until_Z": 50.0}, "until_Z was 100.0 and is 50.0 now",
    ),
    "trade": Case(studies.Trade(studies.TradeSpec(seconds=0.01, scene=DISKS)), {}, repeats=False),
    "roots": Case(Roots(RootSpec()), {"x": (4.0,)}),
}  # fmt: skip


FEW = {"SIZES": (64,), "INTERVALS": (1.0,), "methods": lambda: [spec.ENGINE]}
"""What ``carom trade`` compares here."""


def test_every_study_has_a_case():
    assert {type(case.study) for case in CASES.values()} == {*STUDIES.values(), Roots}
    assert REGISTERED.items() >= STUDIES.items()


def typed(name, *words):
    """Type a command; that of a study of one's own is the program of the study."""
    apps, words = [cli.app], [*map(str, words), *([] if name == "info" else ["--quiet"])]
    with pytest.MonkeyPatch.context() as patch, in_this_process():
        if name == "roots":
            patch.setattr(command_line, "started", apps.append)
            own.command(Roots)
        return CliRunner().invoke(apps[-1], words if name == "roots" else [name, *words])


class Whole(NamedTuple):
    """A study that is done, as its command left it."""

    name: str
    case: Case
    study: Any
    out: Any
    done: Any
    measured: Any  # how its tasks were measured
    ran: list[Any]  # again, since this test began

    def copied(self, tmp_path):
        return shutil.copytree(self.out, tmp_path / "out")

    def again(self, out, *words):
        """Type the same command for another folder."""
        return typed(self.name, *self.asked, "--out", out, *words)

    @property
    def asked(self):
        return [] if self.name == "roots" else [self.out / "study.toml"]


@pytest.fixture(scope="module")
def wholes():
    return {}


@pytest.fixture(params=CASES)
def whole(request, wholes, tmp_path_factory, monkeypatch):
    """Return a study that is done; whatever runs again gives the result that it gave."""
    name, case = request.param, CASES[request.param]
    for some, value in FEW.items():
        monkeypatch.setattr(f"carom.studies.trade.spec.{some}", value)
    kind = type(case.study)
    if name not in wholes:
        out = tmp_path_factory.mktemp(name)
        (out / "asked.toml").write_text(case.study.spec.to_toml(), encoding="utf-8")
        asked = [] if name == "roots" else [out / "asked.toml"]
        with pytest.MonkeyPatch.context() as patch, uncompiled() if name == "pack" else unwarned():
            if case.measure is not None:
                patch.setattr(kind, "measure", staticmethod(case.measure))
            done = typed(name, *asked, "--out", out / "out", "--no-pictures", "--json")
        wholes[name] = Whole(
            name, case, kind.load(out / "out"), out / "out", done, case.measure or kind.measure, []
        )
    found = wholes[name]
    known = {key(record["task"]): record for record in found.study.records}
    ran = []

    def measure(task, look):
        ran.append(task)
        record = known[key(task)]
        return {**record["result"], "timings": record["provenance"]}

    monkeypatch.setattr(kind, "measure", staticmethod(measure))
    return found._replace(ran=ran)


def results(study):
    return [(record["task"], record["result"]) for record in study.records]


def names(out):
    return {path.name for path in out.iterdir()} - {".lock"}


def refused(whole, out, *words):
    """Type the command where it must not run; return its one sentence."""
    before = content(out) if out.is_dir() else None
    done = whole.again(out, *words)
    assert (done.exit_code, done.stdout, type(done.exception)) == (2, "", SystemExit), done.output
    (said,) = done.stderr.strip().splitlines()
    assert said.startswith("Error: ")
    assert before is None or content(out) == before, "something was touched"
    assert not whole.ran
    return said


# What it gives.


def test_the_command_prints_and_keeps_what_the_function_returns(whole, tmp_path):
    study, out, done = whole.study, whole.out, whole.done
    assert done.exit_code == whole.case.code, done.output
    assert any(map(study.table.flagged, study.table)) == (whole.case.code == 3)
    assert study.complete
    assert len(study.records) == len(study.tasks) >= 2
    assert json.loads(done.stdout) == study.to_dict()
    written = {name for name in study.files() if not name.endswith(".png")}
    assert names(out) == {"study.json", "study.toml", "tasks", *written}
    assert type(study.spec).load(out / "study.toml") == study.spec == whole.case.study.spec


def test_its_table_is_the_same_printed_saved_and_loaded(whole, tmp_path):
    study, table = whole.study, whole.study.table
    assert len(table) > 0
    with (whole.out / f"{study.name}.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [[*row] for row in rows] == [[*table.names()]] * len(table)
    frame, (name, column) = study.to_dataframe(), table.columns()[0]
    assert [*frame.columns] == [*table.names()]
    values = [getattr(row, name) for row in table]
    assert ([*frame[name]], [row[name] for row in rows]) == (values, [*map(str, values)])
    with pytest.raises(InputError, match=r"expected one of \.json, \.csv"):
        study.save(tmp_path / "table.xls")
    study.save(tmp_path / "saved.json")
    for again in (carom.load(tmp_path / "saved.json"), carom.load(whole.out)):
        assert type(again) is type(study)
        assert (again.to_dict(), results(again), again.spec) == (study.to_dict(), results(study), study.spec)
    for shown in (str(study), study._repr_html_()):
        assert all(column.text(row, name) in shown for row in table)
    assert str(study).startswith(f"{study.title}: {len(study.records)} ")
    json.dumps(study.to_dict(), allow_nan=False)


def test_a_result_follows_from_its_task(whole):
    """Not from the time on the clock, and not from the tasks before."""
    record = whole.study.records[-1]
    if whole.case.repeats:
        with uncompiled() if whole.name == "pack" else unwarned():
            assert perform(whole.measured, record["task"])["result"] == record["result"]
    assert not {"cpu_seconds", "began", "host"} & record["result"].keys()


def test_its_page_is_whole_and_what_is_not_known_yet_is_not_drawn(whole, tmp_path):
    study = whole.study
    study.report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("<table") == page.count("</table>") > 0
    assert page.count("data:image/svg") >= (study.picture() is not None)
    half, nothing = (dataclasses.replace(study, records=study.records[:n]) for n in (1, 0))
    assert half.progress in str(half)
    half.picture()
    assert str(nothing).startswith(f"{nothing.title}: 0 of {len(study.tasks)} {study.unit} done")
    with pytest.raises(InputError, match="nothing to draw"):
        nothing.plot()


# The folder.


def test_only_what_is_missing_runs_and_what_is_damaged_is_missing(whole, tmp_path):
    out = whole.copied(tmp_path)
    before = content(out)
    assert results(carom.resume(out, cores=1)) == results(whole.study)
    again = whole.again(out, "--json", "--no-pictures")
    assert (again.exit_code, again.stdout) == (whole.done.exit_code, whole.done.stdout)
    assert whole.ran == []
    assert content(out) == before
    first, second = (Folder(out).result(task) for task in whole.study.tasks[:2])
    first.unlink()
    damaged = json.loads(second.read_text(encoding="utf-8"))
    damaged["provenance"]["seconds"] += 1.0
    second.write_text(json.dumps(damaged), encoding="utf-8")
    half = carom.load(out)
    assert (half.complete, len(half.records)) == (False, len(whole.study.tasks) - 2)
    info = json.loads(typed("info", out, "--json").stdout)
    assert (info["kind"], info["state"].split(":")[0], info["next"]) == (
        "a study", "not finished", f"carom resume {out}",
    )  # fmt: skip
    half.report(out / "report.html")
    of_half = (out / "report.html").read_bytes()
    resumed = typed("resume", out, "--json")
    assert resumed.exit_code == whole.done.exit_code, resumed.output
    assert (out / "report.html").read_bytes() != of_half
    assert [key(task) for task in whole.ran] == [key(task) for task in whole.study.tasks[:2]]
    assert json.loads(resumed.stdout) == json.loads(whole.done.stdout)
    assert results(carom.load(out)) == results(whole.study)
    assert json.loads(typed("info", out, "--json").stdout)["state"].startswith("finished")


def test_a_grid_may_grow_and_shrink(whole, tmp_path):
    asked = whole.study.spec
    if not whole.case.part:
        assert asked.grid == ()
        for how in ({"executor": "threads"}, {"cores": 2}):
            with pytest.raises(InputError, match="run one after the other"):
                whole.study.run(**how)
        return
    part = type(whole.study)(asked.replaced(**whole.case.part)).run(executor="serial", out=tmp_path)
    assert 0 < len(part.records) == len(whole.ran) < len(whole.study.tasks)
    done = type(whole.study)(asked).run(executor="threads", out=tmp_path)
    assert len(whole.ran) == len(whole.study.tasks)
    assert results(done) == results(whole.study)
    assert results(type(part)(part.spec).run(executor="serial", out=tmp_path)) == results(part)
    assert len(whole.ran) == len(whole.study.tasks)


def test_ctrl_c_keeps_what_is_done_and_the_same_command_goes_on(whole, tmp_path):
    study, out = whole.study, tmp_path / "out"
    told, so_far = [], []

    def progress(fraction, text):
        told.append((fraction, text))
        if len(told) == 2:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(
        Interrupted, match=f"of {len(study.tasks)} {study.unit} are done, and the same"
    ) as stopped:
        type(study)(study.spec).run(executor="serial", out=out, progress=progress, look=so_far.append)
    count = len(stopped.value.so_far.records)
    assert (count, [len(each.records) for each in so_far]) == (1, [0, 1])
    assert told[0] == (0.0, f"0 of {len(study.tasks)} {study.unit}")
    assert [f for f, _ in told] == sorted(f for f, _ in told)
    kept = content(out / "tasks")
    assert len(kept) == count
    assert Folder(out).held()["settings"] == json.loads(json.dumps(study.spec.settings()))
    done = whole.again(out, "--json", "--no-pictures")
    assert (done.exit_code, json.loads(done.stdout)) == (whole.done.exit_code, json.loads(whole.done.stdout))
    assert len(whole.ran) == len(study.tasks)
    assert content(out / "tasks").items() >= kept.items()


def test_a_command_that_is_stopped_ends_with_130_and_has_its_file(whole, tmp_path, monkeypatch):
    def stopped(task, look):
        signal.raise_signal(signal.SIGINT)
        return replay(task, look)

    study, out, replay = whole.study, tmp_path / "out", type(whole.study).measure
    monkeypatch.setattr(type(study), "measure", staticmethod(stopped))
    done = whole.again(out, "--no-pictures")
    assert done.exit_code == 130
    assert f"of {len(study.tasks)} {study.unit} are done, and the same command goes on" in done.stderr
    assert bool(done.stdout) == study.anytime
    assert study.spec.load(out / "study.toml") == study.spec
    monkeypatch.setattr(type(study), "measure", staticmethod(replay))
    assert whole.again(out, "--no-pictures").exit_code == whole.done.exit_code
    assert len(whole.ran) == len(study.tasks)


@pytest.mark.parametrize(
    ("flagged", "complete", "kept", "code"),
    [
        ([], True, True, 0), ([False, False], True, True, 0), ([False, True], True, True, 3),
        ([True, False], True, True, 3), ([False], False, True, 3), ([False], True, False, 3),
    ],
)  # fmt: skip
def test_a_study_ends_with_three_if_any_point_is_flagged_missing_or_lost(
    flagged, complete, kept, code, tmp_path
):
    class Rows(list):
        flagged = bool

    study = SimpleNamespace(
        table=Rows(flagged), complete=complete, progress="1 of 2 runs", records=[{"task": "a"}, {"task": "b"}]
    )
    for name in ("a", "b") if kept else ("a",):
        (tmp_path / name).touch()
    with pytest.raises(typer.Exit) if code else contextlib.nullcontext() as ended:
        command_line.finish(study, SimpleNamespace(result=lambda task: tmp_path / task))
    assert not code or ended.value.exit_code == code


def test_a_task_that_fails_costs_itself_alone_and_is_tried_again(whole, tmp_path, monkeypatch):
    study, out = whole.study, tmp_path / "out"
    bad, replay = study.tasks[1], type(study).measure

    def measure(task, look):
        if key(task) == key(bad):
            raise RuntimeError("out of luck")
        return replay(task, look)

    monkeypatch.setattr(type(study), "measure", staticmethod(measure))
    for options in ([], ["--json"]):
        done = whole.again(out, "--no-pictures", *options)
        assert done.exit_code == 3, done.output
        assert (
            f"1 of {len(study.tasks)} {study.unit} failed, the first one {study.place(bad)}: RuntimeError"
            in done.stderr
        )
        assert "are done; the same command tries the rest again" in done.stderr
    found = json.loads(done.stdout)
    assert (found["runs"], found["runs_asked_for"]) == (len(study.tasks) - 1, len(study.tasks))
    assert found["failures"] == [{"task": bad, "reason": "RuntimeError: out of luck"}]
    assert len(whole.ran) == len(study.tasks) - 1
    monkeypatch.setattr(type(study), "measure", staticmethod(replay))
    assert whole.again(out, "--no-pictures").exit_code == whole.done.exit_code
    assert [key(whole.ran[-1]), len(whole.ran)] == [key(bad), len(study.tasks)]


def test_a_full_disk_loses_nothing_that_is_in_memory(whole, tmp_path, monkeypatch):
    study, store, room = whole.study, Folder.store, []

    def full(self, record):
        if not room:
            raise FileError("disk full")
        store(self, record)

    monkeypatch.setattr(Folder, "store", full)
    count = len(study.tasks)
    with pytest.warns(CaromWarning, match=f"{count} results could not be kept: disk full"):
        known = type(study)(study.spec).run(executor="serial", out=tmp_path)
    assert results(known) == results(study)
    assert not [*(tmp_path / "tasks").glob("*")]
    done = whole.again(tmp_path, "--no-pictures")
    assert (done.exit_code, "could not be kept" in done.stderr) == (3, True)
    # Room again when all have failed, as after an old file was deleted.
    again = type(study)(study.spec).run(
        executor="serial", out=tmp_path, progress=lambda done, _: done == 1.0 and room.append(1)
    )
    assert again.complete
    assert len([*(tmp_path / "tasks").glob("*.json")]) == count


def test_a_table_that_cannot_be_written_is_shown_all_the_same(whole, tmp_path):
    out = whole.copied(tmp_path)
    (out / f"{whole.study.name}.csv").unlink()
    (out / f"{whole.study.name}.csv").mkdir()
    done = whole.again(out, "--json", "--no-pictures")
    assert (done.exit_code, done.stdout) == (2, whole.done.stdout)
    assert f"{whole.study.name}.csv" in done.stderr


def test_what_a_kill_left_beside_a_result_is_removed(whole, tmp_path):
    """Between its writing and the end of its state; and what it left of one, which is none."""
    out, task = whole.copied(tmp_path), whole.study.tasks[0]
    folder = Folder(out)
    folder.kept(task).write_bytes(b"a state")
    folder.result(task).with_name(".0123456789abcdef0123.77.tmp.json").write_bytes(b"half")
    assert folder.done() == len(whole.study.records)
    assert whole.again(out, "--no-pictures").exit_code == whole.done.exit_code
    assert {path.suffix for path in (out / "tasks").iterdir()} == {".json"}
    assert len([*(out / "tasks").iterdir()]) == folder.done()


# What is refused, and changes nothing.


def test_other_settings_another_version_and_a_folder_in_use_are_refused(whole, tmp_path, monkeypatch):
    out, case = whole.copied(tmp_path), whole.case
    other = type(whole.study)(whole.study.spec.replaced(**(case.other)))
    before = content(out)
    with pytest.raises(FileError, match="holds the results of another") as error:
        other.run(executor="serial", out=out)
    assert case.said in str(error.value) or not case.part
    with Folder(out).owned():
        said = refused(whole, out)
        assert "Another process" in said
    with monkeypatch.context() as patch:
        patch.setattr(specs, "__version__", "99.0.0")
        assert "version was" in refused(whole, out)
    assert content(out) == before


def test_no_process_enters_while_another_writes_its_files(whole, tmp_path, monkeypatch):
    out, other = whole.copied(tmp_path), []

    def write(study, out, **_):
        with pytest.raises(FileError, match="Another process"):
            study.run(executor="serial", out=out)
        other.append("refused")

    monkeypatch.setattr("carom.cli.study.write", write)
    assert whole.again(out, "--no-pictures").exit_code == whole.done.exit_code
    assert other


def test_a_folder_of_other_results_and_a_file_are_refused(whole, tmp_path):
    with pytest.raises(FileError, match="holds no study"):
        type(whole.study).load(tmp_path)
    for name in {*CASES} - {whole.name}:
        with Folder(tmp_path / name).begun({"study": CASES[name].study.spec.study, "version": "1"}, {}):
            pass
        said = refused(whole, tmp_path / name)
        assert f"{name} holds the results of another study" in said
        assert f'study was "{CASES[name].study.spec.study}"' in said
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "study.json").write_text("{}")
    assert "not the description of a study" in refused(whole, tmp_path / "foreign")
    for name in ("report.html", f"{whole.study.name}.csv"):
        (tmp_path / "mine").mkdir(exist_ok=True)
        (tmp_path / "mine" / name).write_text("mine")
        assert f"{name} exists already" in refused(whole, tmp_path / "mine")
        (tmp_path / "mine" / name).unlink()
    (tmp_path / "a.csv").write_text("")
    assert "--out is a folder" in refused(whole, tmp_path / "a.csv")
    (tmp_path / "file").write_text("")
    assert "is a file" in refused(whole, tmp_path / "file")
    (tmp_path / "link").symlink_to(tmp_path / "gone")
    assert "does not exist; create that" in refused(whole, tmp_path / "link")


def test_files_of_the_user_stay_and_what_a_killed_process_left_goes(whole, tmp_path):
    out = tmp_path / "out"
    (out / "tasks").mkdir(parents=True)
    text = f"# Mine.\n{whole.study.spec.to_toml()}"
    mine = [
        ".notes.tmp", ".draft.tmp.txt", ".study.tmp.json", ".study.7.tmp", ".study.7x.tmp.json",
        "study.7.tmp.json", ".notes.7.tmp.json", "tasks/.notes.1.tmp.json", "eos.txt",
    ]  # fmt: skip
    left = [".study.77.tmp.json", f"tasks/.{'0' * 20}.77.tmp.json", f".{whole.study.name}.1.tmp.csv"]
    for name in (*mine, *left):
        (out / name).write_text("mine")
    asked = [] if whole.name == "roots" else [out / "study.toml"]  # whose command has no argument
    (out / "study.toml").write_text(text, encoding="utf-8")
    done = typed(whole.name, *asked, "--out", out, "--no-pictures")
    assert done.exit_code == whole.done.exit_code, done.output
    assert len(whole.ran) == len(whole.study.tasks)
    assert (out / "study.toml").read_text(encoding="utf-8") == text
    assert all((out / name).read_text() == "mine" for name in mine)
    assert not any((out / name).exists() for name in left)
    if whole.case.part and asked:
        # Another study, which would need another file of this name.
        part = whole.study.spec.replaced(**whole.case.part)
        (tmp_path / "part.toml").write_text(part.to_toml(), encoding="utf-8")
        done = typed(whole.name, tmp_path / "part.toml", "--out", out)
        assert (done.exit_code, done.stdout) == (2, "")
        assert "study.toml was written or annotated by somebody" in done.stderr


def test_the_runs_of_a_plan_go_on_as_those_of_a_study(tmp_path):
    plan_of_a_moment().save(tmp_path)
    first = typed("resume", tmp_path, "--json")
    assert first.exit_code == 0, first.output
    (file,) = (tmp_path / "tasks").iterdir()
    before = file.read_bytes()
    assert typed("resume", tmp_path, "--json").stdout == first.stdout
    assert file.read_bytes() == before
    file.write_bytes(before[:-100])
    again = typed("resume", tmp_path, "--json")
    assert json.loads(again.stdout)["value"] == json.loads(first.stdout)["value"]
    assert file.read_bytes() != before[:-100]
