"""Free flights between collisions, and normal speeds at collisions: histograms, if they are requested."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from carom.engine.observers.interface import Observer
from carom.models.interfaces.memory import present

BINS = 256
"""Of each histogram; the last one holds everything beyond."""


class Flights(Observer):
    """What flights and collisions add up to, by species."""

    species: np.ndarray
    """Species of each component, (n + 1,) int64."""
    moves: np.ndarray
    """Whether each component flies at all, (n,) uint8: 0 where it is pinned."""
    last: Annotated[np.ndarray, present(1)]
    """Time of the last collision of each component, in the epoch, (n,) float64; infinite before the first."""
    widths: Annotated[np.ndarray, present((1, 0, -1))]
    """Width of a bin of free times, free paths and normal speeds, (3,) float64."""
    times: Annotated[np.ndarray, present()]
    """Histogram of free times, (K, BINS) int64."""
    paths: Annotated[np.ndarray, present()]
    """Histogram of free paths, (K, BINS) int64."""
    speeds: Annotated[np.ndarray, present()]
    """Histogram of relative normal speeds, (K, K, BINS) int64, in the rows of the smaller species."""
    flown: Annotated[np.ndarray, present((0, 1, 0))]
    """Flights, and sums of their times and paths, (K, 3) float64."""
    met: Annotated[np.ndarray, present((0, -1))]
    """Collisions, and sums of normal speeds, (K, K, 2) float64, likewise."""
    partners: Annotated[np.ndarray, present()]
    """Who each component collided with last, (n,) int64; -1 before the first."""
    returns: Annotated[np.ndarray, present()]
    """Collisions of components that had collided before, and how many of them were with the partner of the
    last time, (K, 2) float64."""

    def before_pair(self, model, state, event):
        flights, i, j, now = self, event.i, event.j, event.now
        for c in (i, j):
            if flights.moves[c] and flights.last[c] <= now:  # the first flight began before anybody looked
                kind = flights.species[c]
                square = 0.0
                for axis in range(len(state.rows[c].v)):
                    v = np.float64(state.rows[c].v[axis])
                    square += v * v
                time = now - flights.last[c]
                path = time * np.sqrt(square)
                flights.times[kind, bin_of(time, flights.widths[0])] += 1
                flights.paths[kind, bin_of(path, flights.widths[1])] += 1
                flights.flown[kind, 0] += 1.0
                flights.flown[kind, 1] += time
                flights.flown[kind, 2] += path
            flights.last[c] = now
        for c, other in ((i, j), (j, i)):
            if flights.partners[c] >= 0:
                flights.returns[flights.species[c], 0] += 1.0
                if flights.partners[c] == other:
                    flights.returns[flights.species[c], 1] += 1.0
            flights.partners[c] = other
        a = min(flights.species[i], flights.species[j])
        b = max(flights.species[i], flights.species[j])
        u = abs(event.rv) / np.sqrt(event.rr)
        flights.speeds[a, b, bin_of(u, flights.widths[2])] += 1
        flights.met[a, b, 0] += 1.0
        flights.met[a, b, 1] += u

    def at_epoch(self, model, state, length):
        self.last[:] -= length

    def limits(self, n, oldest):
        return {"partners": (-1, n - 1), "last": (oldest, np.inf), "widths": (1e-300, 1e300)}


def make_flights(n: int, species, inverse) -> Flights:
    """Return empty histograms; ``inverse`` are inverse masses (n + 1,) where some are pinned, or None."""
    count = 1 if species is None else int(species.max()) + 1
    return Flights(
        np.zeros(n + 1, np.int64) if species is None else species,
        np.ones(n, np.uint8) if inverse is None else (inverse[:n] > 0.0).astype(np.uint8),
        np.full(n, np.inf),
        np.ones(3),
        np.zeros((count, BINS), np.int64),
        np.zeros((count, BINS), np.int64),
        np.zeros((count, count, BINS), np.int64),
        np.zeros((count, 3)),
        np.zeros((count, count, 2)),
        np.full(n, -1),
        np.zeros((count, 2)),
    )


def bin_of(value, width):
    """Return the bin of a value that is not negative."""
    return int(min(value / width, BINS - 1.0))
