"""What is printed: one unit in a table, what its numbers mean, and terminals that are narrow or none."""

from __future__ import annotations

import dataclasses
import io
import math
import re
import time
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import typer
from helpers.frames import crystal, frame_of
from helpers.screens import found, printed
from rich.console import Console
from rich.progress import Progress, TaskProgressColumn
from typer.testing import CliRunner

from carom.cli import app, heartbeat, results, screen
from carom.cli.trouble import friendly
from carom.errors import CaromWarning
from carom.figures.palette import SERIES
from carom.figures.style import shade
from carom.notebook import advance
from carom.observables import Estimate
from carom.observables.packing import DISTINCT, packing_network
from carom.studies import Outcome
from carom.studies.eos import table as eos
from carom.studies.eos.study import composition
from carom.studies.report import STYLE
from carom.studies.runs.summary import Theory
from carom.studies.transport.study import Row
from carom.table import Table, of_texts


def test_all_pressures_of_a_table_have_one_unit_which_is_named():
    text = " ".join(printed(results._physics(found())).split())
    assert "P σ²/kT 3.000 ± 0.010" in text
    # 8 energy / length^2, times 1.5^2 / 2.
    assert "P σ²/kT on x_low 9.00 ± 0.09" in text
    assert "force σ/kT on floor 6.00 ± 0.06" in text
    assert "σ = 1.5 is the largest diameter, kT = 2." in text


def test_what_walls_do_to_packing_fraction_z_and_area_is_said_where_they_are_printed():
    text = " ".join(printed(results._physics(found())).split())
    for said in ("whole box", "Z counts collisions of pairs alone", "area of the surface itself"):
        assert said in text
    assert "whole box" not in printed(results._physics(found(obstacles=[])))


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({}, "Energy kept to 2e-15, no overlap beyond rounding, in equilibrium."),
        *(
            (
                {name: {"mean": 3.9, "error": 0.1, "n_eff": 9.9}},
                "Energy kept to 2e-15, no overlap beyond rounding.",
            )
            for name in ("Z", "U", "temperature", "volume")
        ),
        ({"remarks": ["It drifts."]}, "Energy kept to 2e-15, no overlap beyond rounding."),
        ({"Z": {"mean": None, "error": None}}, "Energy kept to 2e-15, no overlap beyond rounding."),
        ({"energy_drift": None, "worst_overlap": 3e-4}, "Overlaps up to 0.0003 diameters, steady."),
        (
            {"energy_drift": 0.42},
            "Energy changed by 0.42 of the kinetic energy, no overlap beyond rounding, steady.",
        ),
    ],
)
def test_one_line_says_whether_a_run_is_sound(changes, line):
    sound = {"energy_drift": -2e-15, "worst_overlap": 4e-16, "remarks": [], "Z": {"mean": 3.9, "error": 0.1}}
    assert results._health(found(**{**sound, **changes})) == line


@pytest.mark.parametrize(
    ("samples", "errors", "shown"),
    [(9.9, 1.0, "3.800"), (10.0, 1.0, "3.800 (+1.0)"), (50.0, 2.0, "3.800 (+0.5)")],
)
def test_theory_is_compared_from_ten_samples_on_with_the_error_of_both(samples, errors, shown):
    measured = Estimate(3.9, 0.1, samples, math.nan, 0)
    assert results._beside(measured, 3.8, Theory("", 3.8, 3.8, None, errors)) == shown


@pytest.mark.parametrize("width", [30, 60])
def test_a_table_wider_than_the_terminal_is_split_and_loses_nothing(width):
    theory = [
        {"name": f"An equation of state with a long name, {k}", "Z": 2.0 + 0.01 * k,
         "Z_infinite": None, "contact_value": None}
        for k in (1, 2)
    ]  # fmt: skip
    table = results._physics(found(theory=theory))
    shown, wide = printed(table, width, terminal=True), printed(table)
    assert max(map(len, shown.splitlines())) <= width
    assert "…" not in shown
    numbers = re.findall(r"\d+\.\d+", wide)
    assert sorted(re.findall(r"\d+\.\d+", shown)) == sorted(numbers)
    assert len(wide.splitlines()) < len(shown.splitlines())


