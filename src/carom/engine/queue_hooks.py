"""What a calendar does that is one of several, each for a part of the box: questions to its type.

A calendar that is alone answers none of them: the cycle has no branch and no byte for them.
``engine/domains`` has the answers of a part's calendar.
"""

from __future__ import annotations

from carom.compiling.registry import optional


@optional
def is_remote(calendar, i):
    """Return whether component i belongs to another calendar; by default there is none."""
    return False


@optional
def count_local(calendar, start_index, end):
    """Return how many of a range belong to this calendar (all by default); its heap is empty and free."""
    return end - start_index


@optional
def local_component(calendar, start_index, k):
    """Return the k-th of those."""
    return start_index + k


@optional
def send_if_remote(calendar, i, time):
    """Send i, due at ``time``, to the calendar that it belongs to; return whether that is another one."""
    return False


@optional
def note_border_event(calendar, bucket, time, i):
    """Take notice of an entry; by default nobody does."""
    return


@optional
def clear_notes(calendar):
    """Forget all such notices: everything is entered anew."""
    return


@optional
def receive(calendar, state):
    """Begin a cycle: enter what other calendars have sent."""
    return


@optional
def publish_time(calendar, state, time):
    """Tell the others that nothing is due here before ``time``, as a null message does: its safe time."""
    return


@optional
def safe_to_process(calendar, state, boundary, i, now):
    """Return whether the first event here, of component i, may be processed for all that others hold."""
    return True


@optional
def should_return(calendar):
    """Return whether the cycle is to end because this was refused too often."""
    return False
