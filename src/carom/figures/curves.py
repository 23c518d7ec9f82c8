"""Curves, bands of one standard error, running means and groups of bars, from arrays."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.figures.palette import GRAY, INK, PALE

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def stated(text: str) -> str:
    """Return an estimate as text for a picture."""
    return text.replace("+-", "±").replace("inf", "∞")


def known(errors: np.ndarray) -> np.ndarray:
    """Return errors with zero in the place of those that are not known."""
    return np.where(np.isfinite(errors), errors, 0.0)


def curve(
    axes: Axes, x: np.ndarray, values: np.ndarray, errors: np.ndarray, label: str = "", color: str = INK
) -> None:
    """Draw a curve with its band of one standard error."""
    half = known(errors)
    axes.fill_between(x, values - half, values + half, color=color, alpha=0.25, linewidth=0)
    axes.plot(x, values, color=color, linewidth=1.4, label=label or None)


def running_mean(axes: Axes, durations: Sequence[float], values: Sequence[float], text: str) -> None:
    """Draw block values over the time t, and their running mean, whose last value ``text`` says."""
    if not values:
        raise InputError("The result holds no block of the run, so there is nothing to draw.")
    steps, heights = np.array(durations), np.array(values)
    time = np.cumsum(steps)
    axes.plot(time - 0.5 * steps, heights, ".", color=PALE, markersize=4, label="blocks")
    label = f"running mean, {text}"
    axes.plot(time, np.cumsum(steps * heights) / time, color=INK, linewidth=1.6, label=label)
    axes.set_xlabel("time t")


def points(axes: Axes, named: Iterable[tuple[str, float, float, str]]) -> None:
    """Draw values with error bars side by side: the name, the value, its error and the color of each."""
    rows = list(named)
    for k, (_, value, error, color) in enumerate(rows):
        axes.errorbar([k], [value], [error], fmt="o", color=color, capsize=3)
    axes.axhline(0.0, color=GRAY, linestyle=":", linewidth=0.8)
    axes.set_xticks(range(len(rows)), [name for name, *_ in rows])


def level(axes: Axes, value: float, **settings: Any) -> None:
    """Draw a thin dotted line at a value that means something."""
    axes.axhline(value, **{"color": GRAY, "linewidth": 0.8, "linestyle": ":", **settings})


def grouped(values: np.ndarray, durations: np.ndarray, group: int) -> tuple[np.ndarray, np.ndarray]:
    """Return means of ``group`` blocks each, and the time at the middle of each group."""
    starts = np.arange(0, values.size, group)
    lengths = np.add.reduceat(durations, starts)
    return np.add.reduceat(values * durations, starts) / lengths, np.cumsum(lengths) - 0.5 * lengths


def show_convergence(axes: Axes, shown: list[float], means: np.ndarray) -> None:
    """Set limits that show the convergence: most of the blocks, and every value in ``shown``."""
    low, high = np.quantile(means, [0.02, 0.98])
    low, high = min(low, *shown), max(high, *shown)
    margin = 0.12 * (high - low) or 0.05 * abs(high)
    axes.set_ylim(low - margin, high + margin)