def test_a_table_without_rows_is_its_title_and_its_notes():
    table = of_texts(
        ("", "measured"), [], "40 units at packing fraction 0.000349066", ["There is no one kT."]
    )
    assert printed(table, 60).splitlines() == [table.title, *table.notes]


def test_where_nobody_watches_a_terminal_a_line_says_now_and_then_what_goes_on(monkeypatch, capsys):
    monkeypatch.setattr(heartbeat, "EVERY", 0.05)
    with screen.watched() as progress:
        progress(0.0, "Preparing")
        time.sleep(0.2)
        progress(0.25, "Measuring")
        time.sleep(0.2)
    out, err = capsys.readouterr()
    assert out == ""
    assert re.search(r"^\d+ s: Preparing$", err, re.MULTILINE)
    assert re.search(r"^\d+ s: Measuring, 25 %$", err, re.MULTILINE)
    time.sleep(0.15)
    assert capsys.readouterr().err == ""  # it is over


def test_a_command_in_a_pipe_speaks_from_its_imports_to_its_last_picture(monkeypatch, capsys):
    from carom.cli import study

    monkeypatch.setattr(heartbeat, "EVERY", 0.05)

    @friendly
    def command():
        time.sleep(0.2)
        with study.watched("the first runs") as (told, _):
            time.sleep(0.2)
            told(0.25, "1 of 4 runs")
            time.sleep(0.2)
        time.sleep(0.2)

    command()
    said = re.sub(r"\d+ s: ", "", capsys.readouterr().err).splitlines()
    assert [word for word, before in zip(said, [None, *said], strict=False) if word != before] == [
        "Starting",
        "Compiling if need be, and the first runs",
        "1 of 4 runs, 25 %",
        "Finishing",
    ]
    time.sleep(0.15)
    assert capsys.readouterr().err == ""  # it is over


# ------------------------------------------------------------------------------------------------ contacts


