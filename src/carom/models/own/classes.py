"""From one class to a value, which users write, and a model, which the engine compiles."""

from __future__ import annotations

import dataclasses
import dis
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from types import FunctionType, ModuleType
from typing import Annotated, Any, NamedTuple

import numpy as np

from carom import checks, suggestions
from carom.compiling import registry
from carom.compiling.registry import Questions
from carom.errors import InputError, OverlapError
from carom.models.interfaces.memory import parameter
from carom.models.interfaces.obstacle import LIVE
from carom.models.interfaces.particles import NEVER, Particles
from carom.models.interfaces.steps import step_bits
from carom.models.obstacles.convex import gap_of, outline_of
from carom.models.own import fields
from carom.models.own.arrays import Prepared, per_particle
from carom.models.own.fields import Meaning
from carom.models.own.kinds import CONVEX, INTERACTION, OBSERVER, OBSTACLE, PATH, STEPPED, Kind, signature
from carom.texts import with_article
from carom.units import TimeUnit

MISSPELT = 0.85
"""How alike a method's name and that of one that is asked are at least, where one is meant for the other."""

OF_INTERACTIONS = ("radii", "masses")  # what every interaction has, for obstacles and for elastic contacts

PACKAGES = sys.stdlib_module_names | {"carom", "numba", "numpy", "scipy"}
"""Packages whose functions the compiler knows, or never can."""


class Own(NamedTuple):
    """What the decorator knows of a class."""

    kind: Kind
    meanings: dict[str, Meaning]  # of the fields
    parts: dict[str, Prepared]  # the arrays beside them
    constants: dict[str, Any]  # numbers of the class that its compiled methods read
    compiled: Any  # the type that the engine compiles
    methods: tuple[Any, ...]  # the functions that are compiled


def kind_of(value: Any) -> Kind | None:
    """Return the kind of a model of one's own, or None for any other value."""
    definition = getattr(type(value), "_own", None)
    return definition.kind if isinstance(definition, Own) else None


def made(cls: Any, kind: Kind, names: Mapping[str, Any]) -> Any:
    """Return a class as a frozen dataclass with its compiled type; ``names`` are for its annotations."""
    if not isinstance(cls, type):
        raise InputError(f"own.{kind.decorator} decorates a class, found {cls!r}.")
    if kind is INTERACTION and any(hasattr(cls, name) for name in STEPPED.required):
        kind = STEPPED
    for name in ("__init__", "__slots__"):
        if name in vars(cls):
            raise InputError(
                f"{cls.__name__} has {name}: leave it out. Its fields are annotated names, `contact: float`, "
                "and __post_init__(self) may check them."
            )
    before = getattr(cls, "_own", None)
    own_meanings = fields.meanings(cls, names)
    meanings = {**(before.meanings if before else {}), **own_meanings}
    parts = dict(before.parts) if before else {}
    for name, each in list(vars(cls).items()):
        if isinstance(each, Prepared):
            parts[name] = each
            delattr(cls, name)
            each.power = meanings.pop(name, fields.returned(each.make, names)).power
            others = inspect.get_annotations(cls).items()
            cls.__annotations__ = {field: hint for field, hint in others if field != name}
    if kind is OBSTACLE and "name" not in meanings:
        meanings["name"] = Meaning("text")
        cls.__annotations__ = {**inspect.get_annotations(cls), "name": str}
        setattr(cls, "name", getattr(cls, "name", cls.__name__))  # noqa: B010 (a type checker knows no such name)
    if kind is OBSTACLE and hasattr(cls, "closest"):
        kind = CONVEX
        for name, follows in (("gap", gap_of), ("outline", outline_of), ("surface", outline_of)):
            if not hasattr(cls, name):
                setattr(cls, name, follows)
    methods = _methods(cls, kind, meanings)
    helpers = _helpers(cls, methods)
    whole = _completed(kind, parts, meanings, methods)
    constants = _constants(cls, methods | helpers, {*meanings, *whole}, meanings)
    given = [name for name, each in meanings.items() if each.word != "text"]
    items = (*given, *constants, *whole)
    asked = {name for base in kind.base.__mro__ if issubclass(base, Questions) for name in vars(base)}
    asked -= set(vars(Questions))
    taken = next((name for name in (*items, *helpers) if name in asked), None)
    if taken is not None:
        what = "method" if taken in helpers else "field"
        raise InputError(
            f"{cls.__name__} has a {what} {taken}, which is the name of a question that Carom asks of "
            f"{with_article(kind.name)}: give the {what} another name."
        )
    scope = {"__module__": cls.__module__, "__annotations__": dict.fromkeys(items, Any)}
    compiled: Any = type(kind.base)(cls.__name__, (kind.base,), scope)
    compiled.__qualname__ = f"{cls.__qualname__}.Compiled"
    compiled.__doc__ = f"What the engine compiles of {cls.__name__}."
    if not kind.converted:  # who reads the arrays after a run has the methods of the class, too
        for name, each in vars(cls).items():
            if isinstance(each, FunctionType | property) and name not in methods and name[:2] != "__":
                setattr(compiled, name, each)
    setattr(compiled, "lanes", _lanes(cls, methods, meanings, whole))  # noqa: B010 (a tuple has no such name)
    for name, function in methods.items():
        setattr(compiled, name, function)
        setattr(compiled, kind.questions[name].__name__, function)
    for name, function in helpers.items():
        setattr(compiled, name, function)
    _age(compiled, parts, methods)
    said = {name: parameter(each.power) for name, each in meanings.items() if name in given}
    said |= {name: each.field for name, each in whole.items()}
    compiled.__annotations__ = {name: Annotated[Any, each] for name, each in said.items()}
    functions = (*methods.values(), *helpers.values())
    definition = Own(kind, meanings, whole, constants, compiled, functions)
    return _value(cls, definition, compiled)


