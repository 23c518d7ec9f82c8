"""What every result of a study has: a print, a table, a picture, a file."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from carom import notebook
from carom.errors import InputError
from carom.io.paths import replacing, writing
from carom.texts import visible

PICTURES = (".png", ".pdf", ".svg")
"""Suffixes of pictures."""


class Result:
    """A result that prints itself, draws itself and becomes a dictionary, a table or a file."""

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON values by name; a number that does not exist is None."""
        raise NotImplementedError

    def rows(self) -> list[dict[str, Any]]:
        """Return the lines of the table, each a dictionary with the same keys."""
        return [self.to_dict()]

    def columns(self) -> tuple[str, ...]:
        """Return the names of the columns of the table."""
        rows = self.rows()
        return tuple(rows[0]) if rows else ()

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Draw the result, and save the picture to the file ``path`` if there is one."""
        raise NotImplementedError

    def to_dataframe(self) -> Any:
        """Return the table as a pandas DataFrame.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise InputError(
                "A DataFrame needs the package pandas; pip install pandas, or save the table as .csv."
            ) from None
        return pandas.DataFrame(self.rows(), columns=list(self.columns()))

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table to the file ``path``; unknown numbers are empty.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        columns = self.columns()
        write_csv(path, columns, ([_cell(row[name]) for name in columns] for row in self.rows()))

    def to_json(self, path: str | PathLike[str]) -> None:
        """Write the dictionary to the file ``path``, from which :func:`carom.load` makes the result again.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        path = Path(path)
        words = {"kind": type(self).__name__, **self.to_dict(), **self._saved()}
        text = json.dumps(words, indent=1, allow_nan=False) + "\n"
        with replacing(path) as temporary, writing(path):
            temporary.write_text(text, encoding="utf-8")

    def _saved(self) -> dict[str, Any]:
        """Return what else a JSON file holds, so that the result can be made again."""
        return {}

    def save(self, path: str | PathLike[str]) -> None:
        """Write the file ``path``; its suffix chooses what: .json, .csv, or a picture (.png, .pdf, .svg).

        Raises
        ------
        InputError
            If the suffix is another one.
        FileError
            If the file cannot be written.
        """
        suffix, writers = Path(path).suffix.lower(), self._writers()
        if suffix not in writers:
            raise InputError(f"{path} has the suffix '{suffix}'; expected one of {', '.join(writers)}.")
        writers[suffix](path)

    def _writers(self) -> dict[str, Callable[..., object]]:
        """Return the function that writes a file, by its suffix."""
        return {".json": self.to_json, ".csv": self.to_csv, **dict.fromkeys(PICTURES, self.plot)}

    def _lines(self) -> Sequence[str]:
        """Return what is printed: three lines at most."""
        raise NotImplementedError

    def __str__(self) -> str:
        return visible("\n".join(self._lines()), lines=True)

    def _repr_html_(self) -> str:
        head = [name.replace("_", " ") for name in self.columns()]
        cells = [[shown(value) for value in row.values()] for row in self.rows()]
        return notebook.table(self._lines()[0], cells, head)


def shown(value: Any) -> str:
    """Return a value as a cell of a table shows it."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    if isinstance(value, float):
        return f"{value:.8g}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "; ".join(map(str, value))
    return str(value)


def plain(value: Any) -> Any:
    """Return a value as JSON has it: null for a number that is not finite, lists for tuples."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return value


def value_with_error(mean: float | None, error: float | None) -> str:
    """Return a value with its standard error in brackets: 6.92(4)."""
    if mean is None or not math.isfinite(mean):
        return "unknown"
    if error is None or not math.isfinite(error):
        return f"{mean:.6g}(?)"
    if error <= 0.0:
        return f"{mean:.8g}"
    exponent = math.floor(math.log10(error))
    digits = max((1 if error / 10.0**exponent < 1.95 else 0) - exponent, 0)
    if digits == 0:
        return f"{mean:.0f}({error:.0f})"
    return f"{mean:.{digits}f}({round(error * 10**digits)})"


def _cell(value: Any) -> Any:
    """Return a value of the table as the CSV file has it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else ""
    return "; ".join(map(str, value)) if isinstance(value, Sequence) and not isinstance(value, str) else value


def write_csv(path: str | PathLike[str], columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table with the names of the columns as its first line.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    path = Path(path)
    with (
        replacing(path) as temporary,
        writing(path),
        temporary.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)
