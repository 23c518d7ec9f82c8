"""States from an event log: the run again without its engine, bit for bit.

The log holds the initial state with its scene. For every collision it holds the time, the two components (or
the component and the wall or obstacle), the periodic image and the impulse. This is sufficient, because a
component flies freely between two collisions. Rounding is the engine's: a position is advanced only at the
component's own collisions and at the beginning of every epoch, by the same operations in the same order. The
impulse is computed again and must equal the logged one.

The models of the scene say what happens at an event, in the unit of time of the engine. Their functions run
uncompiled, from Python.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from os import PathLike
from typing import Any

import numpy as np

from carom.engine.dynamic_obstacles import is_live
from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io.events import read_events, read_initial
from carom.models import model_checks
from carom.models.interface import (
    Particles,
    age,
    anchor,
    at_time,
    carry,
    core_square,
    exchanged_part,
    jump,
    mass,
    outward,
    position,
    push,
    recoil,
    repeated,
    start_steps,
    step_jump,
    thrown,
    thrust,
    velocity,
)
from carom.models.planes import walls
from carom.models.restitution import Restitution
from carom.models.units import Units
from carom.scene.first_steps import first_steps
from carom.scene.scene import Scene
from carom.simulation import deciding
from carom.simulation.system_of_scene import prepare

CHUNK = 1 << 16
"""Events read at a time."""

ROUNDING = 2.0**-44
"""Relative difference of two impulses below which they differ in the last digits alone."""


class Replay:
    """The run that an event log describes, at a time that only goes forward.

    Parameters
    ----------
    path : path
        An event log that :class:`carom.Simulation` wrote.
    **own
        ``obstacles``, ``interaction``, ``motion`` and ``impact`` of the scene, if they are of your own class:
        a file holds no code.

    Raises
    ------
    FileError
        If the file is missing, truncated or foreign. If it lacks a part of the initial state, or needs a
        value of your own class that is not given.

    Examples
    --------
    >>> run = Replay("events.h5")  # doctest: +SKIP
    >>> run.advance_to(2.5)  # doctest: +SKIP
    >>> run.frame().velocities  # doctest: +SKIP
    """

    def __init__(self, path: str | PathLike[str], **own: Any):
        self._path = path
        initial = read_initial(path)
        if initial.get("single"):
            raise FileError(
                f"{path} cannot be replayed: its run was in single precision, a replay computes in double."
            )
        try:
            scene = _scene(initial, own)
            velocities = np.array(initial["velocities"], dtype=np.float64)
            self._x = np.array(initial["positions"], dtype=np.float64)
            self._box = np.array(initial["box"], dtype=np.float64)
            self._shape = np.array(initial["shape"], dtype=np.int64)
            system = prepare(scene, velocities)
            self._unit = system.unit
            self._v = self._unit.to_kernel(velocities, -1)
            self._length = self._unit.to_kernel(float(initial["epoch_length"]), 1)
            self._bits = int(initial["bits"])
            impact = system.impact
            if isinstance(impact, Restitution):
                impact = impact.below(float(initial["threshold"]))
            particles = system.particles
            self._steps = None if not system.stepped else _Steps(scene, particles)
            self._pair = system.interaction.model(particles)
            self._motion = system.motion.model(particles)
            self._curved = system.curved
            self._impact = impact.model(particles)
            self._scene = scene
            values = (scene.interaction, scene.motion, scene.impact)
            self._own = [type(value).__name__ for value in values if model_checks.is_own(value)]
        except KeyError as missing:
            raise FileError(
                f"{path} has no {missing} in its initial state; expected a log that a Simulation wrote."
            ) from None
        except (InputError, ValueError, TypeError, OverflowError) as problem:
            raise FileError(f"{path} cannot be replayed: {problem}") from None
        self._decide = isinstance(self._pair, Units)
        if self._decide and self._steps is not None:
            start_steps(self._pair, *first_steps(scene))
        # Along axes with walls nothing is wrapped.
        self._inverse = np.where(self._scene.periodic, 1.0 / self._box, 0.0)
        self._fixed = (*walls(self._scene.box, self._scene.periodic), *self._scene.obstacles)
        self._models = [
            value.live(particles) if hasattr(value, "live") else value.model() for value in self._fixed
        ]
        self._live = any(map(is_live, self._models))
        n, dimension = self._x.shape
        self._t = np.zeros(n)
        self._images = np.zeros((n, dimension), np.int32)
        self._epoch, self._offset = 0, 0.0
        offsets = itertools.product((-1, 0, 1), repeat=dimension)
        self._digits = np.array(list(offsets), dtype=np.int64)  # of the codes, and of the images, too
        self._events = self._read()
        self._next = next(self._events, None)
        self._done = self._read_so_far = 0

    def _read(self) -> Iterator[tuple[int, float, int, int, int, float, int]]:
        for start in itertools.count(0, CHUNK):
            events = read_events(self._path, start, start + CHUNK)
            if not len(events.time):
                return
            n = len(self._x)
            others = n + len(self._fixed) + self._decide
            if events.i.max() >= n or events.j.max() >= others or events.image.max() >= len(self._digits):
                raise FileError(
                    f"{self._path} cannot be replayed: it names component {events.i.max()}, partner "
                    f"{events.j.max()} or image {events.image.max()}, and there are {n}, {others} and "
                    f"{len(self._digits)}."
                )
            events = events._replace(
                time=self._unit.to_kernel(events.time, 1), impulse=self._unit.to_kernel(events.impulse, -1)
            )
            kinds = getattr(events, "kind", None)
            if (kinds is None) != (self._steps is None):
                raise FileError(f"{self._path} cannot be replayed: kinds of events go with pairs on steps.")
            kinds = np.zeros(len(events.time), np.int8) if kinds is None else kinds
            yield from zip(*(column.tolist() for column in (*events[:6], kinds)), strict=True)

    @property
    def scene(self) -> Scene:
        """The scene of the logged run."""
        return self._scene

    @property
    def time(self) -> float:
        """Time since the start of the run [time], rounded to a double."""
        return float(self._instant)

    @property
    def _instant(self) -> Fraction:
        elapsed = self._epoch * Fraction(self._length) + Fraction(self._offset)
        return self._unit.to_scene(elapsed, 1)

    @property
    def collisions(self) -> int:
        """Pair collisions realised so far."""
        return self._done

    @property
    def decided(self) -> np.ndarray | None:
        """Present kind of each unit, (n,) int64, -1 if it was removed; None without range rules."""
        if not self._decide:
            return None
        return np.where(self._pair.present[:-1] > 0, self._pair.kinds[:-1], -1)

    def step(self) -> bool:
        """Process the next collision of the log, of two components or with an obstacle.

        It returns False, and does nothing, if there is none.

        Raises
        ------
        FileError
            If the logged impulse does not follow from the states.
        """
        if self._next is None:
            return False
        epoch, time, i, j, code, impulse, kind = self._next
        self._enter_epoch(epoch)
        if j < len(self._x):
            self._collide(time, i, j, code, impulse, kind)
            self._done += 1
        elif j == len(self._x) + len(self._fixed):
            self._consult(time, i)
        else:
            self._bounce(time, i, j - len(self._x), impulse)
        self._offset = time
        self._read_so_far += 1
        self._next = next(self._events, None)
        return True

    def advance_to(self, time: float) -> None:
        """Process all collisions up to and including a time.

        The time of a collision is an epoch and an offset, and need not be a double. Use :meth:`step` to stop
        exactly at a collision.

        After the last collision of the log all components continue to fly, because the log does not hold the
        length of the run.

        Raises
        ------
        InputError
            If the time is not finite, or lies in the past.
        FileError
            If a logged impulse does not follow from the states.
        """
        if not math.isfinite(time) or time < self.time:
            raise InputError(
                f"time is {time!r}; expected a finite number, at least the present {self.time:g}."
            )
        instant, length = self._unit.to_kernel(Fraction(float(time)), 1), Fraction(self._length)
        epoch = int(instant // length)
        offset = float(instant - epoch * length)
        while self._next is not None and self._next[:2] <= (epoch, offset):
            self.step()
        self._enter_epoch(epoch)
        self._offset = offset

    def frame(self) -> Frame:
        """Return all components at the present time, bit-identical to ``Simulation.frame()`` of the run."""
        x, v = self._moved(np.arange(len(self._x)), self._offset)
        crossings = np.floor(x * self._inverse)
        x -= crossings * self._box
        above = x >= self._box
        x[above] -= np.broadcast_to(self._box, x.shape)[above]
        crossings += above
        x[~above & (x < 0.0)] = 0.0
        return Frame(
            time=self.time,
            step=self._done,
            positions=x,
            velocities=self._unit.to_scene(v, -1),
            box=tuple(self._box.tolist()),
            diameters=self._scene.diameters,
            masses=self._scene.masses,
            images=self._images + crossings.astype(np.int32),
            species=self._scene.species,
            species_names=self._scene.species_names,
            periodic=self._scene.periodic,
        )

    def _enter_epoch(self, epoch: int) -> None:
        """Bring all components to the beginning of every epoch up to this one."""
        everyone = np.arange(len(self._x))
        while self._epoch < epoch:
            self._advance(everyone, self._length)
            self._t[:] = 0.0
            for remembers in (self._pair, self._impact, *self._models):
                age(remembers, self._length)
            self._epoch += 1
            self._offset = 0.0

    def _moved(self, components: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return places, not wrapped, and velocities at a time of this epoch."""
        x, v, t = self._x[components], self._v[components], time - self._t[components]
        places, speeds = np.empty_like(x), np.empty_like(v)
        if self._curved:
            for k in range(len(x)):
                x[k], v[k], t[k] = carry(self._motion, x[k], v[k], t[k], places[k], speeds[k])
        if model_checks.is_own(self._scene.motion):  # one by one: math.exp takes no arrays
            for k, axis in np.ndindex(x.shape):
                places[k, axis] = position(self._motion, axis, x[k, axis], v[k, axis], t[k])
                speeds[k, axis] = velocity(self._motion, axis, v[k, axis], t[k])
            return places, speeds
        for axis in range(x.shape[1]):
            places[:, axis] = position(self._motion, axis, x[:, axis], v[:, axis], t)
            speeds[:, axis] = velocity(self._motion, axis, v[:, axis], t)
        return places, speeds

    def _advance(self, components: np.ndarray, time: float) -> None:
        x, self._v[components] = self._moved(components, time)
        crossings = np.floor(x * self._inverse)
        # Where nothing is crossed this takes away zero, which changes no bit.
        self._x[components] = x - crossings * self._box
        self._images[components] += crossings.astype(np.int32)
        self._t[components] = time

    def _collide(self, time: float, i: int, j: int, code: int, impulse: float, kind: int) -> None:
        self._advance(np.array([i, j]), time)
        r = self._separation(i, j, code)
        u = self._v[j] - self._v[i]
        rr = rv = 0.0
        for a, b in zip(r.tolist(), u.tolist(), strict=True):
            rr += a * a
            rv += a * b
        if self._steps is None:
            ours, theirs, virial = jump(self._pair, i, j, rr, rv, time)
        else:
            before = self._steps.of(i, j)
            ours, theirs, virial, step, found = step_jump(self._pair, i, j, before, rr, rv, time)
            self._compare(found, kind, f"{i} and {j}", "kind")
            self._steps.put(i, j, step)
        part = exchanged_part(self._impact, i, j, rr, rv, time)
        self._compare(virial * part / math.sqrt(rr), impulse, f"{i} and {j}")
        for axis in range(len(r)):
            push = thrust(self._motion, axis, self._x[i, axis], r[axis], rr)
            back = thrust(self._motion, axis, self._x[j, axis], -r[axis], rr)
            self._v[i, axis] += ours * part * push
            self._v[j, axis] += theirs * part * back
        if self._decide and self._steps is not None:
            crossed = min(before, self._steps.of(i, j))
            begun = float(self._epoch) * self._length
            states = (self._x, self._v, r, time, begun)
            deciding.on_crossing(self._pair, (i, j), crossed, kind, *states, self._steps)

    def _consult(self, time: float, i: int) -> None:
        """Ask a unit alone."""

        def state_of(i: int, j: int) -> tuple[np.ndarray, np.ndarray]:
            x, v = self._moved(np.array([j]), time)
            dx = x[0] - self._x[i]
            return dx - self._box * np.rint(dx * self._inverse), v[0]

        assert self._steps is not None
        self._advance(np.array([i]), time)
        begun = float(self._epoch) * self._length
        deciding.on_timer(self._pair, i, self._x, self._v, state_of, time, begun, self._steps)

    def _bounce(self, time: float, i: int, k: int, impulse: float) -> None:
        self._advance(np.array([i]), time)
        model = self._models[k]
        at_time(model, time)
        x = self._x[i] - np.floor(self._x[i] * self._inverse) * self._box
        if repeated(model):  # the image that is touched is the nearest one
            center = np.array([anchor(model, axis) for axis in range(len(x))])
            x = x - np.rint((x - center) * self._inverse) * self._box
        coordinates = tuple(x.tolist())
        normal = [outward(model, coordinates, axis) for axis in range(len(x))]
        weight, before = mass(self._pair, i), self._v[i].tolist()
        along = 0.0
        if self._live:
            recoil(model, self._motion, i, weight, x, self._v[i], np.array(normal), 0.0, time)
            for a, new, old in zip(normal, self._v[i].tolist(), before, strict=True):
                along += a * (new - old)
        else:
            speed = 0.0
            for a, b in zip(normal, before, strict=True):
                speed += a * b
            along = thrown(self._motion, 0.0 - speed)
            push(self._motion, along, self._v[i], normal)
        self._compare(weight * along, impulse, f"{i} and {self._fixed[k].name}")

    def _compare(self, found: float, logged: float, components: str, what: str = "impulse") -> None:
        """Raise FileError where the impulse, or the kind, of a collision is not the logged one."""
        if found != logged:
            if abs(found - logged) <= ROUNDING * abs(logged) and self._own:
                raise FileError(
                    f"{self._path}: the {what} of collision {self._read_so_far} between {components} is "
                    f"logged as {logged!r}, and the states before it give {float(found)!r}, which differs by "
                    f"rounding alone; {' or '.join(self._own)} is computed otherwise by Python than by "
                    "compiled code: call math.exp, math.expm1, ... and not np.exp, np.expm1, ... in it"
                    " (docs/models.md)."
                )
            raise FileError(
                f"{self._path}: the {what} of collision {self._read_so_far} between {components} is logged "
                f"as {logged!r}, and the states before it give {found!r}; the log is damaged, or of another "
                "version of Carom."
            )

    def _separation(self, i: int, j: int, code: int) -> np.ndarray:
        """Return the image of j that was met, relative to i.

        In a small box the engine's word names a sector next to that of i. Which image that is depends on the
        engine's own account of sectors, whose rounding at the faces is not logged. Hence the image is the one
        whose distance is nearest to that of contact; of several at the same distance the one in that sector.
        """
        dx = self._x[j] - self._x[i]
        if self._bits == 0:
            return dx - self._box * np.rint(dx * self._inverse)
        images = dx + self._box * self._digits * (self._inverse > 0.0)
        contact = math.sqrt(core_square(self._pair, i, j, 0.0))
        misses = np.abs(np.sqrt((images * images).sum(axis=1)) - contact)
        # Positions are rounded in the last place of the box; images further apart than that are no tie.
        ties = np.flatnonzero(misses <= misses.min() + 2.0**-40 * float(self._box.max()))
        sectors = np.floor(self._x[[i, j]] / self._box * self._shape)
        named = (sectors[0] + self._digits[code] - sectors[1]) / self._shape
        unlike = np.abs(self._digits[ties] - named).sum(axis=1)
        return images[ties[np.argmin(unlike)]]


