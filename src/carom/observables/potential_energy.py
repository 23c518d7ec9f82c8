"""The potential energy of pairs on steps and of components in a field, and kT of the same time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from carom import checks
from carom.block import Block
from carom.errors import InputError
from carom.notebook import table
from carom.observables.statistics import Estimate, ratio

if TYPE_CHECKING:
    from carom.scene.scene import Scene


@dataclass(frozen=True)
class PotentialEnergy:
    """Request to measure the potential energy, for :meth:`carom.Simulation.measure`.

    Parameters
    ----------
    blocks : int
        Number of blocks of equal time into which the run is cut; their scatter gives the error bar.

    Raises
    ------
    InputError
        If `blocks` is not an integer of at least 2.

    Examples
    --------
    >>> import carom
    >>> from carom.models import SquareWell
    >>> scene = carom.Scene.crystal(108, density=0.3, interaction=SquareWell(1.5, 1.0))
    >>> sim = carom.Simulation(scene, seed=1)
    >>> sim.equilibrate(3.0, collisions_per_particle=100)
    >>> sim.measure(PotentialEnergy(), collisions_per_particle=2000).per_particle.mean < -1.5
    True
    """

    blocks: int = 256

    def __post_init__(self) -> None:
        checks.integer(self.blocks, "blocks", low=2)

    def prepare(self, scene: Scene) -> None:
        """Raise InputError if nothing in a ``scene`` has a potential energy."""
        if reason := without_potential(scene):
            raise InputError(reason)

    def of_scene(self, blocks: Sequence[Block], scene: Scene, *, kT: float) -> PotentialEnergyEstimate:
        """Potential energy of a scene, from blocks of its run.

        Parameters
        ----------
        blocks : sequence of Block
            Stretches of the run, with their ``energy``.
        scene : Scene
            The scene of the run.
        kT : float
            Not used: blocks hold their own.

        Raises
        ------
        InputError
            If nothing has a potential energy, or no block of positive duration holds it.

        Warns
        -----
        CaromWarning
            If there are too few independent blocks.

        Notes
        -----
        The mean over a block is exact where the total energy is conserved and contacts are all that changes
        kT: it is the total energy less the integral of the kinetic one. In a field it is the mean of both
        ends of the block. Without any collision of pairs, a constant energy has an infinite error: nothing
        is known.
        """
        self.prepare(scene)
        kept = [block for block in blocks if block.duration > 0.0]
        energies = [block.energy for block in kept if block.energy is not None]
        if not kept or len(energies) < len(kept):
            raise InputError("Blocks of run() hold no energies: use measure().")
        durations = np.array([block.duration for block in kept])
        means = np.array([each.potential for each in energies]) / scene.n
        temperatures = np.array([each.kT for each in energies])
        if not np.ptp(means) and not any(block.collisions for block in kept):
            found = Estimate(float(means[0]), math.inf, 0.0, math.inf, len(kept))
        else:
            found = ratio(means * durations, durations)
        return PotentialEnergyEstimate(
            found, ratio(temperatures * durations, durations), scene.n, tuple(means.tolist())
        )


@dataclass(frozen=True)
class PotentialEnergyEstimate:
    """The potential energy of a run, and its temperature.

    Parameters
    ----------
    per_particle : Estimate
        Mean potential energy U / n [energy].
    kT : Estimate
        Mean temperature of the same stretch [energy].
    n : int
        Number of particles.
    block_values : tuple of float
        U / n in each block.
    """

    per_particle: Estimate
    kT: Estimate
    n: int
    block_values: tuple[float, ...] = field(default=(), repr=False)

    def _repr_html_(self) -> str:
        rows = [("U / N [energy]", self.per_particle), ("kT [energy]", self.kT)]
        shown = [(name, e.value_text.replace("+-", "±")) for name, e in rows]
        return table(f"Potential energy of {self.n} particles", shown)

    def __str__(self) -> str:
        return f"U / N = {self.per_particle.value_text} at kT = {self.kT.value_text}"

    @property
    def total(self) -> Estimate:
        """Potential energy of all particles, U [energy]."""
        return self.per_particle.scaled(self.n)

    @property
    def primary(self) -> Estimate:
        """The quantity that a ``relative_error`` refers to: U / n."""
        return self.per_particle

    @property
    def quantity(self) -> str:
        """Name of the measured quantity, for messages."""
        return "the potential energy"


def without_potential(scene: Scene) -> str | None:
    """Return a sentence on why a scene has no potential energy; None if it has one.

    Pairs on steps have one, and components in the field of a motion with ``potential_energy``.
    """
    stepped = hasattr(scene.interaction, "steps") and not getattr(scene.interaction, "decides", False)
    if stepped or hasattr(scene.motion, "potential_energy"):
        return None
    return (
        "Nothing in this scene has a potential energy: pairs have no steps, as of SquareWell(), and there is "
        "no field, as Gravity()."
    )
