"""Observables with their error bars: the method :meth:`carom.Simulation.measure`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from carom import checks
from carom.block import Block
from carom.errors import InputError
from carom.notebook import watchable
from carom.observables.analysis.precision import Goal, Prediction
from carom.observables.flights import FreeFlights
from carom.observables.of_frames import OfFrames
from carom.observables.protocol import SEEN, Underway, sees
from carom.observables.volume import Volume
from carom.simulation import own_observers
from carom.simulation.measuring import flying, stretches
from carom.simulation.measuring.equilibration import StructuralRelaxation
from carom.simulation.measuring.equipartition import Thermometer
from carom.simulation.measuring.stretches import Blocks, cools
from carom.simulation.measuring.until_precise import tell_doubts, until

if TYPE_CHECKING:
    from carom.simulation.simulation import Simulation

BLOCKS = 256  # blocks where ``measure`` is not told how many


@watchable("Measuring")
def measure(
    sim: Simulation,
    *observables: Any,
    collisions: int | None = None,
    collisions_per_particle: float | None = None,
    time: float | None = None,
    relative_error: float | None = None,
    blocks: int = BLOCKS,
    walltime: float | None = None,
    progress: Callable[[float], object] | None = None,
    predicted: Callable[[Prediction], object] | None = None,
) -> Any:
    """Continue the run and measure :class:`~carom.Pressure`, or other observables, in one pass.

    The stretch is cut into blocks of equal *time*, whose scatter gives the error bars. Observables of frames
    see one at the start and one at the end of each block. Blocks that end with a collision would bias the
    mean. A number of collisions is converted to a time by the rate
    seen so far, or by a short pilot. Where contacts lose energy, the time between collisions grows. A block
    then lasts as long as its collisions take at the temperature at its beginning, unless ``time`` is given.
    ``PressureResult.note`` says what is measured where kT or diameters change.

    Parameters
    ----------
    *observables : Pressure, Energy, RDF, ..., or objects of your own class
        What is measured; each of Carom's begins anew. Your own class has ``add(frame)`` or ``add(block)``,
        and ``result()`` unless ``add`` returns numbers (:class:`carom.observables.Observable`). It may be an
        observer of events (``docs/models``), which sees those of this stretch, and may have ``add`` as well.
    collisions, collisions_per_particle, time : float, optional
        How long, as in :meth:`carom.Simulation.run`.
    relative_error : float, optional
        Alternatively, run until one standard error is at most this fraction of the mean (of Z, for the
        pressure), confirmed by at least 64 independent blocks.
    blocks : int
        Number of blocks; with ``relative_error`` the least number in the end.
    walltime : float, optional
        Wall time, without that of compiling, after which the run ends even if the error is not reached [s].
    progress : callable or True, optional
        Called with the fraction done (with ``relative_error``, of the expected length); True shows a bar.
    predicted : callable, optional
        Called with a :class:`carom.observables.Prediction` after a pilot of 64 collisions per particle
        and again whenever the error bar is computed.

    Returns
    -------
    The observable's result, with error bars; of several observables a tuple of these. For your own
    class: what its ``result()`` returns, or the means of what its ``add`` returned, with error bars. An
    observer of events without either is returned itself, with what it has added up.

    Raises
    ------
    InputError
        If not exactly one length is given, or nothing collides. If the scene has no such pressure.

    Warns
    -----
    CaromWarning
        If ``walltime`` came first. If the measured quantity drifts, or changes so slowly that there are
        fewer than 8 independent samples. If the stretch is too short near freezing, where the particles
        hardly leave their neighborhoods. If species of different masses have different temperatures, or
        exchange energy too slowly for the stretch. One of a thousand runs in equilibrium is flagged as
        drifting, too (``carom.observables.analysis.equilibrium``).
    """
    if not observables:
        raise InputError("measure() needs an observable, such as carom.Pressure(); found none.")
    for each in observables:
        _check_observable(each)
        _check_box(sim, each)
    observables = tuple(each.fresh() if isinstance(each, OfFrames) else each for each in observables)
    for each in observables:  # before a run that would be in vain
        if callable(getattr(each, "begin", None)):
            each.begin(sim.scene)
        if isinstance(each, FreeFlights):
            flying.check(sim._state)
        elif hasattr(each, "sums") and sim._state.system.rates is not None:
            raise InputError(
                f"{type(each).__name__} needs diameters that do not grow; measure carom.Pressure()."
            )
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
    checks.integer(blocks, "blocks", low=2)
    if relative_error is not None:
        return _until_precise(sim, observables, relative_error, blocks, walltime, progress, predicted)
    if walltime is not None or predicted is not None:
        raise InputError("walltime and predicted go with relative_error, which is missing.")
    if collisions_per_particle is not None:
        collisions = checks.collisions_of(collisions_per_particle, sim.scene.n)
    if time is None and not cools(sim):
        assert collisions is not None
        time = stretches.time_for(sim, collisions)  # it may run a pilot, which nothing is measured of
    if any(isinstance(each, FreeFlights) for each in observables):
        stretches.time_for(sim, 1)  # likewise
    with ExitStack() as stack:
        underway = [Underway(_begun(sim, x, stack)) for x in observables]
        of_frames, of_blocks = ([x for x in underway if x.sees == what] for what in SEEN)
        for x in of_frames:
            x.add(sim.frame())
        count = blocks if of_frames or of_blocks or progress is not None else 1
        for k, block in enumerate(_blocks(sim, count, time, collisions), start=1):
            frame = sim.frame() if of_frames else None
            for x in underway:
                if x.sees:
                    x.add(frame if x.sees == "frame" else block)
            if progress is not None:
                progress(k / count)
        results = tuple(x.result() for x in underway)
    return results[0] if len(results) == 1 else results


def _until_precise(
    sim: Simulation,
    observables: tuple[Any, ...],
    relative_error: float,
    blocks: int,
    walltime: float | None,
    progress: Callable[[float], object] | None,
    predicted: Callable[[Prediction], object] | None,
) -> Any:
    """Run until the error bar of the one observable is small enough."""
    if len(observables) > 1:
        raise InputError("relative_error goes with one observable; name a length to measure several.")
    (observable,) = observables
    if not hasattr(observable, "of_scene"):
        raise InputError(
            f"relative_error needs an estimate on the way, which {type(observable).__name__} does not give; "
            "name a length instead."
        )
    seconds = math.inf if walltime is None else checks.number(walltime, "walltime", low=0.0, open_low=True)
    return until(
        sim, observable, Goal(relative_error), blocks=blocks, walltime=seconds, progress=progress,
        predicted=predicted,
    )  # fmt: skip


class _Whole:
    """An observable that is estimated from all blocks at the end, with what casts doubt on them."""

    def __init__(self, sim: Simulation, observable: Any):
        self._sim, self._observable = sim, observable
        self._blocks: list[Block] = []
        self._thermometer = Thermometer(sim._state)
        self._relaxation = StructuralRelaxation(sim._state)

    def add(self, block: Block) -> None:
        """Add a block."""
        self._blocks.append(block)
        self._thermometer.look()

    def result(self) -> Any:
        """Return the estimate."""
        found = stretches.estimate(self._sim, self._observable, self._blocks)
        tell_doubts(found, self._thermometer, self._relaxation)
        return found


def _begun(sim: Simulation, observable: Any, stack: ExitStack) -> Any:
    """Return what is measured of one observable; observers of events are let in until the stack ends."""
    if own_observers.is_observer(observable):
        return stack.enter_context(own_observers.observing(sim._state, observable))
    if isinstance(observable, FreeFlights):
        stack.enter_context(flying.keeping(sim._state))
        return flying.Flying(sim)
    if hasattr(observable, "sums"):
        sums = observable.sums(sim.scene, sim.frame())
        if sums.observer is not None:
            sums.observer = stack.enter_context(own_observers.observing(sim._state, sums.observer))
        return sums
    return _Whole(sim, observable) if hasattr(observable, "of_scene") else observable


def _check_observable(observable: Any) -> None:
    """Raise InputError for what cannot be measured."""
    if own_observers.is_observer(observable):
        return
    adds, whole = callable(getattr(observable, "add", None)), _of_the_run(observable)
    if isinstance(observable, type) or not (adds or whole):
        found = f"the class {observable.__name__}" if isinstance(observable, type) else None
        raise InputError(
            "measure() needs an observable, such as carom.Pressure() or carom.WallPressure(), or an object "
            "of your own with add(frame) or add(block), and perhaps result(); found "
            f"{found or checks.describe(observable)}."
        )
    if isinstance(getattr(observable, "blocks", None), int):
        raise InputError(
            f"{type(observable).__name__} has blocks; their number is an argument of measure(..., blocks=)."
        )
    if not whole:
        sees(observable)


def _of_the_run(observable: Any) -> bool:
    """Tell whether an observable of Carom's needs more of a run than frames and blocks."""
    return isinstance(observable, FreeFlights) or any(hasattr(observable, x) for x in ("of_scene", "sums"))


def _check_box(sim: Simulation, observable: Any) -> None:
    """Raise InputError for what needs a box that does not change, or that changes."""
    if isinstance(observable, Volume):
        if sim._state.volume_moves is None:
            raise InputError("Volume needs a box that changes: give Simulation a barostat.")
    elif sim._state.volume_moves and (_of_the_run(observable) or own_observers.is_observer(observable)):
        raise InputError(
            f"{type(observable).__name__} needs a box that does not change, and there is a barostat: measure "
            "carom.Volume(), or an observable of your own."
        )


def _blocks(sim: Simulation, count: int, time: float | None, collisions: int | None) -> Iterator[Block]:
    """Run on for a number of blocks, and yield each; while a gas cools, of so many collisions each."""
    if time is not None:
        yield from stretches.blocks(sim, time / count, count)
        return
    assert collisions is not None
    cooling = Blocks(sim, collisions / count)
    for _ in range(count):
        yield cooling.next()
