"""Motions, tried on one component, between two walls, and across the faces of the box."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models import model_checks
from carom.models.interfaces.particles import NEVER
from carom.simulation.model_validation.setting import TOLERANCE, Record, Setting, record_of, time_of

if TYPE_CHECKING:
    from carom.engine.system import System

ATTEMPTS = 200  # random pairs among which one that meets across a face is looked for


def try_flight(setting: Setting, record: Record, rng: np.random.Generator, relative: bool = True) -> None:
    """Try that flights add up, that relative flight is straight, and ``exit_time``, on a pair from ``rng``.

    Without ``relative`` two may fly as they like relative to each other: an interaction knows how.
    """
    motion, d = setting.motion, setting.dimension
    time = setting.size / setting.speed
    if setting.curved:
        x = 0.5 * setting.box + setting.size * rng.uniform(-1.0, 1.0, (2, d))
    else:
        x = rng.uniform(0.0, 1.0, (2, d)) * setting.box
    # To go nowhere is to be put where the motion has its components.
    x, v = setting.moved(x, rng.normal(size=(2, d)) * setting.speed, 0.0)
    first_time, second_time = rng.uniform(0.0, 2.0, 2) * time
    places, speeds = setting.moved(*setting.moved(x, v, first_time), second_time)
    at_once, then = setting.moved(x, v, first_time + second_time)
    size = np.abs(x).max() + np.abs(at_once).max() + np.abs(then).max() * time
    facts = {"x": x[0], "v": v[0], "first": first_time, "second": second_time}
    off = max(np.abs(places - at_once).max(), np.abs(speeds - then).max() * time)
    record.note("III", d, off <= TOLERANCE * size, **facts, off=off)
    if setting.curved:
        return
    if relative:
        straight = (x[1] - x[0]) + (first_time + second_time) * (v[1] - v[0])
        off = np.abs((at_once[1] - at_once[0]) - straight).max()
        record.note("relative", d, off <= TOLERANCE * size, **facts, off=off)
    if model_checks.answers("bend", motion):
        bound = checks.answer("bend", motion)[0] * (first_time + second_time)
        change = np.linalg.norm(then - v, axis=1).max()
        slack = TOLERANCE * np.abs(then).max()
        record.note("bend", d, change <= bound + slack, **facts, change=change, bound=bound)
    if setting.straight:
        off = np.abs(at_once - x - (first_time + second_time) * v).max()
        record.note("uniform", d, off <= TOLERANCE * size, **facts, off=off)
    for axis in range(d):
        low, high = x[0, axis] + setting.size * (rng.uniform(0.01, 2.0, 2) * (-1.0, 1.0))
        t, up = checks.answer("exit_time", motion, axis, x[0, axis], v[0, axis], low, high)
        if not t < NEVER:
            continue
        way = [motion.position(axis, x[0, axis], v[0, axis], s * t) for s in np.linspace(0, 1, 33)]
        slack = TOLERANCE * size
        inside = min(way) >= low - slack and max(way) <= high + slack
        there = abs(way[-1] - (high if up else low)) <= slack
        record.note(
            "exit", d, inside and there, **facts, axis=axis, interval=(low, high), exit=t, place=way[-1]
        )


def try_images(setting: Setting, record: Record, rng: np.random.Generator) -> None:
    """Try that components on curves which get to a face of the box meet across it.

    The engine gives ``meeting_time`` the stored positions, and not the nearest image.
    """
    motion, box, d = setting.motion, setting.box, setting.dimension
    span, contact = 20.0 * setting.size / setting.speed, 0.3 * setting.size
    for axis in np.flatnonzero(setting.periodic).tolist():
        inwards = 2.0 * contact * np.eye(d)[axis]
        for _ in range(ATTEMPTS):
            x = rng.uniform(0.3, 0.7, d) * box
            x[axis] = -0.1 * contact  # outside: its image is inside, at the other end
            here = motion.carry(x + inwards, 0.0 * x, 0.0, np.empty_like(x), np.empty_like(x))[0]
            if not np.abs(np.asarray(here) - x - inwards).max() <= TOLERANCE * box.max():
                break  # the motion has its components elsewhere
            r = rng.normal(size=d)
            r[axis] = abs(r[axis]) + 0.5
            r *= contact * rng.uniform(1.2, 2.0) / np.linalg.norm(r)
            v = rng.normal(size=(2, d)) * setting.speed
            image = x + box * np.eye(d)[axis]
            inside, across = (
                time_of(
                    motion.meeting_time,
                    record_of(a, v[0]),
                    record_of(b, v[1]),
                    0.0,
                    contact,
                    0.0,
                    span,
                    span,
                )
                for a, b in ((x + inwards, x + r + inwards), (image, x + r))
            )
            if not inside < 0.1 * span:
                continue
            record.note(
                "images", d, abs(inside - across) <= TOLERANCE * span, axis=axis, inside=inside, across=across
            )
            break


def has_axis(motion: Any, axis: int) -> bool:
    """Tell whether a motion has a value for so many axes, where it has one for each."""
    try:
        motion.position(axis, 0.0, 0.0, 0.0)
    except IndexError:
        return False
    except (ArithmeticError, ValueError):
        pass
    return True


def refuse_motion_that_is_none(system: System) -> None:
    """Raise InputError where a motion is curved and cannot say when two meet, or does not say that it is."""
    model, name = system.motion.model(system.particles), type(system.motion).__name__
    if system.curved:
        if system.straight:
            raise InputError(f"{name} has curved = True: give it straight = False, too.")
        for question in ("carry", "meeting_time"):
            if not model_checks.answers(question, model):
                raise InputError(
                    f"{name} has curved = True, and {type(model).__name__} does not answer "
                    f"{question}: give it that method."
                )
    elif model_checks.answers("meeting_time", model):
        raise InputError(f"{type(model).__name__} answers meeting_time: give {name} curved = True.")
