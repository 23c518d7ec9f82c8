"""The collisions of several parts: noted by each, added up in the order of time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.borrowed import borrowed
from carom.compiling.dispatch import entry
from carom.compiling.registry import required
from carom.engine.constants import LAMBDA, OBSTACLE
from carom.engine.images import index
from carom.engine.obstacles import Obstacles
from carom.engine.state import aligned
from carom.engine.tallies import count_pair, log_full, record

ENTRY = np.dtype([("time", "f8"), ("virial", "f8"), ("impulse", "f8"), ("i", "i4"), ("word", "i4")])
"""A collision: its time within the epoch, its virial and the magnitude of the momentum exchanged, the
component of lower index, and the word of the other, or ``OBSTACLE - k``.
"""


class Page(NamedTuple):
    """The collisions of one part."""

    used: np.ndarray
    """How many there are, the first of a line of int64."""
    entries: Any
    """(room,) of type ENTRY."""


class Ledger(NamedTuple):
    """Room for the collisions of all parts, a row for each part."""

    used: np.ndarray
    """How many collisions each has, in the first column, (parts, 8) int64: a cache line for each."""
    entries: Any
    """(parts, room) of type ENTRY."""


def make_ledger(parts: int, room: int) -> Ledger:
    """Return an empty ledger with room for a given number of collisions of each part."""
    entries = aligned(parts * room, ENTRY).reshape(parts, room)
    return Ledger(aligned(8 * parts, np.int64).reshape(parts, 8), entries.view(np.recarray))


def page_of(ledger: Ledger, part: int) -> Page:
    """Return the page of a part."""
    return Page(ledger.used[part], ledger.entries[part])


class Gathered(NamedTuple):
    """The log of a part, and its tally of species: both note its collisions."""

    latest: np.ndarray
    """Virial of the collision at hand, (1,) float64."""
    page: Page
    """The part's page of the ledger."""


@count_pair.register
def _(by_species: Gathered, i, j, virial):
    by_species.latest[0] = virial


@log_full.register
def _(log: Gathered):
    return log.page.used[0] == len(log.page.entries)


@record.register
def _(log: Gathered, clock, i, word, impulse):
    page = log.page
    k = page.used[0]
    entry = page.entries[k]
    entry.time = clock.now
    entry.virial = log.latest[0]
    entry.impulse = impulse
    entry.i = i
    entry.word = word
    page.used[0] = k + 1


@required
def struck(obstacles, number, momentum):
    """Add a collision with an obstacle."""


@struck.register
def _(obstacles: None, number, momentum):
    return None


@struck.register
def _(obstacles: Obstacles, number, momentum):
    obstacles.hits[number] += 1
    obstacles.impulse[number] += momentum


def put_in_order(page: Page) -> None:
    """Sort the collisions of a part by time, where one came late."""
    entries = page.entries.view(np.ndarray)[: page.used[0]]
    entries[:] = entries[np.argsort(entries["time"], kind="stable")]


def _merge(digest):
    def merge(ledger, heads, clock, tallies, by_species, obstacles, boundary, log):
        """Add up the collisions of all parts in the order of time, as one cycle would have.

        Parameters
        ----------
        heads : (parts,) int64 array
            Number of collisions of each part that have been added already.

        Returns
        -------
        done : bool
            False if the log is full. The next call then continues from there.
        """
        digest  # noqa: B018 (part of the cache's key)
        ledger, obstacles = borrowed(ledger), borrowed(obstacles)
        by_species, log = borrowed(by_species), borrowed(log)
        tally = tallies[0]
        entries = ledger.entries
        parts = len(heads)
        while True:
            part = np.int64(-1)
            for k in range(parts):
                h = heads[k]
                if h == ledger.used[k, 0]:
                    continue
                if part < 0 or entries[k, h].time < entries[part, heads[part]].time:
                    part = np.int64(k)
                elif entries[k, h].time == entries[part, heads[part]].time:
                    part = np.int64(k) if entries[k, h].i < entries[part, heads[part]].i else part
            if part < 0:
                return True
            if log_full(log):
                return False
            h = heads[part]
            heads[part] = h + 1
            entry = entries[part, h]
            i, word = np.int64(entry.i), np.int64(entry.word)
            clock[0].now = entry.time
            if word < LAMBDA:
                struck(obstacles, OBSTACLE - word, entry.impulse)
            else:
                tally.collisions += 1
                tally.virial += entry.virial
                count_pair(by_species, i, np.int64(index(boundary, word)), entry.virial)
            record(log, clock[0], i, word, entry.impulse)

    return merge


merge = entry(_merge)
