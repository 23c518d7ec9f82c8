"""Frames at exact times: the method :meth:`carom.Simulation.sample`."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from os import PathLike
from typing import TYPE_CHECKING, Any

from carom import checks
from carom.errors import InputError
from carom.frame import Frame
from carom.notebook import bar
from carom.simulation.run_loop import advance

if TYPE_CHECKING:
    from carom.simulation.simulation import Simulation


def sample(
    sim: Simulation,
    *,
    every: float | None = None,
    count: int | None = None,
    times: Iterable[float] | None = None,
    progress: Callable[[float], object] | bool | None = None,
) -> Iterator[Frame]:
    """Continue the run and yield Frames at exactly the given times; does not affect the trajectory.

    Parameters
    ----------
    every : float
        Time between two frames; the first one is ``every`` after the present.
    count : int, optional
        Number of frames ``every`` so often; by default endless.
    times : iterable of float
        Alternatively, times since the start of the run, in increasing order and none in the past. An iterator
        may be endless; it is advanced one item at a time.
    progress : callable or True, optional
        Called with the fraction of the frames done; True shows a bar.

    Raises
    ------
    InputError
        If neither or both of ``every`` and ``times`` are given, or ``count`` with ``times``, or a time lies
        in the past.
    """
    if isinstance(progress, bool):
        plain = _watched if progress else sample
        return plain(sim, every=every, count=count, times=times)
    if (every is None) == (times is None):
        raise InputError("sample() needs either every= (with count=) or times=.")
    if every is None:
        if count is not None:
            raise InputError("count of sample() goes with every=, and times= is given: leave count out.")
        several = times if isinstance(times, Iterable) else [times]
        if isinstance(several, Iterator):  # of any length, perhaps without end
            return _frames(sim, map(_instant, several), None, progress)
        given = [_instant(time) for time in several]
        return _frames(sim, given, len(given), progress)
    step = Fraction(checks.number(every, "every", low=0.0, open_low=True))
    count = None if count is None else checks.integer(count, "count", low=0)
    return _frames(sim, step, count, progress)


def write(
    sim: Simulation,
    path: str | PathLike[str],
    *,
    every: float | None = None,
    count: int | None = None,
    times: Iterable[float] | None = None,
    overwrite: bool = False,
    progress: Callable[[float], object] | bool | None = None,
) -> int:
    """Continue the run, and write frames at exactly the given times to a file; return how many.

    Parameters
    ----------
    path : path
        ``.h5md``, ``.extxyz`` or ``.gsd``: the suffix says the format.
    every, count, times
        As for :meth:`carom.Simulation.sample`. With ``every`` a ``count`` is needed.
    overwrite : bool
        Replace a file that exists.
    progress
        As for :meth:`carom.Simulation.sample`.

    Raises
    ------
    InputError
        If the times are not given as for :meth:`carom.Simulation.sample`, or would have no end.
    FileError
        If the file exists and is not to be replaced, or cannot be written.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(32, 0.1), seed=1)
    >>> sim.write("fluid.extxyz", every=0.5, count=4)  # doctest: +SKIP
    4
    """
    from carom.io.trajectory import open_writer

    if every is not None and count is None:
        raise InputError("write() needs count= with every=: without one the frames have no end.")
    frames = sample(sim, every=every, count=count, times=times, progress=progress)
    written = 0
    with open_writer(path, "w" if overwrite else "x", sim.scene) as trajectory:
        for frame in frames:
            trajectory.write(frame)
            written += 1
    return written


def _watched(
    sim: Simulation, *, every: float | None, count: int | None, times: Iterable[float] | None
) -> Iterator[Frame]:
    """Yield the frames under a bar."""
    with bar("Sampling") as shown:
        yield from sample(sim, every=every, count=count, times=times, progress=shown)


def _instant(time: Any) -> Fraction:
    """Return a sample's time, checked, as an exact number."""
    return Fraction(checks.number(time, "a sample's time", low=0.0))


def _frames(
    sim: Simulation,
    times: Fraction | Iterable[Fraction],
    count: int | None,
    progress: Callable[[float], object] | None,
) -> Iterator[Frame]:
    """Yield frames at exact times, or at so many multiples of one from the present on."""
    if isinstance(times, Fraction):
        start, step = sim._state.clock.instant, times
        times = (start + k * step for k in (itertools.count(1) if count is None else range(1, count + 1)))
    for k, instant in enumerate(times, start=1):
        present = sim._state.clock.instant
        if instant < present and float(instant) == float(present):
            instant = present  # the present, as `sim.time` rounds it
        if instant < present:
            raise InputError(
                f"A sample at time {float(instant):g} is asked for at {sim.time:g}; times must not decrease."
            )
        advance(sim._state, None, instant)
        if progress is not None and count:
            progress(k / count)
        yield sim.frame()
