"""The naive system with what only tests compare: walls, obstacles, growth, lost energy, contact matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from carom.errors import InputError, OverlapError
from carom.reference import Collision, NaiveSystem
from carom.reference.arithmetic import make_arithmetic
from carom.reference.meeting import Contacts, Meeting, next_meeting
from carom.reference.naive import _CONTACT_ROUNDING
from helpers.naive.fixed import Ball, make_fixed


class Tabled(NamedTuple):
    """Contact distances of pairs from a table; fixed balls, which come last, belong to no species."""

    diameters: np.ndarray
    growth: np.ndarray
    species: np.ndarray  # (n,)
    matrix: np.ndarray  # (K, K) [length]

    def of(self, i: Any, j: Any) -> tuple[Any, Any]:
        distance, rate = Contacts(self.diameters, self.growth).of(i, j)
        free = len(self.species) - 1
        tabled = self.matrix[self.species[np.minimum(i, free)], self.species[np.minimum(j, free)]]
        return np.where(np.less_equal(j, free), tabled, distance)[()], rate

    def floats(self) -> Tabled:
        return Tabled(
            *Contacts(self.diameters, self.growth).floats(), self.species, self.matrix.astype(float)
        )


class Oracle(NaiveSystem):
    """Hard spheres with walls at 0 and the edge of axes that are not ``periodic``, and ``obstacles``.

    ``species`` (n,) and ``contact`` (K, K) give the contact distances [length]. With ``growth`` at the rate g
    of the contact distance, the normal relative velocity u_n becomes ``g - e (u_n - g)``; e is 1 below the
    normal speed ``elastic_below``, and else ``restitution``. A collision of sphere i with wall or obstacle k
    has j = n + k; ``hits`` and ``impulses`` (K,) are those of each. A ball is met under all its images.
    """

    def __init__(
        self,
        positions: Any,
        velocities: Any,
        box: Any,
        *,
        species: Any = None,
        contact: Any = None,
        growth: Any = 0,
        periodic: Any = True,
        obstacles: Sequence[Mapping[str, Any]] = (),
        restitution: Any = 1,
        elastic_below: Any = 0,
        arithmetic: Any = "mpmath",
        digits: int = 50,
        **settings: Any,
    ) -> None:
        exact, n = make_arithmetic(arithmetic, digits), len(positions)
        edges, rates = exact.array(box, "box"), exact.array(growth, "growth")
        self.growth = np.array([rates[()]] * n, dtype=rates.dtype) if rates.ndim == 0 else rates
        if (self.growth < 0).any() or (self.growth.any() and contact is not None):
            raise InputError(
                f"growth is {growth!r}; expected one or {n} numbers at least zero, and no contact matrix."
            )
        if (species is None) != (contact is None):
            raise InputError("species and contact belong together; give both or none.")
        self._species = None if species is None else np.array(species, dtype=np.int64)
        self._matrix = None if contact is None else exact.array(contact, "contact")
        self._around = np.broadcast_to(np.array(periodic, dtype=bool), edges.shape)
        self._restitution, self._elastic_below = exact.number(restitution), exact.number(elastic_below)
        self.fixed = make_fixed(edges, self._around.tolist(), obstacles, exact)
        self._balls = [fixed for fixed in self.fixed if isinstance(fixed, Ball)]
        self._numbers = [k for k, fixed in enumerate(self.fixed) if isinstance(fixed, Ball)]
        self.hits = np.zeros(len(self.fixed), dtype=np.int64)
        self.impulses = np.array([exact.number(0)] * len(self.fixed), dtype=edges.dtype)
        super().__init__(positions, velocities, box, arithmetic=arithmetic, digits=digits, **settings)

    def _contacts(self) -> Any:
        sizes = np.array([2 * ball.radius for ball in self._balls], dtype=self._x.dtype)
        both = np.concatenate([self.diameters, sizes]), np.concatenate([self.growth, sizes * 0])
        return Contacts(*both) if self._matrix is None else Tabled(*both, self._species, self._matrix)

    def _next(self, limit: Any) -> Meeting | None:
        fixed = self._next_fixed()
        limit = limit if fixed is None else min(limit, fixed.delay)
        # Balls are spheres that stand still.
        centers = np.array([ball.center for ball in self._balls]).reshape(-1, len(self.box))
        places, speeds = np.concatenate([self._x, centers]), np.concatenate([self._v, centers * 0])
        meeting = next_meeting(
            places, speeds, self._contacts(), self.box, self.arithmetic, periodic=self._around, limit=limit,
            guess=self._guess,
        )  # fmt: skip
        n = len(self._x)
        if meeting is not None and meeting.j >= n:
            meeting = meeting._replace(j=n + self._numbers[meeting.j - n])
        if fixed is not None and fixed.delay <= limit and (meeting is None or fixed < meeting):
            return fixed
        return meeting

    def _next_fixed(self) -> Meeting | None:
        """Return the first meeting with a wall, plane or container."""
        n, radii, rates, sqrt = len(self._x), self.diameters / 2, self.growth / 2, self.arithmetic.sqrt
        met = (
            (fixed.encounter(self._x[i], self._v[i], radii[i], rates[i], sqrt), i, n + k)
            for k, fixed in enumerate(self.fixed)
            if not isinstance(fixed, Ball)
            for i in range(n)
        )
        image = (0,) * len(self.box)
        return min((Meeting(*each, image) for each in met if each[0] is not None), default=None)

    def _realized(self, meeting: Meeting) -> Collision:
        i, k = meeting.i, meeting.j - len(self._x)
        if k < 0:
            return super()._realized(meeting)
        image = np.array(meeting.image) + self._crossings[i]
        self._advance(meeting.delay)
        fixed, x = self.fixed[k], self._x[i]
        if isinstance(fixed, Ball):
            away = x - (fixed.center + (image - self._crossings[i]) * self.box)
        else:
            away = fixed.outward(x)
        length = self.arithmetic.sqrt(sum(away * away))
        change = 2 * (self.growth[i] / 2 - sum(away * self._v[i]) / length)
        self._v[i] = self._v[i] + away * (change / length)
        impulse = self.masses[i] * change
        self.hits[k] += 1
        self.impulses[k] = self.impulses[k] + impulse
        return Collision(self.time, i, meeting.j, tuple(int(turn) for turn in image), impulse)

    def _advance(self, duration: Any) -> None:
        super()._advance(duration)
        if self.growth.any():
            self.diameters = self.diameters + self.growth * duration
            self._check_sizes()

    def _kept(self, approach: Any, contact: Any) -> Any:
        return self._restitution if -approach >= self._elastic_below * contact else 1

    def _check_overlaps(self) -> None:
        super()._check_overlaps()
        edges = self.box.astype(float)
        for k, fixed in enumerate(self.fixed):
            for i, (x, radius) in enumerate(zip(self._x, self.diameters / 2, strict=True)):
                if isinstance(fixed, Ball):
                    r = (x - fixed.center).astype(float)
                    r = r - edges * np.rint(r / edges) * self._around
                    gap = np.sqrt(r @ r) - float(fixed.radius + radius)
                else:
                    gap = np.float64(fixed.gap(x, radius))
                if gap < -_CONTACT_ROUNDING * (edges.max() + 2.0 * float(radius)):
                    raise OverlapError(
                        f"Sphere {i} is inside of wall or obstacle {k} by {-gap:.6g}; start outside of it."
                    )
