"""Range rules: units with circles around them, which act by a rule of the user when others come and go.

Wieland's models of combat, a billiard of Lubachevsky's article (sec. 11): a unit that detects m of its own
and n others within a radius takes course of action c(m, n). Compiled: ``carom.models.interactions.units``.
"""

from __future__ import annotations

import hashlib
import itertools
import math
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.declared import SEED, Declared, fields_of, said, schema_of_table
from carom.errors import InputError
from carom.models.declared_values import Value
from carom.models.interactions import units
from carom.models.interactions.steps import CLOSEST, check_rise
from carom.models.interfaces.particles import NEVER, Particles
from carom.models.interfaces.steps import step_bits

MOST = 1000
"""Kinds, circles of a kind and numbers of its memory: more are a slip of the pen."""


def _numbers(values: Any, name: str) -> tuple[float, ...]:
    if not isinstance(values, Sequence | np.ndarray) or isinstance(values, str):
        raise InputError(f"{name} must be a list of numbers, found {checks.describe(values)}.")
    return tuple(checks.number(value, name, low=-checks.FASTEST, high=checks.FASTEST) for value in values)


said(_numbers, type="array", items={"type": "number"})


def _timer(value: Any, name: str) -> float:
    """Check a time, which may be infinite."""
    return math.inf if value == math.inf else checks.number(value, name, low=0.0, high=checks.MAGNITUDE)


said(_timer, type="number", minimum=0)


def _word(value: Any, name: str) -> str:
    """Check the name of a kind."""
    if not isinstance(value, str) or not value:
        raise InputError(f"The name of a kind must be a word, found {checks.describe(value)}.")
    return value


said(_word, type="string", minLength=1)


@dataclass(frozen=True)
class Kind(Value):
    """One kind of units.

    Parameters
    ----------
    name : str
        Name, for messages and results.
    circles : sequence of floats
        Radii of its circles, increasing [length]. A unit without circles sees no other unit but can be seen.
    timer : float
        Time after the start at which the rule is first called without another cause [time]; by default never.
        With 0 the rule is called for every unit of the kind at the start.
    memory : sequence of floats
        Initial values of numbers that the rule keeps for each unit: ammunition, health, a home.

    Raises
    ------
    InputError
        If the name is empty, the circles do not increase, or a number is out of range.

    Examples
    --------
    >>> Kind("scout", circles=[1.0, 4.0], timer=0.0, memory=[100.0]).circles
    (1.0, 4.0)
    """

    name: Annotated[str, _word]
    circles: Annotated[tuple[float, ...], _numbers] = ()
    timer: Annotated[float, _timer] = math.inf
    memory: Annotated[tuple[float, ...], _numbers] = ()

    @property
    def after(self) -> str:  # type: ignore[override]
        """What stands behind the name of a field in an error: which kind has it."""
        return f" of {self.name!r}"

    def complete(self) -> None:
        """Raise InputError where circles do not increase."""
        check_rise(self.circles, f"circles of {self.name!r} must be positive radii that")

    def given(self) -> dict[str, Any]:
        """Return the arguments that are not those by default, by name."""
        return self.unusual()


def kinds(value: Any, name: str) -> tuple[Kind, ...]:
    """Check the kinds of units, which may be tables."""
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        raise InputError(
            f"{name} must be a list of Kind(...), or of their tables; found {checks.describe(value)}."
        )
    kinds = tuple(map(_kind, value))
    sizes = (len(kinds), *(len(k.circles) for k in kinds), *(len(k.memory) for k in kinds))
    if max(sizes) > MOST:
        raise InputError(f"There may be {MOST} kinds, circles and numbers at most; found {max(sizes)}.")
    names = [kind.name for kind in kinds]
    if len(set(names)) < len(names):
        raise InputError(f"Two kinds have the same name: {', '.join(names)}.")
    if not any(kind.circles for kind in kinds):
        raise InputError("No kind has a circle: give at least one Kind circles=[...].")
    return kinds


said(kinds, type="array", items=schema_of_table(Kind), minItems=1)


def _kind(value: Any) -> Kind:
    """Return a kind, also from its table."""
    if isinstance(value, Kind):
        return value
    if not isinstance(value, Mapping):
        raise InputError(f"A kind of units must be a table with a name, found {checks.describe(value)}.")
    checks.keys(value, "A kind of units", fields_of(Kind), needed=("name",))
    return Kind(**value)


def _rule(value: Any, name: str) -> Any:
    """Check the rule."""
    if not isinstance(value, types.FunctionType) or value.__code__.co_argcount != 2:
        raise InputError(f"{name} must be a function rule(unit, event), found {checks.describe(value)}.")
    return value