def _methods(cls: type, kind: Kind, meanings: Mapping[str, Meaning]) -> dict[str, Callable[..., Any]]:
    """Return the methods of a class that are compiled."""
    compiled = {name: signature(question) for name, question in kind.questions.items()}
    there = {name: inspect.getattr_static(cls, name, None) for name in (*compiled, *kind.asked, *kind.may)}
    found = {name: there[name] for name in compiled if isinstance(there[name], FunctionType)}
    functions = (*found.values(), *_helpers(cls, found).values())
    read = {name for function in functions for name in _reads(function)}
    for name, question in kind.questions.items():
        if name != question.__name__ and hasattr(cls, question.__name__):
            raise InputError(f"{cls.__name__} has {question.__name__}: write {name}.")
    for name, wanted in {**kind.may, **kind.asked, **compiled}.items():
        if (
            there[name] is None
            or name in meanings
            or (name in compiled and name not in found and name in read)
        ):
            continue
        given = _parameters(there[name])
        if (given or ())[1:] != wanted[1:] if name in found else not _takes(there[name], wanted):
            raise InputError(
                f"{name} of {cls.__name__} must be written {_written(name, wanted)}, found "
                + (checks.describe(there[name]) if given is None else f"the parameters ({', '.join(given)})")
                + "."
            )
    written = [name for name in vars(cls) if name[0] != "_" and name not in meanings and name not in there]
    for name in (*kind.required, *kind.asked):
        if there[name] is not None or name in meanings or (name == "step_of" and hasattr(cls, "steps_of")):
            continue
        alike = suggestions.nearest(name, written)
        raise InputError(
            f"{cls.__name__} is {with_article(kind.name)} and has no {name}"
            + (f", but {alike}" if alike else "")
            + f": give it {_written(name, {**compiled, **kind.asked}[name])}."
        )
    for name in written:
        alike = suggestions.nearest(name, there, MISSPELT)
        if alike and name not in read and isinstance(getattr(cls, name), FunctionType | bool):
            raise InputError(
                f"{cls.__name__} has {name}, which nobody asks; did you mean {alike}? Else give it a name "
                "that is less alike."
            )
    if kind is OBSERVER and isinstance(there["add"], FunctionType):
        _refuse_writing("add", cls, there["add"])
    if "is_periodic" in found and "anchor" not in found:
        raise InputError(f"{cls.__name__} has is_periodic, and no anchor: give it def anchor(self, axis).")
    if kind is OBSERVER and not found:
        raise InputError(f"{cls.__name__} is an observer and has none of {', '.join(kind.questions)}.")
    return found


def _written(name: str, wanted: tuple[str, ...]) -> str:
    return f"def {name}({', '.join(wanted)})" if wanted else f"{name} = ..."


def _parameters(value: Any) -> tuple[str, ...] | None:
    """Return the parameters of a method, a star for others than plain ones; None of what is none."""
    if not isinstance(value, FunctionType):
        return None
    code = value.__code__
    others = code.co_kwonlyargcount or code.co_flags & (inspect.CO_VARARGS | inspect.CO_VARKEYWORDS)
    return code.co_varnames[: code.co_argcount] + ("*",) * bool(others)


