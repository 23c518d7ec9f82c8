"""The course of kT and diameters along a stretch in which they change, and averages over its blocks.

Inelastic contacts cool and growth heats. The kinetic energy is constant between contacts, so that its
integral over a block is known exactly. This module combines blocks of different temperature.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carom.arithmetic import dot, least_squares, power
from carom.block import Block
from carom.observables.statistics import Estimate, blocking, ratio

TREND = 3
"""Degree in time of the trend of Z while diameters grow. The trend is a smooth curve, and no scatter."""

FEW = 16  # number of blocks below which the trend is a straight line


@dataclass(frozen=True)
class Course:
    """Temperature and sizes along a stretch of m blocks; averages are over its time."""

    durations: np.ndarray  # (m,) [time]
    heat: np.ndarray  # (m,), kT over that of the stretch; ones if constant
    filling: np.ndarray  # (m,), the same for the packing fraction
    kT: float
    packing_fraction: float
    cube: float  # of the largest diameter to the power d
    equal: bool  # whether all diameters are the same
    changes: bool  # blocks have their own kT
    cools: bool  # the energy changes at constant diameters
    grows: bool  # diameters do
    source: str = "Contacts change"  # what changes the energy, with its verb

    @classmethod
    def of(
        cls,
        blocks: Sequence[Block],
        kT: float,
        packing_fraction: float,
        cube: float,
        exchanges: bool = False,
        source: str = source,
    ) -> Course:
        """Return the course of blocks; blocks without their own kT and sizes have the given ones.

        ``exchanges`` tells whether kT only fluctuates, in exchange with a potential energy.
        """
        durations = np.array([block.duration for block in blocks])
        same = np.ones(len(blocks))
        heat, filling, equal = same, same, True
        grows = all(block.sizes is not None for block in blocks)
        changes = all(block.kT_time is not None for block in blocks)
        if changes:
            times = np.array([block.kT_time for block in blocks], dtype=np.float64)
            kT = float(times.sum() / durations.sum())
            heat = times / durations / kT
        if grows:
            sizes = [block.sizes for block in blocks if block.sizes is not None]
            filled = np.array([each.packing_fraction for each in sizes])
            packing_fraction = dot(durations, filled) / float(durations.sum())
            cube = dot(durations, np.array([each.cube for each in sizes])) / float(durations.sum())
            filling, equal = filled / packing_fraction, all(each.equal for each in sizes)
        cools = changes and not grows and not exchanges
        return cls(durations, heat, filling, kT, packing_fraction, cube, equal, changes, cools, grows, source)

    @property
    def note(self) -> str:
        """A sentence on the meaning of Z and P; empty where nothing changes."""
        if self.cools:
            first, last = self.kT * self.heat[0], self.kT * self.heat[-1]
            return (
                f"{self.source} the energy (kT from {first:.3g} to {last:.3g}): Z is PV / NkT with the kT "
                "of each moment, averaged over collisions; P and kT are averages over time."
            )
        if self.grows:
            first, last = self.packing_fraction * self.filling[0], self.packing_fraction * self.filling[-1]
            return (
                f"Diameters grow (packing fraction from {first:.4g} to {last:.4g}): P, kT and the packing "
                "fraction are averages over time, and Z = PV / NkT of them; g(sigma+) is averaged with the "
                "weight of kT times packing fraction."
            )
        return ""

    def excess(self, virials: np.ndarray) -> Estimate:
        """Return Z - 1 as ``sum(virials) / sum(heat durations)``, for virials in units of ``d N kT``.

        Blocks of a cooling gas are weighted by collisions: else its hot beginning would dominate.
        """
        pace = np.sqrt(self.heat) if self.cools else np.ones(len(self.heat))
        return self.average(virials / pace, self.durations * self.heat / pace)

    def pressure(self, virials: np.ndarray) -> Estimate:
        """Return P V over N times the mean kT, for virials in units of ``d N kT``: averages over time.

        Where kT is not constant, this is no multiple of Z: it fluctuates together with the virial.
        """
        return self.average(self.durations * self.heat + virials, self.durations)

    def contact(self, virials: np.ndarray) -> Estimate:
        """Return :meth:`excess` with the packing fraction of each block, over that of the stretch."""
        return self.average(virials, self.durations * self.heat * self.filling)

    def rate(self, collisions: np.ndarray, dimension: int) -> Estimate:
        """Return the collision rate at the average temperature and diameter."""
        return self.average(
            collisions, self.durations * np.sqrt(self.heat) / self.filling ** (1.0 / dimension)
        )

    def average(self, sums: np.ndarray, weights: np.ndarray) -> Estimate:
        """Return the ratio of two sums over blocks; while diameters grow, its error is that about a trend."""
        count = len(sums)
        if not self.grows or count < 4:
            return ratio(sums, weights)
        degree = TREND if count >= FEW else 1
        mean = float(sums.sum() / weights.sum())
        deviations = (sums - mean * weights) / weights.mean()
        ends = np.cumsum(self.durations)
        places = (ends - 0.5 * self.durations) / ends[-1]
        columns = np.stack([power(2.0 * places - 1.0, k) for k in range(degree + 1)], axis=1)
        curve = np.sum(columns * least_squares(columns, deviations), axis=1)
        free = math.sqrt(count / (count - degree - 1.0))
        scatter = blocking(mean + free * (deviations - curve))
        return Estimate(mean, scatter.error, scatter.n_eff, scatter.tau, scatter.blocks)