@dataclass(frozen=True)
class Ranges(Declared):
    """An interaction of units that fly straight until a rule of the user changes their velocity.

    Parameters
    ----------
    kinds : sequence of Kind
        One for each species of the scene, in their order.
    rule : callable
        ``rule(unit, event)``, in plain Python, which is compiled. It is called when another unit crosses one
        of the unit's circles, when the unit's timer runs out, and when a unit in a circle is removed or
        changes its kind. It reads ``event`` and ``unit``, and writes into ``unit`` what the unit does next.
    seed : int
        Seed of the random numbers that :func:`draw` returns.

    Raises
    ------
    InputError
        If there are no kinds, no circles, or two kinds with one name. If there are more than 1000 kinds,
        circles of a kind, or numbers of a memory. If the rule is not a function of two arguments, or the seed
        not an integer of at least 0.

    Notes
    -----
    A rule may write these fields of ``unit``: ``velocity`` (d), ``kind``, ``timer`` (from now), ``target``
    (the number of a unit, or -1), ``memory`` and ``removed``. It may read ``counts[circle, kind]``,
    ``position`` and ``number``. ``event`` has ``cause`` (ENTERED, LEFT, TIMER, CHANGED), ``circle`` and
    ``time``, and for the other unit ``other`` (its number, or -1), ``kind``, ``toward`` (d), ``distance`` and
    ``velocity`` (d). If the cause is TIMER, the other unit is the target.

    Examples
    --------
    >>> def turn_back(unit, event):
    ...     if event.cause == ENTERED:
    ...         for axis in range(len(unit.velocity)):
    ...             unit.velocity[axis] = -unit.velocity[axis]
    >>> interaction = Ranges([Kind("hare", circles=[2.0]), Kind("fox")], turn_back)
    """

    kinds: Annotated[tuple[Kind, ...], kinds]
    rule: Annotated[Callable[[Any, Any], Any], _rule]
    seed: Annotated[int, SEED] = 0

    penetrable = True
    decides = True
    """Units decide themselves: a run of them has no temperature, pressure or equilibrium to report."""
    keeps_momentum = False
    """Rules change velocities as they like."""

    @property
    def distances(self) -> np.ndarray:
        """Radii of all circles of all kinds, decreasing [length]."""
        radii = np.unique([radius for kind in self.kinds for radius in kind.circles])
        return radii[::-1]

    def reach(self, scene: Any) -> float:
        """Return the radius of the largest circle [length]."""
        return float(self.distances[0])

    def check(self, scene: Any) -> None:
        """Raise InputError if the scene cannot have these units, or if the rule fails on one of them."""
        count = 1 if scene.species is None else int(scene.species.max()) + 1
        if count > len(self.kinds):
            raise InputError(
                f"The scene has {count} species, and there are {len(self.kinds)} kinds of units: give one "
                "Kind for each."
            )
        radii = self.distances
        if (radii[:-1] <= radii[1:] * (1.0 + CLOSEST)).any():
            raise InputError(
                "Two circles of different kinds differ by rounding only: make their radii equal."
            )
        if not getattr(scene.motion, "straight", True):
            raise InputError(
                f"Units fly straight, and {type(scene.motion).__name__} bends: leave out motion=."
            )
        for obstacle in scene._standing:
            if hasattr(obstacle, "live"):
                raise InputError(
                    f"Units meet obstacles that rest and are elastic; {obstacle.name} is not so."
                )
        self._try_rule(scene.dimension)

    def _try_rule(self, dimension: int) -> None:
        """Ask the rule in plain Python, which sees slips that compiled code does not: an index too large."""
        unit, event = _records(self, dimension, 1)
        for kind, each in enumerate(self.kinds):
            for cause in (units.ENTERED, units.LEFT, units.TIMER, units.CHANGED):
                for circle in range(len(each.circles)) if cause <= units.LEFT else (-1,):
                    for other in range(len(self.kinds)):
                        unit[0].kind, unit[0].target, unit[0].timer = kind, -1, math.inf
                        unit[0].position[:], unit[0].velocity[:], unit[0].counts[:] = 1.0, 1.0, 1
                        unit[0].memory[: len(each.memory)] = each.memory
                        event[0].cause, event[0].circle = cause, circle
                        event[0].other, event[0].kind = 1, other
                        event[0].toward[:], event[0].distance = 1.0, math.sqrt(dimension)
                        try:
                            with np.errstate(all="ignore"):
                                answer = self.rule(unit[0], event[0])
                        except Exception as error:
                            raise InputError(
                                f"The rule {self.rule.__name__} fails for a unit of kind {each.name!r}: "
                                f"{type(error).__name__}: {error}"
                            ) from error
                        if answer is not None:
                            raise InputError(
                                f"The rule {self.rule.__name__} returns {checks.describe(answer)}; it must "
                                "return nothing: what it decides it writes into unit."
                            )

    def steps(self, particles: Particles) -> tuple[int, np.ndarray]:
        """Return the number of steps, and the step of pairs outside all circles, (1, 1): 0."""
        return len(self.distances) + 1, np.zeros((1, 1), np.int64)

    def steps_of(
        self, pairs: np.ndarray, distances: np.ndarray, species: np.ndarray | None, diameter: float
    ) -> np.ndarray:
        """Return the step of each of ``pairs`` (m, 2) at the start, (m,) int64.

        It is the number of circle radii that exceed the distance of the pair, one of ``distances`` (m,). It
        does not depend on ``species`` and ``diameter``.
        """
        radii = self.distances[::-1]
        return len(radii) - np.searchsorted(radii, distances, side="right")

    def model(self, particles: Particles) -> units.Units:
        """Return the model that the engine compiles."""
        n, radii, unit = len(particles.radii), self.distances, particles.unit
        count = 1 << step_bits(len(radii) + 1)
        ladder = np.full(count, NEVER)
        inner_ends, outer_ends = ladder.copy(), ladder.copy()
        inner_ends[: len(radii)], inner_ends[len(radii)] = radii**2, -(radii[0] ** 2)
        outer_ends[1 : len(radii) + 1] = radii**2
        energy = np.where(np.arange(count) > len(radii), NEVER, 0.0)
        circle_of = np.full((len(self.kinds), count), units.NO_AGENT, np.int64)
        for k, kind in enumerate(self.kinds):
            for circle, radius in enumerate(kind.circles):
                circle_of[k, int(np.flatnonzero(radii == radius)[0])] = circle
        # carom.check brings two species, whatever there are here.
        species = np.zeros(n, np.int64) if particles.species is None else particles.species
        kinds = np.minimum(particles.with_padding(species, np.int64), len(self.kinds) - 1)
        starts = np.array([float(unit.to_kernel(kind.timer, 1)) for kind in self.kinds])
        circles = max(len(kind.circles) for kind in self.kinds)
        memory = np.zeros((len(self.kinds), max(1, *(len(kind.memory) for kind in self.kinds), 1)))
        for k, kind in enumerate(self.kinds):
            memory[k, : len(kind.memory)] = kind.memory
        agents, events = _records(self, len(particles.box), 2)
        nobody = np.full(n + 1, units.NO_AGENT, np.int64)
        return units.Units(
            rule=_tag(self.rule)(),
            inner=inner_ends,
            outer=outer_ends,
            energy=energy,
            events=np.zeros((count, 4), np.int64),
            radii=particles.with_padding(particles.radii),
            masses=particles.with_padding(particles.masses),
            watch=circle_of,
            kinds=kinds,
            present=np.ones(n + 1, np.int64),
            counts=np.zeros((n + 1, circles, len(self.kinds)), np.int64),
            memory=memory[kinds],
            timers=starts[kinds],
            targets=nobody.copy(),
            drawn=np.zeros(n + 1, np.int64),
            news=nobody.copy(),
            queue=np.zeros(n + 1, np.int64),
            queued=np.zeros(1, np.int64),
            asked=np.zeros(5, np.int64),
            fault=np.zeros(2, np.int64),
            begun=np.zeros(1, np.int64),
            units=agents,
            told=events,
            origin=np.zeros(1),
            speed=float(unit.to_scene(1.0, -1)),
            seed=self.seed,
        )


