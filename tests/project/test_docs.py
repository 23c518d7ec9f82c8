"""What the texts say is so: docstring examples run, commands exist, pages build, links lead somewhere."""

import ast
import doctest
import functools
import importlib
import importlib.util
import inspect
import json
import pkgutil
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from helpers.links import dead_links
from helpers.options import COMMANDS
from rich.markup import render
from typer.main import get_command

import carom
from carom.cli import app

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *ROOT.joinpath("docs").rglob("*.md")]
# The pages of the gallery are written by the build, from the examples.
PAGES = sorted(page for page in PAGES if not {"_build", "classes", "gallery"} & set(page.parts))

FEW_EVENTS = ("carom.simulation.callbacks",)
"""Modules whose examples have scenes of their own, and are over before those are compiled."""

ALONE = (
    "carom.models.active", "carom.models.drives", "carom.observables.density_profile",
    "carom.observables.energy", "carom.observables.flights", "carom.observables.pressure_profile",
    "carom.observables.pressure_tensor", "carom.simulation.moves.swaps", "carom.simulation.tuning",
    "carom.studies.transport.study", "carom.studies.shear.study", "carom.studies.packings.pack",
    "carom.studies.planner.plan",
)  # fmt: skip
"""Those with many events of a kind that nobody else has, or pilots."""

MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(carom.__path__, "carom.")
    if not module.name.endswith("__main__")
)


def source_of(name: str) -> str:
    return Path(importlib.util.find_spec(name).origin).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.ci] if name in ALONE else [])
        for name in MODULES
        if ">>> " in source_of(name)
    ],
)
def test_docstring_examples_run(name, tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)  # some write files
    if name in FEW_EVENTS:
        request.getfixturevalue("plain")
    module = importlib.import_module(name)
    options = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    assert doctest.testmod(module, optionflags=options).failed == 0


def undocumented(name: str) -> list[str]:
    """Return what of a module has no docstring: the module itself, or public names."""
    module = importlib.import_module(name)
    own = (vars(module)[n] for n in vars(module) if not n.startswith("_"))
    callables = [x for x in own if callable(x) and getattr(x, "__module__", None) == name]
    callables = [x for x in callables if "<locals>" not in getattr(x, "__qualname__", "")]
    found = [f"{name}.{x.__name__}" for x in callables if not (x.__doc__ or "").strip()]
    return found if (module.__doc__ or "").strip() else [name, *found]


def test_every_module_and_its_public_names_are_documented():
    assert [name for module in MODULES for name in undocumented(module)] == []


TEXTS = {".py", ".md", ".toml", ".json", ".csv", ""}


def blocks(page: Path, language: str) -> list[str]:
    """Return the fenced blocks of a page in one language."""
    return re.findall(
        rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )


def test_readme_has_the_two_commands_alone_on_their_lines():
    lines = ROOT.joinpath("README.md").read_text(encoding="utf-8").splitlines()
    assert "pip install . && carom run" in lines
    assert 'pip install ".[test]" && pytest' in lines


README = "\n".join(blocks(ROOT / "README.md", "python"))


def test_calls_in_the_readme_have_the_arguments_of_what_they_call():
    calls = {
        node: ast.unparse(node.func) for node in ast.walk(ast.parse(README)) if isinstance(node, ast.Call)
    }
    assert {"carom.Scene.random", "sim.equilibrate", "carom.pack"} <= {*calls.values()}
    of = {"carom": carom, "sim": carom.Simulation}
    for call, (first, _, rest) in ((call, name.partition(".")) for call, name in calls.items()):
        if first in of:
            called = functools.reduce(getattr, rest.split("."), of[first])
            itself = [None] if first == "sim" else []
            inspect.signature(called).bind(*itself, *call.args, **{word.arg: None for word in call.keywords})


def test_commands_and_options_in_the_pages_exist():
    """Every `carom ...` line of a shell block names a command and long options that there are."""
    used: dict[str, set[str]] = {}
    for page in PAGES:
        for block in [*blocks(page, "bash"), *blocks(page, "sh"), *blocks(page, "console")]:
            for line in re.findall(r"(?:^|&& |\$ )carom ([^#|&\n]*)", block, re.MULTILINE):
                words = line.split()
                used.setdefault(words[0], set()).update(w.split("=")[0] for w in words if w.startswith("--"))
    assert "run" in used
    for command, options in used.items():
        if not command.startswith("--"):
            parameters = COMMANDS[command].params
            known = {name for each in parameters for name in (*each.opts, *each.secondary_opts)}
            assert options <= known | {"--help"}, f"carom {command}"


def test_only_commands_that_take_a_scene_file_say_that_their_options_override_it():
    for name, command in COMMANDS.items():
        panels = {getattr(parameter, "rich_help_panel", None) or "" for parameter in command.params}
        takes = {parameter.name for parameter in command.params}
        assert takes & {"scene", "study"} or not any(" scene file)" in panel for panel in panels), name


