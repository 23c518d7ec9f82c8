"""Every option of every command changes what the command does; an option without a case here fails."""

import contextlib
import json
import shutil
import sys
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
from carom.frame import Frame

RUN = ("--lattice", "fcc", "--cells", "3", "--packing-fraction", "0.3", "--equilibration", "10",
       "--frames", "2", "--collisions-per-particle", "40", "--no-pictures")  # fmt: skip
PACK = ("--n", "20", "--dimension", "2", "--rate", "0.1", "--until-Z", "1e3", "--no-pictures")
EOS = ("--eta", "0.1", "--n", "32", "--replicas", "1", "--collisions-per-particle", "50", "--equilibration",
       "20", "--engine", "serial", "--no-pictures")  # fmt: skip
TRANSPORT = ("--eta", "0.1", "--n", "32", "--replicas", "1", "--collisions-per-particle", "100",
             "--equilibration", "20", "--engine", "serial", "--no-pictures")  # fmt: skip


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
        lines = (self.folder / "out.csv").read_text().splitlines()
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
    """Look at what `--explain` says of a scene."""
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
EXPLAIN = (*RUN[:6], "--explain")
NO_LENGTH = without(RUN, "--collisions-per-particle")
LOGGED = ("logged.toml", "--no-event-log")
SPECIES = ("--species", "10:1", "--species", "10:1.4")

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
    *(("trade", option) for option in ("scene", "--out", "--seconds", "--overwrite")),
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
    *(("code", option) for option in ("--tries", "--seed", "--rate", "--hops", "--starts", "--cores")),
    *(
        ("transport", option)
        for option in (
            "scene", "--out", "--packing-fraction", "--n", "--kT", "--lattice", "--replicas", "--dimension",
            "--seed",
            "--relative-error", "--collisions-per-particle", "--equilibration", "--engine", "--cores",
            "--scheduler",
        )
    ),
}  # fmt: skip
"""Here the function behind the command is only asked: its own tests show what it does."""

