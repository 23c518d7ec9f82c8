"""The same bits on every engine and any number of workers; and nothing is lost when something is killed."""

import contextlib
import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import pytest
from helpers.commands import CAROM, WAIT, carom as command, wait_for
from helpers.needs import mpiexec
from helpers.workers import die, number_of, rest, run_all

import carom
from carom.errors import CaromWarning, FileError, InputError
from carom.studies import executors as engines

ETAS = [0.1, 0.3, 0.45]
SMALL = {"n": 108, "collisions_per_particle": 200, "equilibration": 20, "blocks": 64}

#: Runs of about half a second each, so that kills fall into them.
LONG = ["--eta", "0.3,0.4,0.45", "--n", "256", "--collisions-per-particle", "8000", "--no-pictures"]


def bits(study):
    """What must not depend on where it ran."""
    return {json.dumps(record["task"], sort_keys=True): record["result"] for record in study.records}


def stored(folder):
    """Results in a study's folder, without their provenance."""
    records = [json.loads(path.read_text()) for path in sorted((Path(folder) / "tasks").glob("*.json"))]
    return {json.dumps(record["task"], sort_keys=True): record["result"] for record in records}


@pytest.fixture(scope="module")
def serial():
    return carom.equation_of_state(ETAS, executor="serial", **SMALL)


def test_processes_give_the_same_bits(serial):
    study = carom.equation_of_state(ETAS, executor="processes", cores=2, **SMALL)
    assert bits(study) == bits(serial)
    assert study.engine.startswith("2")
    assert 1 <= len({record["provenance"]["process"] for record in study.records} - {os.getpid()}) <= 2


def test_threads_give_the_same_bits(serial):
    study = carom.equation_of_state(ETAS, executor="threads", cores=3, **SMALL)
    assert bits(study) == bits(serial)


@pytest.mark.parametrize(
    ("choice", "workers", "most", "name"),
    [
        (2, None, None, "2 processes"), (3, 2, 1, "1 process"), (None, 2, None, "2 processes"),
        ("processes", 3, 2, "2 processes"), ("threads", None, None, "7 threads"),
        ("threads", 3, 2, "2 threads"),
    ],
)  # fmt: skip
def test_there_are_as_many_workers_as_asked_for_and_no_more_than_tasks(
    monkeypatch, choice, workers, most, name
):
    monkeypatch.setattr(engines, "cores", lambda: 7)
    with engines.opened(choice, workers, most) as where:
        assert where.name == name


def test_executors_of_the_caller_stay_open(serial):
    with ThreadPoolExecutor(2) as pool:
        assert bits(carom.equation_of_state(ETAS, executor=pool, **SMALL)) == bits(serial)
        assert pool.submit(int, "3").result() == 3


def test_a_process_pool_of_the_caller_that_breaks_leaves_a_study_to_be_finished(serial, tmp_path):
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        with pytest.raises(Exception, match="abruptly"):
            pool.submit(os._exit, 1).result()
        with pytest.warns(CaromWarning, match="6 of 6 runs failed.*its worker was killed"):
            carom.equation_of_state(ETAS, executor=pool, out=tmp_path, **SMALL)
    study = carom.equation_of_state(ETAS, executor="serial", out=tmp_path, **SMALL)
    assert bits(study) == bits(serial)


