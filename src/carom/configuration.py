"""All particles at one time as arrays: what files, drawings and other programs need of a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

MOST_DIMENSIONS = 12
"""The most dimensions: D_n has 2^(d-1) points a cell, and every sphere 3^d sectors around it."""

MOST_SPECIES = 1000
"""The most species: the engine keeps a table of every pair of them."""


@dataclass(frozen=True, eq=False, repr=False)
class Configuration:
    """The fields of a :class:`carom.Frame`, which says what they are."""

    time: float
    step: int
    positions: np.ndarray
    velocities: np.ndarray
    box: Any  # given as any sequence of edges, kept as an array
    diameters: np.ndarray
    masses: np.ndarray
    images: np.ndarray | None = None
    species: np.ndarray | None = None
    species_names: tuple[str, ...] = ()
    periodic: tuple[bool, ...] = ()
    spins: np.ndarray | None = None
    tilt: float | None = None
    lacks: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        box = np.array(self.box, dtype=np.float64)
        box.setflags(write=False)
        object.__setattr__(self, "box", box)
        if not self.periodic:
            object.__setattr__(self, "periodic", (True,) * len(self.box))

    @property
    def n(self) -> int:
        """Number of particles."""
        return self.positions.shape[0]

    @property
    def dimension(self) -> int:
        """Number of dimensions, d."""
        return self.positions.shape[1]

    @property
    def unwrapped(self) -> np.ndarray:
        """Positions (n, d) without wrapping: ``positions + images * box``.

        Raises
        ------
        ValueError
            If this frame holds no images.
        """
        if self.images is None:
            raise ValueError("This frame holds no image counts; sample with carom.Tuning(images=True).")
        moved = self.positions + self.images * self.box
        if self.tilt:
            moved[:, 0] += self.tilt * self.images[:, 1] * self.box[1]
        return moved
