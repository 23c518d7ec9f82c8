"""Every option of every command changes what the command does; an option without a case here fails."""

import contextlib
import importlib
import json
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from helpers.marks import slow
from helpers.options import COMMANDS, PLAN
from typer.testing import CliRunner

import carom
from carom import cli, io
from carom.cli import heartbeat, meant, screen, study
from carom.cli.meant import OPTIONS
from carom.cli.templates import SPECS
from carom.declared import fields_of, schema_of
from carom.frame import Frame
from carom.scene_file.commands import PlanSpec
from carom.scene_file.sections import RunSpec
from carom.studies import CodeSpec, PackSpec, ShearSpec, StudySpec, TradeSpec, TransportSpec
from carom.studies.study import Study

RUN = ("--lattice", "fcc", "--cells", "3", "--packing-fraction", "0.3", "--equilibration", "10",
       "--frames", "2", "--collisions-per-particle", "40", "--no-pictures")  # fmt: skip
PACK = ("--n", "20", "--dimension", "2", "--rate", "0.1", "--until-Z", "1e3", "--no-pictures")
EOS = ("--eta", "0.1", "--n", "32", "--replicas", "1", "--collisions-per-particle", "50", "--equilibration",
       "20", "--engine", "serial", "--no-pictures")  # fmt: skip
TRANSPORT = ("--eta", "0.1", "--n", "32", "--replicas", "1", "--collisions-per-particle", "100",
             "--equilibration", "20", "--engine", "serial", "--no-pictures")  # fmt: skip

SHEAR = ("--rate", "1", "--eta", "0.1", "--n", "32", "--replicas", "1", "--restitution", "0.9", "--strains",
         "10", "--equilibration", "20", "--engine", "serial", "--no-pictures")  # fmt: skip


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
    def frames(self):
        return io.read(next((self.folder / "out").glob("*.h5md")), ":")

    @property
    def history(self):
        return np.genfromtxt(self.folder / "out" / "history.csv", delimiter=",", names=True)

    @property
    def tasks(self):
        return [json.loads(path.read_text())["task"] for path in (self.folder / "out" / "tasks").iterdir()]

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


def added(base, option, look, right):
    """Return a case that adds an option to a command."""
    return Case(tuple(base), tuple(option), look, right)


def without(base, *names):
    """Return arguments less some options and their values."""
    kept = list(base)
    for name in names:
        k = kept.index(name)
        del kept[k : k + 2]
    return tuple(kept)


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


def tasked(key):
    return lambda done: {task[key] for task in done.tasks}


def scene_told(key):
    return lambda done: {task["scene"][key] for task in done.tasks}


def ratio(done):
    sizes = done.frames[-1].diameters
    return round(float(sizes.max() / sizes.min()), 3)


def reached(done):
    z = done.summary["Z"]
    return z["error"] <= 1e-3 * z["mean"]


def close(value, within=0.0):
    return lambda seen: abs(seen - value) <= within + 1e-9 * abs(value)


OUT = ("--out", "out")
SILENT = None  # looked at by a test of its own
DRY = (*RUN[:6], "--dry-run")
NO_LENGTH = without(RUN, "--collisions-per-particle")
LOGGED = ("logged.toml", "--no-event-log")
SPECIES = ("--species", "10:1", "--species", "10:1.4")

MEASURE = ("two.extxyz", "rdf", *OUT)
MOVIE = ("two.extxyz", "two.gif")

TOO_SLOW = {
    *(
        ("view", option)
        for option in (
            "source", "--out", "--collisions", "--open", "--no-open", "--trust-code", "--overwrite",
        )
    ),
    *(
        ("movie", option)
        for option in ("trajectory", "target", "--fps", "--size", "--color", "--overwrite")
    ),
    *(("trade", option) for option in ("study", "--out", "--seconds", "--seed")),
    *(
        ("plan", option)
        for option in (
            "scene", "--target", "--packing-fraction", "--dimension", "--species", "--n", "--seed", "--cores",
            "--walltime", "--pilot", "--run", "--out", "--json",
        )
    ),
    *(
        ("eos", option)
        for option in ("--dimension", "--relative-error", "--engine", "--cores", "--scheduler")
    ),
    *(
        ("code", option)
        for option in (
            "--tries", "--seed", "--agree", "--rate", "--hops", "--starts", "--engine", "--cores",
            "--scheduler",
        )
    ),
    *(
        ("shear", option)
        for option in (
            "study", "--out", "--packing-fraction", "--n", "--kT", "--lattice", "--replicas", "--dimension",
            "--seed", "--relative-error", "--strains", "--equilibration", "--rate", "--restitution",
            "--thermostat", "--engine", "--cores", "--scheduler",
        )
    ),
    *(
        ("transport", option)
        for option in (
            "study", "--out", "--packing-fraction", "--n", "--kT", "--lattice", "--replicas", "--dimension",
            "--seed",
            "--relative-error", "--collisions-per-particle", "--equilibration", "--engine", "--cores",
            "--scheduler",
        )
    ),
}  # fmt: skip
"""Here the function behind the command is only asked: its own tests show what it does."""

