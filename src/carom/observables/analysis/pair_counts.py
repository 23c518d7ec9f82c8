"""Counts of pair distances, in one pass over sorted cells, in any dimension: those of a frame, and compiled.

Distances are those of nearest images. The counts are integers, so that they do not depend on the number of
threads or on the order of the particles.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from carom.cells import Grid, SortedCells
from carom.compiling.entry import entry
from carom.errors import InputError
from carom.frame import Frame
from carom.geometry.nearby import members_of, near_cells, put_spans, put_squares, scratch_of
from carom.geometry.overlaps import geometry_of_frame
from carom.processors import cores

WORTH_THREADS = 2_000_000
"""Number of pairs in reach below which a second thread gains nothing; they take some 15 ms."""

PORTIONS = 8
"""Portions of work per thread, to balance the load: columns at a border of the box have more pairs."""


class Bins(NamedTuple):
    """Bins of distances, as compiled code reads them."""

    edges: np.ndarray  # (m + 1,) [length]
    low: float  # from where on pairs belong to the first bin [length]
    scale: float  # bins a length
    doubt: float  # part of a bin, at its edges, in which rounding may decide


def counts_of(
    frame: Frame, asked: Mapping[str, tuple[tuple[int, int] | None, np.ndarray]]
) -> dict[str, np.ndarray]:
    """Return the numbers of pairs (m,) of one frame, or of two of its species, in each bin, by name."""
    if frame.tilt:
        return {name: _tilted_histogram(frame, *each) for name, each in asked.items()}
    box = np.asarray(frame.box, dtype=np.float64)
    grid = Grid.of(box, np.ones(len(box), dtype=np.bool_), frame.n, max(e[-1] for _, e in asked.values()))
    rounding = float(np.finfo(np.float32).eps) * float(box.max())
    kinds = {kind for pair, _ in asked.values() for kind in (pair or (None,))}
    x = frame.positions
    places = {kind: x if kind is None else x[frame.species == kind] for kind in kinds}
    cells = {kind: SortedCells.of(grid, place) for kind, place in places.items()}
    found = {}
    for name, (pair, edges) in asked.items():
        a, b = pair or (None, None)
        counts, closer = distance_counts(
            cells[a], None if a == b else cells[b], edges, closest=float(edges[0]) - rounding
        )
        if closer:
            _refuse_overlap(frame, pair, float(edges[0]))
        found[name] = counts
    return found


def _tilted_histogram(frame: Frame, pair: tuple[int, int] | None, edges: np.ndarray) -> np.ndarray:
    """Return the numbers of pairs (m,) in each bin in a tilted cell, whose pairs are listed."""
    room = geometry_of_frame(frame)
    pairs = room.near(frame.positions, float(edges[-1]))
    if pair is not None:
        kinds = np.sort(np.asarray(frame.species)[pairs], axis=1)
        pairs = pairs[(kinds == sorted(pair)).all(axis=1)]
    distances = room.distances(frame.positions, pairs)
    rounding = float(np.finfo(np.float32).eps) * max(frame.box)
    if (distances < edges[0] - rounding).any():
        _refuse_overlap(frame, pair, float(edges[0]))
    return np.histogram(np.maximum(distances, edges[0]), edges)[0]


def _refuse_overlap(frame: Frame, pair: tuple[int, int] | None, contact: float) -> None:
    """Raise InputError that names the closest pair of a frame, or of two of its species."""
    room = geometry_of_frame(frame)
    members = np.arange(frame.n)
    species = np.zeros(frame.n, dtype=np.int64) if frame.species is None else frame.species
    if pair is not None:
        members = np.flatnonzero(np.isin(species, pair))
    places = room.wrapped(frame.positions[members])
    pairs = room.near(places, contact)
    if pair is not None and pair[0] != pair[1]:
        kinds = species[members]
        pairs = pairs[kinds[pairs[:, 0]] != kinds[pairs[:, 1]]]
    distances = room.distances(places, pairs)
    closest = int(np.argmin(distances))
    i, j = sorted(members[pairs[closest]].tolist())
    raise InputError(
        f"Particles {i} and {j} overlap at time {frame.time:.6g} (distance {distances[closest]:.6g}, "
        f"{'diameter' if pair is None else 'contact'} {contact:.6g}); g(r) needs a valid frame, or points "
        "(diameter 0)."
    )


def distance_counts(
    ours: SortedCells,
    theirs: SortedCells | None,
    edges: np.ndarray,
    *,
    closest: float | None = None,
    threads: int | None = None,
) -> tuple[np.ndarray, int]:
    """Return the pairs of particles in each bin of distances, (m,), and how many are below all bins.

    Pairs have one of ``ours`` and of ``theirs`` (cells of one grid), or two of ours. ``edges`` (m + 1,) are
    equally spaced, up to half of the shortest periodic edge, with the ends of :func:`numpy.histogram`. Pairs
    from ``closest`` on, by default ``edges[0]``, belong to the first bin.
    """
    grid = ours.grid
    others = ours if theirs is None else theirs
    bins = len(edges) - 1
    scale = bins / float(edges[-1] - edges[0])
    limits = np.array(edges, dtype=np.float64)
    limits[-1] = np.nextafter(limits[-1], np.inf)
    low = float(edges[0] if closest is None else min(closest, edges[0]))
    # Rounding errors of a distance, of an edge, and of their quotient, in units of a bin.
    doubt = 16.0 * float(np.finfo(np.float64).eps) * (float(edges[-1]) * scale + bins + 1.0)
    # Pairs beyond the last bin are counted in many further bins, because increments of a single counter would
    # wait for each other.
    length = 2 * bins + 64
    offsets, windows = grid.surroundings(float(limits[-1]))
    near = near_cells(grid, offsets, windows)
    asked = members_of(ours), members_of(others), near, theirs is None, Bins(limits, low, scale, doubt)

    def portion(first: int, last: int) -> np.ndarray:
        counts, room = np.zeros(length, dtype=np.int64), len(others.order)
        scratch = *scratch_of(near, room), np.empty(room, np.uint32)
        _count(*asked, (first, last), counts, scratch)
        return counts

    columns = grid.columns
    workers = _threads(threads, ours, others, float(edges[-1]))
    cuts = np.linspace(0, columns, min(columns, workers * PORTIONS if workers > 1 else 1) + 1).astype(int)
    if workers == 1:
        counts = portion(0, columns)
    else:
        with ThreadPoolExecutor(workers) as pool:
            counts = np.sum(list(pool.map(portion, cuts[:-1].tolist(), cuts[1:].tolist())), axis=0)
    return counts[1 : bins + 1], int(counts[0])


def _threads(asked: int | None, ours: SortedCells, others: SortedCells, reach: float) -> int:
    """Return the number of threads that is worth their start."""
    if asked is not None:
        return max(asked, 1)
    box = ours.grid.box
    pairs = 0.5 * len(ours.order) * len(others.order) * min(float(np.prod(2.0 * reach / box)), 1.0)
    if pairs < WORTH_THREADS:
        return 1
    return cores()


@entry
def _count(mine, yours, near, alike, bounds, columns, counts, scratch):
    """Add the pairs of the ``columns`` from the first to the last to ``counts``; place 0 is below all bins.

    If both hold the same particles, a pair of cells is visited from the lower number.
    """
    ours, starts, _ = mine
    theirs, others, _ = yours
    height, _, _, period = near
    begins, ends, squares, slots = scratch
    edges, low, scale, doubt = bounds
    origin, bins, top = edges[0], len(edges) - 1, float(len(counts) - 2)
    for column in range(columns[0], columns[1]):
        for level in range(height):
            start, end = starts[column * height + level], starts[column * height + level + 1]
            if start == end:
                continue
            parts = put_spans(begins, ends, others, column, level, near, alike)
            for i in range(start, end):
                if alike:
                    begins[parts - 1] = i + 1
                found = 0
                for part in range(parts):
                    begin, size = begins[part], ends[part] - begins[part]
                    put_squares(squares, found, ours, i, theirs, begin, size, period)
                    found += size
                doubtful = False
                for j in range(found):
                    place = (math.sqrt(squares[j]) - origin) * scale
                    whole = np.floor(place)
                    part_of_bin = place - whole
                    doubtful |= (part_of_bin < doubt) | (part_of_bin > 1.0 - doubt) | (place < 0.0)
                    # The last bits of a float above 2^52 are a whole number.
                    slot_bits = np.float64(max(min(whole, top), -1.0) + (1.0 + 2.0**52)).view(np.int64)
                    slots[j] = slot_bits & 0xFFFFFFFF
                if doubtful:
                    # A distance is an edge up to rounding, so all are compared with the edges themselves.
                    for j in range(found):
                        r, slot = math.sqrt(squares[j]), int(slots[j]) - 1
                        while 0 <= slot <= bins and r < edges[slot]:
                            slot -= 1
                        while slot < bins and r >= edges[slot + 1]:
                            slot += 1
                        if slot < 0 and r >= low:
                            slot = 0
                        slots[j] = slot + 1
                for j in range(found):
                    counts[slots[j]] += 1
