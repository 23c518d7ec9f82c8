"""Pictures of a study: Z and its deviation from theory; the order parameter; Z against 1/N."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import texts, theory
from carom.errors import InputError
from carom.figures import palette, style
from carom.models.files.tables import from_table
from carom.scene import description
from carom.studies.eos.table import Row, compared
from carom.studies.phase import ENDS, finite_size_shift, usual_equation
from carom.theory import Equation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MARKERS = "osD^v<>ph*"
CURVE = 200
"""Points of a curve."""


def study(
    result: Any,
    *,
    equations: Mapping[str, Equation] | None = None,
    path: str | os.PathLike[str] | None = None,
) -> Figure:
    """Draw Z, and below it by how much it lies above theory, with the other theories.

    Of the ``equations``, by label, the first is compared with the data.
    """
    rows = result.table
    if not rows:
        raise InputError("No point of the study is done yet, so there is nothing to draw.")
    chosen = _equations(result, equations)
    # Without an equation of state there are no deviations to draw.
    heights = [3.0, 2.0] if chosen else [3.0]
    how: dict[str, Any] = {"sharex": True, "squeeze": False, "height_ratios": heights}
    figure, found = style.panels(7.0, 6.4 if chosen else 4.2, len(heights), **how)
    panels = found[:, 0]
    species = result.records[0]["result"]["species"]
    top = panels[0]
    _curves(top, rows, chosen, species)
    for n, good, some in _marked(rows):
        values = [row.Z_infinite if math.isfinite(row.Z_infinite) else row.Z for row in some]
        name = f"measured, $N$ = {n}" + ("" if good else ", flagged")
        _points(top, rows, n, good, some, values, [row.Z_error for row in some], name)
    if chosen:
        _deviations(panels[1], rows, chosen, compare=equations is not None)
    top.set_ylabel("compressibility factor $Z$")
    panels[-1].set_xlabel(r"packing fraction $\eta$")
    top.legend(loc="upper left", fontsize=8.5, framealpha=0.92, edgecolor="none")
    sizes = sorted({row.n for row in rows})
    shown = ", ".join(map(str, sizes)) if len(sizes) < 5 else f"{sizes[0]} to {sizes[-1]}"
    name = kind(rows[0].dimension, result.spec.scene, mixture=len(species) > 1)
    top.set_title(f"{name[0].upper()}{name[1:]}, $N$ = {shown}", fontsize=style.TITLE)
    return style.saved(figure, path)


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
    figure, (top, bottom) = style.panels(7.0, 5.6, 2, sharex=True)
    symbol = {2: r"\psi_6", 3: "Q_6"}[rows[0].dimension]
    for number, n in enumerate(sorted({row.n for row in rows})):
        some = [row for row in rows if row.n == n]
        eta = [row.packing_fraction for row in some]
        errors = [row.order_error if math.isfinite(row.order_error) else 0.0 for row in some]
        look: dict[str, Any] = {
            "marker": MARKERS[number % len(MARKERS)], "color": style.shade(number), "markersize": 4,
            "linewidth": 1.0,
        }  # fmt: skip
        top.plot(eta, [row.order for row in some], label=f"$N$ = {n}", **look)
        top.errorbar(eta, [row.order for row in some], errors, fmt="none", ecolor=look["color"], capsize=2)
        bottom.plot(eta, [row.susceptibility for row in some], **look)
        flagged = [row for row in some if not row.equilibrated]
        hollow = {**look, "markerfacecolor": "white", "linestyle": "none"}
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
    return style.saved(figure, path)


def sizes(result: Any, *, path: str | os.PathLike[str] | None = None) -> Figure | None:
    """Draw Z against 1 / N with the fitted line and theory's, a panel for each density; None for one size."""
    fits = result.extrapolate()
    if not fits:
        return None
    columns = min(3, len(fits))
    lines = math.ceil(len(fits) / columns)
    figure, found = style.panels(3.2 * columns + 0.6, 2.7 * lines + 0.3, lines, columns, squeeze=False)
    panels = found.ravel()
    for axes, fit in zip(panels, fits, strict=False):
        some = [row for row in result.table if row.packing_fraction == fit.packing_fraction]
        inverse = np.array([1.0 / row.n for row in some])
        for row in some:
            axes.errorbar(
                1.0 / row.n,
                row.Z,
                row.Z_error if math.isfinite(row.Z_error) else 0.0,
                fmt="o",
                color=palette.INK,
                markerfacecolor=palette.INK if row.equilibrated else "white",
                markersize=4,
                capsize=2,
            )
        x = np.array([0.0, 1.05 * inverse.max()])
        axes.plot(x, fit.Z + fit.slope * x, color=palette.INK, linewidth=1.2, label="fit")
        if math.isfinite(fit.theory_slope):
            axes.plot(
                x, fit.Z + fit.theory_slope * x,
                color=palette.WARM, linestyle="--", linewidth=1.1, label="slope by theory",
            )  # fmt: skip
        axes.errorbar(
            [0.0], [fit.Z], [fit.Z_error], fmt="D", color=palette.INK,
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
    return style.saved(figure, path)


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
    axes: Axes, rows: Sequence[Row], equations: Mapping[str, Equation], species: Sequence[tuple[float, int]]
) -> None:
    """Draw Z by theory, of the fluid and of the crystal."""
    shown, d = {"fluid": dict(equations)}, rows[0].dimension
    if equations and len(species) == 1 and d <= 6:
        shown["solid"] = {"Almarza (fcc)" if d == 3 else "free volume": theory.solid(d)}
    looks = iter(palette.THEORIES * 4)
    for state, known in shown.items():
        etas = [row.packing_fraction for row in rows if row.phase == state]
        if not etas:
            continue
        within = np.linspace(0.0 if state == "fluid" else min(etas), max(etas), CURVE)
        for (name, equation), (color, line) in zip(known.items(), looks, strict=False):
            eta = within if state == "solid" else within[within <= ENDS.get(name, 1.0)]
            with contextlib.suppress(InputError):
                z = [float(equation(float(e))) for e in eta]
                axes.plot(eta, z, color=color, ls=line, lw=1.1, label=texts.label(name), zorder=2)


