"""Pictures of a study: Z, its deviation from theory, the pressure; the order parameter; Z against 1/N."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import texts, theory
from carom.errors import InputError
from carom.models.files.tables import from_table
from carom.pictures import paper
from carom.scene import description
from carom.studies.eos.table import Row, compared
from carom.studies.phase import ENDS, finite_size_shift, usual_equation
from carom.theory import Equation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


STYLES = ("-", "--", ":", "-.")
SIZES = (paper.INK, "#b8651b", "#2e7d4f", "#8e3b6f", "#5b5fb0", "#6b6b6b")
MARKERS = "osD^v<>ph*"
CURVE = 200
"""Points of a curve."""


def study(
    result: Any,
    *,
    equations: Mapping[str, Equation] | None = None,
    path: str | os.PathLike[str] | None = None,
) -> Figure:
    """Draw Z, its deviation from theory in standard errors, and the pressure, one below the other.

    Of the ``equations``, by label, the first is compared with the data.
    """
    rows = result.table
    if not rows:
        raise InputError("No point of the study is done yet, so there is nothing to draw.")
    chosen = _equations(result, equations)
    # Without an equation of state there are no deviations to draw.
    heights = [3.0, 1.6, 2.4] if chosen else [3.0, 2.4]
    figure = _figure(7.0, 1.2 * sum(heights))
    panels = figure.subplots(len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights})
    top, bottom = panels[0], panels[-1]
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
    species = result.records[0]["result"]["species"]
    _curves(top, rows, chosen, species, pressure=False)
    _curves(bottom, rows, chosen, species, pressure=True)
    _points(top, rows, "Z_infinite", "Z_error", legend=True)
    if chosen:
        _deviations(panels[1], rows, next(iter(chosen.items())), compare=equations is not None)
    _points(bottom, rows, "reduced_pressure", "reduced_pressure_error", legend=False)
    top.set_ylabel("compressibility factor $Z$")
    dimension = rows[0].dimension
    bottom.set_ylabel(rf"pressure $P\sigma^{dimension}/kT$" if dimension > 1 else r"pressure $P\sigma/kT$")
    bottom.set_xlabel(r"packing fraction $\eta$")
    top.legend(loc="upper left", fontsize=8.5, framealpha=0.92, edgecolor="none")
    sizes = sorted({row.n for row in rows})
    shown = ", ".join(map(str, sizes)) if len(sizes) < 5 else f"{sizes[0]} to {sizes[-1]}"
    name = kind(dimension, result.spec.scene, mixture=len(species) > 1)
    top.set_title(f"{name[0].upper()}{name[1:]}, $N$ = {shown}", fontsize=paper.TITLE)
    return paper.saved(figure, path)


def kind(dimension: int, scene: Mapping[str, Any], *, mixture: bool) -> str:
    """Return what the particles of a study with such a ``scene`` are, e.g. "mixture of hard disks"."""
    given = scene.get("interaction")
    interaction = from_table(given, "interaction") if isinstance(given, Mapping) else given
    name = description.kind(dimension, interaction=interaction)
    return f"mixture of {name}" if mixture else name


def order(result: Any, *, path: str | os.PathLike[str] | None = None) -> Figure | None:
    """Draw order parameter and susceptibility against packing fraction; None where none was measured."""
    rows = [row for row in result.table if math.isfinite(row.order)]
    if not rows:
        return None
    figure = _figure(7.0, 5.6)
    top, bottom = figure.subplots(2, 1, sharex=True)
    symbol = {2: r"\psi_6", 3: "Q_6"}[rows[0].dimension]
    for axes in (top, bottom):
        axes.spines[["top", "right"]].set_visible(False)
    for number, n in enumerate(sorted({row.n for row in rows})):
        some = [row for row in rows if row.n == n]
        eta = [row.packing_fraction for row in some]
        errors = [row.order_error if math.isfinite(row.order_error) else 0.0 for row in some]
        style: dict[str, Any] = {"marker": MARKERS[number % len(MARKERS)], "markersize": 4, "linewidth": 1.0}
        (line,) = top.plot(eta, [row.order for row in some], label=f"$N$ = {n}", **style)
        top.errorbar(eta, [row.order for row in some], errors, fmt="none", ecolor=line.get_color(), capsize=2)
        bottom.plot(eta, [row.susceptibility for row in some], color=line.get_color(), **style)
        flagged = [row for row in some if not row.equilibrated]
        hollow = {**style, "color": line.get_color(), "markerfacecolor": "white", "linestyle": "none"}
        for axes, name in ((top, "order"), (bottom, "susceptibility")):
            axes.plot(
                [row.packing_fraction for row in flagged],
                [getattr(row, name) for row in flagged],
                zorder=4,
                **hollow,
            )
    top.set_ylabel(rf"$\langle|{symbol}|\rangle$")
    bottom.set_ylabel(rf"$N\,(\langle|{symbol}|^2\rangle - \langle|{symbol}|\rangle^2)$")
    bottom.set_xlabel(r"packing fraction $\eta$")
    top.legend(fontsize=8.5, frameon=False)
    return paper.saved(figure, path)


def sizes(result: Any, *, path: str | os.PathLike[str] | None = None) -> Figure | None:
    """Draw Z against 1 / N with the fitted line and theory's, a panel for each density; None for one size."""
    fits = result.extrapolate()
    if not fits:
        return None
    columns = min(3, len(fits))
    lines = math.ceil(len(fits) / columns)
    figure = _figure(3.2 * columns + 0.6, 2.7 * lines + 0.3)
    panels = np.atleast_1d(figure.subplots(lines, columns, squeeze=False)).ravel()
    for axes, fit in zip(panels, fits, strict=False):
        axes.spines[["top", "right"]].set_visible(False)
        some = [row for row in result.table if row.packing_fraction == fit.packing_fraction]
        inverse = np.array([1.0 / row.n for row in some])
        for row in some:
            axes.errorbar(
                1.0 / row.n,
                row.Z,
                row.Z_error if math.isfinite(row.Z_error) else 0.0,
                fmt="o",
                color=paper.INK,
                markerfacecolor=paper.INK if row.equilibrated else "white",
                markersize=4,
                capsize=2,
            )
        x = np.array([0.0, 1.05 * inverse.max()])
        axes.plot(x, fit.Z + fit.slope * x, color=paper.INK, linewidth=1.2, label="fit")
        if math.isfinite(fit.theory_slope):
            axes.plot(
                x, fit.Z + fit.theory_slope * x,
                color=paper.WARM, linestyle="--", linewidth=1.1, label="slope by theory",
            )  # fmt: skip
        axes.errorbar(
            [0.0], [fit.Z], [fit.Z_error], fmt="D", color=paper.INK,
            markerfacecolor="white", markersize=4.5, capsize=2,
        )  # fmt: skip
        axes.set_title(rf"$\eta = {fit.packing_fraction:.4g}$", fontsize=9.5)
        axes.set_xlabel("$1/N$")
        axes.set_ylabel("$Z$")
        axes.tick_params(labelsize=8)
        axes.ticklabel_format(useOffset=False)
    for axes in panels[len(fits) :]:
        axes.set_visible(False)
    panels[0].legend(fontsize=8, frameon=False)
    return paper.saved(figure, path)


