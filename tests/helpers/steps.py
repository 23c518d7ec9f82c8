"""Events of steps of energy beside the oracle's."""

import numpy as np
import pytest

import carom
from carom.engine.pair_steps import read_steps
from helpers.naive.steps import NaiveSteps

KINDS = ("core", "in", "out", "bounce")


def assert_order(scene, potential, events, leaving=None, **settings):
    """The engine's events are the oracle's, of the same kinds, at the same times."""
    sim = carom.Simulation(scene, **settings)
    oracle = NaiveSteps(
        scene.positions, scene.velocities, scene.box, potential, leaving=leaving, masses=scene.masses,
        digits=30,
    )  # fmt: skip
    before = sim.interaction.events.sum(axis=0)
    for _ in range(events):
        sim.run(collisions=1)
        after = sim.interaction.events.sum(axis=0)
        expected = oracle.step()
        assert KINDS[int(np.argmax(after - before))] == expected.kind
        # Chaos multiplies rounding, 1e-16 at the start, by some 1.2 an event of ten components.
        assert abs(sim.time - float(expected.time)) < 1e-7 * (1.0 + sim.time)
        before = after
    pairs, steps = read_steps(sim._state.engine.neighbors)
    assert sim.potential_energy == pytest.approx(
        sum(float(potential(*pair)[1][level]) for pair, level in oracle.level.items()), abs=1e-12
    )
    assert len(steps) == len(pairs)
    sim.close()
