"""Progress bars in notebooks; on a terminal, bars are on standard error."""

from __future__ import annotations

import contextlib
import functools
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, TypeVar

from carom.texts import html

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress

T = TypeVar("T")

STEP = 0.005
"""Fraction of the work between two updates of a bar: 200 messages at most."""

LEAST = 0.005
"""Fraction of the work from which a bar shows a percentage. Before, it moves to and fro."""


def advance(bar: RichProgress, fraction: float | None, description: str) -> None:
    """Show the fraction done on a bar of one task; the bar moves to and fro if it is unknown or small."""
    (task,) = bar.tasks
    known = fraction is not None and fraction >= LEAST
    task.total = 1.0 if known else None  # update() and reset() take None for "as before"
    bar.update(task.id, completed=fraction if known else 0.0, description=description)


def in_notebook() -> bool:
    """Tell whether this runs in a Jupyter kernel."""
    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell is not None else None
    return running is not None and hasattr(running, "kernel")


Shown = Callable[..., None]
"""A bar: it is called with the fraction done and, optionally, a description."""


@contextlib.contextmanager
def bar(label: str) -> Iterator[Shown]:
    """Show a bar while the body runs, in the cell of a notebook or else on standard error."""
    with (_in_cell if in_notebook() else _on_terminal)(label) as shown:
        yield shown


def by_count(shown: Shown) -> Callable[[int, int], object]:
    """Return a progress callable that takes the number done and the total."""
    return lambda done, total: shown(done / total)


def watchable(
    label: str, adapt: Callable[[Shown], Callable[..., object]] | None = None
) -> Callable[[Callable[..., T]], Callable[..., T]]:
    """Let a function take ``progress=True``: a bar with a label, or what ``adapt`` makes of it."""

    def decorate(function: Callable[..., T]) -> Callable[..., T]:
        @functools.wraps(function)
        def watched(*args: Any, **kwargs: Any) -> T:
            if not isinstance(kwargs.get("progress"), bool):
                return function(*args, **kwargs)
            if not kwargs.pop("progress"):
                return function(*args, **kwargs)
            with bar(label) as shown:
                kwargs["progress"] = shown if adapt is None else adapt(shown)
                return function(*args, **kwargs)

        return watched

    return decorate


@contextlib.contextmanager
def _in_cell(label: str) -> Iterator[Callable[..., None]]:
    from IPython.display import HTML, display

    last = (-1.0, "")

    def picture(fraction: float, stage: str) -> Any:
        # Without a value, a bar in a browser moves to and fro.
        known = fraction >= LEAST
        value, percent = (f' value="{fraction:.4f}"', f"{100.0 * fraction:.0f} %") if known else ("", "")
        return HTML(f'<label>{html(stage)} <progress{value} max="1"></progress> {percent}</label>')

    handle = display(picture(0.0, label), display_id=True)

    def shown(fraction: float, stage: str = label) -> None:
        nonlocal last
        if stage != last[1] or abs(fraction - last[0]) >= STEP or (fraction >= 1.0 > last[0]):
            last = (fraction, stage)
            handle.update(picture(fraction, stage))

    yield shown


@contextlib.contextmanager
def _on_terminal(label: str) -> Iterator[Callable[..., None]]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    text = TextColumn("{task.description}", markup=False)
    columns = (text, BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        progress.add_task(label, total=None)
        yield lambda fraction, stage=label: advance(progress, fraction, stage)