def _takes(value: Any, wanted: tuple[str, ...]) -> bool:
    """Tell whether a method can be called with these parameters; a fact, whether it is no method."""
    if not wanted or not isinstance(value, FunctionType):
        return callable(value) == bool(wanted)
    try:
        inspect.signature(value).bind(*wanted)
    except TypeError:
        return False
    return True


def _completed(
    kind: Kind, parts: Mapping[str, Prepared], meanings: Mapping[str, Meaning], methods: Mapping[str, Any]
) -> dict[str, Prepared]:
    """Return all arrays that a model has beside its fields."""
    found = dict(parts)
    for name, each in found.items():
        if each.times and not kind.converted:
            raise InputError(
                f"The memory {name} holds times of a run, not of an epoch: leave out times=True."
            )
        if each.size is not None and (each.size not in meanings or meanings[each.size].word != "integer"):
            raise InputError(
                f"The memory {name} has as many items as the field {each.size}, which is no int."
            )
    if kind in (INTERACTION, STEPPED):
        for name in OF_INTERACTIONS:
            if name not in meanings:
                found.setdefault(name, per_particle(name))
    if kind is STEPPED:
        for name, each in OF_STEPS.items():
            if name in meanings or found.get(name, each) is not each:
                raise InputError(
                    f"The {name} of steps is an array of Carom's own: give the field or array {name} another "
                    "name."
                )
            found[name] = each
    return found


def _energies(value: Any) -> np.ndarray:
    """Return the energy of each step, checked [energy]."""
    given = value.energies()
    try:
        found = np.asarray(given, np.float64)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.ndim != 1 or len(found) < 2 or np.isnan(found).any():
        raise InputError(
            f"energies() of {type(value).__name__} must return one energy for each of at least two steps, "
            f"found {given!r}."
        )
    return found


def _padded(value: Any, particles: Particles) -> np.ndarray:
    energies = _energies(value)
    padded = np.full(1 << step_bits(len(energies)), NEVER)
    padded[: len(energies)] = energies
    return padded


def _no_events(value: Any, particles: Particles) -> np.ndarray:
    return np.zeros((1 << step_bits(len(_energies(value))), 4), np.int64)


OF_STEPS = {"energy": Prepared(_padded, power=-2), "events": Prepared(_no_events, remembers=True)}
"""Arrays that every interaction with steps has."""


def _refuse_writing(name: str, cls: type, function: Callable[..., Any]) -> None:
    """Raise InputError where a method assigns to an attribute: the engine's tuples have none to assign to."""
    for step in dis.get_instructions(function):
        if step.opname == "STORE_ATTR":
            raise InputError(
                f"{name} of {cls.__name__} assigns to .{step.argval}, and fields and arrays stay what they "
                f"are: write into an array of own.memory(...), self.{step.argval}[i] = ..."
            )


def _reads(function: Callable[..., Any]) -> Iterator[str]:
    """Yield the names that a method reads of its model, its first parameter."""
    self_name, last = function.__code__.co_varnames[0], None
    for step in dis.get_instructions(function):
        if step.opname in ("LOAD_ATTR", "LOAD_METHOD") and last == self_name:
            yield step.argval
        name = step.argval
        if isinstance(name, tuple) and name:  # two variables in one instruction
            name = name[-1]
        last = name if step.opname.startswith("LOAD_FAST") else None


def _helpers(cls: type, methods: Mapping[str, Callable[..., Any]]) -> dict[str, Callable[..., Any]]:
    """Return the other methods that those which are compiled call, and that these call."""
    found: dict[str, Callable[..., Any]] = {}
    waiting = list(methods.values())
    while waiting:
        for name in _reads(waiting.pop()):
            method = inspect.getattr_static(cls, name, None)
            if isinstance(method, FunctionType) and name not in methods and name not in found:
                found[name] = method
                waiting.append(method)
    return found


def _constants(
    cls: type,
    methods: Mapping[str, Callable[..., Any]],
    known: set[str],
    meanings: Mapping[str, Meaning],
) -> dict[str, Any]:
    """Return the numbers of a class that its compiled methods read."""
    found = {}
    for question, function in methods.items():
        _refuse_writing(question, cls, function)
        for name in _reads(function):
            label = f"{question} of {cls.__name__}"
            value = getattr(cls, name, None)
            if (
                name in known and not (name in meanings and meanings[name].word == "text")
            ) or name in methods:
                continue
            if not isinstance(value, bool | int | float):
                alike = suggestions.nearest(name, known)
                raise InputError(
                    f"{label} reads self.{name}, which is no number and no array of the class"
                    + (f"; did you mean {alike}?" if alike else f"; it has {', '.join(sorted(known))}.")
                )
            found[name] = value
    return found


