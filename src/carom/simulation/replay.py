"""States from an event log: the run again without a search, bit for bit.

The log holds the initial state with its scene. For every collision it holds the time, the two particles (or
the particle and the wall or obstacle), the periodic image and the impulse. This is sufficient, because a
particle flies freely between two collisions: what a run searches for, the log says. The engine's own
functions process each event, in the unit of time of the engine. They run uncompiled, from Python. The impulse
is computed again and must equal the logged one.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from os import PathLike
from types import SimpleNamespace
from typing import Any

import numpy as np

from carom.engine.build import make_model
from carom.engine.collisions import collide
from carom.engine.constants import OBSTACLE, TIMER_EVENT
from carom.engine.epochs import new_epoch
from carom.engine.neighbors.interface import NeighborScheme
from carom.engine.observers.event_log import make_log
from carom.engine.observers.interface import chained
from carom.engine.obstacles import numbers_of
from carom.engine.one_body import run_one_body
from carom.engine.state import make_state
from carom.engine.tilted_lattice import in_lattice
from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io.events import read_events, read_initial
from carom.models import model_checks
from carom.models.interfaces.particles import NEVER
from carom.observables.wall_pressure import obstacle_names
from carom.scene.scene import Scene
from carom.scene.storage import from_arrays
from carom.simulation.clock import Clock
from carom.simulation.files.logged_refs import Refs
from carom.simulation.run_state import frame_of
from carom.simulation.system_of_scene import speeds_of, system_of, with_thresholds

CHUNK = 1 << 16
"""Events read at a time."""

KEPT = ("positions", "spins", "species", "contact", "pinned")
"""Arrays of the scene in a log, besides sizes, masses and the velocities that were drawn."""

ROUNDING = 2.0**-44
"""Relative difference of two impulses below which they differ in the last digits alone."""


class Replay:
    """The run that an event log describes, at a time that only goes forward.

    Parameters
    ----------
    path : path
        An event log that :class:`carom.Simulation` wrote.
    **own
        ``obstacles``, ``interaction``, ``motion``, ``impact`` and ``drive`` of the scene, if they are of your
        own class: a file holds no code.

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
            self._scene = scene = _scene(initial, own)
            velocities = np.array(initial["velocities"], dtype=np.float64)
            system = system_of(speeds_of(scene, velocities, None), None)
            system = with_thresholds(system, np.atleast_1d(initial["thresholds"]).tolist())
            self._clock = Clock(system.unit, system.unit.to_kernel(float(initial["epoch_length"]), 1))
            positions = np.array(initial["positions"], dtype=np.float64)
            speeds = system.unit.to_kernel(velocities, -1)
            model = make_model(system)
            places = in_lattice(model.motion, positions)
            self._arrays = make_state(places, speeds, self._clock.length, True, np.float64)
            shape = np.array(initial["shape"], dtype=np.int64)
            self._refs = Refs(system, scene, model.pair, shape, int(initial["bits"]))
            self._neighbors: Any = self._refs.listed or NeighborScheme()  # which takes notice of nothing
            self._log = make_log(1)
            self._model = model._replace(boundary=self._refs.boundary, observers=chained([self._log]))
            values = (scene.interaction, scene.motion, scene.impact, scene.drive)
            self._own = [type(value).__name__ for value in values if model_checks.is_own(value)]
        except KeyError as missing:
            raise FileError(
                f"{path} has no {missing} in its initial state; expected a log that a Simulation wrote."
            ) from None
        except (InputError, ValueError, TypeError, OverflowError) as problem:
            raise FileError(f"{path} cannot be replayed: {problem}") from None
        self._fixed = obstacle_names(scene)
        self._numbers = numbers_of(scene.periodic, system.obstacle_models)
        # The same places and velocities; Python reads the fields of a record slowly.
        fields = zip(self._arrays.rows.x[:-1], self._arrays.rows.v[:-1], strict=True)
        self._state = self._arrays._replace(
            rows=[SimpleNamespace(x=x, t=0.0, v=v, event_time=NEVER) for x, v in fields],
            clock=[SimpleNamespace(epoch=0, now=0.0, length=self._clock.length)],
        )
        self._tally = SimpleNamespace(collisions=0, virial=0.0, depth=0.0)
        self._events = self._read()
        self._next = next(self._events, None)
        self._read_so_far = 0

    def _read(self) -> Iterator[tuple[int, float, int, int, int, float, int]]:
        for start in itertools.count(0, CHUNK):
            events = read_events(self._path, start, start + CHUNK)
            if not len(events.time):
                return
            n, images = self._scene.n, 3**self._scene.dimension
            alone = self._model.rules is not None or self._model.timers is not None
            others = n + len(self._fixed) + alone
            if events.i.max() >= n or events.j.max() >= others or events.image.max() >= images:
                raise FileError(
                    f"{self._path} cannot be replayed: it names component {events.i.max()}, partner "
                    f"{events.j.max()} or image {events.image.max()}, and there are {n}, {others} and "
                    f"{images}."
                )
            unit = self._clock.unit
            events = events._replace(
                time=unit.to_kernel(events.time, 1), impulse=unit.to_kernel(events.impulse, -1)
            )
            kinds = getattr(events, "kind", None)
            if (kinds is None) != (self._refs.listed is None):
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
        return float(self._clock.instant)

    @property
    def collisions(self) -> int:
        """Pair collisions realized so far."""
        return self._tally.collisions

    @property
    def decided(self) -> np.ndarray | None:
        """Present kind of each unit, (n,) int64, -1 if it was removed; None without range rules."""
        rules = self._model.rules
        return None if rules is None else np.where(rules.present[:-1] > 0, rules.kinds[:-1], -1)

    def step(self) -> bool:
        """Process the next collision of the log, of two particles or with an obstacle.

        It returns False, and does nothing, if there is none.

        Raises
        ------
        FileError
            If the logged impulse does not follow from the states.
        """
        if self._next is None:
            return False
        epoch, now, i, j, code, impulse, kind = self._next
        self._enter_epoch(epoch)
        self._state.clock[0].now = self._clock.offset = now
        n = self._scene.n
        with np.errstate(all="ignore"):  # as in compiled code
            if j < n:
                self._collide(i, j, code, now, impulse, kind)
            else:
                self._meet_alone(i, j - n, now, impulse)
        if self._model.rules is not None:
            self._model.rules.queued[0] = 0  # who is told when is in the log
        self._read_so_far += 1
        self._next = next(self._events, None)
        return True

    def advance_to(self, time: float, *, logged: bool = False) -> None:
        """Process all collisions up to and including a time.

        The time of a collision is an epoch and an offset, and need not be a double. Use :meth:`step` to stop
        exactly at a collision.

        After the last collision of the log all particles continue to fly, because the log does not hold the
        length of the run.

        Parameters
        ----------
        time : float
            Time since the start of the run.
        logged : bool
            Whether a collision must follow.

        Raises
        ------
        InputError
            If the time is not finite, lies in the past, or must be logged and comes after the last collision.
        FileError
            If a logged impulse does not follow from the states.
        """
        if not math.isfinite(time) or time < self.time:
            raise InputError(
                f"time is {time!r}; expected a finite number, at least the present {self.time:g}."
            )
        epoch, offset = self._clock.split(Fraction(float(time)))
        while self._next is not None and self._next[:2] <= (epoch, offset):
            self.step()
        if logged and self._next is None:
            raise InputError(f"{self._path} has no collision after t = {time:g}; choose an earlier time.")
        self._enter_epoch(epoch)
        self._clock.offset = offset

    def frame(self) -> Frame:
        """Return all particles at the present time, bit-identical to ``Simulation.frame()`` of the run."""
        self._arrays.rows.t[:-1] = [row.t for row in self._state.rows]
        now = self._clock, self._clock.offset, self.collisions
        return frame_of(self._scene, self._model, self._arrays, *now, self._scene.diameters)

    def _enter_epoch(self, epoch: int) -> None:
        """Bring all particles to the beginning of every epoch up to this one."""
        while self._clock.epoch < epoch:
            new_epoch(self._model, self._state, self._neighbors)
            self._clock.epoch += 1
            self._clock.offset = 0.0

    def _collide(self, i: int, j: int, code: int, now: float, impulse: float, kind: int) -> None:
        """Process the collision of two particles."""
        model, log = self._model, self._log
        log.used[0] = 0
        ref = self._refs.of(model, self._state, i, j, code, now)
        collide(model, self._state, self._neighbors, self._tally, i, ref, now)
        if self._refs.listed is not None:
            found = int(log.ref[0]) & ((1 << model.boundary.bits) - 1)
            self._compare(found, kind, f"{i} and {j}", "kind")
        self._compare(float(log.impulse[0]), impulse, f"{i} and {j}")

    def _meet_alone(self, i: int, k: int, now: float, impulse: float) -> None:
        """Process an event of one particle: with wall or obstacle k, or at a time of its own."""
        log = self._log
        log.used[0] = 0
        fixed = k < len(self._fixed)
        code = OBSTACLE - self._numbers[k] if fixed else TIMER_EVENT
        run_one_body(self._model, self._state, self._neighbors, i, code, now)
        if fixed:
            self._compare(float(log.impulse[0]), impulse, f"{i} and {self._fixed[k]}")

    def _compare(self, found: float, logged: float, components: str, what: str = "impulse") -> None:
        """Raise FileError where the impulse, or the kind, of a collision is not the logged one."""
        if found != logged:
            if abs(found - logged) <= ROUNDING * abs(logged) and self._own:
                raise FileError(
                    f"{self._path}: the {what} of collision {self._read_so_far} between {components} is "
                    f"logged as {logged!r}, and the states before it give {float(found)!r}, which differs by "
                    f"rounding alone; {' or '.join(self._own)} is computed otherwise by Python than by "
                    "compiled code: write math.exp, ..., math.sqrt(x) and x * x in it, and not np.exp, ..., "
                    "x**0.5, x**2 and math.hypot (docs/models.md)."
                )
            raise FileError(
                f"{self._path}: the {what} of collision {self._read_so_far} between {components} is logged "
                f"as {logged!r}, and the states before it give {found!r}; the log is damaged, or of another "
                "version of Carom."
            )


def _scene(initial: Mapping[str, np.ndarray], user_models: Mapping[str, Any]) -> Scene:
    """Return the scene from the arrays of a log."""
    arrays = {
        "diameter": initial["diameters"],
        "mass": initial["masses"],
        **{name: initial[name] for name in KEPT if name in initial},
    }
    return from_arrays(arrays, json.loads(bytes(initial["scene"]).decode()), **user_models)


def replay(path: str | PathLike[str], *, time: float, **own: Any) -> Frame:
    """Return all particles at one time of a logged run.

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
    """Yield all particles at the given times of a logged run, which must not decrease.

    Parameters and errors are those of :func:`replay`.
    """
    run = Replay(path, **own)
    for time in times:
        run.advance_to(time)
        yield run.frame()
