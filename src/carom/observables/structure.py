"""Structure during a run: the density along an axis, an observable of frames."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np

from carom import checks
from carom.errors import CaromWarning, InputError
from carom.frame import Frame
from carom.observables.statistics import Estimate, blocking


@dataclass
class DensityProfile:
    """Number density along an axis, for :meth:`carom.Simulation.measure` or frames of a file.

    Parameters
    ----------
    axis : int
        Number of the axis, from 0.
    bins : int
        Slabs of equal width from 0 to the edge of the box.
    species : int, optional
        Species to measure; by default all components.
    blocks : int
        Number of frames that ``measure`` takes.

    Raises
    ------
    InputError
        From :meth:`update`, if there is no such axis, or the frame has no species or not this one; from
        :meth:`result`, before any frame.
    """

    axis: int = 0
    bins: int = 64
    species: int | None = None
    blocks: int = 256
    _counts: list[np.ndarray] = field(default_factory=list, init=False, repr=False)
    _edges: np.ndarray = field(default_factory=lambda: np.zeros(0), init=False, repr=False)
    _slab: float = field(default=0.0, init=False, repr=False)

    def __post_init__(self) -> None:
        checks.integer(self.axis, "axis", low=0)
        checks.integer(self.bins, "bins", low=1)
        checks.integer(self.blocks, "blocks", low=2)

    def update(self, frame: Frame) -> None:
        """Add the next frame."""
        if self.axis >= frame.dimension:
            raise InputError(f"axis is {self.axis}, and a frame has axes 0 to {frame.dimension - 1}.")
        x = frame.positions[:, self.axis]
        if self.species is not None:
            if frame.species is None:
                raise InputError(f"species is {self.species}, and the frame has none.")
            known = sorted({*range(len(frame.species_names)), *np.unique(frame.species).tolist()})
            if self.species not in known:
                raise InputError(f"species is {self.species}; known are {', '.join(map(str, known))}.")
            x = x[frame.species == self.species]
        edge = frame.box[self.axis]
        if not self._counts:
            self._edges = np.linspace(0.0, edge, self.bins + 1)
            self._slab = float(np.prod(frame.box)) / self.bins
        self._counts.append(np.histogram(x, self._edges)[0] / self._slab)

    def result(self) -> ProfileEstimate:
        """Return the profile so far, with error bars from blocking over the frames."""
        if not self._counts:
            raise InputError("No frame was given yet, so there is no profile.")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CaromWarning)  # few frames have wide error bars
            density = [blocking(column) for column in np.transpose(self._counts)]
        return ProfileEstimate(self._edges, density)


@dataclass(frozen=True, eq=False)
class ProfileEstimate:
    """Number density in slabs.

    Attributes
    ----------
    edges : (b + 1,) array
        Edges of the slabs [length].
    density : list of Estimate
        Number density in each slab [1 / length^d].
    """

    edges: np.ndarray
    density: list[Estimate]

    @property
    def middle(self) -> np.ndarray:
        """Middle of each slab, (b,) [length]."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])
