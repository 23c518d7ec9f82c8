"""Where the tasks of a study run: in turn, in threads, in processes, or on any Executor.

All engines take plain functions and plain values and return futures. A study does not depend on where it
runs, and the same tasks give the same bits everywhere.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import types
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any, TypeVar

from carom import checks
from carom.compiling import compile_listeners
from carom.errors import CaromError, InputError
from carom.simulation.workers.thread_pool import cores

ENGINES = ("processes", "threads", "serial", "mpi")

ATTEMPTS = 3
"""Number of workers that may die in a task before it counts as failed. A task that needs too much memory
kills every worker."""

GLANCE = 0.1
"""Seconds between two checks for Ctrl-C."""

PATIENCE = 10.0
"""Seconds to wait for the answer of a scheduler."""

T = TypeVar("T")
R = TypeVar("R")


class Stopped(Exception):
    """A task ended because it was told to stop."""


class Engine:
    """Runs functions of one value, and says where.

    Attributes
    ----------
    name : str
        Name, for the provenance.
    capacity : int or None
        Number of tasks that it takes at a time; None without limit.
    local : bool
        Whether functions run in this process. They must then check themselves whether to stop.
    """

    name = ""
    capacity: int | None = None
    local = False

    def submit(self, function: Callable[[T], R], value: T) -> Future[R]:
        """Start the task ``function(value)``."""
        raise NotImplementedError

    def recovered(self, future: Future[Any]) -> bool:
        """Return whether the engine can continue after the worker of a ``future`` failed."""
        return False

    def listen(self) -> None:
        """Pass on messages of workers; called from time to time."""

    def close(self, now: bool) -> None:
        """End the workers; `now` does not wait for the tasks under way."""


class Serial(Engine):
    """One task after the other, in the present process."""

    name, capacity, local = "serial", 1, True

    def submit(self, function: Callable[[T], R], value: T) -> Future[R]:
        """Run the task ``function(value)`` to its end."""
        future: Future[R] = Future()
        try:
            future.set_result(function(value))
        except Exception as error:
            future.set_exception(error)
        return future


class Pool(Engine):
    """An ``executor`` of the caller, which stays open, with a ``name`` for the provenance."""

    def __init__(self, executor: Executor, name: str | None = None):
        self.executor = executor
        self.name = name or type(executor).__name__

    def submit(self, function: Callable[[T], R], value: T) -> Future[R]:
        """Hand the task ``function(value)`` to the executor."""
        return self.executor.submit(function, value)


class OwnPool(Pool):
    """An ``executor`` that ends with the study, with a ``name`` for the provenance."""

    def __init__(self, executor: Executor, name: str):
        super().__init__(executor, name)
        self.local = isinstance(executor, ThreadPoolExecutor)

    def close(self, now: bool) -> None:
        """Shut the executor down, ``now`` or after its tasks."""
        self.executor.shutdown(wait=not now, cancel_futures=now)


class Processes(Engine):
    """Worker processes, each in a pool of its own: one that is killed costs its own task only.

    Parameters
    ----------
    workers : int
        Number of processes.

    Notes
    -----
    Workers are started by spawning, on every system. They do not import the caller's main module, so that
    scripts need no ``if __name__ == "__main__"``. They leave Ctrl-C to the leading process, and end whenever
    it ends. When they compile, they send it a message (``carom.compiling.compile_listeners``).
    """

    def __init__(self, workers: int):
        self.capacity = workers
        self.name = f"{workers} process{'es' * (workers > 1)}"
        self._leash, self._lead = multiprocessing.Pipe(duplex=False)
        self._news, self._mouth = multiprocessing.Pipe(duplex=False)
        self._idle: list[ProcessPoolExecutor] = []
        self._busy: dict[Future[Any], ProcessPoolExecutor] = {}

    def submit(self, function: Callable[[T], R], value: T) -> Future[R]:
        """Hand the task ``function(value)`` to a free worker."""
        for done in [future for future in self._busy if future.done()]:
            self._idle.append(self._busy.pop(done))
        pool = self._idle.pop() if self._idle else self._pool()
        try:
            future = pool.submit(function, value)
        except BrokenExecutor:  # the worker was killed while it was idle
            pool.shutdown(wait=False)
            pool = self._pool()
            future = pool.submit(function, value)
        self._busy[future] = pool
        return future

    def recovered(self, future: Future[Any]) -> bool:
        """Discard the pool whose worker failed with a ``future``; the next task gets a new pool."""
        pool = self._busy.pop(future, None)
        if pool is not None:
            pool.shutdown(wait=False)
        return True

    def listen(self) -> None:
        """Report in this process that workers compile, if they do."""
        while self._news.poll():
            self._news.recv_bytes()
            compile_listeners.notify()

    def close(self, now: bool) -> None:
        """End all workers, ``now`` or after their tasks."""
        if now:
            self._lead.close()
        for pool in [*self._busy.values(), *self._idle]:
            pool.shutdown(wait=True, cancel_futures=True)
        for end in (self._lead, self._leash, self._news, self._mouth):
            end.close()

    def _pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(
            max_workers=1, mp_context=_Context(), initializer=_begin, initargs=(self._leash, self._mouth)
        )


class _Process(SpawnProcess):
    """A process that starts without the caller's main module."""

    @staticmethod
    def _Popen(process: Any) -> Any:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = types.ModuleType("__main__")
        try:
            return SpawnProcess._Popen(process)
        finally:
            sys.modules["__main__"] = main


