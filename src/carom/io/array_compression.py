"""Lossless packing: of neighbor lists, image counts, diameters of species.

The lowest bytes of all numbers come first: the highest are mostly equal. zlib halves lists and leaves almost
nothing of few different numbers. Coordinates are random digits: a tenth saved, three times as long.
"""

from __future__ import annotations

import math
import sys
import zlib

import numpy as np

_LEVEL = 1
"""Level of zlib. Level 4 saves 2 % more and takes 1.5 times as long."""

_SAMPLE = 1 << 16  # numbers, at most, from which the packed size is estimated

_WORTH = 2.0 / 3.0  # largest ratio of packed to unpacked size at which an array is packed


def expected(array: np.ndarray) -> float:
    """Return about how many bytes an array takes, packed if that saves enough: the entropy of its bytes.

    What zlib saves by their order is not counted: diffusion destroys it during a run.
    """
    if array.dtype.kind not in "biuf" or array.size == 0:
        return float(array.nbytes)
    flat = array.reshape(-1)
    # The step is odd, so that all columns are sampled where a row holds a power of two of numbers.
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
    """Return the array of a type and a shape whose bytes were packed."""
    size = math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or size >= sys.maxsize:
        raise ValueError(f"an array cannot have the shape {shape}")
    reader = zlib.decompressobj()
    try:
        # One byte too many shows that the array was larger; a limit of 0 would be none.
        content = reader.decompress(packed, size + 1)
    except zlib.error as error:
        raise ValueError(f"an array cannot be unpacked ({error})") from None
    if len(content) != size or not reader.eof:
        raise ValueError(f"an array of {size} bytes was packed, and {len(content)} come out")
    columns = np.frombuffer(content, np.uint8).reshape(dtype.itemsize, -1)
    return np.array(columns.T, order="C").view(dtype).reshape(shape)


def _columns(flat: np.ndarray) -> np.ndarray:
    """Return the first bytes of all numbers, the second bytes, and so on, as (bytes of a number, n)."""
    return np.ascontiguousarray(flat).view(np.uint8).reshape(len(flat), flat.itemsize).T
