"""What the commands print of a run, a packing and the runs of a plan, on standard output."""

from __future__ import annotations

import functools
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import typer

from carom.cli.heartbeat import say
from carom.cli.tables import Screen
from carom.cli.trouble import PARTLY
from carom.studies.packings.compression import PackingFolder
from carom.studies.packings.packing import Packing
from carom.studies.planner.outcome import Outcome
from carom.studies.runs.folder import RunFolder
from carom.studies.runs.result import RunResult
from carom.table import Table, decimals, facts, of_texts
from carom.texts import particles, superscript, typed, visible

EPSILON = sys.float_info.epsilon
"""Of rounding. What is below its powers 1/2 and 3/4 counts as kept and as nothing."""

LONGER = 5.0
"""Length of a longer run that is proposed [that of the run]."""

MOST_LAYERS = 12
"""Largest number of layers along a field that are printed."""

FILLED = 0.99
"""Part of the particles that the printed layers reach up to."""

FEWEST = 10.0
"""Independent samples from which a run is said to be in equilibrium, and compared with theory."""


@functools.singledispatch
def show(found: Any, folder: Path, *, as_json: bool, verbose: bool = False) -> None:
    """Print what was found in a folder, by what it is: as JSON, or as tables; end with its exit code."""
    raise NotImplementedError


@show.register
def _plan(outcome: Outcome, folder: Path, *, as_json: bool, verbose: bool = False) -> None:
    """Print what a plan promised and reached, and write it to its folder."""
    outcome.save(folder)
    if as_json:
        print(json.dumps(outcome.words(), indent=2, allow_nan=False))
    else:
        print(f"\n{visible(outcome, lines=True)}\nResults in {visible(folder)}")
    if not outcome.kept:
        missed(f"The error is {outcome.error_ratio:.2f} of the promised one.")


@show.register
def _run(result: RunResult, folder: Path, *, as_json: bool, verbose: bool = False) -> None:
    """Print the summary of a run, with the numbers of the engine if ``verbose``."""
    _shown(result, as_json, verbose)
    asked, found = result.summary.get("relative_error"), result.summary["Z"]
    if asked is None:
        return
    if found["mean"] is None or found["error"] is None:
        missed(f"Z has no error yet; a relative error of {asked:g} was asked for.")
    if found["error"] > asked * abs(found["mean"]):
        missed(
            f"Z = {found['mean']:.6g} ± {found['error']:.2g}; a relative error of {asked:g} was asked for."
        )


def missed(sentence: str) -> None:
    """Say that something is finished and a target was missed; end with the exit code of that."""
    sys.stdout.flush()
    say(f"Note: {sentence}")
    raise typer.Exit(PARTLY)


def _shown(result: RunResult, as_json: bool, verbose: bool) -> None:
    if as_json:
        print(json.dumps(result.summary, indent=2, allow_nan=False, ensure_ascii=True))
        if not result.new:
            say(f"{result.folder} was finished already.")
        return
    if not result.new:
        print(f"{visible(result.folder)} was finished already; nothing was left to do.")
    console = Screen()
    console.print(_physics(result.summary).rich(console))
    if result.summary.get("layers"):
        console.print(_bed(result.summary).rich(console))
    console.print(_mechanics(result, verbose).rich(console))
    for note in (result.summary["phase_note"], result.summary["note"]):
        if note:
            console.print(note)
    for reason in (result.summary.get("without_trajectory"), result.summary["without_rdf"]):
        if reason:
            console.print(reason)
    console.print(_health(result.summary))
    ready(console, RunFolder(result.folder), _longer(result), trusted=result._rules_logged)


def _health(summary: dict[str, Any]) -> str:
    """Return one line on whether the run can be trusted."""
    said = []
    if (drift := summary["energy_drift"]) is not None:
        kept = abs(drift) < EPSILON**0.5
        said.append(
            f"energy kept to {abs(drift):.0e}" if kept
            else f"energy changed by {abs(drift):.2g} of the kinetic energy"
        )  # fmt: skip
    overlap = summary["worst_overlap"]
    small = overlap < EPSILON**0.75
    said.append("no overlap beyond rounding" if small else f"overlaps up to {overlap:.1g} diameters")
    if (frames := summary.get("frames_with_overlaps")) is not None:
        said[-1] += f" in {f'{frames} of ' if frames else ''}{summary['frames']} checked frames"
    doubts = summary.get("remarks") or summary.get("phase_note")
    few = any(_few(summary.get(name, {})) for name in ("Z", "U", "temperature", "volume"))
    if summary["Z"]["mean"] is not None and not (doubts or few):
        said.append("in equilibrium" if drift is not None and kept else "steady")
    line = ", ".join(said)
    return f"{line[0].upper()}{line[1:]}."


