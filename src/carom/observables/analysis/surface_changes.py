"""The force on an obstacle of any shape, without most of the momentum that sound carries to and fro.

For a slanting plane or an own obstacle only the distance ``g_i`` of each particle is known, no field as in
``momentum_balance``. Two sums over it are bounded, with s half of the box::

    A = sum_i m_i dg_i/dt        B = sum_i m_i g_i dg_i/dt / s

So any multiple of their changes may be subtracted from the momentum that the obstacle receives in a block,
without a change of the long mean. Regression gives those with the least scatter.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.arithmetic import dot, least_squares
from carom.observables.analysis.momentum_balance import balanced_by_field
from carom.observables.statistics import Estimate, ratio
from carom.scene.fields import standing

if TYPE_CHECKING:
    from carom.frame import Frame
    from carom.scene.scene import Scene

GROUPS = 64
"""Number of stretches into which blocks are merged. Shorter stretches do not resolve the sound, and the error
bar of fewer is uncertain by more than a tenth.
"""

MOST = 16
"""Largest number of obstacles whose distances are computed after each block. More would take too long."""

STEP = 2.0**-20
"""Displacement of the fastest particle for the numerical derivative of a distance [shortest edge]."""


def surface_sums(frame: Frame, scene: Scene) -> tuple[float, ...]:
    """Return A and B [mass length / time] of each obstacle without a field, in order; none if above 16."""
    obstacles = [obstacle for obstacle in standing(scene) if not balanced_by_field(obstacle)]
    fastest = float(np.abs(frame.velocities).max(initial=0.0))
    if len(obstacles) > MOST:
        return ()
    if not obstacles or fastest == 0.0:
        return (0.0,) * (2 * len(obstacles))
    shortest = float(min(scene.box))
    way = frame.velocities * (STEP * shortest / fastest)
    radii, found = 0.5 * frame.diameters, []
    for obstacle in obstacles:
        before, after = (
            np.asarray(obstacle.gap(frame.positions + side * way, radii, scene.box, scene.periodic))
            for side in (-1.0, 1.0)
        )
        pace = frame.masses * (after - before) * (0.5 * fastest / (STEP * shortest))
        found += [float(pace.sum()), dot(pace, after + before) / shortest]
    return tuple(found)


def place_of(scene: Scene, k: int) -> int | None:
    """Return the index of the first sum of wall or obstacle k in those of the scene; None if it has none."""
    number = k - 2 * list(scene.periodic).count(False)
    if number < 0 or balanced_by_field(standing(scene)[number]):
        return None
    return 2 * sum(not balanced_by_field(obstacle) for obstacle in standing(scene)[:number])


def freed(impulses: np.ndarray, changes: np.ndarray, durations: np.ndarray) -> tuple[Estimate, np.ndarray]:
    """Return the force with its error bar, and the momentum of each block without multiples of the changes.

    ``impulses`` (n,) are received in blocks, ``changes`` (n, m) those of bounded sums [mass length / time].
    """
    n, m = changes.shape
    if n < 8 * m or not np.isfinite(changes).all():
        return ratio(impulses, durations), impulses
    starts = np.linspace(0, n, min(n, GROUPS) + 1).astype(int)[:-1]
    columns = np.column_stack([durations, changes])
    momentum, merged = (np.add.reduceat(series, starts, axis=0) for series in (impulses, columns))
    units = np.abs(merged).max(axis=0)
    units[units == 0.0] = 1.0
    solution = least_squares(merged / units, momentum) / units
    flux = impulses - np.sum(changes * solution[1:], axis=1)
    coarse = ratio(np.add.reduceat(flux, starts), merged[:, 0])
    # Degrees of freedom that the regression has removed from the scatter.
    error = coarse.error * math.sqrt((len(starts) - 1) / (len(starts) - 1 - m))
    scatter = float(np.var(flux / durations, ddof=1))
    n_eff = scatter / error**2 if 0.0 < error < math.inf else coarse.n_eff
    mean = float(flux.sum() / durations.sum())
    return Estimate(mean, error, n_eff, n / n_eff if n_eff else math.inf, coarse.blocks), flux
