"""The naive algorithm for pairs on steps: the earliest crossing of all pairs and images is found, all
particles are advanced to it, and a dictionary holds the step of each pair.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from carom.errors import InputError


class Crossing(NamedTuple):
    """One event [time] of a pair, i < j, and the momentum passed along the line of centers, positive if it
    pushes apart; it is thrown back on the way in ("core") or out ("bounce"), or crosses ("in", "out").
    """

    time: Any
    i: int
    j: int
    kind: str
    impulse: Any


class NaiveSteps:
    """Particles in a periodic box, wider than twice the largest distance, whose pairs have the rising
    distances and energies ``potential(i, j)``, i < j, on their way out ``leaving``; ``level`` counts the
    distances that a pair is beyond.
    """

    def __init__(
        self,
        positions: Sequence[Sequence[Any]],
        velocities: Sequence[Sequence[Any]],
        box: Sequence[Any],
        potential: Callable[[int, int], tuple[Sequence[Any], Sequence[Any]]],
        *,
        leaving: Callable[[int, int], tuple[Sequence[Any], Sequence[Any]]] | None = None,
        masses: Sequence[Any] | None = None,
        digits: int = 50,
    ):
        import mpmath

        self._context = mpmath.mp.clone()
        self._context.dps = digits
        number = self._context.mpf
        self.time = number(0)
        self.x = [[number(a) for a in row] for row in positions]
        self.v = [[number(a) for a in row] for row in velocities]
        self._box = [number(a) for a in box]
        self._masses = [number(m) for m in ([1] * len(self.x) if masses is None else masses)]
        self._potential: Mapping[tuple[int, int], Any] = {}
        self.level: dict[tuple[int, int], int] = {}
        potentials = {}
        for pair in itertools.combinations(range(len(self.x)), 2):
            distances, energies = potential(*pair)
            _, out = potential(*pair) if leaving is None else leaving(*pair)
            if len(energies) != len(distances) + 1 or len(out) != len(energies):
                raise InputError(
                    f"The pair {pair} needs one energy more than its {len(distances)} distances."
                )
            if 2 * max(distances) >= min(self._box):
                raise InputError(f"The box must be wider than twice the distance {max(distances)}.")
            potentials[pair] = ([number(s) for s in distances], energies, out)
            near = self._nearest(*pair)
            apart = self._context.sqrt(sum(a * a for a in near))
            self.level[pair] = sum(1 for s in distances if apart >= s)
        self._potential = potentials

    @property
    def energy(self) -> Any:
        """Kinetic plus potential energy."""
        kinetic = sum(m * a * a / 2 for m, row in zip(self._masses, self.v, strict=True) for a in row)
        return kinetic + sum(self._potential[pair][1][level] for pair, level in self.level.items())

    def _nearest(self, i: int, j: int) -> list[Any]:
        """Return the nearest image of j relative to i."""
        half = self._context.mpf(1) / 2
        apart = [b - a for a, b in zip(self.x[i], self.x[j], strict=True)]
        return [
            r - edge * self._context.floor(r / edge + half) for r, edge in zip(apart, self._box, strict=True)
        ]

    def step(self) -> Crossing | None:
        """Realize the next event and return it, or None if nothing moves."""
        while True:
            fastest = max(abs(a) for row in self.v for a in row)
            if fastest == 0:
                return None
            # In this time no pair moves, relative to each other, by more than a quarter of the shortest edge
            # along any axis.
            horizon = min(self._box) / (8 * fastest)
            found = self._earliest(horizon)
            wait = horizon if found is None else found[0]
            for row, speed in zip(self.x, self.v, strict=True):
                for axis, a in enumerate(speed):
                    row[axis] += a * wait
            self.time += wait
            if found is not None:
                return self._cross(*found[1:])

    def _earliest(self, horizon: Any) -> tuple[Any, int, int, list[Any], bool] | None:
        """Return when the next pair crosses a distance, which one, its separation, and whether inwards."""
        best = None
        for (i, j), (distances, _, _) in self._potential.items():
            level = self.level[i, j]
            relative = [b - a for a, b in zip(self.v[i], self.v[j], strict=True)]
            speed = math.sqrt(float(sum(u * u for u in relative)))
            near = self._nearest(i, j)
            outermost = level == len(distances)
            # A pair beyond all steps may meet through another image than the nearest one.
            offsets = itertools.product((-1, 0, 1), repeat=len(near)) if outermost else [(0,) * len(near)]
            for offset in offsets:
                r = [a + edge * k for a, edge, k in zip(near, self._box, offset, strict=True)]
                far = math.sqrt(float(sum(a * a for a in r))) - speed * float(horizon)
                if outermost and far > 1.001 * float(distances[-1]):
                    continue
                for inwards in (True, False):
                    if (level == 0) if inwards else outermost:
                        continue
                    wait = self._when(r, relative, distances[level - 1 if inwards else level], inwards)
                    if wait is not None and wait <= horizon and (best is None or wait < best[0]):
                        there = [a + u * wait for a, u in zip(r, relative, strict=True)]
                        best = wait, i, j, there, inwards
        return best

    def _when(self, r: list[Any], u: list[Any], distance: Any, inwards: bool) -> Any:
        """Return when |r + u t| reaches a distance from this side, or None."""
        a = sum(k * k for k in u)
        b = sum(k * l for k, l in zip(r, u, strict=True))
        c = sum(k * k for k in r) - distance * distance
        if a == 0 or (inwards and b >= 0):
            return None
        square = b * b - a * c
        if square < 0:
            return None if inwards else self._context.mpf(0)
        root = self._context.sqrt(square)
        return max((-b - root if inwards else -b + root) / a, self._context.mpf(0))

    def _cross(self, i: int, j: int, r: list[Any], inwards: bool) -> Crossing:
        """Let a pair that has reached a distance cross it, or throw it back."""
        _, into, out = self._potential[i, j]
        level = self.level[i, j]
        target = level - 1 if inwards else level + 1
        energies = into if inwards else out
        length = self._context.sqrt(sum(k * k for k in r))
        normal = [k / length for k in r]
        speed = sum((b - a) * k for a, b, k in zip(self.v[i], self.v[j], normal, strict=True))
        reduced = self._masses[i] * self._masses[j] / (self._masses[i] + self._masses[j])
        passes = not math.isinf(energies[target])
        if passes:
            left = speed * speed - 2 * (self._context.mpf(energies[target]) - energies[level]) / reduced
            passes = left >= 0
        if passes:
            after = -self._context.sqrt(left) if inwards else self._context.sqrt(left)
            self.level[i, j] = target
        else:
            after = abs(speed) if inwards else -abs(speed)
        impulse = reduced * (after - speed)
        for axis, k in enumerate(normal):
            self.v[i][axis] -= impulse * k / self._masses[i]
            self.v[j][axis] += impulse * k / self._masses[j]
        kind = ("in" if passes else "core") if inwards else ("out" if passes else "bounce")
        return Crossing(self.time, i, j, kind, impulse)
