"""From the mean squares of blocks to transport coefficients with error bars."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from carom.observables.analysis.precision import combined
from carom.observables.statistics import UNKNOWN, Estimate
from carom.studies.folder import Record
from carom.studies.transport import windows


@dataclass(frozen=True)
class Coefficient(Estimate):
    """A transport coefficient, an :class:`~carom.Estimate` with the data behind it.

    Attributes
    ----------
    mean, error, n_eff, tau, blocks
        As of every estimate; the mean is nan if the blocks are too short for a slope.
    window : tuple of two floats
        Times between which the slope was taken [time].
    kinetic, cross, collisional : Estimate or None
        Contributions of the two parts of the current and of their correlation; None where there is no split.
    times : tuple of float
        [time]
    running : tuple of Estimate
        The coefficient at each of these times: half of the slope of the mean square around it.
    settled : bool
        Whether the slope agreed with that of the next window.
    """

    window: tuple[float, float] = (math.nan, math.nan)
    kinetic: Estimate | None = None
    cross: Estimate | None = None
    collisional: Estimate | None = None
    times: tuple[float, ...] = ()
    running: tuple[Estimate, ...] = ()
    settled: bool = True

    @classmethod
    def of(cls, value: Estimate, window: tuple[float, float], **behind: Any) -> Coefficient:
        """Return the coefficient of a ``value`` from a ``window``, with the other attributes by name."""
        return cls(value.mean, value.error, value.n_eff, value.tau, value.blocks, window, **behind)


def jackknife(blocks: np.ndarray, function: Callable[[np.ndarray], Any]) -> list[Estimate]:
    """Return a function of the mean over independent blocks (b, ...), with its jackknife error.

    The function returns one number or several.
    """
    count = len(blocks)
    whole = np.atleast_1d(function(blocks.mean(axis=0)))
    if count < 2:
        return [Estimate(float(x), math.inf, float(count), 1.0, count) for x in whole]
    total = blocks.sum(axis=0)
    parts = np.array([np.atleast_1d(function((total - block) / (count - 1.0))) for block in blocks])
    errors = np.sqrt((count - 1.0) / count * np.sum((parts - parts.mean(axis=0)) ** 2, axis=0))
    return [
        Estimate(float(x), float(e), float(count), 1.0, count) for x, e in zip(whole, errors, strict=True)
    ]


@dataclass(frozen=True)
class Extrapolation:
    """Self-diffusion of infinitely many spheres, by a straight line in 1 / L through several sizes."""

    packing_fraction: float
    value: Estimate  # at 1 / L = 0 [length^2 / time]
    slope: Estimate  # [length^3 / time]
    sizes: tuple[int, ...]
    chi2_per_point: float  # over the number of sizes minus two


def line(x: np.ndarray, y: np.ndarray, error: np.ndarray) -> tuple[Estimate, Estimate, float]:
    """Return intercept and slope of a straight line, and chi squared over the number of points minus two."""
    design = np.stack([np.ones_like(x), x]) / error
    covariance = np.linalg.inv(design @ design.T)
    found = covariance @ (design @ (y / error))
    chi2 = float(np.sum((y / error - found @ design) ** 2))
    ends = [
        Estimate(float(v), float(e), float(len(x)), 1.0, len(x))
        for v, e in zip(found, np.sqrt(np.diag(covariance)), strict=True)
    ]
    return ends[0], ends[1], chi2 / (len(x) - 2) if len(x) > 2 else math.nan


class Point:
    """The blocks of all replicas of one point, from records of ``measure`` with one scene."""

    def __init__(self, records: list[Record]):
        results = [record["result"] for record in records]
        self.first = results[0]
        self.blocks = [block for result in results for block in result["blocks"]]
        self._replicas = [(result["blocks"], result["samples"] - 1) for result in results]
        self.every = float(self.first["every"])
        self.dimension = int(self.first["dimension"])
        self.n = int(self.first["n"])
        # With steps kT fluctuates, and each replica has its own mean.
        self.kT = math.fsum(result["kT"] for result in results) / len(results)
        self.volume = math.prod(self.first["box"])
        # All replicas have the same lags, but shorter blocks have fewer of them.
        self.count = min(len(block["shear"][0]) for block in self.blocks)
        self.lags = np.array(windows.LAGS[: self.count])
        self.times = self.every * self.lags

    def array(self, name: str) -> np.ndarray:
        """Return the entry ``name`` of all blocks, (b, ..., l)."""
        return np.array([np.asarray(block[name])[..., : self.count] for block in self.blocks])

    def coefficient(self, squares: np.ndarray, scale: float, components: int = 0) -> Coefficient:
        """Return ``scale`` times half of the slope of the mean squares (b, parts, l), by the rule.

        They are means over so many independent ``components``; 0 where the product may have either sign.
        """
        half = 0.5 * scale
        run = tuple(jackknife(squares, lambda m: half * np.diff(m.sum(axis=0)) / np.diff(self.times)))
        middle = tuple(float(t) for t in 0.5 * (self.times[1:] + self.times[:-1]))
        window, settled = self._window(squares.sum(axis=1))
        if window is None:
            return Coefficient.of(UNKNOWN, (math.nan, math.nan), times=middle, running=run, settled=False)
        low, high = window
        parts = [
            jackknife(squares[:, part], lambda m: half * self._slope(m, low, high))[0]
            for part in range(squares.shape[1])
        ]
        (value,) = jackknife(squares.sum(axis=1), lambda m: half * self._slope(m, low, high))
        split = dict(zip(("kinetic", "cross", "collisional"), parts, strict=True)) if len(parts) == 3 else {}
        between = (float(self.times[low]), float(self.times[high]))
        value = self._sure(value, between, components)
        return Coefficient.of(value, between, times=middle, running=run, settled=settled, **split)

    def _sure(self, value: Estimate, window: tuple[float, float], components: int) -> Estimate:
        """Return a coefficient with an error no smaller than that of currents without memory.

        The scatter of few blocks is small by chance, most often where their mean is too small as well.
        """
        if not components:
            return value
        total = self.every * sum(steps * len(blocks) for blocks, steps in self._replicas)
        least = abs(value.mean) * math.sqrt(windows.relative_variance(components, total, *window))
        return replace(value, error=max(value.error, least))

    def _slope(self, squares: np.ndarray, low: int, high: int) -> Any:
        return (squares[..., high] - squares[..., low]) / (self.times[high] - self.times[low])

    def _window(self, squares: np.ndarray) -> tuple[tuple[int, int] | None, bool]:
        """Return the window of the rule, and whether the next one agrees with it."""
        at = {int(lag): k for k, lag in enumerate(self.lags)}
        found = [(at[s], at[2 * s]) for s in windows.STARTS if 2 * s in at]
        slopes = [(self._slope(squares, *one)) for one in found]
        for window, one, two in zip(found, slopes, slopes[1:], strict=False):
            (change,) = jackknife(two - one, lambda m: m)
            if abs(change.mean) <= windows.AGREE * change.error:
                return window, True
        return (found[-1] if found else None), False

    def at_rest(self, species: int) -> float:
        """Return M / (M - m): the mass of all over that of all but one of a species; 1 for a single one."""
        whole = self.mean_mass * self.n
        return whole / (whole - self.first["masses"][species]) if self.n > 1 else 1.0

    @property
    def mean_mass(self) -> float:
        """Mean mass of a particle."""
        masses, counts = self.first["masses"], self.first["counts"]
        return math.fsum(mass * count for mass, count in zip(masses, counts, strict=True)) / self.n

    def shear_viscosity(self) -> Coefficient:
        """Return the shear viscosity: slope over ``V kT``."""
        d = self.dimension
        return self.coefficient(self.array("shear"), 1.0 / (self.volume * self.kT), (d - 1) * (d + 2) // 2)

    def thermal_conductivity(self) -> Coefficient:
        """Return the thermal conductivity, at zero flux of every species."""
        scale = 1.0 / (self.volume * self.kT**2)
        fluxes = self.array("fluxes")
        if fluxes.shape[1] <= 2:  # no species, or one: its flux is zero
            return self.coefficient(self.array("heat"), scale, self.dimension)
        window, settled = self._window(np.diagonal(fluxes, axis1=1, axis2=2)[..., 0])
        if window is None:
            return Coefficient.of(UNKNOWN, (math.nan, math.nan), settled=False)
        low, high = window
        half = 0.5 * scale

        def conductivity(mean: np.ndarray) -> float:
            slopes = self._slope(mean, low, high)[:-1, :-1]  # the last species' flux follows from the others'
            return half * float(slopes[0, 0] - slopes[0, 1:] @ np.linalg.solve(slopes[1:, 1:], slopes[1:, 0]))

        (value,) = jackknife(fluxes, conductivity)
        between = (float(self.times[low]), float(self.times[high]))
        return Coefficient.of(self._sure(value, between, self.dimension), between, settled=settled)

    def bulk_viscosity(self) -> Coefficient:
        """Return the bulk viscosity, with the mean of each replica taken out of the pressure.

        The mean of a run of length T makes the mean square at time t too small by ``1 - t / T``.
        """
        squares = []
        for blocks, steps in self._replicas:
            total = self.every * steps * len(blocks)
            mean = sum(block["change"] for block in blocks) / total
            for block in blocks:
                first, second = np.asarray(block["bulk"])[:, : self.count]
                off = (mean - block["rate"]) * self.times
                squares.append([(second - 2.0 * off * first + off**2) / (1.0 - self.times / total)])
        return self.coefficient(np.array(squares), 1.0 / (self.volume * self.kT), 1)

    def self_diffusion(self, species: int = 0) -> tuple[Coefficient, Coefficient]:
        """Return self-diffusion from the mean square displacement, and from the velocity autocorrelation."""
        held = [block["moved"][species] for block in self.blocks]
        count = min(len(each["times"]) for each in held)
        times = np.array(held[0]["times"][:count])
        means = np.array([each["means"][:count] for each in held])
        d = self.dimension
        run = [jackknife(means[:, k, 3], lambda m: m / d)[0] for k in range(count)]
        begin = max(windows.WAVES * self.first["wave_time"], float(windows.STARTS[0]) * self.every)
        low = int(np.searchsorted(times, begin * (1.0 - 1e-9)))
        high = int(np.searchsorted(times, 2.0 * begin * (1.0 - 1e-9)))
        settled = high < count
        if not settled:  # blocks are too short: take the longest available times
            high = count - 1
            low = int(np.searchsorted(times, 0.5 * times[high])) if count else 0
        if high <= low or count < 2:
            empty = Coefficient.of(UNKNOWN, (math.nan, math.nan), settled=False)
            return empty, empty
        window = (float(times[low]), float(times[high]))
        span = 2.0 * d * (times[high] - times[low])
        (slope,) = jackknife(means[:, :, 0], lambda m: (m[high] - m[low]) / span)
        slope = self._sure(slope, window, d * int(self.first["counts"][species]))
        shared: dict[str, Any] = {
            "times": tuple(float(t) for t in times), "running": tuple(run), "settled": settled,
        }  # fmt: skip
        return Coefficient.of(slope, window, **shared), Coefficient.of(run[low], (0.0, window[0]), **shared)

    def mutual_diffusion(self) -> Coefficient | None:
        """Return the Maxwell-Stefan diffusion coefficient of a binary mixture."""
        counts = self.first["counts"]
        if len(counts) != 2 or min(counts) == 0:
            return None
        fluxes = self.array("fluxes")
        one, two = (float(c) for c in counts)
        relative = fluxes[:, 1, 1] / one**2 + fluxes[:, 2, 2] / two**2 - 2.0 * fluxes[:, 1, 2] / (one * two)
        return self.coefficient(relative[:, None], one * two / (one + two), self.dimension)

    def thermal_diffusion(self) -> Coefficient | None:
        """Return Onsager's coefficient of heat and the flux of the first of two species, over ``V kT``."""
        if len(self.first["counts"]) != 2:
            return None
        product = self.array("fluxes")[:, 0, 1]
        return self.coefficient(product[:, None], 1.0 / (self.volume * self.kT))

    def compressibility_factors(self) -> tuple[Estimate, Estimate, Estimate]:
        """Return Z by the virial, by the collision rate, and by both with their covariance."""
        from carom import theory

        durations = np.array([block["duration"] for block in self.blocks])
        virials = np.array([block["virial"] for block in self.blocks]) / durations
        heat = np.array([block.get("kT", self.kT) for block in self.blocks])
        z = 1.0 + virials / (self.dimension * self.n * heat)
        by_virial = jackknife(z, lambda m: m)[0]
        if not self.first["simple"]:
            return by_virial, UNKNOWN, by_virial
        rate = 2.0 * np.array([block["collisions"] for block in self.blocks]) / durations / self.n
        per = theory.collision_rate(
            2.0, self.dimension, n=self.n, diameter=self.first["diameters"][0], mass=self.first["masses"][0],
            kT=self.kT,
        )  # fmt: skip
        counted = 1.0 + rate / per
        both = combined(z, counted) if len(z) >= 8 else by_virial
        return by_virial, jackknife(counted, lambda m: m)[0], both
