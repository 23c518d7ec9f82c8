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

from execution import Result, results
from pictures import Failed
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util import logging

EXAMPLES = Path(__file__).parents[2] / "examples"
IMAGES = Path(__file__).parents[1] / "images"
MARK = "{{ gallery }}"
SUFFIXES = (".gif", ".png", ".webp")
MADE = "made"
"""Folder of the pictures that this build made, beside the pages."""
BUILT: dict[str, Result] = {}
"""What the examples made in this build."""
SMALL = [
    "The build of these pages ran the script with `--smoke`: few particles, short runs, the same code.",
    "What stands above took longer.",
]


def pictures(name: str) -> list[Path]:
    """Return the committed pictures of an example, the one that moves first."""
    wanted = name.replace("_", "-")
    found = [path for path in IMAGES.glob("*") if path.suffix in SUFFIXES]
    return sorted(
        (path for path in found if re.fullmatch(rf"{wanted}(-.*)?", path.stem.replace("_", "-"))),
        key=lambda path: (path.suffix != ".gif", path.stem),
    )


def others(name: str) -> set[str]:
    """Return the names of examples that begin with this one's: their pictures are not its own."""
    return {path.stem for path in EXAMPLES.glob("*.py") if path.stem.startswith(f"{name}_")}


def own_pictures(name: str) -> list[Path]:
    """Return the pictures of an example without those of an example with a longer name."""
    taken = {picture for other in others(name) for picture in pictures(other)}
    return [picture for picture in pictures(name) if picture not in taken]


def title(name: str) -> str:
    """Return the name of a script as words."""
    return name.replace("_", " ").capitalize()


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
        fresh = shown([f"{MADE}/{picture.name}" for picture in made.pictures], made.printed, first)
        if made.full or not stored:
            stored = fresh
        else:
            stored += ["## Run when this page was made", "", *SMALL, "", *fresh]
    lines += [*stored, "## The script", ""]
    for words, code in cells(text):
        lines += [words, ""]
        if code:
            lines += ["```python", code, "```", ""]
    return "\n".join(lines)


def card_picture(name: str, made: Result | None) -> str | None:
    """Return the picture of an example's card: that of full size if there is one."""
    stored = own_pictures(name)
    if made is not None and made.pictures and (made.full or not stored):
        return f"gallery/{MADE}/{made.pictures[0].name}"
    return f"images/{stored[0].name}" if stored else None


def cards(made: dict[str, Result]) -> str:
    """Return the grid of all examples, those with a picture first."""
    pictured = {path: card_picture(path.stem, made.get(path.stem)) for path in EXAMPLES.glob("*.py")}
    lines = ["::::{grid} 1 2 2 3", ":gutter: 3", ""]
    for script in sorted(pictured, key=lambda path: (pictured[path] is None, path.stem)):
        lines += [
            ":::{grid-item-card} " + title(script.stem),
            f":link: gallery/{script.stem}",
            ":link-type: doc",
        ]
        lines += [f":img-top: {pictured[script]}"] if pictured[script] else []
        lines += ["", summary(script.read_text(encoding="utf-8")), ":::", ""]
    listed = "\n".join(f"gallery/{script.stem}" for script in sorted(pictured))
    return "\n".join([*lines, "::::", "", "```{toctree}", ":hidden:", "", listed, "```"])


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
