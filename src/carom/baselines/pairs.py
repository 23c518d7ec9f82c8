"""Verlet lists of the pairs within a reach in a periodic box, made from cells by compiled code."""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import Any

import numpy as np

SWIFT: dict[str, Any] = {
    "error_model": "numpy", "nogil": True, "fastmath": {"nnan", "nsz", "arcp", "contract", "afn", "reassoc"},
}  # fmt: skip
"""Options of Numba for these methods: all that make them faster, such as a free order of sums."""


def compile_kept(function: Any) -> Any:
    """Compile a function by Numba, or load it from the cache of an earlier process."""
    from numba import njit

    return njit(cache=True, **SWIFT)(function)


class PairList:
    """All pairs of ``n`` components closer than a reach in a ``box`` (d,) [length], each pair once."""

    def __init__(self, box: np.ndarray, n: int):
        self.box, self.n = box, n
        self._first, self._second = (np.empty(4 * n, np.uint32) for _ in range(2))
        self.count = 0

    @property
    def first(self) -> np.ndarray:
        """The first component of each pair, (count,) uint32."""
        return self._first[: self.count]

    @property
    def second(self) -> np.ndarray:
        """The second component of each pair, (count,) uint32."""
        return self._second[: self.count]

    def renew(self, x: np.ndarray, reach: float) -> None:
        """List the pairs of components at ``x`` (d, n), inside the box, up to ``reach`` [length] apart.

        Where the reach is more than half of an edge, all pairs are listed.
        """
        dimension = len(self.box)
        shape = np.floor(self.box / reach).astype(np.int64)
        if 2.0 * reach > self.box.min():
            first, second = np.triu_indices(self.n, 1)
            self._first, self._second = first.astype(np.uint32), second.astype(np.uint32)
            self.count = len(first)
            return
        if (shape < 3).any():
            shape[:] = 1
        while True:
            count = _cell_pairs(dimension)(
                x, self.box.astype(x.dtype), x.dtype.type(reach * reach), shape, _half(dimension),
                self._first, self._second,
            )  # fmt: skip
            if count >= 0:
                self.count = int(count)
                return
            self._first, self._second = (np.empty(2 * len(self._first), np.uint32) for _ in range(2))


def order_in_cells(positions: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Return an order (n,) in which neighbors in space follow each other."""
    per_axis = max(int((len(positions) / 4.0) ** (1.0 / len(box))), 1)
    cells = np.minimum(np.floor(np.mod(positions, box) / box * per_axis), per_axis - 1).astype(np.int64)
    return np.argsort(np.ravel_multi_index(tuple(cells.T), (per_axis,) * len(box)), kind="stable")


def _half(dimension: int) -> np.ndarray:
    """Return the steps to one half of the neighbor cells; the other half is reached from those cells."""
    around = list(itertools.product((-1, 0, 1), repeat=dimension))
    return np.array(around[len(around) // 2 + 1 :], dtype=np.int64).reshape(-1, dimension)


@lru_cache
def _cell_pairs(dimension: int) -> Any:
    """Return the compiled function that lists pairs; it returns their number, or -1 if the lists are full."""
    D = dimension

    def cell_pairs(x, box, square, shape, half, first, second):
        n = x.shape[1]
        total = 1
        for a in range(D):
            total *= shape[a]
        cell = np.empty(n, np.int64)
        begin = np.zeros(total + 1, np.int64)
        for i in range(n):
            at = 0
            for a in range(D):
                k = int(x[a, i] / box[a] * shape[a])
                at = at * shape[a] + min(max(k, 0), shape[a] - 1)
            cell[i] = at
            begin[at + 1] += 1
        for c in range(total):
            begin[c + 1] += begin[c]
        members = np.empty(n, np.int64)
        place = begin[:-1].copy()
        for i in range(n):
            members[place[cell[i]]] = i
            place[cell[i]] += 1
        count = 0
        digits = np.empty(D, np.int64)
        for c in range(total):
            rest = c
            for a in range(D - 1, -1, -1):
                digits[a] = rest % shape[a]
                rest //= shape[a]
            for h in range(-1, len(half) if total > 1 else 0):
                other = c
                if h >= 0:
                    other = 0
                    for a in range(D):
                        other = other * shape[a] + (digits[a] + half[h, a]) % shape[a]
                for p in range(begin[c], begin[c + 1]):
                    i = members[p]
                    start = p + 1 if h < 0 else begin[other]
                    for q in range(start, begin[other + 1]):
                        j = members[q]
                        rr = x[0, i] * 0
                        for a in range(D):
                            r = x[a, j] - x[a, i]
                            r -= box[a] * np.rint(r / box[a])
                            rr += r * r
                        if rr < square:
                            if count == len(first):
                                return -1
                            first[count] = i
                            second[count] = j
                            count += 1
        return count

    return compile_kept(cell_pairs)
