"""Pictures of a transport study."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom import theory
from carom.figures import palette, style
from carom.studies.transport.points import Coefficients
from carom.theory.transport import HIGHEST

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


NAMES = {
    "self_diffusion": "self-diffusion",
    "shear_viscosity": "shear viscosity",
    "bulk_viscosity": "bulk viscosity",
    "thermal_conductivity": "thermal conductivity",
}
MARKERS = "osD^"
WIDEST = 0.15
"""Relative error beyond which a point of the running coefficient is not drawn."""


def study(rows: list[Coefficients]) -> Figure:
    """Draw the coefficients over Enskog's against packing fraction, and the running shear viscosity.

    In two dimensions, where there is no theory of Enskog, and where no coefficient is known yet, the running
    self-diffusion replaces the coefficients.
    """
    figure, (left, right) = style.panels(9.6, 4.2, 1, 2)
    known = any(math.isfinite(c.mean) for row in rows for c, _ in row.quantities().values())
    if known and all(row.exists for row in rows) and any(row.enskog for row in rows):
        _against_density(left, rows)
    else:
        _with_time(left, rows, "self_diffusion")
    _with_time(right, rows, "shear_viscosity")
    return figure


def _against_density(axes: Axes, rows: list[Coefficients]) -> None:
    """Draw the coefficients of all points over Enskog's."""
    for k, (marker, (name, label)) in enumerate(zip(MARKERS, NAMES.items(), strict=True)):
        points = [
            (row.packing_fraction, c.mean / enskog, c.error / enskog)
            for row in rows
            for key, (c, enskog) in row.quantities().items()
            if key == name and math.isfinite(enskog) and math.isfinite(c.mean)
        ]
        if points:
            x, y, e = np.transpose(points)
            axes.errorbar(
                x,
                y,
                e,
                fmt=marker,
                ms=4.5,
                lw=1.0,
                capsize=2.0,
                color=style.shade(k),
                label=f"{label}, this $N$",
            )
    infinite = [
        (row.packing_fraction, row.self_diffusion_infinite.mean / row.enskog.self_diffusion)
        for row in rows
        if row.enskog and math.isfinite(row.self_diffusion_infinite.mean)
    ]
    if infinite:
        axes.plot(
            *np.transpose(infinite),
            "o",
            mfc="none",
            ms=7.0,
            color=palette.INK,
            label="self-diffusion, infinite $N$",
        )
        densest = max(row.packing_fraction for row in rows)
        eta = np.linspace(0.0, min(max(0.45, densest), HIGHEST), 100)
        axes.plot(eta, theory.erpenbeck_wood(eta), color=palette.INK, lw=1.0, label="Erpenbeck and Wood")
    axes.axhline(1.0, color=palette.GRAY, lw=0.8)
    axes.set_xlabel(r"packing fraction $\eta$")
    axes.set_ylabel("coefficient / Enskog's")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=8, frameon=False)


def _with_time(axes: Axes, rows: list[Coefficients], name: str) -> None:
    """Draw the running coefficient ``name`` of all species, and its value over the window of the slope.

    It is divided by Enskog's, where all points have one.
    """
    from matplotlib.ticker import LogFormatter

    several = len({row.n for row in rows}) > 1
    divided = all(row.enskog for row in rows)
    curves = [
        (row, key.removeprefix(name), c, enskog if divided else 1.0)
        for row in rows
        for key, (c, enskog) in row.quantities().items()
        if key == name or key.removeprefix(f"{name}_").isdecimal()
    ]
    for k, (row, species, c, enskog) in enumerate(curves):
        if math.isfinite(enskog):
            points = [
                (t / row.mean_free_time, e.mean / enskog, e.error / enskog)
                for t, e in zip(c.times, c.running, strict=True)
                if e.relative_error < WIDEST
            ]
            if points:
                x, y, e = np.transpose(points)
                label = rf"$\eta$ = {row.packing_fraction:.3g}" + (f", $N$ = {row.n}" if several else "")
                label += f", species {species[1:]}" if species else ""
                axes.errorbar(x, y, e, fmt=".-", ms=4.0, lw=0.9, color=style.shade(k), label=label)
                if row.exists:
                    at = [t / row.mean_free_time for t in c.window]
                    axes.plot(at, [c.mean / enskog] * 2, lw=4.0, alpha=0.3, color=style.shade(k))
    axes.set_xscale("log")
    for which in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
        which(LogFormatter())
    axes.set_xlabel("time / mean free time")
    axes.set_ylabel(f"running {NAMES[name]}" + (" / Enskog's" if divided else ""))
    if axes.has_data():
        axes.legend(loc="lower right", fontsize=8, frameon=False)
    else:
        axes.text(0.5, 0.5, "not known yet", transform=axes.transAxes, ha="center")
