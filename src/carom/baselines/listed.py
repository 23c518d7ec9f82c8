"""Spheres with a list of their pairs: the common part of the compiled methods."""

from __future__ import annotations

import itertools
import math
import time as clock
from abc import ABC, abstractmethod
from typing import Any, Self

import numpy as np

from carom.baselines.pairs import PairList, order_in_cells

SKINS = (0.03, 0.06, 0.12, 0.25, 0.4, 0.6, 0.8)
"""Skins of the list to try [diameters]."""

CHUNKS = (0, 8, 64)
"""Sizes of chunks of pairs to try. A vectorized loop first finds the smallest distance in a chunk; only if it
is short enough, the pairs are treated one by one. With 0 all pairs are, which is faster where many touch."""


class ListedSpheres(ABC):
    """Equal spheres (n, d) in a periodic box, and the list of their pairs; a subclass moves them.

    Compiled code has arrays (d, n), neighbors in space beside each other, and adds to the sums in ``tally``
    (k,).
    """

    def __init__(
        self,
        positions: Any,
        velocities: Any,
        box: Any,
        *,
        step: float,
        diameter: float,
        mass: float,
        tally: np.ndarray,
        settings: dict[str, Any],
    ):
        self._settings = settings  # of the subclass, but for the skin
        self.box = np.array(box, dtype=np.float64)
        self.step, self.diameter, self.mass = float(step), float(diameter), float(mass)
        positions = np.asarray(positions, dtype=np.float64)
        self._order = order_in_cells(positions, self.box)
        self._x: Any = np.ascontiguousarray(positions[self._order].T)
        self._v: Any = np.ascontiguousarray(np.asarray(velocities, dtype=np.float64)[self._order].T)
        self._images = np.zeros(self._x.shape, dtype=np.int64)
        self._listed = self._x.copy()
        self._pairs = PairList(self.box, self._x.shape[1])
        self._slack = -1.0  # a pair may approach by so much until the list is renewed; negative: renew now
        self.steps = 0
        self._tally = tally
        self._chunk = CHUNKS[-1]

    @property
    def time(self) -> float:
        """Present time [time]."""
        return self.steps * self.step

    @property
    def positions(self) -> np.ndarray:
        """Unwrapped centers (n, d) [length]."""
        return self._back(self._x + self._images * self.box[:, None])

    @property
    def velocities(self) -> np.ndarray:
        """Velocities (n, d) [length / time]."""
        return self._back(self._v)

    @property
    def bytes(self) -> int:
        """Memory of the state and of the list [bytes]."""
        arrays = (self._x, self._v, self._images, self._listed, self._pairs.first, self._pairs.second)
        return sum(array.nbytes for array in arrays)

    def reversed(self) -> Self:
        """Return the spheres where they are, with all velocities reversed and the sums at zero."""
        make: Any = type(self)
        found: Self = make(self.positions, -self.velocities, self.box, skin=self.skin, **self._settings)
        return found

    @abstractmethod
    def run(self, steps: int) -> Any:
        """Make ``steps`` steps."""

    def _list_pairs(self, contact: float, skin: float, steps: float) -> None:
        """Wrap every sphere into the box; list the pairs up to ``contact`` [length] + ``skin`` [diameters].

        The list is valid for at least so many ``steps`` of the fastest sphere.
        """
        box = self.box[:, None]
        turns = np.floor(self._x / box)
        # Rounding may leave a sphere slightly outside, which the list allows.
        self._x -= turns * box
        self._images += turns.astype(np.int64)
        self._listed = self._x.copy()
        fastest = math.sqrt(float((self._v**2).sum(axis=0).max()))
        self._slack = skin * self.diameter + 2.0 * steps * fastest * self.step
        doubt = 8.0 * float(np.finfo(np.float64).eps) * float(self.box.max())  # roundings of a coordinate
        reach = contact + self._slack + doubt
        self._pairs.renew(self._x, reach)
        if 2.0 * reach > self.box.min():
            self._slack = float(np.finfo(np.float64).max)  # all pairs are listed

    def _tuned(self, skin: float | None) -> float:
        """Return the given skin; by default find the fastest skin by trial, and set its chunk size."""
        if skin is not None:
            return float(skin)
        start = self._x.copy(), self._v.copy(), self._images.copy(), self._tally.copy()
        costs = {}
        for tried in itertools.product(SKINS, CHUNKS):
            self.skin, self._chunk = tried
            self._slack, self.steps = -1.0, 0
            self.run(1)
            began, made = clock.process_time(), 0
            while (spent := clock.process_time() - began) < 0.02:
                self.run(25)
                made += 25
            costs[tried] = spent / made
            for array, before in zip((self._x, self._v, self._images, self._tally), start, strict=True):
                array[:] = before
        self._slack, self.steps = -1.0, 0
        best, self._chunk = min(costs, key=costs.__getitem__)
        return best

    def _back(self, rows: np.ndarray) -> np.ndarray:
        """Return an array (d, n) as (n, d), in the original order of the spheres."""
        result = np.empty(rows.shape[::-1])
        result[self._order] = rows.T
        return result