class _Steps:
    """On which step each pair is, as a plain dictionary."""

    def __init__(self, scene: Scene, particles: Particles):
        self._near = {
            (i, j): step for (i, j), step in zip(*(a.tolist() for a in first_steps(scene)), strict=True)
        }
        _, outside = scene.interaction.steps(particles)  # type: ignore[attr-defined]
        self._outside, self._species = outside, scene.species

    def of(self, i: int, j: int) -> int:
        """Return the step of a pair."""
        kinds = (0, 0) if self._species is None or len(self._outside) == 1 else self._species[[i, j]]
        return self._near.get((min(i, j), max(i, j)), int(self._outside[tuple(kinds)]))

    def around(self, i: int) -> list[tuple[int, int]]:
        """Return who is on a step with component i, and on which."""
        return [(j if k == i else k, step) for (k, j), step in self._near.items() if i in (k, j)]

    def forget_partner(self, i: int) -> None:
        """Forget the pairs of component i."""
        self._near = {pair: step for pair, step in self._near.items() if i not in pair}

    def put(self, i: int, j: int, step: int) -> None:
        """Note the step of a pair."""
        self._near[min(i, j), max(i, j)] = step


def _scene(initial: Mapping[str, np.ndarray], own: Mapping[str, Any]) -> Scene:
    """Return the scene from the arrays of a log."""
    arrays = {
        "diameter": initial["diameters"],
        "mass": initial["masses"],
        **{name: initial[name] for name in ("positions", "species", "contact", "pinned") if name in initial},
    }
    return Scene.from_arrays(arrays, json.loads(bytes(initial["scene"]).decode()), **own)


def replay(path: str | PathLike[str], *, time: float, **own: Any) -> Frame:
    """Return all components at one time of a logged run.

    Parameters
    ----------
    path : path
        An event log that :class:`carom.Simulation` wrote.
    time : float
        Time since the start of the run [time].
    **own
        As for :class:`Replay`.

    Raises
    ------
    FileError
        If the file is not an event log, or a logged impulse does not follow from the states.
    InputError
        If the time is negative or not finite.
    """
    return next(replays(path, [time], **own))


def replays(path: str | PathLike[str], times: Iterable[float], **own: Any) -> Iterator[Frame]:
    """Yield all components at the given times of a logged run, which must not decrease.

    Parameters and errors are those of :func:`replay`.
    """
    run = Replay(path, **own)
    for time in times:
        run.advance_to(time)
        yield run.frame()
