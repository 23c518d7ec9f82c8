"""Drives: events of one component at times of its own, which change its velocity. Thermostats and noise.

A drive is a value with a method ``model(particles)``. The model is a :class:`DriveModel` of numbers and of
arrays, and answers two questions: when component i has its next event (``next_time``), and what happens then
(``kick``). Both are in the units of the scene. The arrays are the memory of the drive: a run adds to
them, and a checkpoint keeps them.

Every drive here replaces a velocity by ``keep v + width normal``. Its events come at times that do not
depend on the state, so that with ``keep`` below 1 and ``width**2 = kT (1 - keep**2) / m`` the canonical
distribution stays as it is, whatever the times: averages of the state are exact, dynamics depends on the
times. Andersen, J. Chem. Phys. 72 (1980) 2384; Scala, Phys. Rev. E 86 (2012) 026709.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Protocol

import numpy as np

from carom import checks, seeds
from carom.compiling.registry import Questions
from carom.declared import SEED, Check, number, said, schema_of_several
from carom.errors import InputError
from carom.models.declared_values import ABOVE, Value
from carom.models.interfaces.memory import kept, parameter
from carom.models.interfaces.particles import NEVER, Particles, species_count
from carom.models.mathematics.counter_random import normal, uniform


class Drive(Protocol):
    """What a scene takes as its ``drive``.

    It may have ``check(scene)``, which raises :class:`carom.errors.InputError`, ``pace(scene)``, a speed that
    it gives to components that rest [length / time], and ``conserves_momentum``.
    """

    def model(self, particles: Particles) -> Any:
        """Return the model that the engine compiles, a :class:`DriveModel`."""


class DriveModel(Questions):
    """What a drive answers."""

    def next_time(self, i, x, v, time):
        """Return when component i has its next event, since the start of the run [time], or NEVER.

        ``x`` in the box and ``v`` are (d,) arrays at ``time``, since the start of the run. It is asked
        whenever i has another velocity, and at other times: the answer must not depend on when, nor lie in
        the past.
        """
        return NEVER

    def kick(self, i, mass, x, v, time):
        """Let the event of i happen at ``time`` since the start: write its new velocity into ``v``.

        ``x`` in the box and ``v`` are (d,) arrays. The arrays of ``drive`` may be written to.
        """
        raise NotImplementedError


class Noise(DriveModel):
    """A velocity becomes ``keep v + width normal`` at events of each component."""

    keep: float  # part of the velocity that remains
    width: Annotated[np.ndarray, parameter(-1)]
    """Standard deviation of the noise along each axis, (n,) [length / time]."""
    interval: Annotated[float, parameter(1)]
    """Time between two events of a component; its mean, where they are random [time]."""
    random: bool  # whether the events are those of a Poisson process
    seed: int  # seed of the random numbers
    due: Annotated[np.ndarray, kept(1)]  # when each component has its next event, (n,) [time]
    drawn: Annotated[np.ndarray, kept()]  # how many each has had, (n,) int64

    def next_time(self, i, x, v, time):
        return self.due[i]

    def kick(self, i, mass, x, v, time):
        k = self.drawn[i]
        self.drawn[i] = k + 1
        draw_index = k * (2 * len(v) + 1)
        for axis in range(len(v)):
            v[axis] = self.keep * v[axis] + self.width[i] * normal(self.seed, i, draw_index + 2 * axis)
        if self.random:
            self.due[i] -= self.interval * math.log(uniform(self.seed, i, draw_index + 2 * len(v)))
        else:  # by counting, so that no rounding adds up; never all at one instant
            self.due[i] = (np.float64(k + 1) + (np.float64(i) + 0.5) / len(self.due)) * self.interval


def noise_of(
    particles: Particles,
    keep: float,
    variance: float | np.ndarray,
    interval: float,
    random: bool,
    seed: int,
) -> Noise:
    """Return the model of a drive whose noise has a ``variance`` along each axis, one or (n,)."""
    n = len(particles.radii)
    key = seeds.word(seed, "drives")
    if random:
        uniforms = [uniform(key, i, (1 << 62)) for i in range(n)]
        first_kicks = -interval * np.log(uniforms)
    else:
        first_kicks = (np.arange(n) + 0.5) / n * interval
    width = np.sqrt(np.broadcast_to(variance, n))
    return Noise(keep, width, interval, random, key, first_kicks, np.zeros(n, np.int64))


def by_species(most: float) -> Check:
    """Return the check of a number of 0 to ``most``, or of one a species."""
    one = number(low=0.0, high=most)

    def check(value: Any, what: str) -> Any:
        if not checks.several(value):
            return one(value, what)
        values = tuple(float(each) for each in checks.array(value, what, "(K,)", ndim=1))
        if not values or not all(0.0 <= each <= most for each in values):
            raise InputError(
                f"{what} must be one number, or one a species, of 0 to {most:g}; found "
                f"{checks.describe(value)}."
            )
        return values

    return said(check, **schema_of_several(one))


Temperatures = Annotated[Any, by_species(checks.HOTTEST)]


def of_each(value: float | tuple[float, ...], particles: Particles) -> np.ndarray:
    """Return what is one number, or one a species, of every component, (n,)."""
    n = len(particles.radii)
    if isinstance(value, tuple):
        species = np.zeros(n, np.int64) if particles.species is None else particles.species
        return np.array(value)[species]
    return np.full(n, value)


class Bath(Value):
    """What drives with a temperature have in common."""

    kT: Any
    seed: int

    def check(self, scene: Any) -> None:
        """Raise InputError if something is given for each species, and not for those of the scene."""
        kinds = species_count(scene)
        for field, value in vars(self).items():
            if isinstance(value, tuple) and len(value) != kinds:
                raise InputError(
                    f"{field} of {type(self).__name__} holds {len(value)} numbers, and the scene has "
                    f"{kinds} species: give one {field}, or one a species."
                )

    def pace(self, scene: Any) -> float:
        """Return the speed of the lightest particle of a ``scene`` in the hottest bath [length / time]."""
        return math.sqrt(float(np.max(self.kT)) / float(scene.masses.min()))

    def _thermal(
        self, particles: Particles, keep: float, noise_fraction: float, interval: float, random: bool = False
    ) -> Noise:
        """Return the model of kicks that keep a part of the velocity, and lose one of its variance."""
        variance = of_each(self.kT, particles) * noise_fraction / particles.masses
        return noise_of(particles, keep, variance, interval, random, self.seed)


@dataclass(frozen=True)
class Andersen(Bath):
    """A thermostat: at random times a particle gets a new velocity from Maxwell's distribution.

    Parameters
    ----------
    kT : float or sequence of floats
        Temperature [energy]; one a species, if there are several.
    rate : float
        Events of each particle a time, those of a Poisson process [1 / time].
    seed : int
        Seed of the random numbers; every particle has its own stream.

    Raises
    ------
    InputError
        If a parameter is out of range.

    Notes
    -----
    A free particle has ``<v(0) v(t)> = (kT / m) exp(-rate t)`` and the diffusion coefficient
    ``kT / (m rate)``. Andersen, J. Chem. Phys. 72 (1980) 2384.

    Examples
    --------
    >>> import carom
    >>> scene = carom.Scene.random(64, 0.2, drive=Andersen(kT=2.0, rate=1.0))
    >>> sim = carom.Simulation(scene)
    >>> sim.run(time=2.0).collisions > 0
    True
    """

    type = "andersen"
    after = " of Andersen"
    kT: Temperatures
    rate: Annotated[float, ABOVE]
    seed: Annotated[int, SEED] = 1

    def model(self, particles: Particles) -> Noise:
        """Return the model that the engine compiles."""
        return self._thermal(particles, 0.0, 1.0, 1.0 / self.rate, random=True)


@dataclass(frozen=True)
class Langevin(Bath):
    """Friction and noise, in steps: the Ornstein-Uhlenbeck process of the velocity, between contacts.

    Parameters
    ----------
    kT : float or sequence of floats
        Temperature [energy]; one a species, if there are several.
    friction : float
        Rate at which a velocity is forgotten [1 / time].
    step : float
        Time between two kicks of a particle [time].
    seed : int
        Seed of the random numbers; every particle has its own stream.

    Raises
    ------
    InputError
        If a parameter is out of range.

    Notes
    -----
    A kick keeps the part ``c = exp(-friction step)`` of the velocity. A free particle diffuses with
    ``(kT step / 2 m) (1 + c) / (1 - c)``. Particles are kicked one after the other.

    Examples
    --------
    >>> Langevin(kT=1.0, friction=2.0, step=0.05).diffusion(mass=1.0)
    0.500416...
    """

    type = "langevin"
    after = " of Langevin"
    kT: Temperatures
    friction: Annotated[float, ABOVE]
    step: Annotated[float, ABOVE]
    seed: Annotated[int, SEED] = 1

    def diffusion(self, mass: float = 1.0) -> float:
        """Return the coefficient of diffusion of a free particle of this ``mass`` [length^2 / time]."""
        decay = math.exp(-self.friction * self.step)
        return float(0.5 * self.kT * self.step / mass * (1.0 + decay) / (1.0 - decay))

    def model(self, particles: Particles) -> Noise:
        """Return the model that the engine compiles."""
        decay = math.exp(-self.friction * self.step)
        noise_fraction = -math.expm1(-2.0 * self.friction * self.step)
        return self._thermal(particles, decay, noise_fraction, self.step)


@dataclass(frozen=True)
class Brownian(Bath):
    """Event-driven Brownian motion: a particle gets a new velocity after every step.

    Parameters
    ----------
    kT : float or sequence of floats
        Temperature [energy]; one a species, if there are several.
    step : float
        Time between two kicks of a particle [time].
    seed : int
        Seed of the random numbers; every particle has its own stream.

    Raises
    ------
    InputError
        If a parameter is out of range.

    Notes
    -----
    A free particle diffuses with ``D0 = kT step / (2 m)``. The limit is that of a step in which a particle
    moves by far less than the gaps between particles. Scala, Voigtmann, De Michele, J. Chem. Phys. 126
    (2007) 134109.

    Examples
    --------
    >>> Brownian(kT=1.0, step=0.1).diffusion(mass=1.0)
    0.05
    """

    type = "brownian"
    after = " of Brownian"
    kT: Temperatures
    step: Annotated[float, ABOVE]
    seed: Annotated[int, SEED] = 1

    def diffusion(self, mass: float = 1.0) -> float:
        """Return the coefficient of diffusion of a free particle of this ``mass`` [length^2 / time]."""
        return float(0.5 * self.kT * self.step / mass)

    def model(self, particles: Particles) -> Noise:
        """Return the model that the engine compiles."""
        return self._thermal(particles, 0.0, 1.0, self.step)
