"""g(r) as a value: a histogram of pair distances, with error bars."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.observables.statistics import Estimate, shown
from carom.results import Result
from carom.texts import counted

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False, repr=False)
class RDFResult(Result):
    """A histogram of pair distances, normalised to 1 for an ideal gas of the same n particles.

    Parameters
    ----------
    edges : (m + 1,) float64 array
        Edges of the bins [length]; the first is exactly the diameter.
    g, error : (m,) float64 arrays
        g(r) averaged over each shell, and its standard error: by blocking over 16 frames or more, otherwise
        that of independent pairs. A bin without any pair has the error of one pair.
    counts : (m,) int64 array
        Pairs seen in all frames.
    n, dimension, frames : int
        Number of particles, of dimensions and of frames.
    diameter : float
        Distance at contact [length]; for two species the distance at which they touch.
    packing_fraction : float
        Packing fraction of all particles together.
    contact_value : Estimate or None
        g(sigma+), extrapolated (see :func:`carom.observables.contact.contact_value`); None if no bin begins
        at contact.
    pair : (int, int) or None
        The species of the two particles; None if all particles are counted.
    neighbors, neighbors_error : (m,) float64 arrays or None
        Running coordination numbers and their errors, which :meth:`coordination` returns.
    """

    edges: np.ndarray
    g: np.ndarray
    error: np.ndarray
    counts: np.ndarray
    n: int
    dimension: int
    frames: int
    diameter: float
    packing_fraction: float
    contact_value: Estimate | None = None
    pair: tuple[int, int] | None = None
    neighbors: np.ndarray | None = None
    neighbors_error: np.ndarray | None = None

    @property
    def r(self) -> np.ndarray:
        """Centers of the bins (m,) [length]."""
        return 0.5 * (self.edges[:-1] + self.edges[1:])

    def coordination(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean number of neighbors up to the upper edge of each bin, and its error, (m,) each.

        For two species it is the number of neighbors of the second one around a particle of the first.
        Errors are by blocking over 16 frames or more, otherwise those of independent pairs.

        Raises
        ------
        InputError
            If the distribution was made by MDAnalysis, which does not count frame by frame.
        """
        if self.neighbors is None or self.neighbors_error is None:
            raise InputError("Running coordination numbers need each frame by itself: RDF().over(frames).")
        return self.neighbors, self.neighbors_error

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        peak = int(np.argmax(self.g))
        rows = [
            ("frames", str(self.frames)),
            ("bins", f"{self.g.size}, r = {self.edges[0]:.6g} to {self.edges[-1]:.6g} [length]"),
            ("highest g", f"{shown(self.g, self.error, peak)} at r = {self.r[peak]:.4g}"),
        ]
        if self.contact_value is not None:
            rows.append(("g(σ+)", self.contact_value.value_text))
        return f"g(r) of {counted(self.n, 'particle')} at packing fraction {self.packing_fraction:.6g}", rows

    def __str__(self) -> str:
        contact = "" if self.contact_value is None else f"; contact value {self.contact_value.value_text}"
        return (
            f"g(r) in {self.g.size} bins from {self.edges[0]:.6g} to {self.edges[-1]:.6g} [length], "
            f"{counted(self.frames, 'frame')}{contact}"
        )

    def _columns(self) -> dict[str, Any]:
        return {
            "r_lo": self.edges[:-1], "r_hi": self.edges[1:], "g": self.g, "error": self.error,
            "counts": self.counts,
        }  # fmt: skip

    def to_dataframe(self) -> pandas.DataFrame:
        """Return r, the edges of each bin, g, its error and the counts as a pandas DataFrame.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        found = super().to_dataframe()
        found.insert(0, "r", self.r)
        return found
