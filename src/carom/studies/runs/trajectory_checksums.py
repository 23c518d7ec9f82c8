"""Checksums of the trajectories of a run, to verify them when the run continues.

They are a CRC-32 of the text of an extended XYZ, or of the numbers in H5MD and GSD as their readers return
them; a checkpoint verifies itself by SHA-256. All trajectories hold the same frames, so that a damaged one is
restored from another, unless that is GSD, which rounds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from carom.errors import FileError
from carom.frame import Frame
from carom.io import checksums
from carom.io.trajectory import open_reader
from carom.studies.runs.folder import RunFolder
from carom.texts import typed

LOSSLESS = ("h5md", "extxyz")
"""Formats from which another can be restored."""


class Written:
    """Checksums of the trajectories of a run, by ``formats``, up to the present.

    ``notes`` is what :meth:`notes` returned when the checkpoint was written; without, there is no frame yet.
    """

    def __init__(
        self, folder: RunFolder, formats: Sequence[str], notes: Mapping[str, Sequence[int]] | None = None
    ):
        self._folder = folder
        self._sums: dict[str, tuple[int, int]] = {
            form: (0, 0) if notes is None else (notes[form][0], notes[form][1]) for form in formats
        }

    def notes(self) -> dict[str, tuple[int, int]]:
        """Return length of the text [bytes] and checksum by format, for the checkpoint."""
        return dict(self._sums)

    def add(self, frame: Frame) -> None:
        """Add a frame that every trajectory has just received."""
        for form, (size, before) in self._sums.items():
            if form == "extxyz":
                path = self._folder.trajectory(form)
                end = path.stat().st_size
                self._sums[form] = end, checksums.of_bytes(path, size, end, before)
            else:
                self._sums[form] = 0, checksums.of_frame(_as_held(frame, form), before)

    def sources(self, keep: int, report: Callable[[float], object]) -> dict[str, str]:
        """Return the damaged trajectories, and for each the one to restore it from; no file is changed.

        ``keep`` frames were written up to the checkpoint; ``report`` gets the verified fraction.
        """
        if keep == 0:
            return {}
        damage = {}
        for k, form in enumerate(self._sums):
            report(k / len(self._sums))
            if problem := self._damage(form, keep):
                damage[form] = problem
        intact = [form for form in LOSSLESS if form in self._sums and form not in damage]
        if damage and not intact:
            raise FileError(
                f"{'; '.join(damage.values())}; no other trajectory holds the frames with all digits, so the "
                "run cannot go on and was left as it is: restore one from a copy, or repeat the run, "
                f"`{typed('carom run', self._folder.scene)} --out` with another folder."
            )
        return {form: intact[0] for form in damage}  # noqa: C420  (where none is damaged, none may be intact)

    def _damage(self, form: str, keep: int) -> str | None:
        """Return a clause on the damage of a trajectory, or None."""
        path, (size, expected) = self._folder.trajectory(form), self._sums[form]
        try:
            if form == "extxyz":
                if not path.is_file() or path.stat().st_size < size:
                    return f"{path} is missing or cut short"
                found = checksums.of_bytes(path, 0, size)
            else:
                found = _sum_of_frames(path, keep)
        except (FileError, OSError) as error:
            return f"{path} is damaged ({str(error).rstrip('.')})"
        return None if found == expected else f"{path} is damaged: it does not hold what was written"


def _as_held(frame: Frame, form: str) -> Frame:
    """Return a frame as the reader of a format returns it."""
    if form != "gsd":
        return frame
    from carom.io.gsd import as_held

    return as_held(frame)


def _sum_of_frames(path: Path, keep: int) -> int:
    """Return the checksum of the first frames of a trajectory."""
    found = 0
    with open_reader(path, torn=True) as reader:
        if len(reader) < keep:
            raise FileError(f"it holds {len(reader)} complete frames of {keep}")
        for k in range(keep):
            found = checksums.of_frame(reader[k], found)
    return found
