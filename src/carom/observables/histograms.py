"""Histograms of pair distances in any dimension, with bins that begin at contact: g(r) of frames."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from carom import checks
from carom.arithmetic import power
from carom.cells import Grid, SortedCells
from carom.errors import InputError
from carom.frame import Frame
from carom.models.motions.shear import LONGEST_STRAIN
from carom.observables.contact import contact_value
from carom.observables.of_frames import OfFrames
from carom.observables.pairs import distance_counts
from carom.observables.statistics import MIN_BLOCKS, blocking
from carom.scene.overlaps import room_of_frame
from carom.theory import ball_volume

# Default width of a bin [diameters]: up to freezing in 3D, g falls by at most a tenth in one bin.
DEFAULT_WIDTH = 0.02

# Default largest distance [diameters]: in a fluid structure fades beyond it, while the cost grows as r^d.
DEFAULT_REACH = 5.0

# Largest number of bins: each frame keeps a count for every bin.
MOST_BINS = 10_000_000


Wanted = Mapping[str, tuple[tuple[int | str, int | str] | None, float | None]]
"""The two species of each g(r) and the distance at which they touch [length], by its name."""


class Histograms(OfFrames):
    """Base of what counts the distances of several g(r) in one pass: ``_wanted``, in bins by ``_binning``."""

    _what = "g(r)"
    _uniform = True
    _same = ("n", "dimension", "diameters", "species")

    _wanted: Wanted
    _binning: tuple[int | None, float | None, float | None] = (None, None, None)
    """The parameters bins, width and rmax of :class:`carom.RDF`."""

    def _begin(self, first: Frame) -> None:
        self._asked: dict[str, tuple[tuple[int, int] | None, np.ndarray]] = {}
        for name, (pair, contact) in self._wanted.items():
            chosen = None if pair is None else species_pair(first, pair)
            if contact is not None and chosen is None:
                raise InputError("contact is the distance of two species, and no pair is given.")
            diameter = _common_diameter(first) if chosen is None else _contact(first, chosen, contact)
            self._asked[name] = (chosen, _bin_edges(diameter, _narrowest(first), *self._binning))

    def _of(self, frame: Frame) -> tuple[dict[str, np.ndarray], float]:
        """Return the pairs in each bin of each g(r), and the volume [length^d]."""
        self._fit(0.5 * _narrowest(frame))
        return _histograms(frame, self._asked), math.prod(frame.box)

    def _fit(self, half: float) -> None:
        """Leave out the bins beyond half of the shortest edge of a frame [length]."""
        for name, (pair, edges) in self._asked.items():
            kept = int(np.searchsorted(edges, half, side="right"))
            if kept == len(edges):
                continue
            if kept < 2 or self._binning != (None, self._binning[1], None):
                checked_rmax(float(edges[-1]), 2.0 * half, float(edges[0]))
            self._asked[name] = pair, edges[:kept]

    def _found(self) -> Any:
        """Return the fields of each :class:`carom.observables.RDFResult`, by name."""
        counted, volumes = zip(*self._samples, strict=True)
        found = {}
        for name, (pair, edges) in self._asked.items():
            counts = np.array([each[name][: len(edges) - 1] for each in counted])
            found[name] = _distribution(self._first, counts, edges, pair, np.array(volumes))
        return found


def _narrowest(frame: Frame) -> float:
    """Return the shortest distance of two faces of the box, at any tilt that a sheared one has [length]."""
    edges = [float(edge) for edge in frame.box]
    if frame.tilt is not None:
        edges[0] /= math.hypot(1.0, 0.5 * edges[0] / edges[1] + LONGEST_STRAIN)
    return min(edges)


def _distribution(
    first: Frame, counts: np.ndarray, edges: np.ndarray, pair: tuple[int, int] | None, volumes: np.ndarray
) -> dict[str, Any]:
    """Return the fields of g(r) from histograms (frames, m) of frames like the first, with their volumes."""
    expected = ideal_counts(edges, _pairs(first, pair), first.box)
    neighbors, neighbors_error = _running(first, counts, pair)
    larger = volumes / volumes[0]
    weighted = counts * larger[:, None] if (larger != 1.0).any() else counts
    return {
        "edges": edges,
        "g": weighted.mean(axis=0) / expected,
        "error": _errors(weighted, larger, expected),
        "counts": counts.sum(axis=0),
        "n": first.n,
        "dimension": first.dimension,
        "frames": len(counts),
        "diameter": float(edges[0]),
        "packing_fraction": _packing_fraction(first) * float(np.mean(1.0 / larger)),
        "contact_value": contact_value(weighted, expected, edges, first.dimension),
        "pair": pair,
        "neighbors": neighbors,
        "neighbors_error": neighbors_error,
    }


def _running(first: Frame, counts: np.ndarray, pair: tuple[int, int] | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of neighbors up to the end of each bin, and the errors of these sums, (m,) each."""
    centers = first.n if pair is None else int(np.count_nonzero(first.species == pair[0]))
    per_pair = 1.0 if pair is not None and pair[0] != pair[1] else 2.0
    numbers = np.cumsum(counts, axis=1) * (per_pair / centers)
    if len(counts) < MIN_BLOCKS:
        independent = np.sqrt(np.cumsum(counts.sum(axis=0))) * (per_pair / centers / len(counts))
        return numbers.mean(axis=0), independent
    return numbers.mean(axis=0), np.array([blocking(column).error for column in numbers.T])


