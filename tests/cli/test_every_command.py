"""What holds of every command: each option changes what it does, and a bad value of each is a sentence.

The table of options is that of the commands: an option without a case fails.
"""

import contextlib
import importlib
import json
import re
import shutil
import sys
import time
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from helpers.commands import content, in_this_process
from helpers.frames import at_rest, write
from helpers.mixtures import mixture
from helpers.options import COMMANDS, PLAN
from helpers.plain import uncompiled
from typer.testing import CliRunner

import carom
from carom import cli
from carom.cli import heartbeat, screen, study, suggestions
from carom.cli.options import FLAGS
from carom.cli.templates import SPECS
from carom.declared import fields_of, schema_of
from carom.scene.keywords import ELSEWHERE
from carom.scene_file.commands import PlanSpec
from carom.scene_file.sections import RunSpec, SceneSpec
from carom.spec import numbers_of
from carom.studies import CodeSpec, PackSpec, ShearSpec, StudySpec, TradeSpec, TransportSpec
from carom.studies.study import Study
from carom.suggestions import NOWHERE, SAME

RUN = ("--lattice", "fcc", "--cells", "3", "--packing-fraction", "0.3", "--equilibration", "10",
       "--frames", "2", "--collisions-per-particle", "40", "--no-pictures")  # fmt: skip
PACK = ("--n", "10", "--dimension", "2", "--rate", "1", "--until-Z", "100", "--no-pictures")
EOS = ("--eta", "0.1", "--n", "32", "--replicas", "1", "--collisions-per-particle", "50", "--equilibration",
       "20", "--engine", "serial")  # fmt: skip


class Done(NamedTuple):
    """What a command did."""

    folder: Path
    """Where it was typed."""
    code: int
    printed: str
    asked: dict[str, Any]
    """What a function that is too slow for this test was asked for."""

    @property
    def summary(self):
        return json.loads((self.folder / "out" / "summary.json").read_text())

    @property
    def table(self):
        lines = (self.folder / "out" / "rdf.csv").read_text().splitlines()
        return np.genfromtxt([x for x in lines if not x.startswith("#")], delimiter=",", names=True)


class Case(NamedTuple):
    """A command typed without and with an option, what to look at, and what it must be with the option."""

    without: tuple[str, ...]
    option: tuple[str, ...]
    look: Callable[[Done], Any]
    right: Any
    """A value, or a function of what was seen with the option."""
    asks: bool = False
    """Whether the function behind the command is only asked: its own tests show what it does."""


def added(base, option, look, right, *, asks=False):
    """Return a case that adds an option to a command."""
    return Case(tuple(base), tuple(option), look, right, asks)


def asked(base, option, name, right):
    """Return a case that looks at a field of what is asked for, or at another argument."""

    def look(done):
        return getattr(done.asked.get("spec"), name, done.asked.get(name))

    return added(base, option, look, right, asks=True)


def close_to(value):
    return lambda seen: seen == pytest.approx(value)


def json_alone(done):
    with contextlib.suppress(ValueError):
        return bool(json.loads(done.printed))
    return False


def made(name):
    return lambda done: (done.folder / name).exists()


def told(key):
    return lambda done: done.summary[key]


def in_brackets(name):
    """Look at what `--dry-run` says of a scene."""
    return lambda done: dict(
        part.split("=", 1) for part in done.printed.replace("Scene(", "").split(", ") if "=" in part
    )[name]


OUT = ("--out", "out")
SILENT = None  # looked at by a test of its own

MEASURE = ("two.extxyz", "rdf", *OUT)
MOVIE = ("two.extxyz", "two.gif")

