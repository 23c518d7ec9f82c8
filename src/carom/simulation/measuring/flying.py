"""Free flights: histograms that the engine keeps while :class:`carom.FreeFlights` are measured."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from carom.block import Block
from carom.errors import InputError
from carom.observables.flights import FlightSums, FreeFlightsResult, flights_of
from carom.simulation.measuring import stretches

if TYPE_CHECKING:
    from carom.engine.observers.flights import Flights
    from carom.simulation.run_state import RunState
    from carom.simulation.simulation import Simulation

REACH = (12.0, 12.0, 8.0)
"""Where histograms end: in mean free times, mean free paths and thermal speeds of the lightest."""


def check(run_state: RunState) -> None:
    """Raise InputError where flights bend or change their speeds, or there are several workers."""
    from carom.engine.obstacles import is_live

    if run_state.executive is not None:
        raise InputError(
            "FreeFlights observes every collision when it happens, and this simulation has several workers: "
            "make it with cores=1."
        )
    system = run_state.system
    moving = any(map(is_live, system.obstacle_models))
    needed = {
        "straight flight": system.straight,
        "obstacles that rest and lose no energy": not moving,
        "diameters that do not grow": system.rates is None,
        "no drive": system.scene.drive is None,
        "units that do not decide by rules": not getattr(system.interaction, "decides", False),
    }
    wrong = [name for name, right in needed.items() if not right]
    if wrong:
        raise InputError(f"FreeFlights needs {' and '.join(wrong)}; leave it out, or change the scene.")


class Flying:
    """Free flights during a stretch, by histograms that the engine keeps from now on (:func:`keeping`)."""

    def __init__(self, sim: Simulation):
        self._sim = sim
        run_state = sim._state
        free = stretches.time_for(sim, 0.5 * sim.scene.n)  # each collision ends two flights
        speed = float(np.sqrt(sim.kT / sim.scene.masses.min()))
        bins = _flights(run_state).times.shape[1] - 1
        self._widths = np.array([free, free * speed, speed]) * REACH / bins
        with run_state.alone.changing():
            unit, observer = run_state.unit, _flights(run_state)
            observer.widths[:] = (
                unit.to_kernel(self._widths[0], 1), self._widths[1], unit.to_kernel(self._widths[2], -1),
            )  # fmt: skip
        self._before = _sums(run_state)
        self._sums: list[FlightSums] = []
        self._durations: list[float] = []

    def add(self, block: Block) -> None:
        """Add what flew during a block."""
        after = _sums(self._sim._state)
        self._sums.append(FlightSums(*(b - a for a, b in zip(self._before, after, strict=True))))
        self._durations.append(block.duration)
        self._before = after

    def result(self) -> FreeFlightsResult:
        """Return distributions and means."""
        scene = self._sim.scene
        species = np.zeros(scene.n, np.int64) if scene.species is None else scene.species
        counts = np.bincount(species, minlength=len(self._before.times))
        return flights_of(self._sums, self._durations, counts, self._widths)


@contextmanager
def keeping(run_state: RunState) -> Iterator[None]:
    """Let the engine keep histograms of flights for as long as the body runs."""
    from carom.engine.observers.flights import make_flights
    from carom.models.interactions.pinned import PinnedCores

    system, pair, species = run_state.system, run_state.engine.model.pair, run_state.scene.species
    if species is not None:
        species = system.particles.with_padding(species, np.int64)
    inverse = pair.inverse if isinstance(pair, PinnedCores) else None
    with run_state.alone.changing():
        _exchange(run_state, make_flights(system.n, species, inverse))
    try:
        yield
    finally:
        leave_out(run_state)


def leave_out(run_state: RunState) -> None:
    """Let the engine go on without histograms of flights."""
    _exchange(run_state, None)


def _exchange(run_state: RunState, new: Flights | None) -> None:
    """Put histograms in the place of those that there are, before the observers of the user."""
    from carom.engine.observers.flights import Flights
    from carom.engine.observers.interface import chained, listed
    from carom.engine.observers.own import Own

    there = [each for each in listed(run_state.engine.model.observers) if not isinstance(each, Flights)]
    user_observers = [each for each in there if isinstance(each, Own)]
    run_state.system = dataclasses.replace(run_state.system, flights=new is not None)
    run_state.observe(chained([*(each for each in there if not isinstance(each, Own)), new, *user_observers]))


def _flights(run_state: RunState) -> Flights:
    from carom.engine.observers.flights import Flights

    found: Flights = run_state.observer(Flights)
    return found


def _sums(run_state: RunState) -> FlightSums:
    """Return a copy of what there is, in the scene's units."""
    observer, unit = _flights(run_state), run_state.unit
    flight_sums, collision_sums = observer.flown.copy(), observer.met.copy()
    flight_sums[:, 1] = unit.to_scene(flight_sums[:, 1], 1)
    collision_sums[:, :, 1] = unit.to_scene(collision_sums[:, :, 1], -1)
    histograms = observer.times.copy(), observer.paths.copy(), observer.speeds.copy()
    return FlightSums(*histograms, flight_sums, collision_sums, observer.returns.copy())
