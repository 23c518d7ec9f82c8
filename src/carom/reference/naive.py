"""The naive algorithm of the paper's introduction: slow, simple, and what defines the correct trajectory.

The whole system goes from collision to collision: of all pairs and all periodic images the earliest meeting
is found, every sphere is advanced to it, two velocities jump, and the search starts over. Lubachevsky (1991)
*calls* the trajectory found in this way the correct one (sec. 7); with 50 digits it stays so for hundreds of
collisions, long after any computation in doubles has diverged from it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from carom.errors import InputError, OverlapError
from carom.reference.arithmetic import ArithmeticName, make_arithmetic
from carom.reference.meeting import next_meeting

# Input in doubles cannot place two spheres at contact better than this, relative to the contact distance.
_CONTACT_ROUNDING = 2.0**-40
# The next search first looks this many recent intervals ahead; only its speed depends on it.
_LOOKAHEAD = 8.0


class Collision(NamedTuple):
    """One realised collision.

    Attributes
    ----------
    time : number
        When [time], in the arithmetic of the run.
    i, j : int
        The two spheres, i < j.
    image : tuple of d ints
        ``x[j] + image * box - x[i]`` is at contact, with unwrapped positions x.
    impulse : number
        Momentum >= 0 passed from i to j along the line of centres [mass length / time]; ``m |u_n|`` for equal
        masses m that approach with the normal speed ``|u_n|``.
    """

    time: Any
    i: int
    j: int
    image: tuple[int, ...]
    impulse: Any


class NaiveSystem:
    """Hard spheres in a periodic box, advanced from collision to collision.

    Parameters
    ----------
    positions, velocities : (n, d) nested sequences or arrays
        Centres [length], anywhere, and velocities [length / time], d >= 1.
    box : sequence of d numbers
        Edges [length]; none below the largest diameter. All images that can be met are considered, down to
        edges of just one diameter.
    diameter : number or sequence of n numbers
        Diameter sigma [length]; unequal spheres meet at the mean of their diameters.
    masses : sequence of n numbers, optional
        All 1 if omitted.
    arithmetic : {"mpmath", "float", "fraction"}
        In which everything is computed. ``"fraction"`` is exact: in one dimension and for head-on meetings
        the roots are rational; the first meeting that could be the next one and whose root is irrational
        raises InputError.
    digits : int
        Decimal digits of ``"mpmath"``.
    time : number
        The time of the given state [time].

    Raises
    ------
    InputError
        If shapes or values do not fit.
    OverlapError
        If two spheres overlap, or one overlaps its own image; relative depths below 2^-40 count as rounding.

    Notes
    -----
    Simultaneous collisions are processed in the order (time, i, j), where times count as equal only if they
    are the same number. Spheres that touch without approaching do not collide.

    Examples
    --------
    >>> system = NaiveSystem([[0.0], [3.0]], [[1.0], [0.0]], [10.0], arithmetic="fraction")
    >>> system.step()
    Collision(time=Fraction(2, 1), i=0, j=1, image=(0,), impulse=Fraction(1, 1))
    >>> [float(v) for v in system.velocities[:, 0]]
    [0.0, 1.0]
    """

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
        """Unwrapped centres (n, d) [length]."""
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
        """Advance to the next collision and realise it.

        Parameters
        ----------
        until : number
            Do nothing if there is no collision up to this time [time].

        Returns
        -------
        Collision or None
            None, and an unchanged state, if there is no collision in time or never one.

        Raises
        ------
        NoMeetingFound
            If a very long search in time finds no collision and `until` is infinite.
        """
        meeting = next_meeting(
            self._x,
            self._v,
            self.diameters,
            self.box,
            self.arithmetic,
            limit=until - self.time,
            guess=self._guess,
        )
        if meeting is None:
            return None
        recent = float(meeting.delay)
        self._guess = _LOOKAHEAD * recent if recent > 0 else math.inf
        # The advance may wrap the two spheres; their unwrapped positions know nothing of that.
        image = np.array(meeting.image) + self._crossings[meeting.i] - self._crossings[meeting.j]
        self._advance(meeting.delay)
        return self._jump(meeting.i, meeting.j, image)

    def advance_to(self, time: Any) -> list[Collision]:
        """Advance to `time`, realising all collisions up to and including it, and return them.

        Raises
        ------
        InputError
            If `time` is in the past or not finite.
        """
        (target,) = self.arithmetic.array([time], "time")
        if target < self.time:
            raise InputError(f"time is {time}, but the system is at {self.time} already and cannot go back.")
        realised = []
        while (collision := self.step(until=target)) is not None:
            realised.append(collision)
        self._advance(target - self.time)
        self.time = target
        return realised

    def __iter__(self) -> Iterator[Collision]:
        """Realise one collision after the other, until there is never another one."""
        while (collision := self.step()) is not None:
            yield collision

    def _advance(self, duration: Any) -> None:
        self._x = self._x + self._v * duration
        self.time = self.time + duration
        self._wrap()

    def _wrap(self) -> None:
        """Bring the positions into the box (up to rounding) and count the crossings."""
        turns = np.floor(self._x.astype(float) / self.box.astype(float)).astype(np.int64)
        if turns.any():
            self._x = self._x - turns * self.box
            self._crossings += turns

    def _jump(self, i: int, j: int, image: np.ndarray) -> Collision:
        """Pass the impulse of an elastic collision along the line of centres."""
        r = self._x[j] - self._x[i] + (image + self._crossings[j] - self._crossings[i]) * self.box
        u = self._v[j] - self._v[i]
        contact = (self.diameters[i] + self.diameters[j]) / 2
        reduced = self.masses[i] * self.masses[j] / (self.masses[i] + self.masses[j])
        # r.r is the contact distance squared up to rounding; dividing by it conserves the energy better.
        scale = -2 * reduced * sum(r * u) / sum(r * r)
        self._v[i] = self._v[i] - r * (scale / self.masses[i])
        self._v[j] = self._v[j] + r * (scale / self.masses[j])
        self.virial = self.virial + scale * contact * contact
        self.collisions += 1
        return Collision(self.time, i, j, tuple(int(n) for n in image), scale * contact)

    def _check_overlaps(self) -> None:
        widest = int(np.argmax(self.diameters))
        if (self.box < self.diameters[widest]).any():
            raise OverlapError(
                f"Sphere {widest} of diameter {float(self.diameters[widest]):.6g} overlaps its own image in "
                f"the box {tuple(float(edge) for edge in self.box)}; no edge may be shorter than a diameter."
            )
        x, edges, sigma = self._x.astype(float), self.box.astype(float), self.diameters.astype(float)
        for i in range(len(x) - 1):
            r = x[i + 1 :] - x[i]
            distance = np.sqrt(((r - edges * np.rint(r / edges)) ** 2).sum(axis=1))
            contact = 0.5 * (sigma[i + 1 :] + sigma[i])
            for k in np.flatnonzero(distance < contact * (1.0 - _CONTACT_ROUNDING)):
                raise OverlapError(
                    f"Spheres {i} and {i + 1 + k} overlap by {contact[k] - distance[k]:.6g} (distance "
                    f"{distance[k]:.6g}, contact {contact[k]:.6g}); start without overlaps."
                )


def collisions(
    positions: Any,
    velocities: Any,
    box: Any,
    *,
    diameter: Any = 1,
    masses: Sequence[Any] | None = None,
    arithmetic: ArithmeticName = "mpmath",
    digits: int = 50,
) -> Iterator[Collision]:
    """Return an iterator over the collisions of hard spheres in a periodic box, in the order of time.

    Parameters, errors and the order of simultaneous collisions are those of :class:`NaiveSystem`; the input
    is checked at once, before the first collision is asked for. The iterator ends only when there can
    never be another collision.

    Examples
    --------
    >>> from itertools import islice
    >>> run = collisions([[0, 0], [2, 0]], [[1, 0], [0, 0]], [10, 10], arithmetic="fraction")
    >>> [(str(c.time), c.i, c.j, c.image) for c in islice(run, 2)]
    [('1', 0, 1, (0, 0)), ('9', 0, 1, (-1, 0))]
    """
    return iter(
        NaiveSystem(
            positions,
            velocities,
            box,
            diameter=diameter,
            masses=masses,
            arithmetic=arithmetic,
            digits=digits,
        )
    )
