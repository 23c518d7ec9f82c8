"""``{{ options }}`` and ``{{ keys SECTION }}`` in a page: what commands and scene files take.

A new option or key appears by itself, with the help that ``carom COMMAND --help`` shows.
"""

from __future__ import annotations

import re

from sphinx.application import Sphinx
from typer.main import get_command

from carom.cli import app as carom
from carom.cli.templates import table

OPTIONS = re.compile(r"^\{\{ options \}\}$", re.MULTILINE)
KEYS = re.compile(r"^\{\{ keys (?P<section>\w+) \}\}$", re.MULTILINE)


def plain(text: str) -> str:
    """Return a help text of the screen as a cell of a table."""
    text = re.sub(r"(?<!\\)\[/?(?:bold|dim)\]", "", text).replace("\\[", "[")
    return " ".join(text.split()).replace("|", "\\|").replace("<", "\\<").rstrip(".")


def options() -> str:
    """Return the options of every command, each command behind a line that opens."""
    lines = []
    for name, command in get_command(carom).commands.items():  # type: ignore[attr-defined]
        lines += [f":::{{dropdown}} carom {name}", "", plain(command.help.partition("[bold]")[0]), ""]
        lines += ["| option | meaning |", "|---|---|"]
        for each in command.params:
            if not getattr(each, "hidden", False):
                words = each.opts if each.param_type_name == "option" else [each.name.upper()]
                said = plain(getattr(each, "help", None) or "")
                lines.append(f"| {', '.join(f'`{word}`' for word in words)} | {said} |")
        lines += [":::", ""]
    return "\n".join(lines)


def expand(app: Sphinx, docname: str, source: list[str]) -> None:
    """Replace every request in a page."""
    if OPTIONS.search(source[0]):
        made = options()
        source[0] = OPTIONS.sub(lambda _: made, source[0])
    source[0] = KEYS.sub(lambda found: table(found["section"]), source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("source-read", expand)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
