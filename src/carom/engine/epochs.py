"""The end of an epoch: all times become less by its length, and whoever remembers times is told."""

from __future__ import annotations

from carom.compiling.entry import entry
from carom.compiling.registry import cold
from carom.engine.advance import advance
from carom.engine.events import retime
from carom.engine.obstacles import age_obstacles
from carom.engine.tilted_lattice import remap


def into_next_epoch(model, state, neighbors, i, length):
    """Advance component i to the beginning of the next epoch, and reduce its times by the epoch's length."""
    advance(model, state, neighbors, i, length)
    state.rows[i].t = 0.0
    state.rows[i].event_time -= length
    state.crossing_time[i] -= length


@cold
def new_epoch(model, state, neighbors):
    """Begin the next epoch, times less by its length; tell whether all must be scheduled again."""
    clock = state.clock[0]
    length = clock.length
    for i in range(len(state.partner)):
        into_next_epoch(model, state, neighbors, i, length)
    model.pair.shift_epoch(length)
    if model.impact is not None:
        model.impact.shift_epoch(length)
    age_obstacles(model.obstacles, length)
    model.observers.at_epoch(model, state, length)
    clock.epoch += 1
    clock.now = 0.0
    if remap(model.motion, state, model.boundary.edges, length):
        return True
    if neighbors.must_renew(model.motion, length):
        return True
    for i in range(len(state.partner)):
        retime(model, state, i)
    return False


@entry
def advance_epoch(model, state, neighbors, start_index, end):
    """Carry the components from ``start_index`` to ``end`` into the next epoch."""
    for i in range(start_index, end):
        into_next_epoch(model, state, neighbors, i, state.clock[0].length)


@entry
def retime_all(model, state, start_index, end):
    """Compute the contacts of the components from ``start_index`` to ``end`` in a new epoch."""
    for i in range(start_index, end):
        retime(model, state, i)
