"""Questions that the engine asks of models, and what compiled code does with a function.

A basic function of the paper asks a small model, a named tuple, a *question*: a method of the model's class.
The class is known while code is compiled: what a scene does not have leaves no branch. Pairs and obstacles
are asked by functions, whose answers are chosen by :func:`functools.singledispatch`.
"""

from __future__ import annotations

from collections import namedtuple
from functools import singledispatch, wraps
from inspect import CO_VARARGS
from types import FunctionType
from typing import TYPE_CHECKING, Any, ClassVar, Self, dataclass_transform

from carom.errors import InputError

FLAGS: dict[Any, str] = {}
"""What may be done to the floats of a function, and of those that it calls, as LLVM writes it."""

COLD: set[Any] = set()
"""Functions and questions that are called, and not written where they are called."""

REQUIRED: set[Any] = set()
"""Questions without an answer for all models."""


IN_USE: set[type] = set()
"""Classes for which an entry point has been compiled, or loaded."""

QUESTIONS: list[Any] = []
"""All questions."""


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
    """Let compiled code call a function, or the answers to a question, in the place of writing them anew."""
    COLD.add(function)
    return function


def required(function):
    """Make a function, only a docstring, a question that all models of its kind must answer."""

    @wraps(function)
    def unanswered(model, *args):
        raise TypeError(f"{type(model).__name__} has no {function.__name__}: register one.")

    generic = _question(unanswered, function)
    REQUIRED.add(generic)
    return generic


def optional(function):
    """Make ``function(model, ...)`` a question; its body is the answer of models that register no other."""
    return _question(function, function)


def answering(*places):
    """Let the methods of a class of models answer the questions of their names: a class decorator."""
    asked = {
        name: each
        for place in places
        for name, each in ({place.__name__: place} if hasattr(place, "registry") else vars(place)).items()
        if hasattr(each, "registry")
    }

    def decorate(kind):
        for name, method in list(vars(kind).items()):
            if name in asked and isinstance(method, FunctionType):  # a field may have the name of a question
                asked[name].register(kind)(method)
        return kind

    return decorate


def _question(default, question):
    """Return a question whose ``register`` refuses answers without its parameters, or that come late."""
    generic: Any = singledispatch(default)
    register, wanted = generic.register, question.__code__

    def register_alike(*args):
        answer = args[-1]
        code: Any = getattr(answer, "__code__", None)
        if isinstance(answer, type) and len(args) == 1:  # the answer comes next
            return lambda answer: register_alike(*args, answer)
        plain = code is None or code.co_flags & CO_VARARGS or answer is generic.registry[object]
        if not plain and len(args) == 1 and not getattr(answer, "__annotations__", None):
            raise InputError(
                f"An answer to {question.__name__} must say which type of model it is for: annotate its "
                f"first parameter, def _({wanted.co_varnames[0]}: YourModel, ...)."
            )
        if not plain and code.co_argcount != wanted.co_argcount:
            names = wanted.co_varnames[: wanted.co_argcount]
            raise InputError(
                f"An answer to {question.__name__} takes {wanted.co_argcount} parameters "
                f"({', '.join(names)}), found {code.co_argcount} in {code.co_filename}, line "
                f"{code.co_firstlineno}."
            )
        before = dict(generic.registry)
        function = register(*args)
        for cls in IN_USE & generic.registry.keys():
            if generic.registry[cls] is not before.get(cls):
                register(cls, before.get(cls, before[object]))
                raise RuntimeError(
                    f"{generic.__name__} is compiled for {cls.__name__}: another function would not be "
                    f"asked. Define {cls.__name__} anew, too (in a notebook: run its cell again)."
                )
        return function

    generic.register = register_alike
    QUESTIONS.append(generic)
    return generic


def is_ours(module: str | None) -> bool:
    """Tell whether a module is part of this package."""
    return (module or "").partition(".")[0] == __name__.partition(".")[0]


def own_answers(classes) -> list[tuple[str, type, Any]]:
    """Return what the user has registered for their classes: names of questions, classes, functions."""
    return [
        (question.__name__, cls, question.registry[cls])
        for cls in dict.fromkeys(classes)
        if not is_ours(cls.__module__)  # a rule is asked by a class of ours
        for question in QUESTIONS
        if cls in question.registry and not is_ours(question.registry[cls].__globals__.get("__name__"))
    ]


def answers(question, kind: type) -> bool:
    """Tell whether a type of model has an answer of its own to a question."""
    if isinstance(question, str):
        above = kind.__mro__[: kind.__mro__.index(Questions) - 1] if issubclass(kind, Questions) else ()
        return any(isinstance(vars(each).get(question), FunctionType) for each in above)
    return kind in question.registry
