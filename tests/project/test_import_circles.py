"""No circle of imports, but for names in annotations and the few calls upwards that pyproject.toml lists."""

from __future__ import annotations

import ast
import fnmatch
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

import carom

PACKAGE = Path(carom.__file__).parent
ROOT = Path(__file__).parents[2]


def modules() -> dict[str, Path]:
    """Return every module of Carom by its full name; a package by that of its folder."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = ("carom", *path.relative_to(PACKAGE).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def named_in(tree: ast.AST, known: set[str]) -> set[str]:
    """Return the modules that a syntax tree imports: at the top, in functions, as strings.

    A string counts where it is the full name of a module, as in a table of what is imported when it is used.
    That a module is in a package counts as no import of the package; what annotations name counts neither.
    """
    found = set()
    for node in walked(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are written with full names"
            inside = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in known else str(node.module) for name in inside}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and "." in node.value:
            found.add(node.value)
    return found & known


def walked(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a tree but those under ``if TYPE_CHECKING``."""
    for node in ast.iter_child_nodes(tree):
        if not (isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"):
            yield node
            yield from walked(node)


def upwards(name: str, others: set[str]) -> set[str]:
    """Return those of the modules that one calls although they are above it, as pyproject.toml says."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    calls = [
        line.split(" -> ") for line in settings["tool"]["importlinter"]["contracts"][0]["ignore_imports"]
    ]
    return {other for a, b in calls if a == name for other in fnmatch.filter(others, b)}


def circles(imports: dict[str, set[str]]) -> list[set[str]]:
    """Return the sets of modules that all lead to each other (strongly connected components, by Tarjan)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    path: list[str] = []
    found: list[set[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        path.append(name)
        for other in sorted(imports[name]):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in path:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            together = path[path.index(name) :]
            del path[path.index(name) :]
            if len(together) > 1 or name in imports[name]:
                found.append(set(together))

    for name in imports:
        if name not in index:
            visit(name)
    return found


def test_no_modules_import_each_other_in_a_circle():
    paths = modules()
    known = set(paths)
    imports = {
        name: named_in(ast.parse(path.read_text(encoding="utf-8")), known) for name, path in paths.items()
    }
    imports = {name: others - upwards(name, others) for name, others in imports.items()}
    assert len(imports) > 300
    assert circles(imports) == []


@pytest.mark.parametrize(
    "source",
    [
        "import carom.b",
        "from carom import b",
        "from carom.b import x",
        "def f():\n    from carom.b import x",
        "TABLE = {'x': 'carom.b'}",
    ],
)
def test_every_way_to_import_counts(source):
    known = {"carom", "carom.a", "carom.b"}
    assert named_in(ast.parse(source), known) == {"carom.b"}
    assert circles({"carom.a": {"carom.b"}, "carom.b": {"carom.a"}, "carom": {"carom.a"}}) == [
        {"carom.a", "carom.b"}
    ]


def alone(code: str) -> str:
    """Return what a process prints that runs this code and nothing else."""
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


@pytest.mark.slow
def test_a_process_that_imports_a_scene_alone_makes_a_dense_one():
    code = "from carom import Scene; print(Scene.random(40, packing_fraction=0.56).packing_fraction)"
    assert float(alone(code)) == pytest.approx(0.56, rel=1e-12)


def test_the_page_on_architecture_lists_every_room_in_the_order_of_its_floors():
    page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    table = page[page.index("| in `src/carom` |") : page.index("`lint-imports` checks")]
    listed = re.findall(r"^\| `(\w+)(?:/|\.py)` \|", table, re.MULTILINE)
    rooms = {
        path.stem for path in PACKAGE.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()
    }
    assert len(listed) == len({*listed})
    assert {*listed} - {"templates"} == rooms - {"__init__", "__main__", "templates"}
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    floors = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    height = {name: k for k, floor in enumerate(floors) for name in re.findall(r"carom\.(\w+)", floor)}
    heights = [height[name] for name in listed if name in height]
    assert heights == sorted(heights)
    assert {*height} <= {*listed}
