"""The naive algorithm for pairs on steps: a plain dictionary holds the step of each pair.

The earliest crossing of a distance, of all pairs and all periodic images, is found. All particles are
advanced to it, the two exchange momentum, and the search starts over. With 50 digits the order of hundreds of
events is correct. It shares nothing with the engine.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from carom.errors import InputError


class Crossing(NamedTuple):
    """One event of a pair.

    Attributes
    ----------
    time : number
        Time of the event [time].
    i, j : int
        The pair, i < j.
    kind : {"core", "in", "out", "bounce"}
        Thrown back on the way in, crossed inwards, crossed outwards, thrown back on the way out.
    impulse : number
        Momentum passed along the line of centers, positive if it pushes them apart.
    """

    time: Any
    i: int
    j: int
    kind: str
    impulse: Any


class NaiveSteps:
    """Particles in a periodic box whose pairs have energies that are constant between distances.

    Parameters
    ----------
    positions, velocities : (n, d) nested sequences
        Centers [length] and velocities [length / time].
    box : sequence of d numbers
        Edges [length], above twice the largest distance.
    potential : callable
        ``potential(i, j)`` returns, for i < j, the rising distances of the pair and its energies: one inside
        each distance, and one beyond the last.
    leaving : callable, optional
        The same, with the energies that a pair feels on its way out.
    masses : sequence of n numbers, optional
        All 1 if omitted.
    digits : int
        Decimal digits of the arithmetic; 15 is that of doubles.

    Attributes
    ----------
    level : dict of (i, j) to int
        How many of its distances each pair is beyond: 0 is the innermost step.
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
        """Realise the next event and return it, or None if nothing moves."""
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
