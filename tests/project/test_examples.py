"""Every example runs as a person would run it, small, and writes only where it is told to."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.marks import slow

EXAMPLES = sorted(Path(__file__).parents[2].joinpath("examples").glob("*.py"))

LONG = (
    "active_disks",
    "barometric_column",
    "billiards",
    "brazil_nut",
    "brownian_spheres",
    "caps_on_a_sphere",
    "constant_pressure",
    "cushions_160",
    "depletion",
    "disks_2000",
    "disks_27",
    "equation_of_state",
    "finite_size",
    "freezing_of_spheres",
    "glassy_relaxation",
    "haffs_law",
    "lorentz_gas",
    "melting_of_disks",
    "order_of_disks",
    "oscillating_shear",
    "replica_exchange",
    "rosato_bed",
    "shaken_ball",
    "sheared_spheres",
    "square_well",
    "swap_liquid",
    "study_on_a_cluster",
    "transport",
    "two_armies",
)
"""Longer than fifteen CPU seconds even at smoke size, compilation included."""


def test_there_are_examples():
    assert len(EXAMPLES) >= 6


@pytest.mark.ci
@pytest.mark.parametrize(
    "example",
    [slow(path) if path.stem in LONG else path for path in EXAMPLES],
    ids=[path.stem for path in EXAMPLES],
)
def test_example_runs_at_smoke_size(example, tmp_path):
    # A folder of its own to stand in, so that a file written beside --out is seen.
    here = tmp_path / "here"
    here.mkdir()
    out = tmp_path / "out"
    done = subprocess.run(
        [sys.executable, example, "--smoke", "--out", out],
        cwd=here,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip(), "an example tells what it did"
    assert "Traceback" not in done.stdout + done.stderr
    assert not list(here.iterdir()), "an example writes into --out alone"


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_a_percent_script_with_a_purpose(example):
    text = example.read_text(encoding="utf-8")
    assert text.startswith('"""'), "the first line says what the example is about"
    assert text.count("\n# %% ") >= 2, "cells, each with a sentence"
    assert "--smoke" in text
    assert "--out" in text
