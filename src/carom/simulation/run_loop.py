"""The loop of a run: the compiled cycle, some 10 ms at a time, with all checks between two calls."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from carom.block import Block
from carom.compiling import compile_listeners
from carom.errors import CaromWarning, InputError
from carom.models.questions.memory import error_message
from carom.scene.temperature import peculiar
from carom.simulation.agents import refuse_rule
from carom.simulation.call_budget import CYCLES
from carom.simulation.mechanics import impulses, sizes
from carom.simulation.stall_detector import StallDetector
from carom.simulation.temperature import kT_time

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState

MOST_FREE_TIMES = 1000.0
"""Mean free times without any collision after which a run towards a number of collisions gives up."""

UNLIMITED = 2**62
"""As a number of collisions or an epoch: never reached."""


def advance(
    machine: RunState,
    collisions: int | None,
    end: Fraction | None,
    walltime: float | None = None,
    progress: Callable[[float], object] | None = None,
) -> Block:
    """Continue for a number of collisions, to an instant, or for seconds: see :meth:`carom.Simulation.run`.

    A :class:`carom.CaromWarning` is issued if the requested collisions cannot happen.

    Raises
    ------
    InputError
        If a time that is the only limit is out of reach, because components have no room.
    BusyError
        If the machine is running already, or this process is a fork of the one that writes its event log.
    """
    with machine.alone.changing():
        machine.refuse_inherited()
        if not machine.scheduled:
            machine.schedule()
        block = _advance(machine, collisions, end, walltime, progress)
        machine.depths.keep(machine)
        return block


def _advance(
    machine: RunState,
    collisions: int | None,
    end: Fraction | None,
    walltime: float | None,
    progress: Callable[[float], object] | None,
) -> Block:
    from carom.engine import constants, cycle

    before = machine.engine.tallies[0].copy()
    impulses_before = impulses(machine)
    diameters, heat = machine.diameters, kT_time(machine)
    start = machine.clock.instant
    target = np.int64(
        UNLIMITED if collisions is None else min(int(before.collisions) + collisions, UNLIMITED)
    )
    deadline = math.inf if walltime is None else compile_listeners.running() + walltime
    last_seen, last_instant = int(before.collisions), start
    only_end = end if walltime is None and collisions is None else None
    stall_detector = None
    most_free_times = None if collisions is not None and end is None else math.inf
    left = CYCLES
    while True:
        stop, final = _stop(machine, end)
        log = None if machine.log is None else machine.log.buffer
        cycles, unused = min(machine.budget.count, left), 0
        began = compile_listeners.running()
        if machine.executive is not None and machine.executive.window(stop, int(target)):
            code = constants.SPENT
        else:
            try:
                with machine.budget:
                    code, unused = cycle.run(*machine.engine, log, *stop, target, np.int64(cycles))
            except Exception as error:
                refuse_rule(machine, error)
                raise
        now = compile_listeners.running()
        machine.seconds += now - began
        wrong = error_message(machine.engine.model.pair)
        if wrong is not None:
            raise InputError(wrong)
        clock, record = machine.clock, machine.engine.state.clock[0]
        if code == constants.IDLE and (end is not None or not final):
            machine.rest_until(stop)
            code = constants.REACHED_TIME
        if code == constants.REACHED_TIME:
            clock.epoch, clock.offset = int(stop[0]), float(stop[1])
            if final:
                break
            machine.refit()
        else:
            # Where a run ended at a time, the last event lies behind the present.
            clock.epoch, clock.offset = max(
                (clock.epoch, clock.offset), (int(record.epoch), float(record.now))
            )
        if code == constants.REACHED_COLLISIONS:
            break
        if code == constants.IDLE:
            if collisions is not None:
                _warn("Nothing moves, so nobody will ever collide: the run ended.")
            break
        if code == constants.NEEDS_HEAP:
            machine.enlarge_heap()
        elif code == constants.NEEDS_NEIGHBORS:
            machine.enlarge_neighbors()
            machine.schedule()
        elif code == constants.NEEDS_EVENTS:
            machine.schedule()
        elif code == constants.NEEDS_LOG:
            machine.flush_log()
        if progress is not None:
            progress(_fraction(machine, int(before.collisions), start, int(target), end))
        if now >= deadline:
            break
        left -= cycles - int(unused)
        if code == constants.SPENT and left > 0:
            continue
        left = CYCLES  # what follows happens at the same cycles, however long they take
        # Only now: many short runs would spend their time with looking at all velocities, or at the clock.
        if most_free_times is None and machine.collisions == last_seen:
            most_free_times = _patience(machine)
            if walltime is None and most_free_times < math.inf:
                stall_detector = StallDetector(machine, last_instant + Fraction(most_free_times))
        if only_end is not None and stall_detector is None:
            stall_detector = StallDetector(machine, only_end)
        if stall_detector is not None and (end is not None or machine.collisions == last_seen):
            stall_detector.look()
        if machine.collisions > last_seen:
            last_seen, last_instant = machine.collisions, machine.clock.instant
        elif most_free_times is not None and machine.clock.instant - last_instant > most_free_times:
            _warn(
                "One component alone meets nobody: the run ended; ask for time= instead of collisions."
                if machine.scene.n == 1
                else f"No collision in {MOST_FREE_TIMES:g} mean free times, after {machine.collisions} in "
                "all: the components seem to miss each other for ever, and the run ended; "
                "ask for time= instead of collisions."
            )
            break
    if progress is not None:
        progress(1.0)
    after, later = machine.engine.tallies[0], kT_time(machine)
    duration = float(machine.clock.instant - start)
    return Block(
        duration,
        int(after.collisions - before.collisions),
        machine.unit.to_scene(float(after.virial - before.virial), -1),
        tuple(b - a for a, b in zip(impulses_before, impulses(machine), strict=True)),
        kT_time=None if heat is None or later is None else later - heat,
        sizes=sizes(machine, diameters, duration),
    )


def _stop(machine: RunState, end: Fraction | None) -> tuple[tuple[np.int64, float], bool]:
    """Return where the engine has to return, as an epoch and an offset, and whether the run ends so."""
    clock, final = machine.clock, True
    if machine.system.rates is not None:
        refit = clock.base + machine.unit.to_scene(Fraction(machine.scheme.horizon), 1)
        if end is None or refit < end:
            end, final = refit, False
    if end is None:
        return (np.int64(UNLIMITED), 0.0), True
    epoch, offset = clock.split(end)
    return (np.int64(epoch), float(offset)), final


def _fraction(machine: RunState, before: int, start: Fraction, target: int, end: Fraction | None) -> float:
    """Return the part that is done: of the collisions or of the time, whichever is more."""
    done = [0.0]
    if before < target < UNLIMITED:
        done.append((machine.collisions - before) / (target - before))
    if end is not None:
        span = end - start
        done.append(float((machine.clock.instant - start) / span) if span else 1.0)
    return min(max(done), 1.0)


def _patience(machine: RunState) -> float:
    """Return the time without a collision after which none is to be expected [time]."""
    growing = machine.system.rates is not None and machine.scene.n > 1
    return math.inf if growing else machine.unit.to_scene(_longest_wait(machine), 1)


def _longest_wait(machine: RunState) -> float:
    """Return the same in the engine's unit, for diameters that do not grow."""
    from carom.engine.neighbors.plan import collision_rate

    scene, epoch = machine.scene, machine.scheme.epoch
    if scene.n == 1:  # there is nobody to meet
        return epoch
    fastest = float(np.abs(machine.speeds).max())
    v = peculiar(scene, machine.speeds)  # a common drift meets nobody
    speed = math.sqrt(float(np.sum(scene.masses[:, None] * v * v)) / (scene.mass * scene.n))
    if speed <= 8.0 * np.finfo(float).eps * fastest:
        return epoch
    if machine.system.threshold > 0.0:  # they cool until contacts are slower than this, hence elastic
        speed = min(speed, machine.system.threshold)
    rate = collision_rate(scene.packing_fraction, scene.dimension, scene.diameter, speed)
    return MOST_FREE_TIMES / rate + epoch if rate > 0.0 else epoch


def _warn(text: str) -> None:
    warnings.warn(text, CaromWarning, stacklevel=5)
