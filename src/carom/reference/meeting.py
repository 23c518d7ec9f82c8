r"""The next meeting among moving spheres in a periodic box, over all images that can be met.

The search goes through time in windows in which no pair moves by more than a quarter of an edge relative to
each other. With the nearest image within half an edge, an offset of m edges is out of reach of a contact
distance s where ``(m - 1/2) L > s + L / 4``: for contacts of at most one edge, only the offsets -1, 0, 1
along each periodic axis can be met.

**Floats find the candidates, the chosen arithmetic decides.** The sweep over pairs, windows and images uses
doubles and spheres that are larger by a margin :math:`\eta = 2^{-20} S`, where S bounds every length that
enters. A larger contact distance adds at least :math:`\eta^2 = 2^{-40} S^2` to :math:`-c`, while rounding
changes :math:`b^2 / a` and c together by less than :math:`8 (d + 4) 2^{-53} S^2 < 2^{-46} S^2` for d <= 6. So
no meeting is missed, and the entry into the larger sphere is a true lower bound of its time. Candidates with
a lower bound before the earliest meeting so far are solved in the chosen arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from carom.errors import CaromError
from carom.reference.arithmetic import Arithmetic

_MARGIN = 2.0**-20
# A pair within the margin of contact counts as approaching unless it clearly separates; the rounding of r.u
# is below (d + 4) 2**-52 |u| S.
_GRAZING = 2.0**-40
# Pairs x windows swept at once, which bounds the memory to about ten megabytes.
_ROWS = 2**16
# Quarter-edge windows that are searched before the search gives up: seconds of work.
_WINDOWS = 2**22


class Contacts(NamedTuple):
    """Distances at which pairs touch, and how fast these grow."""

    diameters: np.ndarray  # of each sphere, (n,) [length]
    growth: np.ndarray  # of their diameters, (n,) [length / time]

    def of(self, i: Any, j: Any) -> tuple[Any, Any]:
        """Return the contact distance and its rate of growth: of a pair, or of arrays of pairs."""
        return (self.diameters[i] + self.diameters[j]) / 2, (self.growth[i] + self.growth[j]) / 2

    def floats(self) -> Contacts:
        """Return the same in doubles."""
        return Contacts(self.diameters.astype(float), self.growth.astype(float))


class NoMeetingFound(CaromError):
    """No pair collided within the longest search; perhaps none ever will."""


class Meeting(NamedTuple):
    """Spheres i < j touch after `delay`, with ``r = x[j] + image * box - x[i]`` at contact."""

    delay: Any
    i: int
    j: int
    image: tuple[int, ...]


def contact_time(r: Any, u: Any, contact: Any, sqrt: Any, rate: Any = 0) -> Any:
    """Time until ``|r + u t| = contact + rate t``, or None when the two do not meet.

    Lubachevsky (1991), eq. (2), as ``c / (-b + sqrt(b^2 - ac))``, which keeps its digits for grazing
    meetings. Spheres that overlap by rounding and approach meet now (sec. 6). Two that touch without
    approaching (b = 0) exchange no momentum, and do not meet, unless they grow faster than they part (a < 0).
    """
    a = sum(u * u) - rate * rate
    b = sum(r * u) - contact * rate
    c = sum(r * r) - contact * contact
    if b >= 0:
        if a >= 0:
            return None
        # The two part at first; then the growing contact distance catches up.
        return (b + sqrt(max(b * b - a * c, c * 0))) / -a
    if c <= 0:
        return c * 0
    discriminant = b * b - a * c
    if discriminant < 0:
        return None
    return c / (-b + sqrt(discriminant))


def _candidates(
    x: np.ndarray,
    v: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    contact: np.ndarray,
    rate: np.ndarray,
    box: np.ndarray,
    periodic: np.ndarray,
    width: float,
    windows: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs (rows of `first`) that may meet in time, images (n, d) and lower bounds of the delay."""
    duration = width * windows
    fastest = float(np.sqrt((v * v).sum(axis=1).max())) + float(rate.max())
    scale = float(np.sqrt(box @ box)) + float(contact.max()) + 2.0 * fastest * duration
    margin = _MARGIN * scale
    pair = np.repeat(np.arange(len(first)), windows)
    begin = np.tile(np.arange(windows) * width, len(first))
    widest = float((contact + rate * duration).max()) + margin
    columns: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    # Axis by axis, so that a pair that is too far apart along one axis is not checked along the others.
    for axis, edge in enumerate(box):
        i, j = first[pair], second[pair]
        u = v[j, axis] - v[i, axis]
        r = x[j, axis] - x[i, axis] + u * begin
        wrap = -np.rint(r / edge) * periodic[axis]
        r += wrap * edge
        far = int(widest / edge + 0.75 + _MARGIN) if periodic[axis] else 0
        offsets = np.arange(-far, far + 1)
        reach = contact[pair] + rate[pair] * (begin + width) + margin + np.abs(u) * width
        kept = [np.flatnonzero(np.abs(r + offset * edge) <= reach) for offset in offsets]
        rows = np.concatenate(kept)
        offset = np.repeat(offsets.astype(float), [len(k) for k in kept])
        pair, begin = pair[rows], begin[rows]
        columns = [(a[rows], b[rows], c[rows]) for a, b, c in columns]
        columns.append((r[rows] + offset * edge, u[rows], wrap[rows] + offset))
    r, u, image = (np.stack(column, axis=1) for column in zip(*columns, strict=True))
    touch = contact[pair] + rate[pair] * begin + margin
    a, b = (u * u).sum(axis=1) - rate[pair] ** 2, (r * u).sum(axis=1) - touch * rate[pair]
    c = (r * r).sum(axis=1) - touch**2
    discriminant = b * b - a * c
    outside = (c > 0) & ((b < 0) | (a < 0)) & (discriminant >= 0)
    inside = (c <= 0) & ((a < 0) | (b < _GRAZING * scale * (np.sqrt((u * u).sum(axis=1)) + rate[pair])))
    delay = np.zeros_like(c)
    delay[outside] = c[outside] / (np.sqrt(discriminant[outside]) - b[outside])
    found = np.flatnonzero((outside | inside) & (delay <= width))
    return pair[found], image[found].astype(np.int64), begin[found] + delay[found]


