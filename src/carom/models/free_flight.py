"""How a component moves between its events: the paper's ``advance``."""

from __future__ import annotations

from typing import NamedTuple

from carom.compiling.dispatch import generic


class FreeFlight(NamedTuple):
    """Uniform motion along straight lines."""

    inertial: bool = True
    """Always true: the frame of reference is inertial (Numba has no empty tuples of its own class)."""


@generic
def position(motion, axis, x, v, t):
    """Return the coordinate a time ``t`` later; ``t`` may be negative."""
    raise NotImplementedError(type(motion))


@position.register
def _(motion: FreeFlight, axis, x, v, t):
    return x + v * t


@generic
def velocity(motion, axis, v, t):
    """Return the velocity's coordinate a time ``t`` later."""
    raise NotImplementedError(type(motion))


@velocity.register
def _(motion: FreeFlight, axis, v, t):
    return v