def _lanes(
    cls: type,
    methods: Mapping[str, Callable[..., Any]],
    meanings: Mapping[str, Meaning],
    parts: Mapping[str, Prepared],
) -> tuple[str, ...]:
    """Return the arrays, one value a particle, that the search reads of candidates."""
    asked = methods.get("interaction_time") or methods.get("step_time")
    if asked is None:
        return ()
    helpers = _helpers(cls, {"": asked})
    read = [function for each in (asked, *helpers.values()) for function in called(each)]
    names = {name for function in read for name in function.__code__.co_names}
    each = [name for name, meaning in meanings.items() if meaning.word == "per particle"]
    each += [name for name, part in parts.items() if part.each]
    return tuple(name for name in each if name in names)


def _is_users(module: str | None) -> bool:
    return (module or "").partition(".")[0] not in PACKAGES


def called(function: Callable[..., Any]) -> list[FunctionType]:
    """Return a function, and those of the user's that it calls, and that these call."""
    found: dict[Any, None] = {}
    waiting = [function]
    while waiting:
        one: Any = waiting.pop()
        if one in found:
            continue
        found[one] = None
        names, scope = one.__code__.co_names, one.__globals__
        reached = [scope[name] for name in names if name in scope]
        for module in [each for each in reached if isinstance(each, ModuleType) and _is_users(each.__name__)]:
            reached += [getattr(module, name, None) for name in names]
        for cell in one.__closure__ or ():
            try:
                reached.append(cell.cell_contents)
            except ValueError:  # not bound yet
                continue
        waiting += [each for each in reached if isinstance(each, FunctionType) and _is_users(each.__module__)]
    return list(found)


def _age(compiled: Any, parts: Mapping[str, Prepared], methods: Mapping[str, Any]) -> None:
    """Let the times that a model remembers go on when an epoch ends."""
    times = tuple(name for name, each in parts.items() if each.times)

    def shift(self, duration):
        for name in times:
            remembered = getattr(self, name)
            for k in range(len(remembered)):
                remembered[k] -= duration

    if times and "shift_epoch" not in methods:
        compiled.shift_epoch = shift


def model_of(value: Any, particles: Particles | None, unit: TimeUnit | None) -> Any:
    """Return what the engine compiles for an own value; without ``unit`` quantities stay as they are."""
    cls = type(value)
    if "_own" not in vars(cls):
        base = next(each for each in cls.__mro__ if "_own" in vars(each))
        raise InputError(
            f"{cls.__name__} is a subclass of {base.__name__} without a decorator of its own, so its methods "
            "are not compiled: decorate it, too."
        )
    definition = cls._own
    found: dict[str, Any] = dict(definition.constants)
    one_each: set[str] = set()
    for name, meaning in definition.meanings.items():
        if meaning.word != "text":
            found[name] = fields.compiled(getattr(value, name), meaning, unit)
        if meaning.word == "per particle" and found[name] is not None:
            one_each.add(name)
    for name, part in definition.parts.items():
        found[name] = fields.converted(part.made(value, particles), part.power, unit)
        if part.each:
            one_each.add(name)
    for name in one_each:
        label = f"{name} of {cls.__name__}"
        if not isinstance(found[name], np.ndarray) or found[name].ndim == 0:
            raise InputError(f"{label} must be an array, found {checks.describe(found[name])}.")
        if particles is not None:
            fields.refuse_other_count(found[name], len(particles.radii), label)
        if definition.kind.padded:
            found[name] = np.concatenate([found[name], found[name][:1]])
    return definition.compiled(**found)


def sized(value: Any, n: int) -> Any:
    """Return a value that has the arrays of one value a particle for n particles: its own, over and over."""
    definition = getattr(type(value), "_own", None)
    if not isinstance(definition, Own):
        return value
    changed = {}
    for name, meaning in definition.meanings.items():
        each = getattr(value, name)
        if meaning.word == "per particle" and each is not None:
            changed[name] = np.resize(each, (n, *each.shape[1:]))
    return dataclasses.replace(value, **changed) if changed else value


