"""What an observer of one's own is told of the events of a run: three questions, and what is handed over.

An observer is a tuple of arrays into which a run adds something up, and of numbers, of a class that derives
from :class:`ObserverModel`. Its methods are compiled into the main cycle. What they are told is in the units
of the scene (``docs/models``). In a sheared box positions are in space, inside the tilted cell or at its
faces, and velocities are relative to the stream, as in a frame. The arrays of an event are used again for the
next one: copy what is to be kept.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import Questions


class PairEvent(NamedTuple):
    """A collision of two particles, or another event of a pair with steps."""

    i: int | np.integer
    """The first particle."""
    j: int | np.integer
    """The second."""
    time: float
    """Time since the start of the run [time], rounded to a double."""
    r: np.ndarray
    """From i to the image of j that it meets, (d,) [length]."""
    x: np.ndarray
    """Positions of i and j in the box, (2, d) [length]."""
    before: np.ndarray
    """Velocities of i and j before the event, (2, d) [length / time]."""
    after: np.ndarray
    """Velocities after it, (2, d)."""
    virial: float
    """r.dp [mass length^2 / time]."""
    kind: int | np.integer
    """CORE for a collision; IN, OUT or BOUNCE for other events of steps (``carom.models.interfaces``)."""


class ObstacleEvent(NamedTuple):
    """A contact of a particle with an obstacle or a wall."""

    i: int | np.integer
    """The particle."""
    obstacle: int
    """Place of the obstacle or wall in ``Simulation.obstacles``."""
    time: float
    """Time since the start of the run [time], rounded to a double."""
    normal: np.ndarray
    """Unit vector away from the obstacle where it is touched, (d,)."""
    x: np.ndarray
    """Position of the particle in the box, (d,) [length]."""
    before: np.ndarray
    """Velocity before the contact, (d,) [length / time]."""
    after: np.ndarray
    """Velocity after it, (d,)."""
    momentum: float
    """What the particle gained along the normal [mass length / time]."""
    energy: float
    """What it gained [energy]."""
    radius: float
    """Its radius at this time [length]."""


class Epoch(NamedTuple):
    """All particles at the beginning of an epoch."""

    time: float
    """Time since the start of the run [time], rounded to a double."""
    x: np.ndarray
    """Positions in the box, (n, d) [length]."""
    v: np.ndarray
    """Velocities, (n, d) [length / time]."""


class ObserverModel(Questions):
    """What an observer of the user's is told."""

    def at_pair(self, event):
        """Let an observer see an event of two particles, a :class:`PairEvent`; by default it is ignored."""
        return

    def at_obstacle(self, event):
        """Let an observer see the event of a contact, an :class:`ObstacleEvent`; by default it is ignored."""
        return

    def at_epoch(self, event):
        """Let an observer see the event that an epoch begins, an :class:`Epoch`; by default it is ignored.

        Epochs begin at equal times, which the engine chooses: anew when velocities are rescaled.
        """
        return
