"""Ctrl-C while something is compiled waits for the compiler, and the screen says that it compiles."""

import os
import signal
import subprocess
import sys
import time

import pytest
from carom.cli.compiling import TEXT, compiling_told
from carom.compiling.deferred_signals import SIGNALS, signals_held
from helpers.workers import compiled_there

from carom.compiling import dispatch
from carom.studies import executors


class Compiled:
    """Stands for a compiled function of Numba: says when it was compiled to the end."""

    def __init__(self):
        self.finished = False

    def compile(self, signature):
        signal.raise_signal(signal.SIGINT)
        time.sleep(0)  # where Python would raise it
        self.finished = True
        return signature


def test_ctrl_c_comes_after_what_is_being_compiled():
    compiled = Compiled()
    with pytest.raises(KeyboardInterrupt):
        dispatch.watched(compiled).compile("f8")
    assert compiled.finished


@pytest.mark.parametrize("number", SIGNALS)
def test_a_handler_of_one_s_own_hears_the_signal_once_and_is_there_again(number):
    heard = []
    before = signal.signal(number, lambda number, frame: heard.append(number))
    try:
        own = signal.getsignal(number)
        with signals_held():
            signal.raise_signal(number)
            signal.raise_signal(number)
            assert heard == []
        assert heard == [number]
        assert signal.getsignal(number) is own
    finally:
        signal.signal(number, before)


@pytest.mark.needs("Unix")
def test_a_command_ends_at_once_while_it_compiles():
    program = """
import os, time
from carom.compiling.deferred_signals import leaving, signals_held
with leaving(lambda: os._exit(7)), signals_held():
    print("compiling", flush=True)
    time.sleep(60)  # as long as the compiler
"""
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) == 7


def test_what_the_compiler_raises_is_raised():
    with pytest.raises(ValueError, match="no such type"), signals_held():
        raise ValueError("no such type")


@pytest.mark.needs("compiled code")
def test_compiling_is_told_once_and_only_where_something_is_compiled(capsys):
    from numba import njit

    @njit
    def one(x):
        return x + 1

    with compiling_told():
        one(1)
        one(1.0)
    assert capsys.readouterr().err.count(TEXT) == 1
    with compiling_told():
        one(2)
    assert capsys.readouterr().err == ""
    one(1j)  # nobody listens any more
    assert capsys.readouterr().err == ""


@pytest.mark.needs("compiled code")
def test_the_screen_says_once_that_worker_processes_compile(capsys):
    results = []
    done = lambda _, found: results.append(found)  # noqa: E731
    how = {"done": done, "failed": print, "stop": lambda: False}
    with compiling_told(), executors.opened("processes", workers=2) as where:
        executors.run(compiled_there, [1, 2, 3], where, **how)
    assert sorted(results) == [2, 3, 4]
    assert capsys.readouterr().err.count(TEXT) == 1
    with compiling_told(), executors.opened("processes", workers=1) as where:
        executors.run(abs, [-1], where, **how)
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_worker_processes_end_in_silence(tmp_path):
    # A worker that had to tidy up while its interpreter ends wrote a traceback to the screen.
    script = tmp_path / "study.py"
    script.write_text(
        "import carom\ncarom.transport([0.1], n=32, collisions_per_particle=200, replicas=1, cores=1)\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.timing
@pytest.mark.slow
def test_ctrl_c_during_the_first_compilation_of_a_command_is_one_line(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-m", "carom", "run", "--n", "32", "--out", str(tmp_path / "run")]
    process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert process.stderr.readline().startswith("Compiling schedule (EqualCores, ")
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert "RuntimeError" not in err