def _few(value: dict[str, Any]) -> bool:
    """Return whether an estimate has fewer than ten independent samples, and its error is a guess."""
    samples = value.get("n_eff")
    return samples is not None and samples < FEWEST


def ready(console: Any, folder: RunFolder, *more: str, trusted: bool = False) -> None:
    """Print the files of a folder, and the commands that may come next; ``trusted`` to call rules again."""
    names = [path.name for path in folder._files() if path.is_file()]
    # Not wrapped, so that a line can be copied.
    console.print(f"{folder.path}: {'  '.join(names)}", soft_wrap=True)
    look = typed("Look: carom view", folder.path) + (" --trust-code" if trusted else "")
    console.print("    ".join([look, *filter(None, more)]), soft_wrap=True)


def _longer(result: RunResult) -> str:
    """Return the commands that measure more, and longer."""
    summary, where = result.summary, result.folder
    if summary.get("without_trajectory"):
        return ""
    more = typed("Measure more: carom measure", where)
    if summary["Z"]["mean"] is None:
        return more
    if summary["relative_error"] is not None:
        length = f"--relative-error {summary['relative_error'] / 2.0:.2g}"
    else:
        each = LONGER * 2.0 * summary["collisions"] / summary["n"]
        length = f"-c {float(f'{each:.1g}'):.0f}"
    return f"{more}    {typed('Longer: carom run', where)} {length} {typed('-o', f'{where}-longer')}"


def _physics(summary: dict[str, Any]) -> Table:
    """Return the table that compares the measurement with theory."""
    n, dimension = summary["n"], summary["dimension"]
    system = summary.get("system", "particles")
    shown: list[tuple[str, ...]] = []
    rows = [
        (f"Z, N = {n}", "Z", "Z"),
        ("Z, infinite N", "Z_infinite", "Z_infinite"),
        ("g(σ+) from collisions", "contact_value", "contact_value"),
        ("g(σ+) from g(r)", "contact_value_from_rdf", "contact_value"),
    ]
    for name, key, theoretical in rows:
        measured = summary[key]
        if measured["mean"] is None:
            continue
        places = decimals(measured["error"])
        beside = [_beside(row, theoretical, measured, places) for row in summary["theory"]]
        shown.append((name, _with_error(measured), *beside))
    per_kT = f"P σ{superscript(dimension)}/kT"
    alone = [
        ("V", summary.get("volume")),
        ("U / N", summary.get("U")),
        ("kT", summary.get("temperature")),
        *((f"g(σ+) {name}", value) for name, value in summary["contact_values_from_rdf"].items()),
        (per_kT, summary["reduced_pressure"]),
    ]
    shown += [(name, _with_error(value)) for name, value in alone if value and value["mean"] is not None]
    if barostat := summary.get("barostat"):
        reduced = barostat["pressure"] * summary["diameter"] ** dimension / summary["kT"]
        shown.append((f"{per_kT} of the barostat", f"{reduced:.6g}"))
        if barostat["step"] is not None:
            shown.append((f"volume moves accepted, step {barostat['step']:.3g}", _share(barostat)))
    if (rate := summary["collision_rate"])["mean"] is not None:
        shown.append(("collision rate of one", _with_error(rate)))
    if (swaps := summary.get("swaps")) and swaps["tried"]:
        shown.append(("swaps accepted", _share(swaps)))
    for obstacle in summary["obstacles"]:
        for name, unit, factor in _units_of_force(summary):
            # Of what is never hit neither a number nor its error is known.
            if (borne := obstacle[name])["mean"] is not None and borne["error"] is not None:
                shown.append((f"{unit} on {obstacle['name']}", _with_error(_scaled(borne, factor))))
                break
    for obstacle in summary["obstacles"]:
        given = obstacle.get("power", _NONE)
        if given["mean"] is not None and given["error"] is not None:
            shown.append((f"work of {obstacle['name']} a time", _with_error(given)))
    title = f"{n} {system} at packing fraction {summary['packing_fraction']:.6g}"
    heads = "", "measured", *(row["name"] for row in summary["theory"])
    return of_texts(heads, shown, title, _meaning(summary))


