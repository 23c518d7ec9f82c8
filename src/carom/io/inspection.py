"""Opening of HDF5 files that exist: what Carom never writes is refused.

That is content in other files (external storage, virtual data sets), links to them, filters that load code,
and sizes without bytes: each byte of a data set lies in the file, once. Format 1.8 has checksums of groups,
attributes and data sets, chunks have Fletcher-32. The index of chunks has none and is inspected: each must be
there once, of full size, at its own address. Where a search in it still fails, HDF5 returns the fill value,
which no data set holds (:func:`fill_value`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import h5py

#: Most objects in a file that is accepted; files of Carom hold fewer than 100.
_MOST_OBJECTS = 10_000
_LARGEST_COMPACT = 4096  # bytes; HDF5 keeps up to 64 kB in a header

FORMAT = ("v108", "v108")
"""The format of HDF5 files, for ``h5py.File(..., libver=FORMAT)``: the first with checksums of the headers,
and the last without a mark that a file is open for writing. After a kill, such a mark makes it unreadable."""


def opened(source: Any, mode: str = "r", *, whole: bool = True) -> h5py.File:
    """Open an HDF5 file that exists, from a Python file object, and inspect it if the ``whole`` is used."""
    import h5py

    # Objects added to a file have checksums; a file that is only read may be of any format.
    file = h5py.File(source, mode, libver=None if mode == "r" else FORMAT)
    try:
        if whole:
            _inspect("/", file["/"])
    except BaseException:
        file.close()
        raise
    return file


def fill_value(dtype: Any) -> Any:
    """Return the fill value for data that HDF5 cannot find: NaN, or the integer farthest from 0."""
    kind = np.dtype(dtype)
    if kind.kind == "f":
        return np.nan
    if kind.kind == "b":
        return None
    return np.iinfo(kind).min if kind.kind == "i" else np.iinfo(kind).max


def put(group: h5py.Group, name: str, array: np.ndarray) -> h5py.Dataset:
    """Write an array as a data set with a checksum, and return the data set."""
    import h5py

    if array.nbytes <= _LARGEST_COMPACT:
        # The header, which has a checksum, holds the data. Empty arrays and scalars cannot have chunks.
        settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        settings.set_layout(h5py.h5d.COMPACT)
        return group.create_dataset(name, data=array, dcpl=settings)
    rows = max(1, (1 << 26) // (array.nbytes // len(array)))
    chunks = (min(rows, len(array)), *array.shape[1:])
    return group.create_dataset(
        name, data=array, chunks=chunks, fletcher32=True, fillvalue=fill_value(array.dtype)
    )


def growing(
    group: h5py.Group, name: str, shape: tuple[int, ...], kind: Any, rows: int, count: int = 0
) -> h5py.Dataset:
    """Make a data set with a checksum, of ``count`` rows to which more are added, in chunks of ``rows``."""
    return group.create_dataset(
        name, shape=(count, *shape), maxshape=(None, *shape), chunks=(rows, *shape), dtype=kind,
        fletcher32=True, fillvalue=fill_value(kind),
    )  # fmt: skip


def part(parent: h5py.Group, name: str, *, text: bool = False) -> Any:
    """Return what is called ``name`` in a group of a file that was not opened as a whole, or None.

    It is inspected with all that it holds, which may be ``text``. Links inside the file are followed to it.
    """
    if not parent.id.links.exists(name.encode()):
        return None
    found = _at(parent, name.encode())
    _inspect(f"{parent.name}/{name}", found, followed=True, text=text)
    return found


def names(group: h5py.Group) -> list[str]:
    """Return the names in a group that are no links to somewhere else."""
    import h5py

    links = group.id.links
    return [
        name.decode("utf-8", "replace")
        for name in group.id
        if links.get_info(name).type == h5py.h5l.TYPE_HARD
    ]


def _at(parent: h5py.Group, name: bytes, depth: int = 8) -> Any:
    """Return what a group holds, perhaps by links inside the file, not more than ``depth`` of them."""
    import h5py

    kind = parent.id.links.get_info(name).type
    if kind == h5py.h5l.TYPE_HARD:
        return parent[name]
    if kind != h5py.h5l.TYPE_SOFT or depth == 0:
        where = f"{parent.name}/{name.decode('utf-8', 'replace')}"
        raise ValueError(f"{where} is a link to somewhere else, and Carom follows none")
    path = parent.id.links.get_val(name)
    found = parent.file["/"] if path.startswith(b"/") else parent
    for each in filter(None, path.split(b"/")):
        found = _at(found, each, depth - 1)
    return found


def _inspect(path: str, node: Any, *, followed: bool = False, text: bool = False) -> None:
    """Raise ValueError unless all objects are plain groups, or data sets with all bytes in this file.

    Links inside the file are ``followed``, or refused.
    """
    import h5py

    seen: set[int] = set()
    waiting: list[tuple[str, Any]] = [(path, node)]
    while waiting:
        path, node = waiting.pop()
        if isinstance(node, h5py.Dataset):
            _inspect_data(path, node, node.file.id.get_filesize(), text)
        elif not isinstance(node, h5py.Group):
            raise ValueError(f"{path} is neither a group nor a data set")
        else:
            for name in node.id:
                child = _at(node, name, depth=8 if followed else 0)
                address = h5py.h5o.get_info(child.id).addr
                if address in seen:
                    continue
                seen.add(address)
                if len(seen) > _MOST_OBJECTS:
                    raise ValueError(f"it holds more than {_MOST_OBJECTS} objects")
                waiting.append((f"{path.rstrip('/')}/{name.decode('utf-8', 'replace')}", child))


def _inspect_data(where: str, data: h5py.Dataset, size: int, text: bool = False) -> None:
    """Raise ValueError unless a data set holds numbers, all of them in this file of `size` bytes."""
    import h5py

    settings = data.id.get_create_plist()
    layout = settings.get_layout()
    inside = (h5py.h5d.COMPACT, h5py.h5d.CONTIGUOUS, h5py.h5d.CHUNKED)
    if settings.get_external_count() or layout not in inside:
        raise ValueError(f"{where} lies in another file, and Carom follows no path out of a file")
    for k in range(settings.get_nfilters()):
        if settings.get_filter(k)[0] != h5py.h5z.FILTER_FLETCHER32:
            raise ValueError(f"{where} is compressed; `h5repack -f NONE old new` undoes that")
    if data.shape is None or (data.dtype.hasobject and not (text and h5py.check_string_dtype(data.dtype))):
        raise ValueError(f"{where} holds no numbers")
    # Not data.size: it wraps around where a damaged file declares more than 2^63.
    if (declared := math.prod(data.shape) * data.dtype.itemsize) == 0:
        return
    if layout == h5py.h5d.CHUNKED:
        _inspect_chunks(where, data, size, 4 * settings.get_nfilters())
    elif layout == h5py.h5d.CONTIGUOUS:
        start = data.id.get_offset()
        if start is None or start + declared > size:
            raise ValueError(f"{where} declares {declared} bytes, which the file does not hold")


def _inspect_chunks(where: str, data: h5py.Dataset, size: int, checksums: int) -> None:
    """Raise ValueError unless the index names every chunk once, in full size plus `checksums` bytes."""
    found: list[Any] = []
    data.id.chunk_iter(found.append)
    expected = math.prod(-(-length // step) for length, step in zip(data.shape, data.chunks, strict=True))
    if len(found) != expected:
        raise ValueError(f"{where} declares {expected} chunks of data, and {len(found)} are stored")
    stored = math.prod(data.chunks) * data.dtype.itemsize + checksums
    grid, addresses = set(), set()
    for chunk in found:
        inside = all(
            start % step == 0 and 0 <= start < length
            for start, step, length in zip(chunk.chunk_offset, data.chunks, data.shape, strict=True)
        )
        if not inside or chunk.filter_mask or chunk.size != stored or chunk.byte_offset + stored > size:
            raise ValueError(f"the index of {where} is damaged")
        grid.add(chunk.chunk_offset)
        addresses.add(chunk.byte_offset)
    if len(grid) != expected or len(addresses) != expected:
        raise ValueError(f"the index of {where} names a chunk twice")
