"""What is tried of own models when a simulation is made: a few pairs of the scene, in plain Python.

It is what :func:`carom.check` tries of components that it makes up, and takes milliseconds. Carom's own
models are tried by the tests.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError, warn
from carom.models import model_checks
from carom.models.interfaces.memory import copied
from carom.models.obstacles import faces
from carom.models.obstacles.box_walls import wall_name
from carom.scene.fields import standing
from carom.simulation.model_validation.events import try_drive, try_impact
from carom.simulation.model_validation.interactions import refuse_interaction, short, shortest, unlike_pairs
from carom.simulation.model_validation.motions import refuse_motion_that_is_none, try_flight, try_images
from carom.simulation.model_validation.obstacles import ObstacleTrial, try_walls
from carom.simulation.model_validation.pairs import PairTrial
from carom.simulation.model_validation.probes import kinds_of
from carom.simulation.model_validation.setting import Record, Setting, in_plain_python, number_of

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene

TRIED = 6  # events of a motion, of two components or with an obstacle that are tried at least

ATTEMPTS = 200  # random ways among which ways to events are looked for

IMPACTS = 64  # contacts on which a contact law is tried, and components on which a drive is

SEVERAL = 16  # obstacles that are tried, if there are so many


def try_own_models(kinds: set[str], obstacles: list[int], scene: Scene, system: System) -> None:
    """Raise InputError where own models, of these ``kinds`` and numbers, are not what the engine wants."""
    setting = setting_of(scene, system)
    owners = {"drive": system.scene}
    values = {kind: getattr(owners.get(kind, system), kind) for kind in TRIALS if kind in kinds}
    for kind, value in values.items():
        # The model of an elastic impact is None.
        model = (
            value.model(setting.particles)
            if kind == "impact"
            else model_checks.made(value, setting.particles)
        )
        model_checks.answered(kind, model)
    for k in obstacles:
        model_checks.answered(f"obstacle {standing(scene)[k].name}", system.obstacle_models[k])
    if "interaction" in kinds:  # it is tried along the motion
        values.pop("motion", None)
    tried = list(values.items())
    for k in obstacles[:: max(1, math.ceil(len(obstacles) / SEVERAL))]:
        resting = not hasattr(standing(scene)[k], "live")
        tried.append(("obstacle", standing(scene)[k] if resting else system.obstacles[k]))
    for kind, value in tried:
        with in_plain_python(value):
            TRIALS[kind](value, scene, system, setting)


def refuse_own_walls(system: System, scene: Scene) -> None:
    """Raise InputError if an own motion meets all walls, and an obstacle stands for one or lies in it."""
    model = system.motion.model(system.particles)
    fixed = standing(scene), scene.box, scene.periodic
    found = [*faces.stand_ins(*fixed), *faces.yielding(*fixed)]
    if found and model_checks.answers("wall_meeting", model):
        raise InputError(
            f"An obstacle is at the wall {wall_name(*found[0])}, and {type(scene.motion).__name__} answers "
            "wall_meeting for all walls of the box: move the obstacle away from the wall."
        )


def refuse_pair_and_motion(value: Any, scene: Scene, system: System, setting: Setting) -> None:
    """Raise InputError where an interaction, a motion or both together do not keep a condition."""
    own_pair, own_motion = model_checks.is_own(system.interaction), model_checks.is_own(system.motion)
    pair, record, flight_record = system.interaction.model(system.particles), Record(), Record()
    kinds = kinds_of(pair, system)
    pairs = list(unlike_pairs(kinds, system.particles.radii))
    if own_pair:
        refuse_interaction(pair, pairs, kinds, scene, system)
    if own_motion:
        refuse_motion_that_is_none(system)
        refuse_own_walls(system, scene)
    rng, met = np.random.default_rng(0), 0
    if own_motion:
        for _ in range(TRIED):
            try_flight(setting, flight_record, rng)
        others = {each: failure for each, failure in flight_record.failures.items() if each[0] != "relative"}
        found = others if own_pair else flight_record.failures
        refuse(type(system.motion).__name__, Record(failures=found))
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
        if system.walls is not None and model_checks.answers("wall_meeting", setting.motion):
            for _ in range(TRIED):
                try_walls(setting, record, rng)
    both = own_pair and own_motion
    name = " with ".join(
        type(each).__name__
        for each, is_own in ((system.interaction, own_pair), (system.motion, own_motion))
        if is_own
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
        warn(f"{name} makes energy. {failure}")


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


def refuse_impact(value: Any, scene: Scene, system: System, setting: Setting) -> None:
    """Raise InputError where the part that a contact law exchanges is none; warn where it adds energy."""
    law, n, record = value.model(system.particles), system.n, Record()
    if law is None or n < 2:
        return
    law = copied(law)
    try:
        number_of("exchanged_part", law, n - 2, n - 1, np.float64(1.0), np.float64(-1.0), 0.0)
    except IndexError:
        raise InputError(short(law, shortest(law, n), n)) from None
    rng = np.random.default_rng(2)
    pairs = list(unlike_pairs(kinds_of(law, system), system.particles.radii))
    for _, (i, j) in zip(range(max(IMPACTS, len(pairs))), itertools.cycle(pairs), strict=False):
        try_impact(law, value, setting, record, rng, i, j)
    refuse(type(value).__name__, record)


def refuse_wrong_drive(value: Any, scene: Scene, system: System, setting: Setting) -> None:
    """Raise InputError where the times or the kicks of a drive are none."""
    model = copied(value.model(system.particles))
    record, rng = Record(), np.random.default_rng(5)
    for _ in range(IMPACTS):
        try_drive(model, setting, record, rng, int(rng.integers(system.n)))
    refuse(type(value).__name__, record)


def refuse_obstacle(value: Any, scene: Scene, system: System, setting: Setting) -> None:
    """Raise InputError where components do not meet an obstacle when they touch it, or it is no obstacle."""
    record, rng = Record(), np.random.default_rng(3)
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


TRIALS = {
    "impact": refuse_impact,
    "drive": refuse_wrong_drive,
    "interaction": refuse_pair_and_motion,
    "motion": refuse_pair_and_motion,
    "obstacle": refuse_obstacle,
}
