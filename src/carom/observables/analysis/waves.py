"""Wave vectors of a periodic box, and the density at them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from carom.arithmetic import cosine_and_sine
from carom.errors import InputError

MOST = 10_000_000  # wave vectors at most

PORTION = 2**20  # products of particles and wave vectors at a time, so that memory stays small


@dataclass(frozen=True, eq=False)
class Waves:
    """Wave vectors that fit a periodic box, in s shells of one length each."""

    numbers: np.ndarray  # (m, d) int, waves along each axis; only one of q and -q
    shell: np.ndarray  # (m,) int, index of the length
    lengths: np.ndarray  # (s,) [1 / length]
    box: np.ndarray  # (d,) [length]
    tilt: float = 0.0  # of the box, as in carom.Frame

    @classmethod
    def of(cls, box: tuple[float, ...], shells: int, tilt: float = 0.0) -> Waves:
        """Return the wave vectors of the shortest lengths."""
        edges = np.asarray(box)
        most = 1
        while True:
            reach = 2.0 * math.pi * most / edges.max()
            numbers, lengths, found = _up_to(edges, reach, tilt)
            if len(found) >= shells:
                return cls._shells(numbers, lengths, found[:shells], edges, tilt)
            most += 1

    @classmethod
    def within(cls, box: tuple[float, ...], kmax: float, tilt: float = 0.0) -> Waves:
        """Return the wave vectors up to the length ``kmax`` [1 / length]."""
        edges = np.asarray(box)
        shortest = cls.of(box, 1, tilt).lengths[0]
        if kmax * (1.0 + 1e-9) < shortest:
            raise InputError(
                f"kmax is {kmax:.6g}, below the shortest wave vector of the box, {shortest:.6g}."
            )
        if np.prod(kmax * edges / math.pi + 1.0) > MOST:
            raise InputError(
                f"There are more than {MOST} wave vectors up to kmax = {kmax:.6g}; take a shorter one."
            )
        return cls._shells(*_up_to(edges, kmax, tilt), edges, tilt)

    @classmethod
    def _shells(
        cls, numbers: np.ndarray, lengths: np.ndarray, kept: np.ndarray, edges: np.ndarray, tilt: float
    ) -> Waves:
        near = np.searchsorted(kept, lengths * (1.0 - 1e-8))
        chosen = lengths <= kept[-1] * (1.0 + 1e-8)
        return cls(numbers[chosen], near[chosen], kept, edges, tilt)

    def in_box(self, box: np.ndarray) -> Waves:
        """Return as many waves along each axis of another box, in the same shells of a mean length."""
        if np.array_equal(box, self.box):
            return self
        own, ours = (self.average(_lengths(self.numbers, b, self.tilt)) for b in (box, self.box))
        return replace(self, lengths=self.lengths * (own / ours), box=box)

    def density(self, positions: np.ndarray) -> np.ndarray:
        """Return the parts of ``sum exp(i q.r)``, real and imaginary, (m, 2).

        In a tilted box, positions (n, d) are along its axes (``Geometry.along``).
        """
        most = int(np.abs(self.numbers).max())
        turns = np.arange(-most, most + 1)[:, None, None] * (positions / self.box)
        cosines, sines = cosine_and_sine(turns)
        step = max(PORTION // max(len(positions), 1), 1)
        parts = []
        for at in range(0, len(self.numbers), step):
            real, imaginary = np.ones(1), np.zeros(1)
            for axis in range(positions.shape[1]):
                which = self.numbers[at : at + step, axis] + most
                c, s = cosines[which, :, axis], sines[which, :, axis]
                real, imaginary = real * c - imaginary * s, real * s + imaginary * c
            parts.append(np.stack([np.sum(real, axis=1), np.sum(imaginary, axis=1)], axis=1))
        return np.concatenate(parts)

    def average(self, values: np.ndarray) -> np.ndarray:
        """Return the mean over each shell, (s,)."""
        return np.bincount(self.shell, values) / np.bincount(self.shell)


def _up_to(edges: np.ndarray, reach: float, tilt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return numbers of waves (m, d), lengths (m,), and each length up to ``reach`` once."""
    most = reach * edges / (2.0 * math.pi)
    if tilt:
        most[1] += abs(tilt) * edges[1] / edges[0] * most[0]
    ranges = [np.arange(-k, k + 1) for k in np.floor(most + 0.5).astype(int)]
    numbers = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, len(edges))
    numbers = numbers[len(numbers) // 2 + 1 :]  # only one of q and -q, without q = 0
    lengths = _lengths(numbers, edges, tilt)
    found = np.unique(np.round(lengths / lengths.min(), 9)) * lengths.min()
    return numbers, lengths, found[found <= reach * (1.0 + 1e-9)]


def _lengths(numbers: np.ndarray, edges: np.ndarray, tilt: float) -> np.ndarray:
    """Return the lengths (m,) of wave vectors [1 / length]."""
    vectors = numbers / edges
    if tilt:
        vectors[:, 1] -= tilt * vectors[:, 0]
    return np.asarray(2.0 * math.pi * np.sqrt(np.sum(vectors**2, axis=1)))
