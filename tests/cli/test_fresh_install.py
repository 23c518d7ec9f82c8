"""Every command of ``carom --help`` works in the environment that the README's ``pip install .`` makes.

The environment is fresh: no extra, no test's package. Typed small, in one folder, in this order.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from carom import cli

ROOT = Path(__file__).parents[2]

SCENE = """
[scene]
dimension = 2
n = 16
packing_fraction = 0.3

[run]
equilibration = 10
collisions_per_particle = 40
frames = 4
"""

TYPED = {
    "init": ("mine.toml",),
    "run": ("scene.toml", "--out", "out"),
    "resume": ("out",),
    "export": ("out/trajectory.h5md", "out.extxyz"),
    "info": ("out",),
    "measure": ("out/trajectory.h5md", "rdf", "--out", "measured"),
    "view": ("out", "--out", "page.html", "--no-open"),
    "movie": ("out/trajectory.h5md", "movie.gif"),
    "pack": ("--n", "20", "--dimension", "2", "--rate", "0.1", "--until-Z", "1e3", "--out", "packed"),
    "plan": ("scene.toml", "--target", "Z=0.05", "--run", "--out", "planned"),
    "eos": ("--dimension", "2", "--eta", "0.3", "--n", "64", "--replicas", "1", "--collisions-per-particle",
            "50", "--equilibration", "20", "--engine", "serial", "--out", "eos"),
    "transport": ("--eta", "0.1", "--n", "32", "--replicas", "1", "--collisions-per-particle", "100",
                  "--equilibration", "20", "--engine", "serial", "--out", "transport"),
    "shear": ("--rate", "1", "--eta", "0.1", "--n", "32", "--replicas", "1", "--strains", "10",
              "--equilibration", "20", "--engine", "serial", "--out", "shear"),
    "code": ("5",),
    "trade": ("scene.toml", "--seconds", "0.02", "--out", "trade"),
}  # fmt: skip
"""What is typed after each command."""


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    """Return the ``carom`` of a fresh environment, and a folder with a scene file."""
    folder = tmp_path_factory.mktemp("fresh")
    source = folder / "source"  # pip builds in the folder that it installs from
    shutil.copytree(
        ROOT, source, ignore=lambda at, names: [n for n in names if n in {".git", "docs", "tests", "build"}]
    )
    subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True, timeout=120)
    programs = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
    subprocess.run([programs / "python", "-m", "pip", "install", "--quiet", source], check=True, timeout=1800)
    (folder / "scene.toml").write_text(SCENE)
    return programs / "carom", folder


def test_every_command_is_typed():
    assert set(TYPED) == set(typer.main.get_command(cli.app).commands)


@pytest.mark.ci
def test_every_command_works_after_the_plain_install(fresh):
    carom, folder = fresh
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
    for name, words in TYPED.items():
        done = subprocess.run(
            [carom, name, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=1800
        )
        # A run of a moment is too short for the slope of a coefficient.
        assert done.returncode in ((0, 3) if name == "transport" else (0,)), (name, done.stderr)
        print(name, "works", flush=True)
    for made in (
        "mine.toml", "out/summary.json", "out.extxyz", "measured/rdf.csv", "measured/rdf.png", "page.html",
        "movie.gif",
        "packed/summary.json", "planned/outcome.json", "trade/trade.csv",
    ):  # fmt: skip
        assert (folder / made).exists(), made
