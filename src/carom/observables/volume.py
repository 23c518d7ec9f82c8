"""The volume at constant pressure, and the pressure from collisions while it changes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from carom.arithmetic import dot
from carom.block import Block
from carom.errors import InputError
from carom.observables.of_blocks import OfBlocks, OneNumber
from carom.observables.statistics import Estimate, ratio
from carom.suggestions import corrected
from carom.texts import counted

if TYPE_CHECKING:
    from carom.scene.scene import Scene


@corrected()
@dataclass(frozen=True)
class Volume(OfBlocks["VolumeResult"]):
    """The mean volume under a barostat, and the pressure: an observable of a run.

    Give it to :meth:`carom.Simulation.measure`.

    Notes
    -----
    The volume is the mean over time. The pressure is the mean of ``(n kT + W / d) / V`` over time, with the
    virial W of a time from the collisions and the volume V of the moment. Its expectation is the pressure of
    the barostat, for any number of particles: the weight of a volume is ``Q(V) exp(-P V / kT)`` with the
    canonical Q, and the pressure at fixed volume is ``kT d ln Q / dV``. By parts ``<kT d ln Q / dV> = P``,
    because the weight is zero at both ends. At constant energy and momentum the virial at fixed volume is the
    canonical one with kT from d (n - 1) degrees of freedom, as in :class:`~carom.Pressure`. Frenkel and Smit,
    Understanding Molecular Simulation, 2nd ed. (2002), sec. 5.4: the virial pressure at constant pressure.

    Examples
    --------
    >>> import carom
    >>> scene = carom.Scene.random(8, packing_fraction=0.2)
    >>> barostat = carom.Barostat(pressure=1.0, interval=0.2, step=0.4)
    >>> sim = carom.Simulation(scene, seed=1, barostat=barostat)
    >>> block = sim.run(time=20.0)
    >>> found = sim.measure(Volume(), time=200.0)
    >>> abs(found.pressure.mean - 1.0) < 5 * found.pressure.error
    True
    """

    _what = "the volume"

    def _of(self, blocks: Sequence[Block], scene: Scene, kT: float) -> VolumeResult:
        durations = [block.duration for block in blocks]
        sums = [block.volumes for block in blocks if block.volumes is not None]
        if len(sums) < len(blocks):
            raise InputError("No block holds the volume: run with a barostat before measuring it.")
        volumes = np.array([each.volume for each in sums])
        pressures = np.array([scene.n * kT * each.inverse + each.virial / scene.dimension for each in sums])
        volume = ratio(volumes, durations)
        pressure = _beside(pressures, volumes, np.array(durations), volume)
        fraction = scene.packing_fraction * scene.volume / volume.mean
        return VolumeResult(
            volume=volume,
            packing_fraction=volume.scaled(fraction / volume.mean),
            pressure=pressure,
            n=scene.n,
            dimension=scene.dimension,
            kT=kT,
            block_values=tuple((volumes / np.array(durations)).tolist()),
            block_durations=tuple(durations),
        )


def _beside(pressures: np.ndarray, volumes: np.ndarray, durations: np.ndarray, volume: Estimate) -> Estimate:
    """Return the mean pressure with the error that the slow volume brings, from sums over blocks.

    The pressure of a block fluctuates fast, but for a part in proportion to the volume of the block, which
    may be hidden in the scatter: it has the error, and as few independent samples, as the ``volume``.
    """
    found = ratio(pressures, durations)
    off = volumes - volume.mean * durations
    square = dot(off, off)
    slope = dot(off, pressures - found.mean * durations) / square if square > 0.0 else 0.0
    rest = ratio(pressures - slope * off, durations)
    error = max(found.error, math.hypot(rest.error, slope * volume.error))
    few = min(found.n_eff, volume.n_eff)
    return Estimate(found.mean, error, few, len(durations) / few if few else math.inf, found.blocks)


@dataclass(frozen=True, eq=False)
class VolumeResult(OneNumber):
    """Volume and pressure under a barostat, averaged over a stretch of a run.

    Parameters
    ----------
    volume : Estimate
        Mean volume of the box [length^d].
    packing_fraction : Estimate
        That of the mean volume.
    pressure : Estimate
        Mean pressure from collisions, whose expectation is that of the barostat [energy / length^d].
    n, dimension : int
        Number of particles, and of dimensions.
    kT : float
        Temperature [energy].
    block_values, block_durations : tuple of float
        Mean volume [length^d] and duration [time] of each block.
    """

    volume: Estimate
    packing_fraction: Estimate
    pressure: Estimate
    n: int
    dimension: int
    kT: float
    block_values: tuple[float, ...] = field(default=(), repr=False)
    block_durations: tuple[float, ...] = field(default=(), repr=False)

    _main = "volume"
    _ylabel = "volume V"
    quantity = "the volume, which the pressure follows,"

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("V [length^d]", self.volume),
            ("packing fraction", self.packing_fraction),
            ("P [energy / length^d]", self.pressure),
        ]
        title = f"{counted(self.n, 'particle')} at constant pressure"
        return title, [(name, e.value_text) for name, e in rows]

    def __str__(self) -> str:
        return (
            f"V = {self.volume.value_text} length^{self.dimension}, packing fraction "
            f"{self.packing_fraction.value_text}\n"
            f"P = {self.pressure.value_text} energy / length^{self.dimension}"
        )
