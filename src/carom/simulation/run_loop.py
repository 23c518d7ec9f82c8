"""The loop of a run: the compiled cycle, some 10 ms at a time, with all checks between two calls."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from carom.block import Block, weighted_sum
from carom.compiling import entry
from carom.errors import InputError, warn
from carom.scene.velocities import peculiar
from carom.simulation.call_budget import CYCLES, MOST_CYCLES
from carom.simulation.measuring.mechanics import sizes, sums
from carom.simulation.measuring.stall_detector import StallDetector
from carom.simulation.moves.barostat import move_volume
from carom.simulation.moves.oscillation import change_rate
from carom.simulation.moves.swaps import sweep

if TYPE_CHECKING:
    from carom.simulation.callbacks import Callbacks
    from carom.simulation.run_state import RunState

MOST_FREE_TIMES = 1000.0
"""Mean free times without any collision after which a run towards a number of collisions gives up."""

END, GROWTH, CALL = "end", "growth", "call"
"""Why the engine has to return at a time: the run ends, neighbors are chosen anew, something is called; or
one of ``MOVES``.
"""

MOVES = {"sweeps": sweep, "volume_moves": move_volume, "oscillation": change_rate}
"""What happens between events when the state of that name in ``RunState`` is due."""

INTERVALS = {"sweeps": "Swaps.interval", "volume_moves": "Barostat.interval", "oscillation": "Shear.period"}
"""What says how often that is."""

HASTE = 1e6
"""Moves in a flight through the box from which on a run hardly gets on: each takes a millisecond at least."""

UNLIMITED = 2**62
"""As a number of collisions or an epoch: never reached."""


def advance(
    run_state: RunState,
    collisions: int | None,
    end: Fraction | None,
    walltime: float | None = None,
    progress: Callable[[float], object] | None = None,
    callbacks: Callbacks | None = None,
) -> Block:
    """Continue for a number of collisions, to an instant, or for seconds: see :meth:`carom.Simulation.run`.

    A :class:`carom.CaromWarning` is issued if the requested collisions cannot happen.
    """
    with run_state.alone.changing():
        run_state.refuse_inherited()
        if not run_state.scheduled:
            run_state.schedule()
        try:
            block = _advance(run_state, collisions, end, walltime, progress, callbacks)
        except BaseException:  # Ctrl-C, too
            if not run_state.answered:
                run_state.break_off()
            raise
        run_state.depths.keep(run_state)
        return block


def _advance(
    run_state: RunState,
    collisions: int | None,
    end: Fraction | None,
    walltime: float | None,
    progress: Callable[[float], object] | None,
    callbacks: Callbacks | None,
) -> Block:
    from carom.engine import constants, cycle

    before, diameters, start = sums(run_state), run_state.diameters, run_state.clock.instant
    target = np.int64(UNLIMITED if collisions is None else min(before.collisions + collisions, UNLIMITED))
    deadline = math.inf if walltime is None else entry.running() + walltime
    last_seen, last_instant = before.collisions, start
    only_end = end if walltime is None and collisions is None else None
    stall_detector = None
    most_free_times = None if collisions is not None and end is None else math.inf
    alone = callbacks is not None and callbacks.needs_events
    left = most = CYCLES
    while True:
        instant, why = _next_stop(run_state, end, callbacks)
        stop = _split(run_state, instant)
        engine = run_state.engine if callbacks is None else callbacks.watched(run_state.engine)
        cycles, unused = min(run_state.budget.count, left), 0
        _ask_ahead(run_state)
        began, run_state.answered = entry.running(), False
        several = None if alone else run_state.executive
        if several is not None and several.window(stop, int(target)):
            code = constants.SPENT
        else:
            with run_state.budget:
                code, unused = cycle.run(*engine, *stop, target, np.int64(cycles))
        now = entry.running()
        run_state.seconds += now - began
        wrong = run_state.engine.model.pair.error_message()
        if wrong is not None:
            raise InputError(wrong)
        if code == constants.IDLE and (end is not None or why == GROWTH):
            run_state.rest_until(stop)
            code = constants.REACHED_TIME
        if code == constants.REACHED_TIME:
            run_state.clock.epoch, run_state.clock.offset = int(stop[0]), float(stop[1])
            run_state.answered = True
            if why == CALL:
                assert callbacks is not None
                if callbacks.pause() or instant == end:
                    break
            elif why in MOVES:
                MOVES[why](run_state)
            elif why == END:
                break
            else:
                run_state.refit()
        else:
            run_state.catch_up()
        if code in (constants.REACHED_COLLISIONS, constants.REACHED_HIT):
            break
        if code == constants.IDLE:
            if collisions is not None or callbacks is not None:
                _warn("Nothing moves, so nobody will ever collide: the run ended.")
            break
        if code == constants.NEEDS_HEAP:
            run_state.enlarge_heap()
        elif code == constants.NEEDS_NEIGHBORS:
            run_state.enlarge_neighbors()
            run_state.schedule()
        elif code == constants.NEEDS_EVENTS:
            run_state.renew_neighbors()
        elif code == constants.NEEDS_LOG:
            run_state.flush_log()
        run_state.answered = True
        if progress is not None:
            progress(_fraction(run_state, before.collisions, start, int(target), end))
        if now >= deadline:
            break
        left -= cycles - int(unused)
        called = code == constants.REACHED_TIME and (why == CALL or why in MOVES)
        if (code == constants.SPENT or called) and left > 0:
            continue
        # What follows happens at the same cycles, however long they take.
        left = most = min(2 * most, MOST_CYCLES) if run_state.collisions > last_seen else CYCLES
        if callbacks is not None and callbacks.ends_between_events():
            break
        # Only now: many short runs would spend their time with looking at all velocities, or at the clock.
        if most_free_times is None and run_state.collisions == last_seen:
            most_free_times = _patience(run_state)
            if walltime is None and most_free_times < math.inf:
                stall_detector = StallDetector(run_state, last_instant + Fraction(most_free_times))
        if only_end is not None and stall_detector is None:
            stall_detector = StallDetector(run_state, only_end)
        if stall_detector is not None and (end is not None or run_state.collisions == last_seen):
            stall_detector.look()
        if run_state.collisions > last_seen:
            last_seen, last_instant = run_state.collisions, run_state.clock.instant
        elif most_free_times is not None and run_state.clock.instant - last_instant > most_free_times:
            _warn(
                "One component alone meets nobody: the run ended; ask for time= instead of collisions."
                if run_state.scene.n == 1
                else f"No collision in {MOST_FREE_TIMES:g} mean free times, after {run_state.collisions} in "
                "all: the components seem to miss each other for ever, and the run ended; "
                "ask for time= instead of collisions."
            )
            break
    if progress is not None:
        progress(1.0)
    duration = float(run_state.clock.instant - start)
    block: Block = weighted_sum(sums(run_state), before, 1, -1)
    return block._replace(duration=duration, sizes=sizes(run_state, diameters, duration))


def warn_of_haste(run_state: RunState) -> None:
    """Warn of moves, after each of which all is scheduled anew, that come far too often."""
    scene = run_state.scene
    for kind, name in INTERVALS.items():
        moves = getattr(run_state, kind)
        if moves is not None:
            flown = float(np.std(peculiar(scene, run_state.velocities))) * float(moves.next)
            if 0.0 < flown * HASTE < max(scene.box):
                _warn(
                    f"{name} is so short that all events are predicted anew more than {HASTE:g} times while "
                    "a particle flies through the box: the run will hardly get on. Give a longer one."
                )


def _ask_ahead(run_state: RunState) -> None:
    """Set whether the next call asks for memory ahead of time, where one of the two is not always faster."""
    from carom.engine.neighbors.sectors import PREFETCH_FROM

    if run_state.scheme.kind == "sectors" and run_state.scene.n >= PREFETCH_FROM and not run_state.executive:
        run_state.engine.calendar.control.ahead[0] = run_state.pace.first()


def _next_stop(
    run_state: RunState, end: Fraction | None, callbacks: Callbacks | None
) -> tuple[Fraction | None, str]:
    """Return the instant at which the engine has to return, or None, and why."""
    instant, why = end, END
    if run_state.system.rates is not None:
        refit = run_state.clock.base + run_state.unit.to_scene(Fraction(run_state.scheme.horizon), 1)
        if instant is None or refit < instant:
            instant, why = refit, GROWTH
    upcoming = None if callbacks is None else callbacks.next
    if upcoming is not None and (instant is None or upcoming <= instant):
        instant, why = upcoming, CALL
    for kind in MOVES:
        moves = getattr(run_state, kind)
        if moves is not None and (instant is None or moves.next <= instant):
            instant, why = moves.next, kind
    return instant, why


def _split(run_state: RunState, instant: Fraction | None) -> tuple[np.int64, float]:
    """Return an instant as the engine takes it, an epoch and an offset; None is never reached."""
    if instant is None:
        return np.int64(UNLIMITED), 0.0
    epoch, offset = run_state.clock.split(instant)
    return np.int64(epoch), float(offset)


def _fraction(run_state: RunState, before: int, start: Fraction, target: int, end: Fraction | None) -> float:
    """Return the part that is done: of the collisions or of the time, whichever is more."""
    done = [0.0]
    if before < target < UNLIMITED:
        done.append((run_state.collisions - before) / (target - before))
    if end is not None:
        span = end - start
        done.append(float((run_state.clock.instant - start) / span) if span else 1.0)
    return min(max(done), 1.0)


def _patience(run_state: RunState) -> float:
    """Return the time without a collision after which none is to be expected [time]."""
    growing = run_state.system.rates is not None and run_state.scene.n > 1
    return math.inf if growing else run_state.unit.to_scene(_longest_wait(run_state), 1)


def _longest_wait(run_state: RunState) -> float:
    """Return the same in the engine's unit, for diameters that do not grow."""
    from carom.engine.neighbors.plan import collision_rate

    scene, epoch = run_state.scene, run_state.scheme.epoch
    if scene.n == 1:  # there is nobody to meet
        return epoch
    fastest = float(np.abs(run_state.speeds).max())
    v = peculiar(scene, run_state.speeds)  # a common drift meets nobody
    speed = math.sqrt(float(np.sum(scene.masses[:, None] * v * v)) / (scene.mass * scene.n))
    if speed <= 8.0 * np.finfo(float).eps * fastest:
        return epoch
    if run_state.system.threshold > 0.0:  # they cool until contacts are slower than this, hence elastic
        speed = min(speed, run_state.system.threshold)
    rate = collision_rate(scene.packing_fraction, scene.dimension, scene.diameter, speed)
    return MOST_FREE_TIMES / rate + epoch if rate > 0.0 else epoch


def _warn(text: str) -> None:
    warn(text)
