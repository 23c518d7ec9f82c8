"""Periodic boxes: the image of a component that a *word* names.

In a wide box it is the index, and the nearest image. In a small one (the paper's unsectored case) it is
``index << bits | code``, with the ``code`` < 3^d of the neighboring sector that held the candidate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import answering, required


@required
def index(boundary, ref):
    """Return the component that a word names."""


@required
def index_bits(boundary):
    """Return how many low bits of a word are not the component's index."""


@required
def lasting(boundary):
    """Return whether a word stays valid when its component, or the one that uses it, changes sector."""


@required
def mirror(boundary, i, ref):
    """Return the word under which the component named by ``ref`` sees component ``i``."""


@required
def separation(boundary, i, ref, axis, dx):
    """Return the coordinate of the image ``ref`` relative to i, from the difference ``dx`` of coordinates."""


@required
def in_box(boundary, i, axis, x):
    """Return a coordinate of i in the box in which it flies, where rounding at a face may decide otherwise.

    Where a component may fly through all of a box before it is looked at again, it is the box of its sector.
    """


ASKED = index, index_bits, lasting, mirror, separation, in_box


@answering(*ASKED)
class NearestImage(NamedTuple):
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


@answering(*ASKED)
class SectorImage(NamedTuple):
    """A periodic box with fewer than four sectors along an edge: the image is the one seen in the sector."""

    edges: tuple  # edges of the box [length]
    inverse: tuple  # their inverses
    shape: tuple  # number of sectors along each edge
    cell: np.ndarray  # sector of each component, (n + 1, d) int32: the array of the sectors themselves
    wraps: np.ndarray  # boxes between a component's position and its sector, (n + 1, d) int32, theirs too
    digits: np.ndarray
    """Offset -1, 0 or 1 along each axis of each of the 3^d neighboring sectors, (3^d, d) int64."""
    bits: int  # bits of a word that hold the neighboring sector

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
