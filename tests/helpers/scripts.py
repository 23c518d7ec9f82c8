"""Scripts that are no part of the package, as modules and as cells, and Python in a process of its own."""

import importlib.util
import linecache
import os
import subprocess
import sys


def module_of(path):
    """Return the module that a Python file is; it finds its neighbors, as where it is run."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(path.parent))
    return module


def python(*words, cwd=None, timeout=600, **environment):
    """Run Python with these words and more variables to its end without an error; return what it printed."""
    done = subprocess.run(
        [sys.executable, *map(str, words)],
        cwd=cwd, env={**os.environ, **environment}, timeout=timeout, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-3000:]
    return done.stdout


def run_cell(text, name, scope):
    """Run the text of a cell as a notebook does: it is where tracebacks look for it."""
    linecache.cache[name] = len(text), None, text.splitlines(keepends=True), name
    exec(compile(text, name, "exec"), scope)
