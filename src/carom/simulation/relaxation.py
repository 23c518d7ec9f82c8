"""The displacement of the particles during a measurement: has their arrangement relaxed?"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.observables.equilibrium import slow_structure

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState


class StructuralRelaxation:
    """Compares the positions at the end of a stretch with those at its beginning.

    Not watched are scenes in which diameters grow, and runs without counts of images, in which particles that
    leave the box at one side cannot be followed to the other.

    Parameters
    ----------
    machine : RunState
        The run, at the beginning of the stretch.
    """

    def __init__(self, machine: RunState):
        self._machine = machine
        followed = machine.engine.state.images is not None and machine.system.rates is None
        self._start = machine.frame().unwrapped if followed else None

    def doubts(self) -> list[str]:
        """Return a sentence if the arrangement has not relaxed since the beginning (``slow_structure``)."""
        if self._start is None:
            return []
        scene = self._machine.scene
        return slow_structure(scene, mean_square_displacement(self._start, self._machine.frame().unwrapped))


def mean_square_displacement(start: np.ndarray, end: np.ndarray) -> float:
    """Return the mean square distance of unwrapped positions (n, d), without the common part [length^2]."""
    distance = end - start
    distance -= distance.mean(axis=0)
    return float(np.mean(np.sum(distance * distance, axis=1)))
