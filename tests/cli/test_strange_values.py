"""Files with a strange value in place of each of theirs: a reader uses them, or refuses them in a sentence.

The readers are called in this process. A value becomes a word, a table, a list, null, a negative, huge or
infinite number, or lists in lists. The default run takes one of these for each value, slow tests take all.
"""

import contextlib
import copy
import json
import math
import os

import h5py
import mpmath
import numpy as np
import pytest
import typer
from helpers.frames import crystal
from helpers.marks import slow
from helpers.options import PLAN
from helpers.screens import summary as summary_of
from typer.testing import CliRunner

import carom
from carom import cli, io
from carom.cli.results import show
from carom.errors import CaromError, FileError, InputError
from carom.io import records
from carom.models import Ball
from carom.scene_file.scene_file import SceneFile
from carom.studies import CodeSpec, EquationOfState, PackSpec, StudySpec, TransportSpec, folder as tasks
from carom.studies.packings.packing import HISTORY, Packing
from carom.studies.runs.result import RunResult
from carom.studies.runs.summary import read_summary
from carom.studies.spherical_codes.code import SphericalCode


def nested(depth):
    """Return lists in lists."""
    value = []
    for _ in range(depth):
        value = [value]
    return value


STRANGE = [
    "word", "", {}, {"a": 1}, [], [[]], [{}], ["word"], None, True, -1, -0.5, 0, 10**400, 1e308, 5e-324,
    math.nan, math.inf, nested(30), nested(900), [1.0] * 13, "\N{GRINNING FACE}\0\x7f\\\"'",
]  # fmt: skip


def places(value, place=()):
    """Return the places of all values within a value."""
    if place:
        yield place
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, each in items:
        yield from places(each, (*place, key))


def replaced(value, place, strange):
    """Return a copy with another value at a place."""
    value = copy.deepcopy(value)
    where = value
    for key in place[:-1]:
        where = where[key]
    where[place[-1]] = strange
    return value


def damaged(value, all_of_them):
    """Return copies of a value with strange ones at every place, and the place."""
    for number, place in enumerate(places(value)):
        for k, strange in enumerate(STRANGE):
            if all_of_them or k == number % len(STRANGE):
                yield replaced(value, place, strange), place, strange


def as_json(value):
    """Return a value as JSON text, with words that are no JSON for numbers that are not finite."""
    try:
        return json.dumps(value)
    except RecursionError:
        return "[" * 100_000


def as_toml(tables):
    """Return tables as TOML text, or None for what no TOML can say."""

    def value(each):
        if each is None:
            raise TypeError
        return str(each) if isinstance(each, int) and not isinstance(each, bool) else records.toml_value(each)

    try:
        lines = []
        for name, table in tables.items():
            if isinstance(table, dict):
                lines += [f"[{name}]", *(f"{key} = {_inline(each, value)}" for key, each in table.items())]
            else:
                lines.insert(0, f"{name} = {_inline(table, value)}")
        return "\n".join(lines)
    except (TypeError, RecursionError):
        return None


def _inline(each, value):
    if isinstance(each, dict):
        return "{ " + ", ".join(f"{key} = {_inline(item, value)}" for key, item in each.items()) + " }"
    if isinstance(each, list):
        return "[" + ", ".join(_inline(item, value) for item in each) + "]"
    return value(each)


def sentence(read, *arguments):
    """Call a reader, which may raise one of Carom's errors only; return whether it did."""
    try:
        read(*arguments)
    except CaromError:
        return True
    return False


# Scene files, study files, searches.

PLANE = {"type": "plane", "normal": [0.0, 1.0], "offset": 0.2, "name": "floor"}
LOSS = {"restitution": 0.9, "contact_time": 1e-3}
RUN = {"seed": 1, "equilibration": 1.0, "collisions_per_particle": 9.0, "frames": 2, "neighbors": "auto"}


def scene(**keys):
    """Return a scene of 20 disks or spheres at random."""
    return {"scene": {"n": 20, "packing_fraction": 0.05, **keys}}


