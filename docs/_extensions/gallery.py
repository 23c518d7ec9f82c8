"""The gallery: a page for every script in ``examples``, and one page with all of them.

A new example appears by itself. Its page shows the docstring, the cells (comment as text, code as code), the
pictures ``docs/images/NAME*`` and what it printed, ``docs/images/NAME.txt``. A build runs nothing
(decision 37). ``python docs/_extensions/pictures.py NAME`` runs an example and stores both.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

from sphinx.application import Sphinx

EXAMPLES = Path(__file__).parents[2] / "examples"
IMAGES = Path(__file__).parents[1] / "images"
MARK = "{{ gallery }}"
SUFFIXES = (".gif", ".png", ".webp")


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


def page(script: Path) -> str:
    """Return the page of one example in Markdown."""
    text, name = script.read_text(encoding="utf-8"), script.stem
    docstring = ast.get_docstring(ast.parse(text)) or ""
    first, _, rest = docstring.partition("\n")
    lines = [f"# {title(name)}", "", first, ""]
    for paragraph in rest.strip().split("\n\n"):
        command = " ".join(paragraph.split())
        lines += ["```bash", command, "```", ""] if command.startswith("python ") else [paragraph, ""]
    lines += [
        f"```{{image}} ../images/{picture.name}\n:alt: {first}\n```\n" for picture in own_pictures(name)
    ]
    printed = IMAGES / f"{name.replace('_', '-')}.txt"
    if printed.exists():
        lines += ["It prints", "", "```text", printed.read_text(encoding="utf-8").rstrip(), "```", ""]
    lines += ["## The script", ""]
    for words, code in cells(text):
        lines += [words, ""]
        if code:
            lines += ["```python", code, "```", ""]
    return "\n".join(lines)


def cards() -> str:
    """Return the grid of all examples, those with a picture first."""
    scripts = sorted(EXAMPLES.glob("*.py"), key=lambda path: (not own_pictures(path.stem), path.stem))
    lines = ["::::{grid} 1 2 2 3", ":gutter: 3", ""]
    for script in scripts:
        shown = own_pictures(script.stem)
        lines += [
            ":::{grid-item-card} " + title(script.stem),
            f":link: gallery/{script.stem}",
            ":link-type: doc",
        ]
        lines += [f":img-top: images/{shown[0].name}"] if shown else []
        lines += ["", summary(script.read_text(encoding="utf-8")), ":::", ""]
    listed = "\n".join(f"gallery/{script.stem}" for script in sorted(EXAMPLES.glob("*.py")))
    return "\n".join([*lines, "::::", "", "```{toctree}", ":hidden:", "", listed, "```"])


def write_pages(app: Sphinx) -> None:
    """Write the page of every example, and remove those of examples that are gone."""
    folder = Path(app.srcdir) / "gallery"
    folder.mkdir(exist_ok=True)
    wanted = {folder / f"{script.stem}.md": page(script) for script in EXAMPLES.glob("*.py")}
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
        source[0] = source[0].replace(MARK, cards())


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("builder-inited", write_pages)
    app.connect("source-read", show_cards)
    # The cards change with the examples, not with their own page.
    app.connect("env-get-outdated", lambda *_: ["gallery"])
    return {"parallel_read_safe": True, "parallel_write_safe": True}
