"""What ``carom trade`` finds: a row for each method, and how long trajectories can be followed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from carom.studies.accuracy.statistics import SamplingRow, SizeRow


@dataclass(frozen=True)
class Row:
    """One way to move hard spheres, with its figures; nan where none was asked for.

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
        In a million collisions, relative.
    horizon_order, horizon_position : float
        Collisions a particle until the order of collisions, and any position by 10^-3 diameters, is not the
        oracle's, the median of three starts; infinite if that did not happen while it was looked at.
    error_1 : float
        Median distance from the true position after one collision a particle, of the three [diameters].
    back_5, back_10, back_20 : float
        Largest distance from the start after so many collisions a particle forward and back [diameters]; 0
        where no double can tell the difference, nan beyond half of what the oracle was followed for.
    z_bias, z_error : float
        Z over what it should be less one, and its standard error.
    contact_bias, contact_error : float
        The same of g(sigma+), from the number of collisions; from the virial where nothing is a collision.
    diffusion, diffusion_bias, diffusion_error : float
        D of these spheres [length^2 / time], compared with the engine's D of as many, by the rule of
        :class:`carom.studies.accuracy.diffusion.EinsteinSlope`.
    z_cost, diffusion_cost : float
        Error of Z and D after one CPU second, relative: the statistical one. What a bias leaves is beside
        it.
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
    """How long doubles can follow a trajectory: what theory says, in collisions a particle.

    Attributes
    ----------
    lyapunov, rate : float
        Largest Lyapunov exponent and collision rate of a particle, from two oracles side by side [1 / time].
    to_one, to_apart : float
        Until one rounding, 2.2e-16, has grown to one diameter, and to 10^-3 diameters.
    published_to_one : float
        The first from published exponents; nan where there are none for this density.
    followed : float
        Collisions a particle that the oracle was followed for.
    """

    lyapunov: float
    rate: float
    to_one: float
    to_apart: float
    published_to_one: float
    followed: float


@dataclass(frozen=True)
class TradeResult:
    """What ``carom trade`` found.

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