def _share(moves: dict[str, Any]) -> str:
    """Return which part of moves was accepted."""
    return f"{100.0 * moves['accepted'] / moves['tried']:.1f} %" if moves["tried"] else "none tried"


_NONE = {"mean": None, "error": None}


def _units_of_force(summary: dict[str, Any]) -> list[tuple[str, str, float]]:
    """Return what is shown of an obstacle, in this order: its name in the summary, and its unit.

    In a field forces are in weights of a component. Else they are in units of kT where there is one kT.
    """
    sigma, d = summary["diameter"], summary["dimension"]
    if summary.get("weight"):
        w = summary["weight"]
        length = f" σ{superscript(d - 1)}" if d > 1 else ""
        return [("pressure", f"P{length}/mg", sigma ** (d - 1) / w), ("force", "force/mg", 1.0 / w)]
    if summary["kT"] and summary.get("thermal", True):
        kT = summary["kT"]
        return [("pressure", f"P σ{superscript(d)}/kT", sigma**d / kT), ("force", "force σ/kT", sigma / kT)]
    return [("pressure", "P", 1.0), ("force", "force", 1.0)]


def _bed(summary: dict[str, Any]) -> Table:
    """Return the table of the layers along a field."""
    sigma, rows = summary["diameter"], []
    held = np.cumsum([layer["members"] for layer in summary["layers"]])
    filled = int(np.searchsorted(held, FILLED * held[-1])) + 1 if held[-1] else 0
    shown = summary["layers"][: filled : math.ceil(filled / MOST_LAYERS) or 1]
    for layer in shown:
        kT = _scaled(layer["kT"], 1.0 / (summary["weight"] * sigma))
        known = kT["mean"] is not None and kT["error"] is not None
        place = f"{layer['low'] / sigma:.4g} to {layer['high'] / sigma:.4g}"
        rows.append((place, f"{layer['members']:.4g}", _with_error(kT) if known else "-"))
    title = "Layers along the field, from below"
    if len(shown) < len(summary["layers"]):
        title += f": {len(shown)} of {len(summary['layers'])}, which summary.json has"
    return of_texts(("height/σ", "components", "granular kT/mgσ"), rows, title)


_WHOLE_BOX = (
    "Packing fraction and Z = PV/NkT are of the whole box: V includes what walls keep free and what "
    "obstacles fill."
)


def _meaning(summary: dict[str, Any]) -> list[str]:
    """Return the meaning of the numbers in the table, one sentence per line."""
    lines = []
    if summary["theory"]:
        of = " of both, as theory is that of the mean volume" if summary.get("barostat") else ""
        lines.append(f"In brackets, from ten samples on: (measured - theory) / standard error{of}.")
    sigma = f"σ = {summary['diameter']:.6g} is the largest diameter"
    if summary.get("weight"):
        lines.append(f"{sigma}, mg = {summary['weight']:.6g} the mean weight of one.")
    elif summary.get("thermal", True):
        lines.append(f"{sigma}, kT = {summary['kT']:.6g}.")
    else:
        lines.append(f"{sigma}. There is no one kT: a pressure is in units of the scene.")
    if summary["obstacles"]:
        if not summary.get("weight"):
            lines += [
                _WHOLE_BOX,
                "Z counts collisions of pairs alone; the pressure on a wall is the momentum that it takes "
                "up.",
            ]
        if any(obstacle["pressure"]["error"] is not None for obstacle in summary["obstacles"]):
            lines.append(
                "A pressure is the force over the area of the surface itself: the face of the box, or the "
                "sphere or cylinder that an obstacle is. Centers turn around half a diameter before it."
            )
    return lines


def _scaled(value: dict[str, Any], factor: float) -> dict[str, Any]:
    """Return an estimate in another unit."""
    return {name: None if value[name] is None else factor * value[name] for name in ("mean", "error")}


