"""Events at the steps of pair potentials: g(r) on both sides, the pressure from it, and the heat capacity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from carom.densities import unit_ball_volume
from carom.errors import InputError
from carom.theory import speed_factor


class Sides(NamedTuple):
    """g(r) on both sides of a distance at which the energy of a pair changes.

    Attributes
    ----------
    distance : float
        The distance [length].
    inside, outside : float
        g just below and just above it; 0 inside a hard core.
    inside_error, outside_error : float
        Standard errors, as if events were independent of each other.
    """

    distance: float
    inside: float
    outside: float
    inside_error: float
    outside_error: float


@dataclass(frozen=True, eq=False)
class StepSums:
    """Events at the ends of every step since the start of a run.

    Later sums minus earlier ones are those of the stretch between. Steps are numbered from the outside
    inwards.

    Attributes
    ----------
    time : float
        Time since the start [time].
    kT_time : float
        Integral of kT over this time [energy time]; NaN in a field, which changes kT between contacts.
    n, dimension : int
        Number of particles, and of dimensions.
    volume, mass : float
        Volume of the box [length^d], and mass of a particle; NaN if masses differ.
    degrees_of_freedom : float
        D of the velocities at constant energy; infinity where a bath or a drive exchanges energy.
    inner, outer : (S,) arrays
        Inner and outer end of each step [length]; 0 and infinity if it has none.
    energies : (S,) array
        Energy of a pair on each step [energy].
    pairs : (S,) int array
        Pairs on each step now. Pairs beyond reach of each other are not counted.
    events : (S, 4) int array
        Events of pairs on each step, by kind: thrown back at the inner end (core), across it (in), across the
        outer end (out), thrown back there (bounce).
    """

    time: float
    kT_time: float
    n: int
    dimension: int
    volume: float
    mass: float
    degrees_of_freedom: float
    inner: np.ndarray
    outer: np.ndarray
    energies: np.ndarray
    pairs: np.ndarray
    events: np.ndarray

    def __sub__(self, before: StepSums) -> StepSums:
        """Return the stretch between two times; ``pairs`` are those at its end."""
        return replace(
            self,
            time=self.time - before.time,
            kT_time=self.kT_time - before.kT_time,
            events=self.events - before.events,
        )

    @property
    def core(self) -> int:
        """Events in which a pair was thrown back at the inner end of its step."""
        return int(self.events[:, 0].sum())

    @property
    def into(self) -> int:
        """Events in which a pair crossed a distance inwards."""
        return int(self.events[:, 1].sum())

    @property
    def out(self) -> int:
        """Events in which a pair crossed a distance outwards."""
        return int(self.events[:, 2].sum())

    @property
    def bounce(self) -> int:
        """Events in which a pair was thrown back at the outer end of its step."""
        return int(self.events[:, 3].sum())

    @property
    def kT(self) -> float:
        """Average of kT over the time [energy]."""
        return self.kT_time / self.time

    @property
    def bonds_per_particle(self) -> float:
        """Mean number of particles within reach of one now; a pair in a well counts as bonded."""
        return 2.0 * float(self.pairs.sum()) / self.n

    def sides(self) -> list[Sides]:
        """Return g(r) on both sides of every distance, from the numbers of pairs that arrive there.

        Notes
        -----
        There are ``n (n - 1) / (2 V) S_d r^(d-1) g(r) dr`` pairs at a distance r. Their flux inwards is
        ``c_D sqrt(kT / (pi m))`` times their density (:func:`carom.theory.speed_factor`). All particles must
        be of one kind, without bonds.

        Raises
        ------
        InputError
            If there is more than one kind of pair, or masses differ.
        """
        if math.isnan(self.mass):
            raise InputError("g(r) at steps is for components of one mass.")
        if np.isinf(self.outer).sum() != 1 or not np.isinf(self.outer[0]):
            raise InputError("g(r) at steps is for one kind of pair, without bonds.")
        found = []
        speed = speed_factor(self.degrees_of_freedom) * math.sqrt(self.kT / (math.pi * self.mass))
        for step in range(len(self.inner)):
            distance = float(self.inner[step])
            if distance == 0.0:
                continue
            area = self.dimension * unit_ball_volume(self.dimension) * distance ** (self.dimension - 1)
            pairs = 0.5 * self.n * (self.n - 1) / self.volume * area
            rate = pairs * speed * self.time
            outside = int(self.events[step, :2].sum())
            inside = int(self.events[step + 1, 2:].sum()) if step + 1 < len(self.inner) else 0
            found.append(
                Sides(
                    distance,
                    inside / rate,
                    outside / rate,
                    math.sqrt(inside) / rate,
                    math.sqrt(outside) / rate,
                )
            )
        return found

    def compressibility_factor(self) -> float:
        """Return Z = P V / (n kT) from g(r) at the steps: ``1 + (rho S_d / 2 d) sum r^d (g(r+) - g(r-))``.

        Raises
        ------
        InputError
            As from :meth:`sides`.
        """
        density = (self.n - 1) / self.volume
        jumps = sum(side.distance**self.dimension * (side.outside - side.inside) for side in self.sides())
        return 1.0 + 0.5 * density * unit_ball_volume(self.dimension) * jumps


def heat_capacity(kT: Sequence[float], degrees_of_freedom: int) -> float:
    """Return the heat capacity at constant volume of all particles [k], from kT at many times of one run.

    Parameters
    ----------
    kT : sequence of floats
        Temperatures at equally spaced times, over many relaxation times [energy].
    degrees_of_freedom : int
        f, as :attr:`carom.Simulation.degrees_of_freedom`.

    Notes
    -----
    At constant energy ``var(K) / <K>^2 = (2 / f) (1 - f / 2 C_V)`` (Lebowitz, Percus and Verlet, Phys. Rev.
    153 (1967) 250), with C_V in units of k.

    Raises
    ------
    InputError
        If there are fewer than two values.
    """
    values = np.asarray(kT, dtype=np.float64)
    if values.ndim != 1 or len(values) < 2:
        raise InputError("A heat capacity needs kT at two times at least, better at a thousand.")
    half = 0.5 * degrees_of_freedom
    left = 1.0 - half * float(values.var() / values.mean() ** 2)
    return half / left if left > 0.0 else math.inf
