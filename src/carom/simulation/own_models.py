"""What is tried of own models when a simulation is made: a few pairs of the scene, in plain Python.

It is what :func:`carom.check` tries of components that it makes up, and takes milliseconds. Carom's own
models are tried by the tests.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import CaromWarning, InputError, OverlapError
from carom.models import model_checks
from carom.models.copies import copied
from carom.models.questions.contact import exchanged_part
from carom.models.questions.interaction import core_square, jump, mass, radius, record_impulse
from carom.models.questions.memory import copy_state, remembers, shift_epoch
from carom.models.questions.motion import carry, meeting_time
from carom.models.questions.steps import step_bits, step_jump, step_time
from carom.models.questions.walls import wall_meeting
from carom.scene import overlaps
from carom.scene.fields import standing
from carom.scene.overlaps import room_at_start
from carom.simulation import obstacle_trials, probes
from carom.simulation.drive_trials import try_drive
from carom.simulation.motion_trials import try_flight, try_images
from carom.simulation.obstacle_trials import ObstacleTrial
from carom.simulation.pair_trials import PairTrial
from carom.simulation.trials import (
    TOLERANCE,
    Record,
    Setting,
    in_plain_python,
    number_of,
    try_impact,
)

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene

KINDS = 12
"""Components whose distances of contact are looked at: unlike ones, if there are so many."""

TRIED = 6  # events of a motion, of two components or with an obstacle that are tried at least

ATTEMPTS = 200  # random ways among which ways to events are looked for

IMPACTS = 64  # contacts on which a contact law is tried, and components on which a drive is

SEVERAL = 16  # obstacles that are tried, if there are so many


def check_user_models(scene: Scene, system: System) -> None:
    """Raise InputError where a model of one's own is not what the engine takes it for."""
    if model_checks.is_own(system.impact):
        with in_plain_python(system.impact):
            refuse_impact(scene, system)
    if scene.drive is not None and model_checks.is_own(scene.drive):
        with in_plain_python(scene.drive):
            refuse_wrong_drive(scene, system)
    own_pair, own_motion = model_checks.is_own(system.interaction), model_checks.is_own(system.motion)
    if own_pair or own_motion:
        with in_plain_python(system.interaction if own_pair else system.motion):
            refuse_pair_and_motion(scene, system)
    own_obstacles = [k for k, each in enumerate(standing(scene)) if obstacle_trials.is_own(each)]
    for k in own_obstacles[:: max(1, math.ceil(len(own_obstacles) / SEVERAL))]:
        resting = not hasattr(standing(scene)[k], "live")
        value = standing(scene)[k] if resting else system.obstacles[k]
        with in_plain_python(value):
            refuse_obstacle(value, scene, system)


def refuse_pair_and_motion(scene: Scene, system: System) -> None:
    """Raise InputError where an interaction, a motion or both together do not keep a condition."""
    pair, record, flight_record = system.interaction.model(system.particles), Record(), Record()
    own_pair, own_motion = model_checks.is_own(system.interaction), model_checks.is_own(system.motion)
    pairs: list[tuple[int, int]] = []
    if own_pair:
        refuse_without_steps(system.interaction, pair)
        if system.stepped:
            _refuse_few_steps(system.interaction, pair, system)
        step = probes.outermost(system.interaction, system.particles, 0, system.n - 1)
        refuse_short(pair, system.n, step)
        if system.curved and not model_checks.answers(core_square, pair):
            raise InputError(
                f"On curved paths two components touch at the distance that core_square answers, which "
                f"{type(pair).__name__} does not: give it that method."
            )
    if own_motion:
        refuse_motion_that_is_none(system)
    if system.n > 1:
        kinds = kinds_of(pair, system)
        pairs = list(_unlike_pairs(kinds, system.particles.radii))
        if own_pair and not system.curved:
            refuse_far(pair, pairs, system)
        if own_pair and not system.stepped:
            refuse_core(pair, kinds, scene, system)
    setting = setting_of(scene, system)
    rng, met = np.random.default_rng(0), 0
    if own_motion:
        for _ in range(TRIED):
            try_flight(setting, flight_record, rng)
        if not own_pair or any(name != "relative" for name, _ in flight_record.failures):
            refuse(type(system.motion).__name__, flight_record)
    if pairs:
        trial = PairTrial(system.interaction, copied(pair), setting, record, system.diameter)
        for k, (i, j) in zip(range(ATTEMPTS), itertools.cycle(pairs), strict=False):
            met += trial.of(rng, i, j) > 0
            if record.failures or (k + 1 >= len(pairs) and met >= TRIED):
                break
    if met == 0 or record.failures:  # else the interaction computes its times along the motion
        refuse(type(system.motion).__name__, flight_record)
    if own_motion:
        if system.curved and not record.failures:
            try_images(setting, record, rng)
        if system.walls is not None and model_checks.answers(wall_meeting, setting.motion):
            for _ in range(TRIED):
                obstacle_trials.try_walls(setting, record, rng)
    both = own_pair and own_motion
    name = " with ".join(
        type(each).__name__
        for each, own_obstacles in ((system.interaction, own_pair), (system.motion, own_motion))
        if own_obstacles
    )
    refuse(name, record, plural=both)


