"""The step on which each pair of a scene starts; later, events change it, and distances are not used."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.scene.fields import Fields, geometry_at_start


def first_steps(scene: Fields) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs (m, 2) within reach, and the step of each (m,)."""
    interaction = scene.interaction
    within = float(interaction.reach(scene)) * (1.0 + 2.0**-30)
    room = geometry_at_start(scene)
    found: Any = room.near(room.wrapped(scene.positions), within) if scene.n > 1 else []
    pairs = np.sort(np.asarray(found, np.int64).reshape(-1, 2), axis=1)
    pairs = pairs[room.distances(scene.positions, pairs) < within]
    if hasattr(interaction, "bonded"):  # refused where they are further apart
        pairs = np.unique(np.concatenate([pairs, interaction.bonded()[0]]), axis=0)
    distances = room.distances(scene.positions, pairs)
    steps = interaction.steps_of(pairs, distances, scene.species, scene.diameter)  # type: ignore[attr-defined]
    return pairs, steps
