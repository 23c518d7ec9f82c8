"""What a run shows at the present, in the scene's units: kT and its integral, energies, steps, units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.block import Block, EnergySample, MomentumFlux
from carom.errors import InputError
from carom.observables.energy import without_potential
from carom.observables.steps import StepSums
from carom.scene.fields import first_steps, standing
from carom.scene.velocities import degrees_of_freedom, kept_by_motion, temperature

if TYPE_CHECKING:
    from carom.scene.scene import Scene
    from carom.simulation.run_state import RunState


def kT(run_state: RunState) -> float:
    """Return the temperature at the present [energy]: :func:`carom.scene.velocities.temperature`."""
    return run_state.unit.to_scene(temperature(run_state.scene, run_state.speeds), -2)


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


def potential_energy(run_state: RunState) -> float:
    """Return the potential energy now, of all pairs on steps and of all components in a field [energy].

    InputError if there is none, or if crossings of the box along the field were not counted.
    """
    if reason := without_potential(run_state.scene):
        raise InputError(reason)
    found = energy_of_steps(run_state) if run_state.system.stepped else 0.0
    return found + _in_field(run_state)


def _in_field(run_state: RunState) -> float:
    """Return the potential energy in the field of the motion, 0 without one."""
    scene = run_state.scene
    in_field = getattr(scene.motion, "potential_energy", None)
    if in_field is None:
        return 0.0
    frame = run_state.frame()
    places = frame.positions
    if frame.images is not None:
        places = places + frame.images * np.array(scene.box)
    elif any(wraps and not kept for wraps, kept in zip(scene.periodic, kept_by_motion(scene), strict=True)):
        raise InputError(
            "The height of components that cross the box along the field is not known: leave out images."
        )
    return float(in_field(scene.masses, places, scene.box))


def energy_now(run_state: RunState) -> EnergySample | None:
    """Return potential energy and kT at the present; None where there is no potential energy."""
    if without_potential(run_state.scene):
        return None
    return EnergySample(potential_energy(run_state), kT(run_state))


def mean_energy(
    before: EnergySample | None, after: EnergySample | None, block: Block, degrees_of_freedom: int
) -> EnergySample | None:
    """Return the means over a block from the values at its ends; None where there is no potential energy.

    It is the total less the kinetic energy, whose mean is known where ``kT_time`` is: the total is averaged
    over both ends, exact where it is conserved. Without ``kT_time`` both means are those of the ends.
    """
    if before is None or after is None:
        return None
    potential, both_kT = (0.5 * (a + b) for a, b in zip(before, after, strict=True))
    if block.kT is None:
        return EnergySample(potential, both_kT)
    return EnergySample(potential + 0.5 * degrees_of_freedom * (both_kT - block.kT), block.kT)


def energy_of_first_steps(run_state: RunState) -> float:
    """Return the potential energy at the start of a run [energy]; pairs are looked for once."""
    if run_state.energy_of_first_steps is None:
        _, step_numbers = first_steps(run_state.scene)
        run_state.energy_of_first_steps = _on_steps(run_state, step_numbers)
    return run_state.energy_of_first_steps


def energy_of_steps(run_state: RunState) -> float:
    """Return the energy of pairs on steps now [energy]; InputError without steps."""
    _, step_numbers = _steps_now(run_state)
    return _on_steps(run_state, step_numbers)


def step_sums(run_state: RunState) -> StepSums:
    """Return what happened at each step's ends, and who is on it now; InputError without steps."""
    _, step_numbers = _steps_now(run_state)
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
        degrees_of_freedom=math.inf if _has_a_bath(run_state.scene) else degrees_of_freedom(run_state.scene),
        inner=np.sqrt(np.maximum(pair.inner[:count], 0.0)),
        outer=np.sqrt(pair.outer[:count]),
        energies=np.asarray(run_state.unit.to_scene(pair.energy[:count], -2)),
        pairs=np.bincount(step_numbers, minlength=count)[:count],
        events=pair.events[:count].copy(),
    )


def _has_a_bath(scene: Scene) -> bool:
    """Tell whether a drive or a thermal surface exchanges energy with the particles."""
    hot = (getattr(obstacle, "kT", None) is not None for obstacle in standing(scene))
    return scene.drive is not None or any(hot)


def _steps_now(run_state: RunState) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs within reach now, and their steps."""
    from carom.engine.pair_steps import read_steps

    if not run_state.system.stepped:
        raise InputError("Pairs of this scene have no steps: give it an interaction such as SquareWell().")
    return read_steps(run_state.engine.neighbors) if run_state.steps is None else run_state.steps


def _on_steps(run_state: RunState, step_numbers: np.ndarray) -> float:
    pair = run_state.engine.model.pair
    energies = run_state.unit.to_scene(pair.energy, -2)
    counts = np.bincount(step_numbers, minlength=len(energies))
    return float(counts[counts > 0] @ energies[counts > 0])


@dataclass(frozen=True)
class UnitsNow:
    """All units at one time: copies, which the run does not change.

    Attributes
    ----------
    kinds : (n,) int64 array
        Kind of each unit: its index in ``Ranges.kinds``.
    present : (n,) bool array
        Which units have not been removed.
    counts : (n, circles, kinds) int64 array
        Units of each kind in each circle of each unit; zero for circles that a unit does not have.
    memory : (n, m) float64 array
        The numbers that the rule keeps for each unit.
    timers : (n,) float64 array
        Time until each unit's timer runs out; infinite for never [time].
    targets : (n,) int64 array
        Target of each unit, or -1.
    asked : dict of str to int
        Number of calls of the rule since the start, by cause.
    """

    kinds: np.ndarray
    present: np.ndarray
    counts: np.ndarray
    memory: np.ndarray
    timers: np.ndarray
    targets: np.ndarray
    asked: dict[str, int]


def units_now(run_state: RunState) -> UnitsNow:
    """Return the units of a run at the present time; InputError if there are none."""
    pair = run_state.engine.model.rules
    if pair is None:
        raise InputError(
            "No unit in this scene decides by rules: give it interaction=carom.models.Ranges(...)."
        )
    causes = ("entered", "left", "timer", "changed")
    return UnitsNow(
        kinds=pair.kinds[:-1].copy(),
        present=pair.present[:-1] != 0,
        counts=pair.counts[:-1].copy(),
        memory=pair.memory[:-1].copy(),
        timers=np.asarray(run_state.unit.to_scene(pair.timers[:-1] - run_state.in_epoch(), 1)),
        targets=pair.targets[:-1].copy(),
        asked=dict(zip(causes, pair.asked[1:].tolist(), strict=True)),
    )
