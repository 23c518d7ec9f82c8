"""A study as one self-contained page: no script, no network, pictures inside."""

from __future__ import annotations

import base64
import io
import math
import platform
import time as clock
from dataclasses import replace
from typing import Any

from carom.drawing.page import MARK
from carom.table import Table, facts, of_texts
from carom.texts import html
from carom.version import __version__

STYLE = """
:root { color-scheme: light dark; --ink: #1d2733; --ground: #ffffff; --line: #d5dbe1; --rule: #8a949e;
  --pane: #f3f5f7; --flag: #fdecea; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e6e6; --ground: #131416; --line: #33383f; --rule: #6b747d; --pane: #1d2024;
    --flag: #4a2422; }
  /* Pictures have no ground: black ink turns white, and hues stay. */
  img { filter: invert(0.92) hue-rotate(180deg); }
}
body { font: 15px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem;
  color: var(--ink); background: var(--ground); overflow-wrap: break-word; }
h1 { font-size: 1.6rem; line-height: 1.25; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.9rem; }
caption { text-align: left; font-weight: 600; padding: 0.4rem 0; }
th, td { padding: 0.15rem 0.7rem; text-align: right; border-bottom: 1px solid var(--line);
  white-space: nowrap; }
th { border-bottom: 2px solid var(--rule); } td.text, th.text { text-align: left; white-space: normal; }
tr.flagged { background: var(--flag); } img { max-width: 100%; height: auto; }
pre { background: var(--pane); padding: 0.8rem; overflow-x: auto; font-size: 0.85rem; }
.scroll { overflow-x: auto; }
@media (max-width: 699px) {
  body { margin: 1rem auto; font-size: 14px; } h1 { font-size: 1.3rem; }
  table { font-size: 0.8rem; } th, td { padding: 0.15rem 0.4rem; }
}
@page { size: A4 landscape; margin: 12mm; }
@media print {
  :root { color-scheme: light; --ink: #000000; --ground: #ffffff; --line: #d5dbe1; --rule: #8a949e;
    --pane: #f3f5f7; --flag: #fdecea; }
  img { filter: none; }
  body { max-width: none; margin: 0; padding: 0; font-size: 10pt; }
  /* What scrolls on a screen is cut on paper: so nothing scrolls, and cells break. */
  .scroll { overflow: visible; }
  table { font-size: 7.5pt; width: 100%; }
  th, td { padding: 0.1rem 0.25rem; overflow-wrap: anywhere; white-space: normal; }
  tr, img, pre { break-inside: avoid; } thead { display: table-header-group; } h2 { break-after: avoid; }
  pre { white-space: pre-wrap; overflow: visible; } img { max-height: 170mm; }
  tr.flagged { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
"""


def page(study: Any) -> str:
    """Return the page of a study."""
    said = " ".join([f"{study.progress[0].upper()}{study.progress[1:]} done.", *study.sentences()])
    parts: list[tuple[str, Any]] = [*(("Results", each) for each in study.tables()), *study.parts()]
    if study.failures:
        rows = [(study.place(failure.task), failure.reason) for failure in study.failures]
        failed = of_texts(("where", "what happened"), rows, left=2)
        parts.append((f"{study.unit.capitalize()} that failed", replace(failed, flagged=lambda row: True)))
    parts += [("Provenance", _provenance(study)), ("To repeat it", _repeat(study))]
    title = html(study.title)
    # Parts with the heading of the part before them stand below the same one.
    before, body = "", [f"<h1>{title}</h1>", f"<p>{html(said)}</p>"]
    for heading, part in parts:
        body += [f"<h2>{html(heading)}</h2>"] * (heading != before)
        body.append(_shown(part, heading))
        before = heading
    phone = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    head = f'<head><meta charset="utf-8">{phone}{MARK}<title>{title}</title><style>{STYLE}</style></head>'
    return f'<!DOCTYPE html>\n<html lang="en">{head}\n<body>\n' + "\n".join(body) + "\n</body></html>\n"


def _shown(part: Any, heading: str) -> str:
    if isinstance(part, Table):
        return part.html()
    if isinstance(part, str):
        return part
    data = io.BytesIO()
    part.savefig(data, format="svg", transparent=True)  # on the ground of either theme
    coded = base64.b64encode(data.getvalue()).decode("ascii")
    return f'<p><img alt="{html(heading)}" src="data:image/svg+xml;base64,{coded}"></p>'


def _provenance(study: Any) -> Table:
    notes = [record["provenance"] for record in study.records]
    began = [note["began"] for note in notes]

    def each(name: str) -> str:
        return ", ".join(sorted({str(note[name]) for note in notes})) or "-"

    def date(seconds: float) -> str:
        return clock.strftime("%Y-%m-%d %H:%M:%S UTC", clock.gmtime(seconds))

    collisions = sum(int(record["result"].get("collisions", 0)) for record in study.records)
    engine = math.fsum(note.get("engine_seconds", 0.0) for note in notes)
    pairs = [
        ("Carom", __version__),
        ("Python, NumPy", f"{each('python')}; {each('numpy')}"),
        ("seed", str(getattr(study.spec, "seed", "-"))),
        ("machines", each("host")),
        ("this machine", f"{platform.system()} {platform.machine()}"),
        ("engine", study.engine or "results read from the folder"),
        (f"{study.unit} begun", f"{date(min(began))} to {date(max(began))}" if began else "-"),
        ("wall time of this session", f"{study.seconds:.1f} s" if study.seconds else "-"),
        (f"time of all {study.unit}", f"{math.fsum(note['seconds'] for note in notes):.1f} s"),
    ]
    if collisions:
        pairs.append(("collisions", f"{collisions:,}".replace(",", " ")))
    if collisions and engine:
        pairs.append(("collisions per second of one worker", f"{collisions / engine:.3g}"))
    return facts("", pairs)


def _repeat(study: Any) -> str:
    """Return the file and the command that repeat the study."""
    command = f"{study.command} study.toml --out {study.name} --report"
    return (
        f"<p>Save this as <code>study.toml</code> and run <code>{command}</code>. The same version of Carom "
        "gives the same bits, on every engine and with any number of workers.</p>"
        f"<pre>{html(study.spec.to_toml())}</pre>"
    )