@show.register
def _packing(packing: Packing, folder: Path, *, as_json: bool, verbose: bool = False) -> None:
    """Print the summary of a packing."""
    summary = packing.to_dict()
    if as_json:
        print(json.dumps(summary, indent=2, allow_nan=False, ensure_ascii=True))
        return
    kind = particles(summary["dimension"], summary["n"])
    rows = [
        ("packing fraction", f"{summary['packing_fraction']:.8g}"),
        ("Z = PV/NkT", "-" if summary["Z"] is None else f"{summary['Z']:.4g}"),
        ("collisions", f"{summary['collisions']:,}".replace(",", " ")),
    ]
    if summary["gap"] is not None:
        jammed, isostatic = summary["jamming_fraction"], summary["isostatic"]
        rows += [
            ("jams at", "-" if jammed is None else f"{jammed:.8g}"),
            ("rattlers", f"{summary['rattlers']} ({100.0 * summary['rattler_fraction']:.2f} %)"),
            ("contacts", f"{summary['contacts']} (isostatic: {isostatic}, {summary['excess']:+d})"),
            ("gap", "{:.2g}, in a void from {:.2g} to {:.2g}".format(summary["gap"], *summary["void"])),
        ]
        if summary["contacts_note"]:  # the number of contacts is not known then
            rows[-2:] = [("pairs", f"{summary['contacts']} with a gap below {summary['gap']:.2g}")]
    meant = ["Z is that of the last collisions, from pairs alone. A gap is a part of the contact distance."]
    if summary.get("confined"):
        meant = [_WHOLE_BOX, *meant, "Contacts with walls and obstacles count as contacts, not in Z."]
    console = Screen()
    console.print(facts(f"{summary['n']} {kind}: {summary['note']}", rows, meant).rich(console))
    if told := summary.get("contacts_note"):
        console.print(told)
    ready(console, PackingFolder(folder))


def _mechanics(result: RunResult, verbose: bool) -> Table:
    """Return the table about the run itself: what was asked for, and if ``verbose`` drifts and the rate."""
    summary = result.summary
    asked, spared = summary["relative_error"], summary["spared_contacts"]
    rows = [
        *([("relative error of Z", _reached(summary))] if asked is not None else []),
        ("collisions", f"{summary['collisions']:,}".replace(",", " ") + f" in time {summary['time']:.6g}"),
        *([("elastic contacts", f"{spared}, below elastic_below or within contact_time")] if spared else []),
        *((f"{name} left", str(count)) for name, count in (summary.get("units") or {}).items()),
    ]
    timing = result.timing if verbose else {}
    engine = [
        *(
            (name.replace("_", " "), f"{summary[name]:.1e}")
            for name in ("energy_drift", "momentum_drift")
            if summary[name] is not None
        ),
        ("worst overlap", f"{summary['worst_overlap']:.1e} diameters"),
        ("advancements", f"{100.0 * summary['advancement_fraction']:.1f} % of all events"),
    ]
    if timing:
        engine += [
            ("rate", f"{_rounded(timing['collisions_per_second'])} collisions per second"),
            ("wall time", f"{timing['seconds']:.1f} s"),
        ]
    return facts("", [*rows, *(engine if verbose else [])])


def _reached(summary: dict[str, Any]) -> str:
    """Return the relative error of Z and the one that was asked for."""
    z = summary["Z"]
    reached = f"{z['error'] / abs(z['mean']):.2g}" if z["mean"] and z["error"] is not None else "?"
    return f"{reached}, {summary['relative_error']:.2g} was asked for"


def _with_error(value: dict[str, Any]) -> str:
    """Return a mean with its standard error."""
    places = decimals(value["error"])
    if value["error"] is None:
        return f"{value['mean']:.6g} ± ?"
    return f"{value['mean']:.{places}f} ± {value['error']:.{places if value['error'] else 0}f}"


def _beside(row: dict[str, Any], key: str, measured: dict[str, Any], places: int) -> str:
    """Return a value of theory, with (measured - theory) / standard error in brackets, if that is known."""
    theory = row[key]
    if theory is None:
        return "-"
    # One digit more than the measurement has, so that rounding does not affect the comparison.
    text = f"{theory:.{places + 1}f}"
    if not measured["error"] or _few(measured):
        return text
    return f"{text} ({(measured['mean'] - theory) / (measured['error'] * row.get('errors', 1.0)):+.1f})"


def _rounded(rate: float) -> str:
    """Return a rate with three digits and spaces between thousands."""
    if rate < 1000:
        return f"{rate:.3g}"
    unit = 10 ** (math.floor(math.log10(rate)) - 2)
    return f"{round(rate / unit) * unit:,}".replace(",", " ")
