"""How far a command is: a progress bar on standard error, or a line now and then."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from carom.cli.heartbeat import quiet, say

if TYPE_CHECKING:
    from rich.progress import ProgressColumn

    from carom.observables import Prediction


UNMEASURED = ("Preparing", "Compiling", "Drawing")
"""Stages that do not report their progress: the bar moves to and fro instead of staying at 0 %."""


def columns(description: str = "{task.description}") -> tuple[ProgressColumn, ...]:
    """Return the columns of a bar: compiling is called so; fraction and time left are shown if known."""
    from rich.progress import (
        BarColumn,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    return (
        TextColumn(description, markup=False),
        BarColumn(),
        TaskProgressColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TaskProgressColumn("left"),
        TimeRemainingColumn(),
    )


@contextlib.contextmanager
def watched(first: str = "Starting") -> Iterator[Callable[[float, str], None]]:
    """Show a progress bar while the body runs; without a terminal, print a line now and then."""
    if quiet():
        yield lambda fraction, text: None
        return
    if not sys.stderr.isatty():
        from carom.cli.heartbeat import Heartbeat

        with Heartbeat(first).beating() as heart:
            yield lambda fraction, text: heart.tell(text, None if text in UNMEASURED else fraction)
        return
    from rich.progress import Progress

    from carom.cli.tables import Screen
    from carom.notebook import advance

    with Progress(*columns("{task.description:<14}"), console=Screen(stderr=True), transient=True) as bar:
        task = bar.add_task(first, total=None)
        present = ""

        def progress(fraction: float, text: str) -> None:
            nonlocal present
            if text != present:
                present = text
                advance(bar, None, text)  # first: a reset draws the bar, and must not draw 0 % of what ended
                bar.reset(task)
            advance(bar, None if text in UNMEASURED else fraction, text)

        yield progress


def predicted(prediction: Prediction) -> None:
    """Print on standard error how long the requested accuracy will take."""
    if quiet():
        return
    say(
        f"Relative error {prediction.relative_error:.2g} so far; about {prediction.seconds:.3g} s more "
        f"({prediction.collisions:.2g} collisions)."
    )