def refuse(name: str, record: Record, plural: bool = False) -> None:
    """Raise InputError with the first condition that does not hold; only warn where energy is added."""
    failures = list(record.failures.values())
    for failure in failures:
        if failure.condition != "gain":
            do = "do" if plural else "does"
            raise InputError(
                f"{name} {do} not keep a condition of carom.check, on which the engine relies. {failure}"
            )
    for failure in failures:
        warnings.warn(f"{name} makes energy. {failure}", CaromWarning, stacklevel=2)


def setting_of(scene: Scene, system: System) -> Setting:
    """Return the components of a scene, and how they move."""
    return Setting(
        system.particles,
        tuple(map(bool, system.periodic)),
        system.motion.model(system.particles),
        system.straight,
        system.curved,
        float(np.min(system.particles.radii)) * 2.0,
        _pace(scene, system),
    )


def _pace(scene: Scene, system: System) -> float:
    """Return a usual speed of components [length / engine's time]."""
    if scene.velocities is not None and scene.velocities.any():
        speed = float(np.sqrt(np.mean(scene.velocities**2)))
    else:
        speed = 1.0 / math.sqrt(scene.mass)
    return float(system.unit.to_kernel(speed, -1))


def refuse_motion_that_is_none(system: System) -> None:
    """Raise InputError where a motion is curved and cannot say when two meet, or does not say that it is."""
    model, name = system.motion.model(system.particles), type(system.motion).__name__
    if system.curved:
        for question in (carry, meeting_time):
            if not model_checks.answers(question, model):
                raise InputError(
                    f"{name} has curved = True, and {type(model).__name__} does not answer "
                    f"{question.__name__}: give it that method."
                )
    elif model_checks.answers(meeting_time, model):
        raise InputError(f"{type(model).__name__} answers meeting_time: give {name} curved = True.")


def refuse_impact(scene: Scene, system: System) -> None:
    """Raise InputError where the part that a contact law exchanges is none; warn where it adds energy."""
    law, n, record = system.impact.model(system.particles), system.n, Record()
    if law is None or n < 2:
        return
    law = copied(law)
    try:
        number_of(exchanged_part, law, n - 2, n - 1, np.float64(1.0), np.float64(-1.0), 0.0)
    except IndexError:
        raise InputError(_short(law, _shortest(law, n), n)) from None
    setting, rng = setting_of(scene, system), np.random.default_rng(2)
    pairs = list(_unlike_pairs(kinds_of(law, system), system.particles.radii))
    for _, (i, j) in zip(range(max(IMPACTS, len(pairs))), itertools.cycle(pairs), strict=False):
        try_impact(law, system.impact, setting, record, rng, i, j)
    refuse(type(system.impact).__name__, record)


def refuse_wrong_drive(scene: Scene, system: System) -> None:
    """Raise InputError where the times or the kicks of a drive are none."""
    model = copied(scene.drive.model(system.particles))  # type: ignore[union-attr]
    setting, record, rng = setting_of(scene, system), Record(), np.random.default_rng(5)
    for _ in range(IMPACTS):
        try_drive(model, setting, record, rng, int(rng.integers(system.n)))
    refuse(type(scene.drive).__name__, record)


