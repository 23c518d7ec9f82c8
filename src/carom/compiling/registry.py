"""Questions that the engine asks of models, and what compiled code does with a function.

A basic function of the paper asks a small model, a named tuple, a *question*: a method of the model's class.
The class is known while code is compiled: what a scene does not have leaves no branch.
"""

from __future__ import annotations

from collections import namedtuple
from types import FunctionType
from typing import TYPE_CHECKING, Any, ClassVar, Self, dataclass_transform

FLAGS: dict[Any, str] = {}
"""What may be done to the floats of a function, and of those that it calls, as LLVM writes it."""

COLD: set[Any] = set()
"""Functions that are called, and not written where they are called."""


@dataclass_transform(frozen_default=True)
class _Tuples(type):
    """Make classes named tuples, as ``typing.NamedTuple`` does, that have a base class with methods, too."""

    def __new__(cls, name, bases, scope):
        if any(isinstance(base, _Tuples) and base.__mro__[1] is not tuple for base in bases):
            fields = dict.fromkeys(field for base in bases for field in getattr(base, "_fields", ()))
            fields |= dict.fromkeys(scope.get("__annotations__", ()))
            given = dict(each for base in bases for each in getattr(base, "_field_defaults", {}).items())
            given |= {field: scope.pop(field) for field in fields if field in scope}
            defaults = [given[field] for field in fields if field in given]
            bases = (namedtuple(name, fields, defaults=defaults, module=scope["__module__"]), *bases)
        return super().__new__(cls, name, bases, {"__slots__": (), **scope})


class Questions(tuple[Any, ...], metaclass=_Tuples):
    """What the engine asks of one kind of model: the methods of a class that derives from this one.

    A method's body is the answer of models that have no other. Models of that kind derive from the class in
    turn, and their annotated names are fields.
    """

    _fields: ClassVar[tuple[str, ...]]

    if TYPE_CHECKING:

        def _replace(self, **fields: Any) -> Self:
            """Return the model with other values of some fields."""


def fast(function):
    """Let a function have vectorized loops: the sign of a zero may be lost."""
    FLAGS[function] = "nsz "
    return function


def approximate(function):
    """As :func:`fast`, with contraction: to choose whom to look at, never for a time that is kept."""
    FLAGS[function] = "nsz contract "
    return function


def cold(function):
    """Let compiled code call a function in the place of writing it anew."""
    COLD.add(function)
    return function


def is_ours(module: str | None) -> bool:
    """Tell whether a module is part of this package."""
    return (module or "").partition(".")[0] == __name__.partition(".")[0]


def own_methods(classes) -> list[tuple[type, Any]]:
    """Return the methods of models of the user's among some classes: classes and functions."""
    return [
        (cls, method)
        for cls in dict.fromkeys(classes)
        for method in vars(cls).values()
        if isinstance(method, FunctionType) and not is_ours(method.__globals__.get("__name__"))
    ]


def answers(question: str, kind: type) -> bool:
    """Tell whether a type of model has an answer to a question beside that of the class which asks it."""
    said = [vars(each).get(question) for each in kind.__mro__] if issubclass(kind, Questions) else []
    return sum(isinstance(each, FunctionType) for each in said) > 1
