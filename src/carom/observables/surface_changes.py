"""The force on an obstacle of any shape, freed of most of the momentum that sound carries to and fro.

For walls, containers, balls and planes along an axis a field is known by which the momentum taken up is
balanced (``momentum_balance``). Of a slanting plane, or an obstacle of one's own, only the distance ``g_i``
of each component is known. Two sums of it change at each contact by what the obstacle takes up::

    A = sum_i m_i dg_i/dt        B = sum_i m_i g_i dg_i/dt / s

with s half of the box. Both are bounded. So the changes of A and B from block to block add up to nothing over
a long stretch, and any multiple of them may be taken off the momentum of the blocks: the mean stays. The
multiples that leave least scatter are those of a linear regression. What is left is less anticorrelated, and
its error bar less too wide, than the momentum taken up.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.observables.momentum_balance import balanced_by_field
from carom.observables.statistics import Estimate, ratio

if TYPE_CHECKING:
    from carom.frame import Frame
    from carom.scene.scene import Scene

GROUPS = 64
"""Stretches that blocks are merged into. Shorter ones do not follow the sound, and the error bar of fewer is
uncertain by more than a tenth.
"""

MOST = 16
"""Obstacles whose distances are looked at after each block. Of more, it would take longer than the block."""

STEP = 2.0**-20
"""Way of the fastest component, in edges, over which the change of a distance is taken."""


def surface_sums(frame: Frame, scene: Scene) -> tuple[float, ...]:
    """Return A and B [mass length / time] of each obstacle that no field balances, in order.

    Parameters
    ----------
    frame : Frame
        Positions and velocities at one time.
    scene : Scene

    Returns
    -------
    tuple of float
        Two numbers an obstacle; none if there are more than 16 such obstacles.
    """
    obstacles = [obstacle for obstacle in scene.obstacles if not balanced_by_field(obstacle)]
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
        found += [float(pace.sum()), float(pace @ (after + before)) / shortest]
    return tuple(found)


def place_of(scene: Scene, k: int) -> int | None:
    """Return where the sums of wall or obstacle k begin in those of the scene, or None if it has none."""
    number = k - 2 * list(scene.periodic).count(False)
    if number < 0 or balanced_by_field(scene.obstacles[number]):
        return None
    return 2 * sum(not balanced_by_field(obstacle) for obstacle in scene.obstacles[:number])


def freed(impulses: np.ndarray, changes: np.ndarray, durations: np.ndarray) -> tuple[Estimate, np.ndarray]:
    """Return the force with its error bar, and the momentum of each block without what comes back.

    Parameters
    ----------
    impulses : (n,) array
        Momentum taken up in each block [mass length / time].
    changes : (n, m) array
        Changes of bounded sums in each block.
    durations : (n,) array
        Of each block [time].

    Notes
    -----
    Multiples are found, and the error is estimated, from 64 stretches of several blocks. If there are fewer
    than 64 blocks, each is a stretch. In fewer than 16 a regression would follow the noise, and the momentum
    is returned as it is.
    """
    n, m = changes.shape
    if n < 8 * m or not np.isfinite(changes).all():
        return ratio(impulses, durations), impulses
    starts = np.linspace(0, n, min(n, GROUPS) + 1).astype(int)[:-1]
    columns = np.column_stack([durations, changes])
    momentum, merged = (np.add.reduceat(series, starts, axis=0) for series in (impulses, columns))
    units = np.abs(merged).max(axis=0)
    units[units == 0.0] = 1.0
    solution = np.linalg.lstsq(merged / units, momentum, rcond=None)[0] / units
    flux = impulses - changes @ solution[1:]
    coarse = ratio(np.add.reduceat(flux, starts), merged[:, 0])
    # What the regression took from the scatter by chance.
    error = coarse.error * math.sqrt((len(starts) - 1) / (len(starts) - 1 - m))
    scatter = float(np.var(flux / durations, ddof=1))
    n_eff = scatter / error**2 if 0.0 < error < math.inf else coarse.n_eff
    mean = float(flux.sum() / durations.sum())
    return Estimate(mean, error, n_eff, n / n_eff if n_eff else math.inf, coarse.blocks), flux
