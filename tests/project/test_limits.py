"""A test that hangs ends as a failure within its limit, and the next ones run."""

import re

import pytest
from helpers.inner import inner_pytest

HANGS = """
import os, subprocess, sys, time

import pytest
from numba import njit

@njit
def counted(n):
    x = 0.0
    for _ in range(n):
        x = 0.5 * x + 1.0
    return x

counted(1)
pytestmark = pytest.mark.timeout(2)

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

def test_in_compiled_code():
    counted(10**12)

@pytest.mark.timeout(60)
def test_that_is_well():
    assert True
"""


def hanging(name):
    """Return how a process ends whose time is over: with the lines where it was."""
    return re.compile(rf'Timeout \(0:00:03\)!\n(.*\n)*?.*test_inner.py", line \d+ in {name}')


@pytest.mark.ci
@pytest.mark.needs("Linux")
def test_a_test_that_hangs_fails_and_the_next_one_runs(tmp_path):
    said = inner_pytest(tmp_path, HANGS, "-k", "process or pipe or well")
    assert len(re.findall(r"Failed: Timeout \(>2.0s\) from pytest-timeout", said)) >= 2, said
    assert "2 failed, 1 passed" in said, said


@pytest.mark.ci
@pytest.mark.parametrize(
    ("test", "name"), [("in_compiled", "test_in_compiled_code"), ("clears_up", "cleared")]
)
def test_what_hears_no_signal_ends_its_process_with_its_stack(tmp_path, test, name):
    said = inner_pytest(tmp_path, HANGS, "-k", test)
    assert hanging(name).search(said), said


@pytest.mark.ci
def test_a_process_that_has_ended_ends_the_run(tmp_path):
    said = inner_pytest(tmp_path, HANGS, "-n", "1", "-k", "compiled or well")
    named = re.findall(r"^worker 'gw\d' crashed while running 'test_inner.py::(\w+)'", said, re.MULTILINE)
    assert named == ["test_in_compiled_code"], said
    assert re.search(r"^=+ 1 failed in ", said, re.MULTILINE), said
