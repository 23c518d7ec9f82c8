"""Compiled code kept on disk, and used again only where nothing that it was made of has changed."""

from __future__ import annotations

import glob
import hashlib
import pickle
from contextlib import suppress
from pathlib import Path

import numba
from numba.core import config

from carom.compiling import numba_features
from carom.compiling.code_digest import classes_in, digest_of

KEEPING = "compiled code kept on disk"

BOUNDS_CHECKED = getattr(config, "BOUNDSCHECK", None)
"""What NUMBA_BOUNDSCHECK says."""


CHECKED = hashlib.sha256().digest_size
"""Bytes at the beginning of a file: the SHA-256 of the others."""


def cached(function, options):
    """Return a compiled function whose code is kept on disk, or None where that cannot be."""
    try:
        return keep(numba.njit(**options, cache=True)(function))
    except (RuntimeError, OSError):  # Numba found no folder that can be written: compile in every process
        return None
    except AttributeError as error:
        numba_features.leave_out(KEEPING, error)
        return None


def keep(compiled):
    """Let a compiled function keep its code in files that are named after all that it depends on.

    Every file begins with its checksum. A damaged one is compiled again, and would end the process if it were
    loaded.

    Numba's own cache looks at the source of the compiled function alone, so that code outlives an edit to
    what that function calls. It lists the types of all arguments seen in one index: with that, every program
    imports the modules of everybody's models, and ends where one of them is gone. And it numbers its files:
    two processes that compile for different scenes could take the same number. Here there is no index: a file
    is found by its name, and what cannot be read is compiled again.

    Parameters
    ----------
    compiled : dispatcher
        The function, for which nothing has been compiled yet.

    Raises
    ------
    AttributeError
        If this Numba keeps its files in another way.
    """
    from numba.core.runtime import rtsys

    file = compiled._cache._cache_file
    pattern, pickled, opened = file._data_name_pattern, file._dump, file._open_for_write
    folder = Path(file._cache_path)
    if not callable(file.load) or not callable(file.save):
        raise AttributeError("load or save")
    load_one, save_all = compiled._cache._load_overload, compiled._cache.save_overload

    def read(name):
        content = (folder / name).read_bytes()
        if hashlib.sha256(content[CHECKED:]).digest() != content[:CHECKED]:
            raise ValueError("damaged")
        return pickle.loads(content[CHECKED:])

    def write(name, data):
        content = pickled(data)
        with opened(str(folder / name)) as target:
            target.write(hashlib.sha256(content).digest() + content)

    def load_overload(signature, target):
        # Numba's own would first load all that it compiles with, which takes 11 MiB. Code that is compiled
        # already needs Numba's runtime alone.
        rtsys.initialize(target)
        try:
            return load_one(signature, target)
        except OSError:
            return None

    def save_overload(signature, data):
        with suppress(OSError):  # a full disk, or a folder that is gone, is no reason to stop
            save_all(signature, data)

    def name_of(key):
        """Return what the name of the file begins with, and all of it; None if nobody can know it."""
        kinds = getattr(key[0], "args", key[0])
        origins = digest_of(compiled, kinds)
        if origins is None:
            return None
        models = [(cls.__module__, cls.__qualname__) for cls in classes_in(kinds)]
        kind = _short(numba.__version__, BOUNDS_CHECKED, key[:2], models)
        names = kind, f"{kind}.{_short(key, origins)}"
        return tuple(pattern.replace("{number:d}", name) for name in names)

    def load(key):
        names = name_of(key)
        try:
            if names is not None:
                return read(names[1])
        except Exception:  # not there, damaged, or written by who knows whom: compiled again and replaced
            pass
        numba_features.try_out()  # before anything is compiled
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
        except OSError:
            raise
        except Exception as error:
            numba_features.leave_out(KEEPING, error)

    file.load, file.save = load, save
    compiled._cache.load_overload, compiled._cache.save_overload = load_overload, save_overload
    return compiled


def _short(*words) -> str:
    return hashlib.sha256(repr(words).encode()).hexdigest()[:32]


@numba_features.trial(KEEPING)
def _try() -> bool:
    asked: list = []
    compiled = numba.njit(cache=True)(_same)
    file = keep(compiled)._cache._cache_file
    file.load = asked.append
    file.save = lambda key, data: asked.append(key)
    return compiled(1) == 1 and len(asked) == 2 and isinstance(asked[0][0], tuple) and asked[0] == asked[1]


def _same(x):
    return x
