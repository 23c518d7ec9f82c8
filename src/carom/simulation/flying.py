"""Collision statistics on the way: the method :meth:`carom.Simulation.free_flights`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.observables.flights import FlightsEstimate, FlightSums, flights_of
from carom.simulation import stretches

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.simulation.in_motion import InMotion
    from carom.simulation.run_state import RunState

REACH = (12.0, 12.0, 8.0)
"""Where histograms end: in mean free times, mean free paths and thermal speeds of the lightest."""


def check(system: System) -> None:
    """Raise InputError where the length of a flight is not its duration times the speed at its end."""
    from carom.engine.dynamic_obstacles import is_live

    moving = any(map(is_live, system.obstacle_models))
    missing = {
        "straight flight": system.straight,
        "obstacles that rest and lose no energy": not moving,
        "diameters that do not grow": system.rates is None,
        "no drive": system.drive is None,
        "units that do not decide by rules": not getattr(system.interaction, "decides", False),
    }
    wrong = [name for name, right in missing.items() if not right]
    if wrong:
        raise InputError(f"flights=True needs {' and '.join(wrong)}; leave it out, or change the scene.")


def free_flights(
    sim: InMotion,
    *,
    collisions_per_particle: float | None = None,
    time: float | None = None,
    blocks: int = 64,
) -> FlightsEstimate:
    """Continue the run and return free times, free paths, collision rates and normal speeds.

    This does not affect the trajectory.

    Parameters
    ----------
    collisions_per_particle, time : float
        Length of the stretch; give one of the two.
    blocks : int
        Number of stretches of equal time; their scatter gives the error bars.

    Returns
    -------
    FlightsEstimate
        By species; see :mod:`carom.observables.flights`. Flights that begin before the stretch or end after
        it are left out: the stretch should be long compared with a free time. Pinned components have no
        flights, but collisions.

    Raises
    ------
    InputError
        If the simulation was made without ``flights=True``, or not exactly one length is given, or it is not
        a positive number.
    """
    machine = sim._state
    flights = _flights(machine)
    if flights is None:
        raise InputError("free_flights() needs a simulation made with flights=True.")
    if (collisions_per_particle is None) == (time is None):
        raise InputError("free_flights() needs either collisions_per_particle or time.")
    count = checks.integer(blocks, "blocks", low=2)
    n = sim.scene.n
    # Checked before anything runs, or is cleared.
    if time is None:
        length = checks.number(
            collisions_per_particle, "collisions_per_particle of free_flights()", low=0.0, open_low=True
        )
        time = stretches.time_for(sim, checks.collisions_of(length, n))
    else:
        time = checks.number(time, "time of free_flights()", low=0.0, open_low=True)
    free = stretches.time_for(sim, 0.5 * n)  # each collision ends two flights
    speed = float(np.sqrt(sim.kT / sim.scene.masses.min()))
    widths = np.array([free, free * speed, speed]) * REACH / (flights.times.shape[1] - 1)
    with machine.alone.changing():
        _clear(machine, widths)
    sums, durations, before = [], [], _sums(machine)
    for block in stretches.blocks(sim, time / count, count):
        after = _sums(machine)
        sums.append(FlightSums(*(b - a for a, b in zip(before, after, strict=True))))
        durations.append(block.duration)
        before = after
    kinds = np.zeros(n, np.int64) if sim.scene.species is None else sim.scene.species
    return flights_of(sums, durations, np.bincount(kinds, minlength=len(flights.times)), widths)


def _flights(machine: RunState):
    from carom.engine.observers.flights import Flights

    return machine.observer(Flights)


def _clear(machine: RunState, widths: np.ndarray) -> None:
    """Begin new histograms."""
    flights, unit = _flights(machine), machine.unit
    flights.widths[:] = [unit.to_kernel(widths[0], 1), widths[1], unit.to_kernel(widths[2], -1)]
    flights.last[:] = np.inf
    flights.partners[:] = -1
    for part in (
        flights.times, flights.paths, flights.speeds, flights.flown, flights.met, flights.returns,
    ):  # fmt: skip
        part[:] = 0


def _sums(machine: RunState) -> FlightSums:
    """Return a copy of what there is, in the scene's units."""
    flights, unit = _flights(machine), machine.unit
    flown, met = flights.flown.copy(), flights.met.copy()
    flown[:, 1] = unit.to_scene(flown[:, 1], 1)
    for power in (1, 2):
        met[:, :, power] = unit.to_scene(met[:, :, power], -power)
    histograms = flights.times.copy(), flights.paths.copy(), flights.speeds.copy()
    return FlightSums(*histograms, flown, met, flights.returns.copy())
