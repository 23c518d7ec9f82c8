"""What slabs and blocks would give on many cores: a run is replayed by the rules that several workers follow.

    python tests/benchmarks/parts.py 2 0.70 1e6 585        # dimension, packing fraction, n, ns a collision
    python tests/benchmarks/parts.py 3 0.30 1e6 1150       # in space there are blocks along three axes, too
    python tests/benchmarks/parts.py 3 0.30 1e6 1150 --check    # slabs under the conditions of the tables

Rates are over one worker's, with a lock for each border, as it is, and with one for each patch; then the
parts of all workers' time that is spent waiting, and of events in zones. A worker's own events come in order.
One in a zone waits until each neighbor is less than eight buckets behind and done with what is earlier in the
patches around, and until nobody holds the border. A worker says how far it is once a bucket, and whenever it
waits. Windows that are run again, unread messages and lost cores are left out. Each row is printed twice:
with the share of memory that the table of 16 processors shows, and as if memory had no limit (1.0).
"""

import argparse
import itertools
import math
import tempfile
from pathlib import Path

import numpy as np
from numba import njit
from workers import scene_of

import carom
from carom.engine.calendar import FEWEST, LARGE_SYSTEM_FACTOR, MOST
from carom.engine.domains.decomposition import interaction_range
from carom.engine.neighbors.prefetch import HUGE
from carom.io.events import read_events
from carom.simulation.files.recorder import Recorder
from carom.simulation.workers.executive import MANY, TIME_WINDOW

COUNTS = "collisions", "advancements", "transits"
LOGGED, MOST_LOGGED = 300_000, 1_000_000  # collisions that are replayed, and particles, at most
HAND_OVER, ASK = 200.0, 100.0  # what an event in a zone costs in addition, and asking once more [ns]
ADDING_UP = 6.5  # of one collision, by one worker for all [ns]; in the tables 3.1 for each worker
SHARE = {2: 1.3, 4: 1.45, 8: 1.5, 16: 1.7, 64: 1.7}
"""How much slower events are beside others, as the table of disks at 0.40 has it; 64 as 16, a guess. The time
of a hand-over is that with which two workers are as slow as measured with 30 000 spheres.
"""
SHAPES = {
    2: ((2, 1), (8, 1), (4, 2), (16, 1), (4, 4), (64, 1), (8, 8)),
    3: ((2, 1, 1), (8, 1, 1), (4, 2, 1), (2, 2, 2), (16, 1, 1), (4, 4, 1), (4, 2, 2), (8, 8, 1), (4, 4, 4)),
}


