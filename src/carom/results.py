"""What measurements and studies give: one base by which every result prints, draws itself, and goes to files.

A result is a frozen dataclass. That of a measurement has numbers, texts, arrays and :class:`~carom.Estimate`.
Its dictionary has the names of its fields; an estimate ``Z`` is there as ``Z`` and ``Z_error``, with
``Z_n_eff``, ``Z_tau`` and ``Z_blocks``. The result of a study says itself what stands in its dictionary. The
key ``kind`` names the class, by which :func:`loaded` finds it again.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import os
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from carom import checks
from carom.errors import FileError, InputError
from carom.figures import style
from carom.paths import replacing, writing
from carom.table import cell, csv_of, in_html
from carom.texts import label, visible

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PICTURES = (".png", ".pdf", ".svg")
"""Suffixes of pictures."""

KINDS: dict[str, type] = {}
"""The classes that a file can hold, by the name under the key ``kind``."""

_PARTS = ("error", "n_eff", "tau", "blocks")  # of an estimate, besides its mean
_NOT_FINITE = ("nan", "inf", "-inf")  # JSON has no such numbers
_DAMAGED = (
    ValueError, TypeError, LookupError, ArithmeticError, AttributeError, RecursionError, zipfile.BadZipFile,
)  # fmt: skip
_TYPES = {"int": (int,), "float": (int, float), "bool": (bool,)}  # what a file may hold in such a field
_T = TypeVar("_T", bound=type)


def part(kind: _T) -> _T:
    """Let a dataclass be a part of results: a decorator.

    Parameters
    ----------
    kind : type
        The dataclass.
    """
    KINDS[kind.__name__] = kind
    return kind


class Result:
    """Base of results.

    A class of its own is a dataclass with ``frozen=True, eq=False, repr=False`` whose ``_rows`` names the
    numbers of its short table. It may have ``_columns``, its arrays of one length for tables and ``.csv``
    files. One that holds more than numbers, arrays and estimates has ``_words`` for its dictionary,
    ``_saved`` for what else a file must hold, and ``_made``, which makes it from both.
    """

    _numbers_above: ClassVar[bool] = True
    """Whether lines with # above a table of many rows hold the numbers that are the same in all of them."""

    _digits: ClassVar[str] = ""
    """Format of the numbers in a .csv file; by default the shortest text that has all digits."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()  # of a generic class, as a study is
        part(cls)

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        """Return the title of the short table, and its rows."""
        raise NotImplementedError

    def _lines(self) -> Sequence[str]:
        """Return what is printed: three lines at most."""
        title, rows = self._rows()
        return [f"{title}: " + ", ".join(f"{name} = {value}" for name, value in rows)]

    def _columns(self) -> dict[str, Any]:
        """Return the columns of the table by name; by default one row of all numbers and texts."""
        return {name: [value] for name, value in self._words().items() if not isinstance(value, list | dict)}

    def _with_errors(self, *names: str) -> dict[str, Any]:
        """Return the fields of these names, each before its error: ``tensor`` and ``tensor_error``."""
        return {each: getattr(self, each) for name in names for each in (name, f"{name}_error")}

    def _above(self) -> dict[str, Any]:
        """Return what stands above the table in a .csv file: numbers that are the same in all rows."""
        above: dict[str, Any] = {}
        for name, value in self._words().items():
            field = getattr(self, name, None)
            if isinstance(field, tuple) and all(isinstance(each, int) for each in field):
                above[name] = " ".join(map(str, value))
            elif value is not None and not isinstance(value, list | dict):
                above[name] = value
        return above

    def _words(self) -> dict[str, Any]:
        """Return the dictionary without the kind."""
        return _fields(self)

    def _saved(self) -> dict[str, Any]:
        """Return what else a file holds, so that the result can be made again."""
        return {}

    @classmethod
    def _made(cls, values: Mapping[str, Any]) -> Any:
        """Return the result of a dictionary, with what ``_saved`` added to it."""
        return _of_fields(cls, values)

    def _repr_html_(self) -> str:
        title, rows = self._rows()
        return in_html(title, [(name, value.replace("+-", "±")) for name, value in rows])

    def __str__(self) -> str:
        return visible("\n".join(self._lines()), lines=True)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Result) or type(self) is not type(other):
            return NotImplemented
        return _text(self) == _text(other)

    __hash__ = None  # type: ignore[assignment]

    def to_dict(self) -> dict[str, Any]:
        """Return the result as numbers, texts and lists by name.

        Notes
        -----
        Of an estimate ``x`` there are ``x``, ``x_error``, ``x_n_eff``, ``x_tau`` and ``x_blocks``. The key
        ``kind`` names the class. In results of studies, a number that does not exist is None.
        """
        return {"kind": type(self).__name__, **self._words()}

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the table for pandas: a row for each bin, time, point or stretch, or one row of numbers.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        pandas = checks.needed("pandas", "A DataFrame", "pandas, or use to_dict()")
        return pandas.DataFrame(self._columns())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file ``path``, by its suffix.

        Parameters
        ----------
        path : path
            ``.json`` and ``.npz`` (NumPy arrays) hold everything, and ``carom.load`` reads them. ``.csv`` is
            the table of :meth:`to_dataframe` with all digits, for other programs; what is unknown is empty.
            Lines that begin with # before the table of a measurement hold the numbers that are the same in
            all rows. ``.png``, ``.pdf`` and ``.svg`` are the picture of :meth:`plot`.

        Raises
        ------
        InputError
            If the suffix is another one, or there is nothing to draw.
        FileError
            If the file cannot be written.
        """
        writers, suffix = self._writers(), Path(path).suffix.lower()
        if suffix not in writers:
            raise InputError(f"{path} has the suffix '{suffix}'; expected one of {', '.join(writers)}.")
        if suffix in PICTURES:
            self.plot(path)
            return
        with replacing(Path(path)) as temporary, writing(Path(path)):
            writers[suffix](temporary)

    def _writers(self) -> dict[str, Callable[[Path], object]]:
        """Return the function that writes a file, by its suffix."""
        return {
            ".json": lambda path: path.write_text(_text(self, indent=1) + "\n", encoding="utf-8"),
            ".csv": lambda path: path.write_text(_csv(self), encoding="utf-8"),
            ".npz": lambda path: np.savez(path, allow_pickle=False, **_arrays(self)),
            **dict.fromkeys(PICTURES, self.plot),
        }

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """Draw the result.

        Parameters
        ----------
        path : path, optional
            Where to save the picture; the suffix is the format (png, pdf, svg).

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            If there is nothing to draw.
        FileError
            If the picture cannot be saved.
        """
        return self._picture(path)

    def _picture(self, path: str | os.PathLike[str] | None, **given: Any) -> Figure:
        """Return the picture, with what else is ``given``: the contact value by a pressure, equations."""
        figure, axes = style.sheet(7.0, 4.2)
        self._draw_into(axes, **given)
        return style.finished(figure, axes, self._heading(), path)

    def _draw_into(self, axes: Axes) -> None:
        """Draw the result into a pair of axes."""
        raise InputError(f"There is no picture of a {type(self).__name__}; to_dataframe() gives a table.")

    def _heading(self) -> str:
        """Return the title of the picture."""
        return label(self._rows()[0])


