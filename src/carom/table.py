"""One table, declared once: a dataclass whose fields say how they are shown, and every way to show it."""

from __future__ import annotations

import csv
import io
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, make_dataclass
from itertools import repeat
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

from carom.checks import needed
from carom.texts import html, visible

if TYPE_CHECKING:
    from rich.console import Console

GRID = "border-collapse:collapse;font-variant-numeric:tabular-nums"
GAP = 2  # spaces between columns
HEAD, NARROWEST = 12, 24  # characters to which a head and a column of sentences may shrink
WIDEST = 10_000  # characters of a line in a file


@dataclass(frozen=True)
class Column:
    """How a field is shown: ``Z: Annotated[float, Column("Z", error("Z_error"))]``; else in files only."""

    head: str  # with the unit
    form: str | Callable[[Any, Any], str] = ""  # format, or what makes the text of a value and its row
    left: bool = False  # text, which stands on the left
    missing: str = ""  # shown for an unknown number
    key: bool = False  # says which row it is: repeated where a table is split

    def text(self, row: Any, name: str) -> str:
        """Return a value of a row as text."""
        value = getattr(row, name)
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            return self.missing
        return visible(self.form(value, row) if callable(self.form) else format(value, self.form))


def decimals(error: float | None) -> int:
    """Return the number of decimals that show one digit of an error, or two if it begins with 1."""
    if not error or not math.isfinite(error) or error < sys.float_info.min:
        return 6
    exponent = math.floor(math.log10(error))
    return max((1 if error / 10.0**exponent < 1.95 else 0) - exponent, 0)


def error(name: str, *, told: bool = False) -> Callable[[float, Any], str]:
    """Return a form with the decimals of the error in the field ``name``; it is added if it is ``told``."""

    def form(value: float, row: Any) -> str:
        known = getattr(row, name)
        if known is not None and not math.isfinite(known):
            return f"{value:.4g}"  # more digits would look like a small error
        places = decimals(known)
        return f"{value:.{places}f}" + (f" ± {known:.{places}f}" if told else "")

    return form


@dataclass(frozen=True)
class Table(Sequence[Any]):
    """Rows of one dataclass: a sequence that knows how it is shown."""

    kind: type
    rows: Sequence[Any]
    title: str = ""
    notes: Sequence[str] = ()  # sentences below the table
    flagged: Callable[[Any], bool] = field(default=lambda row: False, compare=False)
    """Whether a row is marked."""
    only: Sequence[str] = ()  # names of the columns shown, if not all

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, k: Any) -> Any:
        return self.rows[k]

    def names(self) -> tuple[str, ...]:
        """Return the names of all fields: the keys in files."""
        return tuple(get_type_hints(self.kind))

    def dictionaries(self) -> list[dict[str, Any]]:
        """Return the rows as dictionaries with the names of all fields."""
        names = self.names()
        return [{name: getattr(row, name) for name in names} for row in self.rows]

    def csv(self) -> str:
        """Return the rows as CSV; numbers that are not finite are empty."""
        return csv_of(self.names(), (row.values() for row in self.dictionaries()))

    def to_dataframe(self) -> Any:
        """Return the rows as a pandas DataFrame; InputError without pandas."""
        pandas = needed("pandas", "A DataFrame", "pandas, or save the table as .csv")
        return pandas.DataFrame(self.dictionaries(), columns=list(self.names()))

    def columns(self) -> list[tuple[str, Column]]:
        """Return the names of the fields that are shown, and how."""
        found = _columns(get_type_hints(self.kind, include_extras=True))
        return [(name, column) for name, column in found if not self.only or name in self.only]

    def _cells(self) -> tuple[list[Column], list[list[str]]]:
        """Return the columns that are shown, and their texts row by row."""
        found = self.columns()
        return [mark for _, mark in found], [[mark.text(row, n) for n, mark in found] for row in self.rows]

    def html(self) -> str:
        """Return the table in HTML."""
        columns, rows = self._cells()
        sides = [' class="text"' if column.left else "" for column in columns]
        heads = [column.head for column in columns]
        head = f"<tr>{_in_html('th', heads, sides)}</tr>" if any(heads) else ""
        marks = [' class="flagged"' * self.flagged(row) for row in self.rows]
        lines = (_in_html("td", texts, sides) for texts in rows)
        body = "\n".join(f"<tr{mark}>{line}</tr>" for mark, line in zip(marks, lines, strict=True))
        caption = f"<caption>{html(self.title)}</caption>" if self.title else ""
        notes = "".join(f"<p>{html(note)}</p>" for note in self.notes)
        return f'<div class="scroll"><table>{caption}{head}\n{body}</table></div>{notes}'

    _repr_html_ = html

    def rich(self, console: Console) -> Any:
        """Return the table for a terminal or a file, each row a row; without rows title and notes.

        On a terminal that is too narrow, heads and sentences are wrapped, and columns that still have no room
        stand below, again with those that name the row. In a file every line is whole, however long.
        """
        from rich.text import Text

        parts: list[Any] = [Text(self.title, "bold")] if self.title else []
        if self.rows:
            columns, rows = self._cells()
            heads, groups = _laid_out(columns, rows, console.width if console.is_terminal else WIDEST)
            for group in groups:
                parts += ["", self._beside([(columns[k], heads[k], [row[k] for row in rows]) for k in group])]
            parts.append("")
        return _Below([*parts, *(Text(visible(note)) for note in self.notes)])

    def _beside(self, columns: Sequence[tuple[Column, str, Sequence[str]]]) -> Any:
        """Return columns with their heads and texts as a table of Rich."""
        from rich import box
        from rich.table import Table as Rich
        from rich.text import Text

        made = Rich(
            box=box.SIMPLE_HEAD,
            show_edge=False,
            pad_edge=False,
            collapse_padding=True,
            show_header=any(head for _, head, _ in columns),
        )
        for column, head, _ in columns:
            side: Any = "left" if column.left else "right"
            made.add_column(Text(head), justify=side, no_wrap=not column.left, overflow="fold")
        for row, *texts in zip(self.rows, *(texts for _, _, texts in columns), strict=True):
            made.add_row(*map(Text, texts), style="red" if self.flagged(row) else None)
        return made

    def __str__(self) -> str:
        from rich.console import Console

        out = io.StringIO()
        console = Console(file=out, color_system=None, highlight=False, force_jupyter=False)
        console.print(self.rich(console), crop=False)
        return "\n".join(line.rstrip() for line in out.getvalue().splitlines()).strip("\n")


