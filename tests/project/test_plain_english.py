"""Pages are read once: short sentences, and the field's words.

``python tests/project/test_plain_english.py [PAGE ...]`` prints, for each page, words per sentence,
sentences, and the longest one.
"""

import re
import sys
from pathlib import Path

from helpers.sentences import sentences

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.joinpath("docs").rglob("*.md")]
PAGES = sorted(page for page in PAGES if not {"_build", "classes", "gallery", "api"} & set(page.parts))
# Words per sentence. Readers of English as a second language lose the thread at some 25 words.
MEAN, LONGEST = 20.0, 70


# What was once written, and what says it. A reader should not have to guess.
GUESSED = {
    "the very bits": "bit-identical",
    "on the side": "does not affect the trajectory",
    "beside theory": "compared with theory",
    "beside published": "compared with published",
    "are beside nothing": "have no theory column",
    "touches nothing": "no file is changed",
    "how many errors": "(measured - theory) / standard error",
    "squared errors": "mean of the squared deviation in standard errors",
    "next to none": "few",
}


def paragraphs(text: str) -> list[str]:
    """Return the paragraphs and list entries of a page, without code, formulas, tables and headings."""
    text = re.sub(r"^(?P<fence>`{3,}|:{3,}).*?^(?P=fence)\s*$", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"\$\$.*?\$\$", "", text, flags=re.DOTALL)
    found, current = [], []
    for line in [*text.splitlines(), ""]:
        line = line.strip()
        entry = re.match(r"(?:[-*]|\d+\.) (.*)", line)
        if not line or line[0] in "#|><%!" or entry:
            found.append(" ".join(current))
            current = [entry[1]] if entry else []
        else:
            current.append(line)
    return [paragraph for paragraph in found if paragraph]


def measured(page: Path) -> list[int]:
    """Return the number of words of each sentence of a page."""
    return [n for part in paragraphs(page.read_text(encoding="utf-8")) for n in sentences(part)]


def test_words_of_a_sentence_are_counted():
    text = "# Title\n\nOne two three. Four `five six` seven $a b$, eight.\n\n"
    text += "```python\nno words\n```\n\n- a b c d\n"
    assert [sentences(part) for part in paragraphs(text)] == [[3, 5], [4]]


def test_sentences_are_short():
    lengths = {str(page.relative_to(ROOT)): measured(page) or [0] for page in PAGES}
    means = {page: sum(words) / len(words) for page, words in lengths.items()}
    assert {page: mean for page, mean in means.items() if mean > MEAN} == {}
    assert {page: max(words) for page, words in lengths.items() if max(words) > LONGEST} == {}


def test_no_phrase_has_to_be_guessed():
    texts = {
        str(page.relative_to(ROOT)): " ".join(page.read_text(encoding="utf-8").split()) for page in PAGES
    }
    found = [(page, phrase) for page, text in texts.items() for phrase in GUESSED if phrase in text]
    assert [f"{page}: {phrase}; write: {GUESSED[phrase]}" for page, phrase in found] == []


def test_pages_of_developers_stay_short():
    docs = ROOT / "docs"
    limits = {"benchmarks.md": 2000, "benchmarking.md": 2000, "decisions/*.md": 8000}
    words = {name: sum(len(page.read_text("utf-8").split()) for page in docs.glob(name)) for name in limits}
    assert {name: found for name, found in words.items() if not 0 < found < limits[name]} == {}


if __name__ == "__main__":
    for path in [Path(name) for name in sys.argv[1:]] or PAGES:
        lengths = measured(path) or [0]
        print(f"{sum(lengths) / len(lengths):5.1f} {len(lengths):4d} {max(lengths):3d}  {path}")
