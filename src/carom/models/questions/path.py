"""What the engine asks of the path of an obstacle that moves."""

from __future__ import annotations

from carom.compiling.registry import required


@required
def place(path, t):
    """Return the displacement at a time since the start of the run, reduced by whole periods [length]."""


@required
def pace(path, t):
    """Return the velocity at that time: the derivative of :func:`place`."""
