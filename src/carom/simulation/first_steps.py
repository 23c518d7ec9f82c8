"""On which step each pair of a scene starts: the only time that distances say so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.scene.overlaps import Room

if TYPE_CHECKING:
    from carom.scene.scene import Scene


def first_steps(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs (m, 2) within reach, and the step of each (m,).

    Raises
    ------
    OverlapError, InputError
        If a pair is where its energy is infinite.
    """
    interaction = scene.interaction
    reach = float(interaction.reach(scene))
    room = Room(np.asarray(scene.box), np.asarray(scene.periodic))
    pairs = room.near(room.wrapped(scene.positions), reach * (1.0 + 2.0**-30)) if scene.n > 1 else []
    pairs = np.sort(np.asarray(pairs, np.int64).reshape(-1, 2), axis=1)
    distances = room.distances(scene.positions, pairs)
    kept = distances < reach * (1.0 + 2.0**-30)
    pairs, distances = pairs[kept], distances[kept]
    steps = interaction.steps_of(pairs, distances, scene.species, scene.diameter)  # type: ignore[attr-defined]
    return pairs, steps
