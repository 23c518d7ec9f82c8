"""The event log: every collision of a run, from which any state can be rebuilt.

The HDF5 file has one growing data set per column; row k of every column is event k. The group ``initial``
holds the initial state. The layout is in ``docs/layouts.md``.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from carom.errors import FileError, InputError
from carom.io import checksums
from carom.io.formats import Closing
from carom.io.hdf5 import Input, Output
from carom.io.inspection import growing, put
from carom.io.locks import WriteLock, patiently, steady
from carom.paths import existing, reading, uninterrupted, writable, writing
from carom.version import __version__

if TYPE_CHECKING:
    import h5py

T = TypeVar("T")

_KIND = "event log"
_FORMAT, _LAYOUT = "carom-events", 1
_CHUNK = 16384  # events; 128 kB of a float64 column
_VERIFIED = 1 << 20  # events read at a time when a log continues
_DTYPES: dict[str, type] = {
    "epoch": np.int64,
    "time": np.float64,
    "i": np.int32,
    "j": np.int32,
    "image": np.int32,
    "impulse": np.float64,
}
_KIND_OF_EVENT: dict[str, type] = {"kind": np.int8}  # a column only where pairs have steps


class Events(NamedTuple):
    """Events in the order in which they happened, arrays (k,)."""

    epoch: np.ndarray  # int64, since the start of the run
    time: np.ndarray  # [time] since the start of that epoch
    i: np.ndarray  # int32
    j: np.ndarray  # int32: the other component; n + k for wall or obstacle k
    image: np.ndarray  # int32: which periodic image of j it was
    impulse: np.ndarray  # [mass * length / time] on j along the line of centers
    kind: np.ndarray | None = None
    """int8, where pairs have steps (``carom.models.interactions.wells``): 0 for thrown back at the inner end
    (core), 1 for across it (in), 2 for across the outer end (out), 3 for thrown back there (bounce)."""


def _columns(file: h5py.File) -> dict[str, type]:
    """Return the columns that a file has, and their types."""
    return {**_DTYPES, **_KIND_OF_EVENT} if "kind" in file else _DTYPES


def is_log(path: Path) -> bool:
    """Return whether the file ``path`` is an event log."""
    if path.suffix != ".h5" or not path.is_file():
        return False
    import h5py

    try:
        with reading(path, "HDF5"), steady(path), h5py.File(path) as file:
            return _named(file)
    except FileError:
        return False


def _named(file: h5py.File) -> bool:
    """Return whether a file says that it is an event log; attributes of other programs may be of any type."""
    kind = file.attrs.get("format")
    return isinstance(kind, str | bytes) and np.bytes_(kind) == _FORMAT.encode()


def _count(file: h5py.File) -> int:
    """Return the number of whole events: a kill may leave some columns longer than others."""
    if not _named(file):
        raise ValueError(f"it is not of the format {_FORMAT}")
    layout = int(file.attrs["layout"])
    if layout > _LAYOUT:
        raise ValueError(f"its layout is {layout}, newer than the {_LAYOUT} that carom {__version__} knows")
    for name, dtype in _columns(file).items():
        data = file[name]
        if data.dtype.newbyteorder("=") != dtype or data.ndim != 1 or data.chunks is None:
            raise ValueError(f"its column {name} is not one of {np.dtype(dtype)} that grows")
    return min(len(file[name]) for name in _columns(file))


def _sum_of_initial(arrays: Mapping[str, np.ndarray]) -> int:
    """Return the checksum of the initial state."""
    return checksums.of_arrays(arrays[name] for name in sorted(arrays))


def verify(path: Path, count: int, sums: Mapping[str, int]) -> None:
    """Refuse a log whose first ``count`` events are not those with these checksums; it is only read."""
    existing(path)

    def look(file: h5py.File) -> None:
        if (there := _count(file)) < count:
            raise FileError(f"{path} is damaged: it holds {there} events, and {count} were written.")
        for name, value in _sums_of(file, count):
            if value != sums.get(name):
                raise FileError(f"{path} is damaged: its {name} is not what was written.")

    try:
        _looked_up(path, look)
    except FileError as error:
        raise FileError(
            f"{str(error).rstrip('.')}; it was left as it is: restore it from a copy, or repeat the run."
        ) from error


def _sums_of(file: h5py.File, count: int) -> Iterator[tuple[str, int]]:
    """Yield the checksums of the initial state and of the first ``count`` rows of each column."""
    yield "initial", _sum_of_initial({name: data[()] for name, data in file["initial"].items()})
    step = checksums.PIECE // 8
    for name in _columns(file):
        pieces = (file[name][k : min(k + step, count)] for k in range(0, count, step))
        yield name, checksums.of_arrays(pieces)


def _read(file: h5py.File, start: int, stop: int) -> Events:
    """Return these events; raise ValueError if no run can have produced them."""
    events = Events(**{name: file[name][start:stop] for name in _columns(file)})
    if not stop > start:
        return events
    wrong = ""
    if not (np.isfinite(events.time).all() and np.isfinite(events.impulse).all()):
        wrong = "a time or an impulse is NaN or infinite"
    elif events.epoch[0] < 0 or events.time.min() < 0.0 or (np.diff(events.epoch) < 0).any():
        wrong = "an epoch or a time is negative, or before that of the event before it"
    elif ((np.diff(events.epoch) == 0) & (np.diff(events.time) < 0.0)).any():
        wrong = "a time is before that of the event before it"
    elif min(events.i.min(), events.j.min(), events.image.min()) < 0 or (events.i == events.j).any():
        wrong = "a component or an image is negative, or a component meets itself"
    elif events.kind is not None and not 0 <= events.kind.min() <= events.kind.max() <= 3:
        wrong = "a kind of event is none of 0 to 3"
    if wrong:
        raise ValueError(f"among the events {start} to {stop - 1} {wrong}")
    return events


def _initial(file: h5py.File) -> Iterator[tuple[str, Any]]:
    """Yield the arrays of the initial state by name; raise ValueError if one is not of numbers."""
    for name, data in file["initial"].items():
        if data.dtype.kind not in "biuf":
            raise ValueError(f"initial/{name} holds {data.dtype}, and no numbers")
        values = data[()]
        if data.dtype.kind == "f" and np.isnan(values).any():
            raise ValueError(f"initial/{name} holds NaN")
        yield name, values


class EventLog(Closing):
    """Writer of an event log: a new one from the state ``initial`` on, or an old one after ``keep`` events.

    ``sums``, checksums of columns and initial state by then, are compared before anything is dropped; the
    attribute has those of now, None where a log continues without.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        initial: Mapping[str, np.ndarray] | None = None,
        *,
        keep: int | None = None,
        sums: Mapping[str, int] | None = None,
        kinds: bool = False,
    ):
        self.sums = None if sums is None else dict(sums)
        if keep is not None and (initial is not None or keep < 0):
            raise InputError(f"keep is {keep}; expected 0 or more events, of a log that continues.")
        self.path = writable(path)
        if initial is None:
            self._reopen(keep)
        else:
            self._columns = {**_DTYPES, **_KIND_OF_EVENT} if kinds else _DTYPES
            self._create(initial)

    def _create(self, initial: Mapping[str, np.ndarray]) -> None:
        """Begin a new log with its initial state."""
        arrays = {name: np.asarray(values) for name, values in initial.items()}
        for name, array in arrays.items():
            if array.dtype.kind not in "biuf" or "/" in name:
                raise InputError(
                    f"The initial state's '{name}' holds {array.dtype}; expected an array of numbers."
                )
        with writing(self.path):
            self._output = Output(self.path, "w")
            self._file = self._output.file
            self._file.attrs["format"] = np.bytes_(_FORMAT)
            self._file.attrs["layout"] = np.int64(_LAYOUT)
            self._file.attrs["creator"] = np.bytes_(f"carom {__version__}")
            group = self._file.create_group("initial")
            for name, array in arrays.items():
                put(group, name, array)
            for name, dtype in self._columns.items():
                growing(self._file, name, (), dtype, _CHUNK)
            self._output.flush()
        self._events = 0
        self.sums = {**dict.fromkeys(self._columns, 0), "initial": _sum_of_initial(arrays)}

    def _reopen(self, keep: int | None) -> None:
        """Continue a log after a check, and drop all but the first `keep` events."""
        existing(self.path)
        with writing(self.path):
            WriteLock(self.path).close()
        if self.sums is not None:
            verify(self.path, keep or 0, self.sums)
        with reading(self.path, _KIND):
            self._output = Output(self.path, "r+")
            self._file = self._output.file
            try:
                count = _count(self._file)
                self._columns = _columns(self._file)
                keep = count if keep is None else keep
                if keep > count:
                    raise FileError(f"{self.path} holds {count} events, and {keep} were to be kept.")
                for _ in _initial(self._file):
                    pass
                for start in range(0, keep, _VERIFIED):
                    _read(self._file, start, min(start + _VERIFIED, keep))
                with writing(self.path):
                    for name in self._columns:
                        self._file[name].resize(keep, axis=0)
                    self._output.flush()
            except BaseException:
                self._output.close()
                raise
        self._events = keep

    def __len__(self) -> int:
        return self._events

    def append(
        self,
        epoch: np.ndarray,
        time: np.ndarray,
        i: np.ndarray,
        j: np.ndarray,
        image: np.ndarray,
        impulse: np.ndarray,
        kind: np.ndarray | None = None,
    ) -> None:
        """Append events: (k,) arrays as in :class:`Events`.

        On return they have been handed to the system, so that they survive a kill of this process.
        """
        columns: dict[str, np.ndarray] = {}
        given = (epoch, time, i, j, image, impulse, *(() if kind is None else (kind,)))
        for (name, dtype), values in zip(self._columns.items(), given, strict=True):
            array = np.asarray(values)
            if array.ndim != 1 or len(array) != len(np.asarray(epoch)):
                raise InputError(f"The column {name} has the shape {array.shape}; expected ({len(epoch)},).")
            if not np.can_cast(array.dtype, dtype, "same_kind"):
                raise InputError(f"The column {name} is of {array.dtype}; expected {np.dtype(dtype)}.")
            columns[name] = array.astype(dtype)
            if not np.array_equal(columns[name], array):
                raise InputError(
                    f"The column {name} holds numbers that {np.dtype(dtype)} cannot; nothing was written."
                )
        end = self._events + len(columns["epoch"])
        with uninterrupted(), writing(self.path):
            for name, array in columns.items():
                self._file[name].resize(end, axis=0)
                self._file[name][self._events : end] = array
            self._output.flush()
            if self.sums is not None:
                for name, array in columns.items():
                    self.sums[name] = checksums.of_arrays([array], self.sums[name])
        self._events = end

    def close(self) -> None:
        """Flush and close the file; a second time does nothing."""
        with uninterrupted(), writing(self.path):
            self._output.close()


def read_events(path: str | os.PathLike[str], start: int = 0, stop: int | None = None) -> Events:
    """Return the events ``start <= k < stop`` of a log, by default all."""

    def read(file: h5py.File) -> Events:
        first, last, _ = slice(start, stop).indices(_count(file))
        return _read(file, first, max(first, last))

    return _looked_up(path, read)


def count_events(path: str | os.PathLike[str]) -> int:
    """Return the number of events of a log."""
    return _looked_up(path, _count)


def read_initial(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the initial state of a log, as the arrays it was made with."""

    def read(file: h5py.File) -> dict[str, Any]:
        _count(file)  # refuses what is no log
        return dict(_initial(file))

    return _looked_up(path, read)


def _looked_up(path: str | os.PathLike[str], look: Callable[[h5py.File], T]) -> T:
    """Return what ``look`` finds in a log, which a run may be writing."""
    path = existing(path)

    def read() -> T:
        with reading(path, _KIND), Input(path) as file:
            return look(file)

    return patiently(path, read)
