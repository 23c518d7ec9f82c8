"""The next time at which a smooth function is <= 0 and falling, with a proof that none before it is missed.

A *curve* is a model that answers its value f, its slope s, and a bound K on its second derivative.
From f > 0 it stays above ``f + s t - K t^2 / 2``: the search goes from one root of that to the next. Once K
proves that the slope keeps its sign, the root is alone in a bracket, which is narrowed to two neighboring
doubles. Where f <= 0 but not falling (a contact just processed), it cannot fall before ``s / K``. "<= 0 and
falling" is the stable event of Bannerman et al. (J. Chem. Phys. 141 (2014) 041101): it covers contacts,
grazes and overlaps by rounding.
"""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import Questions
from carom.models.interfaces.particles import NEVER

WIDER = 4.0  # the next interval over which K is asked for is so many times as long as the last step

SHORTEST = 2.0**-50
"""Part of the time searched by which a search goes on at least: two zeros nearer than that are one."""


class Curve(Questions):
    """A smooth function of time."""

    def value(self, t):
        """Return the function at the time t."""
        raise NotImplementedError

    def slope(self, t):
        """Return its first derivative at the time t."""
        raise NotImplementedError

    def curvature(self, start, end):
        """Return a bound on the second derivative between two times, finite between finite ones."""
        raise NotImplementedError


def next_fall(curve, limit):
    """Return the first time from 0 to a finite ``limit`` at which a curve is <= 0 and falling, or NEVER.

    It is 0 where that is so now. Else the function is > 0 at the double before, or begins to fall there: none
    is passed but for rounding of the values. The fewer zeros, the more steps to the limit.
    """
    t = 0.0
    window = limit
    least = SHORTEST * limit
    while t <= limit:
        f, s = curve.value(t), curve.slope(t)
        if f <= 0.0 and s < 0.0:
            return t
        window = min(window, limit - t)
        bound = curve.curvature(t, t + window)
        if f > 0.0:
            newton = f / -s if s < 0.0 else NEVER
            if 2.0 * newton <= window and 2.0 * bound * newton <= -s:
                return bracketed(curve, t, t + 2.0 * newton, newton)
            root = np.sqrt(s * s + 2.0 * bound * f)
            slow = (s + root) / bound if bound > 0.0 else NEVER
            step = 2.0 * f / (root - s) if s < 0.0 else slow
        else:
            step = s / bound if bound > 0.0 else NEVER
        step = max(min(step, window), least)
        t += max(step, np.spacing(t))
        window = WIDER * step
    return NEVER


def bracketed(curve, low, high, newton):
    """Return where a function falling from ``low`` to ``high`` is <= 0, but > 0 at the double before."""
    t = low + newton
    for _ in range(8):  # quadratic from here: fewer are used
        f, s = curve.value(t), curve.slope(t)
        if f > 0.0:
            low = max(low, t)
        else:
            high = min(high, t)
        ahead = t - f / s if s < 0.0 else t
        done = abs(ahead - t) <= 4.0 * np.spacing(t)
        t = min(max(ahead, low), high)
        if done:
            break
    # Newton's method comes from one side, and leaves the other end of the bracket where it was.
    resolution = 2.0 * np.spacing(t)
    while low < t - resolution:
        if curve.value(t - resolution) > 0.0:
            low = t - resolution
            break
        high = t - resolution
        resolution *= 4.0
    resolution = 2.0 * np.spacing(t)
    while high > t + resolution:
        if curve.value(t + resolution) <= 0.0:
            high = t + resolution
            break
        low = t + resolution
        resolution *= 4.0
    while True:
        middle = low + 0.5 * (high - low)
        if not low < middle < high:
            return high
        if curve.value(middle) > 0.0:
            low = middle
        else:
            high = middle
