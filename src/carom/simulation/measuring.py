"""Observables with their error bars: the method :meth:`carom.Simulation.measure`."""

from __future__ import annotations

import math
import time as clock
import warnings
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from carom import checks
from carom.block import Block, Sizes
from carom.errors import CaromWarning, InputError
from carom.notebook import watchable
from carom.observables.equilibrium import doubts_about
from carom.observables.precision import FLOOR, Goal, Prediction, block_collisions
from carom.observables.protocol import outcome, sees
from carom.simulation.cooling import Blocks, cools
from carom.simulation.equipartition import Thermometer

if TYPE_CHECKING:
    from carom.simulation.simulation import Simulation

BLOCKS = 256
"""Blocks for an observable of one's own that does not say how many."""


@watchable("Measuring")
def measure(
    sim: Simulation,
    observable: Any,
    *,
    collisions: int | None = None,
    collisions_per_particle: float | None = None,
    time: float | None = None,
    relative_error: float | None = None,
    max_walltime: float | None = None,
    progress: Callable[[float], object] | None = None,
    predicted: Callable[[Prediction], object] | None = None,
):
    """Run on and measure :class:`~carom.observables.Pressure`, or an observable of one's own with ``update``.

    The stretch is cut into ``observable.blocks`` blocks of equal *time*, whatever the limit is given in:
    blocks that end with a collision would bias the mean. A number of collisions is turned into a time by
    the rate seen so far, or in a short pilot. Where contacts lose energy, so that the time between collisions
    grows, a block is as long as so many collisions take at the temperature of its beginning, unless ``time``
    is given. What is measured where kT or diameters change, ``PressureEstimate.note``
    says in a sentence.

    Parameters
    ----------
    observable : Pressure, WallPressure, or a class of one's own
        What is measured. One's own has ``update(frame)`` or ``update(block)``, and ``result()`` unless
        ``update`` returns numbers (:class:`carom.observables.Observable`).
    collisions, collisions_per_particle, time : float, optional
        How long, as in :meth:`carom.Simulation.run`.
    relative_error : float, optional
        Instead of these: until one standard error is at most this part of the mean (of Z, for the
        pressure), and at least 64 independent blocks say so.
    max_walltime : float, optional
        Seconds after which that is given up.
    progress : callable or True, optional
        Called with the fraction done; True shows a bar; with ``relative_error``, of what is expected so far.
    predicted : callable, optional
        Called with a :class:`carom.observables.Prediction` after a pilot of 64 collisions per particle
        and again whenever the error bar was looked at.

    Returns
    -------
    The observable's estimate, with its error bar; of one's own what its ``result()`` returns, or means with
    error bars of what its ``update`` returned.

    Raises
    ------
    InputError
        If not exactly one length is given, or nobody collides.

    Warns
    -----
    CaromWarning
        If ``max_walltime`` came first; if what is measured drifts, or changes so slowly that there are less
        than 8 independent samples; if species of different masses have different temperatures. One of a
        thousand runs in equilibrium is called drifting all the same (``carom.observables.equilibrium``).
    """
    _check_observable(observable)
    given = {
        "collisions": collisions,
        "collisions_per_particle": collisions_per_particle,
        "time": time,
        "relative_error": relative_error,
    }
    if sum(value is not None for value in given.values()) != 1:
        raise InputError(f"measure() needs exactly one of {', '.join(given)}.")
    for name in ("collisions", "collisions_per_particle", "time"):
        if given[name] is not None:
            checks.number(given[name], name, low=0.0)
    own = not hasattr(observable, "of_scene")
    if own and relative_error is not None:
        raise InputError(
            f"relative_error needs an estimate on the way, which {type(observable).__name__} does not give; "
            "name a length instead."
        )
    if relative_error is not None:
        seconds = (
            math.inf
            if max_walltime is None
            else checks.number(max_walltime, "max_walltime", low=0.0, open_low=True)
        )
        return until(
            sim,
            observable,
            Goal(relative_error),
            max_walltime=seconds,
            progress=progress,
            predicted=predicted,
        )
    if max_walltime is not None or predicted is not None:
        raise InputError("max_walltime and predicted go with relative_error, which is missing.")
    if collisions_per_particle is not None:
        collisions = checks.collisions_of(collisions_per_particle, sim.scene.n)
    if own:
        return _follow(sim, observable, time, collisions, progress)
    blocks = []
    thermometer = Thermometer(sim.machine)
    for block in _blocks(sim, observable.blocks, time, collisions):
        blocks.append(block)
        thermometer.look()
        if progress is not None:
            progress(len(blocks) / observable.blocks)
    result = sim.estimate(observable, blocks)
    _tell(result, thermometer)
    return result


def _check_observable(observable: Any) -> None:
    """Raise InputError for what cannot be measured."""
    updated = callable(getattr(observable, "update", None))
    whole = callable(getattr(observable, "of_scene", None)) and hasattr(observable, "blocks")
    if isinstance(observable, type) or not (updated or whole):
        found = f"the class {observable.__name__}" if isinstance(observable, type) else None
        raise InputError(
            "measure() needs an observable, such as carom.Pressure() or carom.WallPressure(), or an object "
            "of your own with update(frame) or update(block), and result(); found "
            f"{found or checks.describe(observable)}."
        )
    checks.integer(getattr(observable, "blocks", BLOCKS), "the observable's blocks", low=1)
    if not whole:
        sees(observable)


