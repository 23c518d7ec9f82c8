"""Error bars are right: over many short runs of systems whose Z is known, intervals hold it as often as said.

All 200 runs of each: ``pytest -m slow -s tests/observables/test_coverage.py``.
"""

import functools
import json
from pathlib import Path

import pytest
from scipy.stats import binom

import carom
from carom.observables.statistics import Estimate
from carom.simulation.measuring import stretches

TORUS = json.loads((Path(__file__).parents[1] / "data" / "few_body_exact.json").read_text())["torus_N2"]

CHANCE = 1e-4
"""Probability with which a true coverage falls below, or above, the limits."""

LEVELS = (0.68, 0.95)

LONG = 4_000_000
"""Collisions of the fluid's long run: its Z is known 60 times better than by a short one."""


def torus(number):
    """Two spheres in a periodic box: exact (few_body_exact.json)."""
    row = TORUS[number]
    d, edge = row["d"], row["L"]
    scene = carom.Scene([[0.0] * d, [edge / 2] * d], edge, diameter=row["sigma"])
    return lambda seed: scene, row["Z_canonical"]


def tonks():
    """Rods on a line, exact for every N: Z = 1/N + (N-1)/N / (1 - rho).

    There are many, because their motion is periodic: a pair meets once a period, and the variance of the
    virial lacks the share 2.4 C / N after C collisions a rod (2.4 = <v^4> / <|v|^3> <|v|> for normal relative
    velocities), which no short run can know of. Intervals of few rods hold the truth too often; here the
    share is 4 %.
    """
    n, rho = 4000, 0.5
    return lambda seed: carom.Scene.random(n, dimension=1, density=rho, seed=seed), 1 / n + (n - 1) / n / (
        1 - rho
    )


@functools.cache
def fluid():
    """Spheres at packing fraction 0.3, against a long run."""
    scene = carom.Scene.crystal(cells=3, packing_fraction=0.3)
    sim = carom.Simulation(scene, seed=99)
    sim.run(collisions_per_particle=200)
    known = sim.measure(carom.Pressure(), collisions=LONG, blocks=1024).Z
    return lambda seed: scene, known.mean


SYSTEMS = {
    "two disks": functools.partial(torus, 1),
    "two spheres": functools.partial(torus, 5),
    "Tonks gas": tonks,
    "fluid": fluid,
}

REQUESTS = {
    "64 blocks": lambda sim: sim.measure(carom.Pressure(), collisions=1000, blocks=64),
    "until 3 %": lambda sim: sim.measure(carom.Pressure(), relative_error=0.03),
    "until 1 %": lambda sim: sim.measure(carom.Pressure(), relative_error=0.01),
}


def estimates(make, measure, runs):
    """Return Z of independent short runs."""
    found = []
    for seed in range(runs):
        sim = carom.Simulation(make(seed), seed=seed)
        if sim.scene.dimension > 1:  # random rods are in equilibrium
            sim.run(collisions_per_particle=100)
        # A run to a number of collisions ends with a collision; from there a mean would be biased.
        sim.run(time=0.1 * stretches.time_for(sim, 1000))
        found.append(measure(sim).Z)
    return found


def hits(found, exact, level):
    """Return how many intervals hold the exact value."""
    return sum(low <= exact <= high for low, high in (estimate.confidence(level) for estimate in found))


def limits(runs, level):
    """Return the fewest and the most hits to be expected."""
    return binom.ppf(CHANCE, runs, level), binom.ppf(1 - CHANCE, runs, level)


def check(found, exact):
    for level in LEVELS:
        fewest, most = limits(len(found), level)
        assert fewest <= hits(found, exact, level) <= most, f"{level:.0%} intervals"


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_intervals_of_short_runs_cover_the_exact_value_and_halved_ones_would_be_found_out():
    make, exact = SYSTEMS["two spheres"]()
    found = estimates(make, REQUESTS["64 blocks"], 100)
    check(found, exact)
    halved = [Estimate(e.mean, 0.5 * e.error, e.n_eff, e.tau, e.blocks) for e in found]
    for level in LEVELS:
        assert hits(halved, exact, level) < limits(100, level)[0]


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_intervals_of_runs_until_their_error_is_small_cover_the_exact_value():
    make, exact = SYSTEMS["two spheres"]()
    check(estimates(make, REQUESTS["until 3 %"], 40), exact)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("request_", REQUESTS)
@pytest.mark.parametrize("system", SYSTEMS)
def test_intervals_of_two_hundred_short_runs_cover_the_exact_value(system, request_):
    make, exact = SYSTEMS[system]()
    found = estimates(make, REQUESTS[request_], 200)
    shares = ", ".join(f"{hits(found, exact, level) / 2:.1f} % at {level:.0%}" for level in LEVELS)
    print(f"{system}, {request_}: {shares}")
    check(found, exact)
