"""What is tried of a motion of one's own when a simulation is made."""

from __future__ import annotations

import math
from contextlib import suppress
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.models import choice
from carom.models.interface import NEVER, carry, meeting_time, step_time
from carom.simulation import probes
from carom.simulation.trials import TOLERANCE, Failure, Trial, flown

if TYPE_CHECKING:
    from carom.engine.requirements import Contents
    from carom.scene.scene import Scene

TRIED = 6
"""Pairs on which a motion is tried."""

ATTEMPTS = 200
"""Random pairs among which pairs that meet are looked for."""


def refuse_motion(pair: Any, scene: Scene, contents: Contents) -> None:
    """Raise InputError where a condition of :func:`carom.check` fails for the motion."""
    motion = contents.motion.model(contents.particles)
    name = type(contents.motion).__name__
    if contents.curved:
        for question in (carry, meeting_time):
            if not choice.answers(question, motion):
                raise InputError(
                    f"{name} has curved = True, and {type(motion).__name__} does not answer "
                    f"{question.__name__}: register a function with @{question.__name__}.register."
                )
    elif choice.answers(meeting_time, motion):
        raise InputError(f"{type(motion).__name__} answers meeting_time: give {name} curved = True.")
    failures: dict[tuple[str, int], Failure] = {}
    size = float(np.min(contents.particles.radii)) * 2.0
    speed = _pace(scene, contents)
    tried: dict[str, int] = {}
    trial = Trial(
        motion,
        contents.dimension,
        tried,
        failures,
        box=contents.box,
        size=size,
        speed=speed,
        growth=0.0,
        straight=contents.straight,
    )
    rng = np.random.default_rng(0)
    with np.errstate(all="ignore"):
        for _ in range(ATTEMPTS):
            with suppress(ArithmeticError, ValueError):  # compiled code goes on, without a number
                trial.motion(rng)
            if failures or tried.get("first" if contents.curved else "III", 0) >= TRIED:
                break
        if contents.curved and not failures:
            refuse_images(motion, contents, size, speed, rng)
    for (condition, _), failure in failures.items():
        knows = condition == "relative" and choice.is_own(contents.interaction)
        if knows and keeps_time(pair, motion, contents, speed):
            continue
        hint = ""
        if condition == "relative":
            hint = " An interaction may compute its times along this motion, or the motion be curved."
        raise InputError(
            f"{name} does not keep a condition of carom.check, on which the engine relies. {failure}.{hint}"
        )


def _pace(scene: Scene, contents: Contents) -> float:
    """Return a usual speed of components [length / engine's time]."""
    if scene.velocities is not None and scene.velocities.any():
        speed = float(np.sqrt(np.mean(scene.velocities**2)))
    else:
        speed = 1.0 / math.sqrt(scene.mass)
    return float(contents.unit.to_kernel(speed, -1))


def keeps_time(pair: Any, motion: Any, contents: Contents, speed: float) -> bool:
    """Tell whether condition IV holds for an interaction along the flights of a motion.

    Then relative flight need not be uniform: the interaction computes its times along it.
    """
    if contents.n < 2 or choice.answers(step_time, pair):
        return False
    rng, met = np.random.default_rng(1), 0
    for _ in range(ATTEMPTS):
        i, j = (int(k) for k in rng.choice(contents.n, 2, replace=False))
        r = rng.normal(size=contents.dimension)
        r *= contents.diameter * rng.uniform(1.5, 4.0) / np.linalg.norm(r)
        u = (0.3 * rng.normal(size=len(r)) - r / contents.diameter * rng.uniform(0.1, 1.0)) * speed
        x = 0.5 * np.asarray(contents.box) + np.array([0.0 * r, r])
        v = rng.normal(size=len(r)) * speed + np.array([0.0 * u, u])
        t = _between(pair, i, j, x, v, 0.0)
        if not t < NEVER:
            continue
        part = rng.uniform(0.1, 0.9) * t
        left = _between(pair, i, j, *flown(motion, x, v, part), part)
        if not abs(part + left - t) <= TOLERANCE * (t + contents.diameter / speed):
            return False
        met += 1
    return met > 0


def _between(pair: Any, i: int, j: int, x: np.ndarray, v: np.ndarray, now: float) -> float:
    """Return the time until two at places x and velocities v, (2, d), act on each other."""
    r, u = x[1] - x[0], v[1] - v[0]
    return probes.asked(pair, i, j, r @ r, r @ u, u @ u, now)


def refuse_images(
    motion: Any, contents: Contents, size: float, speed: float, rng: np.random.Generator
) -> None:
    """Raise InputError where components on curves get to a face of the box, and do not meet across it.

    The engine gives ``meeting_time`` the stored positions, and not the nearest image.
    """
    box, span, contact = np.asarray(contents.box), 20.0 * size / speed, 0.3 * size
    for axis in np.flatnonzero(contents.periodic).tolist():
        inwards = 2.0 * contact * np.eye(contents.dimension)[axis]
        for _ in range(ATTEMPTS):
            x = rng.uniform(0.3, 0.7, contents.dimension) * box
            x[axis] = -0.1 * contact  # outside: its image is inside, at the other end
            here = carry(motion, x + inwards, 0.0 * x, 0.0, np.empty_like(x), np.empty_like(x))[0]
            if not np.abs(np.asarray(here) - x - inwards).max() <= TOLERANCE * box.max():
                break  # the motion has its components elsewhere
            r = rng.normal(size=len(x))
            r[axis] = abs(r[axis]) + 0.5
            r *= contact * rng.uniform(1.2, 2.0) / np.linalg.norm(r)
            v = rng.normal(size=(2, len(x))) * speed
            image = x.copy()
            image[axis] += box[axis]
            t, across = (
                float(meeting_time(motion, *_records(a, b, v), 0.0, contact, 0.0, span, span)[0])
                for a, b in ((x + inwards, x + r + inwards), (image, x + r))
            )
            if not t < 0.1 * span:
                continue
            if not abs(t - across) <= TOLERANCE * span:
                raise InputError(
                    f"{type(contents.motion).__name__} lets components meet inside the box, and not across "
                    f"its face along axis {axis}: meeting_time gets positions in the box and must look at "
                    "their images itself, or keep components away from the faces."
                )
            break


def _records(x: np.ndarray, y: np.ndarray, v: np.ndarray) -> tuple[Any, Any]:
    return (SimpleNamespace(x=x, v=v[0], t=0.0), SimpleNamespace(x=y, v=v[1], t=0.0))
