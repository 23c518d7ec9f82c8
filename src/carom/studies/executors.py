"""Where tasks run: in turn, in threads, in processes (pebble), under MPI, on Dask, or on any Executor.

Every place takes plain functions and plain values and returns futures. A study does not depend on where it
runs.
"""

from __future__ import annotations

import contextlib
import functools
import multiprocessing
import os
import signal
import sys
import threading
import types
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

from carom import checks
from carom.errors import CaromError, InputError
from carom.processors import cores
from carom.studies.job import Stopped
from carom.texts import counted

NAMES = ("processes", "threads", "serial", "mpi")

ATTEMPTS = 3
"""Workers that may die in a task before it counts as failed. One that needs too much memory kills each."""

GLANCE = 0.1
"""Seconds between two checks for Ctrl-C."""

PATIENCE = 10.0
"""Seconds to wait for the answer of a scheduler."""


class Failed(Exception):
    """A task failed, and why, in a clause; every process can read it, unlike the error itself."""


@dataclass(frozen=True)
class Place:
    """Where tasks run.

    Attributes
    ----------
    name : str
        For the provenance.
    submit : callable
        ``submit(function, value)`` returns a future.
    end : callable
        ``end(now)`` ends the workers, at once or after their tasks.
    local : bool
        Whether functions run in this process. They must then check themselves whether to stop.
    capacity : int or None
        Number of tasks at a time; None without limit.
    replaces : bool
        Whether workers that died are replaced: what they ran can run again.
    """

    name: str
    submit: Callable[[Callable[[Any], Any], Any], Future[Any]]
    end: Callable[[bool], object] = field(default_factory=lambda: lambda now: None)
    local: bool = False
    capacity: int | None = None
    replaces: bool = False


def check(choice: Any = None, cores: int | str | None = None) -> int | None:
    """Return with how many workers :func:`opened` could open this ``choice`` on ``cores``; open nothing.

    None, for as many as there are cores, of "auto" and None.

    Raises
    ------
    InputError
        If it could not.
    """
    workers = None if cores in (None, "auto") else checks.integer(cores, "cores", low=1)
    if isinstance(choice, int) and not isinstance(choice, bool):
        checks.integer(choice, "executor", low=1)
    elif choice is None or (isinstance(choice, str) and (choice in NAMES or "://" in choice)):
        return workers
    elif isinstance(choice, str) or not (hasattr(choice, "get_executor") or hasattr(choice, "submit")):
        raise InputError(
            f"executor must be one of {', '.join(NAMES)}, the address of a Dask scheduler (tcp://host:port), "
            f"a number of processes or an Executor; found {checks.describe(choice)}."
        )
    return workers


@contextlib.contextmanager
def opened(
    choice: Any = None, workers: int | None = None, most: int | None = None, *, main: bool = False
) -> Iterator[Place]:
    """Open a place for tasks, and close it after the body of a ``with``; at once if that raises.

    Parameters
    ----------
    choice : optional
        "processes", "threads", "serial" or "mpi" (inside ``mpiexec ... python -m mpi4py.futures``). Or the
        address of a Dask scheduler, such as "tcp://host:8786", an Executor, a Dask Client, or a number of
        processes. By default MPI if it is running, otherwise one process per core.
    workers : int, optional
        Processes or threads; as many as cores if left out.
    most : int, optional
        Number of tasks: more workers are not started.
    main : bool
        Whether processes need the main module of the caller, because the function is defined there.

    Raises
    ------
    InputError
        If the choice is none of these, or a package that it needs is missing.
    """
    check(choice, workers)
    place = _choose(choice, workers, most, main)
    try:
        yield place
    except BaseException:
        place.end(True)
        raise
    place.end(False)


def _choose(choice: Any, workers: int | None, most: int | None, main: bool) -> Place:
    if choice is None:
        choice = "mpi" if "mpi4py.futures" in sys.modules and _mpi_size() > 1 else "processes"
    if isinstance(choice, int):
        choice, workers = "processes", choice
    count = min(workers or cores(), most or sys.maxsize)
    if choice == "serial":
        return Place("serial", _at_once, local=True, capacity=1)
    if choice == "threads":
        pool = ThreadPoolExecutor(count)
        end = lambda now: pool.shutdown(wait=not now, cancel_futures=now)  # noqa: E731
        return Place(counted(count, "thread"), pool.submit, end, local=True)
    if choice == "processes":
        return _processes(count, main)
    if choice == "mpi":
        return _mpi()
    if isinstance(choice, str):
        return _dask(choice)
    if hasattr(choice, "get_executor"):
        # By default Dask assumes pure functions and deduplicates equal calls.
        return Place("Dask", choice.get_executor(pure=False).submit)
    return Place(type(choice).__name__, choice.submit)


def _at_once(function: Callable[[Any], Any], value: Any) -> Future[Any]:
    future: Future[Any] = Future()
    try:
        future.set_result(function(value))
    except Exception as error:
        future.set_exception(error)
    return future