def refuse_obstacle(value: Any, scene: Scene, system: System) -> None:
    """Raise InputError where components do not meet an obstacle when they touch it, or it is no obstacle."""
    setting, record, rng = setting_of(scene, system), Record(), np.random.default_rng(3)
    particles = system.particles
    growth = 0.0 if particles.rates is None else float(particles.rates.max())
    trial = ObstacleTrial(value, setting, record, growth)
    some = rng.integers(0, system.n, ATTEMPTS)
    anywhere = rng.uniform(0.0, 1.0, (ATTEMPTS // 2, system.dimension)) * setting.box
    places = np.concatenate([scene.positions[some[: ATTEMPTS // 2]], anywhere])
    met = 0
    for k, start in enumerate(trial.starts(rng, places[::3], particles.radii[some[::3]])):
        met += trial.of(*start)
        if record.failures or (met >= TRIED and k >= 2 * TRIED):
            break
    refuse(str(value.name), record)


def refuse_without_steps(value: Any, pair: Any) -> None:
    """Raise InputError where an interaction has steps by its value and not by its model, or lacks a part."""
    name, model = type(value).__name__, type(pair).__name__
    stepped = model_checks.answers(step_time, pair)
    if stepped and not hasattr(value, "steps"):
        raise InputError(f"{model} answers step_time, and {name} {model_checks.lacks(value, 'steps')}.")
    if not stepped and hasattr(value, "steps"):
        raise InputError(f"{name} has steps, and {model} does not answer step_time.")
    if not stepped:
        return
    for field, shape in (("energy", "(steps,)"), ("events", "(steps, 4)")):
        if not isinstance(getattr(pair, field, None), np.ndarray):
            raise InputError(f"{model} has steps, and no array {field}, {shape}: give it that field.")


def _refuse_few_steps(value: Any, pair: Any, system: System) -> None:
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

    That is what a lane names, and ``radii`` and ``masses`` if :func:`radius` and :func:`mass` are not
    answered. Others are found by asking for the last component and the ghost, on a ``step``.
    """
    named = {*getattr(pair, "lanes", ())}
    for question, name in ((radius, "radii"), (mass, "masses")):
        if not model_checks.answers(question, pair) and getattr(pair, name, None) is not None:
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
    one = np.float64(1.0)
    for j in (n - 1, n):
        for i in {0, n - 1} - {j}:
            try:
                probes.time(pair, i, j, one, one, step)
                if j < n and step is None and model_checks.answers(jump, pair):
                    number_of(lambda i=i, j=j: jump(pair, i, j, one, -one, 0.0)[0])
                elif j < n and step is not None:
                    number_of(lambda i=i, j=j: step_jump(pair, i, j, step, one, -one, 0.0)[0])
            except IndexError:
                raise InputError(_short(pair, _shortest(pair, n), n)) from None


def check_copy_state(system: System) -> None:
    """Raise InputError where a model of one's own has a memory, and no answer to copy it into a new model."""
    own_obstacles = [value for value in (system.interaction, system.impact) if model_checks.is_own(value)]
    for model in (*(value.model(system.particles) for value in own_obstacles), *system.obstacle_models):
        known = remembers(model) or model_checks.answers(copy_state, model)
        asked = any(model_checks.answers(question, model) for question in (shift_epoch, record_impulse))
        if model_checks.is_own(model) and asked and not known:
            raise InputError(
                f"{type(model).__name__} has a memory, and rescale() and growth make the models anew: "
                "give it a method copy_state that copies it."
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


def kinds_of(model: Any, system: System) -> np.ndarray:
    """Return a number for each component, (n,): equal where no field of the model and no radius differs."""
    n = system.n
    columns = [system.particles.radii, system.particles.masses]
    for values in model:
        if isinstance(values, np.ndarray) and values.ndim > 0 and len(values) >= n:
            columns.append(values[:n].reshape(n, -1).astype(float))
    kinds = np.zeros(n, np.int64)
    for column in columns:  # one after the other: sorting numbers is much faster than sorting rows
        if (column == column[0]).all():
            continue
        several = np.ascontiguousarray(column).reshape(n, -1)
        values = several[:, 0] if several.shape[1] == 1 else several
        which = np.unique(values, axis=0, return_inverse=True)[1].ravel()
        kinds = np.unique(kinds * (which.max() + 1) + which, return_inverse=True)[1].ravel()
    return kinds


def _unlike_pairs(kinds: np.ndarray, radii: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield pairs of components of different kinds, and of one."""
    _, indices = np.unique(kinds, return_index=True)
    chosen = indices[np.unique(np.linspace(0, len(indices) - 1, KINDS).astype(int))]
    some = np.unique([radii.argmin(), radii.argmax(), *chosen]).tolist()
    yield from itertools.combinations(some, 2)
    for i in some:
        others = np.flatnonzero(kinds == kinds[i])
        if len(others) > 1:
            yield i, int(others[others != i][0])


def by_kind(kinds: np.ndarray, pairs: np.ndarray, question: Callable[[int, int], float]) -> np.ndarray:
    """Return what a ``question`` of two answers for ``pairs`` (m, 2), asked once for any two ``kinds``."""
    if not len(pairs):
        return np.zeros(0)
    sorted_kinds = np.sort(kinds[pairs], axis=1)
    names = sorted_kinds[:, 0] * (int(kinds.max()) + 1) + sorted_kinds[:, 1]
    _, indices, which = np.unique(names, return_index=True, return_inverse=True)
    return np.array([float(question(i, j)) for i, j in pairs[indices].tolist()])[which.ravel()]


def refuse_core(pair: Any, kinds: np.ndarray, scene: Scene, system: System) -> None:
    """Raise OverlapError where two components start inside the distance that they keep.

    That is ``core_square``, or where they are thrown back also from where they are.
    """
    geometry = room_at_start(scene)
    speed = float(system.unit.to_kernel(1.0, -1))
    pairs = geometry.near(geometry.wrapped(scene.positions), system.diameter)
    distances = geometry.distances(scene.positions, pairs)
    core = np.sqrt(by_kind(kinds, pairs, lambda i, j: max(float(core_square(pair, i, j, 0.0)), 0.0)))
    throw = by_kind(kinds, pairs, lambda i, j: probes.contact_distance(pair, i, j, system.diameter, speed))
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
