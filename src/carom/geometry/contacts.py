"""Distances at which pairs touch, and classes of size in which near pairs are searched."""

from __future__ import annotations

import numpy as np


class Contacts:
    """Distances at which pairs touch, and the classes of size in which near pairs are searched.

    Without a ``matrix`` (K, K) for ``species``, a pair touches at the mean of its diameters. ``classes`` are
    by octave, or by species with a matrix, the largest first: a search as wide as the largest sphere would
    find thousands of small ones around each small one.
    """

    def __init__(
        self, diameters: np.ndarray, species: np.ndarray | None = None, matrix: np.ndarray | None = None
    ) -> None:
        self.diameters = diameters
        self._species, self._matrix = species, matrix
        if matrix is None:
            octave = np.floor(np.log2(diameters.max() / diameters)).astype(np.int64)
        else:
            assert species is not None
            order = np.argsort(-np.diag(matrix), kind="stable")
            octave = np.argsort(order)[species]
        self._class = np.unique(octave, return_inverse=True)[1].ravel()
        self.classes = [np.nonzero(self._class == k)[0] for k in range(int(self._class.max()) + 1)]
        self._largest = np.array([diameters[members].max() for members in self.classes])

    @property
    def additive(self) -> bool:
        """Whether a pair touches at the mean of its diameters."""
        return self._matrix is None

    def of(self, pairs: np.ndarray) -> np.ndarray:
        """Return the distances (m,) at which ``pairs`` (m, 2) touch [length]."""
        if self._matrix is not None:
            assert self._species is not None
            return self._matrix[self._species[pairs[:, 0]], self._species[pairs[:, 1]]]
        return 0.5 * (self.diameters[pairs[:, 0]] + self.diameters[pairs[:, 1]])

    def reach(self, a: int, b: int) -> float:
        """Return the largest distance at which a component of class a touches one of class b [length]."""
        if self._matrix is not None:
            assert self._species is not None
            return float(self._matrix[self._species[self.classes[a][0]], self._species[self.classes[b][0]]])
        return float(0.5 * (self._largest[a] + self._largest[b]))

    @property
    def extremes(self) -> tuple[float, float]:
        """The smallest and the largest distance at which two components touch [length]."""
        if self._matrix is None or self._species is None:
            order = np.sort(self.diameters)
            return float(order[:2].mean()), float(order[-2:].mean())
        kinds, counts = np.unique(self._species, return_counts=True)
        pairs = ~np.eye(len(kinds), dtype=bool) | (counts > 1)  # nobody touches itself
        distances = self._matrix[np.ix_(kinds, kinds)][pairs]
        return float(distances.min(initial=np.inf)), float(distances.max(initial=0.0))

    def size(self, a: int) -> float:
        """Return the largest diameter in class a [length]."""
        return float(self._largest[a])

    @property
    def sizes(self) -> np.ndarray:
        """The largest diameter of each component's class, (n,) [length]."""
        return self._largest[self._class]

    def part(self, members: np.ndarray) -> Contacts:
        """Return the contacts of some of the components."""
        species = None if self._species is None else self._species[members]
        return Contacts(self.diameters[members], species, self._matrix)