def _laid_out(
    columns: Sequence[Column], rows: Sequence[Sequence[str]], width: int
) -> tuple[list[str], list[list[int]]]:
    """Return the heads of columns, and which columns stand beside each other on lines of ``width``."""
    from rich.cells import cell_len

    heads = [column.head for column in columns]
    texts = [max(map(cell_len, each)) for each in zip(*rows, strict=True)]
    wide = [max(cell_len(head), text) for head, text in zip(heads, texts, strict=True)]
    keys = [k for k, column in enumerate(columns) if column.key]
    if sum(wide) + GAP * (len(wide) - 1) <= width:
        return heads, [list(range(len(columns)))]
    heads = ["\n".join(wrap(head, max(text, HEAD))) for head, text in zip(heads, texts, strict=True)]
    texts = [min(t, NARROWEST) if c.left and not c.key else t for t, c in zip(texts, columns, strict=True)]
    wide = [max([text, *map(cell_len, head.split("\n"))]) for head, text in zip(heads, texts, strict=True)]
    groups = [list(keys)]
    for k in (k for k, column in enumerate(columns) if not column.key):
        longer = [*groups[-1], k]
        if len(groups[-1]) > len(keys) and sum(wide[j] + GAP for j in longer) - GAP > width:
            groups.append(list(keys))
        groups[-1].append(k)
    return heads, groups


@dataclass(frozen=True)
class _Below:
    """Lines and tables, one below the other."""

    parts: list[Any]

    def __rich_console__(self, console: Any, options: Any) -> Iterator[Any]:
        from rich.table import Table as Rich

        whole = options if console.is_terminal else options.update(width=WIDEST)
        for part in self.parts:
            yield from console.render(part, whole if isinstance(part, Rich) else options)


def of_texts(
    heads: Sequence[str],
    rows: Iterable[Sequence[str]],
    title: str = "",
    notes: Sequence[str] = (),
    left: int = 1,
) -> Table:
    """Return a table of texts with ``left`` columns on the left; rows may lack their last cells."""
    marks = [Annotated[str, Column(head, left=k < left, key=k == 0)] for k, head in enumerate(heads)]
    kind = make_dataclass("Texts", [(f"column_{k}", mark, "") for k, mark in enumerate(marks)], frozen=True)
    return Table(kind, [kind(*row) for row in rows], title, notes)


def facts(title: str, pairs: Iterable[tuple[str, str]], notes: Sequence[str] = ()) -> Table:
    """Return a table of names and values, without heads."""
    return of_texts(("", ""), pairs, title, notes, left=2)


def in_html(title: str, rows: Iterable[Sequence[str]], heads: Sequence[str] = ()) -> str:
    """Return a short table for a notebook: rows whose first cell is a name, perhaps below column heads."""
    head = f"<tr>{_in_html('th', heads)}</tr>" if heads else ""
    body = "".join(f"<tr>{_in_html('th', row[:1])}{_in_html('td', row[1:])}</tr>" for row in rows)
    return f'<table style="{GRID}"><caption>{html(title)}</caption>{head}{body}</table>'


def _in_html(tag: str, texts: Sequence[str], sides: Sequence[str] = ()) -> str:
    """Return the cells of a row; ``sides`` are their attributes."""
    return "".join(f"<{tag}{s}>{html(t)}</{tag}>" for t, s in zip(texts, sides or repeat(""), strict=False))


def _columns(hints: dict[str, Any]) -> Iterator[tuple[str, Column]]:
    for name, hint in hints.items():
        for mark in getattr(hint, "__metadata__", ()):
            if isinstance(mark, Column):
                yield name, mark


def csv_of(heads: Iterable[str], rows: Iterable[Iterable[Any]], digits: str = "") -> str:
    """Return a table as CSV: floats with all digits, or by a format, and nothing for what is unknown."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows([cell(value, digits) for value in row] for row in rows)
    return out.getvalue()


def cell(value: Any, digits: str = "") -> Any:
    """Return a number, text or list as CSV has it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return format(float(value), digits) if math.isfinite(value) else ""
    return "; ".join(map(str, value)) if isinstance(value, list | tuple) else value
