"""The naive algorithm of the paper's introduction: slow, simple, and it defines the correct trajectory.

The earliest meeting of all pairs and images is found, every sphere is advanced to it, the velocities jump,
and the search starts over. Lubachevsky (1991) *calls* its trajectory the correct one (sec. 7). With 50 digits
it is correct for hundreds of collisions, long after doubles have diverged.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from carom.errors import InputError, OverlapError
from carom.reference.arithmetic import ArithmeticName, make_arithmetic
from carom.reference.meeting import Contacts, Meeting, next_meeting

# Input in doubles cannot place two spheres at contact better than this, relative to the contact distance.
_CONTACT_ROUNDING = 2.0**-40
# The next search first looks ahead by the last interval times this; only its speed depends on it.
_LOOKAHEAD = 8.0


class Collision(NamedTuple):
    """One realized collision.

    Attributes
    ----------
    time : number
        Time of the collision [time], in the arithmetic of the run.
    i, j : int
        The two spheres, i < j.
    image : tuple of d ints
        ``x[j] + image * box - x[i]`` is the vector between the centers at contact, with unwrapped positions
        x.
    impulse : number
        Momentum >= 0 passed from i to j along the line of centers [mass length / time]; ``m |u_n|`` for equal
        masses m that approach with the normal speed ``|u_n|`` and collide elastically.
    """

    time: Any
    i: int
    j: int
    image: tuple[int, ...]
    impulse: Any


class NaiveSystem:
    """Elastic hard spheres in a periodic box, advanced from collision to collision.

    Parameters
    ----------
    positions, velocities : (n, d) nested sequences or arrays
        Centers [length], anywhere, and velocities [length / time], d >= 1.
    box : sequence of d numbers
        Edges [length]; none below the largest diameter. All images that can be met are considered, down to
        edges of just one diameter.
    diameter : number or sequence of n numbers
        Diameter sigma [length]; unequal spheres meet at the mean of their diameters.
    masses : sequence of n numbers, optional
        Masses; by default all 1.
    arithmetic : {"mpmath", "float", "fraction"}
        Arithmetic of all computations. ``"fraction"`` is exact. It needs rational roots, as in one dimension
        and for head-on collisions: a next collision with an irrational root raises InputError.
    digits : int
        Decimal digits of ``"mpmath"``.
    time : number
        The time of the given state [time].

    Raises
    ------
    InputError
        If shapes or values do not fit.
    OverlapError
        If two spheres overlap, or one overlaps its own image. Relative depths below 2^-40 count as rounding.

    Notes
    -----
    Simultaneous collisions are processed in the order (time, i, j). Times are equal only if they are the same
    number. Spheres that touch without approaching do not collide.

    Examples
    --------
    >>> system = NaiveSystem([[0.0], [3.0]], [[1.0], [0.0]], [10.0], arithmetic="fraction")
    >>> system.step()
    Collision(time=Fraction(2, 1), i=0, j=1, image=(0,), impulse=Fraction(1, 1))
    >>> [float(v) for v in system.velocities[:, 0]]
    [0.0, 1.0]
    """

    _around: Any = True
    """Which axes are periodic, (d,) bool, or all."""

    def __init__(
        self,
        positions: Any,
        velocities: Any,
        box: Any,
        *,
        diameter: Any = 1,
        masses: Sequence[Any] | None = None,
        arithmetic: ArithmeticName = "mpmath",
        digits: int = 50,
        time: Any = 0,
    ) -> None:
        self.arithmetic = make_arithmetic(arithmetic, digits)
        array, number = self.arithmetic.array, self.arithmetic.number
        self._x = array(positions, "positions")
        self._v = array(velocities, "velocities")
        self.box = array(box, "box")
        if self._x.ndim != 2 or 0 in self._x.shape:
            raise InputError(f"positions have shape {self._x.shape}; expected (n, d) with n >= 1 and d >= 1.")
        n, d = self._x.shape
        if self._v.shape != (n, d):
            raise InputError(f"velocities have shape {self._v.shape}; expected {(n, d)} as the positions.")
        if self.box.shape != (d,) or (self.box <= 0).any():
            raise InputError(f"box is {box!r}; expected {d} positive edges.")
        sizes = array(diameter, "diameter")
        self.diameters = np.array([sizes[()]] * n, dtype=self._x.dtype) if sizes.ndim == 0 else sizes
        self.masses = array([1] * n if masses is None else masses, "masses")
        for name, values in (("diameter", self.diameters), ("masses", self.masses)):
            if values.shape != (n,) or (values <= 0).any():
                raise InputError(f"{name} has shape {values.shape}; expected {n} positive numbers.")
        self.time = number(time)
        self.virial = number(0)
        self.collisions = 0
        self._crossings = np.zeros((n, d), dtype=np.int64)
        self._guess = math.inf
        self._wrap()
        self._check_overlaps()

    @property
    def positions(self) -> np.ndarray:
        """Unwrapped centers (n, d) [length]."""
        return self._x + self._crossings * self.box

    @property
    def velocities(self) -> np.ndarray:
        """Velocities (n, d) [length / time]."""
        return self._v.copy()

    @property
    def energy(self) -> Any:
        """Kinetic energy [mass length^2 / time^2]."""
        return sum((self._v * self._v).sum(axis=1) * self.masses) / 2

    @property
    def momentum(self) -> np.ndarray:
        """Total momentum (d,) [mass length / time]."""
        return (self._v * self.masses[:, None]).sum(axis=0)

    def step(self, until: Any = math.inf) -> Collision | None:
        """Advance to the next collision and realize it.

        Parameters
        ----------
        until : number
            Do nothing if there is no collision up to this time [time].

        Returns
        -------
        Collision or None
            None, with an unchanged state, if there is no collision up to `until`.

        Raises
        ------
        NoMeetingFound
            If a very long search in time finds no collision and `until` is infinite.
        """
        meeting = self._next(until - self.time)
        if meeting is None:
            return None
        recent = float(meeting.delay)
        self._guess = _LOOKAHEAD * recent if recent > 0 else math.inf
        return self._realized(meeting)

    def _next(self, limit: Any) -> Meeting | None:
        """Return the next meeting within a time."""
        return next_meeting(
            self._x, self._v, self._contacts(), self.box, self.arithmetic, limit=limit, guess=self._guess
        )

    def _realized(self, meeting: Meeting) -> Collision:
        """Advance all to the meeting of two, and let their velocities jump."""
        # The image is that of unwrapped positions, which do not change if the advance wraps the spheres.
        image = np.array(meeting.image) + self._crossings[meeting.i] - self._crossings[meeting.j]
        self._advance(meeting.delay)
        return self._jump(meeting.i, meeting.j, image)

    def _contacts(self) -> Contacts:
        return Contacts(self.diameters, self.diameters * 0)

    def advance_to(self, time: Any) -> list[Collision]:
        """Advance to `time`, process all collisions up to and including it, and return them.

        Raises
        ------
        InputError
            If `time` is in the past or not finite.
        """
        (target,) = self.arithmetic.array([time], "time")
        if target < self.time:
            raise InputError(f"time is {time}, but the system is at {self.time} already and cannot go back.")
        realized = []
        while (collision := self.step(until=target)) is not None:
            realized.append(collision)
        self._advance(target - self.time)
        self.time = target
        return realized

    def __iter__(self) -> Iterator[Collision]:
        """Realize one collision after the other, until there is never another one."""
        while (collision := self.step()) is not None:
            yield collision

    def _advance(self, duration: Any) -> None:
        self._x = self._x + self._v * duration
        self.time = self.time + duration
        self._wrap()

    def _wrap(self) -> None:
        """Bring the positions into the box (up to rounding) and count the crossings."""
        turns = np.floor(self._x.astype(float) / self.box.astype(float)).astype(np.int64)
        turns *= self._around
        if turns.any():
            self._x = self._x - turns * self.box
            self._crossings += turns

    def _jump(self, i: int, j: int, image: np.ndarray) -> Collision:
        """Pass the impulse of a collision along the line of centers."""
        r = self._x[j] - self._x[i] + (image + self._crossings[j] - self._crossings[i]) * self.box
        u = self._v[j] - self._v[i]
        contact, rate = self._contacts().of(i, j)
        reduced = self.masses[i] * self.masses[j] / (self.masses[i] + self.masses[j])
        approach = sum(r * u) - contact * rate
        kept = self._kept(approach, contact)
        # r.r is the contact distance squared up to rounding; dividing by it conserves the energy better.
        scale = -(1 + kept) * reduced * approach / sum(r * r)
        self._v[i] = self._v[i] - r * (scale / self.masses[i])
        self._v[j] = self._v[j] + r * (scale / self.masses[j])
        self.virial = self.virial + scale * contact * contact
        self.collisions += 1
        return Collision(self.time, i, j, tuple(int(n) for n in image), scale * contact)

    def _kept(self, approach: Any, contact: Any) -> Any:
        """Return the part that a collision leaves of the normal speed, which is ``-approach / contact``."""
        return 1

    def _check_sizes(self) -> None:
        widest = int(np.argmax(self.diameters))
        if (self.box < self.diameters[widest]).any():
            raise OverlapError(
                f"Sphere {widest} of diameter {float(self.diameters[widest]):.6g} overlaps its own image, or "
                f"both walls, in the box {tuple(float(edge) for edge in self.box)}; no edge may be shorter "
                "than a diameter."
            )

    def _check_overlaps(self) -> None:
        self._check_sizes()
        x, edges = self._x.astype(float), self.box.astype(float)
        n, rough = len(x), self._contacts().floats()
        for i in range(n - 1):
            others = np.arange(i + 1, n)
            r = x[i + 1 :] - x[i]
            distance = np.sqrt(((r - edges * np.rint(r / edges) * self._around) ** 2).sum(axis=1))
            contact, _ = rough.of(i, others)
            for other in np.flatnonzero(distance < contact * (1.0 - _CONTACT_ROUNDING)):
                raise OverlapError(
                    f"Spheres {i} and {i + 1 + other} overlap by {contact[other] - distance[other]:.6g} "
                    f"(distance {distance[other]:.6g}, contact {contact[other]:.6g}); start without overlaps."
                )


def collisions(positions: Any, velocities: Any, box: Any, **settings: Any) -> Iterator[Collision]:
    """Return an iterator over the collisions of hard spheres in a box, in the order of time.

    Parameters, errors and the order of simultaneous collisions are those of :class:`NaiveSystem`. The input
    is checked at once, before the first collision is requested. The iterator ends only when no other
    collision is possible.

    Examples
    --------
    >>> from itertools import islice
    >>> run = collisions([[0, 0], [2, 0]], [[1, 0], [0, 0]], [10, 10], arithmetic="fraction")
    >>> [(str(c.time), c.i, c.j, c.image) for c in islice(run, 2)]
    [('1', 0, 1, (0, 0)), ('9', 0, 1, (-1, 0))]
    """
    return iter(NaiveSystem(positions, velocities, box, **settings))
