"""The kinds of folders of results: the one registry of what each is and does."""

from __future__ import annotations

from pathlib import Path

from carom.studies.kind import Kind
from carom.studies.kind_of_studies import OfStudy
from carom.studies.packings.kind import OfPacking
from carom.studies.places import kind_of
from carom.studies.planner.kind import OfPlan
from carom.studies.runs.kind import OfRun

KINDS: dict[str, Kind] = {kind.name: kind for kind in (OfRun(), OfPacking(), OfPlan(), OfStudy())}
"""By their names, which are those in :data:`carom.studies.places.OWN`."""

RESULTS = {name for kind in KINDS.values() for name in kind.results}
"""Files of results, which stand for their folder."""


def kind_at(folder: Path) -> Kind | None:
    """Return the kind of a folder; None if nothing of Carom is there.

    A run that has only a summary or a scene file is one, too.
    """
    name = kind_of(folder)
    if name is None and any((folder / file).is_file() for file in ("summary.json", "scene.toml")):
        name = OfRun.name
    return None if name is None else KINDS[name]