def _common_diameter(frame: Frame) -> float:
    """Return the diameter of all particles."""
    diameters = np.unique(frame.diameters)
    if frame.n < 2:
        raise InputError(f"The frame holds {frame.n} particle; g(r) needs two or more.")
    if diameters.size != 1:
        raise InputError(
            f"Diameters differ, from {diameters[0]:.6g} to {diameters[-1]:.6g}; this g(r) needs equal ones, "
            "or two species: pair=(0, 1), as an option --pair 0,1."
        )
    return float(diameters[0])


def species_pair(frame: Frame, pair: tuple[int | str, int | str]) -> tuple[int, int]:
    """Return the numbers of two species of a frame, given by names or numbers."""
    if frame.species is None:
        raise InputError("pair is given, and the frames have no species; leave it out.")
    if not isinstance(pair, tuple | list) or len(pair) != 2:
        raise InputError(f"pair is {pair!r}; expected two species, such as (0, 1).")
    count = max(int(frame.species.max()) + 1, len(frame.species_names))
    found = []
    for which in pair:
        k = frame.species_names.index(which) if which in frame.species_names else which
        k = int(k) if isinstance(k, str) and k.isdecimal() else k
        if isinstance(k, bool) or not isinstance(k, int | np.integer) or not 0 <= k < count:
            known = ", ".join(frame.species_names) or f"0 to {count - 1}"
            raise InputError(f"There is no species {which!r}; known are {known}.")
        found.append(int(k))
    if _pairs(frame, (found[0], found[1])) == 0:
        raise InputError(f"There are too few components of species {found[0]} and {found[1]} for any pair.")
    return found[0], found[1]


def _contact(frame: Frame, pair: tuple[int, int], contact: float | None) -> float:
    """Return the distance at which two species touch."""
    assert frame.species is not None
    sizes = []
    for k in pair:
        diameters = np.unique(frame.diameters[frame.species == k])
        if diameters.size != 1:
            raise InputError(
                f"Diameters of species {k} differ, from {diameters[0]:.6g} to {diameters[-1]:.6g}; g(r) "
                "needs one diameter a species."
            )
        sizes.append(float(diameters[0]))
    if contact is None:
        return 0.5 * sum(sizes)
    if not checks.number(contact, "contact") > 0.0:
        raise InputError(f"contact is {contact!r}; it must be a positive length.")
    return float(contact)


