"""Pages, code and their comments have American spelling.

``python tests/project/test_spelling.py`` writes it.
"""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
READ = {".py", ".pyi", ".md", ".js", ".css", ".html", ".toml", ".yml", ".yaml", ".cff", ".json", ".mplstyle"}
EXCEPT = (
    "docs/_build/",
    "docs/gallery/",
    "docs/classes/",  # made of the others
    "tests/project/test_spelling.py",
    "tests/project/test_words.py",  # has them as words that others may not have
)
ROOMS = ("src", "tests", "docs", "examples", ".github", ".ci")
ALIASES = ('"--colour"', 'neighbours="lists"')
"""Parts of lines that are right: what somebody else may type."""

VERBS = (
    "capital|character|crystall|discret|emphas|equal|factor|final|fluid|general|initial|linear|local|maxim|minim|"
    "neutral|normal|optim|organ|parametr|penal|polar|quant|random|real|recogn|serial|special|stabil|standard|"
    "summar|symmetr|synchron|util|vector|visual"
)
WORDS = {
    "behaviour": "behavior", "colour": "color", "favour": "favor", "neighbour": "neighbor",
    "artefact": "artifact", "licence": "license", "analysed": "analyzed", "analysing": "analyzing",
    "labelled": "labeled", "modelling": "modeling", "travelled": "traveled", "cancelled": "canceled",
    "centred": "centered", "centring": "centering", "programmes": "programs", "greys": "grays",
}  # fmt: skip
"""Wrong wherever they stand, also in a name."""

WHOLE = {"centre": "center", "centres": "centers", "grey": "gray", "programme": "program"}
"""Wrong as a word, or between underscores."""

WRONG = re.compile(
    rf"(?P<word>{'|'.join(WORDS)})|(?<![a-z])(?P<whole>{'|'.join(WHOLE)})(?![a-z])"
    rf"|(?P<verb>(?<![a-z])(?:un|de|re|mis)?(?:{VERBS}))is(?=e|ing\b|ation|abl)",
    re.IGNORECASE,
)


def right(found: re.Match[str]) -> str:
    """Return the American spelling of what was found, in the same case."""
    if found["verb"]:
        return found["verb"] + ("IZ" if found[0].isupper() else "iz")
    word = (WORDS | WHOLE)[found[0].lower()]
    return word.upper() if found[0].isupper() else word.capitalize() if found[0][0].isupper() else word


def american(text: str) -> str:
    """Return a text in American spelling."""
    parts = re.split(f"({'|'.join(map(re.escape, ALIASES))})", text)
    return "".join(part if part in ALIASES else WRONG.sub(right, part) for part in parts)


def british(text: str) -> set[str]:
    """Return the words of a text that are spelled otherwise."""
    for alias in ALIASES:
        text = text.replace(alias, "")
    words = {part for word in set(re.findall(r"\w+", text)) for part in word.split("_")}
    return {word for word in words if american(word) != word}


def texts():
    """Yield every file that is written by hand, and its text."""
    for path in sorted([*ROOT.glob("*.*"), *(each for room in ROOMS for each in (ROOT / room).rglob("*"))]):
        name = path.relative_to(ROOT).as_posix()
        if (
            path.suffix in READ
            and not name.startswith(EXCEPT)
            and path.is_file()
            and "data" not in path.parts
        ):
            yield path, path.read_text(encoding="utf-8")


def test_words_are_told_apart():
    assert american(
        "Colours of neighbours_of the centre; GREY, grey; vectorised, minimisation, unnormalised"
    ) == ("Colors of neighbors_of the center; GRAY, gray; vectorized, minimization, unnormalized")
    for word in (
        "precise",
        "centreline_is_kept",
        "programmers",
        "emphasis",
        "realistic",
        '"--colour"',
        "optimism",
    ):
        assert american(word) == word


def test_spelling_is_american():
    assert {str(path.relative_to(ROOT)): words for path, text in texts() if (words := british(text))} == {}


if __name__ == "__main__":
    for path, text in texts():
        if british(text):
            path.write_text(american(text), encoding="utf-8")
            print(path.relative_to(ROOT))
