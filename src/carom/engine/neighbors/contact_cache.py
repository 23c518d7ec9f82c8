"""Future contacts of every component, kept until some time so that searches are seldom.

A contact is valid while both fly as they did when it was found: a component that changes its flight gets a
new *version*.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.engine.state import aligned
from carom.models.interfaces.particles import NEVER

CAPACITY = 16
"""Contacts kept for each component. Of more the earliest are kept."""

STALE = -1
"""In the place of how many contacts are kept, for one whose flight has changed since it has looked at all."""


class Contacts(NamedTuple):
    """Contacts of all components."""

    found: np.ndarray
    """Of each component CAPACITY records, (n CAPACITY,): the other, its version then, a time shortly before
    the contact, and the time of the contact, rounded as rows round it.
    """
    counts: np.ndarray  # how many of them are filled, or STALE, (n,) int64
    versions: np.ndarray  # how often the flight of each has changed, (n,) int64
    first_dropped: np.ndarray  # time of the earliest contact that found no room, or NEVER, (n,)


def make_contacts(n: int, number: type) -> Contacts:
    """Return room for the contacts of ``n`` components, whose rows hold numbers of a type."""
    kind = np.dtype(
        [("other", "i8"), ("version", "i8"), ("start_time", "f8"), ("event_time", number)], align=True
    )
    return Contacts(
        found=aligned(n * CAPACITY, kind).view(np.recarray),
        counts=np.zeros(n, np.int64),
        versions=np.zeros(n, np.int64),
        first_dropped=np.full(n, NEVER),
    )


def contact_of(contacts, i, k):
    """Return contact number k of component i, a record."""
    return contacts.found[i * CAPACITY + k]


def clear(contacts, i):
    """Forget the contacts of component i."""
    contacts.counts[i] = 0
    contacts.first_dropped[i] = NEVER


def stands(contacts, contact):
    """Return whether the partner of a contact still flies as it did when the contact was found."""
    return contacts.versions[contact.other] == contact.version


def keep(contacts, i, j, start_time, event_time):
    """Keep the contact of i with j, in the place of an earlier find of the same two if there is one."""
    count = contacts.counts[i]
    slot = count
    for k in range(count):
        contact = contact_of(contacts, i, k)
        if contact.other == j:
            slot = k
            break
        if not stands(contacts, contact):
            slot = k
    if slot == CAPACITY:
        slot = 0
        for k in range(1, CAPACITY):
            if contact_of(contacts, i, k).event_time > contact_of(contacts, i, slot).event_time:
                slot = k
        last_time = np.float64(contact_of(contacts, i, slot).event_time)
        contacts.first_dropped[i] = min(contacts.first_dropped[i], max(last_time, event_time))
        if event_time >= last_time:
            return
    elif slot == count:
        contacts.counts[i] = count + 1
    contact = contact_of(contacts, i, slot)
    contact.other = j
    contact.version = contacts.versions[j]
    contact.start_time = start_time
    contact.event_time = event_time


def best_of(contacts, state, i, before):
    """Return i's first contact with one of no earlier event, or -1, and whether none before it was lost.

    It may be lost for want of room. With ``before`` the event of the other must be later, not at the same
    time.
    """
    best = NEVER
    chosen = -1
    for k in range(contacts.counts[i]):
        contact = contact_of(contacts, i, k)
        event_time, other = (
            np.float64(contact.event_time),
            np.float64(state.rows[contact.other].event_time),
        )
        free = event_time < other or (event_time == other and not before)
        if event_time < best and free and stands(contacts, contact):
            best = event_time
            chosen = k
    return chosen, best <= contacts.first_dropped[i]
