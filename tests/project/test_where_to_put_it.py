"""The page "Developers" says where a new thing goes: each place of what is there today is taken."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import pytest

from carom import cli, observables, results, spec, studies
from carom.declared import fields_of
from carom.io.foreign_source import Source
from carom.io.formats import FORMATS
from carom.models import _SHELF
from carom.models.files.tables import KINDS
from carom.observables.of_frames import OfFrames
from carom.scene_file.sections import RunSpec, SceneSpec
from carom.studies.study_registry import STUDIES

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/developers.md").read_text(encoding="utf-8")
BASES = {"of_blocks", "of_frames", "protocol", "statistics"}
"""Files of observables/ that are no observable."""


def places(heading: str) -> list[str]:
    """Return the files that the list below a heading of the page names, in order."""
    (text,) = re.findall(
        rf"^### {re.escape(heading)}\n(.*?)(?=^### |^## |\Z)", PAGE, re.MULTILINE | re.DOTALL
    )
    return [
        name
        for step in re.findall(r"^\d+\. (.*)", text, re.MULTILINE)
        for name in re.findall(r"`([\w/]+\.(?:py|md))`", step)
    ]


LISTS = re.findall(r"^### (.+)$", PAGE, re.MULTILINE)


def test_there_is_a_list_for_each_kind_of_addition():
    assert LISTS == [
        "A pair interaction", "A motion", "A neighbor scheme", "A drive", "An observable",
        "A key of the scene file", "A study", "A foreign format", "An option of a command",
    ]  # fmt: skip


@pytest.mark.parametrize("heading", LISTS)
def test_a_list_names_files_that_are_there(heading):
    named = places(heading)
    assert named
    known = ("src/carom", "docs", "tests", "")
    assert [name for name in named if not any((ROOT / base / name).exists() for base in known)] == []


def values_of(room: str) -> set[str]:
    """Return the values for users in a room or a file of models: frozen classes that make a model."""
    package = importlib.import_module(f"carom.models.{room}")
    inside = getattr(package, "__path__", None)
    names = (
        [package.__name__]
        if inside is None
        else [m.name for m in pkgutil.iter_modules(inside, f"{package.__name__}.")]
    )
    return {
        name
        for module in map(importlib.import_module, names)
        for name, value in vars(module).items()
        if inspect.isclass(value) and value.__module__ == module.__name__ and not name.startswith("_")
        if dataclasses.is_dataclass(value) and callable(getattr(value, "model", None))
    }


@pytest.mark.parametrize("room", ["interactions", "motions", "drives", "white_noise", "active"])
def test_a_model_is_on_the_shelf_and_a_file_can_hold_it(room):
    found = values_of(room)
    assert found
    shelved = {name for name in found if name in _SHELF}
    inner = {"RuleFile", "Bath", "Pinned", "Growing"}  # made from keywords of a scene, or bases of others
    assert found - inner == shelved - inner
    listed = {
        place.split(":")[1] for kinds in KINDS.values() for place in kinds.values() if isinstance(place, str)
    }
    usual = {"HardCores", "FreeFlight", "Steps", "Ranges"}  # by default, or by another type of a table
    assert shelved - usual <= listed
    text = "\n".join(path.read_text(encoding="utf-8") for path in ROOT.glob("docs/**/*.md"))
    assert [name for name in shelved if not re.search(rf"\b{name}\b", text)] == []


def test_an_observable_is_imported_by_its_room_and_its_result_prints_and_draws():
    path = Path(observables.__file__).parent
    modules = {file.stem for file in path.glob("*.py")} - {"__init__"} - BASES
    said = (path / "__init__.py").read_text(encoding="utf-8")
    imported = {
        node.module.split(".")[-1] for node in ast.parse(said).body if isinstance(node, ast.ImportFrom)
    }
    assert modules - imported == {"steps"}  # functions of what a run adds up
    for name in modules & imported - {"packing"}:
        module = importlib.import_module(f"carom.observables.{name}")
        own = {
            key: value
            for key, value in vars(module).items()
            if inspect.isclass(value) and value.__module__ == module.__name__
        }
        found = [key for key, value in own.items() if issubclass(value, results.Result)]
        assert found, name
        for key in found:
            kind = own[key]
            assert results.KINDS[key] is kind
            assert kind._rows is not results.Result._rows, key
            assert kind._draw_into is not results.Result._draw_into, key
        measured = [key for key in own if f"{key}Result" in own and key != "PartialRDF"]
        assert measured, name
        assert {*measured} <= {*observables.__all__}
        text = "\n".join(page.read_text(encoding="utf-8") for page in ROOT.glob("docs/*.md"))
        assert [key for key in measured if not re.search(rf"\b{key}\b", text)] == []
        assert all(hasattr(own[key], "over") for key in measured if issubclass(own[key], OfFrames))


def test_a_key_of_the_scene_file_has_a_check_and_help_and_is_used():
    code = "".join(
        (ROOT / "src/carom/scene_file" / name).read_text(encoding="utf-8")
        for name in ("build.py", "sections.py")
    )
    for section in (SceneSpec, RunSpec):
        for name, field in fields_of(section).items():
            assert field.check is None or (field.opt is not None and field.opt.help), name
    used = {*re.findall(r"asked\.(\w+)", code), *re.findall(r'"(\w+)"', code)}
    assert {*fields_of(SceneSpec)} <= used


def test_a_study_has_a_section_a_command_a_function_and_a_page():
    commands = {name for group in cli.COMMANDS.values() for name in group}
    pages = "\n".join(path.read_text(encoding="utf-8") for path in ROOT.glob("docs/*.md"))
    for kind in STUDIES.values():
        asked = kind.Spec
        assert asked.section in spec.SECTIONS
        assert kind.name in commands
        assert {kind.__name__, asked.__name__} <= {*studies.__all__}
        assert f"{{{{ keys {asked.section} }}}}" in pages
        assert f"carom {kind.name}" in pages
        assert f"{kind.__module__.rsplit('.', 1)[0]}.".startswith("carom.studies.")


def test_a_foreign_format_has_a_class_and_stands_in_the_table_of_files():
    files = (ROOT / "docs/files.md").read_text(encoding="utf-8")
    for form, known in FORMATS.items():
        module, name = known.reader.split(".")
        reader = getattr(importlib.import_module(f"carom.io.{module}"), name)
        assert issubclass(reader, Source), form
        assert [
            each
            for each in known.names
            if f"`{each.rstrip('.')}" not in files and each not in (".lmp", "dump.", "data.")
        ] == [], form
    names = [each for known in FORMATS.values() for each in known.names]
    assert len(names) == len({*names})


def test_an_option_is_a_field_with_help():
    for group in cli.COMMANDS.values():
        for name, command in group.items():
            for option in inspect.signature(command).parameters.values():
                said = [
                    each for each in getattr(option.annotation, "__metadata__", ()) if hasattr(each, "help")
                ]
                assert not said or said[0].help, (name, option.name)
