"""Compiled code kept on disk, and used again only where nothing that it was made of has changed."""

from __future__ import annotations

import glob
import hashlib
import pickle
import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import filelock
import numba
from numba import config, types

from carom.compiling.code_digest import classes_in, digest_of
from carom.compiling.compile_listeners import notify
from carom.compiling.numba_parts import FunctionCache, rtsys

CHECKED = hashlib.sha256().digest_size
"""Bytes at the beginning of a file: the SHA-256 of the others, which begin with the seconds that it took."""

SECONDS = struct.Struct("<d")

PATIENCE = 600.0
"""Seconds for which a process waits for another that compiles the same. The lock of one that is killed ends
with it; nobody waits longer for one that is stopped, or whose drive keeps its lock."""


def cached(function, options):
    """Return a compiled function whose code is kept on disk, where a folder can be written."""
    compiled = numba.njit(**options)(function)
    if compiled is not function:  # as it is without a compiler
        with suppress(RuntimeError, OSError):  # Numba found no such folder: compile in every process
            compiled._cache = kept = NamedFiles(compiled)
            compile_for = compiled.compile

            def compile_alone(sig):
                with kept.alone(sig, compiled.targetctx.codegen()):
                    return compile_for(sig)

            compiled.compile = compile_alone
    return compiled


class NamedFiles(FunctionCache):
    """The code of a function in files named after all that it depends on; other processes wait for the first.

    A file begins with its checksum: a damaged one is compiled again, and would end the process if it were
    loaded. Numba's own cache looks at the function's source alone, so that code outlives an edit to what it
    calls. Its one index of types imports everybody's models, and fails where one is gone; its numbered files
    can clash.
    """

    def __init__(self, compiled):
        super().__init__(compiled.py_func)
        self.compiled = compiled
        self._began = 0.0

    @contextmanager
    def alone(self, sig, codegen) -> Iterator[None]:
        """Let the body compile for a signature, or load what another process has just compiled."""
        kind, file = self._names(sig, codegen)
        if file is None or file.exists():
            yield
            return
        lock = filelock.FileLock(f"{kind}.lock", thread_local=False)
        with suppress(OSError, NotImplementedError):  # nothing can be written, or the drive has no locks
            self._impl.locator.ensure_cache_path()
            try:
                lock.acquire(blocking=False)
            except filelock.Timeout:
                notify(f"Waiting for another process, which compiles {self._kind_of(sig)}.")
                lock.acquire(PATIENCE)  # a Timeout is an OSError
        try:
            yield
        finally:
            lock.release()

    def news(self, sig) -> str:
        """Return a sentence about what is about to be compiled, and how long it took here last time."""
        last = "ten seconds or more"
        with suppress(OSError, ValueError, struct.error):
            kept = Path(self.cache_path).glob(f"{glob.escape(self._impl.filename_base)}.*.nbc")
            with max(kept, key=lambda file: file.stat().st_mtime).open("rb") as file:
                last = f"it took {SECONDS.unpack_from(file.read(64), CHECKED)[0]:.0f} s the last time"
        return f"Compiling {self._kind_of(sig)}, which is new here: {last}."

    def _kind_of(self, sig) -> str:
        """Return what is compiled, in words: the function, and the models that it is compiled for."""
        names = []
        for part in _parts(getattr(sig, "args", sig)):
            if isinstance(part, types.UniTuple) and isinstance(part.dtype, types.Float):  # one an axis
                names.append(f"d = {part.count}")
            elif hasattr(part, "instance_class") and _is_choice(part.instance_class.__module__):
                names.append(part.instance_class.__name__)
        words = f" ({', '.join(dict.fromkeys(names))})" if names else ""
        return f"{self.compiled.py_func.__name__}{words}"

    def load_overload(self, sig, target_context):
        """Return the code for a signature, or None."""
        # Numba's own would first load all that it compiles with, which takes 11 MiB. Code that is compiled
        # already needs Numba's runtime alone.
        rtsys.initialize(target_context)
        with suppress(Exception):  # not there, damaged, or written by who knows whom: compiled again
            content = Path(self._names(sig, target_context.codegen())[1] or "").read_bytes()
            if hashlib.sha256(content[CHECKED:]).digest() == content[:CHECKED]:
                return self._impl.rebuild(target_context, pickle.loads(content[CHECKED + SECONDS.size :]))
        self._began = time.perf_counter()
        return None

    def save_overload(self, sig, data):
        """Keep the code for a signature, in the place of what was compiled of other sources."""
        if not self._impl.check_cachable(data):
            return
        kind, file = self._names(sig, data.codegen)
        if kind is None or file is None:
            return
        with suppress(OSError):  # a full disk, or a folder that is gone, is no reason to stop
            self._impl.locator.ensure_cache_path()
            stale = [old for old in kind.parent.glob(f"{glob.escape(kind.name)}.*.nbc") if old != file]
            content = SECONDS.pack(time.perf_counter() - self._began)
            content += self._cache_file._dump(self._impl.reduce(data))
            with self._cache_file._open_for_write(str(file)) as target:
                target.write(hashlib.sha256(content).digest() + content)
            for old in stale:
                old.unlink(missing_ok=True)

    def _names(self, sig, codegen) -> tuple[Path, Path] | tuple[None, None]:
        """Return what the name of the file begins with, and all of it; twice None if nobody can know it."""
        key = self._index_key(sig, codegen)
        kinds = getattr(sig, "args", sig)
        origins = digest_of(self.compiled, kinds)
        if origins is None:
            return None, None
        models = [(cls.__module__, cls.__qualname__) for cls in classes_in(kinds)]
        checked = config.BOUNDSCHECK  # type: ignore[attr-defined]  # made when Numba is imported
        kind = f"{self._impl.filename_base}.{_short(numba.__version__, checked, key[:2], models)}"
        folder = Path(self.cache_path)
        return folder / kind, folder / f"{kind}.{_short(key, origins)}.nbc"


def _parts(kinds) -> Iterator[types.Type]:
    """Yield types, and those within."""
    for kind in kinds:
        yield kind
        if isinstance(kind, types.BaseTuple):
            yield from _parts(kind)


def _is_choice(module: str) -> bool:
    """Tell whether some scenes have classes of a module, and others have not: not the frame of the engine."""
    return not module.startswith("carom.engine.") or module.startswith("carom.engine.neighbors.")


def _short(*words) -> str:
    return hashlib.sha256(repr(words).encode()).hexdigest()[:32]