def _follow(
    sim: Simulation,
    observable: Any,
    time: float | None,
    collisions: int | None,
    progress: Callable[[float], object] | None,
) -> Any:
    """Run on, and hand every stretch, or every frame between two of them, to an observable of one's own."""
    count = getattr(observable, "blocks", BLOCKS)
    of_frames = sees(observable) == "frame"
    if time is None and not cools(sim):
        assert collisions is not None
        time = sim.time_for(collisions)  # it may run a pilot, so that the first frame comes after it
    values = [observable.update(sim.frame())] if of_frames else []
    for k, block in enumerate(_blocks(sim, count, time, collisions), start=1):
        values.append(observable.update(sim.frame() if of_frames else block))
        if progress is not None:
            progress(k / count)
    return outcome(observable, values)


def _blocks(sim: Simulation, count: int, time: float | None, collisions: int | None) -> Iterator[Block]:
    """Run on for a number of blocks, and yield each."""
    if time is not None:
        yield from sim.blocks(time / count, count)
        return
    assert collisions is not None
    if cools(sim):
        cooling = Blocks(sim, collisions / count)
        for _ in range(count):
            yield cooling.next()
    else:
        yield from sim.blocks(sim.time_for(collisions) / count, count)


def until(
    sim: Simulation,
    observable: Any,
    goal: Goal,
    *,
    max_walltime: float = math.inf,
    progress: Callable[[float], object] | None = None,
    predicted: Callable[[Prediction], object] | None = None,
) -> Any:
    """Run on until the observable's error bar reaches the goal, and return the estimate.

    Notes
    -----
    The error is looked at after a pilot of 64 blocks and then where the last look predicted the end, the
    stretch never more than four times as long as at the look before. When there are twice
    ``observable.blocks`` blocks, neighbours are merged. The length depends on what was measured and on
    nothing else, except for ``max_walltime``.
    """
    deadline = clock.perf_counter() + max_walltime
    source = Blocks(sim, block_collisions(sim.scene.n))
    capacity = 2 * max(int(observable.blocks), 2 * FLOOR)
    blocks: list[Block] = []
    look = FLOOR  # in blocks of the first kind
    size = 1  # of a block, in blocks of the first kind
    expected = math.inf
    rate = _Rate(sim)
    thermometer = Thermometer(sim.machine)
    while True:
        while size * len(blocks) < look and (len(blocks) < 2 or clock.perf_counter() < deadline):
            blocks.append(source.next(size))
            rate.tick()
            thermometer.look()
            if len(blocks) == capacity:
                blocks = [merged(*pair) for pair in zip(blocks[::2], blocks[1::2], strict=True)]
                size *= 2
            if progress is not None:
                late = (
                    1.0 - (deadline - clock.perf_counter()) / max_walltime if max_walltime < math.inf else 0.0
                )
                progress(min(max(size * len(blocks) / expected, late), 1.0))
        enough = size * len(blocks) >= look
        with warnings.catch_warnings():
            if enough:  # a run that goes on need not be told that it was short so far
                warnings.simplefilter("ignore", CaromWarning)
            result = sim.estimate(observable, blocks)
        found = result.primary
        if goal.reached(found):
            break
        if not enough:
            warnings.warn(
                f"max_walltime = {max_walltime:g} s ended the measurement at a relative error of "
                f"{found.relative_error:.2g}; {goal.relative_error:g} was asked for.",
                CaromWarning,
                stacklevel=3,
            )
            break
        length = size * len(blocks)
        expected = length * goal.remaining(found)
        if predicted is not None:
            more = (expected / length - 1.0) * sum(block.collisions for block in blocks)
            predicted(Prediction(found.relative_error, more, more / rate.collisions_per_second))
        look = goal.next_look(length, found)
        rate.pause()
    if progress is not None:
        progress(1.0)
    _tell(result, thermometer)
    return result


def _tell(result: Any, thermometer: Thermometer) -> None:
    """Warn of what speaks against a result."""
    for sentence in (*doubts_about(result), *thermometer.doubts()):
        warnings.warn(sentence, CaromWarning, stacklevel=3)


class _Rate:
    """Collisions per second of wall time, the first block left out: it may have waited for the compiler."""

    def __init__(self, sim: Simulation):
        self._sim = sim
        self._collisions, self._seconds = 0, 0.0
        self._last: tuple[int, float] | None = None

    def tick(self) -> None:
        """Count what came since the last tick."""
        now = self._sim.collisions, clock.perf_counter()
        if self._last is not None:
            self._collisions += now[0] - self._last[0]
            self._seconds += now[1] - self._last[1]
        self._last = now

    def pause(self) -> None:
        """Leave out the time from the last tick until now."""
        if self._last is not None:
            self._last = self._last[0], clock.perf_counter()

    @property
    def collisions_per_second(self) -> float:
        """Seen so far; infinite before anything was."""
        return self._collisions / self._seconds if self._seconds else math.inf


def merged(one: Block, other: Block) -> Block:
    """Return two neighbouring blocks as one."""
    return Block(
        one.duration + other.duration,
        one.collisions + other.collisions,
        one.virial + other.virial,
        tuple(a + b for a, b in zip(one.impulses, other.impulses, strict=True)),
        tuple(a + b for a, b in zip(one.momentum_changes, other.momentum_changes, strict=True)),
        None if one.kT_time is None or other.kT_time is None else one.kT_time + other.kT_time,
        _averaged(one, other),
    )


def _averaged(one: Block, other: Block) -> Sizes | None:
    """Return the average sizes of two blocks, where diameters grow."""
    a, b = one.sizes, other.sizes
    if a is None or b is None:
        return None
    part = one.duration / (one.duration + other.duration)
    return Sizes(
        part * a.packing_fraction + (1.0 - part) * b.packing_fraction,
        part * a.cube + (1.0 - part) * b.cube,
        a.equal and b.equal,
    )
