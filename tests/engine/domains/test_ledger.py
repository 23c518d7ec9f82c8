"""The collisions of two parts are added up in the order of time, to the last bit."""

import numpy as np
import pytest

import carom
from carom.engine.domains.event_log_merge import (
    find_order,
    lp_events_of,
    make_all_events,
    merge,
    order_tasks,
    put_in_order,
)
from carom.engine.observers.interface import NOBODY


def filled(counts, instants, seed):
    """Return a ledger with so many collisions of each part, at so many different times at most."""
    rng = np.random.default_rng(seed)
    all_events = make_all_events(len(counts), max(*counts, 1), False)
    who = rng.permutation(sum(counts)).astype(np.int32)
    for part, count in enumerate(counts):
        times = (
            np.sort(rng.integers(1, instants, count) / instants) if instants else np.sort(rng.random(count))
        )
        all_events.used[part, 0] = count
        all_events.entries[part, :count].time = times
        all_events.entries[part, :count].virial = rng.standard_normal(count)
        all_events.component[part, :count] = who[sum(counts[:part]) :][:count]
        begin = 0
        for end in np.flatnonzero(np.diff(times, append=np.inf)) + 1:  # as a part's own cycle notes them
            all_events.component[part, begin:end].sort()
            begin = end
    return all_events


@pytest.mark.parametrize("instants", [0, 500, 3])
@pytest.mark.parametrize(
    "counts",
    [
        (20_000, 20_000),
        (20_000, 3),
        (0, 9000),
        (1, 1),
        (0, 0, 0),
        (3000, 0, 4000),
        (500, 700, 600, 800, 0, 1, 900),
        (400,) * 16,
    ],
)
def test_virials_of_all_parts_are_added_in_the_order_of_time(unscheduled, counts, instants):
    engine = carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=1)._state.engine
    all_events, parts = filled(counts, instants, sum(counts)), len(counts)
    times, virials, who = (
        np.concatenate([table[part, : counts[part]] for part in range(parts)])
        for table in (all_events.entries.time, all_events.entries.virial, all_events.component)
    )
    total = 0.0
    for k in np.lexsort((who, times)):
        total += virials[k]
    engine.tallies.virial, engine.tallies.collisions = 0.0, 0
    heads = np.zeros(parts, np.int64)
    for task in order_tasks(all_events):
        find_order(*task)
    assert merge(all_events, heads, engine.state.clock, engine.tallies, NOBODY, None, engine.model.boundary)
    assert tuple(heads) == counts
    assert engine.tallies.collisions[0] == sum(counts)
    assert engine.tallies.virial[0] == total


def test_parts_share_the_work_of_finding_the_order():
    shares = [len(order) for _, _, _, order, *_ in order_tasks(filled((4000,) * 8, 0, seed=1))]
    assert sum(shares) == 32_000
    assert max(shares) < 1.1 * 4000  # as many of each, but for fluctuations of a few hundred


@pytest.mark.parametrize("detailed", [False, True])
def test_a_page_that_is_put_in_order_keeps_what_belongs_to_each_collision(detailed):
    rng = np.random.default_rng(1)
    all_events, count = make_all_events(2, 50, detailed), 40
    lp_events = lp_events_of(all_events, 1)
    lp_events.used[0] = count
    times = rng.permutation(count).astype(float)
    lp_events.entries.time[:count], lp_events.entries.virial[:count] = times, -times
    lp_events.component[:count] = times
    lp_events.component[count:] = 99
    if detailed:
        lp_events.details.ref[:count], lp_events.details.impulse[:count] = times, 2.0 * times
    put_in_order(lp_events)
    for column in (
        lp_events.entries.time,
        -lp_events.entries.virial,
        lp_events.component,
        all_events.component[1],
    ):
        assert (column[:count] == np.arange(count)).all()
    assert (lp_events.component[count:] == 99).all()
    if detailed:
        assert (lp_events.details.ref[:count] == np.arange(count)).all()
        assert (lp_events.details.impulse[:count] == 2.0 * np.arange(count)).all()
