"""Texts from outside are text: in pages and notebooks, on the terminal, in pictures and in tables."""

import csv
import dataclasses
import io
import json
import re
import warnings
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from helpers.estimates import estimate
from helpers.frames import frames_of
from matplotlib.figure import Figure
from rich.progress import Progress

import carom
from carom import texts
from carom.cli import files, tables, trouble
from carom.cli.screen import columns
from carom.errors import CaromWarning, FileError
from carom.observables.rdf import PartialRDFResult
from carom.pictures import plots
from carom.studies.spherical_codes.code import SphericalCode
from carom.studies.spherical_codes.study import spherical_code
from carom.table import in_html, of_texts

HOSTILE = (
    "<img src=x onerror=alert(1)>", "</script><script>alert(1)</script>", "<!--<script>", '"><b>', "'&amp;",
    "@DATA@", "@SCRIPT@", "[/b]", "[red]x", ":smile:", "\x1b[2J\x1b[31m", "\x9b2J", "\r\a\b", "a\nb",
    "\u202eabc", "\u2028", "\ud800", r"$\frac$", "$", "a_b$c$", r"\$x$", "_hidden", "%s %d {x}", 'a,"b";c',
)  # fmt: skip
SHOWN = "<b> [/b] $x$ \N{GREEK SMALL LETTER SIGMA} 10\N{NARROW NO-BREAK SPACE}000"


class Page(HTMLParser):
    """The elements of a page, and the text outside of them."""

    def __init__(self, page: str):
        super().__init__()
        self.elements: list[str] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.elements.append(tag)

    def handle_data(self, data):
        self.text += data


def acting(text: str) -> bool:
    """Return whether a text has characters that act on a terminal."""
    return (
        re.search(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]", text) is not None
    )


@pytest.mark.parametrize("text", HOSTILE)
def test_no_text_acts_in_any_medium(text):
    assert not acting(texts.visible(text))
    assert "\n" not in texts.visible(text)
    texts.visible(text).encode("utf-8")
    page = Page(f"<p title='{texts.html(text)}' class=\"{texts.html(text)}\">{texts.html(text)}</p>")
    assert page.elements == ["p"]
    assert page.text == texts.visible(text, lines=True)
    inside = texts.script({text: [text, 1.5, None]})
    assert json.loads(inside) == {text: [text, 1.5, None]}
    assert not set("<>&") & set(inside)


def test_a_text_that_acts_nowhere_stays_as_it_is():
    assert texts.visible(SHOWN) == SHOWN
    assert texts.visible("a\nb", lines=True) == "a\nb"
    assert texts.visible("\x1b[2J") == r"\x1b[2J"


@pytest.mark.parametrize("text", HOSTILE)
def test_labels_of_pictures_are_drawn_as_they_are(text):
    figure = Figure()
    axes = figure.add_subplot()
    axes.plot([1, 2], label=texts.label(text))
    axes.plot([2, 1], label=f"$N$ of {texts.label(text)}")
    axes.set_title(texts.label(text))
    legend = axes.legend()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a font may lack the character
        figure.savefig(io.BytesIO(), format="svg")
    assert len(legend.get_texts()) == 2


@pytest.mark.parametrize("text", HOSTILE)
def test_titles_and_species_of_a_page_are_text(text):
    frame = carom.Frame(**{**vars(frames_of(3)[0]), "species_names": (text, "other")})
    plain = Page(carom.view(frame, title="title").html)
    shown = carom.view(frame, title=text)
    page = Page(shown.html)
    assert page.elements == plain.elements
    data = re.search(r'<script id="data" type="application/json">(.*?)</script>', shown.html, re.DOTALL)[1]
    assert json.loads(data)["names"] == [text, "other"]
    assert not set("<>&") & set(data)
    assert Page(shown._repr_html_()).elements == ["iframe"]
    assert not acting(repr(shown))
    assert not acting(str(frame))


def test_what_a_notebook_shows_of_a_result_is_text():
    code = dataclasses.replace(spherical_code(4, dimension=3, tries=1), note=HOSTILE[0] + "\x1b[2J")
    assert (
        Page(code._repr_html_()).elements
        == Page(spherical_code(4, dimension=3, tries=1)._repr_html_()).elements
    )
    assert not acting(str(code))
    assert isinstance(code, SphericalCode)
    shown = Page(in_html(HOSTILE[0], [HOSTILE[:2]], HOSTILE[2:4]))
    assert shown.elements == ["table", "caption", "tr", "th", "th", "tr", "th", "td"]
    scene = carom.Scene(
        [[1.0, 1.0], [3.0, 3.0]], 5.0, species=np.array([0, 1]), species_names=(HOSTILE[0], "b")
    )
    assert "img" not in Page(scene._repr_html_()).elements


