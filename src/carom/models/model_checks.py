"""Interaction, motion, impact and drive of a scene: what is given, checked, or what usual keywords mean."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom import checks, suggestions
from carom.compiling import registry
from carom.compiling.faults import unknown_part
from carom.errors import InputError
from carom.models.contacts.restitution import Restitution
from carom.models.drives import DriveModel
from carom.models.files import parameters, tables
from carom.models.interactions.hard_cores import HardCores
from carom.models.interfaces.contact import ImpactModel
from carom.models.interfaces.interaction import PairModel
from carom.models.interfaces.memory import remembers
from carom.models.interfaces.motion import MotionModel
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.interfaces.particles import Particles
from carom.models.motions.free_flight import FreeFlight
from carom.models.own.classes import kind_of

USUAL: dict[str, type] = {"interaction": HardCores, "motion": FreeFlight, "impact": Restitution}
"""The kinds that keywords and files describe."""

REQUIRED: dict[str, tuple[str, ...]] = {
    "interaction": ("interaction_time", "jump"),
    "motion": ("position", "velocity"),
    "impact": ("transfer",),
    "drive": ("next_time", "kick"),
    "obstacle": ("encounter", "outward"),
}
"""The questions that the model of each kind must answer."""

BASES: dict[str, type] = {
    "interaction": PairModel,
    "motion": MotionModel,
    "impact": ImpactModel,
    "drive": DriveModel,
    "obstacle": ObstacleModel,
}
"""The classes from which models of each kind derive."""

STEPPED: tuple[str, ...] = ("step_time", "step_jump")
"""The questions that the model of an interaction with steps must answer, instead of those above."""

METHODS: dict[str, tuple[str, ...]] = {
    "interaction": ("reach", "model"),
    "motion": ("model",),
    "impact": ("model",),
    "drive": ("model",),
}
"""What the value of each kind must have."""


def checked(kind: str, value: Any) -> Any:
    """Return the value of an interaction, a motion, an impact or a drive, or None where none is given."""
    if value is None:
        return None
    example = "Andersen" if kind == "drive" else USUAL[kind].__name__
    wanted = f"{kind} must be a value with {' and '.join(METHODS[kind])}, such as {example}()"
    if isinstance(value, str) and (call := tables.call_of(kind, value)):
        raise InputError(f"{kind} must be a value, found the text {value!r}; write {kind}={call}.")
    if isinstance(value, type):
        raise InputError(f"{wanted}; found the class {value.__name__}, not a value of it.")
    known = kind_of(value)
    if known is not None and known.decorator != kind:
        raise InputError(f"{wanted}; found {type(value).__name__}, which is made with own.{known.decorator}.")
    for name in METHODS[kind]:
        if not callable(getattr(value, name, None)):
            raise InputError(f"{wanted}; found {checks.describe(value)}, which {lacks(value, name)}.")
    if kind != "interaction" and callable(getattr(value, "reach", None)):
        raise InputError(f"{wanted}; found {type(value).__name__}, an interaction: it has reach.")
    for name, other in (("steps", "steps_of"), ("steps_of", "steps")):
        if kind == "interaction" and hasattr(value, name) and not callable(getattr(value, other, None)):
            raise InputError(f"{type(value).__name__} has {name}, and no {other}: give it both.")
    return value


def is_own(value: Any) -> bool:
    """Tell whether a value is of a class from outside of the package; None is not."""
    return value is not None and type(value).__module__.partition(".")[0] != "carom"


def lacks(value: Any, name: str) -> str:
    """Return that a value has no method of this name, and which of a similar name it has."""
    made = is_own(value) and type(value).__module__ not in ("builtins", "numpy")
    given = [each for each in dir(value) if made and not each.startswith("_")]
    similar = suggestions.nearest(name, given)
    return f"has no {name}" + (f", but {similar}" if similar else "")


def made(value: Any, particles: Particles) -> Any:
    """Return the model that a value of one's own makes."""
    model = value.model(particles)
    if model is None:
        raise InputError(
            f"model(particles) of {type(value).__name__} returns None; expected a model: end it with return."
        )
    return model


def compilable(kind: str, model: Any) -> Any:
    """Return a model that is a named tuple of what the compiler knows."""
    wanted = "expected a number, an array of numbers, None, or a tuple of these"
    if not hasattr(model, "_fields"):
        raise InputError(f"The model of the {kind} is {checks.describe(model)}; expected a NamedTuple.")
    for field in model._fields:
        found = unknown_part(getattr(model, field), field)
        if found is not None:
            name, part = found
            what = f"an array of {part.dtype}" if isinstance(part, np.ndarray) else checks.describe(part)
            raise InputError(
                f"The field {name} of {type(model).__name__}, the model of the {kind}, is {what}, which the "
                f"compiler does not know; {wanted}."
            )
    return model


def answered(kind: str, model: Any) -> Any:
    """Return a model that can be compiled, all of whose required questions are answered."""
    if model is not None:
        compilable(kind, model)
    what, name = kind.split()[0], type(model).__name__
    base = BASES[what]
    if model is not None and not isinstance(model, base):
        raise InputError(
            f"The model of the {kind} is of the class {name}, which does not derive from {base.__module__}."
            f"{base.__name__}: let it do so, or write one class with own.{what} (docs/models.md)."
        )
    has_steps = what == "interaction" and registry.answers("step_time", type(model))
    for question in STEPPED if has_steps else REQUIRED[what]:
        if not registry.answers(question, type(model)):
            raise InputError(
                f"The {kind} {name} does not answer {question}: give it that method (docs/models.md)."
            )
    return model


def answers(question: Any, model: Any) -> bool:
    """Tell whether the type of a model has an answer of its own to a question."""
    return registry.answers(question, type(model))


def contact_range_of(interaction: Any, scene: Any) -> float:
    """Return the reach of an interaction in a scene, checked [length]."""
    name = f"reach(scene) of {type(interaction).__name__}"
    return checks.number(interaction.reach(scene), name, low=0.0, open_low=True)


def check_copy_state(system: Any) -> None:
    """Raise InputError where a model of one's own has a memory, and no answer to copy it into a new model."""
    own = [value for value in (system.interaction, system.impact) if is_own(value)]
    for model in (*(value.model(system.particles) for value in own), *system.obstacle_models):
        known = remembers(model) or answers("copy_state", model)
        asked = any(answers(question, model) for question in ("shift_epoch", "record_impulse"))
        if is_own(model) and asked and not known:
            raise InputError(
                f"{type(model).__name__} has a memory, and rescale() and growth make the models anew: "
                "give it a method copy_state that copies it."
            )


def recalled(kind: str, stored: Any, given: Any) -> Any:
    """Return the value for a scene from a file, or None for the usual one."""
    if stored is not None and given is None and "type" in stored:
        return tables.from_table(stored, kind)
    if stored is not None and given is None:
        rules = " On the command line, read the file of the rule and say `--trust-code`."
        raise InputError(
            f"The {kind} of this scene is of the class {stored.get('class')}, which no file holds; "
            f"give the value, {kind}=..., where the file is loaded."
            f"{rules if stored.get('class') == 'Ranges' else ''}"
        )
    if stored is not None and "class" in stored:
        other = parameters.difference(stored, given)
        if other is not None:
            raise InputError(f"The {kind} of the file is {other}: give the value of the run.")
    return given
