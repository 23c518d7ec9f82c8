"""What the engine asks of an interaction of two particles."""

from __future__ import annotations

from typing import Any, Protocol

from carom.models.interfaces.memory import Model
from carom.models.interfaces.particles import NEVER, Particles


class Interaction(Protocol):
    """A pair interaction as users write it.

    It may also have:

    - ``check(scene)``, which raises :class:`carom.errors.InputError` if the scene cannot be simulated;
    - ``penetrable = True``, if particles may be nearer than the mean of their diameters, which a scene
      refuses otherwise;
    - ``by_radii = True``, if no two particles act on each other beyond the sum of their radii, or
      ``contact``. Neighbors are then found by their sizes;
    - ``conserves(diameter)``, whether its jumps keep the energy (true if left out), with which
      :func:`carom.check` compares them;
    - ``keeps_momentum = False``, if its jumps do not keep the total momentum, nor the energy.

    An interaction whose pairs have steps (``step_time``) also has:

    - ``steps(particles)``, which returns the number of steps, and the step of pairs beyond each other's reach
      for every pair of species, (K, K) ints;
    - ``steps_of(pairs, distances, species, diameter)``, the steps of pairs (m, 2) at the start.

    Its model has ``energy``, the energy of a pair on each step. It also has ``events``, (steps, 4) int64, in
    which the engine counts the kinds of events on each step.
    """

    def reach(self, scene: Any) -> float:
        """Return the largest distance at which two particles act on each other [length]."""

    def model(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""


class PairModel(Model):
    """What an interaction of two particles answers."""

    def interaction_time(self, i, j, rr, rv, vv, now):
        """Time from now until particles i and j interact, or NEVER.

        Parameters
        ----------
        i, j : int
            The particles: indices of the model's arrays.
        rr, rv, vv : float
            r.r [length^2], r.v and v.v of j relative to i, both at the time ``now``.
        now : float
            Time since the beginning of the epoch.

        Notes
        -----
        The compiled method stands in the loop over candidates. The loop is vectorized if the method has no
        branch and no store, and if ``lanes`` names the fields that it reads of j. The time is 0 for a pair
        that touches and approaches (Lubachevsky 1991, sec. 6).
        """
        raise NotImplementedError

    def jump(self, i, j, rr, rv, now):
        """Return what an elastic contact adds to the velocities: ``v_i += a r``, ``v_j -= b r``.

        The vector r points from i to j.

        Returns
        -------
        a, b : float
            The factors of r [1 / time].
        virial : float
            ``r . dp`` of the contact [mass length^2 / time].
        """
        raise NotImplementedError

    def contact_time(self, i, j, rr, rv, vv, now):
        """Time from now until i and j interact, after ``interaction_time`` found that they do.

        The two times are rounded differently, so a grazing contact may look like a miss here. It then counts
        as a contact at the closest approach.

        Returns
        -------
        t : float
            Time until contact, not negative.
        clamped : bool
            Whether a negative root was replaced by zero (the paper's sec. 6).
        """
        t = self.interaction_time(i, j, rr, rv, vv, now)
        return t if t < NEVER else max(-rv / vv, 0.0), False

    def core_square(self, i, j, now):
        """Return the square of the distance that i and j keep [length^2]; 0 where they may overlap.

        The deepest overlap of a run is measured with it.
        """
        return 0.0

    def radius_of(self, i, now):
        """Return the radius of particle i at obstacles at the time now; by default ``self.radii[i]``."""
        return self.radii[i]  # type: ignore[attr-defined]

    def growth_of(self, i):
        """Return the rate at which the radius of particle i grows; by default 0."""
        return 0.0

    def mass_of(self, i):
        """Return the mass of particle i; by default ``self.masses[i]``."""
        return self.masses[i]  # type: ignore[attr-defined]

    def record_impulse(self, i, j, momentum):
        """Record the ``momentum`` that a contact of i and j exchanged [mass length / time].

        By default nothing is recorded.
        """
        return
