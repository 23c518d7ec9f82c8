"""A test that hangs ends as a failure within its limit, and the next ones run."""

import re

import pytest
from helpers.inner import inner_pytest

HANGS = """
import os, subprocess, sys, time
from pathlib import Path

import pytest
from numba import njit

@njit
def counted(n):
    x = 0.0
    for _ in range(n):
        x = 0.5 * x + 1.0
    return x

counted(1)
pytestmark = pytest.mark.timeout(0.5)

def test_in_a_process():
    subprocess.run([sys.executable, "-c", "import time; time.sleep(60)"])

def test_at_a_pipe():
    ours, theirs = os.pipe()
    if not (child := os.fork()):
        time.sleep(60)
        os._exit(0)
    try:
        os.read(ours, 1)
    finally:
        os.kill(child, 9)

@pytest.fixture
def cleared():
    yield
    time.sleep(60)

def test_while_it_clears_up(cleared):
    raise ValueError("a failure")

@pytest.mark.timeout(2)
def test_in_compiled_code():
    if not (child := os.fork()):  # outlives this process, and has all its pipes
        time.sleep(60)
        os._exit(0)
    Path("child").write_text(str(child))
    counted(10**12)

@pytest.mark.timeout(60)
def test_that_is_well():
    os.kill(int(Path("child").read_text()), 9)
"""


HANGING = re.compile(r'Timeout \(0:00:03\)!\n(.*\n)*?.*test_inner.py", line \d+ in test_in_compiled_code')


@pytest.mark.ci
@pytest.mark.needs("Linux")
def test_a_test_that_hangs_fails_wherever_it_hangs_and_the_next_one_runs(tmp_path):
    said = inner_pytest(tmp_path, HANGS, "-n", "1")
    # Where the machine is busy the process may end before it has told of the signal.
    late = r"(Failed: Timeout \(>0.5s\) from pytest-timeout|hung in this test until its time was over)"
    for name in ("in_a_process", "at_a_pipe", "while_it_clears_up", "in_compiled_code"):
        assert re.search(rf"^_+ test_{name} _+\n(?:(?!^__).*\n)*.*{late}", said, re.MULTILINE), said
    assert HANGING.search(said), said
    # And then it fails twice: its process ends as well.
    assert re.search(r"[4-8] failed, 1 passed", said), said


@pytest.mark.slow
def test_compiled_code_that_hangs_ends_the_only_process_with_its_stack(tmp_path):
    said = inner_pytest(tmp_path, HANGS, "-k", "test_in_compiled")
    assert HANGING.search(said), said
