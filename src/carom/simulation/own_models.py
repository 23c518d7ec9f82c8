"""What is tried of models of one's own when a simulation is made: a few pairs, in plain Python, in
milliseconds. Carom's own models are not tried: the tests do that.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError, OverlapError
from carom.models import choice
from carom.models.interface import (
    age,
    core_square,
    exchanged_part,
    jump,
    mass,
    radius,
    step_time,
    take_over,
    taken_up,
)
from carom.scene import overlaps
from carom.scene.overlaps import Room
from carom.simulation import probes
from carom.simulation.own_motions import refuse_motion
from carom.simulation.trials import TOLERANCE

if TYPE_CHECKING:
    from carom.engine.requirements import Contents
    from carom.scene.scene import Scene

KINDS = 12
"""Components whose distances of contact are looked at: unlike ones, if there are so many."""


def refuse_unsound(scene: Scene, contents: Contents) -> None:
    """Raise InputError where a model of one's own is not what the engine takes it for.

    Raises
    ------
    InputError
        If the array of a model is too short, two components act on each other beyond the reach of their
        interaction, or a condition of the paper fails for a motion (:func:`carom.check`).
    OverlapError
        If two components are inside the distance at which the interaction throws them back.
    """
    if choice.is_own(contents.impact):
        refuse_short_impact(contents)
    own_pair, own_motion = choice.is_own(contents.interaction), choice.is_own(contents.motion)
    if not (own_pair or own_motion):
        return
    pair = contents.interaction.model(contents.particles)
    if own_pair:
        refuse_short(pair, contents.n)
        if not choice.answers(step_time, pair):
            kinds = kinds_of(pair, contents)
            refuse_far(pair, kinds, contents)
            refuse_core(pair, kinds, scene, contents)
    if own_motion:
        refuse_motion(pair, scene, contents)


def refuse_short(pair: Any, n: int) -> None:
    """Raise InputError where a field of one value a component has fewer than ``n + 1`` items, or is no array.

    What a lane names is such a field, and ``radii`` and ``masses`` if :func:`radius` and :func:`mass` are not
    answered. Others are found by asking the model for the last component and the ghost.
    """
    named = {*getattr(pair, "lanes", ())}
    for question, name in ((radius, "radii"), (mass, "masses")):
        if not choice.answers(question, pair) and getattr(pair, name, None) is not None:
            named.add(name)
    arrays = {name: getattr(pair, name) for name in pair._fields}
    for name, values in arrays.items():
        if name in named and not isinstance(values, np.ndarray):
            raise InputError(
                f"The field {name} of {type(pair).__name__} is a {type(values).__name__}; expected an array "
                f"of {n + 1} items: make it with particles.with_ghost."
            )
        if name in named and len(values) < n + 1:
            raise InputError(_short(pair, name, n))
        if name in getattr(pair, "lanes", ()) and not (values.ndim == 1 and values.flags.c_contiguous):
            raise InputError(
                f"The field {name} of {type(pair).__name__} is named by lanes, and is an array of shape "
                f"{values.shape}, strides {values.strides}; expected one of one value a component, and "
                "contiguous: make it with particles.with_ghost."
            )
    if choice.answers(step_time, pair):
        return
    one = np.float64(1.0)
    for j in (n - 1, n):
        for i in {0, n - 1} - {j}:
            try:
                probes.time(pair, i, j, one, one)
                if j < n and choice.answers(jump, pair):
                    jump(pair, i, j, one, -one, 0.0)
            except IndexError:
                raise InputError(_short(pair, _shortest(pair, n), n)) from None


def refuse_short_impact(contents: Contents) -> None:
    """Raise InputError where a contact law of two components has a field too short for the last of them."""
    law, n = contents.impact.model(contents.particles), contents.n
    if law is None or n < 2:
        return
    try:
        exchanged_part(law, n - 2, n - 1, np.float64(1.0), np.float64(-1.0), 0.0)
    except IndexError:
        raise InputError(_short(law, _shortest(law, n), n)) from None


def refuse_forgetful(contents: Contents) -> None:
    """Raise InputError where a model of one's own has a memory, and no answer to copy it into a new model."""
    own = [value for value in (contents.interaction, contents.impact) if choice.is_own(value)]
    for model in (*(value.model(contents.particles) for value in own), *contents.obstacle_models):
        remembers = any(choice.answers(question, model) for question in (age, taken_up))
        if choice.is_own(model) and remembers and not choice.answers(take_over, model):
            raise InputError(
                f"{type(model).__name__} has a memory, and rescale() and growth make the models anew: "
                "register an answer to take_over that copies it."
            )