def _pairs(frame: Frame, pair: tuple[int, int] | None) -> float:
    """Return the number of pairs of all particles, or of two species."""
    if pair is None:
        return 0.5 * frame.n * (frame.n - 1)
    a, b = (int(np.count_nonzero(frame.species == k)) for k in pair)
    return 0.5 * a * (a - 1) if pair[0] == pair[1] else float(a * b)


def _packing_fraction(frame: Frame) -> float:
    volume = ball_volume(frame.dimension) * math.fsum(power(frame.diameters, frame.dimension))
    return float(volume / math.prod(frame.box))


def checked_rmax(rmax: float | None, shortest: float, rmin: float) -> float:
    """Return the end of the bins: ``rmax``, or by default half of the ``shortest`` edge [length]."""
    half = 0.5 * shortest
    end = half if rmax is None else checks.number(rmax, "rmax")
    if not end <= half:
        raise InputError(
            f"rmax is {end:.6g}, beyond half of the shortest box edge ({half:.6g}), where shells leave the "
            f"box; use rmax <= {half:.6g} or a larger box."
        )
    if not end > rmin:
        raise InputError(f"rmax is {end:.6g}; it must exceed {rmin:.6g}, where the bins begin.")
    return end


def _bin_edges(
    diameter: float, shortest: float, bins: int | None, width: float | None, rmax: float | None
) -> np.ndarray:
    """Return the edges of the bins from the diameter on."""
    if bins is not None and width is not None and rmax is not None:
        raise InputError("bins, width and rmax were all given; give two of them.")
    if bins is not None and (isinstance(bins, bool) or not isinstance(bins, (int, np.integer)) or bins < 1):
        raise InputError(f"bins is {bins!r}; it must be a positive integer.")
    if width is not None and not checks.number(width, "width") > 0.0:
        raise InputError(f"width is {width!r}; it must be a positive length.")
    if bins is not None and width is not None:
        rmax = diameter + bins * width
    elif rmax is None and diameter > 0.0:
        rmax = min(0.5 * shortest, DEFAULT_REACH * diameter)
    end = checked_rmax(rmax, shortest, diameter)
    if bins is None:
        if width is None:
            width = DEFAULT_WIDTH * diameter if diameter > 0.0 else end / 200
        # A range that is a whole number of widths up to rounding keeps its last bin.
        asked = (end - diameter) / width * (1.0 + 1e-12)
        bins = max(int(min(asked, MOST_BINS + 1)), 1)
        end = min(diameter + bins * width, end) if asked <= MOST_BINS else end
    if bins > MOST_BINS:
        raise InputError(
            f"There would be more than {MOST_BINS} bins from {diameter:.6g} to {end:.6g}; give wider ones "
            "or fewer."
        )
    return np.linspace(diameter, end, int(bins) + 1)


def _histograms(
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
    room = room_of_frame(frame)
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
    room = room_of_frame(frame)
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


def ideal_counts(edges: np.ndarray, pairs: float, box: tuple[float, ...]) -> np.ndarray:
    """Return the expected number of pairs in each shell between ``edges``, for ``pairs`` of an ideal gas."""
    shells = ball_volume(len(box)) * np.diff(power(2.0 * edges, len(box)))
    return pairs * shells / math.prod(box)


def independent_errors(counts: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return the errors (m,) of g for independent pairs: ``counts`` seen, ``expected`` for an ideal gas."""
    return np.sqrt(np.maximum(counts, 1)) / expected


def _errors(weighted: np.ndarray, larger: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return the standard errors (m,) of g from histograms (frames, m), weighted by volumes (frames,)."""
    frames = weighted.shape[0]
    total = np.sum(weighted * larger[:, None], axis=0)  # the variance of independent pairs
    errors = independent_errors(total, frames * expected)
    if frames < MIN_BLOCKS:
        return errors
    for k in np.flatnonzero(total):
        errors[k] = blocking(weighted[:, k]).error / expected[k]
    return errors