def _figure(width: float, height: float) -> Figure:
    from carom.pictures.importing import picture

    return picture()(width, height, paper.DPI)


def _equations(result: Any, given: Mapping[str, Equation] | None) -> dict[str, Equation]:
    """Return the equations of state to draw, by name; the first is compared with the data."""
    own, first = result.equation, result.records[0]
    if given is not None:
        return dict(given)
    if own is not None:
        return {getattr(own, "__name__", "theory").replace("_", " "): own}
    if not compared(first):
        return {}
    dimension, species = result.spec.dimension, first["result"]["species"]
    if len(species) == 1:
        return dict(reversed(theory.equations(dimension).items()))
    equation = usual_equation(dimension, "fluid", species)
    name = "Boublik, Mansoori et al." if dimension == 3 else "Santos, Yuste and Lopez de Haro"
    return {} if equation is None else {name: equation}


def _curves(
    axes: Axes,
    rows: Sequence[Row],
    equations: Mapping[str, Equation],
    species: Sequence[tuple[float, int]],
    *,
    pressure: bool,
) -> None:
    """Draw theory. The unit of pressure has the largest diameter; the packing fraction has all diameters."""
    dimension = rows[0].dimension
    n = sum(count for _, count in species)
    mean = sum(count * diameter**dimension for diameter, count in species) / n
    volume = theory.ball_volume(dimension) * mean / max(diameter for diameter, _ in species) ** dimension
    for state in ("fluid", "solid"):
        etas = [row.packing_fraction for row in rows if row.phase == state]
        if not etas:
            continue
        shown = equations
        if state == "solid":
            shown = _crystals(dimension) if equations and len(species) == 1 else {}
        low = 0.0 if state == "fluid" else min(etas)
        within = np.linspace(low if low or not pressure else 1e-9, max(etas), CURVE)
        for (name, equation), style in zip(shown.items(), STYLES * len(shown), strict=False):
            eta = within if state == "solid" else within[within <= ENDS.get(name, 1.0)]
            try:
                z = np.array([float(equation(float(e))) for e in eta])
            except InputError:
                continue
            values = z * eta / volume if pressure else z
            colour = paper.GREY if state == "fluid" else paper.WARM
            axes.plot(
                eta, values, color=colour, linestyle=style, linewidth=1.1, label=texts.label(name), zorder=2
            )