CASES = {
    "run": {
        "scene": added(("--dry-run",), ("scene.toml",), in_brackets("n"), "32"),
        "--out": added(RUN, ("--out", "elsewhere"), made("elsewhere/summary.json"), True),
        "--seed": added(
            (*RUN, *OUT), ("--seed", "5"),
            lambda done: (done.summary["seed"], done.frames[0].positions[0, 0]), lambda seen: seen[0] == 5,
        ),
        "--json": added((*RUN, *OUT), ("--json",), json_alone, True),
        "--quiet": SILENT,
        "--verbose": added((*RUN, *OUT), ("--verbose",), lambda done: "worst overlap" in done.printed, True),
        "--resume": added((*RUN, "--out", "finished"), ("--resume",), lambda done: done.code, 0),
        "--overwrite": added((*RUN, "--out", "full"), ("--overwrite",), lambda done: done.code, 0),
        "--lattice": added(
            without(DRY, "--lattice"), ("--lattice", "cubic"), lambda done: "n=27" in done.printed, True
        ),
        "--kT": added((*RUN, *OUT), ("--kT", "2"), told("kT"), close_to(2.0)),
        "--time": added((*NO_LENGTH, *OUT), ("--time", "3"), told("time"), close_to(3.0)),
        "--write": added(
            (*RUN, *OUT), ("--write", "extxyz"), told("trajectories"), ["trajectory.extxyz"]
        ),
        "--dimension": added(("--dry-run",), ("--dimension", "2"), in_brackets("dimension"), "2"),
        "--n": added(without(DRY, "--cells"), ("--n", "32"), in_brackets("n"), "32"),
        "--cells": added(without(DRY, "--cells"), ("--cells", "2"), in_brackets("n"), "32"),
        "--packing-fraction": added(
            without(DRY, "--packing-fraction"), ("--packing-fraction", "0.2"),
            lambda done: "packing_fraction=0.2)" in done.printed, True,
        ),
        "--density": added(
            without(DRY, "--packing-fraction"), ("--density", "0.6"),
            lambda done: "packing_fraction=0.314159)" in done.printed, True,
        ),
        "--box": added(
            ("--dry-run", "--n", "20"), ("--box", "4,5,6"), lambda done: "box=(4, 5, 6)" in done.printed, True
        ),
        "--diameter": added(("--dry-run",), ("--diameter", "2"), in_brackets("diameter"), "2"),
        "--equilibration": added(
            without((*RUN, *OUT), "--equilibration"), ("--equilibration", "30"),
            lambda done: done.summary["equilibration"]["collisions"], close(54 * 30, 8),
        ),
        # The time is chosen by the rate so far, which is that of the first collisions: about as many.
        "--collisions-per-particle": added(
            (*LOGGED, *OUT), ("--collisions-per-particle", "400"), told("collisions"),
            close(54 * 400, 54 * 160),
        ),
        "--relative-error": added(
            (*LOGGED, *OUT), ("--relative-error", "0.05"), told("relative_error"), 0.05
        ),
        "--walltime": added(
            (*NO_LENGTH, *OUT, "--relative-error", "1e-3"), ("--walltime", "0.001"), reached, False
        ),
        "--frames": added((*RUN, *OUT), ("--frames", "5"), lambda done: len(done.frames), 5),
        # How many there are is a matter of the clock, too: a checkpoint may take a tenth of a run.
        "--checkpoint-every": added(
            (*RUN, *OUT), ("--checkpoint-every", "7"),
            lambda done: "checkpoint_every = 7.0" in (done.folder / "out/scene.toml").read_text(), True,
        ),
        "--event-log": added((*RUN, *OUT), ("--event-log",), made("out/events.h5"), True),
        "--no-event-log": added(
            ("logged.toml", *OUT), ("--no-event-log",), made("out/events.h5"), False
        ),
        "--pictures": added((*RUN, *OUT), ("--pictures",), made("out/pressure.png"), True),
        "--no-pictures": added((*RUN[:-1], *OUT), ("--no-pictures",), made("out/pressure.png"), False),
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
            (*PACK[4:], *OUT, "--collisions", "300"), ("scene.toml",), lambda done: done.summary["n"], 32
        ),
        "--packing-fraction": added(
            (*PACK, *OUT), ("--packing-fraction", "0.3"), lambda done: done.history["packing_fraction"][0],
            lambda seen: seen > 0.3,
        ),
        "--out": added(PACK, ("--out", "elsewhere"), made("elsewhere/summary.json"), True),
        "--seed": added(
            (*PACK, *OUT), ("--seed", "5"),
            lambda done: (done.summary["seed"], done.summary["packing_fraction"]), lambda seen: seen[0] == 5,
        ),
        "--seeds": added((*PACK, *OUT), ("--seeds", "2"), made("out/seed-2/summary.json"), True),
        "--cores": added((*PACK, *OUT), ("--cores", "1"), lambda done: done.code, 2),
        "--report": added((*PACK, *OUT, "--seeds", "1"), ("--report",), made("out/report.html"), True),
        "--json": added((*PACK, *OUT), ("--json",), json_alone, True),
        "--quiet": SILENT,
        "--resume": added(
            (*PACK, "--out", "stopped"), ("--resume",), lambda done: done.code, 0
        ),
        "--overwrite": added((*PACK, "--out", "packed"), ("--overwrite",), lambda done: done.code, 0),
        "--n": added((*PACK, *OUT), ("--n", "30"), told("n"), 30),
        "--dimension": added((*PACK, *OUT), ("--dimension", "1"), told("dimension"), 1),
        "--species": added((*PACK, *OUT), SPECIES, ratio, 1.4),
        "--walls": added((*PACK, *OUT), ("--walls",), lambda done: done.frames[-1].periodic, (False, False)),
        "--rate": added((*PACK, *OUT), ("--rate", "0.2"), lambda done: {*done.history["rate"]}, {0.2}),
        "--until-Z": added(
            (*PACK, *OUT), ("--until-Z", "1e4"), told("note"), "Z = PV/NkT = 10000 reached"
        ),
        "--stage": added(
            (*without(PACK, "--rate", "--until-Z"), *OUT, "--collisions", "2000"),
            ("--stage", "0.2:10", "--stage", "0.1:1e3"),
            lambda done: {*done.history["rate"]}, {0.1, 0.2},
        ),
        "--collisions": added((*PACK, *OUT), ("--collisions", "300"), told("collisions"), 300),
        "--common": added((*PACK, *OUT, *SPECIES), ("--common",), ratio, 1.0),
        "--pictures": added((*PACK, *OUT), ("--pictures",), made("out/gaps.png"), True),
        "--no-pictures": added((*PACK[:-1], *OUT), ("--no-pictures",), made("out/gaps.png"), False),
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
    "compile": {
        "scenes": SILENT,  # tests/cli/test_compile.py
        "--quiet": SILENT,
    },
    "measure": {
        "path": added((), ("two.extxyz", "rdf", *OUT), made("out/rdf.csv"), True),
        "quantities": added(
            ("two.extxyz", *OUT), ("rdf",), lambda done: {p.stem for p in (done.folder / "out").iterdir()},
            {"rdf"},
        ),
        "--out": added(("two.extxyz", "rdf"), OUT, made("out/rdf.csv"), True),
        "--bins": added(MEASURE, ("--bins", "7"), lambda done: len(done.table), 7),
        "--width": added((*MEASURE, "--rmax", "2"), ("--width", "0.25"), lambda done: len(done.table), 4),
        "--rmax": added((*MEASURE, "--width", "0.1"), ("--rmax", "2"), lambda done: len(done.table), 10),
        "--pair": added(MEASURE, ("--pair", "0,1"), lambda done: done.table["g"].sum(), None),
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
    "trade": {
        "--quiet": SILENT,
        "study": added(
            (), ("scene.toml",), lambda done: done.asked["spec"].scene["cells"], 2
        ),
        "--out": added((), OUT, lambda done: str(done.asked["out"]), "out"),
        "--seconds": added((), ("--seconds", "0.5"), lambda done: done.asked["spec"].seconds, 0.5),
        "--seed": added((), ("--seed", "7"), lambda done: done.asked["spec"].seed, 7),
        # What is written is looked at by the test of the trade and by those of other studies.
        "--report": SILENT,
        "--pictures": SILENT,
        "--no-pictures": SILENT,
        "--json": SILENT,
    },
    "plan": {
        "--quiet": SILENT,
        "scene": added((), ("scene.toml",), lambda done: str(done.asked["scene"]), "scene.toml"),
        "--target": added((), ("--target", "Z=+-0.1"), lambda done: done.asked["target"], "Z=+-0.1"),
        "--packing-fraction": added(
            (), ("--packing-fraction", "0.2"), lambda done: done.asked["packing_fraction"], 0.2
        ),
        "--dimension": added((), ("--dimension", "2"), lambda done: done.asked["dimension"], 2),
        "--species": added(
            (), ("--species", "0.5:1", "--species", "0.5:1.4:2"), lambda done: done.asked["species"],
            [{"fraction": 0.5, "diameter": 1.0}, {"fraction": 0.5, "diameter": 1.4, "mass": 2.0}],
        ),
        "--n": added((), ("--n", "100"), lambda done: done.asked["n"], 100),
        "--seed": added((), ("--seed", "7"), lambda done: done.asked["seed"], 7),
        "--cores": added((), ("--cores", "3"), lambda done: done.asked["cores"], 3),
        "--walltime": added((), ("--walltime", "1800"), lambda done: done.asked["walltime"], 1800.0),
        "--pilot": added((), ("--pilot", "2"), lambda done: done.asked["pilot_seconds"], 2.0),
        "--run": added((), ("--run",), made("carom-plan/outcome.json"), True),
        "--out": added((), OUT, made("out/plan.json"), True),
        "--json": added((), ("--json",), json_alone, True),
    },
    "code": {
        "study": added(OUT, ("5",), made("out/code.json"), True),
        "--out": added(("5",), ("--out", "elsewhere"), made("elsewhere/code.json"), True),
        "--quiet": SILENT,
        "--dimension": added(
            ("5",), ("--dimension", "4"), lambda done: "5 points on S^3" in done.printed, True
        ),
        "--tries": added(("9",), ("--tries", "3"), lambda done: done.asked["spec"].tries, 3),
        "--seed": added(("9",), ("--seed", "7"), lambda done: done.asked["spec"].seed, 7),
        "--agree": added(("9",), ("--agree", "3"), lambda done: done.asked["spec"].agree, 3),
        "--rate": added(("9",), ("--rate", "0.1"), lambda done: done.asked["spec"].rate, 0.1),
        "--hops": added(("9",), ("--hops", "2"), lambda done: done.asked["spec"].hops, 2),
        "--starts": added(("9",), ("--starts", "3"), lambda done: done.asked["spec"].starts, 3),
        "--digits": added(
            ("5", "--json"), ("--digits", "40"), lambda done: len(json.loads(done.printed)["angle"]), 41
        ),
        "--engine": added(("9",), ("--engine", "threads"), lambda done: done.asked["executor"], "threads"),
        "--cores": added(("9",), ("--cores", "1"), lambda done: done.asked["cores"], 1),
        "--scheduler": added(
            ("9",), ("--scheduler", "tcp://x:1"), lambda done: done.asked["executor"], "tcp://x:1"
        ),
        "--report": added(("5", *OUT), ("--report",), made("out/report.html"), True),
        "--pictures": added(("5", *OUT, "--no-pictures"), ("--pictures",), made("out/code.png"), True),
        "--no-pictures": added(("5", *OUT), ("--no-pictures",), made("out/code.png"), False),
        "--json": added(("5",), ("--json",), json_alone, True),
    },
    "eos": {
        "--quiet": SILENT,
        "study": added((*EOS, *OUT), ("study.toml",), scene_told("mass"), {2.0}),
        "--out": added(EOS, ("--out", "elsewhere"), made("elsewhere/eos.csv"), True),
        "--packing-fraction": added(
            (*EOS[2:], *OUT, "study.toml"), ("--packing-fraction", "0.15"),
            scene_told("packing_fraction"), {0.15},
        ),
        "--n": added((*EOS, *OUT), ("--n", "40"), scene_told("n"), {40}),
        "--replicas": added((*EOS, *OUT), ("--replicas", "2"), lambda done: len(done.tasks), 2),
        "--dimension": added((), ("--dimension", "2"), lambda done: done.asked["spec"].dimension, 2),
        "--lattice": added((*EOS, *OUT), ("--lattice", "fcc"), scene_told("initial"), {"fcc"}),
        "--kT": added((*EOS, *OUT), ("--kT", "2"), scene_told("kT"), {2.0}),
        "--seed": added((*EOS, *OUT), ("--seed", "7"), tasked("seed"), {7}),
        "--relative-error": added(
            (), ("--relative-error", "0.1"), lambda done: done.asked["spec"].relative_error, 0.1
        ),
        "--collisions-per-particle": added(
            (*without(EOS, "--collisions-per-particle"), *OUT, "study.toml"),
            ("--collisions-per-particle", "60"), tasked("collisions_per_particle"), {60.0},
        ),
        "--equilibration": added((*EOS, *OUT), ("--equilibration", "30"), tasked("equilibration"), {30.0}),
        "--engine": added((), ("--engine", "threads"), lambda done: done.asked["executor"], "threads"),
        "--cores": added((), ("--cores", "3"), lambda done: done.asked["cores"], 3),
        "--scheduler": added(
            (), ("--scheduler", "tcp://x:1"), lambda done: done.asked["executor"], "tcp://x:1"
        ),
        "--report": added((*EOS, *OUT), ("--report",), made("out/report.html"), True),
        "--pictures": added((*EOS, *OUT), ("--pictures",), made("out/eos.png"), True),
        "--no-pictures": added((*EOS[:-1], *OUT), ("--no-pictures",), made("out/eos.png"), False),
        "--json": added((*EOS, *OUT), ("--json",), json_alone, True),
    },
    "transport": {
        "--quiet": SILENT,
        "study": added(
            (), ("scene.toml",), lambda done: done.asked["spec"].packing_fraction, close_to((0.3,))
        ),
        "--out": added((), ("--out", "elsewhere"), lambda done: str(done.asked["out"]), "elsewhere"),
        "--packing-fraction": added(
            (), ("--packing-fraction", "0.15"), lambda done: done.asked["spec"].packing_fraction, (0.15,)
        ),
        "--n": added((), ("--n", "40"), lambda done: done.asked["spec"].n, (40,)),
        "--kT": added((), ("--kT", "2"), lambda done: done.asked["spec"].kT, 2.0),
        "--lattice": added((), ("--lattice", "fcc"), lambda done: done.asked["spec"].lattice, "fcc"),
        "--replicas": added((), ("--replicas", "2"), lambda done: done.asked["spec"].replicas, 2),
        "--dimension": added((), ("--dimension", "2"), lambda done: done.asked["spec"].dimension, 2),
        "--seed": added((), ("--seed", "7"), lambda done: done.asked["spec"].seed, 7),
        "--relative-error": added(
            (), ("--relative-error", "0.1"), lambda done: done.asked["spec"].relative_error, 0.1
        ),
        "--collisions-per-particle": added(
            (), ("--collisions-per-particle", "60"),
            lambda done: done.asked["spec"].collisions_per_particle, 60.0,
        ),
        "--equilibration": added(
            (), ("--equilibration", "30"), lambda done: done.asked["spec"].equilibration, 30.0
        ),
        "--engine": added((), ("--engine", "threads"), lambda done: done.asked["executor"], "threads"),
        "--cores": added((), ("--cores", "3"), lambda done: done.asked["cores"], 3),
        "--scheduler": added(
            (), ("--scheduler", "tcp://x:1"), lambda done: done.asked["executor"], "tcp://x:1"
        ),
        "--report": added((*TRANSPORT, *OUT), ("--report",), made("out/report.html"), True),
        "--pictures": added((*TRANSPORT, *OUT), ("--pictures",), made("out/transport.png"), True),
        "--no-pictures": added(
            (*TRANSPORT[:-1], *OUT), ("--no-pictures",), made("out/transport.png"), False
        ),
        "--json": added((*TRANSPORT, *OUT), ("--json",), json_alone, True),
    },
    "shear": {
        "--quiet": SILENT,
        "study": added(
            (), ("scene.toml",), lambda done: done.asked["spec"].packing_fraction, close_to((0.3,))
        ),
        "--out": added((), ("--out", "elsewhere"), lambda done: str(done.asked["out"]), "elsewhere"),
        **{
            flag: added(
                (), (flag, text),
                lambda done, flag=flag: getattr(done.asked["spec"], flag[2:].replace("-", "_")), right,
            )
            for flag, text, right in (
                ("--packing-fraction", "0.15", (0.15,)), ("--n", "40", (40,)), ("--kT", "2", 2.0),
                ("--lattice", "fcc", "fcc"), ("--replicas", "3", 3), ("--dimension", "2", 2),
                ("--seed", "7", 7),
                ("--relative-error", "0.1", 0.1), ("--strains", "60", 60.0), ("--equilibration", "30", 30.0),
                ("--rate", "0.2:0.6:3", (0.2, 0.4, 0.6)), ("--restitution", "0.8", 0.8),
                ("--thermostat", "rescale", "rescale"),
            )
        },
        "--engine": added((), ("--engine", "threads"), lambda done: done.asked["executor"], "threads"),
        "--cores": added((), ("--cores", "3"), lambda done: done.asked["cores"], 3),
        "--scheduler": added(
            (), ("--scheduler", "tcp://x:1"), lambda done: done.asked["executor"], "tcp://x:1"
        ),
        "--report": added((*SHEAR, *OUT), ("--report",), made("out/report.html"), True),
        "--pictures": added((*SHEAR, *OUT), ("--pictures",), made("out/shear.png"), True),
        "--no-pictures": added((*SHEAR[:-1], *OUT), ("--no-pictures",), made("out/shear.png"), False),
        "--json": added((*SHEAR, *OUT), ("--json",), json_alone, True),
    },
    "view": {
        "source": added((), ("two.extxyz",), lambda done: str(done.asked.get("source")), "two.extxyz"),
        "--out": added(
            ("two.extxyz",), ("--out", "page.html"), lambda done: str(done.asked["page"]), "page.html"
        ),
        "--collisions": added(
            ("two.extxyz",), ("--collisions", "50"), lambda done: done.asked["collisions"], 50
        ),
        "--open": added(
            ("two.extxyz", "--no-open"), ("--open",), lambda done: done.asked.get("launched"), "two.html"
        ),
        "--no-open": added(
            ("two.extxyz",), ("--no-open",), lambda done: done.asked.get("launched"), None
        ),
        "--trust-code": added(("hunt",), ("--trust-code",), made("hunt/ran"), True),
        "--overwrite": added(
            ("two.extxyz", "--out", "full/old.html"), ("--overwrite",), lambda done: done.code, 0
        ),
    },
    "movie": {
        "--quiet": SILENT,
        "trajectory": added(
            (), ("two.extxyz", "two.gif"), lambda done: str(done.asked.get("trajectory")), "two.extxyz"
        ),
        "target": added(
            ("two.extxyz",), ("two.gif",), lambda done: str(done.asked.get("target")), "two.gif"
        ),
        "--fps": added(MOVIE, ("--fps", "12"), lambda done: done.asked["fps"], 12),
        "--size": added(MOVIE, ("--size", "200"), lambda done: done.asked["size"], 200),
        "--color": added(MOVIE, ("--color", "speed"), lambda done: done.asked["color"], "speed"),
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
    (folder / "logged.toml").write_text(
        "[scene]\nlattice = 'fcc'\ncells = 3\npacking_fraction = 0.3\n[run]\nequilibration = 1\nframes = 2\n"
        "collisions_per_particle = 40\nevent_log = true\npictures = false\n"
    )
    (folder / "study.toml").write_text(
        "[study]\npacking_fraction = [0.1]\nn = 32\ncollisions_per_particle = 40\n[scene]\nmass = 2.0\n"
    )
    scene = carom.Scene.random(
        species=[carom.Species(count=12), carom.Species(count=12)], box=(6.0, 6.0, 6.0), seed=1
    )
    with io.open(folder / "two.extxyz", "w") as writer:
        for time in (0.0, 1.0):
            writer.write(frame_at(scene, time))
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


def frame_at(scene, time):
    """Return the scene as a frame."""
    return Frame(
        time, 0, scene.positions, np.zeros_like(scene.positions), scene.box, scene.diameters, scene.masses,
        species=scene.species,
    )  # fmt: skip


def type_in(folder, command, *arguments, asked=None):
    """Type a command in a folder."""
    with contextlib.chdir(folder), pytest.MonkeyPatch.context() as patch:
        for name in [name for name in sys.modules if name.startswith("carom_rules_")]:
            patch.delitem(sys.modules, name)  # one source runs once in a process
        if asked is not None:
            importlib.import_module("carom.studies.saved")  # whose docstrings are those of Study.run

            def plan(target, **settings):
                asked.update(target=target, **settings)
                return PLAN

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
        done = CliRunner().invoke(cli.app, [command, *arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit | Asked):
        raise done.exception
    return Done(folder, done.exit_code, done.stdout, asked or {})


KERNELS = {("pack", "--walls"), ("pack", "--dimension")}
"""Options that need kernels of their own, half a minute to compile."""


@pytest.mark.parametrize(
    ("command", "option"),
    [
        slow(command, option) if (command, option) in KERNELS else (command, option)
        for command, cases in CASES.items()
        for option, case in cases.items()
        if case is not SILENT
    ],
)
def test_an_option_changes_what_the_command_does(command, option, material, typed, tmp_path_factory):
    case = CASES[command][option]
    asked = {} if (command, option) in TOO_SLOW else None
    arguments = (command, *case.without)
    if arguments not in typed:
        folder = tmp_path_factory.mktemp("without") / "here"
        shutil.copytree(material, folder)
        typed[arguments] = type_in(folder, *arguments, asked=asked)
    before = case.look(typed[arguments])
    folder = tmp_path_factory.mktemp("with") / "here"
    shutil.copytree(material, folder)
    after = case.look(type_in(folder, *arguments, *case.option, asked=None if asked is None else {}))
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
    assert {*LONG, "measure", "export", "movie", "compile"} == PROGRESS


@pytest.mark.parametrize("command", sorted(PROGRESS))
def test_a_quiet_command_shows_no_progress(command, monkeypatch, capsys):
    monkeypatch.setattr(heartbeat, "EVERY", 0.01)
    heartbeat.hush(False)
    parsed = COMMANDS[command].make_context(command, ["--quiet", *NEEDED.get(command, [])])
    try:
        assert "quiet" not in parsed.params
        with heartbeat.starting(), screen.watched() as progress, study.watched("runs") as (told, _):
            progress("Measuring", 0.5)
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
    ("words", "answer"),
    [
        (["run", "--phi", "0.3"], "Did you mean --eta?"),
        (["eos", "--packing-fractions", "0.3"], "Did you mean --eta?"),
        (["plan", "--workers=2"], "Did you mean --cores?"),
        (["run", "-n", "5"], "Did you mean --n?"),
        (["run", "--explain"], "Did you mean --dry-run?"),
        (["measure", "run1", "--png"], "Did you mean --pictures?"),
        (["plan", "--error", "1e-3"], "Did you mean --target?"),
        (["rdf", "run1"], "carom measure PATH rdf"),
        (["run", "--pakcing-fraction", "0.3"], "--packing-fraction"),
    ],
)
def test_what_does_not_exist_is_answered_with_what_is_meant(words, answer):
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == 2
    assert answer in " ".join(done.output.replace("│", " ").split())


def test_other_words_lead_to_options_and_commands_that_there_are():
    known = {name for _, _, names in names_of() for name in names}
    assert {*OPTIONS} <= known
    assert {each.split()[0] for each in meant.COMMANDS.values()} <= COMMANDS.keys()
    assert not meant.COMMANDS.keys() & COMMANDS.keys()


def test_the_help_has_four_groups_and_short_texts_without_semicolons():
    printed = CliRunner().invoke(cli.app, ["--help"]).output
    places = [printed.index(f" {group} ") for group in ("Start", "Simulate", "Study", "Look")]
    assert places == sorted(places)
    for name, command in COMMANDS.items():
        text = command.help.split("\n\n")[0]
        assert len(text) <= 70, name
        assert text.endswith(".")
        assert ";" not in text
        assert text.split()[0] in (
            "Write", "Tell", "Simulate", "Compress", "Spread", "Continue", "Measure", "Find", "Compare",
            "Show", "Make", "Convert", "Compile",
        )  # fmt: skip
