"""Without what Carom uses of Numba that Numba promises to nobody: the same results, and one warning."""

import ast
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from helpers.tiny import TINY, run_tiny

from carom.compiling import numba_features

# What to take away from Numba, or from Carom's hands, for want of a Numba that lacks it.
GONE = {
    "inlining without machine code": "import numba.core.codegen as c; del c.JITCodeLibrary",
    "code shared by all callers": "import carom.compiling.inlined_compiler as m; m._share = None",
    "compiled code kept on disk": "import numba.core.caching as c; del c.IndexDataCacheFile._open_for_write",
    "arrays without reference counts": "import carom.compiling.borrowed as m; m.cgutils = object()",
    "memory asked for ahead": "import carom.compiling.prefetch as m; m.cgutils = object()",
    "eight values at a time": "import carom.compiling.simd as m; m.cgutils = object()",
}
PROGRAM = """
import warnings
import numba
{gone}
import carom.engine.build, carom.engine.projection
from carom.compiling import numba_features

numba.__version__ = "9.9.9"
trials = list(numba_features.TRIALS)
numba_features.try_out()
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    numba_features.warn_of_missing()
    numba_features.warn_of_missing()
print(list(numba_features.MISSING), len(trials))
for each in said:
    print(each.category.__name__, each.message)
for part, works in trials:  # as they are now, without what is missing
    assert part == "compiled code kept on disk" or works(), part
"""


@pytest.mark.parametrize("part", GONE)
def test_a_part_of_numba_that_is_gone_is_done_without(part):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(gone=GONE[part])], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    missing, *said = done.stdout.splitlines()
    assert missing == f"{[part]} 6"
    (line,) = said
    assert line.startswith("NumbaPerformanceWarning Numba 9.9.9 lacks what Carom uses")
    assert part in line
    assert "Results are the same" in line


def test_private_parts_of_numba_are_used_in_compiling_only():
    package = Path(numba_features.__file__).parents[1]
    public = {*numba.__all__, "config", "types"}
    for path in package.rglob("*.py"):
        if path.is_relative_to(package / "compiling"):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found = {alias.name for alias in node.names}
                assert not {name for name in found if name.startswith(("numba.", "llvmlite"))}, path
            elif isinstance(node, ast.ImportFrom) and str(node.module).startswith(("numba", "llvmlite")):
                assert node.module == "numba", path
                assert {alias.name for alias in node.names} <= public, path


def test_a_tested_numba_is_not_tried_again():
    tried = []
    numba_features.TRIALS.append(("a part", lambda: tried.append(1)))
    try:
        assert numba_features.tested()
        numba_features.try_out()
        assert not tried
        assert numba_features.has("a part")
    finally:
        numba_features.TRIALS.pop()


def test_versions_are_read_as_numbers(monkeypatch):
    for version, expected in (("0.61.2", False), ("0.62.0rc1", True), ("0.68.1", True), ("0.100.0", False)):
        monkeypatch.setattr(numba_features.numba, "__version__", version)
        assert numba_features.tested() is expected


def test_arrays_in_a_plain_tuple_are_not_let_go():
    # A plain tuple was handed back without being counted, and its arrays were freed.
    from numba import njit

    from carom.compiling.borrowed import borrowed

    @njit
    def last(model):
        (array, _), _ = borrowed(model)
        return array[-1]

    array = np.arange(3.0)
    held = sys.getrefcount(array)
    assert [last(((array, 1), "name")) for _ in range(5)] == [2.0] * 5
    assert sys.getrefcount(array) == held


@pytest.mark.slow
def test_the_public_way_gives_the_same_bits(tmp_path):
    without = "import carom.engine.build\nfrom carom.compiling import numba_features\n" + "".join(
        f"numba_features.leave_out({part!r}, 'as a test')\n" for part in GONE
    )
    program = without + "import warnings\nwarnings.simplefilter('ignore')\n" + TINY
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == run_tiny()
