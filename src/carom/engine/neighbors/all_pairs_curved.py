"""Pairs: every component with every other, one by one, along curves.

For a motion by which two components do not fly straight relative to each other. Its model says when a pair
meets (``meeting_time``), for as many pairs as there are: meant for some hundred components. A search covers a
certain time, after which the component searches again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner
from carom.engine.neighbors.interface import (
    build,
    cross,
    earliest_newcomer,
    earliest_partner,
    transit_time,
)
from carom.engine.search import contact_time_of
from carom.models.questions.interaction import core_square, growth
from carom.models.questions.motion import meeting_time
from carom.models.questions.particles import NEVER


class Pairs(NamedTuple):
    """Nothing but the time that a search covers, and the names of all."""

    span: float
    """Time that a search covers."""
    names: np.ndarray
    """0 to n - 1, uint32."""


class AlongCurves(NamedTuple):
    """Contacts of components that do not fly straight relative to each other."""

    span: float
    """Time that a search covers."""


def make_pairs(n: int, span: float) -> Pairs:
    """Return the scheme for ``n`` components; ``span`` is the time that a search covers."""
    return Pairs(float(span), np.arange(n, dtype=np.uint32))


@inner
def curved_meeting(model, state, i, j, now, limit, span):
    """Return the time from now until i and j touch, or NEVER if that is later than ``limit``, and whether
    they do so already.
    """
    contact = np.sqrt(core_square(model.pair, np.int64(i), np.int64(j), now))
    rate = growth(model.pair, np.int64(i)) + growth(model.pair, np.int64(j))
    rows = state.rows
    me, other = rows[np.uint64(i)], rows[np.uint64(j)]
    return meeting_time(model.motion, me, other, now, contact, rate, limit, span)


@inner
def first_of_pairs(neighbors, model, state, i, now, limit, avoided):
    """Return whom i meets first, until ``limit`` or the end of the time that a search covers, or -1; the one
    whom it has just met is ``avoided``, but only now.
    """
    best = min(now + neighbors.span, limit)
    chosen = np.int64(-1)
    for j in range(np.int64(len(neighbors.names))):
        if j == np.int64(i):
            continue
        end = min(best, np.float64(state.rows[np.uint64(j)].event_time))
        # In the order of their numbers, so that a meeting has the same bits for both.
        low_index, high_index = min(np.int64(i), j), max(np.int64(i), j)
        t, _ = curved_meeting(model, state, low_index, high_index, now, end - now, neighbors.span)
        event_time = now + t
        if event_time < best and event_time <= end and not (j == np.int64(avoided) and event_time <= now):
            best = event_time
            chosen = np.int64(j)
    return chosen


@contact_time_of.register
def _(timing: AlongCurves, model, state, i, ref, now, t):
    low_index, high_index = min(np.int64(i), np.int64(ref)), max(np.int64(i), np.int64(ref))
    t, clamped = curved_meeting(model, state, low_index, high_index, now, NEVER, timing.span)
    return now + t, clamped


@earliest_partner.register
def _(neighbors: Pairs, model, state, i, now, half, avoided):
    return first_of_pairs(neighbors, model, state, i, now, NEVER, avoided), 0.0


@earliest_newcomer.register
def _(neighbors: Pairs, model, state, i, now, refs, start_index, count):
    return first_of_pairs(
        neighbors, model, state, i, now, np.float64(state.rows[i].event_time), np.int64(-1)
    ), 0.0


@transit_time.register
def _(neighbors: Pairs, motion, boundary, state, i, now):
    return now + neighbors.span


@cross.register
def _(neighbors: Pairs, motion, boundary, state, i, now):
    return True, neighbors.names, np.uint64(0), np.int64(0)


@build.register
def _(neighbors: Pairs, motion, boundary, state):
    return True
