"""Prefetching: memory is requested while earlier events are processed.

In a large system nearly every row of the next event is missing in the caches, but the calendar names the next
components several buckets ahead. Their memory is found in steps, a bucket apart, so that none waits:

1. the data of the component;
2. what these name: with lists the partner and the rows of the candidates, or the cells if a list is renewed;
3. what these name: the rows of the partner's candidates, or the reference points in the cells. With sectors,
   the sectors in which both will be after their collision;
4. the members of those sectors.

A wrong guess costs one request. They go to the second-level cache, which serves more at a time and keeps the
lines until needed; the very next event is asked for into the first (:func:`prefetch_first`).
"""

from __future__ import annotations

from carom.compiling.instructions import prefetch
from carom.compiling.registry import cold

LARGE = 10_000
"""Components from which on it pays to ask for rows and lists: fewer fit into the second-level cache."""

HUGE = 120_000
"""Components from which on it pays to ask for what renewals of lists touch, and for what is given another
event: fewer fit into the last cache.
"""

FEW = 2  # members of a cell that are asked for in any case


def prefetch_own(state, i):
    """Ask for what every event of component i needs."""
    prefetch(state.rows, i)
    prefetch(state.partner, i)
    prefetch(state.crossing_time, i)


def prefetch_members(array, cells, cell, count, component):
    """Ask for the elements of an array that belong to the first members of a cell.

    ``component``, whose element is there already, fills the places where there are fewer: a loop over their
    number would be mispredicted at every cell.
    """
    for k in range(FEW):
        member = cells[cell, k]
        prefetch(array, member if k < count else component)
    for k in range(FEW, count):
        prefetch(array, cells[cell, k])


def leaves_first(state, i):
    """Tell whether the event of i is that it leaves its sector."""
    return state.crossing_time[i] < state.rows[i].event_time


@cold
def prefetch_next(calendar, state, neighbors, boundary, motion):
    """Ask for what the next buckets' events touch; where ``ahead`` is 0 for their own data alone.

    In huge systems it pays to find out which are stale, their event a later one: these ask for nothing more.
    """
    control, buckets = calendar.control[0], calendar.buckets
    last = neighbors.stages()
    ahead = control.ahead != 0
    small = len(state.partner) < HUGE
    for step in range(last):  # a number that the compiler knows
        bucket = control.cursor + last - step
        # The last one takes what is due beyond the window.
        if bucket < len(buckets) - 1 and (ahead or step == 0):
            end = control.start + (bucket + 1) * control.width
            for k in range(buckets[bucket, 0]):
                i = buckets[bucket, k + 2]
                if step == 0 or small or min(state.rows[i].event_time, state.crossing_time[i]) <= end:
                    neighbors.prefetch_event(motion, boundary, state, i, step)
