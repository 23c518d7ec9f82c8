"""Who can meet whom next: the interface of the neighbor schemes (``sectors``, ``lists``, ``all_pairs``)."""

from __future__ import annotations

from carom.compiling.registry import cold, optional, required


@required
def candidates(neighbors, boundary, i, half):
    """Return words (uint32) of whom i can meet before a one-component event, where they begin, how many.

    Eight more can be read behind the last, each a word of somebody. ``half`` (0 or 1) is the room to use
    where words have to be put together.
    """


@required
def earliest_partner(neighbors, model, state, i, now, half, avoided):
    """Return the word of whom i meets first but the one ``avoided``, or -1, and about the time until then."""


@required
def earliest_newcomer(neighbors, model, state, i, now, refs, start_index, count):
    """Return the same of the newcomers of a transit."""


@required
def transit_time(neighbors, motion, boundary, state, i, now):
    """Return the time at which component i leaves its sector, or soon leaves the sphere of its list."""


@optional
def rebin(neighbors, motion, boundary, state, i, now):
    """Put i, whose velocity is new, where it will stay longest; by default it stays where it is."""
    return


@required
def cross(neighbors, motion, boundary, state, i, now):
    """Carry i into its next sector (or renew its list); return whether that was done, and whom i meets now.

    The latter are new ones, as :func:`candidates`. If it was not done an array is too small: build all anew.
    """


@optional
def begin_epoch(neighbors, model, state, tally):
    """Choose the events of an epoch that begins, of all; by default everybody keeps the one it has."""
    return


@optional
def must_renew(neighbors, motion, length):
    """Tell whether all must be built anew for an epoch of this length; by default not."""
    return False


@optional
def on_wrap(neighbors, i, axis, crossings):
    """Note that the coordinate of i was reduced by ``crossings`` boxes; by default that does not matter."""
    return


@cold
@required
def build(neighbors, motion, boundary, state):
    """Build the scheme from the positions at the present time; False if an array is too small for it."""
