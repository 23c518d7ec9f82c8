"""Pairs with steps and without: the time and the outcome of their events, through one interface.

The step of a pair is in bits of the refs in neighbor lists, ``index << bits | step``. A pair has two
entries, which change together at its events. Renewed lists keep the refs of old neighbors; new ones come
from beyond all steps. Only the caller derives steps from distances, at the start of a run.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.lanes import asked_of
from carom.engine.boundary import NearestImage
from carom.errors import CaromError
from carom.models.interfaces.particles import NEVER
from carom.models.interfaces.steps import step_bits


def step_of(boundary, ref):
    """Return the step that a ref names."""
    return int(ref) & ((1 << boundary.bits) - 1)


class SteppedImage(NearestImage):
    """A :class:`NearestImage` whose refs name steps of pairs."""

    bits: int  # low bits of a ref that hold the step

    def index(self, ref):  # type: ignore[override]  # of a tuple
        return int(ref) >> self.bits

    def index_bits(self):
        return self.bits

    def mirror(self, i, ref):
        return (i << self.bits) | step_of(self, ref)

    def candidate_time(self, pair, lanes, lane_index, i, ref, rr, rv, vv, now):
        j, step = self.index(ref), step_of(self, ref)
        return asked_of("step_time", pair, lanes, lane_index, i, j, (step, rr, rv, vv, now))

    def refined_time(self, pair, i, ref, rr, rv, vv, now):
        t = pair.step_time(i, self.index(ref), step_of(self, ref), rr, rv, vv, now)
        return t if t < NEVER else max(-rv / vv, 0.0), False

    def outcome(self, pair, neighbors, tally, i, ref, rr, rv, now):
        j = self.index(ref)
        before = step_of(self, ref)
        a, b, virial, step, kind = pair.step_jump(i, j, before, rr, rv, now)
        if step != before:
            neighbors.put_step(i, j, step)
            neighbors.put_step(j, i, step)
        pair.events[before, kind] += 1
        tally.depth = max(tally.depth, pair.step_core_square(before) / rr)
        return a, b, virial, kind, before, step

    def logged(self, ref, kind):
        return (self.index(ref) << self.bits) | kind


def fresh_ref(pair_steps, i, j):
    """Return the ref under which i lists j, a newcomer from beyond all steps."""
    return np.uint32(j) if pair_steps is None else pair_steps.fresh_ref(i, j)


class PairSteps(NamedTuple):
    """How refs of lists name steps; None without steps."""

    bits: int  # low bits of a ref that hold the step
    ready: np.ndarray  # whether lists have been built and steps written into them since, (1,) int64

    def fresh_ref(self, i, j):
        return np.uint32(j << self.bits)


class SpeciesSteps(NamedTuple):
    """The same where pairs of species have steps of their own."""

    bits: int  # low bits of a ref that hold the step
    ready: np.ndarray  # whether lists have been built and steps written into them since, (1,) int64
    species: np.ndarray  # (n + 1,) int64
    species_count: int  # K
    outside: np.ndarray  # step of a pair of species that is out of reach, (K * K,) int64

    def fresh_ref(self, i, j):
        pair_of_species = self.species[i] * self.species_count + self.species[j]
        return stepped_ref(self, j, self.outside[pair_of_species])


def make_steps(interaction: Any, particles: Any) -> PairSteps | SpeciesSteps | None:
    """Return how lists name the steps of an interaction, or None where it has none."""
    if not hasattr(interaction, "steps"):
        return None
    count, outside = interaction.steps(particles)
    bits, n = step_bits(count), len(particles.radii)
    if (n + 1) << bits >= 1 << 31:
        raise ValueError(
            f"{n} components on {count} steps are more than 31 bits can name: use fewer of them."
        )
    ready = np.zeros(1, np.int64)
    if not np.any(outside):
        return PairSteps(bits, ready)
    species = particles.with_padding(particles.species, np.int64)
    return SpeciesSteps(bits, ready, species, len(outside), np.ascontiguousarray(outside, np.int64).ravel())


def named(pair_steps, ref):
    """Return the component that a ref of a list names."""
    return ref if pair_steps is None else np.uint32(ref >> np.uint32(pair_steps.bits))


def put_newcomer(pair_steps, newcomers, k, i, j):
    """Put the ref of a newcomer in the place of its index."""
    if pair_steps is not None:
        newcomers[k] = fresh_ref(pair_steps, i, j)


def standing(pair_steps):
    """Tell whether the lists stand already, with steps in them; only the first time it is asked."""
    if pair_steps is None:
        return False
    ready = pair_steps.ready[0] != 0
    pair_steps.ready[0] = 0
    return ready


def stepped_ref(pair_steps, j, step):
    """Return the ref that names component j and a step."""
    return np.uint32((j << pair_steps.bits) | step)


def _entries(lists: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return where in the refs the lists' entries are, and whose each is."""
    n = len(lists.counts)
    owners = np.repeat(np.arange(n), lists.counts)
    begins = np.repeat(np.cumsum(lists.counts, dtype=np.int64) - lists.counts, lists.counts)
    return owners * lists.bounds.capacity + np.arange(len(owners)) - begins, owners


def read_steps(lists: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs (m, 2), i < j, that are not beyond all steps, and the step of each (m,)."""
    entries, owners = _entries(lists)
    refs = lists.refs[entries].astype(np.int64)
    others, step_numbers = refs >> lists.steps.bits, refs & ((1 << lists.steps.bits) - 1)
    outside: Any = 0
    if isinstance(lists.steps, SpeciesSteps):
        species = lists.steps.species
        outside = lists.steps.outside[species[owners] * lists.steps.species_count + species[others]]
    inside = (owners < others) & (step_numbers != outside)
    return np.stack([owners[inside], others[inside]], axis=1), step_numbers[inside]


def write_steps(lists: Any, pairs: np.ndarray, step_numbers: np.ndarray) -> None:
    """Write the steps (m,) of pairs (m, 2) into both lists; pairs not listed must be out of reach."""
    n = len(lists.counts)
    entries, owners = _entries(lists)
    others = lists.refs[entries].astype(np.int64) >> lists.steps.bits
    keys = owners * n + others
    order = np.argsort(keys)
    for i, j in (pairs.T, pairs.T[::-1]):
        if not len(i):
            return
        at = np.searchsorted(keys, i * n + j, sorter=order)
        found = order[np.minimum(at, len(order) - 1)] if len(order) else at
        if not len(order) or (keys[found] != i * n + j).any():
            raise CaromError(
                "A pair on a step is in no list of neighbors: the checkpoint that the run comes from was "
                "changed, or this is a fault of Carom; please report it."
            )
        lists.refs[entries[found]] = (j << lists.steps.bits | step_numbers).astype(np.uint32)
