"""The next partner of a component, and the time: the minimum of the paper's line 4, over all candidates."""

from __future__ import annotations

import numpy as np

from carom.compiling.lanes import LANES, WIDTH, candidate_block, gather_rows, least, pack_fields
from carom.compiling.registry import Questions, fast
from carom.engine.pair_steps import step_of
from carom.models.interfaces.particles import NEVER
from carom.models.mathematics.contact import MOST_DIAMETERS, contact_time_known

NO_CANDIDATE = np.int64(0x7FEFFFFFFFFFFFFF)
"""Bits of the largest finite float: nobody found."""

PLANE = 2
"""Dimension in which the time that a search has computed is kept; in space it is sooner computed once more
(docs/decisions/08-tried-and-left.md).
"""

NO_REF = -1
"""No ref: nothing is left out of a search."""


@fast
def earliest(model, state, i, now, refs, start_index, count, block_half, avoided):
    """Return the ref of whom i meets first, without ``avoided``, or -1, and the time until then (line 4).

    Times have 47 bits: the candidate's number replaces the last five, and the smallest of these integers is
    the earliest. The loop over eight has no branch and stays in registers, so that it is vectorized. In the
    plane the time returned has all bits.
    """
    me = state.rows[i]
    first_lane = block_half * WIDTH
    block, keys, times = candidate_block(state.rows)
    dimension = len(model.boundary.edges)
    bits = model.boundary.index_bits()
    best = NO_CANDIDATE
    chosen, time = -1, NEVER
    for start in range(0, count, WIDTH):
        size = min(int(count) - start, WIDTH)
        full = (size + LANES - 1) & ~(LANES - 1)
        for k in range(LANES):
            keys[k] = NO_CANDIDATE
        # All of them first: a register that is read right after its parts were written one by one waits.
        for lane in range(0, full, LANES):
            ref_index = start_index + start + lane
            pack_fields(model.pair, model.lanes, refs, ref_index, bits, first_lane + lane)
        for lane in range(0, full, LANES):
            ref_index = start_index + start + lane
            gather_rows(state.rows, refs, ref_index, bits, block)
            for k in range(LANES):
                ref = refs[ref_index + k]
                number = k + lane
                rr, rv, vv = model.motion.candidate_relative_to(model.boundary, i, ref, me, block, k, now)
                lane_index = first_lane + number
                t = model.boundary.candidate_time(
                    model.pair, model.lanes, lane_index, i, ref, rr, rv, vv, now
                )
                times[number] = t
                eligible = block[2 * dimension + 1, k] >= now + t
                eligible &= ref != avoided
                eligible &= number < size  # what follows the last candidate is somebody's ref, but not i's
                t = t if eligible else NEVER
                key = (np.float64(t).view(np.int64) & ~(WIDTH - 1)) | number
                keys[k] = min(keys[k], key)
        first = least(keys)
        if first < best:
            best = first
            time = times[first & (WIDTH - 1)]
            chosen = refs[start_index + start + (first & (WIDTH - 1))]
    return chosen, time if dimension == PLANE else (best & ~(WIDTH - 1)).view(np.float64)


def relative(model, state, i, ref, now):
    """Return r.r, r.v and v.v of the candidate relative to i at the time now."""
    other = state.rows[model.boundary.index(ref)]
    return model.motion.relative_to(model.boundary, i, ref, state.rows[i], other, now)


def start_before(square, vv, event_time):
    """Return a moment before a contact at ``event_time``, by 1/4 to 1 of the flight over ``sqrt(square)``.

    It is a multiple of a power of two: the last bits of ``event_time``, which depend on when the pair was
    looked at, do not change it.
    """
    # Half the root of the quotient, to its leading bit, and the inverse.
    exponent = (((np.float64(square / vv).view(np.int64) >> 52) - 1023) >> 1) - 1
    step = ((1023 + exponent) << 52).view(np.float64)
    inverse_step = ((1023 - exponent) << 52).view(np.float64)
    return (np.floor(event_time * inverse_step) - 1.0) * step


class Timing(Questions):
    """How the time of a contact is computed."""

    def contact_time(self, model, state, i, ref, now, t):
        """Return when i touches the candidate found after a time t, and whether a negative wait was clamped.

        By default it is computed from the moment at which it is found.
        """
        rr, rv, vv = relative(model, state, i, ref, now)
        t, clamped = model.boundary.refined_time(model.pair, i, ref, rr, rv, vv, now)
        return now + t, clamped

    def found_time(self, model, state, i, ref, now, t):
        """Return the same; t is what the search has computed, and may be what is asked for."""
        return self.contact_time(model, state, i, ref, now, t)


class FromNow(Timing):
    """Contacts that are computed from the moment at which they are found."""


class FromRows(Timing):
    """Contacts that are computed from the younger of two rows, or if far away from shortly before them.

    Times do not depend on when the pair is looked at: scheduling leaves no trace in a run.
    """

    square: float
    """Square of how far two may fly relative to each other from the moment from which their contact is
    computed [length^2].
    """
    as_found: bool  # whether searches compute the time until a contact as this does, to the last bit

    def found_time(self, model, state, i, ref, now, t):
        if len(model.boundary.edges) == PLANE:
            then = max(np.float64(state.rows[i].t), np.float64(state.rows[model.boundary.index(ref)].t))
            _, _, vv = relative(model, state, i, ref, now)
            # What is clamped is counted, and what is far away is computed from nearby.
            if self.as_found and then == now and t > 0.0 and t * t * vv < 0.99 * self.square:
                return now + t, False
        return self.contact_time(model, state, i, ref, now, t)

    def contact_time(self, model, state, i, ref, now, t):
        rows = state.rows
        event_time = now + t
        then = max(np.float64(rows[i].t), np.float64(rows[model.boundary.index(ref)].t))
        rr, rv, vv = relative(model, state, i, ref, then)
        if (event_time - then) * (event_time - then) * vv > self.square:
            then = start_before(self.square, vv, event_time)
            rr, rv, vv = relative(model, state, i, ref, then)
        t, clamped = model.boundary.refined_time(model.pair, i, ref, rr, rv, vv, then)
        return max(then + t, now), clamped


class FarSteps(Timing):
    """Pairs on steps with small hard cores, found from far away and then computed again from nearby.

    From nearby only the time is computed, not whether it occurs: a graze that looks like a miss there would
    become a far later exit from the step. Other crossings are not computed again: a late one makes no
    overlap.
    """

    nearness: float = 1.0 / MOST_DIAMETERS**2
    """Distance of the core over distance, squared, below which one is far away."""

    def contact_time(self, model, state, i, ref, now, t):
        event_time, clamped = Timing.contact_time(self, model, state, i, ref, now, t)
        rr, rv, vv = relative(model, state, i, ref, now)
        core = model.pair.step_core_square(step_of(model.boundary, ref))
        falls = (core > 0.0) & (rv < 0.0) & (rv * rv - vv * (rr - core) >= 0.0)
        if falls & (core < self.nearness * rr):
            # Two diameters of flight before the contact.
            then = max(event_time - 2.0 * np.sqrt(core / vv), now)
            rr, rv, vv = relative(model, state, i, ref, then)
            t, clamped = contact_time_known(rr - core, rv, vv)
            event_time = then + t
        return event_time, clamped


class FromCache(Timing):
    """Contacts that are found along paths of several boxes."""

    start_times: np.ndarray
    """A time shortly before the contact found last for each component, (n,): everybody's own array."""

    def contact_time(self, model, state, i, ref, now, t):
        return Timing.contact_time(self, model, state, i, ref, self.start_times[i], t)