ON_A_SPHERE = {"type": "great-circles", "radius": 1.0}
WELL = {"type": "square-well", "range": 1.5, "depth": 1.0}
SCENES = {
    "walls": scene(
        dimension=2, walls={"y_low": {"impact": 0.9, "offset": 0.0}}, pinned=[1, 2],
        obstacles={
            "floor": PLANE,
            "ball": {"type": "ball", "center": [1.0, 1.0], "radius": 0.5},
            "hot": {**PLANE, "kT": 1.0, "seed": 3},
            "soft": {**PLANE, "impact": LOSS},
        },
        impact={"type": "loss", **LOSS},
    ) | {"run": RUN | {"kT": 1.0, "write": ["h5md"], "event_log": False, "pictures": False}},
    "mixture": scene(
        species={"a": {"fraction": 0.5, "diameter": 1.0, "mass": 1.0}, "b": {"fraction": 0.5}},
        contact=[[1.0, 0.9], [0.9, 1.0]],
    ),
    "well": scene(interaction=WELL),
    "steps": scene(interaction={"type": "steps", "distances": [1.2, 1.5], "energies": [0.5, -1.0]}),
    "table": scene(interaction={"type": "steps", "table": [[{"distances": [1.2], "energies": [0.5]}]]}),
    "bonds": scene(
        interaction={"type": "bonds", "pairs": [[0, 1], [1, 2]], "inner": 1.0, "outer": 1.4, "others": WELL}
    ),
    "ranges": scene(
        dimension=2,
        interaction={
            "type": "ranges", "file": "hunt.py", "rule": "hunt", "seed": 1,
            "kinds": [{"name": "a", "circles": [2.0], "timer": 1.0, "memory": [0.0]}],
        },
    ),
    "gravity": scene(
        dimension=2, walls="y", motion={"type": "gravity", "g": [0.0, -1.0]},
        obstacles={"floor": {
            **PLANE, "direction": [0.0, 1.0], "shake": {"type": "sine", "amplitude": 0.01, "period": 1.0},
        }},
    ),
    "sphere": {"scene": {"file": "no.h5md", "motion": ON_A_SPHERE}},
    "lattice": {"scene": {"lattice": "triangular", "cells": [2, 2], "density": 0.5, "diameter": 1.0}},
}  # fmt: skip


def built(text):
    """Read a scene file, and build its scene where that is quick."""
    plan = SceneFile.from_toml(text)
    if (plan.scene.n or 0) < 1000:
        plan.build_scene()
    assert SceneFile.from_toml(plan.to_toml()) == plan


@pytest.mark.parametrize("all_of_them", [False, slow(True)])
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_a_strange_value_in_a_scene_file_is_a_sentence(name, all_of_them):
    refused = [
        sentence(built, text)
        for changed, *_ in damaged(SCENES[name], all_of_them)
        if (text := as_toml(changed)) is not None
    ]
    assert any(refused)


STUDY = {
    "study": {
        "packing_fraction": [0.1], "n": [32], "replicas": 1, "dimension": 3, "collisions_per_particle": 20.0,
        "equilibration": 5.0, "seed": 1,
    },
    "scene": {"species": {"a": {"fraction": 0.5}, "b": {"fraction": 0.5}}},
}  # fmt: skip
SEARCH = {
    "code": {
        "n": 8, "dimension": 3, "tries": 2, "seed": 0, "agree": 2, "rate": 0.1, "hops": 1, "starts": 1,
        "digits": 20,
    }
}  # fmt: skip

PACKINGS = {
    "pack": {
        "dimension": 2, "seeds": 2, "seed": 1,
        "species": [{"count": 5, "diameter": 1.0}, {"name": "small", "count": 5, "diameter": 0.5}],
        "walls": False, "stages": [[0.1, 1e3], [0.01, 1e5]], "collisions": 100, "common": True,
        "neighbors": "auto",
    }
}  # fmt: skip


@pytest.mark.parametrize("all_of_them", [False, slow(True)])
@pytest.mark.parametrize(("tables", "kind"), [(SEARCH, CodeSpec), (PACKINGS, PackSpec)])
def test_a_strange_value_in_the_file_of_a_code_or_of_packings_is_a_sentence(tables, kind, all_of_them):
    def read(text):
        spec = kind.from_toml(text)
        assert kind.from_toml(spec.to_toml()) == spec

    for changed, *_ in damaged(tables, all_of_them):
        if (text := as_toml(changed)) is not None:
            sentence(read, text)


