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


def potential_at_start(run_state: RunState) -> float:
    """Return the potential energy at the start of a run [energy]."""
    _, step_numbers = first_steps(run_state.scene)
    return _energy(run_state, step_numbers)


def potential_energy(run_state: RunState) -> float:
    """Return the potential energy now: the number of pairs on each step times its energy [energy]."""
    _, step_numbers = _present(run_state)
    return _energy(run_state, step_numbers)


def step_sums(run_state: RunState) -> StepSums:
    """Return what happened at the ends of every step since the start, and who is on it now."""
    _, step_numbers = _present(run_state)
    pair = run_state.engine.model.pair
    count, _ = run_state.system.interaction.steps(run_state.system.particles)  # type: ignore[attr-defined]
    heat = kT_time(run_state)
    return StepSums(
        time=float(run_state.clock.instant),
        kT_time=math.nan if heat is None else heat,
        n=run_state.scene.n,
        dimension=run_state.scene.dimension,
        volume=run_state.scene.volume,
        mass=run_state.scene.mass if np.ptp(run_state.scene.masses) == 0.0 else math.nan,
        inner=np.sqrt(np.maximum(pair.inner[:count], 0.0)),
        outer=np.sqrt(pair.outer[:count]),
        energies=np.asarray(run_state.unit.to_scene(pair.energy[:count], -2)),
        pairs=np.bincount(step_numbers, minlength=count)[:count],
        events=pair.events[:count].copy(),
    )


def _present(run_state: RunState) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs within reach now, and their steps."""
    from carom.engine.pair_steps import read_steps

    if not run_state.system.stepped:
        raise InputError("Pairs of this scene have no steps: give it an interaction such as SquareWell().")
    return read_steps(run_state.engine.neighbors) if run_state.steps is None else run_state.steps


def _energy(run_state: RunState, step_numbers: np.ndarray) -> float:
    pair = run_state.engine.model.pair
    energies = run_state.unit.to_scene(pair.energy, -2)
    counts = np.bincount(step_numbers, minlength=len(energies))
    return float(counts[counts > 0] @ energies[counts > 0])
