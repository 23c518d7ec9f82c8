"""Copies of one system. Each holds a part and a rim around it; it is filled, compared, and copied back.

All copies number components and cells alike. A component that a copy does not hold is
absent for its cycle: it is in no cell and no list, and has no event.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.registry import inner, required
from carom.engine.neighbors.bounds import level, start
from carom.engine.neighbors.grid import cell_of
from carom.engine.neighbors.lists import Lists
from carom.engine.neighbors.sectors import Sectors, sector_of

ABSENT, RIM, ZONE, OWN, EDGE = 0, 1, 2, 3, 4
"""What a cell is to a part: not there; in the rim, where the copy may go wrong; in the zone, which the part
can touch; its own; its own, and in the zone of another part.
"""


class Share(NamedTuple):
    """The arrays of a copy that a part fills, compares and copies back."""

    rows: Any
    """Those of the state."""
    bits: np.ndarray
    """The same rows, (n + 1, words) uint64."""
    partner: np.ndarray
    leave: np.ndarray
    images: np.ndarray | None
    neighbors: Any
    here: np.ndarray
    """Which components the copy holds: ``ABSENT`` for the others, (n,) uint8."""


@required
def home(neighbors, i):
    """Return the cell that component i is in."""


@home.register
def _(neighbors: Sectors, i):
    return sector_of(neighbors, i)


@home.register
def _(neighbors: Lists, i):
    return cell_of(neighbors, level(neighbors.bounds, i), neighbors.reference[i])


@required
def copy_home(target, source, i):
    """Copy what the neighbour scheme knows of component i."""


@copy_home.register
def _(target: Sectors, source, i):
    for axis in range(len(target.sides)):
        target.place[i, axis] = source.place[i, axis]
        target.turn[i, axis] = source.turn[i, axis]
    target.face[i] = source.face[i]


@copy_home.register
def _(target: Lists, source, i):
    target.reference[i] = source.reference[i]
    target.counts[i] = source.counts[i]
    for k in range(start(target.bounds, i), start(target.bounds, i + np.uint64(1))):
        target.words[k] = source.words[k]


@required
def forget_absent(neighbors, here, i):
    """Remove from the list of component i, if it has one, the components that are absent here."""


@forget_absent.register
def _(neighbors: Sectors, here, i):
    return None


@forget_absent.register
def _(neighbors: Lists, here, i):
    first = start(neighbors.bounds, i)
    end = first + np.uint64(neighbors.counts[i])
    kept = first
    for k in range(first, end):
        word = neighbors.words[k]
        if here[word] != ABSENT:
            neighbors.words[kept] = word
            kept += np.uint64(1)
    for k in range(kept, end):
        neighbors.words[k] = len(neighbors.counts)
    neighbors.counts[i] = kept - first


@required
def members_in(neighbors, cell):
    """Return how many are in a cell."""


@members_in.register
def _(neighbors: Sectors, cell):
    return np.uint64(neighbors.members[cell, np.uint64(neighbors.members.shape[1] - 1)])


@members_in.register
def _(neighbors: Lists, cell):
    return np.uint64(neighbors.members[cell])


@required
def set_members_in(neighbors, cell, count):
    """Set how many are in a cell."""


@set_members_in.register
def _(neighbors: Sectors, cell, count):
    neighbors.members[cell, np.uint64(neighbors.members.shape[1] - 1)] = count


@set_members_in.register
def _(neighbors: Lists, cell, count):
    neighbors.members[cell] = count


@required
def members(neighbors):
    """Return the components in each cell, a row for each cell."""


@members.register
def _(neighbors: Sectors):
    return neighbors.members


@members.register
def _(neighbors: Lists):
    return neighbors.cells


@inner
def fill_cell(target, source, cell, count):
    """Put the first ``count`` members of a cell of another copy into the same cell here."""
    mine, theirs = members(target), members(source)
    for k in range(count):
        mine[cell, k] = theirs[cell, k]
    set_members_in(target, cell, count)


@required
def copy_images(target, source, i):
    """Copy the boxes that component i has crossed."""


@copy_images.register
def _(target: None, source, i):
    return None


@copy_images.register
def _(target: np.ndarray, source, i):
    for axis in range(target.shape[1]):
        target[i, axis] = source[i, axis]


@inner
def copy_component(target, source, i):
    """Copy the whole state of component i."""
    for k in range(np.uint64(target.bits.shape[1])):
        target.bits[i, k] = source.bits[i, k]
    target.partner[i] = source.partner[i]
    target.leave[i] = source.leave[i]
    copy_images(target.images, source.images, i)
    copy_home(target.neighbors, source.neighbors, i)
