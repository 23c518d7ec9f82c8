"""Rare moments of the main cycle, constructed.

In plain Python, where the parts of the cycle can be called one by one, and nothing has to be compiled.
"""

import math

import numpy as np

import carom
from carom.engine import cycle
from carom.engine.calendar import bucket_of
from carom.engine.constants import LAMBDA
from carom.engine.events import predict
from carom.engine.search import NO_REF
from helpers.oracle_scenes import moving

ONE = np.int64(1)
FAR = np.int64(2**62)


def hair():
    """A place a hair below the upper face, whose quotient by the edge is rounded up to one."""
    found = 0
    for edge in np.random.default_rng(1).uniform(1.5, 9.0, 400):
        x = math.nextafter(edge, 0.0)
        if x * (1.0 / edge) < 1.0:
            continue
        found += 1
        for velocity in (0.0, 1.0):
            scene = carom.Scene([[x]], (edge,), velocities=[[velocity]])
            place = carom.Simulation(scene, seed=0).frame().positions[0, 0]
            assert 0.0 <= place < edge, (edge, place)
        if found == 5:
            return found
    raise AssertionError("no edge of the kind was found")


def met():
    """Two that have just met, and by rounding overlap and approach still, do not meet again now."""
    scene = carom.Scene([[2.0, 2.0], [3.1, 2.0]], (9.0, 9.0), velocities=[[0.1, 0.0], [-0.1, 0.0]])
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"), seed=0)
    model, state, neighbors, calendar, tallies, *_ = sim._state.engine
    word = np.int64(state.partner[0])
    assert word >= 0
    state.rows["x"][1, 0] = 3.0 - 1e-15
    times = []
    for just_met in (NO_REF, word):
        state.rows["event_time"][:2], state.partner[:2] = np.inf, LAMBDA
        predict(model, state, neighbors, calendar, tallies[0], 0, 0.0, just_met, (word, 0.0))
        times.append((float(state.rows["event_time"][0]), int(state.partner[0])))
    assert times[0] == (0.0, word)
    assert times[1][0] > 1.0, "only through the box, in another image"
    return len(times)


def entered(calendar, times):
    """Return whom the calendar will find at their times: on its heap, or in a bucket still to come."""
    control, size = calendar.control[0], calendar.buckets.shape[1] - 2
    waiting = zip(calendar.component[: control.waiting], calendar.event_time, strict=False)
    found = {int(i) for i, event_time in waiting if event_time == times[i]}
    for k in range(max(int(control.cursor) + 1, 0), len(calendar.buckets) - 1):
        bucket = calendar.buckets[k]
        there, link = bucket[2 : 2 + bucket[0]].tolist(), int(bucket[1])
        while link:
            there += calendar.lines[link, 2 : 2 + size].tolist()
            link = int(calendar.lines[link, 1])
        found.update(i for i in there if times[i] < control.end and bucket_of(calendar, times[i]) <= k)
    return found


def left():
    """Who loses a partner, because that one changed sector and found another, keeps its time, and is entered
    into the calendar at it.
    """
    lost = 0
    # In the second, somebody was entered by nobody else (once in some thousand events).
    for n, eta, seed in ((7, 0.3, 0), (8, 0.4, 11)):
        scene = carom.Scene.random(n, eta, 2, seed=seed)
        sim = carom.Simulation(moving(scene, seed), tuning=carom.Tuning(neighbors="sectors"), seed=0)
        model, state, _, calendar, *_ = sim._state.engine
        event_time, leave, partner = state.rows["event_time"][: scene.n], state.crossing_time, state.partner
        for _ in range(190):
            before, expected, left_at = partner.copy(), event_time.copy(), leave.copy()
            transits = sim.statistics.transits
            cycle.run(*sim._state.engine, FAR, 0.0, FAR, ONE)
            times = np.minimum(event_time, leave)
            known = entered(calendar, times)
            for i in np.flatnonzero(times < calendar.control[0].end):
                mate = partner[i] >> model.boundary.bits if partner[i] >= 0 else i
                assert i in known or (mate in known and event_time[i] <= leave[i])
            if sim.statistics.transits > transits:
                alone = (before >= 0) & (partner == LAMBDA) & (leave == left_at)
                np.testing.assert_array_equal(event_time[alone], expected[alone])
                lost += int(alone.sum())
    assert lost > 5, "too few such moments"
    return lost


def epochs():
    """The next event of everybody is as far away after the beginning of an epoch as before."""
    scene = moving(carom.Scene.random(9, 0.1, 2, seed=1), 2)
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"), seed=0)
    state, n, length = sim._state.engine.state, scene.n, sim._state.epoch_length
    begun = 0
    for _ in range(400):
        event_time, leave, epoch = (
            state.rows["event_time"][:n].copy(),
            state.crossing_time.copy(),
            int(state.clock[0].epoch),
        )
        events = sim.collisions + sim.statistics.transits + sim.statistics.advancements
        cycle.run(*sim._state.engine, FAR, 0.0, FAR, ONE)
        if state.clock[0].epoch > epoch:
            begun += 1
            after = sim.collisions + sim.statistics.transits + sim.statistics.advancements
            assert after == events  # an epoch is a cycle
            # Whoever is left alone looks for another a little earlier.
            assert (state.rows["event_time"][:n] + length == event_time).sum() >= n - 3
            assert (state.crossing_time + length == leave).sum() >= n - 2
    assert begun >= 2, begun
    return begun


CASES = {case.__name__: case for case in (hair, met, left, epochs)}
