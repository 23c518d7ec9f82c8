"""The next epoch, for some of the components at a time."""

from __future__ import annotations

import numpy as np

from carom.compiling.borrowed import borrowed
from carom.compiling.dispatch import entry
from carom.engine.advance import into_next_epoch
from carom.engine.events import retime


@entry
def advance_epoch(model, state, neighbors, start_index, end):
    """Carry the components from ``start_index`` to ``end`` into the next epoch."""
    model, state, neighbors = borrowed(model), borrowed(state), borrowed(neighbors)
    for i in range(np.uint64(start_index), np.uint64(end)):
        into_next_epoch(model, state, neighbors, i, state.clock[0].length)


@entry
def retime_all(model, state, start_index, end):
    """Compute the contacts of the components from ``start_index`` to ``end`` in a new epoch."""
    model, state = borrowed(model), borrowed(state)
    for i in range(np.uint64(start_index), np.uint64(end)):
        retime(model.timing, model, state, i)
