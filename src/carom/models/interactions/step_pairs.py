"""Pairs on steps: a potential constant between distances (Alder, Wainwright, J. Chem. Phys. 31 (1959) 459).

The *step* of a pair is stored, changes at its own events only, and is never derived from a distance: rounding
cannot make it wrong. Numbers grow inwards: crossing an inner distance adds 1.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from carom.models.interfaces.memory import kept, parameter
from carom.models.interfaces.particles import NEVER
from carom.models.interfaces.steps import BOUNCE, CORE, IN, OUT, SteppedModel
from carom.models.mathematics.contact import shares


class StepPairs(SteppedModel):
    """What the engine compiles: for every step, where it ends and what crossing its ends costs."""

    inner: np.ndarray
    """Square of the distance at which each step ends inwards, negative where it does not [length^2]."""
    outer: np.ndarray
    """Square of the distance at which it ends outwards, or infinity [length^2]."""
    enter: Annotated[np.ndarray, parameter(-2)]
    """Energy that crossing the inner end takes, infinite at a wall [energy]."""
    leave: Annotated[np.ndarray, parameter(-2)]
    """Energy that crossing the outer end takes [energy]."""
    energy: Annotated[np.ndarray, parameter(-2)]
    """Potential energy of a pair on each step [energy]."""
    events: Annotated[np.ndarray, kept()]
    """How many events there were on each step, of each kind, (steps, 4) int64."""
    radii: np.ndarray
    """Of the components at obstacles, (n + 1,) float64 [length]."""
    masses: np.ndarray
    """(n + 1,) float64."""

    def step_time(self, i, j, step, rr, rv, vv, now):
        return end_of_step(self.inner[step], self.outer[step], rr, rv, vv)

    def step_jump(self, i, j, step, rr, rv, now):
        inwards = rr - self.inner[step] <= self.outer[step] - rr
        cost = self.enter[step] if inwards else self.leave[step]
        return cross(self, i, j, step, rr, rv, inwards, cost)

    def step_core_square(self, step):
        return max(self.inner[step], 0.0) if self.enter[step] == NEVER else 0.0


def end_of_step(low, high, rr, rv, vv):
    """Return the time until r.r is ``low``, if it gets there, or else ``high``; not negative, or NEVER.

    A step that does not end inwards has a negative ``low``, one that does not end outwards ``high = NEVER``.
    """
    # One root serves both ends: the inner one if the pair falls on it, else the outer one.
    above_low = rr - low
    falls = (rv < 0.0) & (rv * rv - vv * above_low >= 0.0)
    c = above_low if falls else rr - high
    root = np.sqrt(max(rv * rv - vv * c, 0.0))
    # Of the two forms of a root the one that does not cancel.
    above = c if falls else (-c if rv > 0.0 else root - rv)
    below = root - rv if falls else (root + rv if rv > 0.0 else vv)
    t = above / below
    return max(t, 0.0) if falls | ((high < NEVER) & (vv > 0.0)) else NEVER


def cross(pair, i, j, step, rr, rv, inwards, cost):
    """Return what happens to a pair at an end of its step: it crosses, or is thrown back.

    Parameters
    ----------
    pair : model
        With ``masses``.
    i, j : int
        The particles.
    step : int
        On which they are.
    rr, rv : float
        r.r [length^2] and r.v.
    inwards : bool
        Whether this is the inner end: the next step is ``step + 1``, and ``step - 1`` at the outer one.
    cost : float
        Energy that crossing takes, infinite at a wall [energy].

    Returns
    -------
    a, b, virial : float
        As from ``jump``.
    step : int
        The step that the pair is on from now on.
    kind : int
        CORE, IN, OUT or BOUNCE.
    """
    sense = -1.0 if inwards else 1.0
    ours, theirs = pair.masses[i], pair.masses[j]
    reduced = ours * theirs / (ours + theirs)
    # (r.v)^2 changes by this much where the pair crosses.
    change = 2.0 * cost * rr / reduced
    left = rv * rv - change
    if left >= 0.0:
        both = rv + sense * np.sqrt(left)
        share_lost = change / both if both != 0.0 else 0.0
        kind = IN if inwards else OUT
        step = step + 1 if inwards else step - 1
    else:
        share_lost = rv + sense * abs(rv)
        kind = CORE if inwards else BOUNCE
    a, b = shares(ours, theirs, rr, share_lost)
    return a, b, -reduced * share_lost, step, kind
