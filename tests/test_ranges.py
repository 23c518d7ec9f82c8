"""Range rules: counters, rules, timers, removal; against counting, the naive algorithm, replay and resume."""

import math

import numpy as np
import pytest

import carom
from carom.io.events import read_events
from carom.ranges import CHANGED, ENTERED, LEFT, TIMER, Kind, Ranges, draw
from carom.reference.rules import NaiveRules
from carom.simulation.replay import Replay

CIRCLES = ((2.0, 3.0), (2.5,))
TIMERS = (0.5, 0.0)
MEMORY = ((1.0, 2.0), (0.0, 0.0))


def turn(unit):
    """A random direction in the plane of the first axis and the others' diagonal."""
    angle = 2.0 * math.pi * draw(unit)
    for axis in range(len(unit.velocity)):
        unit.velocity[axis] = math.cos(angle) if axis == 0 else math.sin(angle)


def restless(unit, event):
    """Does everything that a rule can do."""
    unit.memory[0] += event.distance
    unit.memory[1] += event.time
    if event.cause == ENTERED and unit.counts[0, 1] > 2:
        unit.target = event.other
        turn(unit)
    if event.cause == LEFT and draw(unit) < 0.1:
        unit.kind = 1 - unit.kind
    if event.cause == TIMER:
        turn(unit)
        unit.timer = 0.3 + draw(unit)
        if event.other >= 0:
            for axis in range(len(unit.velocity)):
                unit.velocity[axis] = event.toward[axis] / event.distance
    if event.cause == CHANGED and draw(unit) < 0.1:
        unit.removed = True


def ranges(rule=restless, **more):
    names = zip(("hawk", "dove"), CIRCLES, TIMERS, MEMORY, strict=True)
    return Ranges([Kind(*each) for each in names], rule, **more)


def scattered(n=40, d=2, edge=11.0, seed=1, **more):
    rng = np.random.default_rng(seed)
    return carom.Scene(
        rng.uniform(0.0, edge, (n, d)),
        (edge,) * d,
        velocities=rng.normal(size=(n, d)),
        species=np.arange(n) % 2,
        diameter=0.1,
        interaction=ranges(),
        **more,
    )


def assert_counters(sim):
    """Every counter is what the distances of a frame say."""
    scene, x, units = sim.scene, sim.frame().positions, sim.units
    r = x[None] - x[:, None]
    r -= np.array(scene.box) * np.rint(r / np.array(scene.box)) * np.array(scene.periodic)
    apart = np.sqrt((r**2).sum(axis=-1))
    np.fill_diagonal(apart, np.inf)
    for i in range(scene.n):
        for c in range(units.counts.shape[1]):
            radii = CIRCLES[units.kinds[i]]
            seen = units.present & units.present[i] & (apart[i] < (radii[c] if c < len(radii) else 0.0))
            expected = np.bincount(units.kinds[seen], minlength=2)
            assert (units.counts[i, c] == expected).all()


STRETCHES = np.random.default_rng(2).exponential(0.15, 24).tolist()


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run with a log, looked at on the way and saved in the middle."""
    folder = tmp_path_factory.mktemp("ranges")
    sim = carom.Simulation(scattered(), event_log=folder / "log.h5")
    for k, time in enumerate(STRETCHES):
        if k == 12:
            sim.save(folder / "checkpoint.h5")
        sim.run(time=time)
        assert_counters(sim)
    sim.machine.flush_log()
    return sim, folder


def test_counters_are_what_distances_say_at_any_time(run):
    sim, _ = run
    # Not an empty truth: everything that can happen has happened often, and some are left.
    assert min(sim.units.asked.values()) > 20
    assert 0 < sim.units.present.sum() < sim.scene.n
    assert (np.bincount(sim.units.kinds) > 3).all()


def test_a_replay_asks_the_rules_again_bit_for_bit(run):
    sim, folder = run
    again = Replay(folder / "log.h5", interaction=ranges())
    again.advance_to(sim.time)
    for name in ("positions", "velocities"):
        assert (getattr(again.frame(), name) == getattr(sim.frame(), name)).all()


def test_a_checkpoint_goes_on_bit_for_bit(run, tmp_path):
    sim, folder = run
    log = tmp_path / "log.h5"
    log.write_bytes((folder / "log.h5").read_bytes())  # what it holds beyond the checkpoint is dropped
    half = carom.Simulation.load(folder / "checkpoint.h5", interaction=ranges(), event_log=log)
    for time in STRETCHES[12:]:
        half.run(time=time)
    for name in ("positions", "velocities"):
        assert (getattr(half.frame(), name) == getattr(sim.frame(), name)).all()
    for name in ("kinds", "present", "counts", "memory", "timers", "targets"):
        assert (getattr(half.units, name) == getattr(sim.units, name)).all()
    assert half.units.asked == sim.units.asked
    half.close()


def test_the_events_are_those_of_the_naive_algorithm(run, tmp_path):
    scene = scattered(n=12, edge=8.0, seed=3)
    oracle = NaiveRules(
        scene.positions.tolist(),
        scene.velocities.tolist(),
        scene.box,
        CIRCLES,
        scene.species.tolist(),
        restless,
        timers=TIMERS,
        memory=MEMORY,
        digits=40,
    )
    expected = [oracle.decide() for _ in range(300)]
    sim = carom.Simulation(scene, event_log=tmp_path / "log.h5")
    sim.run(time=float(oracle.time) * (1.0 + 1e-9))
    sim.close()
    log = read_events(tmp_path / "log.h5")
    units = [(i, j) if j < scene.n else (i,) for i, j in zip(log.i.tolist(), log.j.tolist(), strict=True)]
    assert units[:300] == [event.units for event in expected]
    times = log.epoch * sim.epoch_length + log.time
    # A rule that turns to a target magnifies rounding, 1e-16 at the start.
    assert times[:300] == pytest.approx([float(event.time) for event in expected], rel=1e-9)
    assert {event.cause for event in expected} == {ENTERED, LEFT, TIMER, CHANGED}
    for i, unit in enumerate(oracle.units):
        found = sim.units.counts[i]
        assert not unit.removed or (found == 0).all()
        assert {key: int(found[key]) for key in oracle.counts(i)} == oracle.counts(i)
