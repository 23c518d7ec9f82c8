"""What a calendar does that is one of several, each for a part of the box: questions to its type.

A calendar that is alone answers none of them: the cycle has no branch and no byte for them.
``engine/windows`` has the answers of a part's calendar.
"""

from __future__ import annotations

from carom.compiling.registry import optional


@optional
def absent(calendar, i):
    """Return whether component i belongs to another calendar; by default there is none."""
    return False


@optional
def own_in(calendar, begin, end):
    """Return how many of the components from ``begin`` to ``end`` belong to this calendar, whose heap is
    empty and may be used; by default all do.
    """
    return end - begin


@optional
def own(calendar, begin, k):
    """Return the k-th of those."""
    return begin + k


@optional
def sent(calendar, i, time):
    """Send component i, which is due at ``time``, to the calendar that it belongs to; return whether that is
    another one.
    """
    return False


@optional
def mark(calendar, bucket, time, i):
    """Take notice of an entry; by default nobody does."""
    return


@optional
def marks_forgotten(calendar):
    """Forget all such notices: everything is entered anew."""
    return


@optional
def collect(calendar, state):
    """Begin a cycle: enter what other calendars have sent."""
    return


@optional
def announce(calendar, state, time):
    """Tell the others that nothing is due here before ``time``."""
    return


@optional
def granted(calendar, state, boundary, i, now):
    """Return whether the first event here, of component i, may be processed for all that others hold."""
    return True


@optional
def weary(calendar):
    """Return whether the cycle is to end because this was refused too often."""
    return False
