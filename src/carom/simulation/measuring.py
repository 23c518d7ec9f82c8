"""Observables with their error bars: the method :meth:`carom.Simulation.measure`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from carom import checks
from carom.block import Block
from carom.errors import InputError
from carom.notebook import watchable
from carom.observables.precision import Goal, Prediction
from carom.observables.protocol import outcome, sees
from carom.simulation import own_observers
from carom.simulation.cooling import Blocks, cools
from carom.simulation.equipartition import Thermometer
from carom.simulation.relaxation import StructuralRelaxation
from carom.simulation.until_precise import tell_doubts, until

if TYPE_CHECKING:
    from carom.simulation.running import Running

BLOCKS = 256
"""Blocks for an observable of one's own that does not say how many."""


@watchable("Measuring")
def measure(
    sim: Running,
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
    """Continue the run and measure :class:`~carom.observables.Pressure`, or another observable.

    The stretch is cut into ``observable.blocks`` blocks of equal *time*, for every kind of limit: blocks that
    end with a collision would bias the mean. A number of collisions is converted to a time by the rate seen
    so far, or by a short pilot. Where contacts lose energy, the time between collisions grows. A block then
    lasts as long as its collisions take at the temperature at its beginning, unless ``time`` is given.
    ``PressureEstimate.note`` says what is measured where kT or diameters change.

    Parameters
    ----------
    observable : Pressure, WallPressure, or an object of your own class
        What is measured. Your own class has ``update(frame)`` or ``update(block)``, and ``result()`` unless
        ``update`` returns numbers (:class:`carom.observables.Observable`). Or it is an observer of events
        (``docs/models``), which sees those of this stretch.
    collisions, collisions_per_particle, time : float, optional
        How long, as in :meth:`carom.Simulation.run`.
    relative_error : float, optional
        Alternatively, run until one standard error is at most this fraction of the mean (of Z, for the
        pressure), confirmed by at least 64 independent blocks.
    max_walltime : float, optional
        Wall time, without that of compiling, after which the run ends even if the error is not reached [s].
    progress : callable or True, optional
        Called with the fraction done (with ``relative_error``, of the expected length); True shows a bar.
    predicted : callable, optional
        Called with a :class:`carom.observables.Prediction` after a pilot of 64 collisions per particle
        and again whenever the error bar is computed.

    Returns
    -------
    The observable's estimate, with its error bar. For your own class: what its ``result()`` returns, or the
    means of what its ``update`` returned, with error bars. For an observer of events: what its ``result()``
    returns, or the observer with what it has added up.

    Raises
    ------
    InputError
        If not exactly one length is given, or nothing collides. If the scene has no such pressure.

    Warns
    -----
    CaromWarning
        If ``max_walltime`` came first. If the measured quantity drifts, or changes so slowly that there are
        fewer than 8 independent samples. If the stretch is too short near freezing, where the particles
        hardly leave their neighbourhoods. If species of different masses have different temperatures, or
        exchange energy too slowly for the stretch. One of a thousand runs in equilibrium is flagged as
        drifting, too (``carom.observables.equilibrium``).
    """
    _check_observable(observable)
    if callable(getattr(observable, "prepare", None)):
        observable.prepare(sim.scene)  # before a run that would be in vain
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
    observes = own_observers.is_observer(observable)
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
    if observes:
        return _observe(sim, observable, time, collisions, progress)
    if own:
        return _follow(sim, observable, time, collisions, progress)
    blocks = []
    thermometer, relaxation = Thermometer(sim.machine), StructuralRelaxation(sim.machine)
    for block in _blocks(sim, observable.blocks, time, collisions):
        blocks.append(block)
        thermometer.look()
        if progress is not None:
            progress(len(blocks) / observable.blocks)
    result = sim.estimate(observable, blocks)
    tell_doubts(result, thermometer, relaxation)
    return result


def _check_observable(observable: Any) -> None:
    """Raise InputError for what cannot be measured."""
    if own_observers.is_observer(observable):
        return
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
    sim: Running,
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


def _observe(
    sim: Running,
    observer: Any,
    time: float | None,
    collisions: int | None,
    progress: Callable[[float], object] | None,
) -> Any:
    """Run on, and let an observer of one's own see every event."""
    if time is None and not cools(sim):
        assert collisions is not None
        time = sim.time_for(collisions)  # it may run a pilot, of which nothing is observed
    count = BLOCKS if progress is not None else 1
    with own_observers.observing(sim.machine, observer) as mine:
        for k, _ in enumerate(_blocks(sim, count, time, collisions), start=1):
            if progress is not None:
                progress(k / count)
    return mine.result() if callable(getattr(mine, "result", None)) else mine


def _blocks(sim: Running, count: int, time: float | None, collisions: int | None) -> Iterator[Block]:
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
