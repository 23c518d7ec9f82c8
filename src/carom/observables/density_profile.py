"""The number density along an axis: an observable of frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.figures import curves
from carom.figures.palette import INK
from carom.frame import Frame
from carom.observables.of_frames import OfFrames
from carom.observables.statistics import arrays, blocking, shown
from carom.results import Binned
from carom.suggestions import corrected
from carom.texts import axis_name, counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@corrected()
@dataclass
class DensityProfile(OfFrames):
    """Number density along an axis: an observable of frames.

    Give it to :meth:`carom.Simulation.measure`, or frames or a path to :meth:`over`.

    Parameters
    ----------
    axis : int or str
        Number of the axis, from 0, or x, y or z.
    bins : int
        Slabs of equal width from 0 to the edge of the box.
    species : int, optional
        Species to measure; by default all particles.

    Raises
    ------
    InputError
        From :meth:`add`, if there is no such axis, the frame has no species or not this one, or frames differ
        in n; from :meth:`result`, before any frame.

    Notes
    -----
    Where the box changes, each frame has slabs of its own, and their edges are the mean ones.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(64, 0.3, 2, walls="y"))
    >>> profile = sim.measure(DensityProfile(axis=1, bins=40), collisions_per_particle=50)
    >>> bool(profile.density[0] == 0.0)  # no center is nearer to a wall than half a diameter
    True
    """

    axis: Any = 0  # a number, or x, y or z
    bins: int = 64
    species: int | None = None

    _what = "number density"

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", checks.axis(self.axis))
        checks.integer(self.bins, "bins", low=1)

    @property
    def _upright(self) -> str:
        return "" if self.axis else "slabs across the flow are tilted with it; take another axis"

    def _begin(self, first: Frame) -> None:
        if self.axis >= first.dimension:
            raise InputError(f"axis is {self.axis}, and a frame has axes 0 to {first.dimension - 1}.")

    def _of(self, frame: Frame) -> tuple[np.ndarray, float]:
        """Return the density in the slabs of the frame, and the length of its axis over the first one."""
        x = frame.positions[:, self.axis]
        if self.species is not None:
            if frame.species is None:
                raise InputError(f"species is {self.species}, and the frame has none.")
            known = sorted({*range(len(frame.species_names)), *np.unique(frame.species).tolist()})
            if self.species not in known:
                raise InputError(f"species is {self.species}; known are {', '.join(map(str, known))}.")
            x = x[frame.species == self.species]
        edges = np.linspace(0.0, frame.box[self.axis], self.bins + 1)
        longer = float(frame.box[self.axis] / self._first.box[self.axis])
        return np.histogram(x, edges)[0] / (float(np.prod(frame.box)) / self.bins), longer

    def _found(self) -> DensityProfileResult:
        found, longer = zip(*self._samples, strict=True)
        density, error = arrays([blocking(column) for column in np.transpose(found)])
        edges = np.linspace(0.0, self._first.box[self.axis], self.bins + 1) * float(np.mean(longer))
        return DensityProfileResult(edges, density, error, self.axis, len(found))


@dataclass(frozen=True, eq=False, repr=False)
class DensityProfileResult(Binned):
    """Number density in slabs.

    Attributes
    ----------
    edges : (b + 1,) array
        Edges of the slabs [length].
    density, error : (b,) arrays
        Number density in each slab and its standard error [1 / length^d].
    axis : int
        Number of the axis.
    frames : int
        Number of frames.
    """

    edges: np.ndarray
    density: np.ndarray
    error: np.ndarray
    axis: int
    frames: int

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("slabs", str(self.density.size)),
            ("lowest", shown(self.density, self.error, int(np.argmin(self.density)))),
            ("highest", shown(self.density, self.error, int(np.argmax(self.density)))),
        ]
        frames = counted(self.frames, "frame")
        return f"Number density along {axis_name(self.axis)} [1 / length^d], {frames}", rows

    def _draw_into(self, axes: Axes) -> None:
        axes.stairs(self.density, self.edges, color=INK, linewidth=1.2)
        errors = curves.known(self.error)
        axes.errorbar(self.middle, self.density, errors, fmt="none", color=INK, linewidth=0.9)
        axes.set_ylim(bottom=0.0)
        axes.set(xlabel=axis_name(self.axis), ylabel="number density")

    def _columns(self) -> dict[str, Any]:
        return {**self._bins(), "density": self.density, "error": self.error}
