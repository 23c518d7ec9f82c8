"""Caps on a sphere by the naive algorithm, in any number of digits: the earliest contact of all pairs is
approached in steps that the largest speed allows, and found by bisection.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

FINEST = 1e-6
"""Smallest step, as a change of the gap over the diameter. Grazing contacts that are shallower are lost."""


class Contact(NamedTuple):
    """The state just after a contact [time] of caps i and j: positions and velocities of all, (n, k), about
    the center of the sphere.
    """

    time: Any
    i: int
    j: int
    positions: list[list[Any]]
    velocities: list[list[Any]]


def caps(
    positions: Sequence[Sequence[float]],
    velocities: Sequence[Sequence[float]],
    diameter: float,
    *,
    growth: float = 0.0,
    digits: int = 50,
) -> Iterator[Contact]:
    """Yield one contact after the other of equal caps on the unit sphere, (n, k), which touch at the chord
    ``diameter``; ``growth`` is that of the diameter per time.
    """
    import mpmath

    mp = mpmath.mp.clone()  # a context of its own: the global precision stays
    mp.dps = digits
    mpf, fdot, sqrt = mp.mpf, mp.fdot, mp.sqrt
    x = [[mpf(float(c)) for c in row] for row in positions]
    x = [[c / sqrt(fdot(row, row)) for c in row] for row in x]
    v = [[mpf(float(c)) for c in row] for row in velocities]
    v = [[c - fdot(u, w) * a for c, a in zip(u, w, strict=True)] for u, w in zip(v, x, strict=True)]
    now, sigma, rate = mpf(0), mpf(diameter), mpf(growth)
    met: tuple[int, int] | None = None
    while True:
        best, who = mp.inf, None
        for i in range(len(x)):
            for j in range(i + 1, len(x)):
                t = _first(mp, x[i], v[i], x[j], v[j], sigma, rate, best, (i, j) == met)
                if t < best:
                    best, who = t, (i, j)
        assert who is not None, "caps that neither grow nor meet"
        x, v = map(list, zip(*(_flown(mp, a, b, best) for a, b in zip(x, v, strict=True)), strict=True))
        now, sigma, met = now + best, sigma + rate * best, who
        i, j = who
        c = fdot(x[i], x[j])
        s, half = sqrt(1 - c * c), sqrt((1 + c) / 2)
        ours = [(b - c * a) / s for a, b in zip(x[i], x[j], strict=True)]
        theirs = [(a - c * b) / s for a, b in zip(x[i], x[j], strict=True)]
        # The chord shrinks by the speeds towards each other, times the cosine of half the angle.
        change = (-(fdot(v[i], ours) + fdot(v[j], theirs)) * half - rate) / half
        v[i] = [a + change * b for a, b in zip(v[i], ours, strict=True)]
        v[j] = [a + change * b for a, b in zip(v[j], theirs, strict=True)]
        yield Contact(now, i, j, x, v)


def _flown(mp: Any, x: list[Any], v: list[Any], t: Any) -> tuple[list[Any], list[Any]]:
    """Return position and velocity of a cap after a time t."""
    w = mp.sqrt(mp.fdot(v, v))
    if w == 0:
        return x, v
    c, s = mp.cos(w * t), mp.sin(w * t)
    return (
        [a * c + b * s / w for a, b in zip(x, v, strict=True)],
        [b * c - a * w * s for a, b in zip(x, v, strict=True)],
    )


def _first(
    mp: Any,
    x: list[Any],
    v: list[Any],
    y: list[Any],
    u: list[Any],
    sigma: Any,
    rate: Any,
    limit: Any,
    parting: bool,
) -> Any:
    """Return the time until two touch, or infinity beyond a limit; two that are `parting` meet only after
    their gap was positive.
    """

    def gap(t: Any) -> Any:
        a, b = _flown(mp, x, v, t)[0], _flown(mp, y, u, t)[0]
        return mp.sqrt(sum((p - q) ** 2 for p, q in zip(a, b, strict=True))) - sigma - rate * t

    fastest = mp.sqrt(mp.fdot(v, v)) + mp.sqrt(mp.fdot(u, u)) + rate
    shortest = FINEST * sigma
    before = t = mp.mpf(0)
    while t <= limit:
        now = gap(t)
        if now > 0:
            parting = False
        elif not parting:
            break
        before, t = t, t + max(now, shortest) / fastest
    else:
        return mp.inf
    while t - before > 4 * mp.eps * (1 + t):
        middle = (before + t) / 2
        before, t = (middle, t) if gap(middle) > 0 else (before, middle)
    return t
