"""The static structure factor at the wave vectors of the box: an observable of frames."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import CaromWarning, InputError
from carom.frame import Frame
from carom.observables.of_frames import OfFrames, refuse_tilted
from carom.observables.rdf import species_pair
from carom.observables.statistics import arrays, blocking, shown
from carom.observables.waves import Waves
from carom.results import Result

if TYPE_CHECKING:
    from carom.scene.scene import Scene

SHELLS = 32
"""Lengths of wave vectors where neither ``shells`` nor ``kmax`` is given."""


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
        If both ``shells`` and ``kmax`` are given. From :meth:`update`, if an axis has walls, a species is
        unknown, or frames differ in n or box. From :meth:`result`, before any frame. From :meth:`prepare`, if
        the scene has obstacles.

    Notes
    -----
    ``S(k) = <|rho(k)|^2> / n`` with ``rho(k) = sum exp(i k.r)``, averaged over all wave vectors of a length.
    For two species it is ``<rho_a(k) rho_b(-k)> / sqrt(n_a n_b)`` (N. W. Ashcroft and D. C. Langreth, Phys.
    Rev. 156, 685 (1967)): in an ideal gas 1 for a = b, and else 0. The cost is one sine and cosine for each
    particle, axis and harmonic, and a product for each particle and wave vector.

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
    _waves: Waves | None = field(default=None, init=False, repr=False)
    _first: Frame | None = field(default=None, init=False, repr=False)
    _chosen: tuple[int, int] | None = field(default=None, init=False, repr=False)
    _rows: list[np.ndarray] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        if self.shells is not None and self.kmax is not None:
            raise InputError("shells and kmax each say which wave vectors are measured; give one of them.")
        if self.shells is not None:
            checks.integer(self.shells, "shells", low=1)
        if self.kmax is not None:
            checks.number(self.kmax, "kmax", low=0.0, open_low=True)

    def prepare(self, scene: Scene) -> None:
        """Refuse a scene with obstacles, which frames do not show: ``measure`` calls this first."""
        if scene.obstacles:
            raise InputError(
                f"The scene has {len(scene.obstacles)} obstacles; S(k) is that of a fluid which is the same "
                "everywhere."
            )

    def update(self, frame: Frame) -> None:
        """Add the next frame."""
        refuse_tilted(frame, "StructureFactor")
        waves = self._begin(frame) if self._waves is None else self._waves
        assert self._first is not None
        if frame.n != self._first.n or tuple(frame.box) != tuple(self._first.box):
            raise InputError(
                f"A frame has n = {frame.n} and box {frame.box.tolist()}, the first n = {self._first.n} and "
                f"box {self._first.box.tolist()}; S(k) averages frames of the same system."
            )
        if self._chosen is None:
            rho = waves.density(frame.positions)
            square, weight = np.sum(rho * rho, axis=1), float(frame.n)
        else:
            parts = [frame.positions[frame.species == k] for k in self._chosen]
            a = waves.density(parts[0])
            b = a if self._chosen[0] == self._chosen[1] else waves.density(parts[1])
            square, weight = np.sum(a * b, axis=1), math.sqrt(len(parts[0]) * len(parts[1]))
        self._rows.append(waves.average(square) / weight)

    def _begin(self, frame: Frame) -> Waves:
        if not all(frame.periodic):
            raise InputError(
                f"Axis {list(frame.periodic).index(False)} of the box has walls; S(k) is that of a fluid "
                "which is the same everywhere, in a box with periodic axes only."
            )
        if self.kmax is None:
            self._waves = Waves.of(frame.box, SHELLS if self.shells is None else self.shells)
        else:
            self._waves = Waves.within(frame.box, self.kmax)
        self._chosen = None if self.pair is None else species_pair(frame, self.pair)
        self._first = frame
        return self._waves

    def result(self) -> StructureFactorResult:
        """Return S(k) of all frames so far, with error bars from blocking over the frames."""
        if self._waves is None or self._first is None:
            raise InputError("No frame was given yet, so there is no S(k).")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CaromWarning)  # few frames have wide error bars
            values, errors = arrays([blocking(column) for column in np.transpose(self._rows)])
        return StructureFactorResult(
            self._waves.lengths, values, errors, np.bincount(self._waves.shell), self._first.n,
            self._first.dimension, len(self._rows), self._chosen,
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
        return f"S(k) of {self.n} particles, {self.k.size} wave numbers, {self.frames} frames", rows

    def _columns(self) -> dict[str, Any]:
        return {"k": self.k, "S": self.S, "error": self.error, "vectors": self.vectors}
