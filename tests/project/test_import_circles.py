"""No circle of imports: of any two modules, at most one knows the other, directly or through others."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import carom

PACKAGE = Path(carom.__file__).parent


def modules() -> dict[str, Path]:
    """Return every module of Carom by its full name; a package by that of its folder."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = ("carom", *path.relative_to(PACKAGE).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def named_in(tree: ast.AST, known: set[str]) -> set[str]:
    """Return the modules that a syntax tree imports: at the top, in functions, for annotations, as strings.

    A string counts where it is the full name of a module, as in a table of what is imported when it is used.
    That a module is in a package counts as no import of the package.
    """
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are written with full names"
            inside = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in known else str(node.module) for name in inside}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and "." in node.value:
            found.add(node.value)
    return found & known


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
    assert len(imports) > 300
    assert circles(imports) == []


@pytest.mark.parametrize(
    "source",
    [
        "import carom.b",
        "from carom import b",
        "from carom.b import x",
        "def f():\n    from carom.b import x",
        "if TYPE_CHECKING:\n    from carom.b import x",
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


def test_a_process_that_imports_a_scene_alone_knows_who_grows_a_dense_one():
    code = """
import sys
from carom.scene.scene import Scene
from carom import above
assert "carom.simulation.growth" not in sys.modules
print(above._answers["grown"]().__module__)
"""
    assert alone(code) == "carom.simulation.growth"


@pytest.mark.slow
def test_a_process_that_imports_a_scene_alone_makes_a_dense_one():
    code = "from carom.scene import Scene; print(Scene.random(40, packing_fraction=0.56).packing_fraction)"
    assert float(alone(code)) == pytest.approx(0.56, rel=1e-12)
