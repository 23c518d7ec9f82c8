"""Time-driven stepping, with which Lubachevsky (1991) compares event-driven simulation: spheres that overlap
after a step and approach exchange momentum, so that contacts come late or are missed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from carom.reference.naive import Collision

SKIN = 0.3
"""Reach of the list of pairs beyond contact, in diameters: short lists that last for many steps."""


class SteppedSystem:
    """Equal hard spheres (n, d) by a fixed step in a periodic box of two diameters or more; ``virial`` sums
    ``r_ij . dp_ij`` [energy], ``worst_overlap`` is the deepest after a step [diameters].
    """

    def __init__(
        self,
        positions: Any,
        velocities: Any,
        box: Any,
        *,
        step: float,
        diameter: float = 1.0,
        mass: float = 1.0,
    ):
        self.positions = np.array(positions, dtype=float)
        self.velocities = np.array(velocities, dtype=float)
        self.box = np.array(box, dtype=float)
        self.step, self.diameter, self.mass = float(step), float(diameter), float(mass)
        self.steps = self.collisions = 0
        self.virial = self.worst_overlap = 0.0
        self._fastest = self._speed()
        self._drift = math.inf  # how far the fastest sphere may have moved since the pairs were listed
        self._pairs = np.empty((0, 2), dtype=int)

    @property
    def time(self) -> float:
        """The present [time]."""
        return self.steps * self.step

    def run(self, steps: int) -> list[Collision]:
        """Make a number of steps and return the collisions as they were processed, at the time of contact on
        straight lines.
        """
        found: list[Collision] = []
        squared = self.diameter**2
        for _ in range(steps):
            self._list_pairs()
            self.positions += self.velocities * self.step
            self.steps += 1
            r = self._separations(self._pairs)
            rr = np.einsum("ij,ij->i", r, r)
            close = np.flatnonzero(rr < squared)
            if close.size:
                self.worst_overlap = max(
                    self.worst_overlap, 1.0 - math.sqrt(float(rr[close].min())) / self.diameter
                )
                self._collide(r[close], self._pairs[close], found)
        return found

    def _collide(self, separations: np.ndarray, pairs: np.ndarray, found: list[Collision]) -> None:
        """Let pairs that overlap and approach collide, the earliest contact first."""
        u = self.velocities[pairs[:, 1]] - self.velocities[pairs[:, 0]]
        rv = np.einsum("ij,ij->i", separations, u)
        vv = np.einsum("ij,ij->i", u, u)
        c = np.einsum("ij,ij->i", separations, separations) - self.diameter**2
        # Back along straight lines to contact: c < 0, and r.v < 0 for those that approach.
        with np.errstate(invalid="ignore", divide="ignore"):
            ago = -c / (np.sqrt(rv * rv - vv * c) - rv)
        for k in np.argsort(-ago, kind="stable"):
            i, j = (int(index) for index in pairs[k])
            r = separations[k]
            approach = float(r @ (self.velocities[j] - self.velocities[i]))
            if approach >= 0.0:
                continue
            impulse = r * (approach / float(r @ r))
            self.velocities[i] += impulse
            self.velocities[j] -= impulse
            self.collisions += 1
            self.virial -= self.mass * approach
            lateness = min(float(ago[k]), self.step) if math.isfinite(ago[k]) else 0.0
            found.append(
                Collision(self.time - lateness, i, j, (), self.mass * math.sqrt(float(impulse @ impulse)))
            )
        self._fastest = self._speed()

    def _list_pairs(self) -> None:
        """List the pairs anew if a pair that is not listed may meet in the coming step."""
        self._drift += self._fastest * self.step
        if self._drift <= 0.5 * SKIN * self.diameter:
            return
        from scipy.spatial import cKDTree

        wrapped = np.mod(self.positions, self.box)
        wrapped[wrapped >= self.box] = 0.0
        reach = self.diameter * (1.0 + SKIN) + 2.0 * self._fastest * self.step
        self._pairs = cKDTree(wrapped, boxsize=self.box).query_pairs(reach, output_type="ndarray")
        self._pairs = self._pairs[np.lexsort((self._pairs[:, 1], self._pairs[:, 0]))]
        self._drift = self._fastest * self.step

    def _separations(self, pairs: np.ndarray) -> np.ndarray:
        r = self.positions[pairs[:, 1]] - self.positions[pairs[:, 0]]
        r -= self.box * np.rint(r / self.box)
        return r

    def _speed(self) -> float:
        return math.sqrt(float(np.max(np.einsum("ij,ij->i", self.velocities, self.velocities))))
