"""What the commands print of a run, a packing and the runs of a plan, on standard output."""

from __future__ import annotations

import functools
import json
import math
import sys
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import typer

from carom.cli.heartbeat import say
from carom.cli.tables import Screen
from carom.cli.trouble import PARTLY
from carom.observables.statistics import Estimate
from carom.studies.packings.compression import PackingFolder
from carom.studies.packings.packing import Packing
from carom.studies.planner.outcome import Outcome
from carom.studies.result_folders import ResultFolder
from carom.studies.runs.folder import RunFolder
from carom.studies.runs.result import RunResult
from carom.studies.runs.summary import HEADS, BarostatMoves, Moves, Summary, Theory
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
    asked, Z = result._found.relative_error, result._found.Z
    if asked is None:
        return
    if Z is None or math.isinf(Z.error):
        missed(f"Z has no error yet; a relative error of {asked:g} was asked for.")
    if Z.error > asked * abs(Z.mean):
        missed(f"Z = {Z.mean:.6g} ± {Z.error:.2g}; a relative error of {asked:g} was asked for.")


def missed(sentence: str) -> NoReturn:
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
    found, console = result._found, Screen()
    console.print(_physics(found).rich(console))
    if found.layers:
        console.print(_bed(found).rich(console))
    console.print(_mechanics(result, verbose).rich(console))
    for said in (found.phase_note, found.note, found.without_trajectory, found.without_rdf):
        if said:
            console.print(said)
    console.print(_health(found))
    ready(console, RunFolder(result.folder), _longer(result), trusted=result._rules_logged)


def _health(found: Summary) -> str:
    """Return one line on whether the run can be trusted."""
    said, drift, overlap = [], found.energy_drift, found.worst_overlap
    kept = drift is not None and abs(drift) < EPSILON**0.5
    if drift is not None:
        changed = f"energy changed by {abs(drift):.2g} of the kinetic energy"
        said.append(f"energy kept to {abs(drift):.0e}" if kept else changed)
    small = overlap < EPSILON**0.75
    said.append("no overlap beyond rounding" if small else f"overlaps up to {overlap:.1g} diameters")
    if (frames := found.frames_with_overlaps) is not None:
        said[-1] += f" in {f'{frames} of ' if frames else ''}{found.frames} checked frames"
    few = any(map(_few, (found.Z, found.U, found.temperature, found.volume)))
    if found.Z is not None and not (found.remarks or found.phase_note or few):
        said.append("in equilibrium" if kept else "steady")
    line = ", ".join(said)
    return f"{line[0].upper()}{line[1:]}."


def _few(value: Estimate | None) -> bool:
    """Return whether an estimate has fewer than ten independent samples, and its error is a guess."""
    return value is not None and value.n_eff < FEWEST


def ready(console: Any, folder: ResultFolder, *more: str, trusted: bool = False) -> None:
    """Print the files of a folder, and the commands that may come next; ``trusted`` to call rules again."""
    names = [path.name for path in folder._files() if path.is_file()]
    # Not wrapped, so that a line can be copied.
    console.print(f"{folder.path}: {'  '.join(names)}", soft_wrap=True)
    look = typed("Look: carom view", folder.path) + (" --trust-code" if trusted else "")
    console.print("    ".join([look, *filter(None, more)]), soft_wrap=True)


def _longer(result: RunResult) -> str:
    """Return the commands that measure more, and longer."""
    found, where = result._found, result.folder
    if found.without_trajectory:
        return ""
    more = typed("Measure more: carom measure", where)
    if found.Z is None:
        return more
    if found.relative_error is not None:
        length = f"--relative-error {found.relative_error / 2.0:.2g}"
    else:
        each = LONGER * 2.0 * found.collisions / found.n
        length = f"-c {float(f'{each:.1g}'):.0f}"
    return f"{more}    {typed('Longer: carom run', where)} {length} {typed('-o', f'{where}-longer')}"


