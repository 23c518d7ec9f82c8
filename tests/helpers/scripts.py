"""Scripts that are no part of the package, as modules."""

import importlib.util


def module_of(path):
    """Return the module that a Python file is."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
