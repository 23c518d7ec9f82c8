"""A run goes on until the first of its limits: the method :meth:`carom.Simulation.run`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from carom import checks
from carom.block import Block
from carom.errors import InputError
from carom.notebook import watchable
from carom.simulation import run_loop
from carom.simulation.callbacks import Call, Callbacks, Hit
from carom.suggestions import corrected

if TYPE_CHECKING:
    from carom.simulation.simulation import Simulation

LIMITS = ("collisions", "collisions_per_particle", "time", "walltime", "until")  # what ends a run


@watchable("Running")
@corrected()
def run(
    sim: Simulation,
    *,
    collisions: int | None = None,
    collisions_per_particle: float | None = None,
    time: float | None = None,
    walltime: float | None = None,
    until: Hit | Callable[[Any], object] | None = None,
    every: float | None = None,
    call: Call | Sequence[Call] | None = None,
    progress: Callable[[float], object] | None = None,
) -> Block:
    """Run until the first of the given limits is reached.

    Parameters
    ----------
    collisions : int, optional
        Pair collisions to add, a whole number.
    collisions_per_particle : float, optional
        The same per particle: every collision counts for two particles.
    time : float, optional
        Time to add [time]; the run then ends exactly there.
    walltime : float, optional
        Seconds of wall time, without those of compiling.
    until : Hit or callable, optional
        ``carom.hit("door")``: the run ends exactly at the contact with that obstacle. Or a condition: the
        run ends where ``until(sim)`` is true. It is looked at now, and then ``every`` so often, or else
        after every 20 000 events; it does not see what is in between.
    every : float, optional
        Time between two calls [time]; the first is so long after the present.
    call : callable or sequence of callables, optional
        Called with the simulation at exactly these times, such as :class:`carom.CSVLog`. They may look at
        it and save it, and do not affect the trajectory. The run can be continued if one of them raises
        an exception, and after Ctrl-C, which leaves the state at the last event.
    progress : callable or True, optional
        Called from time to time with the fraction done; does not affect the trajectory. True shows a bar.

    Returns
    -------
    Block
        Duration, collisions and virial of this stretch.

    Raises
    ------
    InputError
        If no limit is given, or one is not a number of at least zero; if ``call`` and ``every`` are not
        given together, or there is no such obstacle. Also if a time cannot be reached, because growing
        particles jam before it or have no room at all; the state is then that at which the run stopped.
    BusyError
        If another thread uses this simulation, or if this is called by a callback of a run.

    Warns
    -----
    CaromWarning
        If the requested collisions cannot happen: nothing moves, there is only one particle, or there
        was no collision in a thousand mean free times.
    """
    limits = {
        "collisions": collisions,
        "collisions_per_particle": collisions_per_particle,
        "time": time,
        "walltime": walltime,
    }
    for name, value in limits.items():
        if value is not None:
            checks.number(value, name, low=0.0)
    if collisions is not None and collisions % 1 != 0:
        raise InputError(f"collisions must be a whole number, found {checks.describe(collisions)}.")
    if until is None and all(value is None for value in limits.values()):
        raise InputError(f"run() needs a limit: one of {', '.join(LIMITS)}.")
    if collisions_per_particle is not None:
        added = checks.collisions_of(collisions_per_particle, sim.n)
        collisions = added if collisions is None else min(collisions, added)
    present, callbacks = sim._state.clock.instant, None
    end = None if time is None else present + Fraction(float(time))
    if until is not None or every is not None or call is not None:
        callbacks = Callbacks(sim, every, call, until)
        if callbacks.holds():
            return run_loop.advance(sim._state, None, present)
    whole = None if collisions is None else int(collisions)
    return run_loop.advance(sim._state, whole, end, walltime, progress, callbacks)
