"""The energy: potential, of pairs on steps and of particles in a field, and kinetic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from carom.block import Block
from carom.errors import InputError
from carom.observables.of_blocks import OfBlocks, OneNumber
from carom.observables.statistics import Estimate, ratio, unwarned
from carom.scene.velocities import degrees_of_freedom
from carom.suggestions import corrected
from carom.texts import counted

if TYPE_CHECKING:
    from carom.scene.scene import Scene


@corrected()
@dataclass(frozen=True)
class Energy(OfBlocks["EnergyResult"]):
    """Kinetic, potential and total energy of a particle: an observable of a run.

    Give it to :meth:`carom.Simulation.measure`.

    Notes
    -----
    The mean potential energy over a block is exact where the total energy is conserved and contacts are all
    that changes kT: it is the total energy less the integral of the kinetic one. In a field it is the mean of
    both ends of the block. Where energy is lost, as on hysteretic steps, the total is the mean of both ends:
    not exact in blocks in which it decays much, so take many. Without any collision of pairs, a constant
    energy has an infinite error: nothing is known. Without steps and fields it is zero.

    The kinetic energy is that about the motion of the center of mass: half of kT for each degree of freedom.

    Examples
    --------
    >>> import carom
    >>> from carom.models import SquareWell
    >>> scene = carom.Scene.crystal(108, density=0.3, interaction=SquareWell(1.5, 1.0))
    >>> sim = carom.Simulation(scene, seed=1)
    >>> sim.equilibrate(kT=3.0, collisions_per_particle=100)
    >>> sim.measure(Energy(), collisions_per_particle=2000).U.mean < -1.5
    True
    """

    _what = "the energy"

    def _of(self, blocks: Sequence[Block], scene: Scene, kT: float) -> EnergyResult:
        durations = np.array([block.duration for block in blocks])
        half = 0.5 * degrees_of_freedom(scene) / scene.n
        if without_potential(scene):
            heat = [kT * block.duration if block.kT_time is None else block.kT_time for block in blocks]
            thermal = ratio(heat, durations)
            kinetic = thermal.scaled(half)
            return EnergyResult(Estimate.exact(0.0), kinetic, kinetic, thermal, scene.n)
        energies = [block.energy for block in blocks if block.energy is not None]
        if len(energies) < len(blocks):
            raise InputError("Blocks hold no energies; use those that Simulation.blocks() yields.")
        means = np.array([each.potential for each in energies]) / scene.n
        temperatures = np.array([each.kT for each in energies])
        thermal = ratio(temperatures * durations, durations)
        found = ratio(means * durations, durations)
        with unwarned():  # what is conserved changes by rounding alone
            total = ratio((means + half * temperatures) * durations, durations)
        if not np.ptp(means) and not any(block.collisions for block in blocks):
            found, total = (Estimate(x.mean, math.inf, 0.0, math.inf, len(blocks)) for x in (found, total))
        return EnergyResult(
            found, thermal.scaled(half), total, thermal, scene.n,
            tuple(means.tolist()), tuple(durations.tolist()),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class EnergyResult(OneNumber):
    """Energies of a particle, averaged over a stretch of a run.

    Parameters
    ----------
    U : Estimate
        Mean potential energy over n [energy].
    kinetic : Estimate
        Mean kinetic energy about the motion of the center of mass, over n [energy].
    total : Estimate
        Mean of their sum, over n [energy]. Where it is conserved, its error is that of rounding.
    kT : Estimate
        Mean temperature of the same stretch [energy].
    n : int
        Number of particles.
    block_values, block_durations : tuple of float
        Potential energy over n [energy] and duration [time] of each block; empty where there is none.
    """

    U: Estimate
    kinetic: Estimate
    total: Estimate
    kT: Estimate
    n: int
    block_values: tuple[float, ...] = field(default=(), repr=False)
    block_durations: tuple[float, ...] = field(default=(), repr=False)

    _main = "U"
    quantity = "the potential energy"
    _ylabel = "potential energy U of a particle"

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("potential U [energy]", self.U),
            ("kinetic [energy]", self.kinetic),
            ("total [energy]", self.total),
            ("kT [energy]", self.kT),
        ]
        return f"Energy of one of {counted(self.n, 'particle')}", [(name, e.value_text) for name, e in rows]

    def __str__(self) -> str:
        return (
            f"U = {self.U.value_text}, kinetic = {self.kinetic.value_text} energy a particle\n"
            f"at kT = {self.kT.value_text} energy"
        )

    @property
    def primary(self) -> Estimate:
        """The quantity that a ``relative_error`` refers to: U, or the kinetic energy where U is zero."""
        return self.kinetic if Estimate.exact(0.0) == self.U else self.U


def without_potential(scene: Scene) -> str | None:
    """Return why a scene has no potential energy (no steps, no field that has one); None if it has."""
    stepped = hasattr(scene.interaction, "steps") and not getattr(scene.interaction, "decides", False)
    if stepped or hasattr(scene.motion, "potential_energy"):
        return None
    return (
        "Nothing in this scene has a potential energy: pairs have no steps, as of SquareWell(), and there is "
        "no field, as Gravity()."
    )
