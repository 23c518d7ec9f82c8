"""Observers of one's own: what is refused, what a file keeps of them, and how they are let in and out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models import model_checks
from carom.models.files import parameters
from carom.models.interfaces.memory import copied
from carom.models.interfaces.observer import ObserverModel
from carom.models.interfaces.particles import Particles
from carom.models.own.classes import kind_of
from carom.models.own.kinds import OBSERVER
from carom.simulation.model_validation.events import try_events
from carom.simulation.model_validation.setting import in_plain_python

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene
    from carom.simulation.run_state import RunState


def is_observer(value: Any) -> bool:
    """Tell whether a value is an observer of events."""
    if kind_of(value) is OBSERVER:
        return True
    asked = ("at_pair", "at_obstacle", "at_epoch")
    return isinstance(value, ObserverModel) and any(model_checks.answers(each, value) for each in asked)


def compiled(value: Any, particles: Particles) -> Any:
    """Return what the engine compiles for an observer: with arrays for these ``particles``."""
    return value.model(particles) if kind_of(value) is OBSERVER else value


def checked(observers: Sequence[Any], scene: Scene, system: System) -> tuple[Any, ...]:
    """Return observers with arrays of their own, to which a run adds."""
    if hasattr(observers, "_fields") or not isinstance(observers, list | tuple):
        raise InputError(f"observers must be a list of observers, found {checks.describe(observers)}.")
    found = []
    for each in observers:
        if isinstance(each, type) or not is_observer(each):
            what = f"the class {each.__name__}" if isinstance(each, type) else checks.describe(each)
            raise InputError(
                "An observer is a value of a class with @own.observer and at_pair, at_obstacle or at_epoch "
                f"(docs/models.md); found {what}."
            )
        with in_plain_python(each):
            observer = compiled(each, system.particles)
            model_checks.compilable("observer", observer)
            fixed = len(scene.obstacles) + 2 * int(np.sum(~np.asarray(scene.periodic)))
            try_events(copied(observer), scene, system.particles.radii, fixed)
        found.append(copied(observer))
    return tuple(found)


def described(observer: Any) -> dict[str, Any]:
    """Return what a file keeps of an observer beside its arrays: its class, and its numbers."""
    return parameters.class_and_parameters(_bare(observer))


def _bare(value: Any) -> Any:
    """Return a value without its arrays, which are those of the present."""
    if isinstance(value, np.ndarray):
        return None
    if isinstance(value, tuple):
        parts = map(_bare, value)
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


def recalled(
    stored: Sequence[Mapping[str, Any]], values: Sequence[Any], particles: Particles
) -> tuple[Any, ...]:
    """Return the observers of a run from a file, whose arrays are not filled yet."""
    given = [compiled(each, particles) for each in values]
    if len(stored) != len(given):
        names = ", ".join(str(each.get("class")) for each in stored) or "none"
        raise InputError(
            f"The observers of your own that the run has are {names}, which no file holds, and {len(given)} "
            "are given: give them, observers=[...], where the file is loaded."
        )
    for before, value in zip(stored, given, strict=True):
        other = parameters.difference(before, _bare(value))
        if other is not None:
            raise InputError(f"An observer of the file is {other}: give those of the run.")
    return tuple(map(copied, given))


@contextmanager
def observing(run_state: RunState, observer: Any) -> Iterator[Any]:
    """Let an observer in for as long as the body runs, and hand over the one to whose arrays is added."""
    if run_state.executive is not None:
        raise InputError(
            f"{type(observer).__name__} observes every event when it happens, and this simulation has "
            "several workers: make it with cores=1."
        )
    (mine,) = checked([observer], run_state.scene, run_state.system)
    with run_state.alone.changing():
        run_state.let_in((*run_state.system.observers, mine))
    try:
        yield mine
    finally:
        run_state.let_in(run_state.system.observers[:-1])
