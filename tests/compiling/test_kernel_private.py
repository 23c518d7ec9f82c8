"""What Carom uses of Numba that Numba promises to nobody."""

import ast
import sys
from pathlib import Path

import numba
import numpy as np

import carom


def test_private_parts_of_numba_are_named_in_one_file():
    package = Path(carom.__file__).parent
    public = {*numba.__all__, "config", "types"}
    for path in package.rglob("*.py"):
        if path.name == "numba_parts.py":
            continue
        inside = path.is_relative_to(package / "compiling")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found = {alias.name for alias in node.names}
                assert not {name for name in found if name.startswith(("numba.", "llvmlite"))}, path
            elif isinstance(node, ast.ImportFrom) and str(node.module).startswith(("numba", "llvmlite")):
                if inside and node.module in ("numba.extending", "llvmlite"):
                    continue
                assert node.module == "numba", path
                assert {alias.name for alias in node.names} <= public, path


def test_arrays_in_a_plain_tuple_are_not_let_go():
    # A plain tuple was handed back without being counted, and its arrays were freed.
    from carom.compiling.borrowed import borrowed
    from numba import njit

    @njit
    def last(model):
        (array, _), _ = borrowed(model)
        return array[-1]

    array = np.arange(3.0)
    held = sys.getrefcount(array)
    assert [last(((array, 1), "name")) for _ in range(5)] == [2.0] * 5
    assert sys.getrefcount(array) == held
