"""The naive algorithm in a uniform field, over planes that may be shaken: all particles are advanced to every
event, heights are sampled in doubles, and their zeros enclosed with all digits.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

STEPS = 400
"""Samples of the height above a plane, in a period or in a flight."""


class Floor(NamedTuple):
    """A plane ``normal . x >= offset``, normal a unit vector, which ``amplitude sin(2 pi t / period)`` shifts
    along its normal [length, time].
    """

    normal: tuple[Any, ...]
    offset: Any
    amplitude: Any = 0
    period: Any = 1
    restitution: Any = 1

    def over(self, context: Any, radius: Any) -> _Plane:
        """Return it with the numbers of an arithmetic, for particles of a radius."""
        return _Plane(context, self, radius)


class Event(NamedTuple):
    """The state just after an event of particles i and j, where ``n + k`` is floor k; positions are not
    wrapped.
    """

    time: Any
    i: int
    j: int
    positions: list[list[Any]]
    velocities: list[list[Any]]


def fall(
    positions: Sequence[Sequence[Any]],
    velocities: Sequence[Sequence[Any]],
    g: Sequence[Any],
    floors: Sequence[Any],
    *,
    box: Sequence[Any] = (),
    diameter: Any = 1,
    restitution: Any = 1,
    contact_time: Any = 0,
    bonds: Mapping[tuple[int, int], Any] | None = None,
    digits: int = 40,
) -> Iterator[Event]:
    """Yield one event after the other of particles, (n, d), of equal masses under the acceleration ``g``;
    ``box`` has 0 for axes that are not periodic, and a contact loses no energy where one of the pair had one
    within ``contact_time`` (with a floor: with that floor); ``bonds`` has the largest distance of pairs that
    cannot part, i < j.
    """
    import mpmath

    context = mpmath.mp.clone()
    context.dps = digits
    number = context.mpf
    x = [[number(each) for each in row] for row in positions]
    v = [[number(each) for each in row] for row in velocities]
    field = [number(each) for each in g]
    edges = [number(each) for each in box] or [number(0)] * len(field)
    size, kept, soon = number(diameter), number(restitution), number(contact_time)
    planes = [floor.over(context, size / 2) for floor in floors]
    n, d, now = len(x), len(field), number(0)
    recent: dict[Any, Any] = {}
    longest = {pair: number(each) for pair, each in (bonds or {}).items()}
    met: Any = None
    while True:
        best: Any = math.inf
        who: Any = None
        for i, k in itertools.product(range(n), range(len(planes))):
            t = planes[k].landing(x[i], v[i], field, now, best, met == (i, n + k))
            if t is not None and t < best:
                best, who = t, (i, n + k)
        if best == math.inf and any(edges):
            raise ValueError("Nobody falls on a floor: pairs could meet after any number of boxes.")
        for i, j in itertools.combinations(range(n), 2):
            r, u = _minus(x[j], x[i]), _minus(v[j], v[i])
            if (i, j) in longest:
                t = _parting(r, u, longest[i, j], context)
                if t is not None and t < best:
                    best, who = t, (i, j)
            for shift in itertools.product(*map(_shifts, r, u, edges, [best] * d, [size] * d)):
                t = _contact([a + b for a, b in zip(r, shift, strict=True)], u, size, context)
                if t is not None and t < best and not (met == (i, j) and t < number(10) ** (8 - digits)):
                    best, who = t, (i, j)
        if who is None:
            return
        for i, axis in itertools.product(range(n), range(d)):
            x[i][axis] += (v[i][axis] + field[axis] * best / 2) * best
            v[i][axis] += field[axis] * best
        now += best
        i, j = who
        if j >= n:
            plane = planes[j - n]
            early = soon > 0 and now - recent.get((i, j), -math.inf) < soon
            recent[i, j] = now
            plane.throw(v[i], now, early, x[i])
        else:
            early = soon > 0 and now - max(recent.get(i, -math.inf), recent.get(j, -math.inf)) < soon
            recent[i] = recent[j] = now
            r = _minus(x[j], x[i])
            r = [a - e * context.nint(a / e) if e else a for a, e in zip(r, edges, strict=True)]
            along = sum(a * b for a, b in zip(r, _minus(v[j], v[i]), strict=True)) / sum(a * a for a in r)
            part = (1 + (number(1) if early else kept)) / 2
            for axis in range(d):
                v[i][axis] += part * along * r[axis]
                v[j][axis] -= part * along * r[axis]
        met = who
        yield Event(now, i, j, [list(row) for row in x], [list(row) for row in v])


def over_a_floor(scene: Any, *floor: Any, **more: Any) -> Iterator[Event]:
    """Yield the events of a scene between walls along its last axis, over a floor there: ``floor`` is what
    :class:`Floor` takes after its normal, and ``more`` is handed to :func:`fall`.
    """
    across = (0,) * (scene.dimension - 1)
    floors = [Floor((*across, 1), 0), Floor((*across, -1), -scene.box[-1]), Floor((*across, 1), *floor)]
    places, velocities = scene.positions.tolist(), scene.velocities.tolist()
    return fall(places, velocities, scene.motion.g, floors, box=(*scene.box[:-1], 0), **more)


def _minus(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    return [p - q for p, q in zip(a, b, strict=True)]


def _shifts(r: Any, u: Any, edge: Any, time: Any, size: Any) -> list[Any]:
    """Return the shifts, by whole edges, with which two come within `size` along an axis before `time`."""
    if not edge:
        return [edge]
    low, high = min(r, r + u * time) - size, max(r, r + u * time) + size
    return [edge * turn for turn in range(math.ceil(-high / edge), math.floor(-low / edge) + 1)]


def _contact(r: Sequence[Any], u: Sequence[Any], size: Any, context: Any) -> Any:
    """Return the time until two touch that move uniformly relative to each other, or None."""
    rr, ru, uu = (sum(p * q for p, q in zip(a, b, strict=True)) for a, b in ((r, r), (r, u), (u, u)))
    if ru >= 0:
        return None
    root = ru * ru - uu * (rr - size * size)
    return None if root < 0 else max((rr - size * size) / (context.sqrt(root) - ru), context.mpf(0))


def _parting(r: Sequence[Any], u: Sequence[Any], longest: Any, context: Any) -> Any:
    """Return the time until two are ``longest`` apart, or None if they rest relative to each other."""
    rr, ru, uu = (sum(p * q for p, q in zip(a, b, strict=True)) for a, b in ((r, r), (r, u), (u, u)))
    left = longest * longest - rr
    if uu == 0:
        return None
    root = context.sqrt(ru * ru + uu * max(left, 0))
    return max((root - ru) / uu, context.mpf(0))


class _Plane:
    """A floor with the numbers of one arithmetic."""

    def __init__(self, context: Any, floor: Floor, radius: Any):
        number = context.mpf
        self._context, self._radius = context, radius
        self._normal = [number(each) for each in floor.normal]
        self._offset, self._amplitude = number(floor.offset), number(floor.amplitude)
        self._turn = 2 * context.pi / number(floor.period)
        self._period, self._kept = float(floor.period), number(floor.restitution)

    def throw(self, v: list[Any], now: Any, early: bool, x: list[Any]) -> None:
        """Replace a velocity by the one after the contact."""
        surface = self._amplitude * self._turn * self._context.cos(self._turn * now)
        approach = surface - sum(a * b for a, b in zip(self._normal, v, strict=True))
        kept = self._context.mpf(1) if early else self._kept
        for axis, a in enumerate(self._normal):
            v[axis] += (1 + kept) * approach * a

    def landing(self, x: list[Any], v: list[Any], g: list[Any], now: Any, limit: Any, just: bool) -> Any:
        """Return the time until a particle touches that has not `just` touched, or None if that is beyond a
        limit.
        """
        h = sum(a * b for a, b in zip(self._normal, x, strict=True)) - self._offset - self._radius
        u = sum(a * b for a, b in zip(self._normal, v, strict=True))
        b = sum(a * c for a, c in zip(self._normal, g, strict=True))
        sin, cos = self._context.sin, self._context.cos

        def height(t: Any) -> Any:
            return h + (u + b * t / 2) * t - self._amplitude * sin(self._turn * (now + t))

        def rate(t: Any) -> Any:
            return u + b * t - self._amplitude * self._turn * cos(self._turn * (now + t))

        flight = _longest(float(h), float(u), float(b), float(self._amplitude))
        if flight is None:
            return None
        end = min(flight, float(limit) * (1 + 1e-9))
        step = min(self._period if self._amplitude else flight, flight) / STEPS
        ha, ua, ba, amp, turn, at = (float(z) for z in (h, u, b, self._amplitude, self._turn, now))

        def roughly(t: float) -> tuple[float, float]:
            """Return height and rate in doubles."""
            angle = turn * (at + t)
            bob = amp * math.sin(angle) if amp else 0.0
            return ha + (ua + ba * t / 2) * t - bob, ua + ba * t - (
                amp * turn * math.cos(angle) if amp else 0
            )

        t, rising = 0.0, just
        while t < end:
            value, slope = roughly(t + step)
            if rising and slope > 0:  # it has just been thrown up, and still rises
                t += step
                continue
            low, high = self._context.mpf(t), self._context.mpf(t + step)
            if value > 0 and slope > 0 and roughly(t)[1] < 0:  # a minimum between two samples
                high = _zero(lambda s: -rate(s), low, high, self._context)
                if height(high) > 0:
                    t += step
                    continue
            elif value > 0:
                rising = False
                t += step
                continue
            if rising:  # it falls from the highest point on
                low = _zero(rate, low, high, self._context) if rate(low) > 0 else low
                rising = False
            return _zero(height, low, high, self._context)
        return None


def _longest(h: float, u: float, b: float, amplitude: float) -> float | None:
    """Return a time by which a particle has certainly touched a plane, or does not come back; None if it
    never does.
    """
    if b < 0:
        return (u + math.sqrt(u * u - 2 * b * (h + amplitude + 1e-9))) / -b + 1e-9
    if b == 0 and u < 0:
        return (h + amplitude) / -u + 1e-9
    root = u * u - 2 * b * (h - amplitude)
    if root < 0 or (b == 0 and u == 0):
        return None
    last = (math.sqrt(root) - u) / b if b > 0 else (amplitude - h) / u
    return last if last > 0 else None


def _zero(function: Any, low: Any, high: Any, context: Any) -> Any:
    """Return the zero between ``low`` and ``high`` of a function that is positive before it."""
    while high - low > context.mpf(10) ** (2 - context.dps) * max(abs(high), context.mpf(1)):
        middle = (low + high) / 2
        if function(middle) > 0:
            low = middle
        else:
            high = middle
    return high