def _blocks(n: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield all pairs i < j in lexicographic order, in blocks of about `_ROWS` or of one row."""
    rows = max(1, _ROWS // n)
    for low in range(0, n - 1, rows):
        i, j = np.triu_indices(min(rows, n - 1 - low), 1, n - low)
        yield i + low, j + low


def _period(v: np.ndarray, box: np.ndarray) -> float:
    """Return when relative positions repeat, if every pair moves along a single axis, or else infinity."""
    speed = np.abs(v[:, None, :] - v[None, :, :])
    if ((speed > 0).sum(axis=2) > 1).any():
        return math.inf
    speed[speed == 0] = np.inf
    return float((box / speed).max())


def next_meeting(
    positions: np.ndarray,
    velocities: np.ndarray,
    contacts: Contacts,
    box: np.ndarray,
    arithmetic: Arithmetic,
    *,
    periodic: np.ndarray | None = None,
    limit: Any = math.inf,
    guess: float = math.inf,
    windows_limit: int = _WINDOWS,
) -> Meeting | None:
    """Return the first meeting of any two through any image: the smallest (delay, i, j, image), or None.

    Positions (n, d) are within about one edge of the box. None: no meeting within ``limit`` [time], or never
    one, as there is no relative motion, or motion along one axis only and a full period without a meeting.
    ``guess``, a likely delay, changes the speed only; ``windows_limit`` counts quarter-edge windows.
    """
    n = len(positions)
    if n < 2:
        return None
    v, edges = velocities.astype(float), box.astype(float)
    around = np.ones(len(edges), dtype=bool) if periodic is None else periodic
    rough = contacts.floats()
    spread = v.max(axis=0) - v.min(axis=0)
    grows = float(rough.growth.max())
    if not spread.any() and not grows:
        return None
    with np.errstate(divide="ignore"):
        quarter = float(min((edges / (4.0 * spread)).min(), edges.min() / (4.0 * np.float64(grows))))
    width, windows, start, looked, period = min(quarter, guess), 1, 0.0, 0, math.inf
    best: Meeting | None = None
    while start <= limit:
        x = (
            (positions + velocities * arithmetic.number(start)).astype(float)
            if start
            else positions.astype(float)
        )
        end = start + width * windows
        for first, second in _blocks(n):
            contact, rate = rough.of(first, second)
            pairs, images, delays = _candidates(
                x, v, first, second, contact + rate * start, rate, edges, around, width, windows
            )
            for row in np.argsort(delays, kind="stable"):
                if best is not None and start + delays[row] > best.delay:
                    break
                i, j = int(first[pairs[row]]), int(second[pairs[row]])
                shift = images[row]
                r = positions[j] - positions[i] + shift * box
                touch, growth = contacts.of(i, j)
                delay = contact_time(r, velocities[j] - velocities[i], touch, arithmetic.sqrt, growth)
                # Beyond the end, another pair may be earlier: the next batch of windows finds both.
                if delay is not None and delay <= end:
                    meeting = Meeting(delay, i, j, tuple(int(s) for s in shift))
                    best = meeting if best is None or meeting < best else best
        if best is not None:
            return best if best.delay <= limit else None
        looked += windows if width == quarter else 0
        start = end
        if start > period:
            return None
        if looked > windows_limit:
            raise NoMeetingFound(
                f"No two of the {n} spheres meet within {start:.3g} time units ({looked} windows of a "
                "quarter of an edge); perhaps they never do. Give a time to stop at."
            )
        if width < quarter:
            width = min(4.0 * width, quarter)
        else:
            if period == math.inf and looked >= 4 and not grows:
                period = _period(v, edges)
            windows = min(2 * windows, max(1, 2 * _ROWS // n**2))
    return None