CASES = {
    "run": {
        "scene": added(("--explain",), ("scene.toml",), in_brackets("n"), "32"),
        "--out": added(RUN, ("--out", "elsewhere"), made("elsewhere/summary.json"), True),
        "--seed": added(
            (*RUN, *OUT), ("--seed", "5"),
            lambda done: (done.summary["seed"], done.frames[0].positions[0, 0]), lambda seen: seen[0] == 5,
        ),
        "--json": added((*RUN, *OUT), ("--json",), json_alone, True),
        "--overwrite": added((*RUN, "--out", "full"), ("--overwrite",), lambda done: done.code, 0),
        "--lattice": added(
            without(EXPLAIN, "--lattice"), ("--lattice", "cubic"), lambda done: "n=27" in done.printed, True
        ),
        "--kT": added((*RUN, *OUT), ("--kT", "2"), told("kT"), close_to(2.0)),
        "--time": added((*NO_LENGTH, *OUT), ("--time", "3"), told("time"), close_to(3.0)),
        "--write": added(
            (*RUN, *OUT), ("--write", "extxyz"), told("trajectories"), ["trajectory.extxyz"]
        ),
        "--dimension": added(("--explain",), ("--dimension", "2"), in_brackets("dimension"), "2"),
        "--n": added(without(EXPLAIN, "--cells"), ("--n", "32"), in_brackets("n"), "32"),
        "--cells": added(without(EXPLAIN, "--cells"), ("--cells", "2"), in_brackets("n"), "32"),
        "--packing-fraction": added(
            without(EXPLAIN, "--packing-fraction"), ("--packing-fraction", "0.2"),
            lambda done: "packing_fraction=0.2)" in done.printed, True,
        ),
        "--density": added(
            without(EXPLAIN, "--packing-fraction"), ("--density", "0.6"),
            lambda done: "packing_fraction=0.314159)" in done.printed, True,
        ),
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
        "--explain": added((*RUN, *OUT), ("--explain",), made("out"), False),
        # Several change no bit; that the number is read is seen by one that is refused.
        "--cores": added((*RUN, *OUT), ("--cores", "0"), lambda done: done.code, 2),
        "--trust-code": added(("hunt/scene.toml", "--explain"), ("--trust-code",), made("hunt/ran"), True),
    },
    "resume": {
        "--cores": added(("begun",), ("--cores", "two"), lambda done: done.code, 2),
        "--trust-code": added(("hunt",), ("--trust-code",), made("hunt/ran"), True),
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
        "--json": added((*PACK, *OUT), ("--json",), json_alone, True),
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
        "source": added((), ("two.extxyz", "out.h5md"), made("out.h5md"), True),
        "target": added(("two.extxyz",), ("out.h5md",), made("out.h5md"), True),
        "--overwrite": added(
            ("two.extxyz", "full/trajectory.h5md"), ("--overwrite",), lambda done: done.code, 0
        ),
    },
    "rdf": {
        "trajectory": added((), ("two.extxyz", "--out", "out.csv"), made("out.csv"), True),
        "--out": added(("two.extxyz",), ("--out", "out.csv"), made("out.csv"), True),
        "--png": added(("two.extxyz", "--out", "out.csv"), ("--png",), made("out.png"), True),
        "--rmax": added(
            ("two.extxyz", "--out", "out.csv", "--width", "0.1"), ("--rmax", "2"),
            lambda done: len(done.table), 10,
        ),
        "--width": added(
            ("two.extxyz", "--out", "out.csv", "--rmax", "2"), ("--width", "0.25"),
            lambda done: len(done.table), 4,
        ),
        "--pair": added(
            ("two.extxyz", "--out", "out.csv"), ("--pair", "0,1"), lambda done: done.table["g"].sum(), None
        ),
        "--overwrite": added(
            ("two.extxyz", "--out", "full/rdf.csv"), ("--overwrite",), lambda done: done.code, 0
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
        "scene": added(
            (), ("scene.toml",), lambda done: done.asked["plan"] and done.asked["plan"].scene.cells, 2
        ),
        "--out": added((), OUT, lambda done: str(done.asked["out"]), "out"),
        "--seconds": added((), ("--seconds", "0.5"), lambda done: done.asked["seconds"], 0.5),
        "--overwrite": added((), ("--overwrite",), lambda done: done.asked["overwrite"], True),
    },
    "plan": {
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
        "n": added((), ("5",), lambda done: "5 points on S^2" in done.printed, True),
        "--dimension": added(
            ("5",), ("--dimension", "4"), lambda done: "5 points on S^3" in done.printed, True
        ),
        "--tries": added(("9",), ("--tries", "3"), lambda done: done.asked.get("tries"), 3),
        "--seed": added(("9",), ("--seed", "7"), lambda done: done.asked.get("seed"), 7),
        "--rate": added(("9",), ("--rate", "0.1"), lambda done: done.asked.get("rate"), 0.1),
        "--hops": added(("9",), ("--hops", "2"), lambda done: done.asked.get("hops"), 2),
        "--starts": added(("9",), ("--starts", "3"), lambda done: done.asked.get("starts"), 3),
        "--digits": added(
            ("5", "--json"), ("--digits", "40"), lambda done: len(json.loads(done.printed)["angle"]), 41
        ),
        "--cores": added(("9",), ("--cores", "1"), lambda done: done.asked["cores"], 1),
        "--out": added(("5",), ("--out", "five.txt"), made("five.txt"), True),
        "--overwrite": added(
            ("5", "--out", "full/rdf.csv"), ("--overwrite",), lambda done: done.code, 0
        ),
        "--json": added(("5",), ("--json",), json_alone, True),
    },
    "eos": {
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
        "scene": added(
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

            def trade(plan, out, **settings):
                asked.update(plan=plan, out=out, **settings)
                raise Asked

            def plan(target, **settings):
                asked.update(target=target, **settings)
                return PLAN

            def run(study, **settings):
                asked.update(spec=study.spec, **settings)
                raise Asked

            def code(n, **settings):
                asked.update(n=n, **settings)
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
            patch.setattr("carom.studies.codes.search.spherical_code", code)
            patch.setattr("carom.studies.accuracy.trade.trade", trade)
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
        for option in cases
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