def recorded(dimension, packing_fraction, n):
    """Return events' times (0 to 1) and pairs, places and reaches in boxes, and events a collision."""
    sim = carom.Simulation(scene_of(dimension, packing_fraction, n), seed=3)
    sim.run(collisions_per_particle=max(8.0, 2e6 / n))
    places, n, tally = sim.frame().positions / sim.scene.box % 1.0, sim.scene.n, sim._state.engine.tallies[0]
    before = [int(tally[name]) for name in COUNTS]
    with tempfile.TemporaryDirectory() as folder:
        sim._state.begin_log(Recorder(Path(folder, "log.h5"), sim._state))
        sim.run(collisions_per_particle=2.0 * LOGGED / n)
        sim.close()
        log = read_events(Path(folder, "log.h5"))
    after = [int(sim._state.engine.tallies[0][name]) for name in COUNTS]
    collisions, *others = (now - then for now, then in zip(after, before, strict=True))
    # Searches and renewals of lists are where and when collisions are, drawn at random.
    pairs, rng = np.stack([log.i, log.j], 1), np.random.default_rng(1)
    alone = rng.integers(len(pairs), size=len(pairs) * sum(others) // collisions)
    when = np.concatenate([np.linspace(0.0, 1.0, len(pairs)), rng.random(len(alone))])
    pairs = np.concatenate([rng.permuted(pairs, axis=1), np.repeat(pairs[alone, :1], 2, axis=1)])
    order = np.argsort(when)
    ranges = [interaction_range(sim._state.engine.neighbors, axis) for axis in range(dimension)]
    reaches = [[getattr(r, k) / r.layers for r in ranges] for k in ("zone", "pair", "conflict_range")]
    return when[order], pairs[order], places, np.array(reaches), len(when) / len(log.i)


@njit
def place(at, step, sizes):
    """Return the number of what is a step away, in a periodic grid."""
    k = 0
    for a in range(len(sizes)):
        k = k * sizes[a] + (at[a] + step[a]) % sizes[a]
    return k


@njit
def requirements(when, pairs, places, steps, shape, depth, reach, patches, lead):
    """Return the part of each event, and whom it waits for: first place, part and border, until when."""
    d, total, here = places.shape[1], len(when), len(steps) // 2
    first, owner = np.zeros(total + 1, np.int64), np.empty(total, np.int64)
    parts, needs, count = np.empty((26 * total, 2), np.int64), np.empty(26 * total), 0
    last = np.full((np.prod(patches), np.prod(shape)), -1.0)
    touched, at, part = np.ones((d, 3), np.bool_), np.empty(d, np.int64), np.empty(d, np.int64)
    for e in range(total):
        near = False
        for a in range(d):
            x = places[pairs[e, 0], a]
            gap = places[pairs[e, 1], a] - x
            gap -= np.rint(gap)
            part[a], at[a] = int(x * shape[a]), int(x * patches[a])
            low, high = x - part[a] / shape[a], (part[a] + 1) / shape[a] - x
            touched[a, 0] = shape[a] > 1 and min(low, low + gap) < depth[a]
            touched[a, 2] = shape[a] > 1 and min(high, high - gap) < depth[a]
            near = near or (shape[a] > 1 and min(low, high) < reach[a])
        mine = owner[e] = place(part, steps[here], shape)
        for k in range(len(steps)):
            inside, other = True, place(part, steps[k], shape)
            for a in range(d):
                inside = inside and touched[a, steps[k, a] + 1]
            if inside and other != mine:
                need = when[e] - lead
                for step in steps:
                    need = max(need, last[place(at, step, patches), other])
                border = mine * len(steps) + k if k > here else other * len(steps) + 2 * here - k
                parts[count], needs[count] = (other, border), need
                count += 1
        first[e + 1] = count
        if near:
            last[place(at, steps[here], patches), mine] = when[e]
    return owner, first, parts[:count], needs[:count]


@njit
def replay(when, queues, starts, first, parts, needs, costs, width, hand_over, ask, locked):
    """Return the makespan, and the parts of all workers' time and of events: waiting, and in zones."""
    workers, heads = len(starts) - 1, starts[:-1].copy()
    clock, said, waits = np.zeros(workers), np.zeros(workers), np.zeros(workers, np.bool_)
    free, span, waited, zones = np.zeros(27 * workers), 0.0, 0.0, 0  # free: from when on a border's lock is
    for _ in range(2**62):
        w = np.argmin(clock)
        if clock[w] == np.inf:
            break
        e = queues[heads[w]]
        if waits[w] or said[w] // width != when[e] // width:
            said[w] = when[e]
        waits[w] = False
        for k in range(first[e], first[e + 1]):
            held = locked and free[parts[k, 1]] > clock[w]
            waits[w] = waits[w] or held or said[parts[k, 0]] <= needs[k]
        if waits[w]:
            waited, clock[w] = waited + ask, clock[w] + ask
            continue
        zone = first[e + 1] > first[e]
        clock[w] += costs[e] + hand_over * zone
        for k in range(first[e], first[e + 1]):
            free[parts[k, 1]] = clock[w]
        heads[w], zones = heads[w] + 1, zones + zone
        if heads[w] == starts[w + 1]:
            span, clock[w], said[w] = max(span, clock[w]), np.inf, np.inf
    return span, waited / (workers * span), zones / len(when)


def speed(system, shape, n, cost, share, adding_up, locked):
    """Return the rate over one worker's, and the parts: of time that is waited, of events in zones."""
    when, pairs, places, (depth, pair, conflict), events = system
    workers, shape = math.prod(shape), np.array(shape)
    if np.any((shape > 1) & (depth * shape > 1.0)):
        return "no room"
    patches = np.clip((1.0 / conflict).astype(np.int64), 1, 256 if len(shape) == 2 else 16)
    width = (LARGE_SYSTEM_FACTOR if n >= HUGE else 1.0) * math.sqrt(FEWEST * MOST) * workers / len(when)
    lead = TIME_WINDOW * min(1.0, n / MANY) * width
    costs = cost / events * (0.5 + 0.5 * np.random.default_rng(2).exponential(size=len(when)))
    steps = np.array(list(itertools.product((-1, 0, 1), repeat=len(shape))))
    owner, *waits = requirements(when, pairs, places, steps, shape, depth, depth + pair, patches, lead)
    queues, starts = np.argsort(owner, kind="stable"), np.searchsorted(np.sort(owner), np.arange(workers + 1))
    rules = costs * share, width, HAND_OVER, ASK, locked
    span, waiting, zones = replay(when, queues, starts, *waits, *rules)
    rate = costs.sum() / (span + adding_up * len(when) / events)
    return f"{rate:.2f} (waits {waiting:.2f}, zones {zones:.2f})"


def main():
    """Print a row for each shape of the parts."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("numbers", type=float, nargs=4, metavar="d, packing fraction, n, ns")
    parser.add_argument("--check", action="store_true", help="slabs under the conditions of the tables")
    given = parser.parse_args()
    dimension, packing_fraction, n, cost = given.numbers
    *system, reaches, events = recorded(int(dimension), packing_fraction, int(min(n, MOST_LOGGED)))
    # In a larger box the same things reach less far: events of a million stand for those of more.
    system += reaches * max(n / MOST_LOGGED, 1.0) ** (-1.0 / dimension), events
    if given.check:
        for workers, share in ((2, 1.03), *SHARE.items()):
            shape = (workers,) + (1,) * (int(dimension) - 1)
            print(workers, share, speed(system, shape, n, cost, share, 3.1 * workers, True), flush=True)
        return
    for shape in SHAPES[int(dimension)]:
        for share in (SHARE[math.prod(shape)], 1.0):
            rates = [speed(system, shape, n, cost, share, ADDING_UP, locked) for locked in (True, False)]
            print(*shape, f"share {share}: borders {rates[0]}; patches {rates[1]}", flush=True)


if __name__ == "__main__":
    main()
