r"""The next meeting among moving spheres in a periodic box, over all images that can be met.

Two spheres in a small box may meet through any image of each other. Rather than guess how many images a
flight can reach, the search goes through time in windows in which no pair moves by more than a quarter of an
edge relative to each other. With the nearest image within half an edge and a contact distance of at most one
edge, only the offsets -1, 0, 1 along each axis can then be met within the window:
``|r + 2 L| >= 3/2 L`` is beyond the reach of ``L + L / 4``.

**Floats find the candidates, the chosen arithmetic decides.** The sweep over pairs, windows and images uses
doubles and spheres that are larger by a margin :math:`\eta = 2^{-20} S`, where S bounds every length that
enters. Growing the contact distance adds at least :math:`\eta^2 = 2^{-40} S^2` to :math:`-c`, while rounding
changes :math:`b^2 / a` and c together by less than :math:`8 (d + 4) 2^{-53} S^2 < 2^{-46} S^2` for d <= 6.
So no meeting is missed, and the entry into the larger sphere is a true lower bound of the meeting time. Every
candidate whose lower bound is not beaten is then solved in the arithmetic asked for.
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
# Pairs x windows swept at once: bounds the memory to some ten megabytes.
_ROWS = 2**16
# Quarter-edge windows looked through before the search gives up: seconds of work.
_WINDOWS = 2**22


class NoMeetingFound(CaromError):
    """No pair met within the longest search; perhaps none ever will."""


class Meeting(NamedTuple):
    """Spheres i < j touch after `delay`, with ``r = x[j] + image * box - x[i]`` at contact."""

    delay: Any
    i: int
    j: int
    image: tuple[int, ...]


def contact_time(r: Any, u: Any, contact: Any, sqrt: Any) -> Any:
    """Time until ``|r + u t| = contact``, or None when the two do not meet.

    Parameters
    ----------
    r, u : (d,) arrays of numbers
        Relative position [length] and velocity at one time.
    contact : number
        Distance at contact [length].
    sqrt : callable
        Root of the arithmetic in use.

    Notes
    -----
    Lubachevsky (1991), eq. (2), in the form ``c / (-b + sqrt(b^2 - ac))``, which keeps its digits for grazing
    meetings. Spheres that overlap by rounding and approach meet now (sec. 6). Two that touch without
    approaching (b = 0) exchange no momentum, and do not meet.
    """
    b = sum(r * u)
    if b >= 0:
        return None
    c = sum(r * r) - contact * contact
    if c <= 0:
        return c * 0
    discriminant = b * b - sum(u * u) * c
    if discriminant < 0:
        return None
    return c / (-b + sqrt(discriminant))


def _candidates(
    x: np.ndarray,
    v: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    contact: np.ndarray,
    box: np.ndarray,
    width: float,
    windows: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs (rows of `first`), images (n, d) and lower bounds of the delay, for all that may meet in time."""
    duration = width * windows
    scale = float(np.sqrt(box @ box)) + 2.0 * float(np.sqrt((v * v).sum(axis=1).max())) * duration
    margin = _MARGIN * scale
    pair = np.repeat(np.arange(len(first)), windows)
    begin = np.tile(np.arange(windows) * width, len(first))
    columns: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    # Axis by axis, so that a pair that is too far along one axis costs nothing on the others.
    for axis, edge in enumerate(box):
        i, j = first[pair], second[pair]
        u = v[j, axis] - v[i, axis]
        r = x[j, axis] - x[i, axis] + u * begin
        wrap = -np.rint(r / edge)
        r += wrap * edge
        reach = contact[pair] + margin + np.abs(u) * width
        kept = [np.flatnonzero(np.abs(r + offset * edge) <= reach) for offset in (-1, 0, 1)]
        rows = np.concatenate(kept)
        offset = np.repeat([-1.0, 0.0, 1.0], [len(k) for k in kept])
        pair, begin = pair[rows], begin[rows]
        columns = [(a[rows], b[rows], c[rows]) for a, b, c in columns]
        columns.append((r[rows] + offset * edge, u[rows], wrap[rows] + offset))
    r, u, image = (np.stack(column, axis=1) for column in zip(*columns, strict=True))
    a, b = (u * u).sum(axis=1), (r * u).sum(axis=1)
    c = (r * r).sum(axis=1) - (contact[pair] + margin) ** 2
    discriminant = b * b - a * c
    outside = (c > 0) & (b < 0) & (discriminant >= 0)
    inside = (c <= 0) & (b < _GRAZING * scale * np.sqrt(a))
    delay = np.zeros_like(c)
    delay[outside] = c[outside] / (np.sqrt(discriminant[outside]) - b[outside])
    found = np.flatnonzero((outside | inside) & (delay <= width))
    return pair[found], image[found].astype(np.int64), begin[found] + delay[found]


