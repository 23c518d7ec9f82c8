"""What is tried of models, in plain Python: the paper's conditions I to V, and what the engine relies on.

:func:`carom.check` tries a model on particles that it makes up, and a simulation tries models of one's own
on its particles. Both do it here, so that what the one refuses the other refuses, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from carom import checks
from carom.errors import CaromError, InputError
from carom.models.interfaces.particles import NEVER, Particles
from carom.models.motions.free_flight import Inertial

TOLERANCE = 2.0**-26
"""Relative difference that counts as rounding: the root of that of a double, since roots lose half of it."""

GRAZING = 1e-3
"""Normal over total relative speed below which rounding may decide whether two meet."""

SENTENCES = {
    "I": "interaction_time does not depend on the order of the two",
    "II": "jump does not depend on the order of the two",
    "III": "two flights in a row are one flight as long as both",
    "IV": "a flight brings the interaction nearer by its time",
    "V": "after a jump the two do not interact at once",
    "momentum": "jump keeps the total momentum",
    "virial": "jump returns the virial r.dp of the contact, which is positive where two repel each other",
    "energy": "jump adds no energy, and step_jump keeps that of the motion and of the step",
    "step": "step_jump changes the step for IN and OUT, and only for these, to one of the model's",
    "core": "no two come nearer than their core_square before they interact",
    "reach": "no two act on each other beyond reach(scene)",
    "relative": "relative to each other two components fly straight",
    "first": "along curves the two are apart until they meet, and touch then",
    "uniform": "without straight = False components fly straight and uniformly",
    "exit": "exit_time is when the coordinate leaves the interval",
    "images": "components meet across the faces of the box as they do inside",
    "part": "the part that is exchanged is a number of at least 1/2 (all is lost)",
    "elastic": "a law with elastic = True exchanges all, the part 1",
    "gain": "a contact adds no energy, unless the value has adds_energy = True",
    "bend": "a velocity changes by no more than bend() times the time",
    "encounter": "a component is apart from an obstacle, by its gap, until it meets it, and touches it then",
    "outward": "outward is a unit vector away from the obstacle, against which the component flies",
    "due": "next_time is a number, and not in the past",
    "asked": "next_time is the same whenever it is asked on the way there",
    "kick": "kick leaves a velocity that is finite",
    "later": "the events of a component do not all come at one time",
    "told": "an observer can be told of every event",
    "overlap": "no two particles overlap, and none is inside a wall or an obstacle",
    "touching": "who touches an obstacle, or is inside by rounding, and approaches meets it now",
}
"""What is tried."""

HINTS = {
    "relative": "Check it together with an interaction that computes its times along this motion, "
    "carom.check(interaction, motion=...), or give it curved = True and meeting_time.",
    "images": "meeting_time gets positions in the box and must look at their images itself, or the motion "
    "must keep components away from the faces.",
    "energy": "An interaction that is not to keep it has conserves(diameter), which returns False.",
    "IV of steps": "A last step that does not end inwards has the end low = -1: 0 is a contact of points.",
    "exit": "A motion whose coordinates do not move as x + v t answers exit_time.",
    "asked": "The engine asks after every event: draw a random time once, and keep in a memory when it is "
    "due.",
}
"""What to do where a condition does not hold."""


@dataclass(frozen=True)
class Failure:
    """A condition that does not hold.

    Attributes
    ----------
    condition : str
        The condition, one of ``SENTENCES``.
    dimension : int
        d.
    numbers : dict of str to value
        State of the pair, and the values that violate the condition.
    """

    condition: str
    dimension: int
    numbers: dict[str, Any]

    def __str__(self) -> str:
        facts = ", ".join(f"{name} = {value}" for name, value in self.numbers.items())
        what = f"{self.condition}: not so that {SENTENCES[self.condition]}; d = {self.dimension}, {facts}"
        hint = HINTS.get(f"{self.condition} of steps" if "step" in self.numbers else self.condition)
        return f"{what}. {hint}" if hint else f"{what}."


@dataclass
class Record:
    """What was tried, and what does not hold.

    Attributes
    ----------
    tried : dict of str to int
        How often each condition was tried.
    failures : dict
        The first failure of each condition and dimension.
    """

    tried: dict[str, int] = field(default_factory=dict)
    failures: dict[tuple[str, int], Failure] = field(default_factory=dict)

    def note(self, condition: str, dimension: int, holds: Any, **numbers: Any) -> None:
        """Note whether a ``condition`` holds in a ``dimension``, and the ``numbers`` if it does not."""
        self.tried[condition] = self.tried.get(condition, 0) + 1
        if not holds:
            shown = {name: np.asarray(value).tolist() for name, value in numbers.items()}
            self.failures.setdefault((condition, dimension), Failure(condition, dimension, shown))


@dataclass(frozen=True)
class Setting:
    """Where models are tried.

    Attributes
    ----------
    particles : Particles
        The particles.
    periodic : tuple of d bools
        Which axes of their box are periodic.
    motion : model
        How they move.
    straight, curved : bool
        What the value of the motion says of it (``carom.models.interfaces.motion.Motion``).
    size, speed : float
        Length and speed of which displacements and velocities are, in the engine's unit of time.
    growth : float
        Largest rate at which the distance of contact grows along curves, in units of the speed.
    masses_known : bool
        Whether the masses are those of a scene. Those of ``carom.check`` need not suit the model, whose own
        then count.
    """

    particles: Particles
    periodic: tuple[bool, ...]
    motion: Any = Inertial()  # noqa: RUF009 (a NamedTuple does not change)
    straight: bool = True
    curved: bool = False
    size: float = 1.0
    speed: float = 1.0
    growth: float = 0.0
    masses_known: bool = True

    @property
    def dimension(self) -> int:
        """Number of dimensions."""
        return len(self.particles.box)

    @property
    def n(self) -> int:
        """Number of particles."""
        return len(self.particles.radii)

    @property
    def box(self) -> np.ndarray:
        """Edges, (d,) [length]."""
        return np.asarray(self.particles.box)

    @property
    def free(self) -> bool:
        """Whether particles fly freely, so that the place does not matter."""
        return isinstance(self.motion, Inertial)

    def moved(self, x: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Return places and velocities (k, d) of k particles a time ``t`` later."""
        if self.free:
            return x + t * v, v
        both = [carried(self.motion, *each, t) for each in zip(x, v, strict=True)]
        return np.array([place for place, _ in both]), np.array([speed for _, speed in both])

    def course(self, x: np.ndarray, v: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return the places (m, k, d) of k particles at m ``times`` from now."""
        if self.free:
            return x + times[:, None, None] * v
        return np.array([self.moved(x, v, t)[0] for t in times])


def carried(motion: Any, x: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Return place and velocity (d,) of one particle in a ``motion`` a time ``t`` later."""
    # What carry leaves out is no number.
    there, then, left = motion.carry(x, v, t, np.full_like(x, np.nan), np.full_like(v, np.nan))
    places = [number_of("position", motion, axis, there[axis], then[axis], left) for axis in range(len(x))]
    speeds = [number_of("velocity", motion, axis, then[axis], left) for axis in range(len(x))]
    return np.array(places), np.array(speeds)


def time_of(question: str | Callable[..., Any], *arguments: Any) -> float:
    """Return the time that a model answers to a ``question`` of ``arguments``; NEVER for NaN."""
    t = number_of(question, *arguments)
    return NEVER if math.isnan(t) else t


def number_of(question: str | Callable[..., Any], *arguments: Any) -> float:
    """Return the number, the first of several, that a model answers to a ``question`` of ``arguments``.

    It raises InputError as ``checks.answer`` does.
    """
    return float(checks.answer(question, *arguments)[0])


def same(a: float, b: float) -> bool:
    """Tell whether the numbers ``a`` and ``b`` are the same but for rounding."""
    return bool(a == b or abs(a - b) <= TOLERANCE * max(abs(a), abs(b)))


def direction(rng: np.random.Generator, d: int) -> np.ndarray:
    """Return a unit vector (d,) from ``rng``."""
    u = rng.normal(size=d)
    return u / np.linalg.norm(u)


def record_of(x: np.ndarray, v: np.ndarray) -> Any:
    """Return an old event, as ``meeting_time`` is given it."""
    return SimpleNamespace(x=x, v=v, t=0.0)


@contextmanager
def in_plain_python(value: Any, hint: str = "") -> Iterator[None]:
    """Ask the functions of a ``value`` in plain Python, as compiled code computes: without errors of floats.

    The ``hint`` is what may help where an index is out of bounds.

    Raises
    ------
    InputError
        If one of them fails.
    """
    try:
        with np.errstate(all="ignore"):
            yield
    except CaromError:
        raise
    except Exception as error:
        raise InputError(
            f"{type(value).__name__} fails where Carom asks it in plain Python: {type(error).__name__}: "
            f"{error}; its functions must run in Python as they do when compiled."
            f"{hint if isinstance(error, IndexError) else ''}"
        ) from error
