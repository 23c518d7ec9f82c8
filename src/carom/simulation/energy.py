"""Potential energy: of pairs on steps, and of components in a field; now, and as a mean over a stretch."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.block import Block, Energy
from carom.errors import InputError
from carom.observables.energy import without_potential
from carom.scene.temperature import kept_by_motion
from carom.simulation import pair_steps
from carom.simulation.temperature import temperature

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState


def potential_energy(run_state: RunState) -> float:
    """Return the potential energy now, of all pairs on steps and of all components in a field [energy]."""
    if reason := without_potential(run_state.scene):
        raise InputError(reason)
    found = pair_steps.potential_energy(run_state) if run_state.system.stepped else 0.0
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


def now(run_state: RunState) -> Energy | None:
    """Return potential energy and kT at the present; None where there is no potential energy."""
    if without_potential(run_state.scene):
        return None
    return Energy(potential_energy(run_state), temperature(run_state))


def mean(before: Energy | None, after: Energy | None, block: Block, degrees_of_freedom: int) -> Energy | None:
    """Return the means over a block from the values at its ends; None where there is no potential energy.

    Parameters
    ----------
    before, after : Energy or None
        At the beginning and at the end.
    block : Block
        The stretch between them.
    degrees_of_freedom : int
        Of the velocities.

    Notes
    -----
    The potential energy is the total one less the kinetic one, whose mean is known where ``kT_time`` is. So
    the total energy is averaged over both ends, which is exact where it is conserved. Without ``kT_time``
    both means are those of the ends.
    """
    if before is None or after is None:
        return None
    potential, kT = (0.5 * (a + b) for a, b in zip(before, after, strict=True))
    if block.kT is None:
        return Energy(potential, kT)
    return Energy(potential + 0.5 * degrees_of_freedom * (kT - block.kT), block.kT)