class Binned(Result):
    """Base of results over bins with ``edges`` (b + 1,)."""

    edges: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Middle of each bin, (b,), in the unit of the edges."""
        return 0.5 * (self.edges[:-1] + self.edges[1:])

    def _bins(self, name: str = "x") -> dict[str, Any]:
        """Return the columns of both ends of each bin."""
        return {f"{name}_lo": self.edges[:-1], f"{name}_hi": self.edges[1:]}


def from_dict(values: Mapping[str, Any]) -> Any:
    """Return the result that :meth:`Result.save` wrote as ``values``.

    For a measurement it is the inverse of :meth:`Result.to_dict`. The file of a study holds more than that.

    Raises
    ------
    InputError
        If its kind is not known, or a number is missing.
    """
    name = str(values.get("kind"))
    if name not in KINDS:
        raise InputError(f"No kind of result is called {values.get('kind')!r}.")
    kind = KINDS[name]
    return kind._made(values) if issubclass(kind, Result) else _of_fields(kind, values)


def _of_fields(kind: type, values: Mapping[str, Any]) -> Any:
    """Return a dataclass of the numbers, texts and lists that are its fields."""
    made: dict[str, Any] = {}
    for field in dataclasses.fields(kind):
        name = field.name
        if f"{name}_n_eff" in values:
            parts = {"mean": values[name], **{each: values[f"{name}_{each}"] for each in _PARTS}}
            made[name] = from_dict({"kind": "Estimate", **parts})
        elif name in values:
            made[name] = _value(values[name], str(field.type))
        elif field.default is dataclasses.MISSING:
            raise InputError(f"A saved {kind.__name__} lacks {name!r}.")
    return kind(**made)


def loaded(path: str | os.PathLike[str]) -> Any:
    """Return the result in a file that :meth:`Result.save` wrote.

    Parameters
    ----------
    path : path
        ``.json`` or ``.npz``.

    Raises
    ------
    FileError
        If there is no such file, or it holds no result.
    """
    path = Path(path)
    if path.suffix == ".csv":
        raise FileError(f"{path} is a table for other programs; load the .json or .npz of a result.")
    try:
        if path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as file:
                values = {name: _of_array(file[name]) for name in file.files}
        else:
            values = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(values, dict):
            raise FileError(f"{path} holds no result that was saved.")
        found = from_dict(values)
        _use(found)
        return found
    except OSError as error:
        raise FileError(f"{path} cannot be read ({error.strerror}).") from error
    except _DAMAGED as error:
        raise FileError(f"{path} holds no result that was saved: {error}") from error


def _fields(result: Any) -> dict[str, Any]:
    """Return the fields of a dataclass as numbers, texts and lists."""
    found: dict[str, Any] = {}
    for field in dataclasses.fields(result):
        if not field.init:
            continue
        value = getattr(result, field.name)
        if type(value).__name__ == "Estimate":
            found[field.name] = float(value.mean)
            found |= {f"{field.name}_{each}": _plain(getattr(value, each)) for each in _PARTS}
        else:
            found[field.name] = _plain(value)
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, dict):
        return {_key(name): _plain(each) for name, each in value.items()}
    if type(value).__name__ in KINDS:
        return {"kind": type(value).__name__, **_fields(value)}
    return value


def _key(name: Any) -> str:
    return "-".join(map(str, name)) if isinstance(name, tuple) else str(name)


def _use(result: Any) -> None:
    """Raise an error if a result cannot be printed, or its columns do not make a table."""
    str(result)
    if isinstance(result, Result):
        if type(result)._rows is not Result._rows:
            result._rows()
        columns = result._columns().values()
        # A cell of a list may hold several texts; an array has one number in each.
        wrong = any(isinstance(column, np.ndarray) and column.ndim != 1 for column in columns)
        if wrong or len({len(column) for column in columns}) > 1:
            raise InputError("its columns differ in length.")


def _value(value: Any, annotation: str) -> Any:
    """Return the value of a field that a dictionary of texts, numbers and lists holds."""
    kind = annotation.removesuffix(" | None")
    if value is None and kind != annotation:
        return None
    if kind.startswith("dict[tuple") and isinstance(value, dict):
        inner = kind.rsplit(", ", 1)[-1].rstrip("]")
        return {tuple(map(int, name.split("-"))): _value(each, inner) for name, each in value.items()}
    if kind.startswith("tuple[") and isinstance(value, list):
        return tuple(_value(each, kind[6:].split(",")[0]) for each in value)
    if kind in KINDS and isinstance(value, dict) and value.get("kind") == kind:
        return from_dict(value)
    if kind == "np.ndarray" and isinstance(value, list):
        array = np.array(_nested(value, _number))
        if array.dtype.kind in "biuf":
            return array
    if kind in _TYPES and type(number := _number(value)) in _TYPES[kind]:
        return number
    if kind == "str" and isinstance(value, str):
        return value
    raise InputError(f"{checks.describe(value)} is none of the kind {kind}.")


def _number(value: Any) -> Any:
    return float(value) if isinstance(value, str) and value in _NOT_FINITE else value


def _nested(value: Any, leaf: Callable[[Any], Any]) -> Any:
    """Return lists and dictionaries of values, each as ``leaf`` makes it."""
    if isinstance(value, Mapping):
        return {str(name): _nested(each, leaf) for name, each in value.items()}
    return [_nested(each, leaf) for each in value] if isinstance(value, list | tuple) else leaf(value)


def _written(value: Any) -> Any:
    """Return a value for JSON, in which numbers that are not finite are texts."""
    return _nested(value, lambda x: str(x) if isinstance(x, float) and not math.isfinite(x) else x)


def _all(result: Result) -> dict[str, Any]:
    """Return what a file holds of a result."""
    return {**result.to_dict(), **result._saved()}


def as_saved(result: Result) -> dict[str, Any]:
    """Return what a .json file of a ``result`` holds, from which :func:`from_dict` makes it again."""
    found: dict[str, Any] = _written(_all(result))
    return found


def _text(result: Result, indent: int | None = None) -> str:
    return json.dumps(as_saved(result), indent=indent, allow_nan=False, ensure_ascii=False)


def _arrays(result: Result) -> dict[str, np.ndarray]:
    """Return everything as arrays; a list of other things than numbers is JSON."""
    return {name: _array(value) for name, value in _all(result).items()}


def _array(value: Any) -> np.ndarray:
    if isinstance(value, list):
        with contextlib.suppress(ValueError):  # rows of different lengths
            array = np.array(value)
            if array.dtype.kind in "ifb":
                return array
    if value is None or isinstance(value, list | dict):
        return np.array("json:" + json.dumps(_written(value), allow_nan=False))
    return np.array(value)


def _of_array(array: np.ndarray) -> Any:
    value = array.tolist()
    return json.loads(value[5:]) if isinstance(value, str) and value.startswith("json:") else value


def _csv(result: Result) -> str:
    columns = result._columns()
    above = result._above() if result._numbers_above and len(next(iter(columns.values()))) > 1 else {}
    rows = ([_plain(value) for value in row] for row in zip(*columns.values(), strict=True))
    comments = (f"# {name}: {value}\n" for name, value in above.items())
    return "".join(comments) + csv_of(columns, rows, result._digits)


def html_of(caption: str, columns: Mapping[str, Iterable[Any]]) -> str:
    """Return a whole table in HTML, with a caption, from its columns by name."""
    cells = [list(map(shown, row)) for row in zip(*columns.values(), strict=True)]
    return in_html(caption, cells, [name.replace("_", " ") for name in columns])


def shown(value: Any) -> str:
    """Return a value as a cell of a table shows it; one that does not exist is empty."""
    return f"{value:.8g}" if isinstance(value, float) and math.isfinite(value) else str(cell(_plain(value)))


def plain(value: Any) -> Any:
    """Return a value as JSON has it: null for a number that is not finite, lists for tuples."""
    return _nested(value, lambda x: None if isinstance(x, float) and not math.isfinite(x) else x)
