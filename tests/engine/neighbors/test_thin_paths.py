"""Thin systems: no contact is lost by looking at paths in whole numbers of 16 bits first."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from carom.engine.neighbors import prefilter
from carom.engine.neighbors.all_pairs import make_everybody, pack_all, pack_self
from carom.engine.neighbors.prefilter import ALL, BLOCK, COARSE, ROUNDING, position_error_of
from carom.engine.state import make_state
from carom.models.motions.free_flight import Inertial

SPAN = 8.0
"""Time that a search covers: a power of two, so that the test's own times are exact."""

GRAZE = 1.0 - 1e-9
"""How near others come, in contact distances: by more than what float64 rounds in paths of many boxes."""


def marked(edges, core, now, span, positions, velocities):
    """Return who is marked by the search of component 0, positions being those at the beginning of the epoch,
    and the number that marks are compared with.
    """
    everybody = make_everybody(len(positions), edges, core, SPAN)
    state = make_state(positions, velocities, 1024.0, False, np.float64)
    pack_all(everybody, Inertial(), state)
    pack_self(everybody, 0)
    elapsed, covered = now / SPAN, span / SPAN
    near = prefilter.prefilter(everybody, elapsed, covered, position_error_of(everybody, elapsed, covered), 0)
    found, (lane, last) = [], prefilter.marked(everybody, 0, near)
    while lane < BLOCK:
        found.append(lane)
        after = lane + 1
        lane, same = prefilter.marked(everybody, after, near)
        assert same == (last if lane < BLOCK else after)
    return [lane for lane in found if lane < len(positions)], near


def aimed(edges, core, now, span, pace, drift, rng, n):
    """Return positions at the beginning of the epoch and velocities [length / time] of components that all
    come within a contact distance of an image of component 0 at some time from ``now`` to ``now + span``.
    """
    edges, dimension = np.array(edges), len(edges)
    # Some are slow, and some move along one axis.
    speeds = pace * edges.max() / SPAN * 10.0 ** rng.uniform(-6.0, 0.0, (n, 1))
    speeds[: n // 2] = pace * edges.max() / SPAN
    relative = rng.normal(size=(n, dimension)) * speeds * (rng.random((n, dimension)) < 0.8)
    relative[0] = 0.0
    own = drift * edges.max() / SPAN * rng.normal(size=dimension)
    ways = rng.normal(size=(n, dimension))
    ways *= GRAZE * core / np.linalg.norm(ways, axis=1)[:, None]
    times = now + span * rng.choice([0.0, 1.0, rng.random()], size=(n, 1))
    start = rng.random(dimension) * edges
    positions = start + ways - relative * times
    positions[0] = start
    return positions - np.floor(positions / edges) * edges, own + relative


@settings(max_examples=20, deadline=None)
@given(
    dimension=st.integers(2, 4),
    size=st.floats(3.0, 1e6),
    stretch=st.floats(1.0, 4.0),
    elapsed=st.floats(0.0, 8.0),
    covered=st.floats(1e-3, 1.0),
    pace=st.sampled_from([1e-3, 1.0, 5.0, 20.0]),
    drift=st.sampled_from([0.0, 1.0, 50.0]),
    seed=st.integers(0, 2**32 - 1),
)
def test_whoever_is_met_is_looked_at_closely(dimension, size, stretch, elapsed, covered, pace, drift, seed):
    rng = np.random.default_rng(seed)
    edges = (size * stretch, *[size] * (dimension - 1))
    n = 24
    now, span = elapsed * SPAN, covered * SPAN
    positions, velocities = aimed(edges, 1.0, now, span, pace, drift, rng, n)
    found, _ = marked(edges, 1.0, now, span, positions, velocities)
    assert found == list(range(n))


@pytest.mark.parametrize(("dimension", "size"), [(2, 1000.0), (3, 100.0)])
def test_few_others_are_looked_at_closely(dimension, size):
    rng = np.random.default_rng(dimension)
    edges = (size,) * dimension
    looked_at, others = 0, 0
    for _ in range(12):
        positions = rng.random((BLOCK, dimension)) * size
        velocities = rng.normal(size=(BLOCK, dimension)) * size / SPAN
        found, _ = marked(edges, 1.0, 0.0, SPAN, positions, velocities)
        looked_at += len(found) - 1
        others += BLOCK - 1
    # Up to nine planes, from group to group of four of them, for which a path stands: 12 at most. Near is
    # 2 sqrt(2) contact distances wide, and rounding adds 9 units on both sides.
    near = 2.0 * 2.0**0.5 / size + 2.0 * 9.0 / 2.0**16
    expected = others * 12 * near ** (dimension - 1)
    assert looked_at < expected + 6.0 * expected**0.5


def test_where_somebody_is_too_fast_for_16_bits_everybody_is_looked_at():
    rng = np.random.default_rng(3)
    positions, velocities = rng.random((9, 2)) * 100.0, rng.normal(size=(9, 2))
    velocities[4] = 100.0 / SPAN * COARSE / (32.0 * ROUNDING)
    found, near = marked((100.0, 100.0), 1.0, 0.0, SPAN, positions, velocities)
    assert near == ALL
    assert found == list(range(9))
