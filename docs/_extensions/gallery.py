"""The gallery: a page for every script in ``examples``, and one page with all of them.

A new example appears by itself. Its page shows the docstring, the cells (comment as text, code as code), its
pictures and what it printed. A build runs every example (``execution.py``, decision 16). For examples that
take long it also shows what is stored: the pictures ``docs/images/NAME*`` and the output
``docs/images/NAME.txt``. ``python docs/_extensions/pictures.py NAME`` makes both. ``sphinx-build -t stored``
runs nothing and shows what is stored.
"""

from __future__ import annotations

import ast
import re
import shutil
from pathlib import Path

from example_groups import EXAMPLES, GROUPS, IMAGES, THUMBNAILS, own_pictures
from execution import Result, results
from pictures import Failed, store_dark
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util import logging

MARK = "{{ gallery }}"
MADE = "made"
"""Folder of the pictures that this build made, beside the pages."""
BUILT: dict[str, Result] = {}
"""What the examples made in this build."""
SMALL = [
    "The build of these pages ran the script with `--smoke`: few particles, short runs, the same code.",
    "What stands above took longer.",
]


def title(name: str) -> str:
    """Return the title of an example.

    Raises
    ------
    ExtensionError
        If the example is in no group.
    """
    for group in GROUPS.values():
        if name in group:
            return group[name]
    raise ExtensionError(f"examples/{name}.py is in no group: give it a title in GROUPS.")


def summary(text: str) -> str:
    """Return the first line of a script's docstring."""
    return (ast.get_docstring(ast.parse(text)) or "").splitlines()[0]


def cells(text: str) -> list[tuple[str, str]]:
    """Return the cells of a percent script as pairs of text and code."""
    found = []
    for cell in re.split(r"^# %% ", text, flags=re.MULTILINE)[1:]:
        lines = cell.splitlines()
        k = 1
        while k < len(lines) and lines[k].startswith("#"):
            k += 1
        words = " ".join([lines[0], *(line.lstrip("# ") for line in lines[1:k])])
        found.append((words, "\n".join(lines[k:]).strip("\n")))
    return found


def shown(pictures: list[str], printed: str | None, alternative: str) -> list[str]:
    """Return pictures and printed lines in Markdown."""
    lines = [f"```{{image}} {picture}\n:alt: {alternative}\n```\n" for picture in pictures]
    if printed and printed.strip():
        lines += ["It prints", "", "```text", printed.rstrip(), "```", ""]
    return lines


def page(script: Path, made: Result | None) -> str:
    """Return the page of one example in Markdown, with what a run ``made`` if there was one."""
    text, name = script.read_text(encoding="utf-8"), script.stem
    docstring = ast.get_docstring(ast.parse(text)) or ""
    first, _, rest = docstring.partition("\n")
    lines = [f"# {title(name)}", "", first, ""]
    for paragraph in rest.strip().split("\n\n"):
        command = " ".join(paragraph.split())
        lines += ["```bash", command, "```", ""] if command.startswith("python ") else [paragraph, ""]
    printed = IMAGES / f"{name.replace('_', '-')}.txt"
    stored = shown(
        [f"../images/{picture.name}" for picture in own_pictures(name)],
        printed.read_text(encoding="utf-8") if printed.exists() else None,
        first,
    )
    if made is not None:
        light = [f"{MADE}/{each.name}" for each in made.pictures if not each.stem.endswith("-dark")]
        fresh = shown(light, made.printed, first)
        if made.full or not stored:
            stored = fresh
        else:
            stored += ["## Run when this page was made", "", *SMALL, "", *fresh]
    lines += [*stored, "## The script", "", f"[Download the script](path:../../examples/{script.name}).", ""]
    for words, code in cells(text):
        lines += [words, ""]
        if code:
            lines += ["```python", code, "```", ""]
    return "\n".join(lines)


def card_picture(name: str, made: Result | None) -> str | None:
    """Return the picture of an example's card: its thumbnail, else that of full size if there is one."""
    thumbnail = THUMBNAILS / f"{name.replace('_', '-')}.png"
    if thumbnail.exists():
        return f"images/{thumbnail.parent.name}/{thumbnail.name}"
    stored = own_pictures(name)
    if made is not None and made.pictures and (made.full or not stored):
        return f"gallery/{MADE}/{made.pictures[0].name}"
    return f"images/{stored[0].name}" if stored else None


def cards(made: dict[str, Result]) -> str:
    """Return a grid of cards for each group, and the hidden list of all pages."""
    lines = []
    for group, titles in GROUPS.items():
        lines += [f"## {group}", "", "::::{grid} 1 2 2 3", ":gutter: 3", ""]
        for name, heading in titles.items():
            picture = card_picture(name, made.get(name))
            about = summary(EXAMPLES.joinpath(f"{name}.py").read_text(encoding="utf-8"))
            lines += [":::{grid-item-card} " + heading, f":link: gallery/{name}", ":link-type: doc"]
            lines += [f":img-top: {picture}", f":img-alt: {about}"] if picture else []
            lines += ["", about, ":::", ""]
        lines += ["::::", ""]
    listed = "\n".join(f"gallery/{name}" for titles in GROUPS.values() for name in titles)
    return "\n".join([*lines, "```{toctree}", ":hidden:", "", listed, "```"])


def write_pages(app: Sphinx) -> None:
    """Run the examples, write the page of each, and remove those of examples that are gone.

    Raises
    ------
    ExtensionError
        If an example ends with an error.
    """
    folder = Path(app.srcdir) / "gallery"
    scripts = sorted(EXAMPLES.glob("*.py"))
    try:
        made = {} if app.tags.has("stored") else results(scripts, logging.getLogger(__name__).info)
    except Failed as error:
        raise ExtensionError(f"The gallery cannot be built: {error}") from None
    BUILT.clear()
    BUILT.update(made)
    shutil.rmtree(folder / MADE, ignore_errors=True)
    folder.joinpath(MADE).mkdir(parents=True)
    for result in made.values():
        for picture in result.pictures:
            shutil.copy2(picture, folder / MADE)
    store_dark(folder / MADE)
    wanted = {folder / f"{script.stem}.md": page(script, made.get(script.stem)) for script in scripts}
    for path in set(folder.glob("*.md")) - set(wanted):
        path.unlink()
    for path, text in wanted.items():
        if (
            not path.exists() or path.read_text(encoding="utf-8") != text
        ):  # unchanged pages are not read again
            path.write_text(text, encoding="utf-8")


def show_cards(app: Sphinx, docname: str, source: list[str]) -> None:
    """Replace the mark in the gallery's own page."""
    if docname == "gallery":
        source[0] = source[0].replace(MARK, cards(BUILT))


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("builder-inited", write_pages)
    app.connect("source-read", show_cards)
    # The cards change with the examples, not with their own page.
    app.connect("env-get-outdated", lambda *_: ["gallery"])
    return {"parallel_read_safe": True, "parallel_write_safe": True}