def _blocks(n: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """All pairs i < j in lexicographic order, in blocks of at most about `_ROWS` (or one row of n)."""
    rows = max(1, _ROWS // n)
    for low in range(0, n - 1, rows):
        i, j = np.triu_indices(min(rows, n - 1 - low), 1, n - low)
        yield i + low, j + low


def _period(v: np.ndarray, box: np.ndarray) -> float:
    """Time after which relative positions repeat, if every pair moves along one axis only; else infinite."""
    speed = np.abs(v[:, None, :] - v[None, :, :])
    if ((speed > 0).sum(axis=2) > 1).any():
        return math.inf
    speed[speed == 0] = np.inf
    return float((box / speed).max())


def next_meeting(
    positions: np.ndarray,
    velocities: np.ndarray,
    diameters: np.ndarray,
    box: np.ndarray,
    arithmetic: Arithmetic,
    *,
    limit: Any = math.inf,
    guess: float = math.inf,
    windows_limit: int = _WINDOWS,
) -> Meeting | None:
    """Return the first meeting of any two spheres through any image, the smallest (delay, i, j, image).

    Parameters
    ----------
    positions, velocities : (n, d) arrays of numbers
        At one common time; positions within about one edge of the box [length].
    diameters : (n,) array of numbers
        Two spheres meet at the mean of their diameters, which exceeds no edge of the box.
    box : (d,) array of numbers
        Edges of the periodic box.
    arithmetic : Arithmetic
        In which the times are computed and compared.
    limit : number
        Look no further than this delay [time].
    guess : float
        A likely delay; only the speed depends on it.
    windows_limit : int
        Quarter-edge windows to look through.

    Returns
    -------
    Meeting or None
        None if there is no meeting within `limit`, or never one: no relative motion, or motion along one axis
        only and a full period without a meeting.

    Raises
    ------
    NoMeetingFound
        If the whole of `windows_limit` windows holds no meeting (pairs may fly along channels for ever).
    """
    n = len(positions)
    v, edges = velocities.astype(float), box.astype(float)
    spread = v.max(axis=0) - v.min(axis=0) if n > 1 else np.zeros(len(edges))
    if not spread.any():
        return None
    with np.errstate(divide="ignore"):
        quarter = float((edges / (4.0 * spread)).min())
    sigma = diameters.astype(float)
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
            pairs, images, delays = _candidates(
                x, v, first, second, 0.5 * (sigma[first] + sigma[second]), edges, width, windows
            )
            for row in np.argsort(delays, kind="stable"):
                if best is not None and start + delays[row] > best.delay:
                    break
                i, j = int(first[pairs[row]]), int(second[pairs[row]])
                shift = images[row]
                r = positions[j] - positions[i] + shift * box
                contact = (diameters[i] + diameters[j]) / 2
                delay = contact_time(r, velocities[j] - velocities[i], contact, arithmetic.sqrt)
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
            period = _period(v, edges) if period == math.inf and looked >= 4 else period
            windows = min(2 * windows, max(1, 2 * _ROWS // (n * n)))
    return None
