"""What an interaction of one's own has to be: its fields, its reach and its cores; which pairs are tried."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError, OverlapError
from carom.geometry import overlaps
from carom.models import model_checks
from carom.models.interfaces.steps import step_bits
from carom.scene.fields import geometry_at_start
from carom.simulation.model_validation import probes
from carom.simulation.model_validation.setting import TOLERANCE, number_of

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene

KINDS = 12
"""Components whose distances of contact are looked at: unlike ones, if there are so many."""


def refuse_interaction(
    pair: Any, pairs: list[tuple[int, int]], kinds: np.ndarray, scene: Scene, system: System
) -> None:
    """Raise InputError where an interaction is not what the engine takes it for, before events are tried."""
    refuse_without_steps(system.interaction, pair)
    if system.stepped:
        refuse_few_steps(system.interaction, pair, system)
    refuse_short(pair, system.n, probes.outermost(system.interaction, system.particles, 0, system.n - 1))
    if system.curved and not model_checks.answers("core_square", pair):
        raise InputError(
            f"On curved paths two components touch at the distance that core_square answers, which "
            f"{type(pair).__name__} does not: give it that method."
        )
    if system.n > 1 and not system.curved:
        refuse_far(pair, pairs, system)
    if system.n > 1 and not system.stepped:
        refuse_core(pair, kinds, scene, system)


def refuse_without_steps(value: Any, pair: Any) -> None:
    """Raise InputError where an interaction has steps by its value and not by its model, or lacks a part."""
    name, model = type(value).__name__, type(pair).__name__
    stepped = model_checks.answers("step_time", pair)
    if stepped and not hasattr(value, "steps"):
        raise InputError(f"{model} answers step_time, and {name} {model_checks.lacks(value, 'steps')}.")
    if not stepped and hasattr(value, "steps"):
        raise InputError(f"{name} has steps, and {model} does not answer step_time.")
    if not stepped:
        return
    for field, shape in (("energy", "(steps,)"), ("events", "(steps, 4)")):
        if not isinstance(getattr(pair, field, None), np.ndarray):
            raise InputError(f"{model} has steps, and no array {field}, {shape}: give it that field.")


def refuse_few_steps(value: Any, pair: Any, system: System) -> None:
    """Raise InputError where tables of steps have not the rows that the engine reads."""
    count, model = int(value.steps(system.particles)[0]), type(pair).__name__
    rows = 1 << step_bits(count)
    for field, shape in (("energy", (rows,)), ("events", (rows, 4))):
        found = getattr(pair, field).shape
        if found != shape:
            raise InputError(
                f"The field {field} of {model} has the shape {found}; expected {shape}, for {count} steps "
                f"2**step_bits({count}) rows."
            )


def refuse_short(pair: Any, n: int, step: int | None = None) -> None:
    """Raise InputError where a field of one value a component has fewer than ``n + 1`` items, or is no array.

    That is what a lane names, and ``radii`` and ``masses`` if ``radius_of`` and ``mass_of`` are not
    answered. Others are found by asking for the last component and the padding row, on a ``step``.
    """
    named = {*getattr(pair, "lanes", ())}
    for question, name in (("radius_of", "radii"), ("mass_of", "masses")):
        if not model_checks.answers(question, pair) and getattr(pair, name, None) is not None:
            named.add(name)
    arrays = {name: getattr(pair, name) for name in pair._fields}
    for name, values in arrays.items():
        if name in named and not isinstance(values, np.ndarray):
            raise InputError(
                f"The field {name} of {type(pair).__name__} is a {type(values).__name__}; expected an array "
                f"of {n + 1} items: make it with particles.with_padding."
            )
        if name in named and len(values) < n + 1:
            raise InputError(short(pair, name, n))
        if name in getattr(pair, "lanes", ()) and not (values.ndim == 1 and values.flags.c_contiguous):
            raise InputError(
                f"The field {name} of {type(pair).__name__} is named by lanes, and is an array of shape "
                f"{values.shape}, strides {values.strides}; expected one of one value a component, and "
                "contiguous: make it with particles.with_padding."
            )
    one = np.float64(1.0)
    for j in (n - 1, n):
        for i in {0, n - 1} - {j}:
            try:
                probes.time(pair, i, j, one, one, step)
                if j < n and step is None and model_checks.answers("jump", pair):
                    checks.answer("jump", pair, i, j, one, -one, 0.0)
                elif j < n and step is not None:
                    checks.answer("step_jump", pair, i, j, step, one, -one, 0.0)
            except IndexError:
                raise InputError(short(pair, shortest(pair, n), n)) from None


def shortest(model: Any, n: int) -> str:
    """Return the field of a model that has too few items for n components, or an empty string."""
    fields = {name: getattr(model, name) for name in model._fields}
    fewer = {
        name: len(values)
        for name, values in fields.items()
        if isinstance(values, np.ndarray) and values.ndim > 0 and len(values) <= n
    }
    return max(fewer, key=fewer.__getitem__, default="")


def short(model: Any, name: str, n: int) -> str:
    """Return the sentence that a field has too few items."""
    found = f"{len(getattr(model, name))}" if name else "fewer"
    field = f"The field {name}" if name else "A field"
    return (
        f"{field} of {type(model).__name__} has {found} items; expected {n + 1}, one a component and one for "
        "the padding row: make it with particles.with_padding."
    )


def refuse_far(pair: Any, pairs: list[tuple[int, int]], system: System) -> None:
    """Raise InputError where two components act on each other beyond the reach of their interaction."""
    speed, radii = float(system.unit.to_kernel(1.0, -1)), system.reaches
    for i, j in pairs:
        contact_range = system.diameter if radii is None else float(radii[i] + radii[j])
        step = probes.outermost(system.interaction, system.particles, i, j)
        found = probes.contact_distance(pair, i, j, system.diameter, speed, step)
        if found > contact_range * (1.0 + TOLERANCE):
            kind = "reach(scene)" if radii is None else "the sum of their radii (by_radii)"
            raise InputError(
                f"Components {i} and {j} act on each other {found:.6g} apart, beyond {kind} of "
                f"{type(system.interaction).__name__}, {contact_range:.6g}: the engine would not look so "
                "far. Let reach return the largest such distance."
            )


def unlike_pairs(kinds: np.ndarray, radii: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield pairs of components of different kinds, and of one."""
    _, indices = np.unique(kinds, return_index=True)
    chosen = indices[np.unique(np.linspace(0, len(indices) - 1, KINDS).astype(int))]
    some = np.unique([radii.argmin(), radii.argmax(), *chosen]).tolist()
    yield from itertools.combinations(some, 2)
    for i in some:
        others = np.flatnonzero(kinds == kinds[i])
        if len(others) > 1:
            yield i, int(others[others != i][0])


