"""The naive algorithm for units with range rules, in high precision: a rule counts all units in its circles,
and events at the same time happen in the order of the units' numbers.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

from carom.errors import InputError
from helpers.naive.steps import NaiveSteps

ENTERED, LEFT, TIMER, CHANGED = 1, 2, 3, 4


class Decision(NamedTuple):
    """One event [time]: of the pair that crosses a distance (ENTERED, LEFT), or the unit whose rule is called
    (TIMER, CHANGED).
    """

    time: Any
    units: tuple[int, ...]
    cause: int


class NaiveRules(NaiveSteps):
    """Units of several kinds in a periodic box, with the radii of each kind's circles, rising, its timers and
    memory at the start, and ``rule(unit, event)``, which knows the names of ``carom.models.Ranges``.
    """

    def __init__(
        self,
        positions: Sequence[Sequence[Any]],
        velocities: Sequence[Sequence[Any]],
        box: Sequence[Any],
        circles: Sequence[Sequence[Any]],
        kinds: Sequence[int],
        rule: Callable[[Any, Any], None],
        *,
        timers: Sequence[Any],
        memory: Sequence[Sequence[Any]],
        seed: int = 0,
        digits: int = 50,
    ):
        radii = sorted({radius for each in circles for radius in each})
        flat = (radii, [0.0] * (len(radii) + 1))
        super().__init__(positions, velocities, box, lambda i, j: flat, digits=digits)
        self._radii, self._circles, self._rule = radii, circles, rule
        number = self._context.mpf
        self.units = [
            SimpleNamespace(
                kind=kind,
                timer=number(timers[kind]),
                memory=[number(m) for m in memory[kind]],
                target=-1,
                removed=False,
                number=i,
                seed=seed,
                drawn=0,
            )
            for i, kind in enumerate(kinds)
        ]
        self._news: dict[int, int] = {}

    def counts(self, i: int) -> dict[tuple[int, int], int]:
        """Return how many units of each kind are in each circle of unit i, by (circle, kind)."""
        found = {(c, k): 0 for c in range(max(map(len, self._circles))) for k in range(len(self._circles))}
        for (a, b), level in self.level.items():
            if i in (a, b) and not (self.units[a].removed or self.units[b].removed):
                other = self.units[b if a == i else a]
                for c, radius in enumerate(self._circles[self.units[i].kind]):
                    found[c, other.kind] += level <= self._radii.index(radius)
        return found

    def decide(self) -> Decision:
        """Realize the next event and return it."""
        zero = self._context.mpf(10) ** (-self._context.dps // 2)
        while True:
            fastest = max(abs(a) for row in self.v for a in row)
            # At rest nobody meets, and only a timer can run down.
            horizon = min(self._box) / (8 * fastest) if fastest else self._context.inf
            found = self._earliest(horizon) if fastest else None
            waits: list[Any] = [(self._context.mpf(0), i, None) for i in self._news]
            waits += [(unit.timer, unit.number, None) for unit in self.units if not unit.removed]
            if found is not None:
                waits.append((found[0], found[1], found))
            waits = [
                ((0 if wait < zero else wait), i, what)
                for wait, i, what in waits
                if wait <= horizon and self._context.isfinite(wait)
            ]
            if not (fastest or waits):
                raise InputError("Nothing follows: all units are at rest, and no timer runs.")
            wait, i, pair = min(waits, key=lambda each: each[:2]) if waits else (horizon, -1, None)
            for row, speed in zip(self.x, self.v, strict=True):
                for axis, a in enumerate(speed):
                    row[axis] += a * wait
            for unit in self.units:
                unit.timer -= wait
            self.time += wait
            if pair is not None:
                return self._meet(*pair[1:])
            if i >= 0:
                return self._alone(i)

    def _meet(self, i: int, j: int, r: list[Any], inwards: bool) -> Decision:
        """Let a pair cross a distance; call the rules of those whose circle has this radius."""
        level = self.level[i, j]
        crossed = self._radii[level - 1 if inwards else level]
        self.level[i, j] = level - 1 if inwards else level + 1
        cause = ENTERED if inwards else LEFT
        asked = []
        for me, other, sense in ((i, j, 1), (j, i, -1)):
            mine = list(self._circles[self.units[me].kind])
            if crossed in mine:
                toward = [sense * a for a in r]
                asked.append(self._prepared(me, cause, mine.index(crossed), other, toward))
        for unit, event in asked:
            self._rule(unit, event)
        for unit, _ in asked:
            self._settle(unit)
        return Decision(self.time, (i, j), cause)

    def _alone(self, i: int) -> Decision:
        """Call the rule of one unit, because another unit has changed or the timer is due."""
        unit = self.units[i]
        if i in self._news:
            cause, other = CHANGED, self._news.pop(i)
        else:
            cause, unit.timer = TIMER, self._context.inf
            if unit.target >= 0 and self.units[unit.target].removed:
                unit.target = -1
            other = unit.target
        toward = [self._context.mpf(0)] * len(self._box)
        if other >= 0:
            toward = self._nearest(i, other)
        self._rule(*(asked := self._prepared(i, cause, -1, other, toward)))
        self._settle(asked[0])
        return Decision(self.time, (i,), cause)

    def _prepared(self, i: int, cause: int, circle: int, other: int, toward: list[Any]) -> tuple[Any, Any]:
        """Return the arguments of the rule of unit i: the unit and the event."""
        unit = SimpleNamespace(**vars(self.units[i]))
        unit.position, unit.velocity, unit.counts = list(self.x[i]), list(self.v[i]), self.counts(i)
        unit.memory = list(unit.memory)
        event = SimpleNamespace(
            cause=cause, circle=circle, other=other, kind=self.units[other].kind if other >= 0 else -1,
            toward=toward, distance=self._context.sqrt(sum(a * a for a in toward)),
            velocity=list(self.v[other]) if other >= 0 else [self._context.mpf(0)] * len(self._box),
            time=self.time,
        )  # fmt: skip
        return unit, event

    def _settle(self, decided: Any) -> None:
        """Apply a unit's decision; notify units with it in a circle if it changes kind or is removed."""
        before = self.units[decided.number]
        number = self._context.mpf
        self.v[decided.number] = [number(0 if decided.removed else a) for a in decided.velocity]
        changed = decided.removed or decided.kind != before.kind
        for name in ("kind", "target", "removed", "drawn", "memory"):
            setattr(before, name, getattr(decided, name))
        before.timer = self._context.inf if decided.removed else number(decided.timer)
        if not changed:
            return
        for i, j in itertools.permutations(range(len(self.units)), 2):
            if j == decided.number and not self.units[i].removed:
                level = self.level[min(i, j), max(i, j)]
                radii = self._circles[self.units[i].kind]
                if any(level <= self._radii.index(radius) for radius in radii):
                    self._news[i] = j
        if decided.removed:
            self._news.pop(decided.number, None)
            for pair in [pair for pair in self._potential if decided.number in pair]:
                del self._potential[pair]  # type: ignore[attr-defined]
