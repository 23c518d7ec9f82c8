"""What observables of frames share: they are values, and go over frames of a run or of a file."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Iterable
from typing import Any, Self

from carom import checks
from carom.errors import InputError
from carom.frame import Frame


class OfFrames:
    """Base of a dataclass with ``update(frame)`` and ``result()``."""

    def fresh(self) -> Self:
        """Return the same observable without any frame, so that one object serves several measurements."""
        return dataclasses.replace(self)  # type: ignore[type-var]

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
            If these are no frames, and as from ``update`` and ``result``.
        FileError
            If a file cannot be read.
        """
        mine: Any = self.fresh()
        if isinstance(frames, str | os.PathLike):
            from carom.io.places import open_frames

            opened: Any = open_frames(frames)
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
                mine.update(frame)
        return mine.result()


def refuse_other_box(frame: Frame, first: tuple[float, ...], what: str) -> None:
    """Raise InputError if the box of a ``frame`` is not that of the first one, as ``what`` needs."""
    if tuple(frame.box) != first:
        raise InputError(
            f"A frame has the box {list(map(float, frame.box))}, the first {list(map(float, first))}; {what} "
            "is for a box that does not change."
        )


def refuse_tilted(frame: Frame, what: str) -> None:
    """Raise InputError if a ``frame`` is of a sheared box, as ``what`` needs right angles."""
    if frame.tilt is not None:
        raise InputError(
            f"{what} is for boxes with right angles, and this one is sheared: measure carom.RDF() or "
            "carom.PressureTensor()."
        )
