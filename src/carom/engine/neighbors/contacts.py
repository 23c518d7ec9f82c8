"""Future contacts of every component, for as long as neither partner changes its flight.

A search finds all contacts until some time and keeps them, so that the next search is seldom needed. A
contact is valid as long as both partners fly as they did when it was found. A component that changes its
flight gets a new *version*, which identifies contacts with its former flight.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner
from carom.engine.state import aligned
from carom.models.interface import NEVER

ROOM = 16
"""Contacts kept for each component. Of more the earliest are kept."""

CHANGED = -1
"""In the place of how many contacts are kept, for one whose flight has changed since it has looked at all."""


class Contacts(NamedTuple):
    """Contacts of all components."""

    found: np.ndarray
    """Of each component ROOM records: the other, its version then, a time shortly before the contact, and the
    time of the contact, rounded as rows round it; (n ROOM,).
    """
    counts: np.ndarray
    """How many of them are filled, or CHANGED, (n,) int64."""
    versions: np.ndarray
    """How often the flight of each has changed, (n,) int64."""
    lost: np.ndarray
    """Time of the earliest contact that found no room, or NEVER, (n,)."""


def make_contacts(n: int, number: type) -> Contacts:
    """Return room for the contacts of ``n`` components, whose rows hold numbers of a type."""
    kind = np.dtype([("other", "i8"), ("version", "i8"), ("begin", "f8"), ("due", number)], align=True)
    return Contacts(
        found=aligned(n * ROOM, kind).view(np.recarray),
        counts=np.zeros(n, np.int64),
        versions=np.zeros(n, np.int64),
        lost=np.full(n, NEVER),
    )


@inner
def contact_of(contacts, i, k):
    """Return contact number k of component i, a record."""
    return contacts.found[np.uint64(i) * np.uint64(ROOM) + np.uint64(k)]


@inner
def clear(contacts, i):
    """Forget the contacts of component i."""
    contacts.counts[i] = 0
    contacts.lost[i] = NEVER


@inner
def stands(contacts, contact):
    """Return whether the partner of a contact still flies as it did when the contact was found."""
    return contacts.versions[np.uint64(contact.other)] == contact.version


@inner
def keep(contacts, i, j, begin, due):
    """Keep the contact of i with j, in the place of an earlier find of the same two if there is one."""
    count = contacts.counts[i]
    place = count
    for k in range(count):
        contact = contact_of(contacts, i, k)
        if np.int64(contact.other) == np.int64(j):
            place = k
            break
        if not stands(contacts, contact):
            place = k
    if place == ROOM:
        place = 0
        for k in range(1, ROOM):
            if contact_of(contacts, i, k).due > contact_of(contacts, i, place).due:
                place = k
        latest = np.float64(contact_of(contacts, i, place).due)
        contacts.lost[i] = min(contacts.lost[i], max(latest, due))
        if due >= latest:
            return
    elif place == count:
        contacts.counts[i] = count + 1
    contact = contact_of(contacts, i, place)
    contact.other = np.int64(j)
    contact.version = contacts.versions[j]
    contact.begin = begin
    contact.due = due


@inner
def best_of(contacts, state, i, before):
    """Return the number of the first contact of i with somebody who has no earlier event, or -1, and whether
    none that comes first has been lost for want of room.

    With ``before`` the event of the other must be later, not at the same time.
    """
    best = NEVER
    chosen = np.int64(-1)
    for k in range(contacts.counts[i]):
        contact = contact_of(contacts, i, k)
        due, other = np.float64(contact.due), np.float64(state.rows[np.uint64(contact.other)].due)
        free = due < other or (due == other and not before)
        if due < best and free and stands(contacts, contact):
            best = due
            chosen = np.int64(k)
    return chosen, best <= contacts.lost[i]
