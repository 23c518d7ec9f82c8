"""How many species a scene has."""

from __future__ import annotations

from typing import Any


def species_count(scene: Any) -> int:
    """Return the number of species of a scene, K: 1 where none are given."""
    if scene.species is None:
        return 1
    contacts = 0 if scene.contact is None else len(scene.contact)
    return max(int(scene.species.max()) + 1, len(scene.species_names), contacts)
