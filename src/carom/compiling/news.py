"""Who is told when something is compiled: in this process, or in a worker that sends word."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

_LISTENERS: list[Callable[[], object]] = []


def tell() -> None:
    """Tell all who listen in this process that something is being compiled."""
    for listener in [*_LISTENERS]:
        listener()


def listen(listener: Callable[[], object]) -> Callable[[], None]:
    """Call a function whenever something is compiled, or :func:`tell` is called; return how to end that.

    What is found in the cache is not compiled, and nobody is told of it. Who listens until the process ends
    need not end it.
    """
    from numba.core import event

    class Watch(event.Listener):
        """Passes on what Numba says."""

        def on_start(self, event: object) -> None:
            """Pass it on."""
            listener()

        def on_end(self, event: object) -> None:
            """Say nothing."""

    watch = Watch()
    event.register("numba:compile", watch)
    _LISTENERS.append(listener)

    def end() -> None:
        _LISTENERS.remove(listener)
        event.unregister("numba:compile", watch)

    return end


@contextlib.contextmanager
def listening(listener: Callable[[], object]) -> Iterator[None]:
    """Call a function as :func:`listen` does, while the body runs."""
    end = listen(listener)
    try:
        yield
    finally:
        end()
