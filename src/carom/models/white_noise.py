"""White noise: kicks that heat, of single particles or of pairs, which get opposite momenta."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import seeds
from carom.declared import SEED, switch
from carom.errors import InputError
from carom.models.declared_values import ABOVE, Value
from carom.models.drives import DriveModel, Noise, noise_of
from carom.models.interfaces.memory import kept, parameter
from carom.models.interfaces.particles import Particles
from carom.models.mathematics.counter_random import normal, uniform


class PairNoise(DriveModel):
    """In every interval each component meets a random other, and the two are kicked by opposite momenta.

    Each kick is an event of one component; both are at one instant. Who meets whom is a round of a
    round-robin tournament, drawn by counting: each partner is as likely, and nothing is stored.
    """

    width: Annotated[float, parameter(-1)]
    """Standard deviation of the noise along each axis for equal masses [length / time]."""
    root_masses: np.ndarray
    """Square roots of the masses, (n,)."""
    interval: Annotated[float, parameter(1)]
    """Time from one kick of a component to the next, on average [time]."""
    seed: int
    """Seed of the random numbers."""
    due: Annotated[np.ndarray, kept(1)]
    """When each component has its next event, (n,) [time]."""
    drawn: Annotated[np.ndarray, kept()]
    """How many each has had, (n,) int64."""

    def next_time(self, i, x, v, time):
        return self.due[i]

    def kick(self, i, mass, x, v, time):
        k = self.drawn[i]
        j = partner(self, i, k)
        if j != i:
            share = self.width * self.root_masses[j] / self.root_masses[i]
            if i > j:
                share = -share
            for axis in range(len(v)):
                v[axis] += share * normal(self.seed, min(i, j), 2 * (k * len(v) + axis))
        self.drawn[i] = k + 1
        self.due[i] = due(self, i, k + 1)


def opponent(i, n, r):
    """Return the opponent of i of n in round r of a tournament; i where it has none."""
    m = rounds(n)
    if i == m:  # the last of an even number meets the one who would meet itself
        return (r * ((m + 1) // 2)) % m
    j = (r - i) % m
    return m if j == i and m < n else j


def rounds(n):
    """Return in how many rounds each of n meets each other once."""
    return n - 1 + n % 2


def partner(drive, i, k):
    """Return who is kicked together with i in interval k; i itself where nobody is."""
    n = len(drive.due)
    m = rounds(n)
    return opponent(i, n, int(uniform(drive.seed, n, k) * m) % m)


def due(drive, i, k):
    """Return when i and its partner are kicked in interval k: a function of the two, the same for both."""
    first = min(i, partner(drive, i, k))
    return (np.float64(k) + (np.float64(first) + 0.5) / len(drive.due)) * drive.interval


@dataclass(frozen=True)
class WhiteNoise(Value):
    """White noise, which heats: a granular gas comes to rest where it heats as much as contacts lose.

    Parameters
    ----------
    power : float
        Variance that the velocity gains along each axis a time, xi^2 [length^2 / time^3].
    rate : float
        Kicks of each particle a time [1 / time]. Take many in a mean free time.
    seed : int
        Seed of the random numbers; every particle has its own stream.
    pairs : bool
        Whether two particles, drawn anew each time, get opposite momenta, which conserves the total.

    Raises
    ------
    InputError
        If a parameter is out of range.

    Notes
    -----
    The energy grows by ``d m power / 2`` a particle and time, m being the mean mass. Without ``pairs`` the
    total momentum wanders, and the square of the drift, ``power time / n`` along each axis, counts for kT.
    With ``pairs`` the momentum of a kick has the variance ``m_i m_j power / rate`` along each axis. Van Noije
    and Ernst, Granular Matter 1 (1998) 57.

    Examples
    --------
    >>> WhiteNoise(power=0.1, rate=20.0)
    WhiteNoise(power=0.1, rate=20.0, seed=1, pairs=False)
    """

    type = "white-noise"
    after = " of WhiteNoise"
    power: Annotated[float, ABOVE]
    rate: Annotated[float, ABOVE]
    seed: Annotated[int, SEED] = 1
    pairs: Annotated[bool, switch] = False

    @property
    def conserves_momentum(self) -> bool:
        """Whether the total momentum is conserved: with ``pairs``."""
        return self.pairs

    def check(self, scene: Any) -> None:
        """Raise :class:`InputError` if there is nobody to be kicked together with."""
        if self.pairs and scene.n < 2:
            raise InputError("WhiteNoise(pairs=True) kicks particles in pairs, but the scene has only one.")

    def pace(self, scene: Any) -> float:
        """Return the speed that a particle gains in a kick, in any ``scene`` [length / time]."""
        return math.sqrt(self.power / self.rate)

    def model(self, particles: Particles) -> Noise | PairNoise:
        """Return the model that the engine compiles."""
        if self.pairs:
            return self._in_pairs(particles)
        return noise_of(particles, 1.0, self.power / self.rate, 1.0 / self.rate, False, self.seed)

    def _in_pairs(self, particles: Particles) -> PairNoise:
        n = len(particles.radii)
        heated = n - n % 2  # of an odd number, one gets nothing: the others get more
        width = math.sqrt(self.power / self.rate * n / heated)
        key = seeds.word(self.seed, "drives")
        drive = PairNoise(
            width, np.sqrt(particles.masses), 1.0 / self.rate, key, np.zeros(n), np.zeros(n, np.int64)
        )
        drive.due[:] = [due(drive, i, 0) for i in range(n)]
        return drive
