"""Paths through the images of the box, in whole numbers: which of them must be followed with all digits.

A coordinate counts 2^16 *units* an edge, so that a number of 16 bits wraps as the box does. Along the axis of
fastest motion a path passes planes of images at equal intervals. From one to the next each other coordinate
grows by the same *step*, and it is near an image where the wrapped sum is small: an addition and a comparison
for 32 pairs at a time. What is missed is lost, so all that rounding can do is added to what counts as near.

That is, in edges, with e = 2^-24 (the rounding of float32), W the largest velocity along an axis that anybody
had in the epoch [edges / span], T the time since flights were lined up, S <= 1 that to be covered [spans],
and L the longest edge over the shortest:

- Coordinates in the box and velocities are rounded by e and e W, their differences by as much again.
  Relative to the true path the one that is followed is off by at most e (4 + 10 W T) at its beginning,
  and by 4 e W S more at its end: by g = e (4 + 10 W (T + S)) along each axis.
- The path that is followed then comes within a contact distance and g of the image, at a time that is
  covered. There the plane is at most sigma + g away. On the way to it the other coordinate changes by no
  more than L times that in edges (no more than that in lengths: the main axis is the fastest), so that
  the path passes its plane within sqrt(2) sigma + (1 + L) g of the image.
- Where the first plane is passed is computed from numbers below 2 W T + 3 L, with an error of at most e
  (2 W T + 9 L + 3).

The sum of both errors is below ``16 e (1 + L) (1 + W (T + S))``, the error of positions. The rest is exact
but for two roundings to whole numbers: half a unit at the first plane, and at each plane half a unit of the
step, with 3 e L edges that the step itself was off before.
"""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import approximate, fast

BLOCK = 128  # components looked at side by side

PLANES = 2  # planes looked at in one go

UNITS = 2.0**16  # whole numbers that a coordinate can have in one box

HALF = 0x8000  # so many units to both sides are all of the box

SIGN = np.int32(-0x80000000)  # the bit of a float32 that is its sign

ALL = 0xFFFF
"""The largest of the whole numbers: what a path has that comes near nothing."""

ROUNDING = 2.0**-24  # of a number in single precision, relatively

STEP_ROUNDING = 3.0 * ROUNDING * UNITS
"""By how much a step is off before it is rounded to a whole number [units], where all edges are equal."""

SLOWEST = 2.0**-84  # velocity [units / span] below which nothing moves

COARSE = 2.0**-6
"""Error of positions [edges] beyond which every path is looked at closely: some fly thousands of boxes."""


def wrap(number):
    """Return a whole number of units in the box."""
    return np.uint16(number & ALL)


def in_units(x):
    """Return a coordinate in the box as a whole number; ``x`` is in units, float32, and below 2^31."""
    return wrap(np.int32(np.rint(x)))


def along(x, v):
    """Return ``x``, float32, or -x where v is negative: a change of one bit."""
    turned = np.float32(x).view(np.int32) ^ (np.float32(v).view(np.int32) & SIGN)
    return np.int32(turned).view(np.float32)


@approximate
def lay_path(everybody, elapsed, range_edges, start_index, lane):
    """Lay out the path of one of the block whose flights begin at ``start_index``."""
    packed_flights, packed_self, paths = everybody.packed_flights, everybody.packed_self, everybody.paths
    dimension = len(everybody.inverse)
    w = packed_flights[start_index + BLOCK + lane] - packed_self[1]
    u = packed_flights[start_index + lane] - packed_self[0] + w * elapsed
    fastest = abs(w) * np.float32(everybody.lengths[0])
    main = np.int32(0)
    for axis in range(1, dimension):
        speed = packed_flights[start_index + (2 * axis + 1) * BLOCK + lane] - packed_self[2 * axis + 1]
        coordinate = (
            packed_flights[start_index + 2 * axis * BLOCK + lane] - packed_self[2 * axis] + speed * elapsed
        )
        distance = abs(speed) * np.float32(everybody.lengths[axis])
        faster = distance >= fastest
        u = coordinate if faster else u
        w = speed if faster else w
        fastest = distance if faster else fastest
        here = np.int32(axis)
        main = here if faster else main
    ahead = along(u, w) * np.float32(1.0 / UNITS)
    period = np.float32(UNITS) / max(abs(w), np.float32(SLOWEST))
    to_plane = np.ceil(ahead - range_edges) - ahead
    last_speed = (
        packed_flights[start_index + (2 * dimension - 1) * BLOCK + lane] - packed_self[2 * dimension - 1]
    )
    last_place = (
        packed_flights[start_index + (2 * dimension - 2) * BLOCK + lane] - packed_self[2 * dimension - 2]
    )
    last_place += last_speed * elapsed
    for axis in range(dimension - 1):
        speed = packed_flights[start_index + (2 * axis + 1) * BLOCK + lane] - packed_self[2 * axis + 1]
        coordinate = (
            packed_flights[start_index + 2 * axis * BLOCK + lane] - packed_self[2 * axis] + speed * elapsed
        )
        # The others' coordinates; the last one's in the place of the one that counts the planes.
        speed = last_speed if main == axis else speed
        coordinate = last_place if main == axis else coordinate
        step = speed * period
        paths[2 * axis * BLOCK + lane] = in_units(coordinate + step * to_plane)
        paths[(2 * axis + 1) * BLOCK + lane] = in_units(step)