@pytest.mark.ci
def test_scripts_need_no_main_guard(tmp_path):
    """Ten lines without `if __name__ == "__main__"` run in processes, on every system's way to start them."""
    script = tmp_path / "ten_lines.py"
    script.write_text(
        "import carom\n"
        "study = carom.equation_of_state([0.1], n=32, collisions_per_particle=50, cores=2)\n"
        "print('lines', study.complete)\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=WAIT)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "lines True\n"


@pytest.mark.needs("Unix")
def test_a_killed_worker_costs_its_own_task_only(tmp_path):
    values = [{"number": k, "always": k == 1, "mark": str(tmp_path / str(k))} for k in range(4)]
    with engines.opened("processes", 2) as where:
        ended, done, failed = run_all(die, values, where)
    assert ended
    # Each killed its first worker; the one that kills all of them is given up after three.
    assert sorted((value["number"], found) for value, found in done) == [(0, 0), (2, 2), (3, 3)]
    ((value, reason),) = failed
    assert value["number"] == 1
    assert "killed" in reason


@pytest.mark.needs("Unix")
def test_a_worker_killed_while_it_is_idle_costs_nothing():
    with engines.opened(1) as place:
        worker = place.submit(number_of, 0).result()
        os.kill(worker, signal.SIGKILL)
        deadline = time.monotonic() + WAIT
        while alive(worker):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        assert run_all(abs, [-3], place) == (True, [(-3, 3)], [])


def alive(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    with contextlib.suppress(OSError):
        # A zombie has ended; its parent has not looked yet.
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    return True


@pytest.mark.needs("Unix")
def test_workers_end_at_once_when_told_to():
    began = time.monotonic()
    with engines.opened("processes", 2) as where:
        ended, *_ = run_all(
            rest, [0.0, 600.0, 600.0], where, lambda done: bool(done) and time.monotonic() - began > 1.0
        )
        assert not ended
        where.end(True)
    assert time.monotonic() - began < 60.0


@pytest.mark.timing
def test_the_overhead_of_a_task_is_small(tmp_path):
    """From the issue: under 0.1 s a task beyond the engine's own time, here of tasks with hardly any of that.

    Processor time rather than the clock's, which counts what else the machine does.
    """
    short = {**SMALL, "collisions_per_particle": 1, "equilibration": 1}
    carom.equation_of_state([0.2], replicas=1, executor="serial", **short)
    began = time.process_time()
    carom.equation_of_state([0.2], replicas=20, executor="serial", out=tmp_path, **short)
    assert (time.process_time() - began) / 20 < 0.1


# Kills and stops of the whole.


@pytest.mark.ci
@pytest.mark.needs("Unix")
def test_killing_workers_and_the_study_at_random_leaves_a_study_that_finishes_with_the_same_bits(tmp_path):
    kill_at_random(tmp_path, rounds=2, seed=1)


@pytest.mark.slow
@pytest.mark.needs("Unix")
@pytest.mark.parametrize("seed", [2, 3])
def test_killing_more_often(tmp_path, seed):
    kill_at_random(tmp_path, rounds=8, seed=seed)


def children(process):
    """Processes that a process has started (Linux); none where that cannot be known."""
    found = []
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            found += [int(word) for word in task.read_text().split()]
    return found


def kill_at_random(folder, rounds, seed):
    assert command("eos", *LONG, "--engine", "serial", "--out", folder / "whole").returncode == 0
    expected = stored(folder / "whole")
    assert len(expected) == 6
    dice, out = random.Random(seed), folder / "killed"
    for _ in range(rounds):
        process = subprocess.Popen(
            [*CAROM, "eos", *LONG, "--cores", "2", "--out", out],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        wait_for(lambda: (out / "study.json").exists(), process)
        for _ in range(2):
            time.sleep(dice.uniform(0.1, 1.5))
            workers = children(process.pid)
            if workers and process.poll() is None:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(dice.choice(workers), signal.SIGKILL)
        time.sleep(dice.uniform(0.0, 1.0))
        workers = children(process.pid)
        process.kill()
        process.communicate(timeout=WAIT)
        # Whoever leads is gone, and the workers follow.
        deadline = time.monotonic() + WAIT
        while any(map(alive, workers)):
            assert time.monotonic() < deadline, "workers outlive the study"
            time.sleep(0.01)
        # Nothing half-written counts: every result there is whole and right.
        assert stored(out).items() <= expected.items()
    done = command("eos", *LONG, "--cores", "2", "--out", out)
    assert done.returncode == 0, done.stderr
    assert stored(out) == expected


@pytest.mark.ci
@pytest.mark.needs("Unix")
@pytest.mark.parametrize(
    ("engine", "number"),
    [("processes", signal.SIGINT), ("threads", signal.SIGINT), ("serial", signal.SIGTERM)],
)
def test_a_stopped_study_waits_for_the_next_job_and_lets_no_other_in(tmp_path, engine, number):
    process = subprocess.Popen(
        [*CAROM, "eos", *LONG, "--engine", engine, "--cores", "2", "--out", tmp_path],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    wait_for(lambda: stored_count(tmp_path) >= 1, process)
    with pytest.raises(FileError, match="Another process is running"):
        carom.load(tmp_path).run(executor="serial", out=tmp_path)
    began = time.monotonic()
    # As the terminal and Slurm do: to the whole group.
    os.killpg(process.pid, number)
    _, error = process.communicate(timeout=WAIT)
    assert process.returncode == 130, error
    assert "runs are done, and the same command goes on" in error
    assert "Traceback" not in error
    assert time.monotonic() - began < 10.0
    before = stored(tmp_path)
    assert 1 <= len(before) < 6
    again = command("eos", *LONG, "--engine", engine, "--cores", "2", "--out", tmp_path)
    assert again.returncode == 0, again.stderr
    assert before.items() <= stored(tmp_path).items()
    assert len(stored(tmp_path)) == 6


def stored_count(folder):
    return len(list((folder / "tasks").glob("[!.]*.json")))


# Dask: a scheduler and two workers, each a process of its own, over TCP.


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dask")
    listed = folder / "scheduler.json"
    options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    processes = [
        subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0",
             "--no-dashboard", "--scheduler-file", listed],
            **options,
        )
    ]  # fmt: skip
    try:
        wait_for(lambda: listed.exists() and listed.stat().st_size, processes[0])
        address = json.loads(listed.read_text())["address"]
        processes += [
            subprocess.Popen(
                [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1",
                 "--no-dashboard", "--local-directory", folder / name],
                **options,
            )
            for name in ("one", "two")
        ]  # fmt: skip
        yield address, processes
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait(timeout=WAIT)


def test_dask_over_tcp_gives_the_same_bits(serial, dask):
    from distributed import Client

    address, _ = dask
    assert address.startswith("tcp://")
    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=WAIT)
        study = carom.equation_of_state(ETAS, executor=client, **SMALL)
    assert bits(study) == bits(serial)
    assert len({record["provenance"]["process"] for record in study.records}) == 2


def test_the_command_line_uses_a_scheduler(dask, tmp_path):
    address, _ = dask
    short = ["--eta", "0.2", "--n", "108", "--collisions-per-particle", "100", "--no-pictures"]
    done = command("eos", *short, "--scheduler", address, "--out", tmp_path / "dask")
    assert done.returncode == 0, done.stderr
    assert command("eos", *short, "--engine", "serial", "--out", tmp_path / "serial").returncode == 0
    assert stored(tmp_path / "dask") == stored(tmp_path / "serial")


def test_a_scheduler_that_is_not_there_is_told(monkeypatch):
    monkeypatch.setattr(engines, "PATIENCE", 1.0)
    with pytest.raises(InputError, match="No Dask scheduler answers"), engines.opened("tcp://127.0.0.1:9"):
        pass


# MPI.


@pytest.mark.needs("MPI")
def test_mpi_gives_the_same_bits(tmp_path):
    short = ["--eta", "0.1,0.3", "--n", "108", "--collisions-per-particle", "50", "--no-pictures"]
    launcher = [mpiexec(), "-n", "3"]
    version = subprocess.run([mpiexec(), "--version"], capture_output=True, text=True, check=False)
    if "Open MPI" in version.stdout or "open-mpi" in version.stdout:
        # More processes than cores, and as any user: small machines run tests, too.
        launcher += ["--oversubscribe", "--allow-run-as-root"]
    under_mpi = [*launcher, sys.executable, "-m", "mpi4py.futures", "-m", "carom", "eos", *short]
    under_mpi += ["--out", str(tmp_path / "mpi")]
    done = subprocess.run(under_mpi, capture_output=True, text=True, timeout=WAIT)
    assert done.returncode == 0, done.stderr
    assert command("eos", *short, "--engine", "serial", "--out", tmp_path / "serial").returncode == 0
    assert stored(tmp_path / "mpi") == stored(tmp_path / "serial")
    records = [json.loads(path.read_text()) for path in (tmp_path / "mpi" / "tasks").glob("*.json")]
    assert len(records) == 4
    assert len({record["provenance"]["process"] for record in records}) == 2


@pytest.mark.needs("MPI")
def test_mpi_without_mpiexec_is_told():
    with pytest.raises(InputError, match="mpiexec"), engines.opened("mpi"):
        pass