class _Process(SpawnProcess):
    """A process without the caller's main module: scripts need no ``if __name__ == "__main__"``."""

    @staticmethod
    def _Popen(process: Any) -> Any:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = types.ModuleType("__main__")
        try:
            return SpawnProcess._Popen(process)
        finally:
            sys.modules["__main__"] = main


class _Context(SpawnContext):
    Process = _Process


def _processes(count: int, main: bool) -> Place:
    """Return worker processes; one that is killed costs its own task only."""
    from pebble import ProcessPool

    leash, lead = multiprocessing.Pipe(duplex=False)

    def new() -> ProcessPool:
        context = SpawnContext() if main else _Context()
        return ProcessPool(count, context=context, initializer=_begin, initargs=(leash,))

    pools = [new()]

    def submit(function: Callable[[Any], Any], value: Any) -> Future[Any]:
        if not pools[-1].active:  # its last worker was killed while nothing ran
            pools.append(new())
        return pools[-1].schedule(function, args=[value])

    def end(now: bool) -> None:
        if now:
            lead.close()
        for pool in pools:
            if now or not pool.active:
                pool.stop()
            else:
                pool.close()
            pool.join()

    name = counted(count, "process")
    return Place(name, submit, end, replaces=True)


def _begin(leash: Any) -> None:
    """Prepare a worker: it leaves Ctrl-C to the leading process, and ends with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def watch() -> None:
        with contextlib.suppress(EOFError, OSError):
            leash.recv()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _mpi_size() -> int:
    from mpi4py import MPI

    return int(MPI.COMM_WORLD.Get_size())


def _mpi() -> Place:
    futures = checks.needed("mpi4py.futures", "Running under MPI", "'carom[mpi]', and an MPI library")
    size = _mpi_size()
    if size < 2 or "mpi4py.futures" not in sys.modules:
        raise InputError(
            "Under MPI one process leads and the others work, and here is only one: start with "
            "mpiexec -n 3 python -m mpi4py.futures -m carom eos ..."
        )
    pool = futures.MPIPoolExecutor()
    end = lambda now: pool.shutdown(wait=not now, cancel_futures=now)  # noqa: E731
    return Place(f"MPI, {counted(size - 1, 'worker')}", pool.submit, end)


def _dask(address: str) -> Place:
    distributed = checks.needed("distributed", "A Dask scheduler", "'carom[dask]'")
    try:
        client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"No Dask scheduler answers at {address} ({type(error).__name__}); "
            "start one with `dask scheduler`."
        ) from error
    return Place("Dask", client.get_executor(pure=False).submit, lambda now: client.close())


def run(
    function: Callable[[Any], Any],
    values: Sequence[Any],
    place: Place,
    *,
    done: Callable[[Any, Any], object],
    failed: Callable[[Any, str], object],
    stop: Callable[[], bool],
    enough: Callable[[], bool] = lambda: False,
) -> bool:
    """Run tasks in the given order; return whether all were completed, or the results are enough.

    Parameters
    ----------
    function : callable
        Returns the result of a value.
    values : sequence
        One for each task.
    place : Place
        Where they run.
    done : callable
        Called with each value and its result.
    failed : callable
        Called with the value of a task that failed, and the reason as a clause.
    stop, enough : callable
        Asked from time to time; true ends the tasks, with or without having reached what is wanted.
    """
    guarded = functools.partial(_guarded, function)
    waiting = deque((value, 1) for value in values)
    running: dict[Future[Any], tuple[Any, int]] = {}
    while waiting or running:
        if stop() or enough():
            for future in running:
                future.cancel()
            return not stop()
        while waiting and (place.capacity is None or len(running) < place.capacity):
            value, attempt = waiting.popleft()
            try:
                running[place.submit(guarded, value)] = value, attempt
            except BrokenExecutor as error:  # an Executor of the caller
                failed(value, reason(error))
        ended, _ = wait(running, timeout=GLANCE, return_when=FIRST_COMPLETED)
        for future in ended:
            value, attempt = running.pop(future)
            try:
                result = future.result()
            except Stopped:
                return False
            except Exception as error:
                if _died(error) and place.replaces and attempt < ATTEMPTS:
                    waiting.appendleft((value, attempt + 1))
                else:
                    failed(value, reason(error))
            else:
                done(value, result)
    return True


def _guarded(function: Callable[[Any], Any], value: Any) -> Any:
    """Return the result of a task; whatever it raises, also by ``sys.exit``, ends that task alone."""
    try:
        return function(value)
    except (Stopped, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise Failed(reason(error)) from error


def _died(error: BaseException) -> bool:
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "ProcessExpired"


def reason(error: BaseException) -> str:
    """Return an error of a task as a clause for a sentence."""
    if _died(error):
        return "its worker was killed, or ran out of memory"
    text = (str(error).strip() or "no message").splitlines()[0].rstrip(".")
    return text if isinstance(error, CaromError | Failed) else f"{type(error).__name__}: {text}"
