"""What observers are told, each with a default that does nothing, and the one tuple that they are in.

An observer is a tuple of arrays in the engine's unit of time, whose fields say what a checkpoint
keeps (``carom.models.interfaces.memory``). Compiled code asks all but ``at_rest`` and ``limits``.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.registry import Questions
from carom.models.interfaces.memory import arrays_in


class Observer(Questions):
    """What an observer is told, and a run asks of it: by default nothing happens."""

    def before_pair(self, model, state, event):
        """Observe the ``event`` of a pair, both of whom are at its time, before their velocities change."""

    def after_pair(self, model, state, event):
        """Observe the same event when both have their new velocities."""

    def count_pair(self, i, j, virial):
        """Add a collision of which its components and its virial are known, and nothing else.

        An observer of this or :func:`record` alone works with several workers, who count a window's events in
        order at its end.
        """

    def record(self, clock, i, ref, impulse):
        """Write down an event at the time of the ``clock``: i, the lower index, and the momentum exchanged.

        ``ref`` names the other, or the code of an event of one component
        (:mod:`carom.engine.constants`).
        """

    def is_full(self):
        """Return whether there is no room to write down the next event: the cycle returns before it."""
        return False

    def ends_run(self):
        """Return whether the event that ends the run has happened: the cycle returns before any other."""
        return False

    def before_obstacle(self, model, state, i, now):
        """Observe component i, which is at the time of its contact, before its velocity changes."""

    def after_obstacle(self, model, state, event):
        """Observe it with its new velocity; the normal is in the obstacles' room for an image."""

    def before_kick(self, model, state, i, now):
        """Observe component i at the time of a kick, before its velocity changes."""

    def after_kick(self, model, state, i, now):
        """Observe component i when a drive has kicked it."""

    def gain(self, energy, now):
        """Observe the energy that a component gains alone: at an obstacle, or by its rule."""

    def at_epoch(self, model, state, length):
        """Observe the next epoch's beginning; times held are still of the last, whose ``length`` is over."""

    def at_rest(self, now, since):
        """Observe that nothing happens until ``now`` of this epoch, which is ``since`` of another."""

    def limits(self, n, oldest):
        """Return limits of arrays that a checkpoint keeps, {field: (low, high)}, for ``n`` components.

        Others: real numbers are finite, whole ones not negative. ``oldest`` is a time in the epoch before the
        run began.
        """
        return {}


class Nobody(Observer):
    """The end of a chain of observers."""


NOBODY = Nobody()


class Observers(Observer):
    """An observer and those after it: a list that types can walk along, as that of obstacles."""

    head: Any  # the first
    tail: Any  # the rest, Observers or Nobody

    def is_full(self):
        return self.head.is_full() or self.tail.is_full()

    def ends_run(self):
        return self.head.ends_run() or self.tail.ends_run()


def _to_all(name: str) -> Any:
    """Return the answer of a chain: the first observer is told, then those after it."""

    def tell(self, *told):
        getattr(self.head, name)(*told)
        getattr(self.tail, name)(*told)

    return tell


for _name in (
    *("before_pair", "after_pair", "count_pair", "record", "before_obstacle", "after_obstacle"),
    *("before_kick", "after_kick", "gain", "at_epoch", "at_rest"),
):
    setattr(Observers, _name, _to_all(_name))


def chained(observers: Iterable[Any]) -> Observers | Nobody:
    """Return one tuple of those observers that are not None."""
    chain: Observers | Nobody = NOBODY
    for each in reversed([each for each in observers if each is not None]):
        chain = Observers(each, chain)
    return chain


def listed(observers: Any) -> list[Any]:
    """Return every observer of a chain."""
    return [observers.head, *listed(observers.tail)] if isinstance(observers, Observers) else []


def observer_of(observers: Any, kind: type) -> Any:
    """Return the observer of a type, or None where there is none."""
    return next((each for each in listed(observers) if isinstance(each, kind)), None)


class PairEvent(NamedTuple):
    """A collision of two components, or another event of a pair with steps."""

    i: int | np.integer
    j: int | np.integer
    ref: int  # the reference that names j and its image
    now: float  # time since the beginning of the epoch
    rr: float
    rv: float  # r.r and r.v of j relative to i, before the event
    a: float
    b: float  # the velocities change by ``a r`` and ``-b r``
    virial: float
    kind: int | np.integer  # CORE, IN, OUT or BOUNCE
    before: int
    after: int  # the steps of the pair, zero where there are none


class ObstacleEvent(NamedTuple):
    """A contact of a component with an obstacle or a wall."""

    i: int | np.integer
    number: int  # the engine's number of the obstacle
    now: float  # time since the beginning of the epoch
    momentum: float  # what the component gained along the normal
    energy: float  # what it gained


def kept_arrays(observers: Any) -> dict[str, dict[str, np.ndarray]]:
    """Return every array that a checkpoint keeps, by its field and by the name of its observer."""
    arrays: dict[str, dict[str, np.ndarray]] = {}
    for each in listed(observers):
        name = type(each).__name__
        while name in arrays:  # another of its type
            name += "+"
        arrays[name] = dict(arrays_in(each))
    return arrays
