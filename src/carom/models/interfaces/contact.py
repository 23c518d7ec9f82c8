"""What the engine asks of a contact law."""

from __future__ import annotations

from typing import Any, Protocol

from carom.models.interfaces.memory import Model
from carom.models.interfaces.particles import Particles


class Impact(Protocol):
    """What a contact of two particles loses, as users write it.

    It may also have ``check(scene)``, as an :class:`Interaction`, ``elastic = True``, if no contact loses
    energy, and ``adds_energy = True``, if contacts may add some, of which a simulation warns otherwise.
    """

    def model(self, particles: Particles) -> Any:
        """Return what the engine compiles, or None where contacts are elastic."""


class ImpactModel(Model):
    """What a contact law answers."""

    def transfer(self, rr, rv):
        """Return the part of an elastic contact's momentum that is exchanged: ``(1 + e) / 2``.

        Parameters
        ----------
        rr, rv : float
            r.r [length^2] and r.v of the surfaces; ``rv^2 / rr`` is the normal speed squared.
        """
        return 1.0

    def exchanged_part(self, i, j, rr, rv, now):
        """Return :meth:`transfer` for the particles i and j at the time ``now`` of the epoch.

        It is for contact laws with memory, and is asked once per contact. By default it does not depend on
        i, j and ``now``.
        """
        return self.transfer(rr, rv)