def _shortest(model: Any, n: int) -> str:
    """Return the field of a model that has too few items for n components, or an empty string."""
    fields = {name: getattr(model, name) for name in model._fields}
    fewer = {
        name: len(values)
        for name, values in fields.items()
        if isinstance(values, np.ndarray) and values.ndim > 0 and len(values) <= n
    }
    return max(fewer, key=fewer.__getitem__, default="")


def _short(model: Any, name: str, n: int) -> str:
    found = f"{len(getattr(model, name))}" if name else "fewer"
    field = f"The field {name}" if name else "A field"
    return (
        f"{field} of {type(model).__name__} has {found} items; expected {n + 1}, one a component and one for "
        "the ghost: make it with particles.with_ghost."
    )


def refuse_far(pair: Any, kinds: np.ndarray, contents: Contents) -> None:
    """Raise InputError where two components act on each other beyond the reach of their interaction."""
    speed, radii = float(contents.unit.to_kernel(1.0, -1)), contents.reaches
    for i, j in _unlike_pairs(kinds, contents.particles.radii):
        reach = contents.diameter if radii is None else float(radii[i] + radii[j])
        found = probes.contact_distance(pair, i, j, contents.diameter, speed)
        if found > reach * (1.0 + TOLERANCE):
            kind = "reach(scene)" if radii is None else "the sum of their radii (by_radii)"
            raise InputError(
                f"Components {i} and {j} act on each other {found:.6g} apart, beyond {kind} of "
                f"{type(contents.interaction).__name__}, {reach:.6g}: the engine would not look so far. Let "
                "reach return the largest such distance."
            )


def kinds_of(pair: Any, contents: Contents) -> np.ndarray:
    """Return a number for each component, (n,): equal where no field of the model and no radius differs."""
    n = contents.n
    columns = [contents.particles.radii[:, None], contents.particles.masses[:, None]]
    for values in pair:
        if isinstance(values, np.ndarray) and values.ndim > 0 and len(values) >= n:
            columns.append(values[:n].reshape(n, -1).astype(float))
    return np.unique(np.hstack(columns), axis=0, return_inverse=True)[1].ravel()


def _unlike_pairs(kinds: np.ndarray, radii: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield pairs of components of different kinds, and of one."""
    _, first = np.unique(kinds, return_index=True)
    spread = first[np.unique(np.linspace(0, len(first) - 1, KINDS).astype(int))]
    some = np.unique([radii.argmin(), radii.argmax(), *spread]).tolist()
    yield from itertools.combinations(some, 2)
    for i in some:
        others = np.flatnonzero(kinds == kinds[i])
        if len(others) > 1:
            yield i, int(others[others != i][0])


def refuse_core(pair: Any, kinds: np.ndarray, scene: Scene, contents: Contents) -> None:
    """Raise OverlapError where two components start inside the distance that they keep.

    This is what ``core_square`` answers, or the distance at which they are thrown back, if they are thrown
    back from where they are, too.
    """
    room = Room(np.asarray(scene.box), np.asarray(scene.periodic))
    speed = float(contents.unit.to_kernel(1.0, -1))
    pairs = room.near(room.wrapped(scene.positions), contents.diameter)
    distances = room.distances(scene.positions, pairs)
    _, first, which = np.unique(kinds[pairs], axis=0, return_index=True, return_inverse=True)
    cores, throws = np.zeros(len(first)), np.zeros(len(first))
    for k, (i, j) in enumerate(pairs[first].tolist()):
        cores[k] = math.sqrt(max(float(core_square(pair, i, j, 0.0)), 0.0))
        throws[k] = probes.contact_distance(pair, i, j, contents.diameter, speed)
    core, throw = cores[which.ravel()], throws[which.ravel()]
    for k in np.flatnonzero(distances < np.maximum(core, throw)).tolist():
        (i, j), distance, contact = pairs[k].tolist(), float(distances[k]), float(core[k])
        if probes.time(pair, i, j, distance, speed) == 0.0:
            contact = max(contact, float(throw[k]))
        depth = contact - distance
        # What a root of far away leaves is no overlap.
        if depth > max(overlaps.tolerance(room.box, contact), TOLERANCE * contact):
            raise OverlapError(
                f"Components {i} and {j} overlap by {depth:.3g} at the start: they are {distance:.6g} apart, "
                f"and {type(contents.interaction).__name__} keeps them {contact:.6g} apart. Move them."
            )
