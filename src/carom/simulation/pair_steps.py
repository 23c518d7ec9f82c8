"""Pairs on steps, in the scene's terms: their energy, and what happened to them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError
from carom.observables.steps import StepSums
from carom.scene.first_steps import first_steps
from carom.simulation.temperature import kT_time

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState


def potential_at_start(machine: RunState) -> float:
    """Return the potential energy at the start of a run [energy]."""
    _, steps = first_steps(machine.scene)
    return _energy(machine, steps)


def potential_energy(machine: RunState) -> float:
    """Return the potential energy now: the number of pairs on each step times its energy [energy].

    Raises
    ------
    InputError
        If pairs have no steps.
    """
    _, steps = _present(machine)
    return _energy(machine, steps)


def step_sums(machine: RunState) -> StepSums:
    """Return what happened at the ends of every step since the start, and who is on it now.

    Raises
    ------
    InputError
        If pairs have no steps.
    """
    _, steps = _present(machine)
    pair = machine.engine.model.pair
    count, _ = machine.system.interaction.steps(machine.system.particles)  # type: ignore[attr-defined]
    heat = kT_time(machine)
    return StepSums(
        time=float(machine.clock.instant),
        kT_time=math.nan if heat is None else heat,
        n=machine.scene.n,
        dimension=machine.scene.dimension,
        volume=machine.scene.volume,
        mass=machine.scene.mass if np.ptp(machine.scene.masses) == 0.0 else math.nan,
        inner=np.sqrt(np.maximum(pair.inner[:count], 0.0)),
        outer=np.sqrt(pair.outer[:count]),
        energies=np.asarray(machine.unit.to_scene(pair.energy[:count], -2)),
        pairs=np.bincount(steps, minlength=count)[:count],
        events=pair.events[:count].copy(),
    )


def _present(machine: RunState) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs within reach now, and their steps."""
    from carom.engine.pair_steps import read_steps

    if not machine.system.stepped:
        raise InputError("Pairs of this scene have no steps: give it an interaction such as SquareWell().")
    return read_steps(machine.engine.neighbors) if machine.steps is None else machine.steps


def _energy(machine: RunState, steps: np.ndarray) -> float:
    pair = machine.engine.model.pair
    energies = machine.unit.to_scene(pair.energy, -2)
    counts = np.bincount(steps, minlength=len(energies))
    return float(counts[counts > 0] @ energies[counts > 0])
