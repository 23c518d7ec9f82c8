"""Tests that fail, run by a pytest of their own with the settings of this project."""

import os
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]


def inner_pytest(folder, code, *options):
    """Run tests that ``code`` defines, in a folder; return what pytest printed."""
    folder.joinpath("test_inner.py").write_text(code, encoding="utf-8")
    words = [sys.executable, "-m", "pytest", "-c", TESTS.parent / "pyproject.toml", "--rootdir", folder]
    words += ["-p", "no:cacheprovider", "-p", "conftest", "-n", "0", *options, folder]
    paths = os.pathsep.join(filter(None, [str(TESTS), os.environ.get("PYTHONPATH")]))
    said = folder / "said.txt"  # no pipe, which what a test leaves behind would hold open
    with said.open("w") as out:
        subprocess.run(
            words, cwd=folder, env={**os.environ, "PYTHONPATH": paths}, stdout=out,
            stderr=subprocess.STDOUT, timeout=600,
        )  # fmt: skip
    return said.read_text(encoding="utf-8")
