"""A study as one self-contained page: no script, no network, pictures inside."""

from __future__ import annotations

import base64
import io
import math
import platform
import time as clock
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom import texts
from carom.paths import replacing, writing
from carom.studies.eos import fits, pictures
from carom.studies.eos.measured import Measured
from carom.studies.eos.table import Row
from carom.studies.eos.toml import text
from carom.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST_NAMED = 6
"""Largest number of diameters in the title of a mixture."""

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.9rem; }
th, td { padding: 0.15rem 0.7rem; text-align: right; border-bottom: 1px solid #ddd; }
th { border-bottom: 2px solid #888; } td.text, th.text { text-align: left; }
tr.flagged { background: #fdecea; } img { max-width: 100%; }
pre { background: #f4f4f4; padding: 0.8rem; overflow-x: auto; font-size: 0.85rem; }
.scroll { overflow-x: auto; }
@page { size: A4 landscape; margin: 12mm; }
@media print {
  body { max-width: none; margin: 0; padding: 0; font-size: 10pt; }
  /* What scrolls on a screen is cut on paper: so nothing scrolls, and cells break. */
  .scroll { overflow: visible; }
  table { font-size: 7.5pt; width: 100%; }
  th, td { padding: 0.1rem 0.25rem; overflow-wrap: anywhere; }
  tr, img, pre { break-inside: avoid; } thead { display: table-header-group; } h2 { break-after: avoid; }
  pre { white-space: pre-wrap; overflow: visible; } img { max-height: 170mm; }
  tr.flagged { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
"""


def write(study: Measured, path: Path) -> None:
    """Write the report of a study.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    page = document(study)
    with replacing(path) as temporary, writing(path):
        temporary.write_text(page, encoding="utf-8")


def document(study: Measured) -> str:
    """Return the report as one page of HTML."""
    rows = study.table
    species = study.records[0]["result"]["species"] if study.records else []
    name = pictures.kind(study.spec.dimension, study.spec.scene, mixture=len(species) > 1)
    title = f"Equation of state of {'a ' if len(species) > 1 else ''}{name}{composition(species)}"
    flagged = [row for row in rows if not row.equilibrated]
    parts = [
        f"<h1>{texts.html(title)}</h1>",
        f"<p>{_summary(study, rows, flagged)}</p>",
        "<h2>Results</h2>",
        _results(rows),
    ]
    if rows:
        parts.append(_picture(pictures.study(study), "Z, its deviation from theory, and the pressure"))
    if (figure := pictures.order(study)) is not None:
        parts += ["<h2>Order parameter</h2>", _picture(figure, "order parameter and susceptibility")]
    if (figure := pictures.sizes(study)) is not None:
        parts += ["<h2>Size of the system</h2>", _extrapolations(study), _picture(figure, "Z against 1/N")]
    parts += _virials(study)
    if study.failures:
        parts += ["<h2>Runs that failed</h2>", _failures(study)]
    parts += ["<h2>Provenance</h2>", _provenance(study), "<h2>To repeat it</h2>", _repeat(study)]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{texts.html(title)}</title><style>{STYLE}</style></head>\n<body>\n"
        + "\n".join(parts)
        + "\n</body></html>\n"
    )


def composition(species: Sequence[Sequence[float]]) -> str:
    """Return the diameters of a mixture and their fractions, at most six; "" for one diameter."""
    if len(species) < 2:
        return ""
    total = sum(count for _, count in species)
    sizes = [f"{count / total:.3g} of diameter {diameter:.4g}" for diameter, count in species[:MOST_NAMED]]
    more = f" and {len(species) - MOST_NAMED} sizes more" if len(species) > MOST_NAMED else ""
    return ": " + ", ".join(sizes) + more


def _summary(study: Measured, rows: Sequence[Row], flagged: Sequence[Row]) -> str:
    done, total = len(study.records), len(study.spec.tasks())
    said = [f"{len(rows)} points from {done} of {total} runs."]
    chi2 = study.chi2_per_point
    if math.isfinite(chi2):
        said.append(f"Mean squared deviation of the fluid from theory, in standard errors: {chi2:.2f}.")
    said.append(
        f"{len(flagged)} point{'s are' if len(flagged) != 1 else ' is'} flagged and left out of fits."
        if flagged
        else "Every point passed the tests of equilibrium."
    )
    return texts.html(" ".join(said))


def _results(rows: Sequence[Row]) -> str:
    header = (
        "η",
        "N",
        "runs",
        "Z",
        "error",
        "Z, infinite",
        "theory",
        "deviation",
        "P*",
        "χ²",
        "drift",
        "remarks",
    )
    body = []
    for row in rows:
        digits = _decimals(row.Z_error)
        cells = [
            f"{row.packing_fraction:.6g}",
            f"{row.n}",
            f"{row.replicas}",
            _number(row.Z, digits),
            _number(row.Z_error, digits),
            _number(row.Z_infinite, digits),
            _number(row.theory, digits),
            f"{row.deviation:+.1f}" if math.isfinite(row.deviation) else "",
            _number(row.reduced_pressure, _decimals(row.reduced_pressure_error)),
            _number(row.chi2, 1),
            f"{row.drift:+.1f}",
            "; ".join(row.remarks),
        ]
        body.append((cells, not row.equilibrated))
    return _table(header, body) + (
        "<p>Z of N particles with its standard error; Z of infinitely many by theory's correction of order "
        "1/N; deviation of the latter from theory in standard errors; pressure P* = Pσ<sup>d</sup>/kT, σ the "
        "largest diameter; χ² of the "
        "replicas; trend of the pressure, a standard normal number in equilibrium.</p>"
    )


def _extrapolations(study: Measured) -> str:
    header = ("η", "Z at 1/N = 0", "error", "slope", "error", "slope by theory", "χ²")
    body = []
    for fit in study.extrapolate():
        digits, slope = _decimals(fit.Z_error), _decimals(fit.slope_error)
        values = (
            f"{fit.packing_fraction:.6g}",
            _number(fit.Z, digits),
            _number(fit.Z_error, digits),
            _number(fit.slope, slope),
            _number(fit.slope_error, slope),
            _number(fit.theory_slope, slope),
            _number(fit.chi2, 1),
        )
        body.append((values, False))
    return _table(header, body)


def _virials(study: Measured) -> list[str]:
    from carom.errors import InputError

    try:
        found: fits.Virials = study.virials()
    except InputError:
        return []
    body = [
        (
            (
                f"{k}",
                _number(v, _decimals(e)),
                _number(e, _decimals(e)),
                f"{b:.7g}" if math.isfinite(b) else "",
            ),
            False,
        )
        for k, (v, e, b) in enumerate(zip(found.values, found.errors, found.known, strict=True), start=2)
    ]
    table = _table(("k", "B<sub>k</sub>/v<sup>k−1</sup>", "error", "published"), body, escaped=True)
    return [
        "<h2>Virial coefficients</h2>",
        table,
        f"<p>From {found.points} points, χ² = {found.chi2:.1f}.</p>",
    ]


def _failures(study: Measured) -> str:
    body = [
        (
            (
                f"{failure.task['scene']['packing_fraction']:g}",
                f"{failure.task['scene']['n']}",
                f"{failure.task['replica']}",
                failure.reason,
            ),
            True,
        )
        for failure in study.failures
    ]
    return _table(("η", "N", "replica", "what happened"), body)


def _provenance(study: Measured) -> str:
    notes = [record["provenance"] for record in study.records]
    began = [note["began"] for note in notes]

    def each(name: str) -> str:
        return ", ".join(sorted({str(note[name]) for note in notes})) or "-"

    def date(seconds: float) -> str:
        return clock.strftime("%Y-%m-%d %H:%M:%S UTC", clock.gmtime(seconds))

    collisions = sum(int(record["result"]["collisions"]) for record in study.records)
    engine_seconds = math.fsum(note["engine_seconds"] for note in notes)
    items = [
        ("Carom", __version__),
        ("Python, NumPy", f"{each('python')}; {each('numpy')}"),
        ("seed", str(study.spec.seed)),
        ("machines", each("host")),
        ("this machine", f"{platform.system()} {platform.machine()}"),
        ("engine", study.engine or "results read from the folder"),
        ("runs begun", f"{date(min(began))} to {date(max(began))}" if began else "-"),
        ("wall time of this session", f"{study.seconds:.1f} s" if study.seconds else "-"),
        ("time of all runs", f"{math.fsum(note['seconds'] for note in notes):.1f} s"),
        ("collisions", f"{collisions:,}".replace(",", " ")),
        (
            "collisions per second of one worker",
            f"{collisions / engine_seconds:.3g}" if engine_seconds else "-",
        ),
    ]
    return _table(("", ""), [(item, False) for item in items], text=True)


def _repeat(study: Measured) -> str:
    """Return the study file and the command that repeat the study."""
    command = "carom eos study.toml --out eos --report"
    return (
        f"<p>Save this as <code>study.toml</code> and run <code>{command}</code>. The same version of Carom "
        "gives the same bits, on every engine and with any number of workers.</p>"
        f"<pre>{texts.html(text(study.spec))}</pre>"
    )


def _picture(figure: Figure, description: str) -> str:
    data = io.BytesIO()
    figure.savefig(data, format="svg")
    coded = base64.b64encode(data.getvalue()).decode("ascii")
    return f'<p><img alt="{texts.html(description)}" src="data:image/svg+xml;base64,{coded}"></p>'


def _table(
    header: Sequence[str],
    rows: Iterable[tuple[Sequence[Any], bool]],
    *,
    escaped: bool = False,
    text: bool = False,
) -> str:
    shown = header if escaped else [texts.html(name) for name in header]
    last = len(header) - 1

    def style(k: int, words: bool) -> str:
        return ' class="text"' if (words and k == last) or text else ""

    words = bool(header[-1]) and header[-1] in ("remarks", "what happened")
    lines = ['<div class="scroll"><table>']
    if any(header):
        lines.append(
            "<tr>" + "".join(f"<th{style(k, words)}>{c}</th>" for k, c in enumerate(shown)) + "</tr>"
        )
    for cells, flagged in rows:
        inside = "".join(f"<td{style(k, words)}>{texts.html(str(c))}</td>" for k, c in enumerate(cells))
        mark = ' class="flagged"' if flagged else ""
        lines.append(f"<tr{mark}>{inside}</tr>")
    return "\n".join([*lines, "</table></div>"])


def _decimals(error: float) -> int:
    """Return the number of decimals that shows two digits of the error."""
    if not (math.isfinite(error) and error > 0.0):
        return 6
    return max(1 - math.floor(math.log10(error)), 0)


def _number(value: float, decimals: int) -> str:
    """Return a number as text; nothing if it is not finite."""
    return f"{value:.{decimals}f}" if math.isfinite(value) else ""
