"""The picture of ``carom trade``: error against speed for every method."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from carom.figures import palette, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from carom.studies.trade.rows import Row, SizeRow

LOOKS = {
    "event-driven": ("o", palette.INK),
    "naive": ("s", palette.GRAY),
    "time-driven": ("^", palette.WARM),
    "pseudo-hard": ("D", palette.SERIES[2]),
}
"""Marker and color of each algorithm."""

FLOOR = 2.0**-53
"""Position of an error of zero on the logarithmic axis: half a rounding."""


def picture(rows: Sequence[Row], sizes: Sequence[SizeRow]) -> Figure:
    """Draw the error of positions and the bias of Z against speed, and the error of Z against N."""
    figure, axes = style.panels(13.0, 4.2, 1, 3)
    first = axes[0]
    rates = [row.collisions_per_second for row in rows]
    # Doubles do not resolve errors below half a rounding.
    _panel(first, rows, rates, [max(row.error_1, FLOOR) for row in rows])
    first.legend(loc="center left", frameon=False, fontsize=9)
    first.set_ylabel(r"error after one collision a particle [$\sigma$]")
    # Without a significant bias, its standard error is the upper bound.
    biases = [max(abs(row.z_bias), row.z_error) for row in rows]
    _panel(axes[1], rows, rates, biases, bars=[row.z_error for row in rows])
    axes[1].set_ylabel(r"bias of $Z$, relative (or what hides it)")
    for panel in (first, axes[1]):
        panel.set_xlabel("collisions per CPU second")
    n = np.array([row.n for row in sizes])
    axes[2].loglog(n, [row.relative_error_1s for row in sizes], "o-", color=palette.INK)
    axes[2].loglog(n, np.abs([row.finite_size_bias for row in sizes]), "--", color=palette.GRAY)
    axes[2].set_xlabel("particles")
    axes[2].set_ylabel(r"relative error of $Z$")
    axes[2].legend(["statistical, after 1 CPU second", "of finite size"], frameon=False, fontsize=9)
    return figure


def _panel(
    axes: Axes, rows: Sequence[Row], rates: list[float], errors: list[float], bars: list[float] | None = None
) -> None:
    """Draw errors against speed: a point per row, a line per method, and the Pareto front."""
    if bars is not None:
        for k, row in enumerate(rows):
            axes.plot([rates[k]] * 2, [errors[k], errors[k] + bars[k]], color=LOOKS[row.algorithm][1], lw=1)
    for name, members in families(rows).items():
        members.sort(key=lambda k: rates[k])
        x, y = ([values[k] for k in members] for values in (rates, errors))
        marker, color = LOOKS[rows[members[0]].algorithm]
        face = "white" if name == "float32" else color
        axes.plot(x, y, marker + "-", color=color, markerfacecolor=face, lw=0.7, label=name)
    front = pareto(rates, errors)
    axes.plot([rates[k] for k in front], [errors[k] for k in front], "-", color=palette.PALE, lw=2, zorder=0)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.2, y=0.1)


def families(rows: Sequence[Row]) -> dict[str, list[int]]:
    """Return the indices of the rows of each method, all its time steps together."""
    found: dict[str, list[int]] = {}
    for k, row in enumerate(rows):
        name = re.sub(r"(^|, )step [\d.e-]+", "", row.method)
        name = f"stepping{name}" if row.algorithm == "time-driven" else name
        found.setdefault(name, []).append(k)
    return found


def pareto(speeds: list[float], errors: list[float]) -> list[int]:
    """Return the indices of the Pareto front, by speed: no other method is both faster and more accurate."""
    front: list[int] = []
    for k in sorted(range(len(speeds)), key=lambda k: (-speeds[k], errors[k])):
        if np.isfinite(errors[k]) and (not front or errors[k] < errors[front[-1]]):
            front.append(k)
    return front[::-1]