def refuse_core(pair: Any, kinds: np.ndarray, scene: Scene, system: System) -> None:
    """Raise OverlapError where two components start inside the distance that they keep.

    That is ``core_square``, or where they are thrown back also from where they are.
    """
    geometry = geometry_at_start(scene)
    speed = float(system.unit.to_kernel(1.0, -1))
    pairs = geometry.near(geometry.wrapped(scene.positions), system.diameter)
    distances = geometry.distances(scene.positions, pairs)
    squares = probes.by_kind(kinds, pairs, lambda i, j: number_of("core_square", pair, i, j, 0.0))
    core = np.sqrt(np.maximum(squares, 0.0))
    throw = probes.by_kind(
        kinds, pairs, lambda i, j: probes.contact_distance(pair, i, j, system.diameter, speed)
    )
    for k in np.flatnonzero(distances < np.maximum(core, throw)).tolist():
        (i, j), distance, contact = pairs[k].tolist(), float(distances[k]), float(core[k])
        if probes.time(pair, i, j, distance, speed) == 0.0:
            contact = max(contact, float(throw[k]))
        depth = contact - distance
        # What a root of far away leaves is no overlap.
        if depth > max(overlaps.tolerance(geometry.box, contact), TOLERANCE * contact):
            raise OverlapError(
                f"Components {i} and {j} overlap by {depth:.3g} at the start: they are {distance:.6g} apart, "
                f"and {type(system.interaction).__name__} keeps them {contact:.6g} apart. Move them."
            )
