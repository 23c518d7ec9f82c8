"""How deep the rims of parts are: as deep as was measured to do, and deeper where that was too thin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from carom.scene.scene import Scene

FRONTS = {2: (3.0, 1.5)}
"""Diameters by which wrong rows spread into a rim at once, and for every collision a particle, in some
dimensions: a window lost costs more in the plane than deeper rims.
"""

FRONT = (2.0, 1.3)
"""The same elsewhere. Where rims of this depth prove too thin, they become deeper."""

DEEPER, DEEPEST = 1.15, 2.5
"""Factor by which rims become deeper when a window was lost, and the most that this comes to."""

THINNER, STREAK = 0.95, 32
"""Factor by which rims become thinner after so many windows in a row that were kept."""


@dataclass
class Rims:
    """The rims of a team.

    Attributes
    ----------
    fixed : float or None
        A depth that was asked for [length].
    factor : float
        By how much they are deeper than measured.
    streak : int
        Windows in a row that were kept.
    """

    fixed: float | None = None
    factor: float = 1.0
    streak: int = 0

    def lost(self) -> None:
        """Be deeper: a window was lost."""
        self.factor, self.streak = min(self.factor * DEEPER, DEEPEST), 0

    def kept(self) -> None:
        """Be thinner after many windows that were kept."""
        self.streak += 1
        if self.streak == STREAK and self.factor > 1.0:
            self.factor, self.streak = max(self.factor * THINNER, 1.0), 0

    def depths(self, scene: Scene, flight: float, held: float) -> tuple[float, float]:
        """Return how deep rims have to be beyond what a part touches, at both ends of a window [length].

        Parameters
        ----------
        scene : Scene
            What is run.
        flight : float
            Mean free path [length].
        held : float
            Collisions a particle in a window.
        """
        once, each = FRONTS.get(scene.dimension, FRONT)
        first = once * scene.diameter + (each * scene.diameter + flight) * held
        wanted = self.factor * first if self.fixed is None else self.fixed
        return wanted, wanted * once * scene.diameter / first
