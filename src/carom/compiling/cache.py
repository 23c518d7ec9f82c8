"""Compiled code kept on disk, and used again only where nothing that it was made of has changed."""

from __future__ import annotations

import glob
import hashlib
import pickle
from contextlib import suppress
from pathlib import Path

import numba
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.runtime import rtsys

from carom.compiling.code_digest import classes_in, digest_of

BOUNDS_CHECKED = getattr(config, "BOUNDSCHECK", None)
"""What NUMBA_BOUNDSCHECK says."""

CHECKED = hashlib.sha256().digest_size
"""Bytes at the beginning of a file: the SHA-256 of the others."""


def cached(function, options):
    """Return a compiled function whose code is kept on disk, where a folder can be written."""
    compiled = numba.njit(**options)(function)
    if compiled is not function:  # as it is without a compiler
        with suppress(RuntimeError, OSError):  # Numba found no such folder: compile in every process
            compiled._cache = NamedFiles(compiled)
    return compiled


class NamedFiles(FunctionCache):
    """The code of a function in files that are named after all that it depends on.

    Every file begins with its checksum. A damaged one is compiled again, and would end the process if it were
    loaded.

    Numba's own cache looks at the source of the compiled function alone, so that code outlives an edit to
    what that function calls. It lists the types of all arguments seen in one index: with that, every program
    imports the modules of everybody's models, and ends where one of them is gone. And it numbers its files:
    two processes that compile for different scenes could take the same number. Here there is no index: a file
    is found by its name, and what cannot be read is compiled again.
    """

    def __init__(self, compiled):
        super().__init__(compiled.py_func)
        self.compiled = compiled

    def load_overload(self, sig, target_context):
        """Return the code for a signature, or None."""
        # Numba's own would first load all that it compiles with, which takes 11 MiB. Code that is compiled
        # already needs Numba's runtime alone.
        rtsys.initialize(target_context)
        with suppress(Exception):  # not there, damaged, or written by who knows whom: compiled again
            content = self._names(sig, target_context.codegen())[-1].read_bytes()
            if hashlib.sha256(content[CHECKED:]).digest() == content[:CHECKED]:
                return self._impl.rebuild(target_context, pickle.loads(content[CHECKED:]))
        return None

    def save_overload(self, sig, data):
        """Keep the code for a signature, in the place of what was compiled of other sources."""
        if not self._impl.check_cachable(data):
            return
        names = self._names(sig, data.codegen)
        if not names:
            return
        kind, file = names
        with suppress(OSError):  # a full disk, or a folder that is gone, is no reason to stop
            self._impl.locator.ensure_cache_path()
            stale = [old for old in kind.parent.glob(f"{glob.escape(kind.name)}.*.nbc") if old != file]
            content = self._cache_file._dump(self._impl.reduce(data))
            with self._cache_file._open_for_write(str(file)) as target:
                target.write(hashlib.sha256(content).digest() + content)
            for old in stale:
                old.unlink(missing_ok=True)

    def _names(self, sig, codegen) -> tuple[Path, ...]:
        """Return what the name of the file begins with, and all of it; nothing if nobody can know it."""
        key = self._index_key(sig, codegen)
        kinds = getattr(sig, "args", sig)
        origins = digest_of(self.compiled, kinds)
        if origins is None:
            return ()
        models = [(cls.__module__, cls.__qualname__) for cls in classes_in(kinds)]
        kind = f"{self._impl.filename_base}.{_short(numba.__version__, BOUNDS_CHECKED, key[:2], models)}"
        folder = Path(self.cache_path)
        return folder / kind, folder / f"{kind}.{_short(key, origins)}.nbc"


def _short(*words) -> str:
    return hashlib.sha256(repr(words).encode()).hexdigest()[:32]
