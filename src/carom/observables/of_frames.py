"""The base of observables of frames: what one frame adds, and the result of all."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.frame import Frame
from carom.observables.statistics import unwarned

if TYPE_CHECKING:
    from carom.scene.scene import Scene


class OfFrames:
    """Base of a dataclass with ``_of(frame)``, what a frame adds, and ``_found()``, what ``_samples`` give.

    ``_begin(first)`` is called once. Class attributes say which frames fit.
    """

    _what: ClassVar[str] = ""
    """Name of the quantity in messages."""
    _uniform: ClassVar[bool] = False
    """Whether it is that of a fluid which is the same everywhere: without walls and obstacles."""
    _same: ClassVar[tuple[str, ...]] = ("n", "dimension")
    """What all frames share with the first; each is measured in its own box."""

    _first: Any = None
    _samples: Any = ()

    @property
    def _upright(self) -> str:
        """Why boxes must have right angles; empty where sheared ones are measured as well."""
        return ""

    def fresh(self) -> Self:
        """Return the same observable without any frame, so that one object serves several measurements."""
        return replace(self)  # type: ignore[type-var]

    def begin(self, scene: Scene) -> None:
        """Refuse a scene with obstacles, which frames do not show, where they matter."""
        if self._uniform and scene.obstacles:
            raise InputError(
                f"The scene has {len(scene.obstacles)} obstacles; {self._what} is that of a fluid which is "
                "the same everywhere."
            )

    def add(self, frame: Frame) -> None:
        """Add the next frame."""
        if frame.tilt is not None and self._upright:
            raise InputError(
                f"{type(self).__name__} is for boxes with right angles, and this one is sheared: "
                f"{self._upright}."
            )
        if self._uniform and not all(frame.periodic):
            raise InputError(
                f"Axis {list(frame.periodic).index(False)} of the box has walls; {self._what} is that of a "
                "fluid which is the same everywhere, in a box with periodic axes only."
            )
        if self._first is None:
            self._begin(frame)
            self._first, self._samples = frame, []
        for name in self._same:
            ours, first = (getattr(each, name) for each in (frame, self._first))
            if not np.array_equal(ours, first):
                found = f"{name} {ours!r}, the first one {first!r}" if np.isscalar(ours) else f"other {name}"
                raise InputError(f"A frame has {found}; {self._what} is that of the same system.")
        self._samples.append(self._of(frame))

    def result(self) -> Any:
        """Return what was measured so far, with error bars from blocking over the frames.

        Raises
        ------
        InputError
            If there is no frame, or too few.
        """
        if not self._samples:
            raise InputError(f"No frame was given, and that is too few for a result: {self._what}.")
        with unwarned():  # few frames have wide error bars
            return self._found()

    def _begin(self, first: Frame) -> None:
        """Choose by the first frame what is measured."""

    def _of(self, frame: Frame) -> Any:
        raise NotImplementedError

    def _found(self) -> Any:
        raise NotImplementedError

    def over(self, frames: Iterable[Frame] | str | os.PathLike[str]) -> Any:
        """Return the result of all frames of a sequence, a file or a run.

        Parameters
        ----------
        frames : iterable of Frame, or path
            Frames in order, read once, one at a time: a list, ``sim.sample(...)``, an open trajectory, the
            path of a trajectory file, or of the folder of a run.

        Raises
        ------
        InputError
            If these are no frames, and as from ``add`` and ``result``.
        FileError
            If a file cannot be read.
        """
        mine: Any = self.fresh()
        if isinstance(frames, str | os.PathLike):
            from carom.io.trajectory import open_reader

            opened: Any = open_reader(frames)
        elif isinstance(frames, Frame) or not isinstance(frames, Iterable):
            raise InputError(
                f"frames must be a list or an iterator of frames, or a path, found {checks.describe(frames)}."
            )
        else:
            opened = contextlib.nullcontext(frames)
        with opened as several:
            for frame in several:
                if not isinstance(frame, Frame):
                    raise InputError(f"frames must hold frames, found {checks.describe(frame)}.")
                mine.add(as_points(frame))
        return mine.result()


def as_points(frame: Frame) -> Frame:
    """Return a frame in which particles whose diameters nobody knows are points."""
    return replace(frame, diameters=np.zeros(frame.n)) if "diameters" in frame.lacks else frame


def of_species(frame: Frame, species: int | None) -> np.ndarray:
    """Return which particles (n,) are of a species; all if it is None."""
    if species is None:
        return np.ones(frame.n, bool)
    if frame.species is None or not (frame.species == species).any():
        raise InputError(f"species is {species}, and the frame has none of them.")
    return np.asarray(frame.species == species)


def species_pair(frame: Frame, pair: tuple[int | str, int | str]) -> tuple[int, int]:
    """Return the numbers of two species of a frame, given by names or numbers."""
    if frame.species is None:
        raise InputError("pair is given, and the frames have no species; leave it out.")
    if not isinstance(pair, tuple | list) or len(pair) != 2:
        raise InputError(f"pair is {pair!r}; expected two species, such as (0, 1).")
    count = max(int(frame.species.max()) + 1, len(frame.species_names))
    found = []
    for which in pair:
        k = frame.species_names.index(which) if which in frame.species_names else which
        k = int(k) if isinstance(k, str) and k.isdecimal() else k
        if isinstance(k, bool) or not isinstance(k, int | np.integer) or not 0 <= k < count:
            known = ", ".join(frame.species_names) or f"0 to {count - 1}"
            raise InputError(f"There is no species {which!r}; known are {known}.")
        found.append(int(k))
    if count_pairs(frame, (found[0], found[1])) == 0:
        raise InputError(f"There are too few components of species {found[0]} and {found[1]} for any pair.")
    return found[0], found[1]


def count_pairs(frame: Frame, pair: tuple[int, int] | None) -> float:
    """Return the number of pairs of all particles, or of two species."""
    if pair is None:
        return 0.5 * frame.n * (frame.n - 1)
    a, b = (int(np.count_nonzero(frame.species == k)) for k in pair)
    return 0.5 * a * (a - 1) if pair[0] == pair[1] else float(a * b)