FIELDS = {
    "packing_fraction": ("0.15", lambda seen: seen in (0.15, (0.15,))),
    "n": ("40", lambda seen: seen in (40, (40,))),
    "replicas": ("3", 3), "kT": ("2", 2.0), "dimension": ("2", 2), "lattice": ("fcc", "fcc"),
    "seed": ("7", 7), "equilibration": ("30", 30.0), "relative_error": ("0.1", 0.1),
    "collisions_per_particle": ("60", 60.0), "strains": ("60", 60.0), "restitution": ("0.8", 0.8),
    "rate": ("0.3", lambda seen: seen in (0.3, (0.3,))), "thermostat": ("rescale", "rescale"),
    "tries": ("4", 4), "agree": ("3", 3), "hops": ("2", 2), "starts": ("3", 3), "digits": ("40", 40),
    "seconds": ("0.5", 0.5), "density": ("0.6", 0.6), "box": ("4,5,6", (4.0, 5.0, 6.0)), "cells": ("2", 2),
    "diameter": ("2", 2.0), "time": ("3", 3.0), "walltime": ("9", 9.0), "frames": ("5", 5),
    "write": ("extxyz", ("extxyz",)), "checkpoint_every": ("7", 7.0), "seeds": ("2", 2),
    "until_Z": ("1e4", 1e4), "collisions": ("300", 300),
    "stages": ("0.2:10", lambda seen: [*seen[0]] == [0.2, 10.0]),
    "species": ("1:1.4", lambda seen: (
        (seen[0]["count"], seen[0]["diameter"]) if isinstance(seen[0], dict)
        else (seen[0].fraction, seen[0].diameter)
    ) == (1, 1.4)),
}  # fmt: skip
"""What is typed for a field of a specification, and what it becomes."""

NEEDS = {
    "cells": ("--lattice", "fcc"),
    "nearest": ("--lattice", "fcc"),
    "walltime": ("--relative-error", "0.01"),
}
"""Options without which another one means nothing."""


def of_fields(base, *kinds):
    """Return the cases of the fields of specifications: options of one machine, which are only asked for."""
    found = {}
    for field in (field for kind in kinds for field in fields_of(kind).values() if field.is_option):
        name = field.name
        on, _, off = (field.opt.flags or FLAGS.get(name, ("--" + name.replace("_", "-"),)))[0].partition("/")
        typed = (*base, *NEEDS.get(name, ()))
        if field.kind in (bool, bool | None):
            found[on] = asked((*typed, off) if off else typed, (on,), name, True)
            found |= {off: asked((*typed, on), (off,), name, False)} if off else {}
        else:
            text, right = FIELDS[name]
            found[on] = asked(typed, (on, text), name, right)
    return found


THAT_OF_SCENE = close_to((0.3,))


def of_study(kind, needed, small, *argument):
    """Return the cases of the command of a study.

    With the arguments ``small`` it runs and writes its files, which one function does for all studies.
    """
    found = {
        "study": asked((), *argument),
        "--out": added(needed, OUT, lambda done: str(done.asked["out"]), "out", asks=True),
        "--quiet": SILENT,
        **of_fields(needed, kind),
    }
    where = {} if kind.serial else {"engine": "threads", "scheduler": "tcp://x:1", "cores": "3"}
    for name, text in where.items():
        found[f"--{name}"] = asked(needed, (f"--{name}", text), *(
            ("cores", 3) if name == "cores" else ("executor", text)
        ))  # fmt: skip
    drawn, bare = (*small, *OUT), (*small, *OUT, "--no-pictures")
    png = lambda done: any((done.folder / "out").glob("*.png"))  # noqa: E731
    return found | {
        "--report": added(bare, ("--report",), made("out/report.html"), True) if small else SILENT,
        "--pictures": added(bare, ("--pictures",), png, True) if small else SILENT,
        "--no-pictures": added(drawn, ("--no-pictures",), png, False) if small else SILENT,
        "--json": added(bare, ("--json",), json_alone, True) if small else SILENT,
    }


