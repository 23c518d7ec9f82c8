"""Time-driven stepping, compiled: the method with which Lubachevsky (1991) compares his algorithm.

After each step, pairs that overlap and approach exchange momentum, the earliest contact first.
``tests/helpers/naive/stepping.py`` has the same rules, written for readability.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from carom.baselines.listed import ListedSpheres
from carom.baselines.pairs import compile_kept


class Stepper(ListedSpheres):
    """Equal hard spheres in a periodic box of at least two diameters, advanced by a fixed ``step`` [time].

    ``skin`` [diameters] is that of the list of pairs, by default the fastest.
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
        skin: float | None = None,
    ):
        super().__init__(
            positions,
            velocities,
            box,
            step=step,
            diameter=diameter,
            mass=mass,
            tally=np.array([0.0, 0.0, float(diameter) ** 2]),  # collisions, virial, smallest distance squared
            settings={"step": step, "diameter": diameter, "mass": mass},
        )
        self._log_pairs, self._log_times = np.empty((0, 2), np.int64), np.empty(0)
        self.skin = self._tuned(skin)

    @property
    def collisions(self) -> int:
        """Collisions so far."""
        return int(self._tally[0])

    @property
    def virial(self) -> float:
        """Sum of ``r_ij . dp_ij`` so far [mass length^2 / time], with r_ij at which a pair was found."""
        return self.mass * float(self._tally[1])

    @property
    def worst_overlap(self) -> float:
        """Deepest overlap found after a step [diameters]."""
        return max(1.0 - math.sqrt(float(self._tally[2])) / self.diameter, 0.0)

    def run(self, steps: int, *, log: bool = False) -> list[tuple[float, int, int]]:
        """Make ``steps`` steps; with ``log`` return the time and the two components of each collision."""
        found: list[tuple[float, int, int]] = []
        move = _move(len(self.box))
        left = steps
        while left:
            if self._slack < 0.0:
                self._list_pairs(self.diameter, self.skin, 1.01)
            room = 4 * self._x.shape[1] if log else 0
            if len(self._log_times) != room:
                self._log_pairs, self._log_times = np.empty((room, 2), np.int64), np.empty(room)
            made, logged = move(
                self._x, self._v, self._listed, self._pairs.first, self._pairs.second, self.box,
                1.0 / self.box, self.step, left, self.diameter**2, self._slack, self._tally,
                self._log_pairs, self._log_times, self._chunk,
            )  # fmt: skip
            for k in range(logged):
                i, j = (int(self._order[one]) for one in self._log_pairs[k])
                found.append((self.time + float(self._log_times[k]) * self.step, i, j))
            self.steps += made
            left -= made
            if left:
                self._slack = -1.0
        return found


@lru_cache
def _move(dimension: int) -> Any:
    """Return the compiled time-driven steps."""
    D = dimension

    def move(
        x,
        v,
        listed,
        first,
        second,
        box,
        inverse,
        step,
        steps,
        square,
        slack,
        tally,
        log_pairs,
        log_times,
        chunk,
    ):
        """Make steps until the list is no longer valid, or the log is half full.

        Returns the number of steps and the number of logged collisions.
        """
        n = x.shape[1]
        pairs = len(first)
        size = chunk if chunk > 0 else max(pairs, 1)
        logging = len(log_times) > 0
        logged = 0
        hits = np.empty(16, np.int64)
        ago = np.empty(16, np.float64)
        fastest = 0.0
        safe = np.int64(0)  # steps during which the list surely stays valid
        for made in range(steps):
            if safe == 0:
                furthest = 0.0
                fastest = 0.0
                for i in range(n):
                    moved = 0.0
                    speed = 0.0
                    for a in range(D):
                        r = x[a, i] - listed[a, i]
                        moved += r * r
                        speed += v[a, i] * v[a, i]
                    furthest = max(furthest, moved)
                    fastest = max(fastest, speed)
                left = (slack / 2 - np.sqrt(furthest)) / (np.sqrt(fastest) * step)
                safe = np.int64(max(min(left, 1e9), 0.0))
                if safe == 0:
                    return made, logged
            if logging and logged > len(log_times) // 2:
                return made, logged
            safe -= 1
            for a in range(D):
                for i in range(n):
                    x[a, i] += v[a, i] * step
            found = 0
            for begin in range(0, pairs, size):
                end = min(begin + size, pairs)
                least = square
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
                if chunk > 0 and least >= square:
                    continue
                for k in range(begin, end):
                    p = np.uint64(first[k])
                    q = np.uint64(second[k])
                    rr = 0.0
                    for a in range(D):
                        r = x[a, q] - x[a, p]
                        r -= box[a] * np.rint(r * inverse[a])
                        rr += r * r
                    if rr < square:
                        tally[2] = min(tally[2], rr)
                        if found == len(hits):
                            hits = np.concatenate((hits, np.empty_like(hits)))
                            ago = np.concatenate((ago, np.empty_like(ago)))
                        rv = 0.0
                        vv = 0.0
                        for a in range(D):
                            r = x[a, q] - x[a, p]
                            r -= box[a] * np.rint(r * inverse[a])
                            u = v[a, q] - v[a, p]
                            rv += r * u
                            vv += u * u
                        c = rr - square
                        # Time of contact, back along straight lines; a pair at rest has always overlapped.
                        way = np.sqrt(max(rv * rv - vv * c, 0.0)) - rv
                        hits[found] = k
                        ago[found] = c / way if way > 0.0 else -1e300
                        found += 1
            if found == 0:
                continue
            order = np.argsort(ago[:found], kind="mergesort")
            for h in order:
                k = hits[h]
                p = np.uint64(first[k])
                q = np.uint64(second[k])
                rr = 0.0
                rv = 0.0
                for a in range(D):
                    r = x[a, q] - x[a, p]
                    r -= box[a] * np.rint(r * inverse[a])
                    rr += r * r
                    rv += r * (v[a, q] - v[a, p])
                if rv >= 0:
                    continue
                factor = rv / rr
                for a in range(D):
                    r = x[a, q] - x[a, p]
                    r -= box[a] * np.rint(r * inverse[a])
                    v[a, p] += factor * r
                    v[a, q] -= factor * r
                mine = 0.0
                other = 0.0
                for a in range(D):
                    mine += v[a, p] * v[a, p]
                    other += v[a, q] * v[a, q]
                if max(mine, other) > fastest:
                    safe = np.int64(0)
                tally[0] += 1
                tally[1] -= rv
                if logging and logged < len(log_times):
                    log_pairs[logged, 0] = p
                    log_pairs[logged, 1] = q
                    log_times[logged] = made + 1 - min(-ago[h] / step, 1.0)
                    logged += 1
        return steps, logged

    return compile_kept(move)
