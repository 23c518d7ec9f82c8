"""Who is told when something is compiled, here or in a worker that sends word; and how long it takes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any

_LISTENERS: list[Callable[[str], object]] = []
_taken, _depth = 0.0, 0


@contextlib.contextmanager
def compiling() -> Iterator[None]:
    """Leave the time that the body takes out of :func:`running`."""
    global _taken, _depth
    began = time.perf_counter()
    _depth += 1
    try:
        yield
    finally:
        _depth -= 1
        _taken += time.perf_counter() - began


def under_way() -> bool:
    """Tell whether this process compiles now, or loads what it has compiled."""
    return _depth > 0


def running() -> float:
    """Return wall time [s] that does not pass while this process compiles, or loads what it has compiled."""
    return time.perf_counter() - _taken


def notify(news: str) -> None:
    """Tell all who listen in this process what is being compiled, in a sentence."""
    for listener in [*_LISTENERS]:
        listener(news)


def listen(listener: Callable[[str], object]) -> Callable[[], None]:
    """Call a function whenever something is compiled, or :func:`notify` is called; return how to end that.

    It is given a sentence that says what, or an empty text where nobody knows. Code from the cache is not
    reported.
    """
    from carom.compiling.numba_parts import event

    class Watch(event.Listener):
        """Passes on what Numba says."""

        def on_start(self, event: Any) -> None:
            """Pass it on."""
            cache = event.data["dispatcher"]._cache
            listener(cache.news(event.data["args"]) if hasattr(cache, "news") else "")

        def on_end(self, event: object) -> None:
            """Say nothing."""

    collector = Watch()
    event.register("numba:compile", collector)
    _LISTENERS.append(listener)

    def end() -> None:
        _LISTENERS.remove(listener)
        event.unregister("numba:compile", collector)

    return end


@contextlib.contextmanager
def listening(listener: Callable[[str], object]) -> Iterator[None]:
    """Call a function as :func:`listen` does, while the body runs."""
    end = listen(listener)
    try:
        yield
    finally:
        end()
