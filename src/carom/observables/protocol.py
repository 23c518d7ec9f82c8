"""The interface of an observable: a user's class for ``measure`` and for ``for frame in sim.sample(...)``.

It has ``update(frame)`` or ``update(block)``; the name of the parameter determines its input. The method may
return a number or an array; Carom then computes the mean with its error bar. Alternatively, it stores data,
and ``result()`` returns the result.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.observables.statistics import blocking

SEEN = ("frame", "block")


@runtime_checkable
class Observable(Protocol):
    """Interface of an observable, for :meth:`carom.Simulation.measure`.

    It may have ``result()``, and ``prepare(scene)``, which is called first. An observable of frames gets one
    at the start, and one at the end of each block.
    """

    def update(self, seen: Any, /) -> Any:
        """Add ``seen``, the next :class:`carom.Frame` or :class:`carom.Block`; return its value or None."""


def sees(observable: Any) -> str:
    """Return the input of the ``update`` of an observable: "frame" or "block"."""
    try:
        names = [
            name
            for name, parameter in inspect.signature(observable.update).parameters.items()
            if parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD
        ]
    except (TypeError, ValueError):
        names = []
    if len(names) != 1 or names[0] not in SEEN:
        raise InputError(
            f"{type(observable).__name__}.update({', '.join(names)}) does not say what it needs; name "
            "its one parameter frame or block."
        )
    return names[0]


def averages(values: Sequence[Any]) -> Any:
    """Return the means of the values from ``update``, with error bars from blocking.

    Parameters
    ----------
    values : sequence of float or arrays of one shape
        One value for each stretch, in order.

    Returns
    -------
    Estimate, or an array of them
        Each mean, in the shape of a value.

    Raises
    ------
    InputError
        If the values are not real numbers, or differ in shape.
    """
    if any(np.iscomplexobj(value) for value in values):
        raise InputError(
            "update() returned a complex number, which has no error bar of its own; return its real and "
            "imaginary part, or its square, as an array."
        )
    try:
        series = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(
            f"update() returned {checks.describe(values[0])} first; expected a number, or an array of the "
            "same shape each time, or None and a method result()."
        ) from None
    if series.ndim == 1:
        return blocking(series)
    flat = series.reshape(len(series), -1)
    found = np.empty(flat.shape[1], dtype=object)
    found[:] = [blocking(column) for column in flat.T]
    return found.reshape(series.shape[1:])


def outcome(observable: Any, values: Sequence[Any]) -> Any:
    """Return ``result()``; without this method, the means of the values from ``update``."""
    if callable(getattr(observable, "result", None)):
        return observable.result()
    if any(value is None for value in values) or not values:
        raise InputError(
            f"{type(observable).__name__}.update() returned nothing, and there is no result(): give it "
            "one of the two."
        )
    return averages(values)
