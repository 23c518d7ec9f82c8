"""Periodic boxes: the image of a component that a reference names, a *ref*.

In a wide box it is the index, and the nearest image. In a small one (the paper's unsectored case) it is
``index << bits | code``, with the ``code`` < 3^d of the neighboring sector that held the candidate.
"""

from __future__ import annotations

import numpy as np

from carom.compiling.lanes import asked_of
from carom.compiling.registry import Questions
from carom.models.interfaces.steps import CORE


class Boundary(Questions):
    """What a boundary answers: who is named by a ref, and where the image is."""

    def index(self, ref):  # type: ignore[override]  # of a tuple
        """Return the component that a ref names."""
        raise NotImplementedError

    def index_bits(self):
        """Return how many low bits of a ref are not the component's index."""
        raise NotImplementedError

    def lasting(self):
        """Return whether a ref stays valid when its component, or the one that uses it, changes sector."""
        raise NotImplementedError

    def mirror(self, i, ref):
        """Return the ref under which the component named by ``ref`` sees component ``i``."""
        raise NotImplementedError

    def separation(self, i, ref, axis, dx):
        """Return the coordinate of the image ``ref`` relative to i, from the difference ``dx``."""
        raise NotImplementedError

    def in_box(self, i, axis, x):
        """Return a coordinate of i in the box in which it flies, where rounding may decide otherwise.

        Where a component may fly through all of a box before it is looked at again, it is the box of its
        sector.
        """
        raise NotImplementedError

    def candidate_time(self, pair, lanes, lane_index, i, ref, rr, rv, vv, now):
        """Return the time until i meets the candidate that a ref names, at a place of the lanes."""
        return asked_of("interaction_time", pair, lanes, lane_index, i, self.index(ref), (rr, rv, vv, now))

    def refined_time(self, pair, i, ref, rr, rv, vv, now):
        """Return the time until i meets the candidate found, and whether a negative one was clamped."""
        return pair.contact_time(i, self.index(ref), rr, rv, vv, now)

    def outcome(self, pair, neighbors, tally, i, ref, rr, rv, now):
        """Return what the event of i and a ref adds, as ``jump`` does, its kind, and both steps or zeros."""
        a, b, virial = pair.jump(i, self.index(ref), rr, rv, now)
        return a, b, virial, CORE, 0, 0

    def logged(self, ref, kind):
        """Return what the log holds of a ref: with steps, the kind of the event in place of one."""
        return ref


class NearestImage(Boundary):
    """The minimum image convention (MinimumImage): nobody meets two images of another before one moves on."""

    edges: tuple  # edges of the box [length]
    inverse: tuple  # their inverses

    def index(self, ref):  # type: ignore[override]  # of a tuple
        return int(ref)

    def index_bits(self):
        return 0

    def lasting(self):
        return True

    def mirror(self, i, ref):
        return i

    def separation(self, i, ref, axis, dx):
        return dx - self.edges[axis] * np.rint(dx * self.inverse[axis])

    def in_box(self, i, axis, x):
        return x - np.floor(x * self.inverse[axis]) * self.edges[axis]


class SectorImage(Boundary):
    """A periodic box with fewer than four sectors along an edge: the image is the one seen in the sector."""

    edges: tuple  # edges of the box [length]
    inverse: tuple  # their inverses
    shape: tuple  # number of sectors along each edge
    cell: np.ndarray  # sector of each component, (n + 1, d) int32: the array of the sectors themselves
    wraps: np.ndarray  # boxes between a component's position and its sector, (n + 1, d) int32, theirs too
    digits: np.ndarray
    """Offset -1, 0 or 1 along each axis of each of the 3^d neighboring sectors, (3^d, d) int64."""
    bits: int  # bits of a ref that hold the neighboring sector

    def index(self, ref):  # type: ignore[override]  # of a tuple
        return int(ref) >> self.bits

    def index_bits(self):
        return self.bits

    def lasting(self):
        return False

    def mirror(self, i, ref):
        code = ref & ((1 << self.bits) - 1)
        return (i << self.bits) | (len(self.digits) - 1 - code)

    def separation(self, i, ref, axis, dx):
        j = ref >> self.bits
        code = ref & ((1 << self.bits) - 1)
        sectors = self.cell[i, axis] + self.digits[code, axis] - self.cell[j, axis]
        turns = self.wraps[i, axis] - self.wraps[j, axis]
        return dx + self.edges[axis] * (np.rint(sectors / self.shape[axis]) + turns)

    def in_box(self, i, axis, x):
        return x - self.wraps[i, axis] * self.edges[axis] if self.inverse[axis] > 0.0 else x


def count_images(images, i, axis, crossings):
    """Add ``crossings`` of the box to the image count of component ``i``, where images are counted."""
    if images is not None:
        images[i, axis] += int(crossings)
