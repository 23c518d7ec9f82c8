"""Tables as they are printed, and the summary of a run that they show."""

from __future__ import annotations

import io

from carom.cli.tables import Screen
from carom.studies.runs.summary import Summary

NOTHING = {"mean": None, "error": None, "n_eff": None}


def summary(**changes):
    """Return the least that the file of a run of disks of two sizes between walls has."""
    measured = {"mean": 2.0, "error": 0.01, "n_eff": None}
    return {
        "n": 100, "dimension": 2, "system": "hard disks", "packing_fraction": 0.5, "diameter": 1.5, "kT": 2.0,
        "Z": measured, "Z_infinite": NOTHING,
        "contact_value": NOTHING, "contact_value_from_rdf": NOTHING, "contact_values_from_rdf": {},
        "reduced_pressure": measured | {"mean": 3.0}, "collision_rate": measured, "theory": [],
        "obstacles": [
            {"name": "x_low", "force": {"mean": 80.0, "error": 0.8, "n_eff": None},
             "pressure": {"mean": 8.0, "error": 0.08, "n_eff": None}},
            {"name": "floor", "force": {"mean": 8.0, "error": 0.08, "n_eff": None}, "pressure": NOTHING},
        ],
        "box": [10.0, 10.0], "collisions": 100, "time": 3.0, "relative_error": None, "without_rdf": None,
        "note": "", "phase_note": None, "spared_contacts": 0, "energy_drift": 1e-15, "momentum_drift": None,
        "worst_overlap": 0.0, "advancement_fraction": 0.1,
    } | changes  # fmt: skip


def found(**changes):
    """Return that summary as a value; estimates need no number of samples."""

    def whole(value):
        if isinstance(value, dict):
            more = {"n_eff": None} if "mean" in value else {}
            return more | {name: whole(each) for name, each in value.items()}
        return [whole(each) for each in value] if isinstance(value, list) else value

    return Summary.of(whole(summary(**changes)))


def printed(table, width=200, *, terminal=False):
    """Return a table as it is printed on a terminal of a width, or in a file."""
    screen = Screen(file=io.StringIO(), width=width, force_terminal=terminal, color_system=None)
    screen.print(table.rich(screen))
    return screen.file.getvalue()
