"""All components at one time: what sampling yields, what files hold, what observables see."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import ase


@dataclass(frozen=True, eq=False)
class Frame:
    """A global state: the paper's projection of every component to one time.

    Parameters
    ----------
    time : float
        Time [sigma sqrt(m / kT)] since the start of the run.
    step : int
        Pair collisions realised since the start of the run.
    positions : (n, d) float64 array
        Centres [length], wrapped into ``0 <= x < edge``.
    velocities : (n, d) float64 array
        Velocities [length / time].
    box : tuple of d floats
        Edges of the periodic box [length].
    diameters, masses : (n,) float64 arrays
        Diameter [length] and mass of each component.
    images : (n, d) int32 array or None
        How often each component has left the box through the upper face, less through the lower.
    species : (n,) int64 array or None
        Which species each component is, from 0.
    species_names : tuple of str
        Their names, or ().
    periodic : tuple of d bools
        Which axes are; the others have walls at 0 and at the edge. All are where left out.
    """

    time: float
    step: int
    positions: np.ndarray
    velocities: np.ndarray
    box: tuple[float, ...]
    diameters: np.ndarray
    masses: np.ndarray
    images: np.ndarray | None = None
    species: np.ndarray | None = None
    species_names: tuple[str, ...] = ()
    periodic: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        if not self.periodic:
            object.__setattr__(self, "periodic", (True,) * len(self.box))

    @property
    def n(self) -> int:
        """Number of components."""
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
            raise ValueError("This frame holds no image counts; sample with Simulation(..., images=True).")
        return self.positions + self.images * np.asarray(self.box)

    def to_ase(self) -> ase.Atoms:
        """Return this frame as an ``ase.Atoms`` (see :func:`carom.io.ase.to_ase`)."""
        from carom.io.ase import to_ase

        return to_ase(self)