@pytest.mark.parametrize("all_of_them", [False, slow(True)])
def test_a_strange_value_in_a_study_file_is_a_sentence(tmp_path, all_of_them):
    def transport(text):
        (tmp_path / "study.toml").write_text(text, encoding="utf-8")
        TransportSpec.of_argument(tmp_path / "study.toml")

    def eos(text):
        spec = StudySpec.from_toml(text)
        assert StudySpec.from_toml(spec.to_toml()) == spec

    for tables, reader in ((STUDY, eos), (STUDY, transport)):
        for changed, *_ in damaged(tables, all_of_them):
            if (text := as_toml(changed)) is not None:
                sentence(reader, text)


@pytest.mark.parametrize("name", ["\N{GRINNING FACE}", 'a "quote" \\ and é', "a = 1 # no", "[x]", "'''"])
def test_a_study_file_holds_every_name(name):
    kinds = [{"name": name, "fraction": 0.5}, {"name": "b", "fraction": 0.5, "diameter": 0.6}]
    spec = StudySpec(packing_fraction=(0.1,), n=(32,), scene={"species": kinds})
    again = StudySpec.from_toml(spec.to_toml())
    assert again == spec
    assert again.scene["species"][0]["name"] == name


def test_toml_has_every_key_and_every_number():
    table = {"a.b": 1, 'q"': np.float64(0.1), "é": [1e300, -0.0], "": {"x y": True}}
    table["plain-key_1"] = np.int64(3)
    assert records.toml_tables("\n".join(records.toml_lines(table))) == table
    with pytest.raises(InputError, match="no text in Unicode"):
        records.toml_value("caf\udce9")


# Records that Carom wrote.

MEASURED = {"mean": 1.5, "error": 0.1, "n_eff": 5.0}
EMPTY = {"mean": None, "error": None, "n_eff": None}
SUMMARY = summary_of(
    **dict.fromkeys(("Z", "reduced_pressure", "collision_rate"), MEASURED),
    **dict.fromkeys(("Z_infinite", "contact_value", "contact_value_from_rdf"), EMPTY),
    contact_values_from_rdf={"a-b": MEASURED},
    theory=[{"name": "CS", "Z": 1.4, "Z_infinite": 1.5,
             "contact_value": 1.1}],
    obstacles=[{"name": "wall", "force": MEASURED, "pressure": MEASURED},
               {"name": "floor", "force": EMPTY, "pressure": EMPTY}],
    relative_error=0.1, without_trajectory=None, spared_contacts=2, units={"a": 3},
)  # fmt: skip


def typed(*words):
    """Type a command in this process; it must end well, or with a sentence."""
    done = CliRunner().invoke(cli.app, [str(word) for word in words])
    assert done.exit_code in (0, 2), (words, done.output, done.exception)
    assert done.exception is None or isinstance(done.exception, SystemExit)
    return done


@pytest.mark.parametrize("missing", [{"U": None}, {"volume": None}, {"U": EMPTY}, {}])
def test_a_quantity_that_a_summary_does_not_have_is_not_a_number(tmp_path, missing):
    kept = {name: value for name, value in SUMMARY.items() if name not in ("U", "volume")}
    result = RunResult(tmp_path, {**kept, **missing})
    assert math.isnan(result.U.mean)
    assert math.isnan(result.volume.mean)
    assert result.Z.mean == 1.5
    assert result.to_dict()["U"] is None


@pytest.mark.parametrize("all_of_them", [False, slow(True)])
def test_a_strange_value_in_the_summary_of_a_run_is_a_sentence(tmp_path, all_of_them):
    path = tmp_path / "summary.json"
    path.write_text(as_json(SUMMARY))
    assert typed("resume", tmp_path).exit_code == 0

    def shown(as_json):
        found = RunResult(tmp_path, read_summary(path), new=True)
        with contextlib.suppress(typer.Exit):  # a target that was missed: exit code 3
            show(found, found.folder, as_json=as_json)

    for changed, place, strange in damaged(SUMMARY, all_of_them):
        path.write_text(as_json(changed))
        refused = [sentence(shown, as_json) for as_json in (False, True)]
        if isinstance(strange, str | dict) and place[-1] in ("mean", "error", "packing_fraction", "n"):
            assert all(refused), (place, strange)
    path.write_text(as_json({**SUMMARY, "n": "word"}))
    assert "summary.json is not the summary of a run" in typed("resume", tmp_path).output.replace("\n", "")
    for key in SUMMARY.keys() - {"system", "without_trajectory", "units"}:
        path.write_text(as_json({name: value for name, value in SUMMARY.items() if name != key}))
        with pytest.raises(FileError, match=f"has no {key}"):
            read_summary(path)
    for unknown in ("Infinity", "NaN", "1e999", "[" * 60 + "]" * 60, '"\\ud800"'):
        path.write_text(as_json(SUMMARY)[:-1] + f', "more": {unknown}}}')
        assert typed("resume", tmp_path, "--json").exit_code == 2
    path.write_text(as_json(replaced(SUMMARY, ("Z", "error"), -0.1)))
    assert "error must be at least 0, found -0.1" in typed("resume", tmp_path).output


