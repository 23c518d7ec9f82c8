"""The temperature of a run: now, and its integral over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.block import MomentumFlux
from carom.scene.temperature import degrees_of_freedom
from carom.scene.temperature import temperature as temperature_of

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState


def temperature(run_state: RunState) -> float:
    """Return the temperature at the present [energy]: :func:`carom.scene.temperature.temperature`."""
    return run_state.unit.to_scene(temperature_of(run_state.scene, run_state.speeds), -2)


def kT_time(run_state: RunState) -> float | None:
    """Return the integral of kT since the start [energy time], or None where no contact changes it."""
    from carom.engine.observers.energy import Balance
    from carom.engine.observers.stream import StreamSums, totals

    stream = run_state.observer(StreamSums)
    if stream is not None:
        twice = float(np.trace(totals(stream, run_state.in_epoch())[0]))
        return run_state.unit.to_scene(twice / degrees_of_freedom(run_state.scene), -1)
    balance = run_state.observer(Balance)
    if balance is None:
        return None
    action = float(balance.action[0] + balance.energy[0] * (run_state.in_epoch() - balance.since[0]))
    return run_state.unit.to_scene(2.0 * action / degrees_of_freedom(run_state.scene), -1)


def momentum_flux(run_state: RunState) -> MomentumFlux | None:
    """Return what makes the pressure tensor of a sheared box, since the start; None elsewhere."""
    from carom.engine.observers.stream import StreamSums, totals

    stream = run_state.observer(StreamSums)
    if stream is None:
        return None
    unit = run_state.unit
    return MomentumFlux(*(unit.to_scene(each, -1) for each in totals(stream, run_state.in_epoch())))