CASES = {
    "run": {
        "scene": added(("--dry-run",), ("scene.toml",), in_brackets("n"), "32"),
        "--out": added(RUN, ("--out", "elsewhere"), made("elsewhere/summary.json"), True),
        "--json": added((*RUN, *OUT), ("--json",), json_alone, True),
        "--quiet": SILENT,
        "--verbose": added((*RUN, *OUT), ("--verbose",), lambda done: "worst overlap" in done.printed, True),
        "--resume": added((*RUN, "--out", "finished"), ("--resume",), lambda done: done.code, 0),
        "--overwrite": added((*RUN, "--out", "full"), ("--overwrite",), lambda done: done.code, 0),
        **of_fields((), SceneSpec, RunSpec),
        "--dry-run": added((*RUN, *OUT), ("--dry-run",), made("out"), False),
        # Several change no bit; that the number is read is seen by one that is refused.
        "--cores": added((*RUN, *OUT), ("--cores", "0"), lambda done: done.code, 2),
        "--trust-code": added(("hunt/scene.toml", "--dry-run"), ("--trust-code",), made("hunt/ran"), True),
    },
    "resume": {
        "--cores": added(("begun",), ("--cores", "two"), lambda done: done.code, 2),
        "--trust-code": added(("hunt",), ("--trust-code",), made("hunt/ran"), True),
        "--quiet": SILENT,
        "folder": added((), ("finished",), lambda done: (done.code, "already" in done.printed), (0, True)),
        "--json": added(("finished",), ("--json",), json_alone, True),
    },
    "pack": {
        "scene": added(
            (), ("scene.toml",), lambda done: "cells=2" in str(done.asked["start"]), True, asks=True
        ),
        **of_fields((), PackSpec),
        "--out": added(PACK, ("--out", "elsewhere"), made("elsewhere/summary.json"), True),
        "--cores": added((*PACK, *OUT), ("--cores", "1"), lambda done: done.code, 2),
        "--report": added((*PACK, *OUT, "--seeds", "1"), ("--report",), made("out/report.html"), True),
        "--json": added((*PACK, *OUT), ("--json",), json_alone, True),
        "--quiet": SILENT,
        "--resume": added(
            (*PACK, "--out", "stopped"), ("--resume",), lambda done: done.code, 0
        ),
        "--overwrite": added((*PACK, "--out", "packed"), ("--overwrite",), lambda done: done.code, 0),
    },
    "export": {
        "--quiet": SILENT,
        # of files of other programs: tests/io/test_foreign_files.py
        "--diameter": SILENT,
        "--box": SILENT,
        "source": added((), ("two.extxyz", "out.h5md"), made("out.h5md"), True),
        "target": added(("two.extxyz",), ("out.h5md",), made("out.h5md"), True),
        "--overwrite": added(
            ("two.extxyz", "full/trajectory.h5md"), ("--overwrite",), lambda done: done.code, 0
        ),
    },
    "info": {
        "path": added((), ("finished",), lambda done: "a run, finished" in done.printed, True),
        "--json": added(("finished",), ("--json",), json_alone, True),
    },
    "measure": {
        "path": added((), ("two.extxyz", "rdf", *OUT), made("out/rdf.csv"), True),
        "quantities": added(
            ("two.extxyz", *OUT, "--no-pictures"), ("rdf",),
            lambda done: {p.stem for p in (done.folder / "out").iterdir()}, {"rdf"},
        ),
        "--out": added(("two.extxyz", "rdf"), OUT, made("out/rdf.csv"), True),
        "--bins": added(MEASURE, ("--bins", "7"), lambda done: len(done.table), 7),
        "--width": added((*MEASURE, "--rmax", "2"), ("--width", "0.25"), lambda done: len(done.table), 4),
        "--rmax": added((*MEASURE, "--width", "0.1"), ("--rmax", "2"), lambda done: len(done.table), 10),
        "--pair": added(MEASURE, ("--pair", " 0, 1 "), lambda done: done.table["g"].sum(), None),
        "--axis": added(
            ("two.extxyz", "profile", *OUT), ("--axis", "z"),
            lambda done: "along z" in done.printed, True,
        ),
        "--pictures": added((*MEASURE, "--no-pictures"), ("--pictures",), made("out/rdf.png"), True),
        "--no-pictures": added(MEASURE, ("--no-pictures",), made("out/rdf.png"), False),
        "--json": added(MEASURE, ("--json",), json_alone, True),
        "--quiet": SILENT,
        "--diameter": SILENT,
        "--box": SILENT,
        "--overwrite": added(
            ("two.extxyz", "rdf", "--out", "mine"), ("--overwrite",), lambda done: done.code, 0
        ),
    },
    "init": {
        "path": added((), ("mine.toml",), made("mine.toml"), True),
        "--template": added((), ("--template", "rules"), made("rules.py"), True),
        "--list": added((), ("--list",), lambda done: "square-well" in done.printed, True),
        "--schema": added((), ("--schema",), json_alone, True),
        "--overwrite": added(("scene.toml",), ("--overwrite",), lambda done: done.code, 0),
    },
    "plan": {
        "--quiet": SILENT,
        "scene": added((), ("scene.toml",), lambda done: str(done.asked["scene"]), "scene.toml"),
        "--target": asked((), ("--target", "Z=+-0.1"), "target", "Z=+-0.1"),
        "--packing-fraction": asked((), ("--packing-fraction", "0.2"), "packing_fraction", 0.2),
        "--dimension": asked((), ("--dimension", "2"), "dimension", 2),
        "--species": asked(
            (), ("--species", "0.5:1", "--species", "0.5:1.4:2"), "species",
            [{"fraction": 0.5, "diameter": 1.0}, {"fraction": 0.5, "diameter": 1.4, "mass": 2.0}],
        ),
        "--n": asked((), ("--n", "100"), "n", 100),
        "--seed": asked((), ("--seed", "7"), "seed", 7),
        "--cores": asked((), ("--cores", "3"), "cores", 3),
        "--walltime": asked((), ("--walltime", "1800"), "walltime", 1800.0),
        "--pilot": asked((), ("--pilot", "2"), "pilot", 2.0),
        "--run": added((), ("--run",), made("carom-plan/outcome.json"), True),
        "--out": added((), OUT, made("out/plan.json"), True),
        "--json": added((), ("--json",), json_alone, True),
    },
    "eos": of_study(StudySpec, (), EOS, ("study.toml",), "packing_fraction", (0.1,)),
    "transport": of_study(TransportSpec, (), (), ("scene.toml",), "packing_fraction", THAT_OF_SCENE),
    "shear": of_study(ShearSpec, (), (), ("scene.toml",), "packing_fraction", THAT_OF_SCENE),
    "code": of_study(CodeSpec, ("9",), ("5",), ("9",), "n", 9),
    "trade": of_study(TradeSpec, (), (), ("scene.toml",), "scene", lambda scene: scene["cells"] == 2),
    "view": {
        "source": asked((), ("two.extxyz",), "source", lambda path: str(path) == "two.extxyz"),
        "--out": asked(
            ("two.extxyz",), ("--out", "page.html"), "page", lambda path: str(path) == "page.html"
        ),
        "--collisions": asked(("two.extxyz",), ("--collisions", "50"), "collisions", 50),
        "--from": asked(("two.extxyz",), ("--from", "0.5"), "begin", 0.5),
        "--to": asked(("two.extxyz",), ("--to", "0.5"), "end", 0.5),
        "--open": asked(("two.extxyz", "--no-open"), ("--open",), "launched", "two.html"),
        "--no-open": asked(("two.extxyz",), ("--no-open",), "launched", None),
        "--trust-code": added(("hunt",), ("--trust-code",), made("hunt/ran"), True),
        "--overwrite": added(
            ("two.extxyz", "--out", "full/old.html"), ("--overwrite",), lambda done: done.code, 0
        ),
    },
    "movie": {
        "--quiet": SILENT,
        "trajectory": asked((), MOVIE, "trajectory", lambda path: str(path) == "two.extxyz"),
        "target": asked(("two.extxyz",), ("two.gif",), "target", lambda path: str(path) == "two.gif"),
        "--fps": asked(MOVIE, ("--fps", "12"), "fps", 12),
        "--size": asked(MOVIE, ("--size", "200"), "size", 200),
        "--color": asked(MOVIE, ("--color", "speed"), "color", "speed"),
        "--overwrite": added(
            ("two.extxyz", "full/rdf.csv"), ("--overwrite",), lambda done: bool(done.asked), True
        ),
    },
}  # fmt: skip


