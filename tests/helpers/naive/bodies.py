"""Bodies for the naive fall: convex hulls of a few corners, rounded, at rest or shaken along a line;
distances are the least from all segments and triangles, sampled, and normals numerical gradients.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np

from helpers.naive.falling import _zero

FLIGHT = 100
"""Samples at least while a particle at its fastest goes as far as its radius, or in a period."""


class Solid(NamedTuple):
    """The hull of corners, (k, d) numbers, within a distance, shaken as a floor; give it after floors that
    enclose the particles: it is looked at as far as they let these fly.
    """

    corners: Any
    rounding: Any = 0
    direction: tuple[Any, ...] = ()
    amplitude: Any = 0
    period: Any = 1

    def over(self, context: Any, radius: Any) -> _Body:
        """Return it with the numbers of an arithmetic, for particles of a radius."""
        return _Body(context, self, radius)


def square(x: Any, corners: Any) -> Any:
    """Return squares of distances from a hull, (m,), at places (m, d), for d up to 3 in any arithmetic."""
    best = ((x - corners[0]) ** 2).sum(axis=1)
    for a, b in itertools.combinations(corners, 2):
        u, r = b - a, x - a
        part = np.clip((r @ u) / (u @ u), 0 * u[0], 0 * u[0] + 1)
        best = np.minimum(best, ((r - part[:, None] * u) ** 2).sum(axis=1))
    for a, b, c in itertools.combinations(corners, 3):
        u, w, r = b - a, c - a, x - a
        uu, uw, ww, ru, rw = u @ u, u @ w, w @ w, r @ u, r @ w
        area = uu * ww - uw * uw
        if area <= 1e-12 * float(uu * ww):
            continue
        p, q = (ru * ww - rw * uw) / area, (rw * uu - ru * uw) / area
        above = ((r - p[:, None] * u - q[:, None] * w) ** 2).sum(axis=1)
        best = np.where((p >= 0) & (q >= 0) & (p + q <= 1), np.minimum(best, above), best)
    return best


class _Body:
    """A solid with the numbers of one arithmetic."""

    def __init__(self, context: Any, solid: Solid, radius: Any):
        number = np.vectorize(context.mpf, otypes=[object])
        self._context, self._corners = context, number(np.array(solid.corners, dtype=object))
        d = self._corners.shape[1]
        self._contact = context.mpf(solid.rounding) + radius
        self._direction = number(np.array(solid.direction or [0] * d, dtype=object))
        self._amplitude = context.mpf(solid.amplitude)
        self._turn = 2 * context.pi / context.mpf(solid.period)

    def throw(self, v: list[Any], now: Any, early: bool, x: list[Any]) -> None:
        """Replace a velocity by the one after the contact."""
        step = self._context.mpf(10) ** (-self._context.dps // 3)
        d, shift = len(x), self._direction * (self._amplitude * self._context.sin(self._turn * now))
        ways = step * np.concatenate([np.eye(d, dtype=int), -np.eye(d, dtype=int)])
        values = square(np.array(x, dtype=object) - shift + ways, self._corners)
        slope = values[:d] - values[d:]
        normal = slope / self._context.sqrt((slope**2).sum())
        pace = self._direction * (self._amplitude * self._turn * self._context.cos(self._turn * now))
        approach = (normal * (pace - np.array(v, dtype=object))).sum()
        v[:] = list(np.array(v, dtype=object) + 2 * approach * normal)

    def landing(self, x: list[Any], v: list[Any], g: list[Any], now: Any, limit: Any, just: bool) -> Any:
        """Return the time until a particle touches, or None if that is beyond a limit."""
        turn, at = float(self._turn), float(now)
        fx, fv, fg = (np.array(each, dtype=float) for each in (x, v, g))
        along, corners = self._direction.astype(float), self._corners.astype(float)
        fastest = np.linalg.norm(fv) + np.linalg.norm(fg) * float(limit) + turn * float(self._amplitude)
        step = min(float(self._contact) / fastest, 1.0 / turn if self._amplitude else np.inf) / FLIGHT
        end = float(limit) * (1 + 1e-9)

        def roughly(t: Any) -> Any:
            t = np.atleast_1d(t)[:, None]
            bob = float(self._amplitude) * np.sin(turn * (at + t)) * along
            return square(fx + (fv + fg * t / 2) * t - bob, corners) - float(self._contact) ** 2

        def height(t: Any) -> Any:
            bob = self._amplitude * self._context.sin(self._turn * (now + t)) * self._direction
            place = [a + (b + c * t / 2) * t for a, b, c in zip(x, v, g, strict=True)]
            return square((np.array(place, dtype=object) - bob)[None], self._corners)[0] - self._contact**2

        times = np.arange(0.0, end + step, step)
        values = roughly(times)
        first = int(np.argmax(np.diff(values) < 0)) if just else 0  # it has just been thrown off
        if just and not (np.diff(values) < 0).any():
            return None
        for k in range(first + 1, len(times)):
            low, high = times[k - 1], times[k]
            if values[k] > 0:
                if k + 1 == len(times) or not values[k - 1] > values[k] < values[k + 1]:
                    continue
                dip = np.linspace(times[k - 1], times[k + 1], 400)  # a minimum between two samples
                deep = roughly(dip)
                if deep.min() > 0:
                    continue
                high = dip[int(np.argmax(deep <= 0))]
            return _zero(height, self._context.mpf(low), self._context.mpf(high), self._context)
        return None
