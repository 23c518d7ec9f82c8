"""Extended XYZ: text for exchange with ASE and OVITO, with every bit of a double.

Layout: ``docs/layouts.md``. ASE takes velocities from ``momenta``, OVITO from ``velo``. Where names are no
chemical symbols, ``Z`` is 0, and ASE reads it instead of them.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Collection, Iterator
from itertools import chain
from pathlib import Path
from typing import IO, Any

import numpy as np

from carom.bridges.embedding import (
    about_axes,
    cell_of,
    embed,
    joined,
    names_of,
    one_word,
    parted,
    periodic,
    require_at_most_three,
    spins_of,
    symbols_of,
)
from carom.errors import FileError
from carom.figures.palette import colors_of
from carom.frame import Frame
from carom.io.extxyz_header import (
    dimension_of,
    in_order,
    integers,
    lattice_of,
    layout_of,
    number_of,
    pairs,
    periodic_axes,
    tilt_of,
    vectors,
    words_of,
)
from carom.io.foreign_source import LONGEST, UNENDED, line_of, opened, pass_lines, table_of
from carom.io.formats import Reader, Writer
from carom.io.locks import WriteLock, under_way
from carom.io.validation import narrowed
from carom.paths import reading, writing
from carom.version import __version__

_KIND = "extended XYZ"
_COLUMNS = (("pos", "R", 3), ("momenta", "R", 3), ("masses", "R", 1), ("radius", "R", 1), ("velo", "R", 3))


def render(frame: Frame) -> bytes:
    """Return one frame as the bytes of the file."""
    require_at_most_three(frame.dimension, "Extended XYZ")
    columns: list[list[Any]] = list(embed(frame.positions).T.tolist())
    velocities = _triples(embed(frame.velocities))
    moments = frame.velocities * frame.masses[:, None]
    same = np.array_equal(moments.view(np.int64), frame.velocities.view(np.int64))  # -0.0 is not 0.0
    columns.append(velocities if same else _triples(embed(moments)))
    row = " %.17g" * 3 + " %s"
    for values in (frame.masses, frame.diameters / 2.0):
        if values.min() == values.max():
            row += f" {values[0]:.17g}"
        else:
            row += " %.17g"
            columns.append(values.tolist())
    columns += [velocities, list(range(1, frame.n + 1))]
    row += " %s %d"
    properties = (
        "species:S:1:" + ":".join(f"{name}:{kind}:{width}" for name, kind, width in _COLUMNS) + ":id:I:1"
    )
    if frame.images is not None:
        columns += embed(frame.images).T.tolist()
        properties += ":images:I:3"
        row += " %d %d %d"
    if frame.spins is not None:
        columns.append(_triples(about_axes(frame.spins)))
        properties += ":angular_velocity:R:3"
        row += " %s"
    more = ""
    symbols, kinds = symbols_of(frame), np.zeros(frame.n, dtype=np.int64)
    fixed = [""] * len(symbols)  # what follows from the species alone
    if frame.species is not None:
        kinds = frame.species
        columns.append(kinds.tolist())
        properties += ":kind:I:1:color:R:3"
        row += " %d"
        fixed = [" {:.3g} {:.3g} {:.3g}".format(*rgb) for rgb in colors_of(len(symbols))]
        names = [one_word(name) for name in names_of(frame)]
        if names != symbols:
            properties += ":Z:I:1"
            symbols, fixed = names, [color + " 0" for color in fixed]
        if frame.species_names:
            more = f'species_names="{joined(frame.species_names)}" '
    lattice = " ".join(f"{x:.17g}" for x in cell_of(frame).ravel())
    if frame.tilt is not None:
        more += f"tilt={float(frame.tilt)!r} "
    pbc = " ".join("T" if flag else "F" for flag in periodic(frame.periodic))
    # repr keeps a time such as 3.0 a float for readers that guess types.
    head = (
        f'{frame.n}\nLattice="{lattice}" Properties={properties} pbc="{pbc}" '
        f"time={float(frame.time)!r} step={int(frame.step)} dimension={frame.dimension} "
        f"{more}carom={__version__}\n"
    )
    # Formatting the whole table at once is about twice as fast as formatting each row.
    lines = [f"{symbol.replace('%', '%%')}{row}{rest}\n" for symbol, rest in zip(symbols, fixed, strict=True)]
    table = lines[0] * frame.n if len(lines) == 1 else "".join([lines[k] for k in kinds.tolist()])
    body = table % tuple(chain.from_iterable(zip(*columns, strict=True)))
    return (head + body).encode("ascii")


def _triples(vectors: np.ndarray) -> list[str]:
    """Return (n, 3) vectors as text. Formatting doubles takes most of the time, so it is done only once."""
    return (("%.17g %.17g %.17g\n" * len(vectors)) % tuple(vectors.ravel().tolist())).split("\n")[:-1]


class Index:
    """Where the frames of a file start: ``offsets`` (bytes) of each complete one, and of the end of the last.

    ``torn`` says that part of a frame follows, ``unended`` that it lacks the last newline and perhaps digits.
    Anything else that follows is a ValueError; if a part of the file will do, what is ``wrong`` is noted.
    """

    def __init__(self, path: Path, limit: int | None = None, *, partly: bool = False):
        self.offsets = [0]
        self.torn = self.unended = False
        self.wrong = ""
        try:
            self._seek(path, limit)
        except ValueError as error:
            if not (partly and len(self)):
                raise
            self.wrong = str(error)

    def _seek(self, path: Path, limit: int | None) -> None:
        with opened(path) as file:
            while limit is None or len(self.offsets) <= limit:
                first = line_of(file)
                if not first:  # the end; what a run writes from now on is not looked at
                    break
                if not first.strip():
                    while block := file.read(LONGEST):
                        if block.strip():
                            raise ValueError(f"an empty line follows frame {len(self) - 1}")
                    break
                n, second = self._number(first), line_of(file)
                if second.endswith(b"\n"):
                    if len(self) == 0:
                        layout_of(pairs(second))  # before all rows are read
                    passed, rest = pass_lines(file, n)
                    if passed == n:
                        self.offsets.append(file.tell())
                        continue
                    # A line without a newline is the last of the file, perhaps cut off within a number.
                    self.unended = passed == n - 1 and len(rest.split()) >= layout_of(pairs(second))[1]
                self.torn = True
                break

    def _number(self, line: bytes) -> int:
        text = line.strip()
        if not text.isdigit() or len(text) > 18 or int(text) == 0:
            raise ValueError(f"frame {len(self)} does not start with a number of components")
        return int(text)

    def __len__(self) -> int:
        return len(self.offsets) - 1


def parse(
    path: Path, start: int, stop: int, names: Collection[str] | None = None
) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    """Return the ``key=value`` pairs and the columns, all or `names`, of the frame in a range of bytes.

    Any extended XYZ will do. Columns are (n,) or (n, width) arrays of float64, int64 or str.
    """
    with opened(path) as file:
        file.seek(start)
        n = int(line_of(file))
        info = pairs(line_of(file))
        layout, width = layout_of(info)
        if "Properties" not in info:  # plain XYZ may hold more columns, which have no names
            at = file.tell()
            width = max(width, len(line_of(file).split()))
            file.seek(at)
        wanted = [column for column in layout if names is None or column.name in names]
        numbers = [column for column in wanted if column.kind in "RI"]
        used = [k for column in numbers for k in range(width)[column.words]]
        tables: list[np.ndarray] = []
        words: dict[str, list[bytes]] = {column.name: [] for column in wanted if column.kind in "SL"}
        count = 0
        for lines in _blocks(file, stop):
            count += _check_words(lines, width)
            if used:
                # loadtxt rounds correctly, as Python's float does.
                tables.append(table_of(lines, used))
            if words:
                each = lines.split()
                for column in wanted:
                    if column.name in words:
                        words[column.name] += each[column.words.start :: width]
    if count != n:
        raise ValueError(f"{count} lines follow, and {n} were announced")
    table = tables[0] if len(tables) == 1 else np.concatenate(tables or [np.empty((n, 0))])
    columns: dict[str, np.ndarray] = {
        name: np.array([word.decode("utf-8") for word in found]) for name, found in words.items()
    }
    at = 0
    for column in numbers:
        wide = column.words.stop - column.words.start
        values = table[:, at] if wide == 1 else table[:, at : at + wide]
        columns[column.name] = integers(values) if column.kind == "I" else values
        at += wide
    return info, columns


def _blocks(file: IO[bytes], stop: int) -> Iterator[bytes]:
    """Yield whole lines, some megabytes at a time, up to the byte `stop`."""
    rest = b""
    while left := stop - file.tell():
        block = rest + file.read(min(left, LONGEST))
        end = block.rfind(b"\n") + 1
        if not end:
            raise ValueError(f"a line is longer than {LONGEST} bytes")
        yield block[:end]
        rest = block[end:]


def _check_words(lines: bytes, width: int) -> int:
    """Return the number of lines, each of which must have `width` words."""
    characters = np.frombuffer(lines, dtype=np.uint8)
    inside = characters > ord(" ")
    first = inside.copy()
    first[1:] &= ~inside[:-1]
    ends = np.flatnonzero(characters == ord("\n"))
    words = np.flatnonzero(first)
    if len(words) == width * len(ends):
        table = words.reshape(len(ends), width)
        if (table[:, -1] < ends).all() and (table[1:, 0] > ends[:-1]).all():
            return len(ends)
    raise ValueError(f"a line has not the {width} columns that Properties announces")


#: The columns that a frame is read from. ``momenta`` and ``species`` repeat them for ASE.
_READ = frozenset(("pos", "velo", "masses", "radius", "images", "kind", "id", "angular_velocity"))


def _to_frame(info: dict[str, str], columns: dict[str, np.ndarray]) -> Frame:
    for name in ("pos", "velo", "masses", "radius"):
        if name not in columns:
            raise ValueError(f"it has no column '{name}'")
    dimension = dimension_of(info, columns)
    lattice = lattice_of(info)
    if lattice is None:
        raise ValueError("its second line has no 'Lattice'")
    tilt = tilt_of(info, lattice)
    if any(word.strip("+-0.") for word in words_of(info.get("Origin", ""))):
        raise ValueError(f"the origin of its box is {info['Origin']!r}; expected 0 0 0")
    kinds, spinning = columns.get("kind"), "angular_velocity" in columns
    return Frame(
        time=number_of(info, "time"),
        step=number_of(info, "step", int),
        positions=np.ascontiguousarray(vectors(columns, "pos", dimension), dtype=np.float64),
        velocities=np.ascontiguousarray(vectors(columns, "velo", dimension), dtype=np.float64),
        box=tuple(float(edge) for edge in np.diag(lattice)[:dimension]),
        diameters=2.0 * vectors(columns, "radius", 1)[:, 0],
        masses=np.ascontiguousarray(vectors(columns, "masses", 1)[:, 0], dtype=np.float64),
        images=narrowed(vectors(columns, "images", dimension)) if "images" in columns else None,
        species=None if kinds is None else np.ascontiguousarray(kinds),
        species_names=parted(info.get("species_names", "")) if kinds is not None else (),
        periodic=periodic_axes(info, dimension),
        spins=spins_of(vectors(columns, "angular_velocity", 3), dimension) if spinning else None,
        tilt=tilt,
    )


_UNREAD = np.empty(0, np.int64)

_OR_DROP = f"{UNENDED}, or cut the frame off with mode 'a' and keep=."


def is_foreign(path: Path) -> bool:
    """Tell whether the second line of a file does not say that Carom wrote it."""
    with opened(path) as file:
        line_of(file)
        return "carom" not in pairs(line_of(file))


class ExtxyzReader(Reader):
    """Reader of extended XYZ with the columns that Carom writes; it holds no file open."""

    def __init__(self, path: Path, *, torn: bool = False, limit: int | None = None):
        super().__init__(path)
        self._first: np.ndarray | None = _UNREAD
        growing = under_way(path)
        with reading(path, _KIND):
            self._index = Index(path, limit)
            # Of a frame that is being written the rest is to come.
            if self._index.torn and not torn and not growing:
                raise FileError(
                    f"{path} ends inside frame {len(self)}, after {len(self)} complete ones; "
                    + (_OR_DROP if self._index.unended else "opening it once with mode 'a' drops the rest.")
                )

    def __len__(self) -> int:
        return len(self._index)

    def _read(self, k: int) -> Frame:
        start, stop = self._index.offsets[k : k + 2]
        with reading(self.path, _KIND):
            info, columns = parse(self.path, start, stop, _READ)
            if k == 0:
                columns, self._first = in_order(columns, None)
            else:
                columns, _ = in_order(columns, self._ids())
            return _to_frame(info, columns)

    def _ids(self) -> np.ndarray | None:
        """Return the ids of the first frame, in order."""
        if self._first is _UNREAD:
            _, columns = parse(self.path, 0, self._index.offsets[1], ("id",))
            self._first = in_order(columns, None)[1]
        return self._first


class ExtxyzWriter(Writer):
    """Writer of extended XYZ. A frame that could not be written completely is removed."""

    def __init__(self, path: Path, scene: Any = None, *, append: bool = False, keep: int | None = None):
        super().__init__(path, scene)
        end = 0
        with writing(path):
            self._write_lock = WriteLock(path)
        try:
            if append:
                end = self._keep(keep)
            with writing(path):
                # Unbuffered: a failed frame must not come back from a buffer when the file is closed.
                self._file: io.FileIO = path.open("r+b" if append else "wb", buffering=0)
                if append:
                    self._file.truncate(end)
                    self._file.seek(end)
        except BaseException:
            self._write_lock.close()
            raise
        self._end = end

    def _keep(self, keep: int | None) -> int:
        """Return the byte after the first `keep` frames, at which writing continues."""
        with ExtxyzReader(self.path, torn=True, limit=keep) as reader:
            index = reader._index
            if keep is None and (index.unended or (index.torn and not len(index))):
                raise FileError(
                    f"{self.path} holds {len(reader)} complete frames and was left as it is: "
                    + (_OR_DROP if index.unended else "mode 'a' with keep=0 drops the rest.")
                )
            self._retain(reader, keep)
            return index.offsets[-1]

    def _append(self, frame: Frame) -> None:
        rest = memoryview(render(frame))
        size = len(rest)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            with contextlib.suppress(OSError):
                self._file.truncate(self._end)
                self._file.seek(self._end)
            raise
        self._end += size

    def _close(self) -> None:
        self._file.close()
        self._write_lock.close()


READER, WRITER = ExtxyzReader, ExtxyzWriter
