"""Scripts that are no part of the package, as modules."""

import importlib.util
import sys


def module_of(path):
    """Return the module that a Python file is; it finds its neighbours, as where it is run."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(path.parent))
    return module
