"""What a file of another program holds at one time, before it becomes a Frame; and how its text is read."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

LONGEST = 1 << 24
"""Bytes of a line, at most: a file of zeros is one line that never ends."""

_BLOCK, _LINE = 1 << 18, 64  # bytes that are read at once, and of a usual line
_FEW = 500  # lines that are read one by one

PACKED = (".gz", ".bz2", ".xz")  # suffixes of compressed files, before which stands that of the format

UNENDED = "its last line has no newline, so that digits may be missing; add a newline if the line is whole"

_MAGIC: dict[bytes, Callable[[Path], Any]] = {
    b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ\0": lzma.open,
}  # fmt: skip


@dataclass
class RawFrame:
    """All particles at one time, as a file has them; what it lacks is None."""

    positions: np.ndarray  # (n, 1 to 3), centers [length], anywhere
    cell: np.ndarray | None = None  # (3, 3), edges of the box, a vector a row [length]
    origin: np.ndarray | None = None  # (3,), corner of the box [length]
    periodic: tuple[bool, ...] | None = None  # of 3 axes
    velocities: np.ndarray | None = None
    diameters: np.ndarray | None = None
    masses: np.ndarray | None = None
    images: np.ndarray | None = None
    kinds: np.ndarray | None = None  # (n,), what tells species apart: names or numbers
    ids: np.ndarray | None = None
    time: float | None = None
    step: float | None = None  # which stands for a time that is not there
    unwrapped: bool = False  # known never to be put back into the box
    dimension: int | None = None  # None where it follows from the coordinates
    dropped: tuple[str, ...] = ()  # what the file holds besides


class Source(ABC):
    """A file of another program: frames by number. Its constructor and ``read`` may raise anything."""

    units = ""
    """Unit of lengths that the format prescribes."""
    ordered = False
    """Whether particles without ids stand in the same order in every frame."""
    cut = ""
    """Why the file ends inside a frame, if it does: that one is none of its frames."""

    def __init__(self, path: Path):
        self.path = path

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def read(self, k: int) -> RawFrame:
        """Return frame ``0 <= k < len(self)``."""

    def close(self) -> None:  # noqa: B027  (many hold nothing open)
        """Close the file."""


def opened(path: Path) -> io.BufferedReader:
    """Open a text file for reading, compressed or not: its first bytes tell, whatever its name says."""
    with path.open("rb") as file:
        begin = file.read(6)
    packed = (opener(path) for magic, opener in _MAGIC.items() if begin.startswith(magic))
    return io.BufferedReader(next(packed, None) or path.open("rb", buffering=0), _BLOCK)


def text_of(path: Path) -> tuple[list[str], str]:
    """Return the lines of a text, and a last one without an end; comments may be in any encoding."""
    with opened(path) as file:
        text = file.read().decode("utf-8", "replace")
    lines = text.splitlines()
    return lines, lines.pop().rstrip() if text and text[-1] not in "\r\n" else ""


def line_of(file: IO[bytes]) -> bytes:
    """Return the next line."""
    line = file.readline(LONGEST)
    if len(line) == LONGEST:
        raise ValueError(f"a line is longer than {LONGEST} bytes")
    return line


def pass_lines(file: io.BufferedReader, count: int, end: bytes = b"") -> tuple[int, bytes]:
    """Go past lines, up to one that begins with ``end``; return how many, and a last one without an end."""
    passed = 0
    while passed < count:
        if count - passed > _FEW:  # of many lines the ends are counted
            block = file.peek()[: _LINE * (count - passed)]
            if end and block.startswith(end):
                break
            if end and (at := block.find(b"\n" + end)) >= 0:
                block = block[: at + 1]
            ends = np.flatnonzero(np.frombuffer(block, np.uint8) == ord("\n"))[: count - passed]
            if len(ends):
                file.read(int(ends[-1]) + 1)
                passed += len(ends)
                continue
        line = line_of(file)
        if not line.endswith(b"\n"):
            return passed, line
        if end and line.startswith(end):
            break
        passed += 1
    return passed, b""


def table_of(lines: bytes, columns: list[int]) -> np.ndarray:
    """Return some columns of a table of words as float64, (rows, columns)."""
    return np.loadtxt(io.BytesIO(lines), usecols=columns, comments=None, ndmin=2, encoding="latin-1")


def is_number(word: str) -> bool:
    """Tell whether a word is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def thin(places: np.ndarray, d: int) -> bool:
    """Tell whether positions are of d dimensions: beyond, they change no distance of neighbors.

    The square of a distance counts up to single precision, in which such files are often written.
    """
    spread = np.ptp(places, axis=0) if len(places) else np.zeros(places.shape[1])
    apart = np.prod(spread[:d]) ** (2.0 / d) / max(len(places), 1) ** (2.0 / d)
    return bool((spread[d:] ** 2 <= np.finfo(np.float32).eps * apart).all())


def vectors(table: dict[str, Any], *names: str) -> np.ndarray | None:
    """Return the columns of these names side by side, as many as there are from the first; None of none."""
    found: list[Any] = []
    for name in names:
        if name not in table:
            break
        found.append(table[name])
    return np.column_stack(found) if found else None


def tilted_cell(edges: Any, xy: float, xz: float, yz: float) -> np.ndarray:
    """Return the cell of these edges and tilts, a vector a row."""
    return np.array([[edges[0], 0.0, 0.0], [xy, edges[1], 0.0], [xz, yz, edges[2]]])
