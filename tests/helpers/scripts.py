"""Scripts that are no part of the package, as modules, and Python in a process of its own."""

import importlib.util
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
