"""The naive algorithm for any model, whose functions are called as plain Python, in doubles.

The earliest interaction of all pairs and near images is found, all particles are advanced to it, two
velocities jump, and the search starts over. It tests the engine, not the model.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np


class Step(NamedTuple):
    """The state just after an interaction.

    Attributes
    ----------
    time : float
        Time of the interaction [time].
    i, j : int
        The two particles.
    positions, velocities : (n, d) arrays
        Unwrapped positions [length] and velocities [length / time] of all particles.
    """

    time: float
    i: int
    j: int
    positions: np.ndarray
    velocities: np.ndarray


def follow(
    positions: np.ndarray,
    velocities: np.ndarray,
    box: tuple[float, ...],
    *,
    interaction_time: Callable[..., Any],
    jump: Callable[..., Any],
    position: Callable[..., Any] = lambda axis, x, v, t: x + v * t,
    velocity: Callable[..., Any] = lambda axis, v, t: v,
    transfer: Callable[..., Any] = lambda rr, rv: 1.0,
) -> Iterator[Step]:
    """Yield one interaction after the other, in a periodic box.

    Parameters
    ----------
    positions, velocities : (n, d) arrays
        Positions [length] and velocities [length / time] at the start.
    box : tuple of d floats
        Edges [length].
    interaction_time, jump, position, velocity, transfer : callables
        The questions of ``carom.models.interfaces``, without the model: ``interaction_time(i, j, rr, rv,
        vv)``, ``jump(i, j, rr, rv)``, ``position(axis, x, v, t)``, ``velocity(axis, v, t)`` and
        ``transfer(rr, rv)``.

    Examples
    --------
    Hard disks of diameter 1:

    >>> def meet(i, j, rr, rv, vv):
    ...     root = rv * rv - vv * (rr - 1.0)
    ...     return (rr - 1.0) / (-rv + root**0.5) if rv < 0.0 <= root else float("inf")
    >>> bounce = lambda i, j, rr, rv: (rv / rr, rv / rr, -rv)
    >>> run = follow([[1, 1], [4, 1]], [[1, 0], [0, 0]], (8, 8), interaction_time=meet, jump=bounce)
    >>> [next(run).time for _ in range(2)]
    [2.0, 8.0]
    """
    x, v = np.array(positions, dtype=float), np.array(velocities, dtype=float)
    n, d = x.shape
    edges, now, met = np.array(box), 0.0, None
    turns = [np.array(turn) * edges for turn in itertools.product((-1, 0, 1), repeat=d)]
    while True:
        best, who = np.inf, None
        for i, j in itertools.combinations(range(n), 2):
            nearest, u = -edges * np.rint((x[j] - x[i]) / edges), v[j] - v[i]
            for turn in turns:
                shift = nearest + turn
                r = x[j] - x[i] + shift
                t = interaction_time(i, j, float(r @ r), float(r @ u), float(u @ u))
                # By rounding, two that have just met may still touch and approach (condition V).
                again = t == 0.0 and met is not None and met[:2] == (i, j) and (met[2] == shift).all()
                if t < best and not again:
                    best, who = t, (i, j, shift)
        if who is None:
            return
        i, j, shift = who
        for k, axis in np.ndindex(n, d):
            x[k, axis] = position(axis, x[k, axis], v[k, axis], best)
            v[k, axis] = velocity(axis, v[k, axis], best)
        now += best
        r = x[j] - x[i] + shift
        rr, rv = float(r @ r), float(r @ (v[j] - v[i]))
        ours, theirs, _ = jump(i, j, rr, rv)
        part = transfer(rr, rv)
        v[i], v[j] = v[i] + part * ours * r, v[j] - part * theirs * r
        met = who
        yield Step(now, i, j, x.copy(), v.copy())
