"""Who calls a function can see what it takes: eight parameters at most, but for what users call."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import carom

PACKAGE = Path(carom.__file__).parent
MOST = 8

FACES = {
    "Scene.__init__", "random", "crystal", "Simulation.__init__", "Simulation.load", "Pressure.estimate",
    "run", "measure", "view",
}  # fmt: skip
"""What users call, with keywords that have defaults."""

ROOMS = (
    "bridges", "drawing", "figures", "geometry", "io", "observables", "pictures", "scene", "scene_file",
    "simulation", "theory",
)  # fmt: skip


def functions(tree: ast.AST, inside: tuple[str, ...] = ()) -> Iterator[tuple[str, int]]:
    """Yield the name and the number of parameters of each function, without the instance or the class."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            name = (*inside, node.name)
            if isinstance(node, ast.FunctionDef):
                given = [each.arg for each in (*node.args.posonlyargs, *node.args.args)]
                count = len(given) + len(node.args.kwonlyargs) + (node.args.kwarg is not None)
                yield ".".join(name), count - (given[:1] in (["self"], ["cls"]))
            yield from functions(node, name)
        else:
            yield from functions(node, inside)


@pytest.mark.parametrize("room", ROOMS)
def test_no_function_has_more_than_eight_parameters(room):
    many = {
        f"{path.relative_to(PACKAGE)}: {name} has {count}"
        for path in sorted((PACKAGE / room).rglob("*.py"))
        for name, count in functions(ast.parse(path.read_text(encoding="utf-8")))
        if count > MOST and name not in FACES
    }
    assert many == set()


def test_parameters_are_counted():
    code = "class A:\n    def f(self, a, /, b, *, c=1, **d): ...\ndef g(a, b):\n    def h(x): ..."
    assert list(functions(ast.parse(code))) == [("A.f", 4), ("g", 2), ("g.h", 1)]
