"""States from an event log: the run again without its engine, bit for bit.

The log holds the initial state with all of its scene, and of every collision its time, the two components (or
the component and the wall or obstacle), the periodic image and the impulse. Between two of its collisions a
component flies freely, so that this is enough. Rounding is the engine's: a position is advanced at the
component's own collisions and at the beginning of every epoch, by the same operations in the same order, and
nowhere else. The impulse is computed anew and must come out as logged.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from os import PathLike

import numpy as np

from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io.events import Events, read_events, read_initial
from carom.obstacles import Ball, CylindricalContainer, Obstacle, Plane, SphericalContainer, walls
from carom.scene import Scene
from carom.species import Contacts

CHUNK = 1 << 16
"""Events read at a time."""


class Replay:
    """The run that an event log describes, at a time that only goes forward.

    Parameters
    ----------
    path : path
        An event log that :class:`carom.Simulation` wrote.

    Raises
    ------
    FileError
        If the file is missing, truncated, foreign, lacks a part of the initial state, or has obstacles of a
        class of one's own, which no file holds.

    Examples
    --------
    >>> run = Replay("events.h5")  # doctest: +SKIP
    >>> run.advance_to(2.5)  # doctest: +SKIP
    >>> run.frame().velocities  # doctest: +SKIP
    """

    def __init__(self, path: str | PathLike[str]):
        self._path = path
        initial = read_initial(path)
        try:
            self._x = np.array(initial["positions"], dtype=np.float64)
            self._v = np.array(initial["velocities"], dtype=np.float64)
            self._box = np.array(initial["box"], dtype=np.float64)
            self._shape = np.array(initial["shape"], dtype=np.int64)
            self._scene = _scene(initial)
            self._threshold = float(initial["threshold"])
            self._length = float(initial["epoch_length"])
            self._bits = int(initial["bits"])
        except KeyError as missing:
            raise FileError(
                f"{path} has no {missing} in its initial state; expected a log that a Simulation wrote."
            ) from None
        except (InputError, ValueError, TypeError, OverflowError) as problem:
            raise FileError(f"{path} cannot be replayed: {problem}") from None
        # Along axes with walls nothing is wrapped.
        self._inverse = np.where(self._scene.periodic, 1.0 / self._box, 0.0)
        self._contacts = Contacts(self._scene.diameters, self._scene.species, self._scene.contact)
        self._fixed = (*walls(self._scene.box, self._scene.periodic), *self._scene.obstacles)
        n, dimension = self._x.shape
        self._t = np.zeros(n)
        self._images = np.zeros((n, dimension), np.int32)
        self._epoch, self._offset = 0, 0.0
        offsets = itertools.product((-1, 0, 1), repeat=dimension)
        self._digits = np.array(list(offsets), dtype=np.int64)  # of the codes, and of the images, too
        self._events = self._read()
        self._next = next(self._events, None)
        self._done = self._read_so_far = 0

    def _read(self) -> Iterator[tuple[int, float, int, int, int, float]]:
        for start in itertools.count(0, CHUNK):
            events: Events = read_events(self._path, start, start + CHUNK)
            if not len(events.time):
                return
            n = len(self._x)
            others = n + len(self._fixed)
            if events.i.max() >= n or events.j.max() >= others or events.image.max() >= len(self._digits):
                raise FileError(
                    f"{self._path} cannot be replayed: it names component {events.i.max()}, partner "
                    f"{events.j.max()} or image {events.image.max()}, and there are {n}, {others} and "
                    f"{len(self._digits)}."
                )
            yield from zip(*(column.tolist() for column in events), strict=True)

    @property
    def time(self) -> float:
        """Time since the start of the run [sigma sqrt(m / kT)], rounded to a double."""
        return float(self._epoch * Fraction(self._length) + Fraction(self._offset))

    @property
    def collisions(self) -> int:
        """Pair collisions realised so far."""
        return self._done

    def step(self) -> bool:
        """Realise the next collision of the log, of two components or with an obstacle.

        Returns False, and does nothing, if there is none.

        Raises
        ------
        FileError
            If the logged impulse is not the one that the states give.
        """
        if self._next is None:
            return False
        epoch, time, i, j, code, impulse = self._next
        self._enter_epoch(epoch)
        if j < len(self._x):
            self._collide(time, i, j, code, impulse)
            self._done += 1
        else:
            self._bounce(time, i, self._fixed[j - len(self._x)], impulse)
        self._offset = time
        self._read_so_far += 1
        self._next = next(self._events, None)
        return True

    def advance_to(self, time: float) -> None:
        """Realise all collisions up to and including a time.

        A collision's own time need not be a double (it is an epoch and an offset): to stop at one, use
        :meth:`step`.

        Past the last collision of the log all components fly on: whether the run went on so far, or the log
        ends early, is not known here.

        Raises
        ------
        InputError
            If the time is not finite, or past already.
        FileError
            If a logged impulse is not the one that the states give.
        """
        if not math.isfinite(time) or time < self.time:
            raise InputError(
                f"time is {time!r}; expected a finite number, at least the present {self.time:g}."
            )
        instant, length = Fraction(float(time)), Fraction(self._length)
        epoch = int(instant // length)
        offset = float(instant - epoch * length)
        while self._next is not None and self._next[:2] <= (epoch, offset):
            self.step()
        self._enter_epoch(epoch)
        self._offset = offset

    def frame(self) -> Frame:
        """Return all components at the present time, equal to ``Simulation.frame()`` of the logged run."""
        x = self._x + self._v * (self._offset - self._t)[:, None]
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
            velocities=self._v.copy(),
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
            self._epoch += 1
            self._offset = 0.0

    def _advance(self, who: np.ndarray, time: float) -> None:
        x = self._x[who] + self._v[who] * (time - self._t[who])[:, None]
        crossings = np.floor(x * self._inverse)
        # Where nothing is crossed this takes away zero, which changes no bit.
        self._x[who] = x - crossings * self._box
        self._images[who] += crossings.astype(np.int32)
        self._t[who] = time

    def _collide(self, time: float, i: int, j: int, code: int, impulse: float) -> None:
        self._advance(np.array([i, j]), time)
        r = self._separation(i, j, code)
        u = self._v[j] - self._v[i]
        rr = rv = 0.0
        for a, b in zip(r.tolist(), u.tolist(), strict=True):
            rr += a * a
            rv += a * b
        scene = self._scene
        if scene.equal:
            ours = theirs = rv / rr
            virial = -scene.mass * rv
        else:
            mine, other = float(scene.masses[i]), float(scene.masses[j])
            total = mine + other
            factor = 2.0 * rv / (rr * total)
            ours, theirs = factor * other, factor * mine
            virial = -2.0 * rv * (mine * other / total)
        # In a unit of time in which the squares are doubles, whatever the speeds.
        power = -math.frexp(self._threshold)[1]
        least, approach = math.ldexp(self._threshold, power), math.ldexp(rv, power)
        if scene.restitution < 1.0 and approach * approach >= least * least * rr:
            part = 0.5 * (1.0 + scene.restitution)
            ours, theirs, virial = ours * part, theirs * part, virial * part
        self._compare(virial / math.sqrt(rr), impulse, f"{i} and {j}")
        self._v[i] += ours * r
        self._v[j] -= theirs * r

    def _bounce(self, time: float, i: int, obstacle: Obstacle, impulse: float) -> None:
        self._advance(np.array([i]), time)
        x = self._x[i] - np.floor(self._x[i] * self._inverse) * self._box
        normal = self._outward(obstacle, x)
        speed = 0.0
        for a, b in zip(normal, self._v[i].tolist(), strict=True):
            speed += a * b
        change = 2.0 * (0.0 - speed)
        self._compare(float(self._scene.masses[i]) * change, impulse, f"{i} and {obstacle.name}")
        self._v[i] += change * np.array(normal)

    def _outward(self, obstacle: Obstacle, x: np.ndarray) -> list[float]:
        """Return the unit vector along which a component at x is thrown back."""
        if isinstance(obstacle, Plane):
            length = math.hypot(*obstacle.normal)
            return [component / length for component in obstacle.normal]
        assert isinstance(obstacle, Ball | SphericalContainer | CylindricalContainer)
        center = np.array(obstacle.center)
        if isinstance(obstacle, Ball):
            x = x - np.rint((x - center) * self._inverse) * self._box
        r = x - center if isinstance(obstacle, Ball) else center - x
        if isinstance(obstacle, CylindricalContainer):
            r[obstacle.axis] = 0.0
        rr = 0.0
        for component in r.tolist():
            rr += component * component
        return [component / math.sqrt(rr) for component in r.tolist()]

    def _compare(self, found: float, logged: float, who: str) -> None:
        """Raise FileError where the impulse of a collision is not the logged one."""
        if found != logged:
            raise FileError(
                f"{self._path}: the impulse of collision {self._read_so_far} between {who} is logged as "
                f"{logged!r}, and the states before it give {found!r}; the log is damaged, or of another "
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
        contact = float(self._contacts.of(np.array([[i, j]]))[0])
        misses = np.abs(np.sqrt((images * images).sum(axis=1)) - contact)
        # Positions are rounded in the last place of the box; images further apart than that are no tie.
        ties = np.flatnonzero(misses <= misses.min() + 2.0**-40 * float(self._box.max()))
        sectors = np.floor(self._x[[i, j]] / self._box * self._shape)
        named = (sectors[0] + self._digits[code] - sectors[1]) / self._shape
        unlike = np.abs(self._digits[ties] - named).sum(axis=1)
        return images[ties[np.argmin(unlike)]]


def _scene(initial: Mapping[str, np.ndarray]) -> Scene:
    """Return the scene from the arrays of a log."""
    arrays = {
        "diameter": initial["diameters"],
        "mass": initial["masses"],
        **{name: initial[name] for name in ("positions", "species", "contact") if name in initial},
    }
    return Scene.from_arrays(arrays, json.loads(bytes(initial["scene"]).decode()))


def replay(path: str | PathLike[str], *, time: float) -> Frame:
    """Return all components at one time of a logged run.

    Parameters
    ----------
    path : path
        An event log that :class:`carom.Simulation` wrote.
    time : float
        Time since the start of the run [sigma sqrt(m / kT)].

    Raises
    ------
    FileError
        If the file is no event log, or a logged impulse is not the one that the states give.
    InputError
        If the time is negative or not finite.
    """
    return next(replays(path, [time]))


def replays(path: str | PathLike[str], times: Iterable[float]) -> Iterator[Frame]:
    """Yield all components at the given times of a logged run, which must not decrease.

    Parameters and errors are those of :func:`replay`.
    """
    run = Replay(path)
    for time in times:
        run.advance_to(time)
        yield run.frame()
