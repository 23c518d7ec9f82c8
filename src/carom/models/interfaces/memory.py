"""What the fields of a model are, and what the engine asks of a model that remembers something.

A field that changes in a run, or has a unit of time, says so in its annotation:
``last: Annotated[np.ndarray, MOMENT]``. Whatever makes models anew, in another unit of time, goes by that.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from carom.compiling.registry import Questions


class Field(NamedTuple):
    """What a field of a model is."""

    power: int | tuple[int, ...] = 0
    """Its dimension is ``time**power``; one power for all, or one for each column. Masses have one unit."""
    role: str = "parameter"
    """``parameter``: follows from the scene; ``kept``: goes on in a model that takes the place of this one;
    ``moment``: the same, of times of the epoch; ``origin``: when the counting of epochs began; ``present``:
    changes in a run, and is made anew; ``room``: written before it is read; ``given``: a model in the scene's
    unit of time; ``unit``: says the unit itself.
    """


parameter, kept, present = (
    Field,
    functools.partial(Field, role="kept"),
    functools.partial(Field, role="present"),
)
MOMENT, ORIGIN = Field(1, "moment"), Field(1, "origin")
ROOM, GIVEN, UNIT = Field(0, "room"), Field(0, "given"), Field(0, "unit")
KEPT = ("kept", "moment", "origin", "given")
"""Roles of what goes on in another model."""


@functools.cache
def fields_of(kind: Any) -> dict[str, Field]:
    """Return what each field of a ``kind`` of model is; by default a parameter without a unit of time."""
    try:
        hints = get_type_hints(kind, include_extras=True)
    except NameError:  # of a class inside of a function
        hints = {}
    said = {name: getattr(hint, "__metadata__", ()) for name, hint in hints.items()}
    return {
        name: next((each for each in said.get(name, ()) if isinstance(each, Field)), Field())
        for name in getattr(kind, "_fields", ())
    }


def remembers(model: Any) -> bool:
    """Tell whether a model keeps anything."""
    return any(each.role in KEPT for each in fields_of(type(model)).values())  # type: ignore[arg-type]


def arrays_in(value: Any, name: str = "", role: str = "parameter") -> Iterator[tuple[str, np.ndarray]]:
    """Yield the arrays of a model by their names, but no room, and not what follows from the scene.

    Parameters
    ----------
    value : model, array or number
        What may hold arrays.
    name : str
        What it is called, the beginning of their names.
    role : str
        What it is: its ``role``.
    """
    if isinstance(value, np.ndarray):
        if role not in ("parameter", "room"):
            yield name, value
    elif isinstance(value, tuple):
        declared = fields_of(type(value))
        for field, part in zip(declared or map(str, range(len(value))), value, strict=True):
            inherited = role if role == "given" else declared[field].role if declared else "parameter"
            yield from arrays_in(part, f"{name}.{field}" if name else field, inherited)


class Model(Questions):
    """What the engine asks of models of every kind that may remember something."""

    def shift_epoch(self, duration):
        """Refer arrays that depend on time to the start of the next epoch, ``duration`` later.

        By default there are none.
        """
        return

    def error_message(self):
        """Return a sentence that says why the run cannot continue, or None; called often from Python."""
        return

    def copy_state(self, before, instant, passed, slower):
        """Copy the memory of ``before``, a model of the same type that is replaced; called from Python.

        :meth:`carom.Simulation.rescale` and growing diameters replace models. By default all fields go on
        that are declared so (:class:`Field`), and those of the models in them.

        Parameters
        ----------
        before : model
            The model that this one replaces.
        instant : Fraction
            Present time since the start of the run, in the unit of the new model. Its epochs begin then.
        passed : float
            Present time since the beginning of the epoch, in the unit of the old model.
        slower : int
            The unit of time of the new model is longer by ``2**slower``.
        """
        _copy_fields(self, before, instant, passed, slower)


def copy_state(model, before, instant, passed, slower):
    """Copy whatever a model may hold.

    Parameters are those of :meth:`~carom.models.interfaces.memory.Model.copy_state`.
    """
    if isinstance(model, Model):
        model.copy_state(before, instant, passed, slower)
    elif isinstance(model, tuple):
        _copy_fields(model, before, instant, passed, slower)


def _copy_fields(model, before, instant, passed, slower):
    kind: Any = type(model)
    declared = fields_of(kind).values() or [Field()] * len(model)
    for (power, role), mine, old in zip(declared, model, before, strict=True):
        if role == "kept":
            mine[...] = np.ldexp(old, np.multiply(power, -slower, dtype=np.int32)) if power else old
        elif role == "moment":
            mine[...] = np.ldexp(old - passed, -slower)
        elif role == "origin":
            mine[...] = float(instant)
        elif role == "given":
            for (_, target), (_, source) in zip(
                *(arrays_in(each, "", role) for each in (mine, old)), strict=True
            ):
                target[...] = source
        else:
            copy_state(mine, old, instant, passed, slower)


def copied(model: Any) -> Any:
    """Return a model with copies of its arrays: what is tried, or run, leaves the memory of a value alone."""
    if isinstance(model, np.ndarray):
        return model.copy()
    if hasattr(model, "_fields"):
        return model._replace(**{name: copied(getattr(model, name)) for name in model._fields})
    if isinstance(model, tuple):
        return tuple(map(copied, model))
    return model
