"""The pages of the documentation and their blocks."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
EVERY = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.joinpath("docs").rglob("*.md"))]
EVERY = [page for page in EVERY if not {"_build", "classes", "gallery"} & set(page.parts)]


def blocks(page: Path, language: str) -> list[str]:
    """Return the blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)
