"""Arrays in fewer bytes: lists of neighbours, counts of images, places in a calendar, diameters of species.

The lowest bytes of all numbers come first, then the next ones, and so on: the highest are mostly equal. zlib
leaves half of what lists take, and next to nothing where all numbers are equal or few. Coordinates and
velocities are not worth it: their digits are random, so that a tenth would be saved, in three times as long.
"""

from __future__ import annotations

import math
import sys
import zlib

import numpy as np

_LEVEL = 1
"""Of zlib; level 4 saves 2 % more and takes half as long again."""

_SAMPLE = 1 << 16
"""Numbers looked at to say what packing leaves."""

_WORTH = 2.0 / 3.0
"""Part of its bytes that packing must leave of an array at most."""


def expected(array: np.ndarray) -> float:
    """Return about how many bytes an array takes, packed if that is worth while.

    The estimate is the entropy of its bytes, one by one. What zlib saves because numbers follow each other in
    order is not counted in: diffusion destroys such order in the course of a run.
    """
    if array.dtype.kind not in "biuf" or array.size == 0:
        return float(array.nbytes)
    flat = array.reshape(-1)
    # An odd step: rows that hold a power of two of numbers are seen in all of their columns.
    columns = _columns(flat[:: -(-len(flat) // _SAMPLE) | 1])
    bits = 0.0
    for column in columns:
        parts = np.bincount(column, minlength=256) / len(column)
        parts = parts[parts > 0.0]
        bits -= float(np.sum(parts * np.log2(parts)))
    part = bits / (8.0 * array.itemsize)
    return array.nbytes * (part if part <= _WORTH else 1.0)


def pack(array: np.ndarray) -> bytes:
    """Return the bytes of an array, packed."""
    return zlib.compress(_columns(array.reshape(-1)).tobytes(), _LEVEL)


def unpack(packed: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """Return the array of a type and a shape whose bytes were packed.

    Raises
    ------
    ValueError
        If these are not its bytes, or of another number. No more is unpacked than the array holds.
    """
    size = math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or size >= sys.maxsize:
        raise ValueError(f"an array cannot have the shape {shape}")
    reader = zlib.decompressobj()
    try:
        # One byte more shows where there would be more; 0 would be no limit.
        content = reader.decompress(packed, size + 1)
    except zlib.error as error:
        raise ValueError(f"an array cannot be unpacked ({error})") from None
    if len(content) != size or not reader.eof:
        raise ValueError(f"an array of {size} bytes was packed, and {len(content)} come out")
    columns = np.frombuffer(content, np.uint8).reshape(dtype.itemsize, -1)
    return np.array(columns.T, order="C").view(dtype).reshape(shape)


def _columns(flat: np.ndarray) -> np.ndarray:
    """Return the first bytes of all numbers, the second ones, and so on, (bytes of a number, n)."""
    return np.ascontiguousarray(flat).view(np.uint8).reshape(len(flat), flat.itemsize).T
