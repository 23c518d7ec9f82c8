"""The next epoch, for some of the components at a time."""

from __future__ import annotations

import numpy as np

from carom.compiling.borrowed import borrowed
from carom.compiling.dispatch import entry
from carom.engine.collisions import into_next_epoch
from carom.engine.events import renew


def _turn(digest):
    def turn(model, state, neighbors, begin, end):
        """Carry the components from ``begin`` to ``end`` into the next epoch."""
        digest  # noqa: B018 (part of the cache's key)
        model, state, neighbors = borrowed(model), borrowed(state), borrowed(neighbors)
        for i in range(np.uint64(begin), np.uint64(end)):
            into_next_epoch(model, state, neighbors, i, state.clock[0].length)

    return turn


def _renew_all(digest):
    def renew_all(model, state, begin, end):
        """Compute the contacts of the components from ``begin`` to ``end`` in a new epoch."""
        digest  # noqa: B018 (part of the cache's key)
        model, state = borrowed(model), borrowed(state)
        for i in range(np.uint64(begin), np.uint64(end)):
            renew(model.sight, model, state, i)

    return renew_all


turn = entry(_turn)
renew_all = entry(_renew_all)
