"""What the engine asks of the path of an obstacle that moves."""

from __future__ import annotations

from carom.compiling.registry import Questions


class PathModel(Questions):
    """What the path of an obstacle answers."""

    def place(self, t):
        """Return the displacement at a time since the start of the run, reduced by whole periods [length]."""
        raise NotImplementedError

    def pace(self, t):
        """Return the velocity at that time: the derivative of :func:`place`."""
        raise NotImplementedError
