"""The displacement of the particles during a stretch: has their arrangement relaxed?"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.observables.drift import STUCK
from carom.observables.equilibrium import RENEWED, RENEWED_OTHERWISE, caged, slow_structure
from carom.scene.fields import is_usual
from carom.theory import FREEZING, NEAR_FREEZING

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState


class StructuralRelaxation:
    """Compares the positions at the end of a stretch with those at its beginning.

    Not watched are growing diameters, and runs without counts of images, where particles cannot be followed.
    """

    def __init__(self, run_state: RunState, start: np.ndarray | None = None):
        self._run_state = run_state
        followed = run_state.engine.state.images is not None and run_state.system.rates is None
        self.start = start if start is not None or not followed else run_state.frame().unwrapped
        """Unwrapped positions at the beginning, (n, d) [length]; None where they are not watched."""
        self._box = np.array(run_state.scene.box)

    def doubts(self) -> list[str]:
        """Return a sentence if the arrangement has not relaxed since the beginning (``slow_structure``)."""
        if self.start is None:
            return []
        return slow_structure(self._run_state.scene, self._square())

    def distances(self) -> tuple[float, float]:
        """Return how far particles moved, and must move to leave their neighborhoods [mean spacing], or 0.

        Near freezing that is as in :func:`carom.observables.equilibrium.slow_structure`; below it hard
        particles alone in a periodic box must have left their places. Nothing is asked of crystals, glasses,
        rods on a line, and below freezing of what walls, pinned particles or wells may keep.
        """
        scene = self._run_state.scene
        freezing = FREEZING.get(scene.dimension)
        if self.start is None or freezing is None:
            return 0.0, 0.0
        moved = math.sqrt(self._square()) / (scene.volume / scene.n) ** (1.0 / scene.dimension)
        if scene.packing_fraction >= NEAR_FREEZING * freezing:
            held = scene.packing_fraction >= freezing and caged(scene, moved)
            return moved, 0.0 if held else RENEWED.get(scene.dimension, RENEWED_OTHERWISE)
        hard = all(is_usual(scene, kind) for kind in ("interaction", "motion", "impact"))
        alone = hard and all(scene.periodic) and not scene.obstacles and scene.pinned is None
        return moved, STUCK if alone else 0.0

    def _square(self) -> float:
        assert self.start is not None
        scale = np.array(self._run_state.scene.box) / self._box  # a barostat moves all places with the box
        return mean_square_displacement(self.start * scale, self._run_state.frame().unwrapped)


def mean_square_displacement(start: np.ndarray, end: np.ndarray) -> float:
    """Return the mean square distance of unwrapped positions (n, d), without the common part [length^2]."""
    distance = end - start
    distance -= distance.mean(axis=0)
    return float(np.mean(np.sum(distance * distance, axis=1)))
