"""Who can meet whom next: the interface of the neighbor schemes (``sectors``, ``lists``, ``all_pairs``)."""

from __future__ import annotations

from carom.compiling.registry import Questions
from carom.engine.search import NO_REF, earliest


class NeighborScheme(Questions):
    """Who can meet whom next."""

    def candidates(self, boundary, i, half):
        """Return refs (uint32) of whom i can meet before a one-component event, where they begin, how many.

        Eight more can be read behind the last, each a ref of somebody. ``half`` (0 or 1) is the room to use
        where refs have to be put together.
        """
        raise NotImplementedError

    def earliest_partner(self, model, state, i, now, half, avoided):
        """Return the ref of whom i meets first but the one ``avoided``, or -1, and about when."""
        refs, start_index, count = self.candidates(model.boundary, i, half)
        return earliest(model, state, i, now, refs, start_index, count, half, avoided)

    def earliest_newcomer(self, model, state, i, now, refs, start_index, count):
        """Return the same of the newcomers of a transit."""
        return earliest(model, state, i, now, refs, start_index, count, 0, NO_REF)

    def transit_time(self, motion, boundary, state, i, now):
        """Return the time at which component i leaves its sector, or soon leaves the sphere of its list."""
        raise NotImplementedError

    def rebin(self, motion, boundary, state, i, now):
        """Put i, whose velocity is new, where it will stay longest; by default it stays where it is."""

    def cross(self, motion, boundary, state, i, now):
        """Carry i into its next sector (or renew its list); return whether that was done, and its newcomers.

        They are as :meth:`candidates`. If it was not done an array is too small: build all anew.
        """
        raise NotImplementedError

    def begin_epoch(self, model, state, tally):
        """Choose the events of an epoch that begins, of all; by default everybody keeps the one it has."""

    def must_renew(self, motion, length):
        """Tell whether all must be built anew for an epoch of this length; by default not."""
        return False

    def on_wrap(self, i, axis, crossings):
        """Note that a coordinate of i was reduced by ``crossings`` boxes; by default that does not matter."""

    def build(self, motion, boundary, state):
        """Build the scheme from the positions at the present time; False if an array is too small for it."""
        raise NotImplementedError

    def prefetch_event(self, motion, boundary, state, i, step):
        """Ask for what the event of component i will touch, as far as the answers to the step before say.

        The steps are one function because they have code in common that the compiler then makes once.
        """

    def prefetch_first(self, boundary, state, i):
        """Ask for what the next event, of component i, touches first; with sectors for nothing."""

    def stages(self):
        """Return the steps in which memory is requested: the buckets to look ahead, by default none."""
        return 0

    def put_step(self, i, j, step):
        """Write into the list of i that it and j are on another step."""
        raise NotImplementedError

    def recount_listed(self, rules, boundary, i, was):
        """Count unit i, which was of the kind ``was``, and all listed with it anew."""
        raise NotImplementedError

    def layer_of(self, i, axis):
        """Return the layer that component i is in along an axis."""
        raise NotImplementedError

    def prefetch_layer(self, i):
        """Ask for what ``layer_of`` of component i looks at."""
        raise NotImplementedError