@pytest.mark.parametrize("text", HOSTILE)
def test_errors_and_warnings_print_names_as_text(text, capsys):
    assert not acting(str(FileError(f"{text} is damaged.")))
    assert "\n" not in str(CaromWarning(f"{text} is damaged."))

    @trouble.friendly
    def command():
        warnings.warn(f"{text} is odd.", CaromWarning, stacklevel=1)
        raise KeyboardInterrupt(f"Stopped in {text}.")

    with pytest.raises(Exception, match="130"):
        command()
    said = capsys.readouterr().err
    assert not acting(said)
    assert len(said.splitlines()) == 2


@pytest.mark.parametrize("width", [200, 12])
def test_cells_and_lines_of_the_screen_are_text(width):
    table = of_texts(("[/x]", "b", "c"), [("g [/b]", "\x1b[2J", "0")], "[/b]", [":smile: [red]c"])
    file = io.StringIO()
    console = tables.Screen(file=file, width=width, force_terminal=True, color_system=None)
    console.print(table.rich(console))
    console.print("[/b] \x1b[2J")
    shown = " ".join(file.getvalue().split())
    assert not acting(shown)
    for text in ("[/b]", ":smile:", "[/x]", "g [/b]", r"\x1b[2J"):
        assert text in shown


def test_a_bar_shows_its_stage_as_text(monkeypatch):
    file = io.StringIO()
    with Progress(*columns(), console=tables.Screen(file=file, width=120, force_terminal=True)) as bar:
        bar.add_task("[/b] of", total=1)
    assert "[/b] of" in file.getvalue()


def test_files_are_named_as_text_on_the_screen(tmp_path, capsys):
    files.init(tmp_path / "a\x1b[2Jb.toml")
    assert r"a\x1b[2Jb.toml written" in capsys.readouterr().out


def test_species_of_any_name_are_in_the_legend_and_in_the_table(tmp_path):
    names = ("$\\frac$", "_b,\"'")
    rng = np.random.default_rng(1)
    frame = carom.Frame(
        0.0, 0, rng.random((40, 2)) * 9.0, np.zeros((40, 2)), (9.0, 9.0), np.full(40, 1e-3), np.ones(40),
        species=np.arange(40) % 2, species_names=names,
    )  # fmt: skip
    wanted = {f"{names[a]}-{names[b]}": (a, b) for a, b in ((0, 0), (0, 1), (1, 1))}
    found = {name: carom.RDF(rmax=3.0, width=0.5, pair=pair).over([frame]) for name, pair in wanted.items()}
    figure = plots.partial_rdf(found, path=tmp_path / "rdf.png")
    shown = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert [text.replace(r"\$", "$").strip("\N{ZERO WIDTH SPACE}") for text in shown] == list(wanted)
    for k, name in enumerate(wanted):
        value = carom.observables.Estimate(float(k), 0.5, 9.0, 1.0, 9)
        found[name] = dataclasses.replace(found[name], contact_value=value)
    PartialRDFResult(found | {"a\nb": found[f"{names[0]}-{names[0]}"]}).save(tmp_path / "rdf.csv")
    lines = (tmp_path / "rdf.csv").read_text().splitlines(keepends=True)
    (head, *rows) = csv.reader(line for line in lines if not line.startswith("#"))
    assert head[2::5] == [f"g {name}" for name in (*wanted, "a\nb")]
    assert all(len(row) == len(head) for row in rows)
    assert sum(line.startswith("# contact ") for line in lines) == 4
    values = [line.split(": ")[-1].strip() for line in lines if line.startswith("# contact_value ")]
    assert values == ["0.0 +- 0.5", "1.0 +- 0.5", "2.0 +- 0.5", "0.0 +- 0.5"]


def test_equations_are_drawn_by_any_name(tmp_path):
    figure = plots.pressure(estimate(), equations={r"$\frac$": 1.5, "_b": 1.6}, path=tmp_path / "z.png")
    assert len(figure.axes[0].get_legend().get_texts()) == 4


def test_every_medium_has_one_function():
    """Nobody else makes text of HTML, or prints on a terminal of Rich."""
    sources = Path(carom.__file__).parent
    escaping = {"texts.py", "drawing/page.py"}  # the view also puts a whole page into an attribute
    for path in sources.rglob("*.py"):
        name, text = path.relative_to(sources).as_posix(), path.read_text(encoding="utf-8")
        if name not in escaping:
            assert not re.search(r"^\s*(import html\b|from html import)", text, re.MULTILINE), name
        if name.startswith("cli/"):
            assert not re.search(r"\bConsole\(", text.replace("class Screen(Console)", "")), name


def test_the_text_of_a_table_is_whole_in_a_notebook(monkeypatch):
    """Rich shows there what it prints, whatever the file."""
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    assert "here" in str(of_texts(("a",), [("here",)]))