def _records(ranges: Ranges, dimension: int, count: int) -> tuple[Any, Any]:
    """Return room for what rules are handed and told."""
    circles = max(len(kind.circles) for kind in ranges.kinds)
    memory = max(len(kind.memory) for kind in ranges.kinds)
    kinds = [units.unit_type(dimension, len(ranges.kinds), circles, memory), units.event_type(dimension)]
    agents, events = (np.zeros(count, kind).view(np.recarray) for kind in kinds)
    return agents, events


_TAGS: dict[Any, type] = {}


def _tag(rule: Any) -> type:
    """Return the type that stands for a rule, so that the compiler can choose it by type."""
    if rule not in _TAGS:
        _TAGS[rule] = _new_type(rule)
    return _TAGS[rule]


def _new_type(rule: Any) -> type:
    """Return a new type for a rule, of a name that follows from the rule's.

    Compiled code on disk names the types of its arguments: another process must find this one under its name.
    For a copy the code would be read from disk at every call.
    """

    def call_rule(self, unit, event):
        rule(unit, event)

    here = globals()
    origin = hashlib.sha256(f"{rule.__module__}.{rule.__qualname__}".encode()).hexdigest()[:16]
    names = (f"Rule_{origin}_{number}" for number in itertools.count())
    name = next(name for name in names if name not in here)
    scope = {
        "__doc__": "A rule.",
        "__module__": __name__,
        "__annotations__": {"asked": bool},
        "asked": True,
        "call_rule": call_rule,
    }
    make: Any = type(units.Rule)
    here[name] = make(name, (units.Rule,), scope)
    return here[name]
