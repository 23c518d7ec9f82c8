"""Free flights and meetings: distributions and means with error bars, by species."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from carom.errors import CaromWarning
from carom.observables.statistics import Estimate, ratio


class FlightSums(NamedTuple):
    """What the flights and collisions of one stretch of time add up to.

    Attributes
    ----------
    times, paths : (K, b) int64 arrays
        Histograms of free times and free paths of each species.
    speeds : (K, K, b) int64 array
        Histograms of relative normal speeds, in the row of the species with the smaller number.
    flown : (K, 3) array
        Number of flights, sum of their times [time], and sum of their paths [length].
    met : (K, K, 3) array
        Number of collisions, sum of the normal speeds [length / time], and sum of their squares.
    returns : (K, 2) array
        Number of collisions of components that had collided before, and of those with the same partner again.
    """

    times: np.ndarray
    paths: np.ndarray
    speeds: np.ndarray
    flown: np.ndarray
    met: np.ndarray
    returns: np.ndarray


@dataclass(frozen=True, eq=False)
class Distribution:
    """A probability density over bins of equal width, and its mean.

    Attributes
    ----------
    edges : (b + 1,) array
        Edges of the bins.
    density, error : (b,) arrays
        Probability density and its standard error. Values beyond the last edge are included in the
        normalisation.
    mean : Estimate
        Mean of the quantity itself.
    """

    edges: np.ndarray
    density: np.ndarray
    error: np.ndarray
    mean: Estimate

    @property
    def middle(self) -> np.ndarray:
        """Middle of each bin, (b,)."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])


@dataclass(frozen=True, eq=False)
class FlightsEstimate:
    """Free flights and meetings of a fluid.

    Attributes
    ----------
    free_time, free_path : list of Distribution
        Time [time] and length [length] from one collision of a component to its next, of each species.
    normal_speed : dict of Distribution
        Relative normal speed of two that collide [length / time], by the numbers of their species.
    collision_rate : list of Estimate
        Collisions of one component per time, of each species.
    return_probability : list of Estimate
        Probability that the next partner of a component is its previous one, of each species. Two isolated
        hard spheres never collide twice; a third one must send one of them back. The probability therefore
        vanishes in a dilute gas and grows where spheres are caged.
    """

    free_time: list[Distribution]
    free_path: list[Distribution]
    normal_speed: dict[tuple[int, int], Distribution]
    collision_rate: list[Estimate]
    return_probability: list[Estimate]

    def __str__(self) -> str:
        return "\n".join(
            f"species {k}: mean free time {t.mean.value_text}, mean free path {p.mean.value_text}"
            for k, (t, p) in enumerate(zip(self.free_time, self.free_path, strict=True))
        )


def flights_of(
    blocks: list[FlightSums], durations: list[float], counts: np.ndarray, widths: np.ndarray
) -> FlightsEstimate:
    """Return distributions from the sums of blocks.

    Parameters
    ----------
    blocks : list of FlightSums
        Sums over stretches of a run in equilibrium.
    durations : list of float
        Duration of each stretch [time].
    counts : (K,) array
        Number of components of each species.
    widths : (3,) array
        Widths of the bins of time, path and speed.
    """
    kinds = len(counts)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)  # bins with few samples have wide error bars
        found = FlightsEstimate(
            [
                _distribution([b.times[k] for b in blocks], [b.flown[k, :2] for b in blocks], widths[0])
                for k in range(kinds)
            ],
            [
                _distribution([b.paths[k] for b in blocks], [b.flown[k, ::2] for b in blocks], widths[1])
                for k in range(kinds)
            ],
            {
                (a, b): _distribution(
                    [block.speeds[a, b] for block in blocks],
                    [block.met[a, b, :2] for block in blocks],
                    widths[2],
                )
                for a in range(kinds)
                for b in range(a, kinds)
                if any(block.met[a, b, 0] for block in blocks)
            },
            [],
            [_probability([b.returns[k] for b in blocks]) for k in range(kinds)],
        )
        for k in range(kinds):
            # A collision within a species counts for both components.
            rates = [(b.met[k, :, 0].sum() + b.met[:, k, 0].sum()) / max(counts[k], 1) for b in blocks]
            found.collision_rate.append(ratio(rates, durations))
    return found


def _probability(rows: list[np.ndarray]) -> Estimate:
    """Return a probability from blocks (trials, successes)."""
    could, did = np.array([row for row in rows if row[0] > 0.0]).reshape(-1, 2).T
    return ratio(did, could) if len(could) else Estimate(np.nan, np.inf, 0.0, np.inf, 0)


def _distribution(rows: list[np.ndarray], sums: list[np.ndarray], width: float) -> Distribution:
    """Return a density and a mean; ``sums`` hold the number and the sum of the values of each block."""
    counts = np.array(rows, np.float64)
    totals = np.array([row[0] for row in sums])
    kept = totals > 0.0
    edges = width * np.arange(counts.shape[1])  # the last bin holds values beyond the last edge
    if not kept.any():
        empty = np.full(len(edges) - 1, np.nan)
        return Distribution(edges, empty, empty, Estimate(np.nan, np.inf, 0.0, np.inf, 0))
    mean = ratio([row[1] for row in np.array(sums)[kept]], totals[kept])
    whole = totals.sum()
    density = counts[:, :-1].sum(axis=0) / whole
    residuals = counts[:, :-1] - density * totals[:, None]
    blocks = max(int(kept.sum()), 2)
    error = np.sqrt(np.sum(residuals**2, axis=0) * blocks / (blocks - 1.0)) / whole
    return Distribution(edges, density / width, error / width, mean)