def _crystals(dimension: int) -> dict[str, Equation]:
    """Return the equation of state of the crystal, by name; nothing beyond six dimensions."""
    if dimension > 6:
        return {}
    return {"Almarza (fcc)" if dimension == 3 else "free volume": theory.solid(dimension)}


def of_size(number: int) -> str:
    """Return the colour for a number of particles by its rank, from the smallest; dark, to show on white."""
    return SIZES[number % len(SIZES)]


def _points(axes: Axes, rows: Sequence[Row], name: str, error: str, *, legend: bool) -> None:
    """Draw one quantity; flagged points are hollow."""
    for number, n in enumerate(sorted({row.n for row in rows})):
        for good in (True, False):
            some = [row for row in rows if row.n == n and row.equilibrated is good]
            values = [getattr(row, name) for row in some]
            if name == "Z_infinite":  # without a finite-size correction, Z of n particles is shown
                values = [v if math.isfinite(v) else r.Z for v, r in zip(values, some, strict=True)]
            if not some:
                continue
            errors = [e if math.isfinite(e) else 0.0 for e in (getattr(row, error) for row in some)]
            axes.errorbar(
                [row.packing_fraction for row in some],
                values,
                errors,
                fmt=MARKERS[number % len(MARKERS)],
                color=of_size(number),
                markerfacecolor=of_size(number) if good else "white",
                markersize=4,
                capsize=2,
                linewidth=0.9,
                zorder=4,
                label=(f"measured, $N$ = {n}" + ("" if good else ", flagged")) if legend else None,
            )


def _deviations(axes: Axes, rows: Sequence[Row], first: tuple[str, Equation], *, compare: bool) -> None:
    """Draw the deviation of every point from theory in standard errors."""
    axes.axhspan(-1.0, 1.0, color=paper.PALE, alpha=0.35, linewidth=0, zorder=1)
    axes.axhline(0.0, color=paper.GREY, linewidth=0.8, zorder=2)
    for number, n in enumerate(sorted({row.n for row in rows})):
        for row in rows:
            deviation = row.deviation
            if compare and row.Z_error > 0.0 and row.phase == "fluid":
                shift = finite_size_shift(row.phase, row.packing_fraction, n, first[1])
                infinite = row.Z - shift
                deviation = (infinite - float(first[1](row.packing_fraction))) / row.Z_error
            if row.n != n or not math.isfinite(deviation):
                continue
            axes.plot(
                row.packing_fraction, deviation, marker=MARKERS[number % len(MARKERS)],
                color=of_size(number), markerfacecolor=of_size(number) if row.equilibrated else "white",
                markersize=4, zorder=4,
            )  # fmt: skip
    axes.set_ylabel("(measured − theory)\n/ error", fontsize=9)
    low, high = axes.get_ylim()
    limit = max(3.0, abs(low), abs(high))
    axes.set_ylim(-limit, limit)
    if any(row.phase == "fluid" for row in rows):
        axes.set_title(f"against {texts.label(first[0])}", fontsize=8.5, loc="right", color=paper.GREY)