def _physics(found: Summary) -> Table:
    """Return the table that compares the measurement with theory."""
    shown: list[tuple[str, ...]] = []
    for name in ("Z", "Z_infinite", "contact_value", "contact_value_from_rdf"):
        if measured := getattr(found, name):
            theoretical = [getattr(row, name.removesuffix("_from_rdf")) for row in found.theory]
            beside = map(functools.partial(_beside, measured), theoretical, found.theory)
            shown.append((_head(found, name), _with_error(measured), *beside))
    per_kT = _head(found, "reduced_pressure")
    pairs = [(f"{HEADS['contact_values_from_rdf']} {k}", g) for k, g in found.contact_values_from_rdf.items()]
    ways = [(_head(found, name), getattr(found, name)) for name in ("volume", "U", "temperature")]
    ways += [*pairs, (per_kT, found.reduced_pressure)]
    shown += [(name, _with_error(value)) for name, value in ways if value is not None]
    if barostat := found.barostat:
        reduced = barostat.pressure * found.diameter**found.dimension / found.kT
        shown.append((f"{per_kT} of the barostat", f"{reduced:.6g}"))
        if barostat.step is not None:
            shown.append((f"volume moves accepted, step {barostat.step:.3g}", _share(barostat)))
    if found.collision_rate is not None:
        shown.append((HEADS["collision_rate"], _with_error(found.collision_rate)))
    if found.swaps and found.swaps.tried:
        shown.append(("swaps accepted", _share(found.swaps)))
    for surface in found.obstacles:
        for name, unit, factor in _units_of_force(found):
            if borne := _known(getattr(surface, name)):
                shown.append((f"{unit} on {surface.name}", _with_error(borne.scaled(factor))))
                break
    work = [(each.name, _known(each.power)) for each in found.obstacles]
    shown += [(f"work of {name} a time", _with_error(power)) for name, power in work if power]
    title = f"{found.n} {found.system} at packing fraction {found.packing_fraction:.6g}"
    return of_texts(("", "measured", *(row.name for row in found.theory)), shown, title, _meaning(found))


def _head(found: Summary, name: str) -> str:
    """Return what a quantity is called in this dimension, and Z with the number of particles."""
    return f"Z, N = {found.n}" if name == "Z" else HEADS[name].replace("^d", superscript(found.dimension))


def _known(value: Estimate | None) -> Estimate | None:
    """Return an estimate that has an error; of what is never hit neither a number nor its error is known."""
    return None if value is None or math.isinf(value.error) else value


def _share(moves: Moves | BarostatMoves) -> str:
    """Return which part of moves was accepted."""
    return f"{100.0 * moves.accepted / moves.tried:.1f} %" if moves.tried else "none tried"


def _units_of_force(found: Summary) -> list[tuple[str, str, float]]:
    """Return what is shown of an obstacle, in this order: its name in the summary, and its unit.

    In a field forces are in weights of a component. Else they are in units of kT where there is one kT.
    """
    sigma, d, kT = found.diameter, found.dimension, found.kT
    if w := found.weight:
        length = f" σ{superscript(d - 1)}" if d > 1 else ""
        return [("pressure", f"P{length}/mg", sigma ** (d - 1) / w), ("force", "force/mg", 1.0 / w)]
    if kT and found.thermal:
        per_kT = _head(found, "reduced_pressure")
        return [("pressure", per_kT, sigma**d / kT), ("force", "force σ/kT", sigma / kT)]
    return [("pressure", "P", 1.0), ("force", "force", 1.0)]


def _bed(found: Summary) -> Table:
    """Return the table of the layers along a field."""
    sigma, rows = found.diameter, []
    held = np.cumsum([layer.members for layer in found.layers])
    filled = int(np.searchsorted(held, FILLED * held[-1])) + 1 if held[-1] else 0
    shown = found.layers[: filled : math.ceil(filled / MOST_LAYERS) or 1]
    for layer in shown:
        kT, place = _known(layer.kT), f"{layer.low / sigma:.4g} to {layer.high / sigma:.4g}"
        text = "-" if kT is None else _with_error(kT.scaled(1.0 / ((found.weight or math.nan) * sigma)))
        rows.append((place, f"{layer.members:.4g}", text))
    title = "Layers along the field, from below"
    if len(shown) < len(found.layers):
        title += f": {len(shown)} of {len(found.layers)}, which summary.json has"
    return of_texts(("height/σ", "components", "granular kT/mgσ"), rows, title)


