"""What must hold of lists, partners and times between any two events."""

import itertools

import numpy as np

from carom.engine import cycle
from carom.engine.boundary import SectorImage
from carom.engine.constants import NEEDS_NEIGHBORS
from carom.engine.neighbors.bounds import EqualBounds, list_range_sq, size_class, skin_at, start
from carom.engine.neighbors.grid import coordinate_bits


def present(sim):
    """Return positions and velocities of all at the clock of the last event, not wrapped."""
    state, n = sim._state.engine.state, sim.scene.n
    rows, now = state.rows[:n], state.clock[0].now
    return rows["x"] + rows["v"] * (now - rows["t"])[:, None], rows["v"].copy(), float(now)


def go(sim, cycles):
    """Process so many cycles of the kernel, whatever they are; a list that is full is no news."""
    code, _ = cycle.run(*sim._state.engine, np.int64(2**62), 0.0, np.int64(2**62), np.int64(cycles))
    if code == NEEDS_NEIGHBORS:
        sim._state.enlarge_neighbors()
        sim._state.schedule()
    return code


def lists_of(sim):
    lists, n = sim._state.engine.neighbors, sim.scene.n
    begins = [int(start(lists.bounds, np.uint64(i))) for i in range(n)]
    return [
        set(lists.refs[begin : begin + count].tolist())
        for begin, count in zip(begins, lists.counts, strict=True)
    ]


def check_lists(sim):
    """Lists are symmetric, hold just who is within reach, and nobody is beyond the margin."""
    lists, n = sim._state.engine.neighbors, sim.scene.n
    size = coordinate_bits(sim.scene.dimension)
    edges = np.array(lists.grid_step) * 2.0**size  # those of the box; stretched between walls
    listed = lists_of(sim)
    assert all(len(row) == count for row, count in zip(listed, lists.counts, strict=True)), "no one twice"
    axes = np.arange(sim.scene.dimension, dtype=np.uint64)
    steps = lists.reference[:, None] >> (np.uint64(size) * axes) & np.uint64(2**size - 1)
    reference = steps * np.array(lists.grid_step)
    r = reference[:, None] - reference
    r -= edges * np.rint(r / edges)
    near = (r**2).sum(axis=2)
    reach = np.array([[list_range_sq(lists.bounds, i, j) for j in range(n)] for i in range(n)])
    # Rounding of one distance against another's may decide on the edge of the reach alone.
    sure, maybe = near < reach * (1 - 1e-9), near < reach * (1 + 1e-9)
    for i in range(n):
        assert set(np.flatnonzero(sure[i])) - {i} <= listed[i] <= set(np.flatnonzero(maybe[i])) - {i}
    x = present(sim)[0] - reference
    x -= edges * np.rint(x / edges)
    _, v, now = present(sim)
    hair = 1e-9 * np.sqrt(reach.max())
    if isinstance(lists.bounds, EqualBounds):
        # From the scene and what was asked for: a diameter and twice the margin are the reach.
        free = np.full(n, 0.5 * (sim._state.scheme.list_range - sim.scene.diameter))
        np.testing.assert_allclose(reach, sim._state.scheme.list_range**2, rtol=1e-15)
    else:
        free = np.array([skin_at(lists.bounds, i, now)[0] for i in range(n)])
    assert (np.sqrt((x**2).sum(axis=1)) <= free + hair).all()
    if sim._state.system.rates is None:
        # Two who are not listed cannot touch before one of them leaves, and each is there until it leaves.
        scene = sim.scene
        contact = 0.5 * (scene.diameters[:, None] + scene.diameters)
        if scene.contact is not None:
            contact = scene.contact[scene.species[:, None], scene.species]
        assert (contact + free[:, None] + free <= np.sqrt(reach) + hair).all()
        ahead = x + v * (sim._state.engine.state.crossing_time - now)[:, None]
        assert (np.sqrt((ahead**2).sum(axis=1)) <= free + hair).all()
    grid = lists.grid
    for cell in range(len(lists.members)):
        for k in range(lists.members[cell]):
            i = lists.cells[cell, k]
            own = int(size_class(lists.bounds, np.uint64(i)))
            place = np.floor(reference[i] / edges * grid.shape[own]).astype(int)
            assert grid.base[own] + np.ravel_multi_index(place, grid.shape[own]) == cell
    assert lists.members.sum() == n


def all_meetings(sim):
    """Return the time until each pair meets, if left alone, under the earliest of all images, (n, n)."""
    x, v, _ = present(sim)
    n, d = x.shape
    edges = np.array(sim.scene.box)
    sigma = 0.5 * (sim.scene.diameters[:, None] + sim.scene.diameters)
    first = np.full((n, n), np.inf)
    u = v[None] - v[:, None]
    uu = (u**2).sum(axis=2)
    reach = 3 if n < 8 else 1
    for image in itertools.product(range(-reach, reach + 1), repeat=d):
        r = x[None] - x[:, None]
        r -= edges * np.rint(r / edges)
        r = r + edges * np.array(image)
        ru, c = (r * u).sum(axis=2), (r**2).sum(axis=2) - sigma**2
        disc = ru**2 - uu * c
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where((ru < 0) & (disc >= 0), c / (np.sqrt(np.maximum(disc, 0)) - ru), np.inf)
        first = np.minimum(first, np.maximum(t, 0.0))
    np.fill_diagonal(first, np.inf)
    return first


def check_invariants(sim):
    """The paper's (13) to (16) on the live arrays: past before future, mutual partners, nobody overlooked."""
    state, n = sim._state.engine.state, sim.scene.n
    rows = state.rows[:n]
    now = float(state.clock[0].now)
    event_time, leave, partner = rows["event_time"], state.crossing_time, state.partner
    bits = (
        sim._state.engine.model.boundary.bits
        if isinstance(sim._state.engine.model.boundary, SectorImage)
        else 0
    )
    assert rows["t"].max() <= now  # (13)
    assert now <= min(event_time.min(), leave.min())
    assert state.rows[n]["event_time"] == -np.inf
    mates = np.where(partner >= 0, partner >> bits, -1)
    for i in range(n):  # (15)
        assert mates[i] != i
        if mates[i] >= 0:
            assert mates[mates[i]] == i
            assert event_time[mates[i]] == event_time[i]
    # (14) Nobody has an event later than a meeting for which the other is free, except one that lies beyond
    # the leaving of a sector by either: that is looked at then. Times are compared up to rounding.
    meeting = now + all_meetings(sim)
    slack = 1e-9 * sim._state.epoch_length
    bound = np.minimum(leave[:, None], leave[None])
    overlooked = (
        (meeting < event_time[:, None] - slack)
        & (meeting <= event_time[None] - slack)
        & (meeting < bound - slack)
    )
    assert not overlooked.any(), np.argwhere(overlooked)
