"""Free flights and meetings: distributions and means with error bars, by species."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carom.figures import curves
from carom.figures.palette import GRAY
from carom.figures.style import shade
from carom.observables.statistics import Estimate, arrays, ratio, unwarned
from carom.results import Binned, Result
from carom.suggestions import corrected

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class FlightSums(NamedTuple):
    """What the flights and collisions of one stretch of time add up to."""

    times: np.ndarray  # histograms of free times of each species, (K, b) int64
    paths: np.ndarray
    speeds: np.ndarray  # of relative normal speeds, in the row of the smaller number, (K, K, b) int64
    flown: np.ndarray  # flights, and the sums of their times [time] and paths [length], (K, 3)
    met: np.ndarray  # collisions, and the sum of normal speeds [length / time], (K, K, 2)
    returns: np.ndarray
    """Collisions of particles that had collided before, and of those with the same partner again, (K, 2)."""


@corrected()
@dataclass(frozen=True)
class FreeFlights:
    """Free times, free paths, collision rates and normal speeds, by species: an observable of a run.

    Give it to :meth:`carom.Simulation.measure`. The engine then adds up every flight and collision of the
    stretch in histograms, which are compiled for it. This does not affect the trajectory. Flights that begin
    before the stretch or end after it are left out: the stretch should be long compared with a free time.
    Pinned particles have no flights, but collisions.

    Raises
    ------
    InputError
        From ``measure``, where the length of a flight is not its duration times the speed at its end: in a
        field, with a drive, with moving walls or walls that take energy, or where diameters grow.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.crystal(108, 0.3), seed=1)
    >>> found = sim.measure(FreeFlights(), collisions_per_particle=100, blocks=64)
    >>> found.free_path[0].mean.mean < 0.5
    True
    """


@dataclass(frozen=True, eq=False, repr=False)
class Distribution(Binned):
    """A probability density over bins of equal width, and its mean.

    Attributes
    ----------
    edges : (b + 1,) array
        Edges of the bins.
    density, error : (b,) arrays
        Probability density and its standard error. Values beyond the last edge are included in the
        normalization.
    mean : Estimate
        Mean of the quantity itself.
    """

    edges: np.ndarray
    density: np.ndarray
    error: np.ndarray
    mean: Estimate

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        return f"Distribution in {self.density.size} bins", [("mean", self.mean.value_text)]

    def _draw_into(self, axes: Axes) -> None:
        curves.curve(axes, self.middle, self.density, self.error)
        axes.axvline(self.mean.mean, color=GRAY, linestyle="--", linewidth=0.9)
        label = f"value, mean {curves.stated(self.mean.value_text)}"
        axes.set(xlabel=label, ylabel="probability density")

    def _columns(self) -> dict[str, Any]:
        return {**self._bins(), "density": self.density, "error": self.error}


@dataclass(frozen=True, eq=False, repr=False)
class FreeFlightsResult(Result):
    """Free flights and meetings of a fluid.

    Attributes
    ----------
    free_time, free_path : tuple of Distribution
        Time [time] and length [length] from one collision of a particle to its next, of each species.
    normal_speed : dict of Distribution
        Relative normal speed of two that collide [length / time], by the numbers of their species.
    collision_rate, collision_rate_error : (K,) arrays
        Collisions of one particle, of each species [1 / time].
    return_probability, return_probability_error : (K,) arrays
        Probability that the next partner of a particle is its previous one, of each species. Two isolated
        hard spheres never collide twice; a third one must send one of them back. The probability therefore
        vanishes in a dilute gas and grows where spheres are caged.
    """

    free_time: tuple[Distribution, ...]
    free_path: tuple[Distribution, ...]
    normal_speed: dict[tuple[int, int], Distribution]
    collision_rate: np.ndarray
    collision_rate_error: np.ndarray
    return_probability: np.ndarray
    return_probability_error: np.ndarray

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = []
        for k, (t, path) in enumerate(zip(self.free_time, self.free_path, strict=True)):
            of = f" of species {k}" if len(self.free_time) > 1 else ""
            rows += [(f"free time{of} [time]", t.mean.value_text)]
            rows += [(f"free path{of} [length]", path.mean.value_text)]
        return "Means of free flights", rows

    def _draw_into(self, axes: Axes) -> None:
        for k, each in enumerate(self.free_time):
            seen, color = each.density > 0.0, shade(k)
            label = f"species {k}" if len(self.free_time) > 1 else ""
            curves.curve(axes, each.middle[seen], each.density[seen], each.error[seen], label, color)
            # What the density were if a collision did not know when the last one was.
            rate = float(self.collision_rate[k])
            law = rate * np.exp(-rate * each.middle[seen])
            name = None if k else "without memory"
            axes.plot(each.middle[seen], law, "--", color=color, linewidth=1.0, label=name)
        axes.set_yscale("log")
        axes.set(xlabel="free time", ylabel="probability density")

    def _columns(self) -> dict[str, Any]:
        found: dict[str, Any] = {"species": np.arange(len(self.free_time))}
        for name in ("free_time", "free_path"):
            found[name], found[f"{name}_error"] = arrays([each.mean for each in getattr(self, name)])
        return found | self._with_errors("collision_rate", "return_probability")


def flights_of(
    blocks: list[FlightSums], durations: list[float], counts: np.ndarray, widths: np.ndarray
) -> FreeFlightsResult:
    """Return distributions from sums over stretches, by the bins' ``widths`` of time, path and speed (3,)."""
    kinds = range(len(counts))
    with unwarned():  # bins with few samples have wide error bars
        times, paths = (
            tuple(
                _distribution(
                    [getattr(each, name)[k] for each in blocks],
                    [each.flown[k, [0, column]] for each in blocks],
                    widths[column - 1],
                )
                for k in kinds
            )
            for name, column in (("times", 1), ("paths", 2))
        )
        speeds = {
            (a, b): _distribution(
                [block.speeds[a, b] for block in blocks],
                [block.met[a, b] for block in blocks],
                widths[2],
            )
            for a in kinds
            for b in kinds[a:]
            if any(block.met[a, b, 0] for block in blocks)
        }
        met = [block.met for block in blocks]
        # A collision within a species counts for both particles.
        rates = [
            ratio([(x[k, :, 0].sum() + x[:, k, 0].sum()) / max(counts[k], 1) for x in met], durations)
            for k in kinds
        ]
        returns = [_probability([b.returns[k] for b in blocks]) for k in kinds]
    return FreeFlightsResult(times, paths, speeds, *arrays(rates), *arrays(returns))


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
