"""Losses at contacts: a restitution, constant or by speed, and remedies against inelastic collapse.

Elastic are contacts below a speed, or less than t_c after the last of one of the two: the TC model, with the
duration t_c of real contacts (Luding and McNamara, Granular Matter 1 (1998) 113).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from carom import checks
from carom.declared import number
from carom.errors import InputError
from carom.models.declared_values import PART, SPEED, Value
from carom.models.interfaces.contact import ImpactModel
from carom.models.interfaces.memory import MOMENT, kept, parameter
from carom.models.interfaces.particles import Particles


@dataclass(frozen=True)
class Loss(Value):
    """Energy loss at contacts, for the keyword ``impact`` of a scene, an obstacle or a wall.

    Parameters
    ----------
    restitution : float
        Fraction of the normal relative speed that remains, in (0, 1].
    contact_time : float, optional
        t_c of the TC model [time].
    elastic_below : float, optional
        Normal relative speed below which a contact is elastic [length / time].
    at_speed : float, optional
        Speed at which the restitution is ``restitution`` [length / time]. At a normal relative speed u it is
        ``1 - (1 - restitution) (u / at_speed)^power``, but not negative. By default it does not depend on u.
    power : float
        The exponent; by default 1/5, that of viscoelastic spheres.

    Raises
    ------
    InputError
        If a value is out of range, or no remedy against inelastic collapse is given.

    Examples
    --------
    >>> Loss(0.9, contact_time=1e-4).restitution
    0.9
    """

    type = "loss"
    restitution: Annotated[float, PART]
    contact_time: Annotated[float | None, number(low=0, high=checks.MAGNITUDE, open_low=True)] = None
    elastic_below: Annotated[float | None, SPEED] = None
    at_speed: Annotated[float | None, SPEED] = None
    power: Annotated[float, number(low=0, high=8, open_low=True)] = 0.2

    def complete(self) -> None:
        """Raise InputError where particles could collide infinitely often in a finite time."""
        if self.restitution < 1 and self.contact_time is None and self.elastic_below is None:
            raise InputError(
                "A Loss needs contact_time or elastic_below: else components collide infinitely often in a "
                "finite time. A contact_time of 1e-3 of the time between two contacts changes little."
            )

    def to_table(self) -> dict[str, Any]:
        """Return the arguments that were given, for a file."""
        table = super().to_table()
        if self.at_speed is None:
            del table["power"]
        return table

    def law(self, particles: Particles) -> Law:
        """Return the compiled form of the restitution."""
        unit = particles.unit
        return Law(
            self.restitution,
            0.0 if self.at_speed is None else float(unit.to_kernel(self.at_speed, -1)),
            self.power,
            0.0 if self.elastic_below is None else float(unit.to_kernel(self.elastic_below, -1)),
            0.0 if self.contact_time is None else float(unit.to_kernel(self.contact_time, 1)),
        )

    def model(self, particles: Particles) -> Losing:
        """Return the model that the engine compiles for contacts of two particles."""
        return Losing(self.law(particles), never_touched(particles), np.zeros(1, np.int64))


class Law(NamedTuple):
    """Restitution by speed, and the two remedies against inelastic collapse."""

    restitution: float  # restitution at the speed ``at_speed``
    at_speed: Annotated[float, parameter(-1)]
    """Speed at which the restitution is that; 0 if it does not depend on the speed."""
    power: float  # exponent of the speed
    threshold: Annotated[float, parameter(-1)]  # speed below which a contact is elastic
    contact_time: Annotated[float, parameter(1)]  # a contact within this time after the last one is elastic


def never_touched(particles: Particles) -> np.ndarray:
    """Return the time of the last contact of each of the ``particles`` at the start, (n + 1,): -infinity."""
    return np.full(len(particles.radii) + 1, -np.inf)


def restitution_at(law, speed):
    """Return the fraction of a normal relative ``speed`` that remains after a contact by a ``law``."""
    if law.at_speed == 0.0:
        return law.restitution
    return max(1.0 - (1.0 - law.restitution) * (speed / law.at_speed) ** law.power, 0.0)


class Losing(ImpactModel):
    """Contacts of two components that lose energy."""

    law: Law
    """The restitution."""
    last: Annotated[np.ndarray, MOMENT]
    """Time of the last contact of each component, in the epoch, (n + 1,) float64."""
    spared: Annotated[np.ndarray, kept()]
    """Number of contacts that were elastic because they were slow or came too soon, (1,) int64."""

    def transfer(self, rr, rv):
        speed = abs(rv) / np.sqrt(rr)
        return 1.0 if speed < self.law.threshold else 0.5 * (1.0 + restitution_at(self.law, speed))

    def exchanged_part(self, i, j, rr, rv, now):
        soon = now - max(self.last[i], self.last[j]) < self.law.contact_time
        self.last[i] = now
        self.last[j] = now
        part = 1.0 if soon else self.transfer(rr, rv)
        self.spared[0] += soon or abs(rv) < self.law.threshold * np.sqrt(rr)
        return part

    def shift_epoch(self, duration):
        for i in range(len(self.last)):
            self.last[i] -= duration