HUNT = """
[scene]
n = 4
box = [9.0, 9.0]
diameter = 0.1
[scene.interaction]
type = "ranges"
file = "rules.py"
rule = "behave"
kinds = [{ name = "hare", circles = [1.0] }]
"""


class Asked(Exception):
    """Raised by a function that was only to be asked."""


@pytest.fixture(scope="module")
def material(tmp_path_factory):
    """Return a folder of what commands read, and what stands in their way."""
    folder = tmp_path_factory.mktemp("material")
    (folder / "scene.toml").write_text("[scene]\nlattice = 'fcc'\ncells = 2\npacking_fraction = 0.3\n")
    (folder / "study.toml").write_text(
        "[study]\npacking_fraction = [0.1]\nn = 32\ncollisions_per_particle = 40\n[scene]\nmass = 2.0\n"
    )
    scene = mixture([12, 12], box=(6.0, 6.0, 6.0), seed=1)
    write(folder / "two.extxyz", [at_rest(scene, time) for time in (0.0, 1.0)])
    assert type_in(folder, "run", *RUN, "--out", "finished").code == 0
    (folder / "begun").mkdir()
    shutil.copy(folder / "finished" / "scene.toml", folder / "begun")
    hunt = folder / "hunt"
    hunt.mkdir()
    (hunt / "scene.toml").write_text(HUNT)
    # It says that it ran, and has no rule that a long compilation would follow.
    (hunt / "rules.py").write_text("from pathlib import Path\nPath(__file__).with_name('ran').touch()\n")
    (folder / "packed").mkdir()
    (folder / "packed" / "packing.h5md").touch()
    assert type_in(folder, "pack", *PACK, "--out", "stopped").code == 0
    (folder / "mine").mkdir()
    (folder / "mine" / "rdf.csv").write_text("mine")
    lattice = 'Lattice="6 0 0 0 5 0 0 0 4" Properties=species:S:1:pos:R:3'
    (folder / "start.xyz").write_text(f"2\n{lattice}\nA 1.0 1.0 1.0\nA 3.0 1.0 1.0\n")
    (folder / "cut.h5md").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    full = folder / "full"
    full.mkdir()
    (full / "old.html").touch()
    for name in ("summary.json", "trajectory.h5md", "rdf.csv"):
        shutil.copy(folder / "finished" / name, full)
    return folder