_WHOLE_BOX = (
    "Packing fraction and Z = PV/NkT are of the whole box: V includes what walls keep free and what "
    "obstacles fill."
)


def _meaning(found: Summary) -> list[str]:
    """Return the meaning of the numbers in the table, one sentence per line."""
    lines = []
    if found.theory:
        of = " of both, as theory is that of the mean volume" if found.barostat else ""
        lines.append(f"In brackets, from ten samples on: (measured - theory) / standard error{of}.")
    sigma = f"σ = {found.diameter:.6g} is the largest diameter"
    if found.weight:
        lines.append(f"{sigma}, mg = {found.weight:.6g} the mean weight of one.")
    elif found.thermal:
        lines.append(f"{sigma}, kT = {found.kT:.6g}.")
    else:
        lines.append(f"{sigma}. There is no one kT: a pressure is in units of the scene.")
    if found.obstacles and not found.weight:
        pairs = "Z counts collisions of pairs alone; the pressure on a wall is the momentum that it takes up."
        lines += [_WHOLE_BOX, pairs]
    if any(_known(surface.pressure) for surface in found.obstacles):
        lines.append(
            "A pressure is the force over the area of the surface itself: the face of the box, or the "
            "sphere or cylinder that an obstacle is. Centers turn around half a diameter before it."
        )
    return lines


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
    found, asked, Z = result._found, result._found.relative_error, _known(result._found.Z)
    reached = f"{Z.relative_error:.2g}" if Z and Z.mean else "?"
    spared = found.spared_contacts
    rows = [
        *([("relative error of Z", f"{reached}, {asked:.2g} was asked for")] if asked is not None else []),
        ("collisions", f"{found.collisions:,}".replace(",", " ") + f" in time {found.time:.6g}"),
        *([("elastic contacts", f"{spared}, below elastic_below or within contact_time")] if spared else []),
        *((f"{name} left", str(count)) for name, count in (found.units or {}).items()),
    ]
    timing = result.timing if verbose else {}
    engine = [
        *(
            (name.replace("_", " "), f"{drift:.1e}")
            for name in ("energy_drift", "momentum_drift")
            if (drift := getattr(found, name)) is not None
        ),
        ("worst overlap", f"{found.worst_overlap:.1e} diameters"),
        ("advancements", f"{100.0 * found.advancement_fraction:.1f} % of all events"),
    ]
    if timing:
        engine += [
            ("rate", f"{_rounded(timing['collisions_per_second'])} collisions per second"),
            ("wall time", f"{timing['seconds']:.1f} s"),
        ]
    return facts("", [*rows, *(engine if verbose else [])])


def _with_error(value: Estimate) -> str:
    """Return a mean with its standard error."""
    if math.isinf(value.error):
        return f"{value.mean:.6g} ± ?"
    places = decimals(value.error)
    return f"{value.mean:.{places}f} ± {value.error:.{places if value.error else 0}f}"


def _beside(measured: Estimate, theory: float | None, row: Theory) -> str:
    """Return a value of theory, with (measured - theory) / standard error in brackets, if that is known."""
    if theory is None:
        return "-"
    # One digit more than the measurement has, so that rounding does not affect the comparison.
    text = f"{theory:.{decimals(measured.error) + 1}f}"
    if not measured.error or math.isinf(measured.error) or _few(measured):
        return text
    return f"{text} ({(measured.mean - theory) / (measured.error * (row.errors or 1.0)):+.1f})"


def _rounded(rate: float) -> str:
    """Return a rate with three digits and spaces between thousands."""
    if rate < 1000:
        return f"{rate:.3g}"
    unit = 10 ** (math.floor(math.log10(rate)) - 2)
    return f"{round(rate / unit) * unit:,}".replace(",", " ")
