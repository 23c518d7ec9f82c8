"""What is measured: ``begin``, what it needs of the run; ``add``, a frame or a block; and ``result``.

Every observable of Carom and of one's own is measured so, of a run, of a file, of a folder, or in
``for frame in sim.sample(...)``. What ``add`` returns, a number or an array, gets an error bar.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.observables.statistics import blocking

SEEN = ("frame", "block")


@runtime_checkable
class Observable(Protocol):
    """Interface of an observable, for :meth:`carom.Simulation.measure` and :func:`carom.measure`.

    It may have ``begin(scene)``, which is called first and raises InputError where the scene does not fit. It
    may have ``result()``; without this, the result is the mean of what ``add`` returned, with its error bar.
    An observable of frames gets one at the start, and one at the end of each block.
    """

    def add(self, seen: Any, /) -> Any:
        """Add ``seen``, the next :class:`carom.Frame` or :class:`carom.Block`; return its value or None.

        The name of the parameter, ``frame`` or ``block``, says which of the two it is.
        """


def sees(observable: Any) -> str:
    """Return what is handed to ``add`` of an observable: "frame" or "block"."""
    try:
        names = [
            name
            for name, parameter in inspect.signature(observable.add).parameters.items()
            if parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD
        ]
    except (TypeError, ValueError):
        names = []
    if len(names) != 1 or names[0] not in SEEN:
        raise InputError(
            f"{type(observable).__name__}.add({', '.join(names)}) does not say what it needs; name "
            "its one parameter frame or block."
        )
    return names[0]


class Underway:
    """An observable while it is measured: it is handed what it sees, and what it returned is kept."""

    def __init__(self, observable: Any):
        self._observable = observable
        # An observer of events need not add anything.
        self.sees = sees(observable) if callable(getattr(observable, "add", None)) else ""
        self._values: list[Any] = []

    def add(self, seen: Any) -> None:
        """Hand over the next frame or block."""
        self._values.append(self._observable.add(seen))

    def result(self) -> Any:
        """Return ``result()``; without this method, the means of the values from ``add``."""
        if callable(getattr(self._observable, "result", None)):
            return self._observable.result()
        if not self.sees:
            return self._observable
        if any(value is None for value in self._values) or not self._values:
            raise InputError(
                f"{type(self._observable).__name__}.add() returned nothing, and there is no result(): give "
                "it one of the two."
            )
        return averages(self._values)


def averages(values: Sequence[Any]) -> Any:
    """Return the means of the values from ``add``, with error bars from blocking.

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
        If there is none, or they are not real numbers, or differ in shape.
    """
    try:
        turned = any(np.iscomplexobj(value) for value in values)
        series = np.asarray([0.0] if turned else values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(
            f"add() returned {checks.describe(values[0])} first; expected a number, or an array of the "
            "same shape each time, or None and a method result()."
        ) from None
    if turned:
        raise InputError(
            "add() returned a complex number, which has no error bar of its own; return its real and "
            "imaginary part, or its square, as an array."
        )
    if series.ndim < 2 or not len(series):
        return blocking(series)
    flat = series.reshape(len(series), math.prod(series.shape[1:]))
    found = np.empty(flat.shape[1], dtype=object)
    found[:] = [blocking(column) for column in flat.T]
    return found.reshape(series.shape[1:])
