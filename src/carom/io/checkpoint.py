"""Checkpoints: named arrays and attributes in one HDF5 file, refused if incomplete or changed.

The user block is a line with format, version, size and SHA-256, checked first, against accidents; ``arrays``
has data sets, ``attributes`` is JSON. Large arrays are packed: 175 MB for a million spheres, not 240.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from carom.errors import FileError, InputError
from carom.io.array_compression import expected, pack, unpack
from carom.io.hdf5 import made
from carom.io.inspection import opened
from carom.paths import existing, reading, replacing, uninterrupted, writing
from carom.version import __version__

_MAGIC = "carom-checkpoint"
_VERSION = 2  # the first with packed arrays; a small state, which is not packed, is still of version 1
_HEADER = 512  # bytes; the smallest user block that HDF5 allows

LARGE = 100e6
"""Bytes of all arrays above which they are packed. Smaller states are written and read faster unpacked."""


def save(
    path: str | os.PathLike[str], arrays: Mapping[str, np.ndarray], attributes: Mapping[str, Any]
) -> None:
    """Write a checkpoint that replaces `path` once it is complete and on the disk, and never otherwise.

    Arrays of any dtype but object are kept bit for bit; attributes are what JSON can hold.
    """
    text = _to_json(attributes)
    large = sum(np.asarray(array).nbytes for array in arrays.values()) > LARGE
    with uninterrupted(), replacing(Path(path)) as temporary, writing(Path(path)):
        with made(temporary, userblock_size=_HEADER) as file:
            file["attributes"] = np.frombuffer(text.encode("utf-8"), dtype=np.uint8)
            group = file.create_group("arrays")
            for name, array in arrays.items():
                _put(group, name, np.asarray(array), large)
        with temporary.open("r+b") as raw:
            raw.seek(_HEADER)
            digest = hashlib.file_digest(raw, "sha256").hexdigest()
            size = raw.tell() - _HEADER
            line = f"{_MAGIC} {2 if large else 1} {size} {digest} written by carom {__version__}\n"
            raw.seek(0)
            raw.write(line.encode("ascii").ljust(_HEADER, b"\0"))


def load(path: str | os.PathLike[str]) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return the arrays and attributes of a checkpoint."""
    path = existing(path)
    with reading(path, "checkpoint"):
        content = path.read_bytes()
        _verify(path, content)
        with opened(io.BytesIO(content)) as file:
            attributes = json.loads(file["attributes"][:].tobytes().decode("utf-8"))
            return {name: _get(data) for name, data in file["arrays"].items()}, attributes


def is_one(path: Path) -> bool:
    """Return whether a file that exists begins as a checkpoint does."""
    with reading(path, "checkpoint"), path.open("rb") as file:
        return file.read(len(_MAGIC)) == _MAGIC.encode()


def _verify(path: Path, content: bytes) -> None:
    """Raise FileError unless the version is known, and the length and the digest are those in the header."""
    words = content[:_HEADER].split(b"\n")[0].split(b" ")
    if words[0] != _MAGIC.encode():
        raise FileError(f"{path} is no checkpoint of Carom; name the file that Carom wrote as one.")
    version, size, digest = int(words[1]), int(words[2]), words[3].decode("ascii")
    if version > _VERSION:
        raise FileError(
            f"{path} is a checkpoint of version {version}, and carom {__version__} reads up to "
            f"{_VERSION}; use a newer Carom."
        )
    if len(content) - _HEADER != size:
        raise FileError(
            f"{path} is truncated or has grown: {size} bytes were written and "
            f"{len(content) - _HEADER} are there; restore it from a copy."
        )
    if hashlib.sha256(memoryview(content)[_HEADER:]).hexdigest() != digest:
        raise FileError(
            f"{path} was changed since it was written (its SHA-256 differs); restore it from a copy."
        )


def _put(group: Any, name: str, array: np.ndarray, large: bool) -> None:
    """Write an array as a data set: packed, as it is, or as bytes."""
    if not isinstance(name, str) or not name or "/" in name or "\0" in name or name == ".":
        raise InputError(f"The array's name is {name!r}; expected a text without '/'.")
    if array.dtype.hasobject:
        raise InputError(
            f"The array '{name}' holds Python objects ({array.dtype}); expected numbers, text or dates."
        )
    packed = large and expected(array) < array.nbytes
    plain = array.dtype.kind in "biuf" and array.dtype != np.longdouble and array.dtype.isnative
    if plain and not packed:
        group.create_dataset(name, data=array)
        return
    # HDF5 has no type for dates, str, long double and others: bytes are stored, with their dtype and shape.
    content = pack(array) if packed else array.tobytes()
    data = group.create_dataset(name, data=np.frombuffer(content, dtype=np.uint8))
    if packed:
        data.attrs["packed"] = "zlib"
    data.attrs["dtype"] = json.dumps(np.lib.format.dtype_to_descr(array.dtype))
    data.attrs["shape"] = np.array(array.shape, dtype=np.int64)


def _get(data: Any) -> np.ndarray:
    """Return the array of a data set that :func:`_put` wrote."""
    if "dtype" not in data.attrs:
        return np.asarray(data[()])
    dtype = np.lib.format.descr_to_dtype(_tuples(json.loads(data.attrs["dtype"])))
    shape = tuple(int(length) for length in data.attrs["shape"])
    if "packed" in data.attrs:
        return unpack(data[()].tobytes(), dtype, shape)
    return np.frombuffer(data[()].tobytes(), dtype=dtype).reshape(shape).copy()


def _tuples(descr: Any) -> Any:
    """Return the description of a dtype with its tuples, which JSON has turned into lists."""
    if not isinstance(descr, list):
        return descr
    fields = []
    for name, *rest in descr:
        kind, *shape = rest
        fields.append(
            (tuple(name) if isinstance(name, list) else name, _tuples(kind), *(tuple(s) for s in shape))
        )
    return fields


def _to_json(attributes: Mapping[str, Any]) -> str:
    def plain(value: Any) -> Any:
        if isinstance(value, np.generic):
            return value.item()
        raise TypeError(f"{type(value).__name__} is none of them")

    for name in attributes:
        if not isinstance(name, str):
            raise InputError(f"The attribute's name is {name!r}; expected a text.")
    try:
        return json.dumps(dict(attributes), default=plain)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"The attributes must be None, bool, int, float, str, or lists and dicts of them: {error}."
        ) from None
