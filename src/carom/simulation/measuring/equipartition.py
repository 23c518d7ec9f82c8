"""The temperatures of species with different masses: a test of equipartition."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.observables.analysis.equilibrium import equipartition, slow_exchange
from carom.scene.velocities import conserved

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState

MOST = 16
"""Kinds that are looked at; with more of them a species is hardly more than its members."""


class Thermometer:
    """Looks at the temperature of each species, over that of all (``series``), now and then.

    Species of different masses exchange energy slowly: a sphere a thousand times as heavy takes a thousand
    collisions. Not tested are species of one mass, growing diameters, and inelastic contacts and drives,
    which keep different temperatures.
    """

    def __init__(self, run_state: RunState):
        self._run_state = run_state
        self.series: list[tuple[float, ...]] = []
        scene = run_state.scene
        self.names: tuple[str, ...] = ()
        # Pinned components have no temperature; those that move among them are compared by nobody.
        system = run_state.system
        elastic = system.elastic and system.rates is None and scene.pinned is None and scene.drive is None
        if not elastic or scene.masses.min() == scene.masses.max():
            return
        if scene.species is None:
            masses, self._kinds = np.unique(scene.masses, return_inverse=True)
            names = tuple(f"mass {mass:g}" for mass in masses)
        else:
            present, self._kinds = np.unique(scene.species, return_inverse=True)
            names = tuple(
                scene.species_names[k] if scene.species_names else f"species {k}" for k in present.tolist()
            )
        self._conserved = np.array(conserved(scene))
        # Two that conserve all momentum keep their temperatures in a fixed ratio.
        if not 1 < len(names) <= MOST or scene.n - int(self._conserved.all()) < 2:
            return
        self.names = names
        counts = np.bincount(self._kinds)
        masses = np.bincount(self._kinds, weights=scene.masses)
        # Without the momentum that is conserved: <m v^2> = d kT (1 - m / M).
        self._freedoms = scene.dimension * counts - self._conserved.sum() * masses / masses.sum()

    def look(self) -> None:
        """Note the present temperatures, where there are several."""
        if not self.names:
            return
        masses, v = self._run_state.scene.masses, self._run_state.speeds
        v = v - np.where(self._conserved, np.average(v, axis=0, weights=masses), 0.0)
        energies = np.bincount(self._kinds, weights=masses * np.sum(v * v, axis=1))
        total = energies.sum()
        if total > 0.0:
            mean = total / self._freedoms.sum()
            self.series.append(tuple((energies / np.maximum(self._freedoms, 1e-300) / mean).tolist()))

    def differences(self) -> list[str]:
        """Return a sentence if species differ in temperature over the looks so far."""
        return equipartition(self.names, self.series, self._freedoms) if self.series else []

    def doubts(self, relative_error: float) -> list[str]:
        """Return a sentence if species differ in temperature, or exchange energy too slowly."""
        slow = slow_exchange(self.names, self.series, self._freedoms, relative_error) if self.series else []
        return self.differences() or slow
