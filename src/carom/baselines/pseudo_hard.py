"""Pseudo hard spheres: a steep potential that codes with a time step use instead of hard spheres.

A Mie potential of exponents 50 and 49, cut at its minimum and shifted, has nearly the structure and pressure
of hard spheres of diameter sigma at kT = 1.5 epsilon (Jover, Haslam, Galindo, Jackson and Mueller, J. Chem.
Phys. 137, 144505 (2012)).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from carom.baselines.listed import ListedSpheres
from carom.baselines.pairs import compile_kept

REDUCED_TEMPERATURE = 1.5
"""kT / epsilon at which the potential imitates hard spheres (Jover et al.)."""

CUT = 50.0 / 49.0
"""Distance beyond which the force is zero [diameters]."""


class PseudoHardSpheres(ListedSpheres):
    """Pseudo hard spheres in a periodic box of at least two diameters, by velocity Verlet.

    ``step`` is in units of ``diameter * sqrt(mass / epsilon)``, epsilon is two thirds of ``kT``, and ``skin``
    [diameters] is that of the list of pairs, by default the fastest.
    """

    def __init__(
        self,
        positions: Any,
        velocities: Any,
        box: Any,
        *,
        step: float,
        kT: float = 1.0,
        diameter: float = 1.0,
        mass: float = 1.0,
        skin: float | None = None,
    ):
        self.kT, self.epsilon = float(kT), float(kT) / REDUCED_TEMPERATURE
        super().__init__(
            positions,
            velocities,
            box,
            step=float(step) * float(diameter) * math.sqrt(float(mass) / self.epsilon),
            diameter=diameter,
            mass=mass,
            # Integrals of the virial and of the kinetic energy; smallest distance squared; potential energy.
            tally=np.array([0.0, 0.0, float(np.max(box)) ** 2, 0.0]),
            settings={"step": step, "kT": kT, "diameter": diameter, "mass": mass},
        )
        self._f = np.zeros(self._x.shape)
        self.skin = self._tuned(skin)

    @property
    def virial(self) -> float:
        """Integral of ``sum r_ij . f_ij`` so far [energy time]; for hard spheres sum of ``r_ij . dp_ij``."""
        return float(self._tally[0])

    @property
    def action(self) -> float:
        """Integral of the kinetic energy over the time so far [energy time]."""
        return float(self._tally[1])

    @property
    def closest(self) -> float:
        """Smallest distance of two spheres so far [diameters]."""
        return math.sqrt(float(self._tally[2])) / self.diameter

    @property
    def energy(self) -> float:
        """Kinetic and potential energy now."""
        self._renew()
        self._forces()
        return self.kinetic_energy + float(self._tally[3])

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy now."""
        return 0.5 * self.mass * float((self._v**2).sum())

    @property
    def bytes(self) -> int:
        """Memory of the state, the forces and the list [bytes]."""
        return super().bytes + self._f.nbytes

    def run(self, steps: int) -> None:
        """Make ``steps`` steps."""
        left = steps
        while left:
            if self._slack < 0.0:
                self._renew()
                self._forces()
            made = self._stepped(self.step, left)
            self.steps += made
            left -= made
            if left:
                self._slack = -1.0

    def equilibrate(self, steps: int, every: int = 50) -> None:
        """Make steps with velocities rescaled to kT from time to time; then set the sums to zero.

        Hard spheres have too little potential energy, whose gain would cool the system.
        """
        n, d = self._x.shape[1], self._x.shape[0]
        for _ in range(max(steps // every, 1)):
            self.run(every)
            self._v -= self._v.mean(axis=1, keepdims=True)
            self._v *= math.sqrt(0.5 * d * (n - 1) * self.kT / self.kinetic_energy)
        self.steps = 0
        self._tally[:2] = 0.0
        self._tally[2] = float(self.box.max()) ** 2

    def _renew(self) -> None:
        """List the pairs again."""
        self._list_pairs(CUT * self.diameter, self.skin, 2.0)

    def _forces(self) -> None:
        """Compute forces and potential energy."""
        self._stepped(0.0, 0)

    def _stepped(self, step: float, steps: int) -> int:
        """Make steps of a time while the list is valid, and return their number."""
        made: int = _verlet(len(self.box))(
            self._x, self._v, self._f, self._listed, self._pairs.first, self._pairs.second, self.box,
            1.0 / self.box, step, steps, self._slack, self.diameter**2, self.epsilon, self.mass, self._tally,
            self._chunk,
        )  # fmt: skip
        return made


@lru_cache
def _verlet(dimension: int) -> Any:
    """Return the compiled velocity Verlet steps."""
    D = dimension
    strength = 50.0 * CUT**49.0

    def verlet(
        x, v, f, listed, first, second, box, inverse, step, steps, slack, square, epsilon, mass, tally, chunk
    ):
        """Make steps until the list is no longer valid; return their number. 0 steps only compute forces."""
        n = x.shape[1]
        pairs = len(first)
        size = chunk if chunk > 0 else max(pairs, 1)
        cut = CUT * CUT * square
        kick = 0.5 * step / mass
        for made in range(max(steps, 1)):
            if steps > 0:
                furthest = 0.0
                for i in range(n):
                    moved = 0.0
                    for a in range(D):
                        v[a, i] += kick * f[a, i]
                        r = x[a, i] + v[a, i] * step - listed[a, i]
                        moved += r * r
                    furthest = max(furthest, moved)
                if 2.0 * np.sqrt(furthest) > slack:
                    for a in range(D):
                        for i in range(n):
                            v[a, i] -= kick * f[a, i]
                    return made
                for a in range(D):
                    for i in range(n):
                        x[a, i] += v[a, i] * step
            for a in range(D):
                for i in range(n):
                    f[a, i] = 0.0
            virial = 0.0
            potential = 0.0
            for begin in range(0, pairs, size):
                end = min(begin + size, pairs)
                least = cut
                # This loop stores nothing, so that it is vectorized.
                for k in range(begin, end if chunk > 0 else begin):
                    p = np.uint64(first[k])
                    q = np.uint64(second[k])
                    rr = 0.0
                    for a in range(D):
                        r = x[a, q] - x[a, p]
                        r -= box[a] * np.rint(r * inverse[a])
                        rr += r * r
                    least = min(least, rr)
                if chunk > 0 and least >= cut:
                    continue
                for k in range(begin, end):
                    p = np.uint64(first[k])
                    q = np.uint64(second[k])
                    rr = 0.0
                    for a in range(D):
                        r = x[a, q] - x[a, p]
                        r -= box[a] * np.rint(r * inverse[a])
                        rr += r * r
                    if rr < cut:
                        tally[2] = min(tally[2], rr)
                        s = square / rr
                        s8 = s * s
                        s8 *= s8
                        s8 *= s8
                        s24 = s8 * s8 * s8
                        steep = strength * epsilon * s24 * s
                        flat = strength * epsilon * s24 * np.sqrt(s)
                        pull = 50.0 * steep - 49.0 * flat
                        virial += pull
                        potential += steep - flat + epsilon
                        for a in range(D):
                            r = x[a, q] - x[a, p]
                            r -= box[a] * np.rint(r * inverse[a])
                            f[a, p] -= pull / rr * r
                            f[a, q] += pull / rr * r
            tally[3] = potential
            if steps > 0:
                kinetic = 0.0
                for a in range(D):
                    for i in range(n):
                        v[a, i] += kick * f[a, i]
                        kinetic += v[a, i] * v[a, i]
                tally[0] += virial * step
                tally[1] += 0.5 * mass * kinetic * step
        return steps

    return compile_kept(verlet)