class _Context(SpawnContext):
    """Starts workers as :class:`_Process`."""

    Process = _Process


def _begin(leash: Connection, mouth: Connection) -> None:
    """Prepare a worker process.

    It ignores Ctrl-C, and ends when the other end of ``leash`` is closed. Through ``mouth`` it reports once
    that it compiles.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def watch() -> None:
        with contextlib.suppress(EOFError, OSError):
            leash.recv()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    told = False

    def say() -> None:
        nonlocal told
        if not told:
            told = True
            with contextlib.suppress(OSError):  # the study has ended meanwhile
                mouth.send_bytes(b"compiling")

    compile_listeners.listen(say)


@contextlib.contextmanager
def engine(choice: Any = None, workers: int | None = None) -> Iterator[Engine]:
    """Open an engine for the body of a ``with``, and close it; at once if the body raises.

    Parameters
    ----------
    choice : optional
        "processes", "threads", "serial" or "mpi" (inside ``mpiexec ... python -m mpi4py.futures``). Or the
        address of a Dask scheduler, such as "tcp://host:8786", an Executor, a Dask Client, or a number of
        processes. By default MPI if it is running, otherwise one process per core.
    workers : int, optional
        Processes or threads; as many as cores if left out.

    Raises
    ------
    InputError
        If the choice is none of these, or a package that it needs is missing.
    """
    chosen = _choose(choice, workers)
    try:
        yield chosen
    except BaseException:
        chosen.close(now=True)
        raise
    chosen.close(now=False)


def check(choice: Any = None, workers: int | None = None) -> None:
    """Raise InputError if :func:`engine` could not open this choice; nothing is opened.

    Parameters and errors are those of :func:`engine`.
    """
    if workers is not None:
        checks.integer(workers, "workers", low=1)
    if isinstance(choice, int) and not isinstance(choice, bool):
        checks.integer(choice, "executor", low=1)
    elif isinstance(choice, str):
        known = choice in ENGINES or "://" in choice
        if not known:
            raise InputError(f"{_EXPECTED}; found {checks.describe(choice)}.")
    elif choice is not None and not hasattr(choice, "get_executor") and not hasattr(choice, "submit"):
        raise InputError(f"{_EXPECTED}; found {checks.describe(choice)}.")


_EXPECTED = (
    f"executor must be one of {', '.join(ENGINES)}, the address of a Dask scheduler (tcp://host:port), a "
    "number of processes or an Executor"
)


def _choose(choice: Any, workers: int | None) -> Engine:
    check(choice, workers)
    if choice is None:
        choice = "mpi" if "mpi4py.futures" in sys.modules and _mpi_size() > 1 else "processes"
    if isinstance(choice, int):
        return Processes(choice)
    if isinstance(choice, str):
        count = cores() if workers is None else workers
        if choice == "processes":
            return Processes(count)
        if choice == "threads":
            return OwnPool(ThreadPoolExecutor(count), f"{count} thread{'s' * (count > 1)}")
        if choice == "serial":
            return Serial()
        return _mpi() if choice == "mpi" else _dask(choice)
    if hasattr(choice, "get_executor"):
        # By default Dask assumes pure functions and deduplicates equal calls.
        return Pool(choice.get_executor(pure=False), "Dask")
    return Pool(choice)


def _mpi_size() -> int:
    from mpi4py import MPI

    return int(MPI.COMM_WORLD.Get_size())


def _mpi() -> Engine:
    try:
        from mpi4py.futures import MPIPoolExecutor
    except ImportError:
        raise InputError(
            'Running under MPI needs the package mpi4py and an MPI library; pip install "carom[mpi]".'
        ) from None
    size = _mpi_size()
    if size < 2 or "mpi4py.futures" not in sys.modules:
        raise InputError(
            "Under MPI one process leads and the others work, and here is only one: start with "
            "mpiexec -n 3 python -m mpi4py.futures -m carom eos ..."
        )
    return OwnPool(MPIPoolExecutor(), f"MPI, {size - 1} worker{'s' * (size > 2)}")


class _Dask(Pool):
    """The Dask cluster of a ``client``, which is closed at the end."""

    def __init__(self, client: Any):
        super().__init__(client.get_executor(pure=False), "Dask")
        self.client = client

    def close(self, now: bool) -> None:
        """Disconnect from the cluster, which keeps running."""
        self.client.close()


def _dask(address: str) -> Engine:
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            'A Dask scheduler needs the package distributed; pip install "carom[dask]".'
        ) from None
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"No Dask scheduler answers at {address} ({type(error).__name__}); "
            "start one with `dask scheduler`."
        ) from error
    return _Dask(client)


def run(
    function: Callable[[T], R],
    values: Sequence[T],
    where: Engine,
    *,
    done: Callable[[int, R], object],
    failed: Callable[[int, BaseException], object],
    stop: Callable[[], bool] = lambda: False,
) -> bool:
    """Run tasks in the given order, and pass on each result when it arrives.

    Parameters
    ----------
    function : callable
        A function of a module, which workers can import.
    values : sequence
        One value per task, which can be pickled.
    where : Engine
        Where to run the tasks.
    done, failed : callable
        Called in this thread with the index of the task and its result, or its exception.
    stop : callable
        Called from time to time; if it returns true, the function does not wait for more tasks.

    Returns
    -------
    bool
        Whether all tasks were completed.
    """
    waiting = deque((index, 1) for index in range(len(values)))
    running: dict[Future[R], tuple[int, int]] = {}
    while waiting or running:
        if stop():
            for future in running:
                future.cancel()
            return False
        while waiting and (where.capacity is None or len(running) < where.capacity):
            index, attempt = waiting.popleft()
            try:
                running[where.submit(function, values[index])] = index, attempt
            except BrokenExecutor as error:
                failed(index, error)
        ended, _ = wait(running, timeout=GLANCE, return_when=FIRST_COMPLETED)
        where.listen()
        for future in ended:
            index, attempt = running.pop(future)
            try:
                result = future.result()
            except Stopped:
                return False
            except BrokenExecutor as error:
                if where.recovered(future) and attempt < ATTEMPTS:
                    waiting.appendleft((index, attempt + 1))
                else:
                    failed(index, error)
            except Exception as error:
                failed(index, error)
            else:
                done(index, result)
    return True


def reason(error: BaseException) -> str:
    """Return an ``error`` of a task as a clause for a sentence."""
    if isinstance(error, BrokenExecutor):
        return "its worker was killed, or ran out of memory"
    text = (str(error).strip() or "no message").splitlines()[0].rstrip(".")
    return text if isinstance(error, CaromError) else f"{type(error).__name__}: {text}"
