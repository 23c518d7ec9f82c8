"""Citations of the paper: all by one edition, which one page names, each of what stands there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

EDITION = "arXiv:cond-mat/0503627"
"""Its figures are numbered by section, and its equations throughout."""

SECTIONS = {
    "1": ("Introduction", "naive"),
    "2": ("Basic operations", "basic functions"),
    "3": ("Data organization", "old and (the )?new"),
    "4": ("The algorithm", "main cycle"),
    "5": ("Simple example", "four balls"),
    "6": (
        "Comments on the practical execution of the algorithm",
        "rounding|touches|negative root|advancement",
    ),
    "7": ("Consistency of basic operations", "[Cc]onditions|correct"),
    "8": ("Invariants and correctness proof", "[Ii]nvariant"),
    "9": ("An application example: disk packing problem", "jam|grow|[Gg]rowing|disks"),
    "10": ("Comparing practical performance of the algorithm", "counted|counts as two"),
    "11": ("Other billiard-like simulations", "circles|caps|codes|combat|rules|constant parts"),
}
"""Sections: their titles, and what a text that cites one speaks of."""

FIGURES = {
    "4.1": "algorithm", "6.1": "cycle|algorithm|search|delayed|third party|computed", "5.2": "event|balls",
    "5.3": "event|balls", "7.1": "meet a third", "8.1": "asynchronous",
}  # fmt: skip
EQUATIONS = {"2": "Return the time until|digits|first_contact"}
INVARIANTS = {
    "13": "old event|past before|after any cycle|reference.figures",
    "14": "earliest possible|overlooked|half processed|beyond|condition VI|after an interaction",
    "15": "partner|obstacle|N \\+ 1|for i in range",
    "16": "earliest new event|proof|half processed|overlooked|reference.figures",
}

KINDS = {
    r"\b[Ss]ecs?\. (\d+)(?:, (\d+))?(?![\d.]*\d)": {number: words for number, (_, words) in SECTIONS.items()},
    r"\bFigures? (\d+(?:\.\d+)?)(?: and (\d+(?:\.\d+)?))?": FIGURES,
    r"(?:1991\)?, |\| |root of )eq\. \(?(\d+)\)?": EQUATIONS,
    r"\b[Ii]nvariants? \((\d+)\)(?: to \((\d+)\))?": INVARIANTS,
}
"""How each kind of place is cited, and the table of its places."""


def texts() -> dict[str, str]:
    """Return what may cite the paper, by path."""
    paths = [*ROOT.glob("src/carom/**/*.py"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/*.py")]
    return {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in sorted(paths)}


def wrong(text: str) -> Iterator[str]:
    """Yield the citations of a text of what is not there: no such place, or the text speaks of another."""
    for pattern, table in KINDS.items():
        for cited in re.finditer(pattern, text):
            near = re.sub(r"\s+", " ", text[max(cited.start() - 300, 0) : cited.end() + 200])
            for number in filter(None, cited.groups()):
                if number not in table or not re.search(table[number], near):
                    yield cited[0]


def test_every_citation_of_the_paper_is_of_what_stands_there():
    found = {name: list(wrong(text)) for name, text in texts().items()}
    assert {name: cited for name, cited in found.items() if cited} == {}
    counts = [len(re.findall(pattern, "\n".join(texts().values()))) for pattern in KINDS]
    assert min(counts) >= 2
    assert sum(counts) > 25


def test_one_page_names_the_edition():
    assert [name for name, text in texts().items() if EDITION in text] == ["docs/notation.md"]


@pytest.mark.parametrize(
    "text",
    [
        "Spheres grow until they jam (the paper's sec. 8).",  # of the journal's numbering
        "The invariants of sec. 9 hold.",
        "As Figure 2 says, line 14 of the main cycle.",
        "Invariants (6) to (9): no old event is later.",
        "The root of eq. (3), with all digits.",
    ],
)
def test_a_citation_by_another_edition_is_found(text):
    assert list(wrong(text))


def test_other_books_have_sections_of_sections():
    assert list(wrong("Evans and Morriss, 2nd ed. (2008), sec. 6.3, and sec. 10.21 of another.")) == []