def test_every_option_is_described_and_no_bracket_lost():
    """``[study]`` in a help text is markup, and gone, unless its bracket is escaped."""
    texts = {"carom": get_command(app).help}
    for name, command in COMMANDS.items():
        texts[name] = command.help.replace("[bold]Examples[/bold]", "")
        for parameter in command.params:
            texts[f"{name} {parameter.name}"] = getattr(parameter, "help", None)
    assert "eos study" in texts
    for where, text in texts.items():
        assert text, f"{where} is not described"
        assert render(text).plain == text.replace("\\[", "["), where


def test_relative_links_lead_somewhere():
    dead = []
    for page in PAGES:
        text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
            if not re.match(r"[a-z]+:", target) and not (page.parent / target).exists():
                dead.append(f"{page.relative_to(ROOT)} links to {target}")
    assert dead == []


ROOMS = {
    folder.name for folder in ROOT.joinpath("src/carom").iterdir() if folder.joinpath("__init__.py").exists()
}


def resolves(dotted: str) -> bool:
    """Tell whether a dotted name is a module, or something in one."""
    words = dotted.split(".")
    for k in range(len(words), 0, -1):
        try:
            found = importlib.import_module(".".join(words[:k]))
        except ModuleNotFoundError:
            continue
        for at in range(k, len(words)):
            word = words[at]
            if not hasattr(found, word):  # a field of a dataclass or a NamedTuple
                return at == len(words) - 1 and word in getattr(found, "__annotations__", {})
            found = getattr(found, word)
        return True
    return False


# The changelog may name what is no more.
NAMING = [page for page in PAGES if page.name != "CHANGELOG.md"]


def missing_names(page: Path) -> list[str]:
    """Return what a page names and is not there: modules and their names in backticks, with `carom.` or from
    a room on; and paths of sources.
    """
    text = page.read_text(encoding="utf-8")
    missing = []
    names = re.findall(r"`~?((?:[A-Za-z_]\w*\.)+[A-Za-z_]\w*)(?:\([^`]*\))?`", text)
    names += re.findall(r"^\s*(?:from|import) (carom[\w.]*)", text, re.MULTILINE)
    for name in names:
        first = name.split(".")[0]
        whole = f"carom.{name}" if first in ROOMS and not name.endswith((".py", ".toml")) else name
        if whole.startswith("carom.") and not resolves(whole):
            missing.append(name)
    for path in re.findall(r"`((?:\w+/)+[\w.-]*\w\.(?:py|md|toml))`", text):
        if not any(base.joinpath(path).exists() for base in (ROOT, ROOT / "src/carom", ROOT / "docs")):
            missing.append(path)
    return [f"{page.relative_to(ROOT)} names {each}" for each in missing]


def test_every_name_of_carom_in_the_pages_exists():
    assert [each for page in NAMING for each in missing_names(page)] == []


def test_no_text_names_a_place_on_one_machine():
    """No absolute path of a home, a scratch or a mount folder in anything that is read."""
    # Spelled so that this file does not find itself.
    places = re.compile(r"(?<![\w.])/(?:home|Users|root|work|mnt|scratch)" + r"/\w")
    # In a second worktree .git is a file, and says where the first one is.
    texts = [path for path in ROOT.glob("*.*") if path.is_file() and path.name != ".git"]
    for folder in ("src", "tests", "examples", "docs", ".ci"):
        texts += [
            path for path in ROOT.joinpath(folder).rglob("*") if path.suffix in TEXTS and path.is_file()
        ]
    read = {path.relative_to(ROOT): path.read_text(encoding="utf-8", errors="replace") for path in texts}
    found = [str(path) for path, text in read.items() if "_build" not in path.parts and places.search(text)]
    assert found == []


def test_version_dates_and_license_agree():
    citation = ROOT.joinpath("CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {carom.__version__}\n" in citation
    assert f"## [{carom.__version__}]" in ROOT.joinpath("CHANGELOG.md").read_text(encoding="utf-8")
    project = tomllib.loads(ROOT.joinpath("pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"\nlicense: {project['license']}\n" in citation


def test_decision_records_have_their_three_parts():
    decisions = sorted(ROOT.joinpath("docs/decisions").glob("[0-9]*.md"))
    assert decisions
    for decision in decisions:
        text = decision.read_text(encoding="utf-8")
        for heading in ("## Context", "## Decision", "## Consequences"):
            assert text.count(heading) == 1, f"{decision.name} lacks {heading}"


@pytest.mark.slow
@pytest.mark.needs("Sphinx")
def test_documentation_builds_without_a_warning(tmp_path):
    words = ["-m", "sphinx", "-q", "-W", "--keep-going", "-t", "stored", "-b", "html"]
    command = [sys.executable, *words, ROOT / "docs", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "Carom" in tmp_path.joinpath("index.html").read_text(encoding="utf-8")
    assert dead_links(tmp_path) == []
    index = tmp_path.joinpath("searchindex.js").read_text(encoding="utf-8")
    terms = json.loads(index.removeprefix("Search.setIndex(").removesuffix(")"))["terms"]
    assert "diffus" in terms, "a search for diffusion finds nothing"


def test_no_page_shows_data_that_slipped_in():
    """A table made by a script once brought the JSON of its program along."""
    found = []
    for page in PAGES:
        text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        found += [page.name for line in text.splitlines() if line.strip() in ("{", "}", "[", "]")]
    assert not found