def chain_with_gaps(gaps):
    """Return disks on a row each, pairs of which have these gaps."""
    pairs = [[[3.0 * (k % 20) + 1, 3.0 * (k // 20) + 1], [3.0 * (k % 20) + 2 + gap, 3.0 * (k // 20) + 1]]
             for k, gap in enumerate(gaps)]  # fmt: skip
    return frame_of(np.concatenate(pairs), (60.0, 3.0 * len(gaps) / 20 + 3.0))


def test_contacts_of_a_crystal_are_distinct():
    network = packing_network(crystal(2, 6))
    assert network.distinct
    assert network.note == ""


def test_gaps_without_a_void_are_said_to_tell_no_contacts():
    # Evenly spread over five decades: two next to each other differ by a factor of 10^(5 / 100).
    gaps = np.logspace(-6, -1, 100)
    network = packing_network(chain_with_gaps(gaps))
    assert network.void[1] < DISTINCT * network.void[0]
    assert not network.distinct
    assert "cannot be told from near contacts" in str(network)
    assert "Compress more slowly" in network.note


def test_a_void_above_gaps_that_no_force_explains_tells_no_contacts():
    """Of 100 contacts with gaps of 1e-10 none is weaker than 1 / 100; pairs at 1e-6 are no contacts."""
    gaps = np.concatenate([np.full(80, 1e-10), np.logspace(-9, -6, 20)])
    assert not packing_network(chain_with_gaps(gaps), gap=1e-3).separated
    assert packing_network(chain_with_gaps(gaps[:80]), gap=1e-3).separated
    weak = np.append(gaps[:80], 5e-9)
    assert packing_network(chain_with_gaps(weak), gap=1e-3).separated


def test_the_screen_prints_no_number_of_contacts_where_nobody_knows_it(capsys):
    packing = {
        "n": 300, "dimension": 2, "note": "done", "packing_fraction": 0.88, "Z": 1e6, "collisions": 5,
        "jamming_fraction": None, "isostatic": 599, "excess": 118, "rattlers": 1, "rattler_fraction": 0.01,
        "contacts": 717, "gap": 5e-5, "void": [3e-5, 9e-5], "contacts_note": "Contacts cannot be told.",
    }  # fmt: skip
    results._packing(SimpleNamespace(to_dict=lambda: packing), Path("here"), as_json=False)
    text = " ".join(capsys.readouterr().out.split())
    assert "717 with a gap below 5e-05" in text
    assert "isostatic" not in text
    assert "Contacts cannot be told." in text
    packing["contacts_note"] = ""
    results._packing(SimpleNamespace(to_dict=lambda: packing), Path("here"), as_json=False)
    assert "717 (isostatic: 599, +118)" in " ".join(capsys.readouterr().out.split())


# ------------------------------------------------------------------------ reports, completion


def test_the_title_of_a_report_says_the_composition_and_paper_cuts_nothing():
    assert composition([[1.0, 100]]) == ""
    assert composition([[1.0, 75], [0.5, 25]]) == ": 0.75 of diameter 1, 0.25 of diameter 0.5"
    assert composition([[k, 1] for k in range(1, 10)]).endswith("and 3 sizes more")
    printed = STYLE.split("@media print")[1]
    assert "overflow: visible" in printed
    assert "@page" in STYLE


def test_sizes_of_a_study_have_colors_of_their_own():
    assert len({shade(k) for k in range(len(SERIES))}) == len(SERIES) > 4


def test_the_shell_can_complete_commands():
    assert "--install-completion" in CliRunner().invoke(app, ["--help"]).output


@pytest.mark.parametrize("stage", ["Compiling", "Packing"])
def test_a_bar_shows_no_percentage_before_something_is_done(monkeypatch, stage):
    """A bar that stands at 0 % looks like a hang. Until half a percent is done it moves to and fro."""
    shown = io.StringIO()
    with Progress(TaskProgressColumn(), console=Console(file=shown, width=60), auto_refresh=False) as bar:
        bar.add_task("Starting", total=None)
        for fraction, percent in [(0.0, ""), (0.004, ""), (0.3, "30%"), (None, ""), (0.0, ""), (1.0, "100%")]:
            advance(bar, fraction, stage)
            (task,) = bar.tasks
            assert str(bar.columns[0](task)).strip() == percent
            assert (task.total is None) == (not percent)


def test_a_line_of_the_heartbeat_says_no_percentage_before_something_is_done():
    heart = heartbeat.Heartbeat("Starting")
    heart.tell("Packing", 0.0)
    assert heart.state == "Packing"
    heart.tell("Packing", 0.25)
    assert heart.state == "Packing, 25 %"


def coefficients(count):
    rows = [
        Row(0.1, n, "thermal_conductivity", 0.88, 0.03, 0.95225, 0.921, 5.664, 11.33, "")
        for n in range(count)
    ]
    return Table(Row, rows, notes=["* η = 0.1, N = 108: too short"])


@pytest.mark.parametrize("width", [60, 80])
def test_columns_without_room_on_a_terminal_stand_below_and_every_row_is_a_row(width):
    lines = printed(coefficients(3), width, terminal=True).splitlines()
    assert max(len(line.rstrip()) for line in lines) <= width
    words = ("thermal conductivity", "0.88 ± 0.03", "0.95225", "0.921", "5.664 and 11.33")
    for word in words:
        assert sum(word in line for line in lines) >= 3, word
    named = [line for line in lines if "thermal conductivity" in line]
    groups = len(named) // 3
    assert len(named) == 3 * groups
    assert groups == {60: 2, 80: 1}[width]
    assert lines[-1] == "* η = 0.1, N = 108: too short"


def test_a_flagged_row_is_red_on_a_terminal_and_marked_on_a_page():
    table = dataclasses.replace(coefficients(3), flagged=lambda row: row.n == 1)
    shown = io.StringIO()
    console = Console(file=shown, force_terminal=True, color_system="standard", width=100)
    console.print(table.rich(console))
    (red,) = (line for line in shown.getvalue().splitlines() if "\x1b[31m" in line)
    assert re.sub(r"\x1b\[\d*m", "", red).split()[:2] == ["0.1", "1"]
    (marked,) = (line for line in table.html().splitlines() if 'class="flagged"' in line)
    assert "<td>0.1</td><td>1</td>" in marked


def test_no_cell_of_a_table_is_folded_on_a_terminal_of_any_width():
    for width in range(40, 90):
        lines = printed(coefficients(1), width, terminal=True).splitlines()
        assert max(len(line.rstrip()) for line in lines) <= width
        for word in ("thermal conductivity", "0.88 ± 0.03", "0.95225", "0.921", "5.664 and 11.33"):
            assert any(word in line for line in lines), (width, word)


def test_a_row_is_one_line_of_a_file_however_narrow_it_seems():
    lines = printed(coefficients(5), 30, terminal=False).splitlines()
    assert sum("0.95225" in line and "5.664 and 11.33" in line for line in lines) == 5


def test_sentences_of_a_table_are_wrapped_on_a_terminal():
    words = ["for", "every", "measurement:", "what", "is", "wrong", "is", "rounding"]
    table = of_texts(("method", "choose it"), [("engine", " ".join(words))], left=2)
    lines = printed(table, 40, terminal=True).splitlines()
    assert max(map(len, lines)) <= 40
    assert " ".join(lines).split()[-len(words) - 1 :] == ["engine", *words]
    assert any(line.split()[1:] == words for line in printed(table, 40, terminal=False).splitlines())


@pytest.mark.parametrize("precise", [1e-4, 0.02])
def test_the_table_of_an_equation_of_state_fits_into_eighty_columns(precise):
    rows = [
        eos.Row(
            0.4567, 10_000, 3, "fluid", 16, 12.34567, precise, 12.35, 12.5, precise, 1.0, 12.34567, -1.2,
            15.6, 0.3, math.nan, math.nan, math.nan, 2.0, False, ("too short",), 1_000,
        )
    ]  # fmt: skip
    lines = printed(Table(eos.Row, rows), 80, terminal=True).splitlines()
    assert max(map(len, lines)) <= 80
    assert len([line for line in lines if "0.4567" in line]) == 1


@pytest.mark.parametrize(
    ("held", "count"), [([1.0] * 64, 11), ([100.0] * 5 + [0.001] * 59, 5), ([0.0] * 9, 0)]
)
def test_a_bed_prints_a_dozen_of_its_layers_from_the_floor_to_where_the_particles_end(held, count):
    known = {"mean": 1.0, "error": 0.1}
    layers = [
        {"low": float(k), "high": k + 1.0, "members": members, "kT": known} for k, members in enumerate(held)
    ]
    table = results._bed(found(layers=layers, weight=1.0))
    assert len(table) == count <= results.MOST_LAYERS
    assert f"{count} of {len(held)}" in table.title
    assert not table or printed(table).splitlines()[4].startswith("0 to ")


def test_a_sentence_is_a_note_once(capsys):
    @friendly
    def command():
        for text in ("few samples", "few samples", "near freezing"):
            warnings.warn(text, CaromWarning, stacklevel=2)
        warnings.warn("of a library", DeprecationWarning, stacklevel=2)

    command()
    assert capsys.readouterr().err == "Note: few samples\nNote: near freezing\n"


@pytest.mark.parametrize(("error", "code"), [(1.2e-3, 0), (1.5e-3, 3)])
def test_a_plan_that_misses_its_target_has_an_exit_code_of_its_own(error, code, tmp_path, capsys):
    promise = SimpleNamespace(target=SimpleNamespace(quantity="Z"), error=1e-3, cpu_seconds=1.0)
    outcome = Outcome(promise, Estimate(1.0, error, 1.0, 1.0, 1), 0.0, 1.0, [])
    found = 0
    try:
        results.show(outcome, tmp_path, as_json=False)
    except typer.Exit as ended:
        found = ended.exit_code
    assert found == code
    assert (tmp_path / "outcome.json").exists()
    assert ("1.50 of the promised one" in capsys.readouterr().err) == (code == 3)
