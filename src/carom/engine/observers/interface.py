"""What observers are told, each with a default that does nothing, and the one tuple that they are in.

An observer is a ``NamedTuple`` of arrays in the engine's unit of time, whose fields say what a checkpoint
keeps (``carom.models.questions.memory``). Compiled code asks all but :func:`at_rest` and :func:`limits`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.registry import optional
from carom.models.questions.memory import arrays_in


class Observers(NamedTuple):
    """An observer and those after it: a list that types can walk along, as that of obstacles."""

    head: Any  # the first
    tail: Any  # the rest, Observers or None


def chained(observers: Iterable[Any]) -> Observers | None:
    """Return one tuple of those observers that are not None, or None where there are none."""
    chain = None
    for each in reversed([each for each in observers if each is not None]):
        chain = Observers(each, chain)
    return chain


def listed(observers: Observers | None) -> list[Any]:
    """Return every observer of a chain."""
    return [] if observers is None else [observers.head, *listed(observers.tail)]


def observer_of(observers: Observers | None, kind: type) -> Any:
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


@optional
def before_pair(observer, model, state, event):
    """Observe the ``event`` of a pair, both of whom are at its time, before their velocities change."""
    return


@optional
def after_pair(observer, model, state, event):
    """Observe the same event when both have their new velocities."""
    return


@optional
def count_pair(observer, i, j, virial):
    """Add a collision of which its components and its virial are known, and nothing else.

    An observer of this or :func:`record` alone works with several workers, who count a window's events in
    order at its end.
    """
    return


@optional
def record(observer, clock, i, ref, impulse):
    """Write down an event at the time of the ``clock``: i, the lower index, and the momentum exchanged.

    ``ref`` is the word of the other, or the code of an event of one component
    (:mod:`carom.engine.constants`).
    """
    return


@optional
def is_full(observer):
    """Return whether there is no room to write down the next event: the cycle returns before it."""
    return False


@optional
def ends_run(observer):
    """Return whether the event that ends the run has happened: the cycle returns before any other."""
    return False


@optional
def before_obstacle(observer, model, state, i, now):
    """Observe component i, which is at the time of its contact, before its velocity changes."""
    return


@optional
def after_obstacle(observer, model, state, event):
    """Observe the contact when it has its new velocity; the normal is in the obstacles' room for an image."""
    return


@optional
def before_kick(observer, model, state, i, now):
    """Observe component i, which is at the time at which a drive kicks it, before its velocity changes."""
    return


@optional
def after_kick(observer, model, state, i, now):
    """Observe component i when a drive has kicked it."""
    return


@optional
def gain(observer, energy, now):
    """Observe the energy that a component gains alone: at an obstacle, or by its rule."""
    return


@optional
def at_epoch(observer, model, state, length):
    """Observe the next epoch's beginning; times held are still of the last, whose ``length`` is over."""
    return


@optional
def at_rest(observer, now, since):
    """Observe that nothing happens until the time ``now`` of this epoch, which is ``since`` of another."""
    return


@optional
def limits(observer, n, oldest):
    """Return limits of arrays that a checkpoint keeps, {field: (low, high)}, for ``n`` components.

    Others: real numbers are finite, whole ones not negative. ``oldest`` is a time in the epoch before the run
    began.
    """
    return {}


def _to_all(question: Any) -> Any:
    """Return the answer of a chain: the first observer is told, then those after it."""

    def tell(observers, *told):
        question(observers.head, *told)
        question(observers.tail, *told)

    return tell


for _question in (
    *(before_pair, after_pair, count_pair, record, before_obstacle, after_obstacle),
    *(before_kick, after_kick, gain, at_epoch, at_rest),
):
    _question.register(Observers)(_to_all(_question))


@is_full.register
def _is_full_of_observers(observer: Observers):
    return is_full(observer.head) or is_full(observer.tail)


@ends_run.register
def _ends_run_of_observers(observer: Observers):
    return ends_run(observer.head) or ends_run(observer.tail)


def kept_arrays(observers: Observers | None) -> dict[str, dict[str, np.ndarray]]:
    """Return every array that a checkpoint keeps, by its field and by the name of its observer."""
    arrays: dict[str, dict[str, np.ndarray]] = {}
    for each in listed(observers):
        name = type(each).__name__
        while name in arrays:  # another of its type
            name += "+"
        arrays[name] = dict(arrays_in(each))
    return arrays
