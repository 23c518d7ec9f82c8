"""Helfand's moments at equal times, and the mean squares from which transport coefficients follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carom.errors import InputError

PARTS = ("kinetic", "cross", "collisional")
"""Parts of a mean square ``<(k + c)^2>``: ``<k^2>``, ``2 <k c>`` and ``<c^2>``."""


@dataclass(frozen=True)
class HelfandCurrents:
    """Has a simulation add up the currents of momentum and heat: a value for ``Simulation(observers=[...])``.

    :meth:`carom.Simulation.helfand` then returns their time integrals. It needs periodic axes, elastic
    contacts and straight flight.
    """


@dataclass(frozen=True, eq=False)
class HelfandMoments:
    """Time integrals of the currents of momentum and heat, at m equally spaced times.

    They refer to the rest frame of the center of mass. Kinetic parts are exact between collisions;
    collisional parts change only at collisions.

    Attributes
    ----------
    every : float
        Time from one sample to the next [time].
    stress : (2, m, d, d) array
        Kinetic part, the integral of ``sum m v_a v_b``, and collisional part, the sum of ``dp_a r_b``
        [mass length^2 / time].
    heat : (2, m, d) array
        Kinetic part, the integral of ``sum e v_a``, and collisional part, the sum of ``de r_a``
        [energy length]. The energy e is ``m v^2 / 2``, plus half of the energy of each pair with steps.
    displacement : (K, m, d) array
        Sum of the displacements of each species [length]; K = 0 if the scene has no species.
    """

    every: float
    stress: np.ndarray
    heat: np.ndarray
    displacement: np.ndarray

    @property
    def count(self) -> int:
        """Number of samples, m."""
        return self.stress.shape[1]

    @property
    def dimension(self) -> int:
        """Number of dimensions, d."""
        return self.stress.shape[-1]

    @property
    def pressure(self) -> np.ndarray:
        """Trace of the stress over d, (m,): pressure times volume, integrated over time [energy time]."""
        return np.trace(self.stress.sum(axis=0), axis1=1, axis2=2) / self.dimension


@dataclass(frozen=True, eq=False)
class MeanSquares:
    """Mean squares of changes of Helfand's moments over l times; shear is that of an off-diagonal element."""

    times: np.ndarray  # (l,), between the samples [time]
    shear: np.ndarray  # (3, l): kinetic, cross, collisional
    heat: np.ndarray  # (3, l): kinetic, cross, collisional
    bulk: np.ndarray  # (2, l), mean and mean square of ``pressure`` less ``rate`` times the time
    rate: float  # as in :func:`mean_squares`
    fluxes: np.ndarray  # (1 + K, 1 + K, l), products of heat and displacement of species


def mean_squares(moments: HelfandMoments, lags: Sequence[int], rate: float) -> MeanSquares:
    """Return mean squares over all stretches of ``lags`` samples, less ``rate`` times the time in the trace.

    In an isotropic fluid the sum of squares of the traceless stress is ``A (d - 1) (d + 2)``, with A that of
    an off-diagonal element.
    """
    d = moments.dimension
    if max(lags, default=1) >= moments.count or min(lags, default=1) < 1:
        raise InputError(
            f"lags of {min(lags)} to {max(lags)} samples in a stretch of {moments.count}; expected from 1 to "
            f"{moments.count - 1}."
        )
    traces = np.trace(moments.stress, axis1=2, axis2=3) / d
    traceless = moments.stress - traces[..., None, None] * np.eye(d)
    shape = (2, moments.count, d * d)
    tensor, vector = traceless.reshape(shape), moments.heat
    trace = traces.sum(axis=0) - rate * moments.every * np.arange(moments.count)
    flux = np.concatenate([vector.sum(axis=0)[None], moments.displacement])
    shear, heat, bulk, fluxes = [], [], [], []
    for lag in lags:
        s, q, f = (a[:, lag:] - a[:, :-lag] for a in (tensor, vector, flux))
        b = trace[lag:] - trace[:-lag]
        shear.append(_parts(s) / max((d - 1) * (d + 2), 1))
        heat.append(_parts(q) / d)
        bulk.append([b.mean(), np.mean(b * b)])
        fluxes.append(np.einsum("kma,lma->kl", f, f) / (f.shape[1] * d))
    return MeanSquares(
        moments.every * np.asarray(lags, np.float64),
        np.transpose(shear),
        np.transpose(heat),
        np.transpose(bulk),
        rate,
        np.moveaxis(np.asarray(fluxes), 0, -1),
    )


def _parts(x: np.ndarray) -> np.ndarray:
    """Return the means over samples of k.k, 2 k.c and c.c, for (k, c) of the shape (2, m, particles)."""
    (kk, kc), (_, cc) = np.einsum("pma,qma->pq", x, x) / x.shape[1]
    return np.array([kk, 2.0 * kc, cc])
