"""The temperature of a run: now, its integral over time, and velocities of a given one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError
from carom.scene.temperature import degrees_of_freedom, peculiar
from carom.scene.temperature import temperature as temperature_of

if TYPE_CHECKING:
    from carom.scene.scene import Scene
    from carom.simulation.machine import Machine


def temperature(machine: Machine) -> float:
    """Return the temperature at the present [energy]: :func:`carom.scene.temperature.temperature`."""
    return machine.unit.to_scene(temperature_of(machine.scene, machine.speeds), -2)


def kT_time(machine: Machine) -> float | None:
    """Return the integral of kT since the start [energy time], or None where no contact changes it."""
    balance = machine.engine.model.balance
    if balance is None:
        return None
    action = float(balance.action[0] + balance.energy[0] * (machine.in_epoch() - balance.since[0]))
    return machine.unit.to_scene(2.0 * action / degrees_of_freedom(machine.scene), -1)


def at_temperature(velocities: np.ndarray, scene: Scene, kT: float) -> np.ndarray:
    """Return velocities, scaled so that the temperature is ``kT``, without momentum that is conserved.

    Raises
    ------
    InputError
        If nothing moves.
    """
    velocities = peculiar(scene, velocities)
    twice = float(np.sum(scene.masses[:, None] * velocities * velocities))
    if twice == 0.0:
        raise InputError("Nothing moves, so there is no temperature to scale; give the scene velocities.")
    half = math.frexp(twice)[1] // 2  # a temperature over another may be no double; their roots are
    factor = math.sqrt(kT * degrees_of_freedom(scene) / math.ldexp(twice, -2 * half))
    return np.ldexp(factor * velocities, -half)