@approximate
def lay_paths(everybody, elapsed, range_edges, start):
    """Lay out the paths of the block from component ``start``, relative to the one that searches.

    What is done for one is a function of its own: no variable seems to live on, and the loop is vectorized.
    """
    start_index = 2 * len(everybody.inverse) * start
    for lane in range(BLOCK):
        lay_path(everybody, elapsed, range_edges, start_index, lane)


@fast
def next_planes(everybody, shift, first_time):
    """Mark how near each path comes to an image at the next few planes; go on behind them.

    A mark is the largest coordinate, at the plane where that is least. ``shift``, at first half of what is
    near and later nothing, is added so that one wrapped comparison sees both sides of an image.
    ``first_time`` is ALL at first, where there is no mark yet, and then zero.
    """
    paths = everybody.paths
    dimension = len(everybody.inverse)
    marks = (2 * dimension - 2) * BLOCK
    for lane in range(BLOCK):
        least = wrap(paths[marks + lane] | first_time)
        for k in range(PLANES):
            largest = wrap(0)
            for axis in range(dimension - 1):
                # Each number is wrapped at once: only then does the compiler see that 16 bits will do.
                coordinate = wrap(int(paths[2 * axis * BLOCK + lane]) + shift)
                step = int(paths[(2 * axis + 1) * BLOCK + lane])
                for _ in range(k):
                    coordinate = wrap(int(coordinate) + step)
                largest = coordinate if coordinate > largest else largest
            least = largest if largest < least else least
        for axis in range(dimension - 1):
            coordinate = wrap(int(paths[2 * axis * BLOCK + lane]) + shift)
            step = int(paths[(2 * axis + 1) * BLOCK + lane])
            for _ in range(PLANES):
                coordinate = wrap(int(coordinate) + step)
            paths[2 * axis * BLOCK + lane] = coordinate
        paths[marks + lane] = least


@fast
def marked(everybody, start_index, limit):
    """Return the first and last from ``start_index`` on whose mark is not above ``limit``.

    Of none they are BLOCK and ``start_index``: a last one of 0 would leave no loop that can be vectorized.
    """
    marks = (2 * len(everybody.inverse) - 2) * BLOCK
    beyond, least = wrap(BLOCK), wrap(start_index)
    first_lane, last = beyond, least
    for lane in range(BLOCK):
        number = wrap(lane)
        near_it = (everybody.paths[marks + lane] <= limit) & (number >= least)
        low = number if near_it else beyond
        high = number if near_it else least
        first_lane = low if low < first_lane else first_lane
        last = high if high > last else last
    return int(first_lane), int(last)


def max_relative_speed(everybody, start):
    """Return the most that anybody of a block may fly relative to the one that searches [edges / span]."""
    dimension = len(everybody.inverse)
    start_index = start // BLOCK * dimension
    speed = 0.0
    for axis in range(dimension):
        packed_self = np.float64(everybody.packed_self[2 * axis + 1]) * (1.0 / UNITS)
        speed = max(speed, everybody.swiftest[start_index + axis] + abs(packed_self))
    return speed


def position_error_of(everybody, elapsed, covered):
    """Return by how much rounding may hide an image [edges]; times are in spans."""
    way = everybody.fastest[0] * (elapsed + covered)
    return 16.0 * ROUNDING * (1.0 + everybody.stretch) * (1.0 + way)


def prefilter(everybody, elapsed, covered, position_error, start):
    """Mark those of the block from ``start`` on whose relative paths come near an image."""
    if position_error > COARSE:
        return wrap(ALL)
    range_edges = everybody.width + position_error
    most = int(max_relative_speed(everybody, start) * covered + 2.0 * range_edges + 1.0)
    # One unit more for the two halves: at the first plane, and where this number is cut.
    half = int(UNITS * range_edges + 1.5 + most * (0.5 + everybody.stretch * STEP_ROUNDING))
    if half >= HALF:
        return wrap(ALL)
    lay_paths(everybody, np.float32(elapsed), np.float32(range_edges), start)
    next_planes(everybody, half, wrap(ALL))
    for _ in range(PLANES, most, PLANES):
        next_planes(everybody, 0, wrap(0))
    return wrap(2 * half)
