"""Tables that fit the terminal: a wider one is printed with one value per line."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from carom.texts import visible


class Screen(Console):
    """A terminal on which every string is text: no markup, and nothing in it acts on the terminal."""

    def __init__(self, **settings: Any):
        super().__init__(highlight=False, **settings)

    def render_str(self, text: str, **settings: Any) -> Text:
        """Return a string as Rich prints it; cells, titles and captions of tables are made here, too."""
        plain = {**settings, "markup": False, "emoji": False}
        return super().render_str(visible(text, lines=True), **plain)


def show(console: Console, table: Table) -> None:
    """Print a table, with one value per line if it is wider than the terminal."""
    console.print(fitted(console, table))


def fitted(console: Console, table: Table) -> Any:
    """Return a table if it fits, or else its rows one below the other.

    The title and the caption are wrapped, so they do not count for the width. Of a table without rows they
    are all there is.
    """
    title, caption = table.title, table.caption
    table.title = table.caption = None
    wide = Measurement.get(console, console.options.update(max_width=10_000), table).maximum
    table.title, table.caption = title, caption
    if wide <= console.width and table.row_count:
        return table
    columns = [(str(column.header), [str(cell) for cell in column.cells]) for column in table.columns]
    lines = [str(title)] if title else []
    for row in range(table.row_count):
        (_, first), *rest = [(name, cells[row]) for name, cells in columns]
        shown = [(name, cell) for name, cell in rest if cell]
        if len(rest) == 1:
            lines.append(f"{first}: {rest[0][1]}")
        else:
            name = columns[0][0]
            lines.append(f"{name} {first}".strip())
            lines += [f"  {name}: {cell}" if name else f"  {cell}" for name, cell in shown]
    if caption:
        lines.append(str(caption))
    return "\n".join(lines)
