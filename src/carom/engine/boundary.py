"""Periodic boxes: the image of a component that a *word* names.

In a wide box it is the index, and the nearest image. In a small one (the paper's unsectored case) it is
``index << bits | code``, with the ``code`` < 3^d of the neighbouring sector that held the candidate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner, required


class NearestImage(NamedTuple):
    """A periodic box in which no component can meet two images of another before one changes sector."""

    edges: tuple  # edges of the box [length]
    inverse: tuple  # their inverses


class SectorImage(NamedTuple):
    """A periodic box with fewer than four sectors along an edge: the image is the one seen in the sector."""

    edges: tuple  # edges of the box [length]
    inverse: tuple  # their inverses
    shape: tuple  # number of sectors along each edge
    cell: np.ndarray  # sector of each component, (n + 1, d) int32: the array of the sectors themselves
    wraps: np.ndarray  # boxes between a component's position and its sector, (n + 1, d) int32, theirs too
    digits: np.ndarray
    """Offset -1, 0 or 1 along each axis of each of the 3^d neighbouring sectors, (3^d, d) int64."""
    bits: int  # bits of a word that hold the neighbouring sector


class SteppedImage(NamedTuple):
    """A :class:`NearestImage` whose words name steps of pairs (:mod:`carom.engine.pair_steps`)."""

    edges: tuple  # edges of the box [length]
    inverse: tuple  # their inverses
    bits: int  # low bits of a word that hold the step


@required
def index(boundary, ref):
    """Return the component that a word names."""


@index.register
def _(boundary: NearestImage, ref):
    return ref


@index.register
def _(boundary: SectorImage | SteppedImage, ref):
    return np.int64(ref) >> boundary.bits


@required
def index_bits(boundary):
    """Return how many low bits of a word are not the component's index."""


@index_bits.register
def _(boundary: NearestImage):
    return 0


@index_bits.register
def _(boundary: SectorImage | SteppedImage):
    return boundary.bits


@required
def lasting(boundary):
    """Return whether a word stays valid when its component, or the one that uses it, changes sector."""


@lasting.register
def _(boundary: NearestImage | SteppedImage):
    return True


@lasting.register
def _(boundary: SectorImage):
    return False


@required
def mirror(boundary, i, ref):
    """Return the word under which the component named by ``ref`` sees component ``i``."""


@mirror.register
def _(boundary: NearestImage, i, ref):
    return i


@mirror.register
def _(boundary: SectorImage, i, ref):
    code = ref & ((1 << boundary.bits) - 1)
    return (i << boundary.bits) | (len(boundary.digits) - 1 - code)


@mirror.register
def _(boundary: SteppedImage, i, ref):
    return (i << boundary.bits) | (np.int64(ref) & ((np.int64(1) << boundary.bits) - 1))


@required
def separation(boundary, i, ref, axis, dx):
    """Return the coordinate of the image ``ref`` relative to i, from the difference ``dx`` of coordinates."""


@separation.register
def _(boundary: NearestImage | SteppedImage, i, ref, axis, dx):
    return dx - boundary.edges[axis] * np.rint(dx * boundary.inverse[axis])


@separation.register
def _(boundary: SectorImage, i, ref, axis, dx):
    ref = np.int64(ref)
    j = np.uint64(ref >> boundary.bits)
    code = np.uint64(ref & ((1 << boundary.bits) - 1))
    sectors = boundary.cell[i, axis] + boundary.digits[code, axis] - boundary.cell[j, axis]
    turns = boundary.wraps[i, axis] - boundary.wraps[j, axis]
    return dx + boundary.edges[axis] * (np.rint(sectors / boundary.shape[axis]) + turns)


@required
def in_box(boundary, i, axis, x):
    """Return a coordinate of i in the box in which it flies, where rounding at a face may decide otherwise.

    Where a component may fly through all of a box before it is looked at again, it is the box of its sector.
    """


@in_box.register
def _(boundary: NearestImage | SteppedImage, i, axis, x):
    return x - np.floor(x * boundary.inverse[axis]) * boundary.edges[axis]


@in_box.register
def _(boundary: SectorImage, i, axis, x):
    return x - boundary.wraps[i, axis] * boundary.edges[axis] if boundary.inverse[axis] > 0.0 else x


@inner
def count_images(images, i, axis, crossings):
    """Add ``crossings`` of the box to the image count of component ``i``, where images are counted."""
    if images is not None:
        images[i, axis] += crossings