def _value(cls: Any, definition: Own, compiled: Any) -> Any:
    """Return a class as a frozen dataclass with the methods that Carom asks in Python."""
    kind, written = definition.kind, vars(cls)
    users = getattr(cls, "__post_init__", None) if "__post_init__" in written else None
    usual_check = getattr(cls, "check", None)

    def __post_init__(self):
        for name, meaning in definition.meanings.items():
            given = fields.checked(getattr(self, name), meaning, f"{name} of {cls.__name__}")
            object.__setattr__(self, name, given)
        if users is not None:
            users(self)

    def __eq__(self, other):
        if type(other) is not type(self):
            return NotImplemented
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in definition.meanings)

    def __hash__(self):
        shown = (getattr(self, name) for name in definition.meanings)
        return hash((cls, *(each.tobytes() if isinstance(each, np.ndarray) else each for each in shown)))

    def model(self, particles):
        return model_of(self, particles, particles.unit if kind.converted else None)

    def check(self, scene):
        for name, meaning in definition.meanings.items():
            values = getattr(self, name)
            if meaning.word == "per particle" and values is not None:
                fields.refuse_other_count(values, scene.n, f"{name} of {cls.__name__}")
        if usual_check is not None:
            usual_check(self, scene)

    added: dict[str, Any] = {"_own": definition, "Compiled": compiled}  # where other processes find the type
    added |= {"__post_init__": __post_init__, "__eq__": __eq__, "__hash__": __hash__}
    if kind in (OBSTACLE, CONVEX):
        added |= _of_obstacle(cls, definition)
    elif kind is PATH:
        added["model"] = lambda self, unit: model_of(self, None, unit)
    else:
        added |= {"model": model, "check": check}
    if kind is STEPPED:
        added |= {name: each for name, each in _of_steps().items() if name not in written}
    for name, each in added.items():
        setattr(cls, name, each)
    try:
        return dataclasses.dataclass(frozen=True, eq=False)(cls)
    except (TypeError, ValueError) as error:
        raise InputError(f"The fields of {cls.__name__} are not those of a dataclass: {error}.") from None


def _of_obstacle(cls: Any, definition: Own) -> dict[str, Any]:
    """Return the methods of an obstacle's value: ``live`` where it moves, remembers or has quantities."""

    def at_rest(self):
        return model_of(self, None, None)

    def live(self, particles):
        return model_of(self, particles, particles.unit)

    def nobody(self):
        nothing = np.zeros(1)
        return live(self, Particles((), nothing, nothing, None, None, True, TimeUnit()))

    def check(self, box, periodic):
        return None

    written = cls.gap

    def gap(self, positions, *args):
        found = written(self, positions, *args)
        if np.shape(found) != (len(positions),):
            shown = f"the shape {np.shape(found)}" if np.ndim(found) else checks.describe(found)
            raise InputError(
                f"gap of {cls.__name__} must return {len(positions)} distances, one a particle, found "
                f"{shown}."
            )
        return np.asarray(found, np.float64)

    found: dict[str, Any] = {"gap": gap} | ({} if hasattr(cls, "check") else {"check": check})
    alive = any(registry.answers(question, definition.compiled) for question in LIVE)
    alive |= any(each.each or each.remembers for each in definition.parts.values())
    alive |= any(each.power or each.word == "per particle" for each in definition.meanings.values())
    return {**found, "model": nobody, "live": live} if alive else {**found, "model": at_rest}


def _of_steps() -> dict[str, Any]:
    """Return what the value of an interaction with steps answers about them."""

    def steps(self, particles):
        # Beyond their reach all pairs are on the first.
        return len(_energies(self)), np.zeros((1, 1), np.int64)

    def steps_of(self, pairs, distances, species, diameter):
        name, last = f"step_of(distance) of {type(self).__name__}", len(_energies(self)) - 1
        given = [self.step_of(each) for each in np.asarray(distances).tolist()]
        whole = [int(each) if isinstance(each, bool | np.bool_) else each for each in given]
        found = np.array([checks.integer(each, name, low=-1, high=last) for each in whole], np.int64)
        wrong = np.flatnonzero(found < 0)
        if len(wrong):
            i, j = (int(k) for k in pairs[wrong[0]])
            raise OverlapError(
                f"Particles {i} and {j} are {distances[wrong[0]]:.9g} apart, where {type(self).__name__} has "
                "no step for them: move them."
            )
        return found

    return {"steps": steps, "steps_of": steps_of}
