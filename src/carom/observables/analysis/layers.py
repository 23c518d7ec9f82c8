"""The granular temperature by layers along a field: what a bed has in place of one temperature.

A layer holds the centers at one height ``u . x`` against the field, within the largest diameter. With its N
particles at each look, numerator and denominator added up separately::

    kT = sum_i m_i (v_i - v)^2 / (d (N - 1)),    v = sum_i m_i v_i / sum_i m_i

In equilibrium that is the temperature, at every height; a bed that loses energy has no single one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.models.motions.gravity import Gravity
from carom.observables.statistics import Estimate, ratio, unwarned

if TYPE_CHECKING:
    from carom.frame import Frame
    from carom.scene.scene import Scene

MOST = 64
"""Layers at most; in a higher box they are thicker than the largest diameter."""

GROUPS = 128
"""Groups of looks that are kept, from which errors follow; of more, two neighbors become one."""


@dataclass(frozen=True)
class Layer:
    """Averages over a layer; its heights are from the end of the box to which the field pulls."""

    low: float  # [length]
    high: float  # [length]
    members: float  # mean number of particles
    kT: Estimate | None  # granular temperature [energy]; None where never two were in the layer


class Layers:
    """Sums over the layers of a run, at looks of equal distance in time; none without a field.

    ``groups`` is continued in place: of each the looks, the sum of kT, and for each layer members, twice the
    kinetic energy in its frame, and degrees of freedom.
    """

    def __init__(self, scene: Scene, groups: list[list[list[float]]]):
        self.groups = groups
        self.weight = weight(scene)
        if self.weight is None:
            return
        g, box = np.array(scene.motion.g), np.array(scene.box)  # type: ignore[attr-defined]
        self._up = -g / math.hypot(*g)
        self._bottom = float(np.minimum(self._up * box, 0.0).sum())
        self._room = float(np.abs(self._up * box).sum())
        self._count = min(max(math.ceil(self._room / scene.diameter), 1), MOST)
        self._width = max(scene.diameter, self._room / MOST)

    def look(self, frame: Frame, kT: float) -> None:
        """Add the present state, whose temperature is ``kT``; only where there is a ``weight``."""
        heights = frame.positions @ self._up - self._bottom
        which = np.clip((heights / self._width).astype(np.int64), 0, self._count - 1)
        members, _ = np.histogram(which, np.arange(self._count + 1))

        def summed(values: np.ndarray) -> np.ndarray:
            return np.bincount(which, values, self._count)

        m, v = frame.masses, frame.velocities
        masses = np.maximum(summed(m), np.finfo(float).tiny)
        mean = np.array([summed(m * each) for each in v.T]) / masses
        own = v - mean.T[which]
        energies = summed(m * np.sum(own * own, axis=1))
        freedoms = frame.dimension * np.maximum(members - 1, 0)
        new = [[1.0, kT], members.tolist(), energies.tolist(), freedoms.tolist()]
        if self.groups and self.groups[-1][0][0] < self.groups[0][0][0]:
            self.groups[-1] = _together(self.groups[-1], new)
            return
        if len(self.groups) == GROUPS:
            self.groups[:] = [_together(*self.groups[k : k + 2]) for k in range(0, GROUPS, 2)]
        self.groups.append(new)

    @property
    def kT(self) -> float | None:
        """Mean temperature of all at the looks [energy]; None without a look."""
        looks = sum(group[0][0] for group in self.groups)
        return sum(group[0][1] for group in self.groups) / looks if looks else None

    def found(self) -> list[Layer]:
        """Return the layers in which there ever was a particle, from the lowest on."""
        if not self.groups:
            return []
        looks = sum(group[0][0] for group in self.groups)
        members, energies, freedoms = np.array([group[1:] for group in self.groups]).transpose(1, 2, 0)
        layers = []
        for k in np.flatnonzero(members.sum(axis=1)).tolist():
            held = freedoms[k] > 0.0
            with unwarned():  # few samples: the error says so
                kT = ratio(energies[k][held], freedoms[k][held]) if held.any() else None
            ends = k * self._width, min((k + 1) * self._width, self._room)
            layers.append(Layer(*ends, float(members[k].sum()) / looks, kT))
        return layers


def weight(scene: Scene) -> float | None:
    """Return the mean weight of a particle, m g [energy / length]; None where there is no field."""
    motion = scene.motion
    if not isinstance(motion, Gravity) or motion.strength == 0.0:
        return None
    return float(scene.masses.mean()) * motion.strength


def _together(a: list[list[float]], b: list[list[float]]) -> list[list[float]]:
    """Return the sums of two groups."""
    return [[x + y for x, y in zip(*rows, strict=True)] for rows in zip(a, b, strict=True)]
