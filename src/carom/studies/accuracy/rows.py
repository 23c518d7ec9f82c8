"""Results of ``carom trade``: a row for each method, and how long trajectories can be followed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from carom.studies.accuracy.statistics import SamplingRow, SizeRow


@dataclass(frozen=True)
class Row:
    """The figures of one method; nan where none was measured.

    Attributes
    ----------
    method, algorithm : str
    n_speed : int
        Particles of the scene on which speed, Z and D were measured.
    collisions_per_second : float
        Per CPU second, on one core.
    bytes_per_particle : float
    worst_overlap : float
        Deepest overlap [diameters].
    energy_drift, momentum_drift : float
        Relative, per million collisions.
    horizon_order, horizon_position : float
        Collisions per particle until the order of collisions is not the oracle's, and until any position
        differs by 10^-3 diameters. Median of three starts; infinite if that did not happen in the time
        followed.
    error_1 : float
        Median distance from the true position after one collision per particle; median of the three starts
        [diameters].
    back_5, back_10, back_20 : float
        Largest distance from the start after so many collisions per particle forward and back [diameters]. It
        is 0 where doubles do not resolve it, and nan beyond half the length of the oracle's trajectory.
    z_bias, z_error : float
        Relative bias of Z, and its standard error.
    contact_bias, contact_error : float
        The same of g(sigma+), from the number of collisions; from the virial for a method without collisions.
    diffusion, diffusion_bias, diffusion_error : float
        D at this N [length^2 / time] by the rule of
        :class:`carom.studies.accuracy.diffusion.EinsteinSlope`, and its relative deviation from the engine's
        D at the same N, with the standard error.
    z_cost, diffusion_cost : float
        Relative statistical error of Z and of D after one CPU second, without the bias.
    """

    method: str
    algorithm: str
    n_speed: int
    collisions_per_second: float
    bytes_per_particle: float
    worst_overlap: float
    energy_drift: float
    momentum_drift: float
    horizon_order: float
    horizon_position: float
    error_1: float
    back_5: float
    back_10: float
    back_20: float
    z_bias: float
    z_error: float
    contact_bias: float
    contact_error: float
    diffusion: float
    diffusion_bias: float
    diffusion_error: float
    z_cost: float
    diffusion_cost: float


@dataclass(frozen=True)
class Horizon:
    """How long doubles can follow a trajectory, by theory [collisions per particle].

    Attributes
    ----------
    lyapunov, rate : float
        Largest Lyapunov exponent and collision rate of a particle, from the oracle and its twin [1 / time].
    to_one, to_apart : float
        Until one rounding, 2.2e-16, has grown to one diameter, and to 10^-3 diameters.
    published_to_one : float
        The first from published exponents; nan where there are none for this density.
    followed : float
        Length of the oracle's trajectory [collisions per particle].
    """

    lyapunov: float
    rate: float
    to_one: float
    to_apart: float
    published_to_one: float
    followed: float


@dataclass(frozen=True)
class TradeResult:
    """The results of ``carom trade``.

    Attributes
    ----------
    folder : Path
    scene, small : str
        The scene, and the small one of the same density in which trajectories were followed.
    rows : list of Row
    horizon : Horizon
    sizes : list of SizeRow
    sampling : list of SamplingRow
    """

    folder: Path
    scene: str
    small: str
    rows: list[Row]
    horizon: Horizon
    sizes: list[SizeRow]
    sampling: list[SamplingRow]
