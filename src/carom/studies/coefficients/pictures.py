"""Pictures of a transport study, and its page."""

from __future__ import annotations

import base64
import io
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from carom import theory
from carom.errors import InputError
from carom.paths import replacing, writing
from carom.pictures import paper
from carom.studies.coefficients.measured import Measured, Row
from carom.studies.eos.html import STYLE, composition
from carom.studies.eos.pictures import kind
from carom.studies.eos.toml import text
from carom.texts import html
from carom.theory.transport import HIGHEST
from carom.version import __version__

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


def study(result: Measured, path: str | os.PathLike[str] | None = None) -> Figure:
    """Draw the coefficients over Enskog's against packing fraction, and the running shear viscosity.

    In two dimensions, and where there is no theory of Enskog, the running self-diffusion replaces the
    coefficients.

    Parameters
    ----------
    result : Measured
    path : path, optional
        Where to save the picture.

    Raises
    ------
    InputError
        If no point is done yet.
    """
    rows = result.table
    if not rows:
        raise InputError("No point of the study is done yet, so there is nothing to draw.")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.6, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    if all(row.exists for row in rows) and any(row.enskog for row in rows):
        _against_density(left, rows)
    else:
        _with_time(left, rows, "self_diffusion")
    _with_time(right, rows, "shear_viscosity")
    return paper.saved(figure, path)


def _against_density(axes: Axes, rows: list[Row]) -> None:
    """Draw the coefficients of all points over Enskog's."""
    for marker, (name, label) in zip(MARKERS, NAMES.items(), strict=True):
        points = [
            (row.packing_fraction, c.mean / enskog, c.error / enskog)
            for row in rows
            for key, (c, enskog) in row.quantities().items()
            if key == name and math.isfinite(enskog) and math.isfinite(c.mean)
        ]
        if points:
            x, y, e = np.transpose(points)
            axes.errorbar(x, y, e, fmt=marker, ms=4.5, lw=1.0, capsize=2.0, label=f"{label}, this $N$")
    infinite = [
        (row.packing_fraction, row.self_diffusion_infinite.mean / row.enskog.self_diffusion)
        for row in rows
        if row.enskog and math.isfinite(row.self_diffusion_infinite.mean)
    ]
    if infinite:
        axes.plot(
            *np.transpose(infinite), "o", mfc="none", ms=7.0, color="C0", label="the same, infinite $N$"
        )
        densest = max(row.packing_fraction for row in rows)
        eta = np.linspace(0.0, min(max(0.45, densest), HIGHEST), 100)
        axes.plot(eta, theory.erpenbeck_wood(eta), color="C0", lw=1.0, label="Erpenbeck and Wood")
    axes.axhline(1.0, color="0.6", lw=0.8)
    axes.set_xlabel(r"packing fraction $\eta$")
    axes.set_ylabel("coefficient / Enskog's")
    axes.legend(fontsize=8, frameon=False)


def _with_time(axes: Axes, rows: list[Row], name: str) -> None:
    """Draw the running coefficient ``name`` of all species, and its value over the window of the slope.

    It is divided by Enskog's, where all points have one.
    """
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
                axes.errorbar(x, y, e, fmt=".-", ms=4.0, lw=0.9, color=f"C{k % 10}", label=label)
                if row.exists:
                    at = [t / row.mean_free_time for t in c.window]
                    axes.plot(at, [c.mean / enskog] * 2, lw=4.0, alpha=0.3, color=f"C{k % 10}")
    axes.set_xscale("log")
    axes.set_xlabel("time / mean free time")
    axes.set_ylabel(f"running {NAMES[name]}" + (" / Enskog's" if divided else ""))
    if axes.has_data():
        axes.legend(fontsize=8, frameon=False)


UNITS = "Units are those of the scene, with k = 1; without a scene file σ = m = kT = 1."


def title_of(result: Measured) -> str:
    """Return a title that says what was simulated."""
    if not result.records:
        return "Transport coefficients"
    found = result.records[0]["result"]
    species = list(zip(found["diameters"], found["counts"], strict=True))
    name = kind(found["dimension"], result.spec.scene, mixture=len(species) > 1)
    article = "a " if len(species) > 1 else ""
    return f"Transport coefficients of {article}{name}{composition(species)}"


def write_report(result: Measured, path: Path) -> None:
    """Write a self-contained page: no script, no network, pictures inside.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    rows = result.to_dict()["table"]
    title = html(title_of(result))
    parts = [
        f"<h1>{title}</h1>",
        f"<p>{len(result.records)} of {len(result.spec.tasks())} runs done, by Carom {__version__}. "
        f"{UNITS} One standard error; slopes between the times given, by the rule in "
        "<code>carom.studies.coefficients.windows</code>.</p>",
        '<div class="scroll"><table><tr>',
    ]
    head = [name for name in (rows[0] if rows else {}) if name != "remark"]
    parts += [f"<th>{html(name)}</th>" for name in head] + ["</tr>"]
    for each in rows:
        cells = (f"{x:.5g}" if isinstance(x, float) else str(x) for x in (each[name] for name in head))
        parts.append("<tr>" + "".join(f"<td>{html(cell)}</td>" for cell in cells) + "</tr>")
    parts.append("</table></div>")
    remarks = dict.fromkeys(each["remark"] for each in rows if each["remark"])
    parts += [f"<p>{html(remark)}.</p>" for remark in remarks]
    if rows:
        buffer = io.BytesIO()
        study(result).savefig(buffer, format="png", dpi=110)
        picture = base64.b64encode(buffer.getvalue()).decode("ascii")
        parts.append(f'<img alt="coefficients" src="data:image/png;base64,{picture}">')
    parts += [
        "<h2>To repeat it</h2><pre>carom transport study.toml</pre>",
        f"<pre>{html(text(result.spec))}</pre>",
    ]
    page = (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{title}</title>"
        f"<style>{STYLE}</style></head>\n<body>\n" + "\n".join(parts) + "\n</body></html>\n"
    )
    with replacing(path) as temporary, writing(path):
        temporary.write_text(page, encoding="utf-8")