@pytest.mark.parametrize("all_of_them", [False, slow(True)])
@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_a_strange_value_beside_a_trajectory_is_a_sentence(tmp_path, all_of_them):
    with io.open(tmp_path / "trajectory.h5md", "w") as file:
        file.write(crystal(2, 3))
    (tmp_path / "scene.toml").write_text("[scene]\ndimension = 2\nn = 5\ndensity = 0.1\n")
    for changed, *_ in damaged({"box": 10.0}, True):
        (tmp_path / "summary.json").write_text(as_json(changed))
        typed("view", tmp_path, "--out", tmp_path / "page.html", "--no-open", "--overwrite")

    packed = tmp_path / "packing"
    packed.mkdir()
    obstacles = (Ball((1.0, 1.0), 0.1),)
    frame = crystal(2, 6)
    packing = Packing(frame, np.array([], HISTORY), "", 1, 0.0, obstacles)
    packing.save(packed, pictures=False)
    summary = packing.to_dict()
    for changed, *_ in damaged({"obstacles": summary["obstacles"]}, all_of_them):
        (packed / "summary.json").write_text(as_json({**summary, **changed}))
        sentence(carom.view, packed)


@pytest.mark.parametrize("all_of_them", [False, slow(True)])
def test_a_strange_value_in_a_plan_is_a_sentence(tmp_path, all_of_them):
    PLAN.save(tmp_path)
    words = PLAN.to_dict()
    assert carom.load(tmp_path) == PLAN

    def shown():
        found = carom.load(tmp_path)
        assert str(found)
        json.dumps(found.to_dict(), allow_nan=False)

    for changed, *_ in damaged(words, all_of_them):
        (tmp_path / "plan.json").write_text(as_json(changed))
        sentence(shown)
    (tmp_path / "plan.json").write_text(as_json({**words, "estimator": "magic"}))
    with pytest.raises(FileError, match="estimator must be one of virial"):
        carom.load(tmp_path)


@pytest.mark.parametrize("all_of_them", [False, slow(True)])
def test_a_strange_value_in_a_study_s_folder_is_a_sentence_or_a_missing_result(tmp_path, all_of_them):
    spec = StudySpec(packing_fraction=(0.1,), n=(32,), replicas=1)
    (task,) = spec.tasks()
    folder = tasks.Folder(tmp_path)
    settings = {"settings": spec.settings(), "grid": {"packing_fraction": [0.1], "n": [32], "replicas": 1}}
    for changed, *_ in damaged(settings, all_of_them):
        (tmp_path / "study.json").write_text(as_json(changed))
        sentence(EquationOfState.load, tmp_path)
        sentence(folder.check, spec.settings())

    record = {"task": task, "result": {"n": 32}, "provenance": {"seconds": 1.0, "host": "here"}}
    folder.store(record)
    assert folder.load(task) == record
    whole = json.loads(folder.result(task).read_text())
    for changed, place, strange in damaged(whole, all_of_them):
        folder.result(task).write_text(as_json(changed))
        assert folder.load(task) is None or changed == whole, (place, strange)


