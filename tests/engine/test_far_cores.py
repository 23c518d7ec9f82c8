"""Hard cores that are small beside the reach of the steps around them: found from far away, never lost."""

import math

import numpy as np
import pytest
from helpers.marks import slow
from helpers.steps import assert_order

import carom
from carom.models import SquareWell, Steps, StepTable


def graze(width, aside):
    """One component flies into a wall and back, past a second at a distance ``aside``, and towards a third.

    All are in each other's wells all the time, of no depth. The others rest, so that they look for nobody
    after the start: only the first finds whom it meets.
    """
    edge, far = 2.6 * width, 4.0
    y = 0.5 * edge
    scene = carom.Scene(
        [[far, y], [far + 0.25 * width, y + aside], [far + 0.5 * width, y]], edge,
        velocities=[[-1.0, 0.0], [0.0, 0.0], [0.0, 0.0]], interaction=SquareWell(width, 0.0), walls=True,
    )  # fmt: skip
    sim = carom.Simulation(scene, seed=0)
    assert sim.explain().models["timing"] == "FarSteps"
    sim.run(time=2.0 * (far - 0.5) + 0.75 * width)
    return sim


def apart(n, d, edge, core, seed):
    """Places further apart than a core."""
    rng, x = np.random.default_rng(seed), np.empty((0, d))
    while len(x) < n:
        new = rng.uniform(0.0, edge, d)
        r = x - new - edge * np.rint((x - new) / edge)
        if (np.linalg.norm(r, axis=1) > core).all():
            x = np.vstack([x, new])
    return x, rng.normal(size=(n, d))


def wide_mixture(d, seed, n=7):
    """Return a scene of two or three species whose steps reach 5 to 60 times the smallest core, and its
    potential: every pair of species has a core and steps of its own.
    """
    rng = np.random.default_rng(seed)
    kinds, width = int(rng.integers(2, 4)), math.exp(rng.uniform(math.log(5.0), math.log(60.0)))
    cores = np.exp(rng.uniform(0.0, math.log(4.0), kinds))
    cores[0] = 1.0
    table = [[None] * kinds for _ in range(kinds)]
    for a in range(kinds):
        for b in range(a, kinds):
            core = cores[a] if a == b else 0.5 * (cores[a] + cores[b]) * rng.uniform(0.8, 1.0)
            reach = width if a == b == 0 else rng.uniform(1.2 * core, width)
            ends = np.sort([*rng.uniform(1.05 * core, reach, rng.integers(0, 3)), reach]).tolist()
            steps = Steps([core, *ends], [math.inf, *rng.normal(size=len(ends)).tolist()])
            table[a][b] = table[b][a] = steps
    species = np.append(np.arange(kinds), rng.integers(0, kinds, n - kinds))
    edge = max(2.3 * width + 6.0, 3.0 * n * cores.max() if d == 1 else 0.0)
    x = np.empty((0, d))
    while len(x) < n:
        new = rng.uniform(0.0, edge, d)
        r = np.linalg.norm(x - new - edge * np.rint((x - new) / edge), axis=1)
        if all(r[j] > 1.001 * table[species[j]][species[len(x)]].core for j in range(len(x))):
            x = np.vstack([x, new])
    scene = carom.Scene(
        x, edge, velocities=rng.normal(size=(n, d)), mass=np.exp(rng.normal(size=n)), species=species,
        interaction=StepTable(table),
    )  # fmt: skip

    def potential(i, j):
        steps = table[species[i]][species[j]]
        return steps.distances, [*steps.energies, 0.0]

    return scene, potential


def assert_order_of_wide_mixtures(*seeds):
    for seed in seeds:
        for d in (1, 2):
            assert_order(*wide_mixture(d, 100 * d + seed), 60)


def test_a_graze_of_a_small_core_in_a_wide_well_hides_nobody_behind_it(plain):
    for width in (20.0, 40.0, 200.0):
        # Grazes that rounding takes for a contact from far away and for a miss from nearby, and clear ones.
        for aside in (1.0 - 2e-14, 1.0, 1.0 + 2e-14, 1.0 - 1e-12, 1.0 + 1e-12, 1.0 + 1e-9):
            sim = graze(width, aside)
            x = sim.frame().positions[:, 0]
            assert x[0] < x[2], (width, aside)
            assert 1 <= sim.interaction.core <= 2
            # A part of 1e-13 of a diameter is what positions in a box of 520 diameters are rounded by.
            assert sim.statistics.worst_overlap < 2e-13


def test_events_of_wide_steps_are_those_of_the_naive_algorithm(plain):
    for d, edge, distances, energies in (
        (2, 14.0, [1.0, 5.0], [math.inf, -0.5]),
        (1, 150.0, [1.0, 60.0], [math.inf, -0.5]),
        (1, 104.0, [0.01, 0.3, 1.0, 7.0, 40.0], [math.inf, -2.0, 1.0, -0.5, 0.2]),
        (2, 104.0, [0.01, 0.3, 1.0, 7.0, 40.0], [math.inf, -2.0, 1.0, -0.5, 0.2]),
    ):
        x, v = apart(8, d, edge, distances[0], seed=d)
        interaction = StepTable(Steps(distances, energies))
        scene = carom.Scene(x, edge, velocities=v, diameter=distances[0], interaction=interaction)
        assert_order(scene, lambda i, j, r=distances, e=energies: (r, [*e, 0.0]), 50)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("seed", [5, *map(slow, range(4))])
def test_events_of_mixtures_with_wide_steps_are_those_of_the_naive_algorithm(seed):
    assert_order_of_wide_mixtures(seed)


@pytest.mark.slow
def test_a_core_in_a_wide_well_is_met_in_compiled_code():
    sim = graze(40.0, 1.0)
    x = sim.frame().positions[:, 0]
    assert x[0] < x[2]
