"""What the commands print on."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.text import Text

from carom.texts import visible


class Screen(Console):
    """A terminal on which every string is text: no markup, and nothing in it acts on the terminal.

    In a file nothing is cut.
    """

    def __init__(self, **settings: Any):
        super().__init__(highlight=False, **settings)

    def render_str(self, text: str, **settings: Any) -> Text:
        """Return a string as Rich prints it; cells, titles and captions of tables are made here, too."""
        plain = {**settings, "markup": False, "emoji": False}
        return super().render_str(visible(text, lines=True), **plain)

    def print(self, *objects: Any, **settings: Any) -> None:
        """Print as Rich does; only on a terminal are lines cut."""
        super().print(*objects, **{"crop": self.is_terminal, **settings})
