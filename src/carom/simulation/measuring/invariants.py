"""Energy and momentum of all components: what a run should keep."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.units import TimeUnit


class EnergyMomentum(NamedTuple):
    """Energy and momentum of all components."""

    energy: float  # kinetic [mass length^2 / time^2]
    momentum: np.ndarray  # (d,) [mass length / time]
    scale: float  # momentum of the same speeds in one direction

    @classmethod
    def of(cls, masses: np.ndarray, v: np.ndarray, unit: TimeUnit) -> EnergyMomentum:
        """Return those of masses (n,) and velocities (n, d) in the engine's unit of time."""
        masses = masses[:, None]
        energy = 0.5 * math.fsum((masses * v * v).ravel())
        momentum = np.array([math.fsum(column) for column in (masses * v).T])
        scale = float(np.sum(masses[:, 0] * np.sqrt(np.sum(v * v, axis=1))))
        return cls(unit.to_scene(energy, -2), unit.to_scene(momentum, -1), unit.to_scene(scale, -1))

    def momentum_drift(self, start: EnergyMomentum, strain: float = 0.0) -> float:
        """Return the change of the momentum since the start, in terms of its scale.

        In a shear each peculiar velocity along axis 0 has fallen by ``strain`` times that along axis 1.
        """
        change = self.momentum - start.momentum
        if strain:
            change[0] += strain * start.momentum[1]
        return float(np.linalg.norm(change)) / start.scale if start.scale else 0.0
