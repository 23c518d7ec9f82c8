"""The static structure factor at the wave vectors of the box: an observable of frames."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.figures import curves
from carom.figures.palette import INK
from carom.frame import Frame
from carom.geometry.overlaps import geometry_of_frame
from carom.observables.analysis.waves import Waves
from carom.observables.of_frames import OfFrames, species_pair
from carom.observables.statistics import arrays, blocking, shown
from carom.results import Result
from carom.suggestions import corrected
from carom.texts import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SAME = 1e-6  # change of the tilt of a box up to which it is that of rounded files

SHELLS = 32  # lengths of wave vectors where neither ``shells`` nor ``kmax`` is given


@corrected()
@dataclass
class StructureFactor(OfFrames):
    """S(k) at the wave vectors of a periodic box: an observable of frames.

    Give it to :meth:`carom.Simulation.measure`, or frames or a path to :meth:`over`.

    Parameters
    ----------
    shells : int, optional
        Number of lengths of wave vectors, from the shortest that the box allows; 32 by default.
    kmax : float, optional
        Alternatively, the largest length of a wave vector [1 / length].
    pair : two ints or strs, optional
        Names or numbers of two species, which may be the same, for the partial S_ab(k).

    Raises
    ------
    InputError
        If both ``shells`` and ``kmax`` are given. From :meth:`add`, if an axis has walls, a species is
        unknown, or frames differ in n or in the tilt of the box. From :meth:`result`, before any frame.
        From :meth:`begin`, if the scene has obstacles.

    Notes
    -----
    ``S(k) = <|rho(k)|^2> / n`` with ``rho(k) = sum exp(i k.r)``, averaged over all wave vectors of a length.
    For two species it is ``<rho_a(k) rho_b(-k)> / sqrt(n_a n_b)`` (N. W. Ashcroft and D. C. Langreth, Phys.
    Rev. 156, 685 (1967)): in an ideal gas 1 for a = b, and else 0. Where the box changes, the waves are those
    of each frame, as many along each axis, and k is their mean length. The cost is one sine and cosine for
    each particle, axis and harmonic, and a product for each particle and wave vector.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.crystal(108, 0.3), seed=1)
    >>> found = sim.measure(StructureFactor(shells=4), time=16.0, blocks=64)
    >>> bool(found.S[0] < 0.5)
    True
    """

    shells: int | None = None
    kmax: float | None = None
    pair: tuple[int | str, int | str] | None = None

    _what = "S(k)"
    _uniform = True

    def __post_init__(self) -> None:
        if self.shells is not None and self.kmax is not None:
            raise InputError("shells and kmax each say which wave vectors are measured; give one of them.")
        if self.shells is not None:
            checks.integer(self.shells, "shells", low=1)
        if self.kmax is not None:
            checks.number(self.kmax, "kmax", low=0.0, open_low=True)

    def _begin(self, first: Frame) -> None:
        tilt = geometry_of_frame(first).tilt
        if self.kmax is None:
            self._waves = Waves.of(first.box, SHELLS if self.shells is None else self.shells, tilt)
        else:
            self._waves = Waves.within(first.box, self.kmax, tilt)
        self._chosen = None if self.pair is None else species_pair(first, self.pair)

    def _of(self, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
        """Return S at the wave vectors of the frame, and their lengths over those of the first frame."""
        room, waves = geometry_of_frame(frame), self._waves.in_box(frame.box)
        turned = room.tilt - waves.tilt
        if turned and abs(math.remainder(turned, frame.box[0] / frame.box[1])) > SAME:
            raise InputError(
                f"A frame has tilt {room.tilt:g}, the first one {waves.tilt:g}, and wave vectors turn with "
                "the strain; measure S(k) of frames of one tilt."
            )
        positions = room.along(frame.positions)
        if self._chosen is None:
            rho = waves.density(positions)
            square, weight = np.sum(rho * rho, axis=1), float(frame.n)
        else:
            parts = [positions[frame.species == k] for k in self._chosen]
            a = waves.density(parts[0])
            b = a if self._chosen[0] == self._chosen[1] else waves.density(parts[1])
            square, weight = np.sum(a * b, axis=1), math.sqrt(len(parts[0]) * len(parts[1]))
        return waves.average(square) / weight, waves.lengths / self._waves.lengths

    def _found(self) -> StructureFactorResult:
        found, longer = zip(*self._samples, strict=True)
        values, errors = arrays([blocking(column) for column in np.transpose(found)])
        return StructureFactorResult(
            self._waves.lengths * np.mean(longer, axis=0), values, errors, np.bincount(self._waves.shell),
            self._first.n, self._first.dimension, len(self._samples), self._chosen,
        )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class StructureFactorResult(Result):
    """The static structure factor.

    Attributes
    ----------
    k : (s,) array
        Lengths of the wave vectors [1 / length].
    S, error : (s,) arrays
        S(k) and its standard error.
    vectors : (s,) int64 array
        Number of wave vectors of each length, k and -k counted once.
    n, dimension, frames : int
        Number of particles, of dimensions and of frames.
    pair : (int, int) or None
        The two species; None if all particles are counted.
    """

    k: np.ndarray
    S: np.ndarray
    error: np.ndarray
    vectors: np.ndarray
    n: int
    dimension: int
    frames: int
    pair: tuple[int, int] | None = None

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            (f"S at k = {self.k[at]:.4g} [1 / length]", shown(self.S, self.error, at))
            for at in sorted({0, int(np.argmax(self.S))})
        ]
        seen = counted(self.k.size, "wave number"), counted(self.frames, "frame")
        return f"S(k) of {counted(self.n, 'particle')}, {', '.join(seen)}", rows

    def _draw_into(self, axes: Axes) -> None:
        curves.level(axes, 1.0)
        errors = curves.known(self.error)
        axes.errorbar(self.k, self.S, errors, fmt=".-", color=INK, linewidth=0.9, markersize=4)
        axes.set_xlim(left=0.0)
        axes.set(xlabel="wave number k", ylabel="structure factor S(k)")

    def _columns(self) -> dict[str, Any]:
        return {"k": self.k, "S": self.S, "error": self.error, "vectors": self.vectors}
