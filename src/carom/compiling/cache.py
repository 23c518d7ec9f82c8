"""Compiled code kept on disk, and used again only where nothing that it was made of has changed."""

from __future__ import annotations

import glob
import hashlib
from pathlib import Path

import numba
from numba.core import config

from carom.compiling import private
from carom.compiling.origins import classes_in, digest_of

KEEPING = "compiled code kept on disk"

BOUNDS_CHECKED = getattr(config, "BOUNDSCHECK", None)
"""What NUMBA_BOUNDSCHECK says."""


def keep(compiled):
    """Let a compiled function keep its code in files that are named after all that it depends on.

    Numba's own cache looks at the source of the compiled function alone, so that code outlives an edit to
    what that function calls. It lists the types of all arguments seen in one index: with that, every program
    imports the modules of everybody's models, and ends where one of them is gone. And it numbers its files:
    two processes that compile for different scenes could take the same number. Here there is no index: a file
    is found by its name, and what cannot be read is compiled again.

    Raises
    ------
    AttributeError
        If this Numba keeps its files in another way.
    """
    file = compiled._cache._cache_file
    pattern, read, write = file._data_name_pattern, file._load_data, file._save_data
    folder = Path(file._cache_path)
    if not callable(file.load) or not callable(file.save):
        raise AttributeError("load or save")

    def name_of(key):
        """Return what the name of the file begins with, and all of it; None if nobody can know it."""
        origins = digest_of(compiled.py_func, key[0])
        if origins is None:
            return None
        models = [(cls.__module__, cls.__qualname__) for cls in classes_in(key[0])]
        kind = _short(numba.__version__, BOUNDS_CHECKED, key[:2], models)
        return tuple(pattern.replace("{number:d}", name) for name in (kind, f"{kind}.{_short(key, origins)}"))

    def load(key):
        names = name_of(key)
        try:
            if names is not None:
                return read(names[1])
        except Exception:  # not there, damaged, or written by who knows whom: compiled again and replaced
            pass
        private.try_out()  # before anything is compiled
        return None

    def save(key, data):
        names = name_of(key)
        if names is None:
            return
        start = names[0].removesuffix(".nbc")
        stale = [old for old in folder.glob(f"{glob.escape(start)}.*.nbc") if old.name != names[1]]
        try:
            write(names[1], data)
            for old in stale:
                old.unlink(missing_ok=True)
        except OSError:  # a full disk is no reason to stop
            pass
        except Exception as error:
            private.leave_out(KEEPING, error)

    file.load, file.save = load, save
    return compiled


def _short(*words) -> str:
    return hashlib.sha256(repr(words).encode()).hexdigest()[:32]


@private.trial(KEEPING)
def _try() -> bool:
    asked: list = []
    compiled = numba.njit(cache=True)(_same)
    file = keep(compiled)._cache._cache_file
    file.load = asked.append
    file.save = lambda key, data: asked.append(key)
    return compiled(1) == 1 and len(asked) == 2 and isinstance(asked[0][0], tuple) and asked[0] == asked[1]


def _same(x):
    return x
