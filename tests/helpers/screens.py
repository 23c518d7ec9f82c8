"""Tables as they are printed, and the summary of a run that they show."""

from __future__ import annotations

import io

from carom.cli.tables import Screen

NOTHING = {"mean": None, "error": None}


def summary(**changes):
    """Return what the first table needs of a run of disks of two sizes between walls."""
    measured = {"mean": 2.0, "error": 0.01}
    return {
        "n": 100, "dimension": 2, "system": "hard disks", "packing_fraction": 0.5, "diameter": 1.5, "kT": 2.0,
        "Z": measured, "Z_infinite": NOTHING,
        "contact_value": NOTHING, "contact_value_from_rdf": NOTHING, "contact_values_from_rdf": {},
        "reduced_pressure": {"mean": 3.0, "error": 0.01}, "collision_rate": measured, "theory": [],
        "obstacles": [
            {"name": "x_low", "force": {"mean": 80.0, "error": 0.8},
             "pressure": {"mean": 8.0, "error": 0.08}},
            {"name": "floor", "force": {"mean": 8.0, "error": 0.08}, "pressure": NOTHING},
        ],
    } | changes  # fmt: skip


def printed(table, width=200, *, terminal=False):
    """Return a table as it is printed on a terminal of a width, or in a file."""
    screen = Screen(file=io.StringIO(), width=width, force_terminal=terminal, color_system=None)
    screen.print(table.rich(screen))
    return screen.file.getvalue()