def _marked(rows: Sequence[Row]) -> Iterator[tuple[int, bool, list[Row]]]:
    """Yield the rows of each size, and of these the good ones and the flagged ones."""
    for n in sorted({row.n for row in rows}):
        for good in (True, False):
            if some := [row for row in rows if row.n == n and row.equilibrated is good]:
                yield n, good, some


def _points(
    axes: Axes, rows: Sequence[Row], n: int, good: bool, some: Sequence[Row], values: Any, errors: Any,
    label: str | None = None,
) -> None:  # fmt: skip
    """Draw a quantity of some rows of one size; flagged points are hollow."""
    number = sorted({row.n for row in rows}).index(n)
    color = style.shade(number)
    axes.errorbar(
        [row.packing_fraction for row in some], values, [e if math.isfinite(e) else 0.0 for e in errors],
        fmt=MARKERS[number % len(MARKERS)], color=color, markerfacecolor=color if good else "white",
        markersize=4, capsize=2, linewidth=0.9, zorder=4, label=label,
    )  # fmt: skip


def _deviations(axes: Axes, rows: Sequence[Row], equations: Mapping[str, Equation], *, compare: bool) -> None:
    """Draw by how many percent Z of the fluid lies above the first theory, and the other theories do."""
    (name, first), *others = equations.items()
    axes.axhline(0.0, color=palette.THEORIES[0][0], linewidth=1.1, zorder=2)
    seen, bars = [0.0], [0.0]
    for n, good, some in _marked(rows):
        kept, values, errors = [], [], []
        for row in some:
            infinite, theory = row.Z_infinite, row.theory
            if compare and row.phase == "fluid":
                infinite = row.Z - finite_size_shift(row.phase, row.packing_fraction, n, first)
                theory = float(first(row.packing_fraction))
            if row.phase == "fluid" and math.isfinite(infinite / theory):
                kept.append(row)
                values.append(100.0 * (infinite / theory - 1.0))
                errors.append(100.0 * row.Z_error / abs(theory))
        if kept:
            _points(axes, rows, n, good, kept, values, errors)
            seen, bars = [*seen, *values], [*bars, *filter(math.isfinite, errors)]
    # The data set the axis: a long error bar or another theory may leave it.
    limit = max(1.3 * float(np.max(np.abs(seen))), 2.0 * float(np.median(bars))) or 1.0
    axes.set_ylim(-limit, limit)
    etas = [row.packing_fraction for row in rows if row.phase == "fluid"]
    for (other, equation), (color, line) in zip(others, palette.THEORIES[1:], strict=False):
        eta = np.linspace(0.0, max(etas, default=0.0), CURVE)
        eta = eta[eta <= min(ENDS.get(name, 1.0), ENDS.get(other, 1.0))]
        with contextlib.suppress(InputError):
            above = np.array(
                [100.0 * (float(equation(float(e))) / float(first(float(e))) - 1.0) for e in eta]
            )
            above[np.abs(above) > limit] = math.nan
            axes.plot(eta, above, color=color, ls=line, lw=1.1, zorder=2)
    axes.set_ylabel(f"above {texts.label(name)} [%]", fontsize=9)