@pytest.mark.parametrize("all_of_them", [False, slow(True)])
def test_a_strange_value_in_a_spherical_code_is_a_sentence(tmp_path, all_of_them):
    points = np.array([[mpmath.mpf(x) for x in row] for row in [(1, 0), (-1, 0)]], object)
    code = SphericalCode(
        points, mpmath.mpf(-1), mpmath.mpf("1e-30"), 20, np.array([[0, 1]]), np.array([1.0]),
        np.array([], np.int64), True, 3, {3: 180.0, 4: math.nan}, 1, "two points",
    )  # fmt: skip
    path = tmp_path / "code.json"
    code.save(path)
    assert carom.load(path).to_dict() == code.to_dict()
    words = json.loads(path.read_text())
    for changed, *_ in damaged(words, all_of_them):
        path.write_text(as_json(changed))
        sentence(lambda: str(carom.load(path)))
    for key, wrong in (("pairs", [[0, 2]]), ("rattlers", [-1]), ("digits", 10**6), ("cosine", "nan")):
        path.write_text(as_json({**words, key: wrong}))
        with pytest.raises(FileError, match="holds no result that was saved"):
            carom.load(path)


BROKEN = [
    b"", b"[", b"[" * 100_000, b'{"a":' * 100_000, b"\xff\xfe", "é".encode("latin-1"), b"\0" * 100, b"NaN",
    b"1" * 10_000, b'"\\ud800"', b"null", b"[]", b"{}", b'{"box": NaN}',
]  # fmt: skip


@pytest.mark.parametrize("content", BROKEN)
def test_what_is_no_json_is_a_sentence_of_every_reader(tmp_path, content):
    for name, read in (
        ("summary.json", lambda: read_summary(tmp_path / "summary.json")),
        ("plan.json", lambda: carom.load(tmp_path)),
        ("study.json", lambda: EquationOfState.load(tmp_path)),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(FileError):
            read()
        (tmp_path / name).unlink()
        (tmp_path / name).mkdir()
        with pytest.raises(FileError):
            read()
        (tmp_path / name).rmdir()
    file = tmp_path / "file.toml"
    file.write_bytes(content)
    for command in ("run", "eos", "transport", "shear", "code", "plan", "trade"):
        if content or command == "code":  # an empty scene file has all defaults
            assert typed(command, file, "--out", tmp_path / "out").exit_code == 2


@pytest.mark.parametrize("all_of_them", [False, slow(True)])
@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_an_attribute_of_another_type_in_an_hdf5_file_is_a_sentence(tmp_path, all_of_them):
    source, path = tmp_path / "disks.h5md", tmp_path / "changed.h5md"
    with io.open(source, "w") as file:
        file.write(crystal(2, 3))
    found = []

    def note(name, item):
        found.extend((name, key) for key in item.attrs)

    with h5py.File(source) as file:
        file.visititems(note)
        found += [("/", key) for key in file.attrs]
    assert len(found) > 5
    strange = np.array([1, 2]), "word", -1, h5py.Empty("f8"), np.array([b"\xff"]), 1e308
    for number, (name, key) in enumerate(found):
        for wrong in strange if all_of_them else (strange[number % 6], strange[(number + 2) % 6]):
            path.write_bytes(source.read_bytes())
            with h5py.File(path, "r+") as file:
                file[name].attrs[key] = wrong
            sentence(io.read, path, ":")
    for wrong in (np.array([1, 2]), np.array([]), 3, h5py.Empty("f8"), "é", np.array([b"carom-events"] * 2)):
        with h5py.File(tmp_path / "other.h5", "w") as file:
            file.attrs["format"] = wrong
        assert typed("view", tmp_path / "other.h5", "--no-open").exit_code == 2


# Streams and names.


@pytest.mark.needs("Linux")
def test_a_folder_whose_name_is_no_text_is_shown_or_refused(tmp_path):
    folder = os.path.join(os.fsencode(tmp_path), b"caf\xe9")
    os.mkdir(folder)
    name = os.fsdecode(os.path.join(folder, b"disks.h5md"))
    with io.open(name, "w") as file:
        file.write(crystal(2, 3))
    for words in (
        ("view", name, "--out", tmp_path / "page.html", "--no-open"),
        ("measure", name, "rdf", "--out", os.fsdecode(os.path.join(folder, b"g"))),
        *(
            ("export", name, os.fsdecode(os.path.join(folder, b"x" + end)))
            for end in (b".extxyz", b".gsd", b".pdb")
        ),
    ):
        typed(*words)
    assert "caf\N{REPLACEMENT CHARACTER}/disks.h5md" in (tmp_path / "page.html").read_text(encoding="utf-8")