@pytest.fixture(scope="module")
def typed():
    """Return what commands without the option did, by what was typed: many cases share one."""
    return {}


def type_in(folder, command, *arguments, asked=None):
    """Type a command in a folder."""
    compiled = command != "pack"  # of some hundred events
    with (
        contextlib.chdir(folder),
        pytest.MonkeyPatch.context() as patch,
        in_this_process(),
        contextlib.nullcontext() if compiled else uncompiled(),
    ):
        for name in [name for name in sys.modules if name.startswith("carom_rules_")]:
            patch.delitem(sys.modules, name)  # one source runs once in a process
        if asked is not None:
            importlib.import_module("carom.studies.at_path")  # whose docstrings are those of Study.run

            def plan(target, **settings):
                asked.update(target=target, **settings)
                if (out := settings["out"]) is not None:
                    PLAN.save(out)
                return PLAN

            def simulate(plan, out, **settings):
                asked.update({**vars(plan.scene), **vars(plan.run)}, out=out, **settings)
                raise Asked

            def pack(spec, start, *settings):
                asked.update(spec=spec, start=start)
                raise Asked

            run_in_full = Study.run

            def run(study, **settings):
                if command == "plan":  # of a moment
                    return run_in_full(study, **settings)
                asked.update(spec=study.spec, **settings)
                raise Asked

            def view(source, page, **settings):
                asked.update(source=source, page=page, **settings)
                page.write_text("<html></html>")

            def movie(trajectory, target, **settings):
                asked.update(trajectory=trajectory, target=target, **settings)
                raise Asked

            patch.setattr("carom.pictures.view.view", view)
            patch.setattr("carom.pictures.movie.movie", movie)
            patch.setattr("typer.launch", lambda page: asked.update(launched=page))
            patch.setattr("carom.studies.planner.plan.plan", plan)
            patch.setattr("carom.studies.study.Study.run", run)
            patch.setattr("carom.studies.runs.execution.run", simulate)
            patch.setattr("carom.studies.packings.pack.packed", pack)
        done = CliRunner().invoke(cli.app, [command, *arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit | Asked):
        raise done.exception
    return Done(folder, done.exit_code, done.stdout, asked or {})


@pytest.mark.parametrize(
    ("command", "option"),
    [
        (command, option)
        for command, cases in CASES.items()
        for option, case in cases.items()
        if case is not SILENT
    ],
)
def test_an_option_changes_what_the_command_does(command, option, material, typed, tmp_path_factory):
    case = CASES[command][option]
    asks = case.asks or command in ("view", "movie", "plan")
    arguments = (command, *case.without)
    if arguments not in typed:
        folder = tmp_path_factory.mktemp("without") / "here"
        shutil.copytree(material, folder)
        typed[arguments] = type_in(folder, *arguments, asked={} if asks else None)
    before = case.look(typed[arguments])
    folder = tmp_path_factory.mktemp("with") / "here"
    shutil.copytree(material, folder)
    after = case.look(type_in(folder, *arguments, *case.option, asked={} if asks else None))
    assert after != before
    if callable(case.right):
        assert case.right(after), after
    elif case.right is not None:
        assert after == case.right


def test_every_option_has_a_case():
    found = {
        name: {
            each
            for parameter in command.params
            for each in ([parameter.name] if parameter.param_type_name == "argument"
                         else [parameter.opts[0], *parameter.secondary_opts[:1]])
        }
        for name, command in COMMANDS.items()
    }  # fmt: skip
    assert found == {name: {*cases} for name, cases in CASES.items()}


def test_several_numbers_are_typed_with_commas_or_as_first_last_and_count():
    assert numbers_of("--eta")("0.1:0.3:3") == [0.1, 0.2, 0.3]  # as typed, not 0.2 + 3e-17
    assert numbers_of("--eta")("0.1, 0.25") == [0.1, 0.25]


# Values that mean nothing.

BAD = ("no such value", "", "-1", "nan", "1e999", "0x10")

HUGE = "9" * 40
"""A value of some options, and too much for others."""

TAKEN = {
    "--out": BAD,  # names of folders
    "--scheduler": BAD,  # addresses
    "--from": ("-1",),  # before the first frame
    "--to": (),
}
"""Values that an option does take."""

IN_PYTHON = {"--engine": "executor", "--from": "begin", "--to": "end"}
"""Options that are called otherwise where they are checked."""

EXPECTED = re.compile(
    "(?i)must |should be |leave it out|expected|known: |takes |needs |does not exist|no such"
)
"""How a sentence says what would be right."""

BESIDE = {
    "measure": ("start.xyz", "rdf"), "movie": ("two.extxyz", "a.gif"), "export": ("start.xyz", "a.gsd"),
    "code": ("9",), "info": ("finished",), "view": ("two.extxyz", "--no-open"), "resume": ("begun",),
    "plan": ("--eta", "0.3"), "--axis": ("start.xyz", "profile"),
}  # fmt: skip
"""What else is typed for a command, or for an option."""


def values_of(command):
    """Return the options of a command that take a value."""
    return [
        each for each in COMMANDS[command].params if each.param_type_name == "option" and not each.is_flag
    ]


class Begun(Exception):
    """Raised where something would be computed."""


def answer(command, words, folder):
    """Type something; return what it did."""
    with contextlib.chdir(folder), in_this_process():
        done = CliRunner().invoke(cli.app, [command, *words], env={"COLUMNS": "300"})
    assert isinstance(done.exception, SystemExit | Begun | None), (words, done.output, done.exception)
    return done


def refusal(command, words, folder):
    """Type what means nothing; return what is said, on one line."""
    done = answer(command, words, folder)
    assert (done.exit_code, type(done.exception)) == (2, SystemExit), (words, done.output)
    assert done.stdout == ""
    return " ".join(done.stderr.replace("│", "").split())


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("command", [name for name in COMMANDS if values_of(name)])
def test_no_option_takes_a_value_that_means_nothing(command, material, monkeypatch, tmp_path):
    """It is refused in one sentence that says which option or value it is, before anything is begun."""

    def begun(*_, **__):
        raise Begun

    monkeypatch.setattr("carom.simulation.run_state.RunState.schedule", begun)
    monkeypatch.setattr("carom.studies.executors.run", begun)
    before = content(material)
    for parameter in values_of(command):
        option = parameter.opts[0]
        beside = BESIDE.get(option, BESIDE.get(command, ()))
        for value in BAD:
            if value not in TAKEN.get(option, ()):
                said = refusal(command, (*beside, f"{option}={value}"), material)
                names = (value or option, option, IN_PYTHON.get(option, option.strip("-").replace("-", "_")))
                assert any(name in said for name in names), said
                assert EXPECTED.search(said), said
        assert "requires an argument" in refusal(command, (*beside, option), material)
    assert content(material) == before
    huge = shutil.copytree(material, tmp_path / "huge")
    for parameter in values_of(command):
        answer(command, (*BESIDE.get(command, ()), f"{parameter.opts[0]}={HUGE}"), huge)


@pytest.mark.parametrize("command", COMMANDS)
def test_what_a_command_has_not_is_answered_with_what_is_nearest(command, material):
    for parameter in COMMANDS[command].params:
        if parameter.param_type_name == "argument":
            continue
        option = parameter.opts[0]
        if parameter.is_flag:
            assert "does not take a value" in refusal(command, (f"{option}=1",), material)
        if len(option) > 6:  # a letter twice
            assert option in refusal(command, (f"{option}{option[-1]}",), material)
    if any(each.required for each in COMMANDS[command].params):
        assert "Missing argument" in refusal(command, (), material)


STUDIES = {"code", "eos", "transport", "shear", "trade"}
LONG = {*STUDIES, "run", "resume", "pack", "plan"}

SHARED = {
    "--seed": LONG - {"resume"},  # which goes on with what is there
    "--out": {*LONG - {"resume"}, "measure", "view"},  # others name one file, or go on in their folder
    "--json": {*LONG, "measure", "info"},  # others write one file
    "--cores": LONG - {"trade"},  # whose rows measure CPU time
    "--dimension": LONG - {"resume", "trade"},  # whose scene is that of a file
    "--packing-fraction": LONG - {"resume", "trade", "code"},  # points on a sphere have none
    "--n": LONG - {"resume", "trade", "code"},  # for which it is the argument
    "--resume": {"run", "pack"},  # a study goes on with the same command
    "--overwrite": {"run", "pack", "measure", "export", "view", "movie", "init"},  # a study keeps all results
    "--report": {*STUDIES, "pack"},
    "--pictures": {*STUDIES, "run", "pack", "measure"},
}
"""Options that several commands have, the commands that have them, and why others do not."""

SEEDED = (RunSpec, StudySpec, TransportSpec, ShearSpec, PackSpec, PlanSpec, CodeSpec, TradeSpec)


@pytest.mark.parametrize("option", SHARED)
def test_an_option_is_there_wherever_it_has_a_meaning(option):
    assert {command for command, _, names in names_of() if option in names} == SHARED[option]


def test_a_seed_is_the_same_number_in_every_command_and_section():
    assert {each.section for each in SEEDED} == {
        name for name, kind in SPECS.items() if "seed" in fields_of(kind)
    }
    for spec in SEEDED:
        found = schema_of(fields_of(spec)["seed"].check)
        assert found == {"type": "integer", "minimum": 0, "maximum": 2**63 - 1}, spec


PROGRESS = {name for name, each in COMMANDS.items() if any("--quiet" in one.opts for one in each.params)}


def test_commands_that_take_long_can_be_quiet():
    assert {*LONG, "measure", "export", "movie"} == PROGRESS


@pytest.mark.parametrize("command", sorted(PROGRESS))
def test_a_quiet_command_shows_no_progress(command, monkeypatch, capsys):
    monkeypatch.setattr(heartbeat, "EVERY", 0.01)
    heartbeat.hush(False)
    parsed = COMMANDS[command].make_context(command, ["--quiet", *NEEDED.get(command, [])])
    try:
        assert "quiet" not in parsed.params
        with heartbeat.starting(), screen.watched() as progress, study.watched("the first runs") as (told, _):
            progress(0.5, "Measuring")
            told(0.5, "1 of 2 runs")
            time.sleep(0.1)
        assert capsys.readouterr().err == ""
    finally:
        COMMANDS[command].make_context(command, NEEDED.get(command, []))
    assert not heartbeat.quiet()


NEEDED = {
    "resume": ["folder"], "code": ["5"], "measure": ["path"], "export": ["a.h5md", "b.gsd"],
    "movie": ["a.h5md", "b.gif"],
}  # fmt: skip
"""Arguments without which a command is not read."""


def names_of():
    """Return the commands and names of every option: (command, all of its names)."""
    for command, each in COMMANDS.items():
        for parameter in each.params:
            if parameter.param_type_name == "option":
                yield command, parameter, frozenset((*parameter.opts, *parameter.secondary_opts))


def test_a_letter_or_word_has_one_meaning_in_every_command():
    """Options that share a name share all of their names, and are switches in all commands or in none."""
    meanings = {}
    for command, parameter, names in names_of():
        for name in names:
            meanings.setdefault(name, {})[command] = (names, bool(parameter.is_flag))
    assert {name: found for name, found in meanings.items() if len({*found.values()}) > 1} == {}


@pytest.mark.parametrize(
    ("name", "long"),
    [
        ("--eta", "--packing-fraction"), ("-d", "--dimension"), ("-j", "--cores"), ("-o", "--out"),
        ("-c", "--collisions-per-particle"), ("-q", "--quiet"), ("--colour", "--color"),
    ],
)  # fmt: skip
def test_a_short_name_goes_wherever_the_long_one_does(name, long):
    found = [names for _, _, names in names_of() if {name, long} & names]
    assert found
    assert all({name, long} <= names for names in found)


@pytest.mark.parametrize(
    ("line", "way"),
    [
        ("run --phi 0.3", "Did you mean --eta?"),
        ("eos --packing-fractions 0.3", "Did you mean --eta?"),
        ("plan --workers=2", "Did you mean --cores?"),
        ("run -n 5", "Did you mean --n?"),
        ("run --explain", "Did you mean --dry-run?"),
        ("measure run1 --png", "Did you mean --pictures?"),
        ("plan --error 1e-3", "Did you mean --target?"),
        ("run --pressure 3", "give barostat = { pressure = 10.0"),
        ("plan --restitution 0.9", "give impact = 0.9"),
        ("run --walls x", "A scene file has walls, in [scene]"),
        ("pack --dt 0.1", "There is none, as events are computed"),
        ("run --natoms 5", "Did you mean --n?"),
        ("rdf run1", "carom measure PATH rdf"),
        ("inspect run1", "carom info PATH"),
        ("walk", "No such command"),
        ("run --packing-fracton 0.3", "--packing-fraction"),
        ("run --ndim 3", "Did you mean --dimension?"),
        ("run --T 3", "Did you mean --kT?"),
        ("run --box 3,3", "Take a larger box or fewer particles."),
        ("run --eta 0.7", "Scene.crystal, --lattice), for equal ones up to 0.74"),
        ("transport --num-particles 3", "Did you mean --n?"),
        ("pack --temperature 3", "carom pack has no kT"),
        ("code 5 --eta 0.3", "carom code has no eta"),
        ("code 5 --num-particles 3", "Did you mean N?"),
        ("plan --target Z=0", "--eta"),
        ("plan --target Z=0 --eta 0.3", "the relative error of the target must be at least"),
        ("measure cut.h5md rdf", "carom.io.rebuild(source, target, keep)"),
        ("measure two.extxyz profile --axis q", "axis must be x, y, z or a number from 0, found the string"),
        ("measure none.h5md rdf --pair 0,²", "does not exist"),
        ("info cut.h5md", "carom.io.rebuild(source, target, keep)"),
        ("transport --eta 1e-320 --n 100", "must be"),
        ("eos --eta 0.1:0.4:2000000000", "must be at most"),
        ("pack --rate 1e-320", "must be"),
        ("pack --stage 1e-320:1e3", "must be"),
        ("pack --dimension 99999999999999999999", "must be"),
        ("run --n 32 --cores 99999999999999999999", "must be"),
    ],
)
def test_a_line_that_cannot_be_meant_points_the_right_way(line, way, material):
    command, *words = line.split()
    assert way in refusal(command, words, material)


def test_other_words_lead_to_options_and_commands_that_there_are():
    known = {name for _, _, names in names_of() for name in names}
    in_python = {*signature(carom.Scene.random).parameters, *ELSEWHERE, *SceneSpec.gone, *NOWHERE}
    for same in SAME:
        assert {f"--{one.replace('_', '-')}" for one in same} & known or in_python & {*same}
    assert {each.split()[0] for each in suggestions.COMMANDS.values()} <= COMMANDS.keys()
    assert not suggestions.COMMANDS.keys() & COMMANDS.keys()


def test_the_help_has_four_groups_and_short_texts_without_semicolons():
    printed = CliRunner().invoke(cli.app, ["--help"]).output
    places = [printed.index(f" {group} ") for group in ("Start", "Simulate", "Study", "Look")]
    assert places == sorted(places)
    for name, command in COMMANDS.items():
        said, examples = command.help.split("\n\n[bold]Examples[/bold]\n\n")
        assert "\n" not in said.replace("\n\n", ""), "a terminal is as wide as it is"
        assert all("carom" in line for line in examples.splitlines())
        text = said.split("\n\n")[0]
        assert len(text) <= 70, name
        assert text.endswith(".")
        assert ";" not in text
        assert text.split()[0] in (
            "Write", "Tell", "Simulate", "Compress", "Spread", "Continue", "Measure", "Find", "Compare",
            "Show", "Make", "Convert", "Compile",
        )  # fmt: skip
