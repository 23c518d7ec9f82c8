"""The summary of a finished run as ``carom resume`` reads it: every field that is shown is checked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from carom import checks
from carom.io import records
from carom.scene import lattices
from carom.scene.box import LONGEST_EDGE

_NUMBER = records.optional(records.number())
_POSITIVE = records.number(low=0.0)
_COUNT = records.integer(high=2**63)
_TEXT = records.optional(records.text)

_ESTIMATE = records.table(
    {"mean": _NUMBER, "error": records.optional(_POSITIVE), "n_eff": records.optional(_POSITIVE)}
)

_THEORY = records.table(
    {"name": records.text, **dict.fromkeys(("Z", "Z_infinite", "contact_value"), _NUMBER)},
    later={"errors": records.number(low=0.0, open_low=True)},
)

_ALIKE = {
    _ESTIMATE: "Z Z_infinite reduced_pressure collision_rate contact_value contact_value_from_rdf",
    _POSITIVE: "packing_fraction kT time advancement_fraction",
    _COUNT: "collisions spared_contacts",
    _NUMBER: "energy_drift momentum_drift",
    _TEXT: "without_rdf note phase_note",
}

SUMMARY = records.table(
    {
        **{name: check for check, names in _ALIKE.items() for name in names.split()},
        "n": records.integer(low=1, high=lattices.MOST),
        "dimension": records.integer(low=1, high=lattices.MOST_DIMENSIONS),
        "box": records.listed(records.number(low=0.0, high=LONGEST_EDGE * checks.MAGNITUDE, open_low=True)),
        "diameter": records.number(low=1.0 / checks.MAGNITUDE, high=checks.MAGNITUDE),
        "relative_error": records.optional(records.number(low=checks.FINEST_ERROR, high=1.0)),
        "contact_values_from_rdf": records.mapping(_ESTIMATE),
        "obstacles": records.listed(
            records.table({"name": records.text, "force": _ESTIMATE, "pressure": _ESTIMATE})
        ),
        "theory": records.listed(_THEORY),
        "worst_overlap": records.number(),
    },
    later={
        "without_trajectory": _TEXT,
        "units": records.mapping(_COUNT),
        "frames_with_overlaps": records.optional(_COUNT),
        "swaps": records.optional(records.table({"tried": _COUNT, "accepted": _COUNT})),
        "barostat": records.optional(
            records.table(
                {
                    "pressure": _POSITIVE,
                    "step": records.optional(_POSITIVE),
                    "tried": _COUNT,
                    "accepted": _COUNT,
                }
            )
        ),
        **dict.fromkeys(("U", "temperature", "volume"), records.optional(_ESTIMATE)),
    },
)
"""The check of ``summary.json``."""

_TIMING = records.table({"collisions_per_second": _POSITIVE, "seconds": _POSITIVE})


def read_summary(path: Path) -> dict[str, Any]:
    """Return the summary of a finished run."""
    found: dict[str, Any] = records.read_json(
        path, SUMMARY, "the summary of a run", "remove it, and `carom resume` makes it anew"
    )
    return found


def read_timing(path: Path) -> dict[str, float]:
    """Return the rate and the wall time of a finished run; empty if the file is missing."""
    if not path.is_file():
        return {}
    found: dict[str, float] = records.read_json(path, _TIMING, "the times of a run", "remove it")
    return found
