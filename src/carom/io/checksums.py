"""CRC-32 of written data: before a run continues a file, it checks that the file is unchanged.

A CRC-32 detects every accident that changes up to 32 bits in a row, and misses one in 4e9 of the others. It
is no signature. Each function continues from the checksum ``before`` of the data so far.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from carom.frame import Frame

PIECE = 1 << 24  # bytes read at a time


def of_arrays(arrays: Iterable[np.ndarray], before: int = 0) -> int:
    """Return the checksum of the bytes of arrays, one after the other."""
    for array in arrays:
        before = zlib.crc32(np.ascontiguousarray(array).data, before)
    return before


def of_frame(frame: Frame, before: int = 0) -> int:
    """Return the checksum of everything that a frame holds."""
    return of_arrays(_numbers(frame), before)


def _numbers(frame: Frame) -> Iterator[np.ndarray]:
    """Yield the content of a frame as arrays of fixed types."""
    yield np.array([frame.time, *frame.box], np.float64)
    yield np.array([frame.step, *frame.positions.shape, *frame.periodic], np.int64)
    for values in (frame.positions, frame.velocities, frame.diameters, frame.masses):
        yield np.asarray(values, np.float64)
    if frame.images is not None:
        yield np.asarray(frame.images, np.int32)
    if frame.tilt is not None:
        yield np.array([frame.tilt], np.float64)
    if frame.spins is not None:
        yield np.asarray(frame.spins, np.float64)
    if frame.species is not None:
        yield np.asarray(frame.species, np.int32)
        yield np.frombuffer("\0".join(frame.species_names).encode(), np.uint8)


def of_bytes(path: Path, start: int, stop: int, before: int = 0) -> int:
    """Return the checksum of the bytes ``start <= k < stop`` of a file; of fewer, where it ends earlier."""
    with path.open("rb") as file:
        file.seek(start)
        while start < stop and (piece := file.read(min(PIECE, stop - start))):
            before = zlib.crc32(piece, before)
            start += len(piece)
    return before
