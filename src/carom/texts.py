"""Text from outside, for each medium: names of files and species, notes, titles, reasons of other programs.

Whatever such a text holds, it is shown as it is, and means nothing to a terminal, a browser or matplotlib.
Each medium has one function here.
"""

from __future__ import annotations

import html as markup
import json
import os
import shlex
import unicodedata
from typing import Any

HIDDEN = frozenset(("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"))
"""Categories of characters that act on the screen or the direction of a text, or are no characters."""


def visible(text: Any, *, lines: bool = False) -> str:
    """Return a text whose unseen characters are escaped; with ``lines`` ends of lines stay."""
    text = str(text)
    if text.isprintable():
        return text
    return "".join(c if (lines and c == "\n") or not _acts(c) else _escape(c) for c in text)


def _acts(character: str) -> bool:
    return unicodedata.category(character) in HIDDEN


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def html(text: Any) -> str:
    """Return a text for HTML, between tags or inside the quotes of an attribute."""
    return markup.escape(visible(text, lines=True), quote=True)


def script(values: Any) -> str:
    """Return values as JSON for an element ``script``, which nothing in them can end."""
    text = json.dumps(values, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def label(text: Any) -> str:
    """Return a text for matplotlib, which takes dollar signs for mathematics and hides what begins with _."""
    shown = visible(text).replace("$", r"\$")
    return f"\N{ZERO WIDTH SPACE}{shown}" if shown.startswith("_") else shown


def typed(command: str, *paths: str | os.PathLike[str]) -> str:
    """Return a command with paths, as it is typed: no shell splits them, and none is taken for an option."""
    texts = (os.fspath(path) for path in paths)
    return " ".join([command, *(shlex.quote(f"./{t}" if t.startswith("-") else t) for t in texts)])


def counted(number: int, name: str) -> str:
    """Return a number of things with their name in the singular or plural: ``1 point``, ``2 tries``."""
    plural = name[:-1] + "ies" if name.endswith("ry") else name + ("es" if name.endswith("s") else "s")
    return f"{number} {name if number == 1 else plural}"


def with_article(name: str) -> str:
    """Return a name after "a" or "an"."""
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


def particles(dimension: int, number: int = 2) -> str:
    """Return the word for `number` particles: "rods", "disk", "spheres in 4D"."""
    name = {1: "rod", 2: "disk"}.get(dimension, "sphere") + ("" if number == 1 else "s")
    return f"{name} in {dimension}D" if dimension > 3 else name


def axis_name(axis: int) -> str:
    """Return the name of an axis: x, y, z, and axis3 from the fourth on."""
    return "xyz"[axis] if axis < 3 else f"axis{axis}"


def span(values: Any) -> str:
    """Return the smallest and the largest value of an array as text, or one if they are equal."""
    low, high = float(values.min()), float(values.max())
    return f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"


def superscript(exponent: int) -> str:
    """Return an exponent as it is written; nothing for 1."""
    return "".join("⁰¹²³⁴⁵⁶⁷⁸⁹"[int(digit)] for digit in str(exponent)) if exponent > 1 else ""
