"""Conditions on frames, the same for every file format."""

from __future__ import annotations

import numbers
from typing import Any

import numpy as np

from carom.configuration import MOST_DIMENSIONS, MOST_SPECIES
from carom.frame import Frame

_REALS = ("positions", "velocities", "box", "diameters", "masses", "time")
_WORDS = {"box": "box edges"}  # names of fields in messages, where they differ from those of the frame
_INTEGERS = np.iinfo(np.int64)
_IMAGES = np.iinfo(np.int32)


def finite(values: Any) -> bool:
    """Tell whether all values are finite; if their sum is, this takes no temporary array."""
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(np.sum(values)) or np.isfinite(values).all())


def whole(values: np.ndarray, low: int, high: int) -> bool:
    """Tell whether these are integers from `low` to `high`."""
    return values.dtype.kind in "iu" and bool(values.min() >= low and values.max() <= high)


def narrowed(images: np.ndarray) -> np.ndarray:
    """Return image counts as int32."""
    if not whole(images, _IMAGES.min, _IMAGES.max):
        raise ValueError(f"images hold what is no integer from {_IMAGES.min} to {_IMAGES.max}")
    return np.ascontiguousarray(images, dtype=np.int32)


def flaw(frame: Frame) -> str | None:
    """Return what is wrong with a frame, as the end of a sentence ("masses hold ..."), or None.

    Positions may lie outside the box, as rounding leaves them at walls; diameters may be 0.
    """
    return _shape(frame) or _values(frame)


def _shape(frame: Frame) -> str | None:
    """Return which field of a frame has a wrong shape, or None."""
    if frame.positions.ndim != 2:
        return f"positions have the shape {frame.positions.shape}; expected (n, d)"
    n, dimension = frame.positions.shape
    if n < 1 or not 1 <= dimension <= MOST_DIMENSIONS:
        return (
            f"positions are of {n} components in {dimension} dimensions; expected one component or more in "
            f"1 to {MOST_DIMENSIONS}"
        )
    expected: dict[str, tuple[int, ...]] = {
        "velocities": (n, dimension),
        "box": (dimension,),
        "diameters": (n,),
        "masses": (n,),
        "time": (),
        "periodic": (dimension,),
    }
    if frame.images is not None:
        expected["images"] = (n, dimension)
    if frame.spins is not None:
        expected["spins"] = (n, 1 if dimension == 2 else 3)
    if frame.species is not None:
        expected["species"] = (n,)
    for name, shape in expected.items():
        found = np.shape(getattr(frame, name))
        if found != shape:
            return f"{name} have the shape {found}; expected {shape}"
    return None


def _values(frame: Frame) -> str | None:
    """Return which field of a frame has an invalid value, or None."""
    for name in _REALS:
        if not finite(getattr(frame, name)):
            return f"{_WORDS.get(name, name)} hold NaN or infinite values"
    lowest = {"box": min(frame.box), "masses": frame.masses.min(), "diameters": frame.diameters.min()}
    for name, low in lowest.items():
        if low < 0.0 or (low == 0.0 and name != "diameters"):
            expected = "0 or more" if name == "diameters" else "more than 0"
            return f"{_WORDS.get(name, name)} hold {low:g}; expected {expected}"
    if not isinstance(frame.step, numbers.Integral) or not 0 <= frame.step <= _INTEGERS.max:
        return f"step is {frame.step}; expected an integer from 0 to {_INTEGERS.max}"
    if frame.tilt is not None and (frame.positions.shape[1] < 2 or not np.isfinite(frame.tilt)):
        return f"tilt is {frame.tilt!r}; expected a finite number, of two dimensions or more"
    if frame.spins is not None and not finite(frame.spins):
        return "spins hold NaN or infinite values"
    if frame.images is not None and not whole(frame.images, _IMAGES.min, _IMAGES.max):
        return f"images hold what is no integer from {_IMAGES.min} to {_IMAGES.max}"
    kinds = len(frame.species_names) or MOST_SPECIES
    if frame.species is not None and not whole(frame.species, 0, min(kinds, MOST_SPECIES) - 1):
        return f"species hold what is no integer from 0 to {min(kinds, MOST_SPECIES) - 1}"
    return None


def step_back(frame: Frame, time: float, step: int) -> str | None:
    """Return how `frame` is earlier than the previous one, of this time and step; None if it is not."""
    if frame.time < time:
        return f"time is {frame.time!r}, before that of the frame before it, {time!r}"
    if frame.step < step:
        return f"step is {frame.step}, less than that of the frame before it, {step}"
    return None
