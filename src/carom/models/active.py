"""Active particles: each swims into a direction of its own, which turns, and gets thermal noise.

It is event-driven Brownian motion with a drift. Ni, Cohen Stuart, Dijkstra, Nat. Commun. 4 (2013) 2704.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import checks, seeds
from carom.declared import SEED, word
from carom.errors import InputError
from carom.models.declared_values import ABOVE
from carom.models.drives import Bath, DriveModel, Noise, Temperatures, by_species, of_each
from carom.models.interfaces.memory import kept, parameter
from carom.models.interfaces.particles import Particles
from carom.models.mathematics.counter_random import normal, uniform

KINDS = ("diffusion", "tumble")


class Propulsion(DriveModel):
    """A kick turns a direction; the new velocity is along it, plus noise."""

    noise: Noise  # the noise, which keeps nothing of a velocity; it counts the kicks
    speed: Annotated[np.ndarray, parameter(-1)]  # speed along the direction, (n,) [length / time]
    tumbles: bool  # whether directions are forgotten at once, now and then, or diffuse
    turn: float  # probability that a step ends with a tumble, or standard deviation of the angle of a step
    seed: int  # seed of the random numbers that turn
    directions: Annotated[np.ndarray, kept()]  # unit vectors, (n, d)

    @property
    def drawn(self) -> np.ndarray:
        """How many kicks each has had, (n,) int64."""
        return self.noise.drawn

    def next_time(self, i, x, v, time):
        return self.noise.next_time(i, x, v, time)

    def kick(self, i, mass, x, v, time):
        _turn(self, i, self.noise.drawn[i], v)  # the noise keeps nothing of v: it is room
        self.noise.kick(i, mass, x, v, time)
        for axis in range(len(v)):
            v[axis] += self.speed[i] * self.directions[i, axis]


def _turn(drive, i, k, room):
    """Turn the direction of component i at its kick k, with (d,) numbers of ``room``.

    Diffusion turns it by a normal angle about a random axis, which keeps <e(0) . e(t)> exact (in the plane
    all is exact); a tumble draws a new one.
    """
    d = len(room)
    e = drive.directions[i]
    first = k * (2 * d + 2)
    cos, sin = 0.0, 1.0
    if not drive.tumbles:
        angle = drive.turn * normal(drive.seed, i, first)
        cos, sin = math.cos(angle), math.sin(angle)
    elif uniform(drive.seed, i, first) > drive.turn:
        return
    along = 0.0
    for axis in range(d):
        room[axis] = normal(drive.seed, i, first + 2 + 2 * axis)
        along += room[axis] * e[axis]
    if drive.tumbles:
        along = 0.0
    square = 0.0
    for axis in range(d):
        room[axis] -= along * e[axis]
        square += room[axis] * room[axis]
    if square == 0.0:  # it points nowhere
        return
    length = 0.0
    for axis in range(d):
        e[axis] = cos * e[axis] + sin * room[axis] / math.sqrt(square)
        length += e[axis] * e[axis]
    for axis in range(d):
        e[axis] /= math.sqrt(length)


@dataclass(frozen=True)
class Active(Bath):
    """Active Brownian particles, or run and tumble: a particle swims, and its direction is forgotten.

    After every step a particle gets the velocity ``speed e + noise``, with its direction e turned.

    Parameters
    ----------
    speed : float or sequence of floats
        Speed along the direction [length / time]; one a species, if there are several. 0 is passive.
    persistence : float
        Time in which a direction is forgotten: ``<e(0) . e(t)> = exp(-t / persistence)`` [time].
    step : float
        Time between two kicks of a particle [time].
    kT : float or sequence of floats
        Temperature of the noise [energy]; one a species, if there are several.
    kind : {"diffusion", "tumble"}
        Whether directions turn by rotational diffusion, for d > 1, or by tumbles at random times.
    seed : int
        Seed of the random numbers; every particle has its own stream.

    Raises
    ------
    InputError
        If a parameter is out of range. From a scene, if directions are to diffuse on a line.

    Notes
    -----
    The coefficient of rotational diffusion is ``1 / ((d - 1) persistence)``, the rate of tumbles
    ``1 / persistence``. The limit is that of a step in which a particle moves by far less than the gaps
    between particles. The first directions are random.

    Examples
    --------
    >>> import carom
    >>> swimmers = Active(speed=1.0, persistence=5.0, step=0.1, kT=0.2)
    >>> round(swimmers.diffusion(dimension=2), 2)
    2.51
    >>> sim = carom.Simulation(carom.Scene.random(64, 0.2, 2, drive=swimmers))
    >>> sim.run(time=1.0).collisions > 0
    True
    >>> sim.drive.directions.shape
    (64, 2)
    """

    type = "active"
    after = " of Active"
    speed: Annotated[Any, by_species(checks.FASTEST)]
    persistence: Annotated[float, ABOVE]
    step: Annotated[float, ABOVE]
    kT: Temperatures = 0.0
    kind: Annotated[str, word(*KINDS)] = "diffusion"
    seed: Annotated[int, SEED] = 1

    def check(self, scene: Any) -> None:
        """Raise InputError if directions are to diffuse on a line, or numbers are not one a species."""
        super().check(scene)
        if scene.dimension == 1 and self.kind == "diffusion":
            raise InputError('On a line directions cannot diffuse: give Active kind="tumble".')

    def pace(self, scene: Any) -> float:
        """Return the speed of the fastest particle of a ``scene`` [length / time]."""
        return float(np.max(self.speed)) + super().pace(scene)

    def diffusion(self, mass: float = 1.0, *, dimension: int) -> float:
        """Return the coefficient of diffusion of a free particle [length^2 / time].

        Parameters
        ----------
        mass : float
            Its mass.
        dimension : int
            d.

        Raises
        ------
        InputError
            If each species has its own speed or kT.
        """
        if isinstance(self.speed, tuple) or isinstance(self.kT, tuple):
            raise InputError("Each species diffuses in its own way: ask an Active with one speed and one kT.")
        swims = self.speed**2 * self.step / math.tanh(0.5 * self.step / self.persistence) / dimension
        return float(0.5 * (self.kT * self.step / mass + swims))

    def model(self, particles: Particles) -> Propulsion:
        """Return the model that the engine compiles."""
        tumbles = self.kind == "tumble"
        steps = self.step / self.persistence
        turn = -math.expm1(-steps) if tumbles else math.sqrt(2.0 * steps)
        shape = len(particles.radii), len(particles.box)
        directions = seeds.generator(self.seed, "directions").normal(size=shape)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        return Propulsion(
            self._thermal(particles, 0.0, 1.0, self.step),
            of_each(self.speed, particles),
            tumbles,
            turn,
            seeds.word(self.seed, "directions"),
            directions,
        )
