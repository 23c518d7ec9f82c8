"""Restitution: contacts that lose a part of the normal relative velocity."""

from __future__ import annotations

import numbers
from copy import copy
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.declared import number
from carom.errors import InputError
from carom.models.contacts.losses import Law
from carom.models.declared_values import PART, Value
from carom.models.interfaces.contact import ImpactModel
from carom.models.interfaces.memory import kept, parameter
from carom.models.interfaces.particles import Particles

CAUTIOUS = 1e-3  # normal speed, in thermal speeds, below which contacts are elastic unless another is given


@dataclass(frozen=True)
class Restitution(Value):
    """Contacts after which a fraction of the normal relative velocity remains.

    Parameters
    ----------
    restitution : float
        This fraction, in (0, 1]; 1 is elastic.
    elastic_below : float, optional
        Normal relative speed below which a contact is elastic [length / time]. It prevents inelastic
        collapse, infinitely many collisions in a finite time, so it must be positive if restitution < 1. The
        default is 1e-3 of the thermal speed, at the start and at every :meth:`carom.Simulation.rescale`; of
        what a field, growth or moving obstacles do in a scene at rest.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    type = "restitution"
    restitution: Annotated[float, PART] = 1.0
    elastic_below: Annotated[float | None, number(low=0, high=checks.FASTEST)] = None

    def complete(self) -> None:
        """Set the threshold of elastic contacts; raise InputError where that of others is not above 0."""
        if self.elastic_below is None:
            self._put("elastic_below", 0.0 if self.restitution == 1 else None)
        elif self.restitution == 1 and self.elastic_below > 0:
            raise InputError("elastic_below has no meaning where restitution is 1; remove it.")
        elif self.restitution < 1 and self.elastic_below == 0:
            raise InputError(
                "elastic_below must be positive where restitution is below 1: else spheres collide "
                "infinitely often in a finite time. Leave it out for 1e-3 of the thermal speed."
            )

    @property
    def elastic(self) -> bool:
        """Whether no contact loses energy."""
        return self.restitution == 1.0

    def at(self, speed: float) -> Restitution:
        """Return the value with its threshold, for a thermal ``speed`` [length / time]."""
        return self if self.elastic_below is not None else self.below(CAUTIOUS * speed)

    def below(self, speed: float) -> Restitution:
        """Return the value with the threshold ``speed`` [length / time], which is zero if nothing moves."""
        result = copy(self)
        object.__setattr__(result, "elastic_below", speed)
        return result

    def to_table(self) -> dict[str, Any]:
        """Return the arguments that were given, for a file."""
        table = super().to_table()
        if self.restitution == 1.0:
            del table["elastic_below"]
        return table

    def law(self, particles: Particles) -> Law:
        """Return the compiled form of the loss at the surface of an obstacle."""
        return Law(self.restitution, 0.0, 0.2, float(particles.speed(self.elastic_below)), 0.0)

    def model(self, particles: Particles) -> Inelastic | None:
        """Return the model that the engine compiles, or None if contacts are elastic."""
        if self.elastic:
            return None
        threshold = float(particles.speed(self.elastic_below))
        return Inelastic(float(self.restitution), threshold, np.zeros(1, np.int64))


def as_impact(value: Any) -> Any:
    """Return a number as the restitution that it means, and anything else as it is."""
    if isinstance(value, numbers.Real | np.floating) and not isinstance(value, bool):
        return Restitution(checks.number(value, "restitution"))
    return value


class Inelastic(ImpactModel):
    """Contacts that lose energy."""

    restitution: float
    """Normal speed after over normal speed before a contact."""
    threshold: Annotated[float, parameter(-1)]
    """Normal speed below which a contact is elastic, against inelastic collapse."""
    spared: Annotated[np.ndarray, kept()]
    """Number of contacts that were elastic for that reason, (1,) int64."""

    def transfer(self, rr, rv):
        if rv * rv < self.threshold * self.threshold * rr:
            self.spared[0] += 1
            return 1.0
        return 0.5 * (1.0 + self.restitution)
