"""What parts and the true state tell each other at both ends of a window: filled, loosened, handed over."""

from __future__ import annotations

import numpy as np

from carom.compiling.borrowed import borrowed
from carom.compiling.dispatch import entry
from carom.compiling.registry import inner
from carom.engine.collisions import into_next_epoch
from carom.engine.constants import LAMBDA
from carom.engine.events import renew
from carom.engine.images import index
from carom.engine.windows.shares import (
    ABSENT,
    EDGE,
    OWN,
    copy_component,
    fill_cell,
    forget_absent,
    home,
    members,
    members_in,
)
from carom.models.interface import NEVER


@inner
def remove(mine, i):
    """Let component i be absent from a copy: without an event."""
    mine.rows[i].due = NEVER
    mine.partner[i] = LAMBDA
    mine.leave[i] = NEVER
    mine.here[i] = ABSENT


@inner
def receive(mine, truth, i):
    """Set component i of a copy to the true state, as far as the copy holds those whom it knows."""
    copy_component(mine, truth, i)
    forget_absent(mine.neighbors, mine.here, i)
    word = np.int64(mine.partner[i])
    if word >= 0 and mine.here[np.uint64(word)] == ABSENT:
        mine.partner[i] = LAMBDA


def _load(digest):
    def load(mine, truth, flags):
        """Set the whole copy to the true state."""
        digest  # noqa: B018 (part of the cache's key)
        mine, truth = borrowed(mine), borrowed(truth)
        n = np.uint64(len(mine.partner))
        for i in range(n):
            flag = flags[home(truth.neighbors, i)]
            if flag == ABSENT:
                remove(mine, i)
            mine.here[i] = flag
        for i in range(n):
            if mine.here[i] != ABSENT:
                receive(mine, truth, i)
        for cell in range(np.uint64(len(flags))):
            count = np.uint64(0) if flags[cell] == ABSENT else members_in(truth.neighbors, cell)
            fill_cell(mine.neighbors, truth.neighbors, cell, count)

    return load


def _refresh(digest):
    def refresh(mine, truth, flags):
        """Set the rim of a copy to the true state, which its own cells are in already.

        The work is in proportion to the rim: whoever the copy has in other cells than its own goes first.
        """
        digest  # noqa: B018 (part of the cache's key)
        mine, truth = borrowed(mine), borrowed(truth)
        cells = np.uint64(len(flags))
        held, true = members(mine.neighbors), members(truth.neighbors)
        for cell in range(cells):
            if flags[cell] < OWN:
                for k in range(members_in(mine.neighbors, cell)):
                    remove(mine, np.uint64(held[cell, k]))
        for cell in range(cells):
            if flags[cell] < OWN and flags[cell] != ABSENT:
                for k in range(members_in(truth.neighbors, cell)):
                    mine.here[np.uint64(true[cell, k])] = flags[cell]
        for cell in range(cells):
            if flags[cell] >= OWN:
                continue
            count = np.uint64(0) if flags[cell] == ABSENT else members_in(truth.neighbors, cell)
            for k in range(count):
                receive(mine, truth, np.uint64(true[cell, k]))
            fill_cell(mine.neighbors, truth.neighbors, cell, count)

    return refresh


def _loosen(digest):
    def loosen(mine, boundary, flags, now):
        """Let whoever another part can touch look for its next event anew.

        What the copies know of whom they could not see through to the end may be wrong: with whom somebody
        beyond the border has an event, and when.
        """
        digest  # noqa: B018 (part of the cache's key)
        mine = borrowed(mine)
        held = members(mine.neighbors)
        for cell in range(np.uint64(len(flags))):
            if flags[cell] != EDGE:
                continue
            for k in range(members_in(mine.neighbors, cell)):
                i = np.uint64(held[cell, k])
                word = np.int64(mine.partner[i])
                if word >= 0:
                    j = np.uint64(index(boundary, word))
                    back = np.int64(mine.partner[j])
                    if back >= 0 and np.uint64(index(boundary, back)) == i:
                        mine.partner[j] = LAMBDA
                mine.partner[i] = LAMBDA
                mine.rows[i].due = now

    return loosen


def _store(digest):
    def store(mine, truth, boundary, flags):
        """Copy the contents of the part's own cells into the true state.

        Whose partner has gone over to another part looks for its next event at the time of the last.
        """
        digest  # noqa: B018 (part of the cache's key)
        mine, truth = borrowed(mine), borrowed(truth)
        for i in range(np.uint64(len(mine.partner))):
            if mine.here[i] != ABSENT and flags[home(mine.neighbors, i)] >= OWN:
                word = np.int64(mine.partner[i])
                if word >= 0 and flags[home(mine.neighbors, np.uint64(index(boundary, word)))] < OWN:
                    mine.partner[i] = LAMBDA
                copy_component(truth, mine, i)
        for cell in range(np.uint64(len(flags))):
            if flags[cell] >= OWN:
                fill_cell(truth.neighbors, mine.neighbors, cell, members_in(mine.neighbors, cell))

    return store


def _give_up(digest):
    def give_up(mine, boundary, stages, stage):
        """Let all in cells that do not matter after a stage of the window have no event and meet nobody.

        Who has an event with somebody elsewhere keeps it until the next stage.
        """
        digest  # noqa: B018 (part of the cache's key)
        mine = borrowed(mine)
        held = members(mine.neighbors)
        for cell in range(np.uint64(len(stages))):
            if stages[cell] > stage:
                continue
            for k in range(members_in(mine.neighbors, cell)):
                i = np.uint64(held[cell, k])
                word = np.int64(mine.partner[i])
                if word >= 0 and stages[home(mine.neighbors, np.uint64(index(boundary, word)))] > stage:
                    continue
                mine.rows[i].due = NEVER
                mine.leave[i] = NEVER
                mine.rows[i].x[0] = np.nan  # no search finds a place that is none

    return give_up


def _turn(digest):
    def turn(model, share, state, begin, end):
        """Carry the components from ``begin`` to ``end``, those that are here, into the next epoch."""
        digest  # noqa: B018 (part of the cache's key)
        model, share, state = borrowed(model), borrowed(share), borrowed(state)
        for i in range(np.uint64(begin), np.uint64(end)):
            if share.here[i] != ABSENT:
                into_next_epoch(model, state, share.neighbors, i, state.clock[0].length)

    return turn


def _renew_all(digest):
    def renew_all(model, share, state, begin, end):
        """Compute the contacts of the components from ``begin`` to ``end`` that are here, in a new epoch."""
        digest  # noqa: B018 (part of the cache's key)
        model, share, state = borrowed(model), borrowed(share), borrowed(state)
        for i in range(np.uint64(begin), np.uint64(end)):
            if share.here[i] != ABSENT:
                renew(model.sight, model, state, i)

    return renew_all


load = entry(_load)
refresh = entry(_refresh)
loosen = entry(_loosen)
store = entry(_store)
give_up = entry(_give_up)
turn = entry(_turn)
renew_all = entry(_renew_all)
