"""Free flights: against the collision rate, the exact law of normal speeds, and by hand."""

import numpy as np
import pytest
from helpers.mixtures import mixture

import carom
from carom import theory
from carom.engine.observers.flights import Flights
from carom.engine.observers.interface import PairEvent
from carom.errors import InputError
from carom.models import Andersen, Ball, Gravity, Kind, Ranges
from carom.models.obstacles.with_properties import Thermal
from carom.observables.flights import FlightSums, flights_of
from carom.simulation.measuring import flying, stretches
from carom.simulation.run_state import RunState

FIVE = 5.0


@pytest.fixture(scope="module")
def found():
    scene = mixture([64, 64], diameters=[1.0, 0.6], masses=[1.0, 0.25], packing_fraction=0.3, seed=2)
    arrays = {"positions": scene.positions, "diameter": scene.diameters, "mass": scene.masses}
    # In the order of particles the second species comes first.
    scene = scene.replace(**{name: each[::-1] for name, each in arrays.items()}, species=scene.species[::-1])
    sim = carom.Simulation(scene, seed=3)
    sim.run(collisions_per_particle=100)
    before = sim.collisions_by_species
    time = sim.time
    result = sim.measure(carom.FreeFlights(), collisions_per_particle=1500, blocks=64)
    return sim, result, (sim.collisions_by_species - before) / (sim.time - time)


def test_free_times_and_collision_rates_are_inverse(found):
    _, result, _ = found
    for k in (0, 1):
        mean, rate = result.free_time[k].mean, result.collision_rate[k]
        assert mean.mean * rate == pytest.approx(1.0, rel=2e-3)  # but for flights cut off at the ends
        # A free path is not the mean speed times the mean free time: who is fast flies shorter times.
        speed = np.sqrt(8.0 / (np.pi * [1.0, 0.25][k]))
        assert 0.8 < result.free_path[k].mean.mean / (speed * mean.mean) < 1.05


def test_the_rates_are_those_that_the_run_counts(found):
    _, result, rates = found
    for k in (0, 1):
        right = (rates[k].sum() + rates[k, k]) / 64
        assert result.collision_rate[k] == pytest.approx(right, rel=1e-9)


def test_normal_speeds_have_the_exact_distribution(found):
    sim, result, _ = found
    masses = [1.0, 0.25]
    d = 3 * (sim.scene.n - 1)
    assert [*result.normal_speed] == [(0, 0), (0, 1), (1, 1)]
    for (a, b), speeds in result.normal_speed.items():
        mu = masses[a] * masses[b] / (masses[a] + masses[b])
        mean = np.sqrt(np.pi / (2.0 * mu)) * theory.speed_factor(d) ** -1
        # At constant energy <u> = <u^2> / <1 / u>-wise: the factor is 1 + 1 / (4 D) at most, 0.07 % here.
        assert speeds.mean.mean == pytest.approx(mean, rel=1e-3, abs=FIVE * speeds.mean.error)
        right = theory.normal_speed(speeds.middle, reduced_mass=mu)
        common = right > 0.05 * right.max()
        deviations = (speeds.density - right)[common] / speeds.error[common]
        # So many independent deviations have a mean square of 1, give or take sqrt(2 / count).
        assert np.mean(deviations**2) == pytest.approx(1.0, abs=FIVE * np.sqrt(2.0 / common.sum()) + 0.2)


def test_densities_are_normalized(found):
    _, result, _ = found
    for each in (*result.free_time, *result.free_path, *result.normal_speed.values()):
        whole = np.sum(each.density * np.diff(each.edges))
        assert whole == pytest.approx(1.0, abs=2e-3)  # what is beyond the last edge


def test_the_return_probability_is_counted_by_hand(found, tmp_path):
    sim, result, _ = found
    sim.save(tmp_path / "run.h5")
    twin = carom.Simulation.load(tmp_path / "run.h5")
    collisions = 1500
    estimate = sim.measure(carom.FreeFlights(), time=stretches.time_for(sim, collisions), blocks=8)
    before, last, seen, back = twin.frame().velocities, {}, np.zeros(2), np.zeros(2)
    while twin.collisions < sim.collisions:
        twin.run(collisions=1)
        after = twin.frame().velocities
        i, j = np.flatnonzero((after != before).any(axis=1)).tolist()
        for one, other in ((i, j), (j, i)):
            kind = int(twin.scene.species[one])
            seen[kind] += one in last
            back[kind] += last.get(one) == other
            last[one] = other
        before = after
    assert estimate.return_probability == pytest.approx(back / seen, rel=1e-12)
    # Who is caged returns often; light spheres more often, because a heavy one hardly moves meanwhile.
    assert 0.01 < result.return_probability[0] < 0.5
    assert result.return_probability_error[0] < 0.1 * result.return_probability[0]


def test_every_distribution_has_bins_of_its_own_width():
    rng = np.random.default_rng(1)
    blocks = [
        FlightSums(*rng.integers(1, 9, (2, 1, 256)), rng.integers(1, 9, (1, 1, 256)), np.full((1, 3), 2000.0),
                   np.full((1, 1, 2), 2000.0), np.full((1, 2), 9.0))
        for _ in range(4)
    ]  # fmt: skip
    found = flights_of(blocks, [1.0] * 4, np.array([5]), np.array([0.5, 2.0, 3.0]))
    every = (found.free_time[0], found.free_path[0], found.normal_speed[0, 0])
    for each, width, name in zip(every, (0.5, 2.0, 3.0), ("times", "paths", "speeds"), strict=True):
        assert each.edges == pytest.approx(width * np.arange(256))
        counts = sum(getattr(block, name).reshape(256) for block in blocks)
        assert each.density == pytest.approx(counts[:-1] / (8000.0 * width))


RULES = Ranges([Kind("a", circles=[1.5])], lambda unit, event: None)
FLUID = carom.Scene.crystal(cells=3, packing_fraction=0.1)


@pytest.mark.parametrize(
    ("change", "settings", "says"),
    [
        ({"motion": Gravity((0.0, 0.0, -20.0))}, {}, "straight flight"),
        ({"obstacles": [Thermal(Ball((2.07, 0.69, 0.69), 0.2), kT=1.0)]}, {}, "obstacles that rest"),
        ({}, {"growth": 0.01}, "diameters that do not grow"),
        ({"interaction": RULES}, {}, "units that do not decide"),
        ({"drive": Andersen(1.0, rate=1.0)}, {}, "no drive"),
    ],
)
def test_flights_are_refused_where_speeds_change_on_the_way(unscheduled, change, settings, says):
    sim = carom.Simulation(FLUID.replace(**change), **settings)
    with pytest.raises(InputError, match=f"FreeFlights needs {says}"):
        sim.measure(carom.FreeFlights(), time=1.0)


def test_what_is_pinned_does_not_fly(monkeypatch):
    monkeypatch.setattr(RunState, "schedule", lambda machine: None)  # nothing is to run
    scene = FLUID.replace(pinned=np.arange(FLUID.n) % 2 == 0)
    machine = carom.Simulation(scene, seed=1)._state
    with flying.keeping(machine):
        engine, flights = machine.engine, machine.observer(Flights)
    assert (flights.moves == np.arange(FLUID.n) % 2).all()
    for now in (0.25, 0.75):
        event = PairEvent(np.int64(0), np.int64(1), 1, now, 1.0, -1.0, 1.0, 1.0, 1.0, 0, 0, 0)
        flights.before_pair(engine.model, engine.state, event)
    speed = np.linalg.norm(engine.state.rows["v"][1])
    assert flights.flown[0] == pytest.approx([1.0, 0.5, 0.5 * speed])
    assert flights.met[0, 0, 0] == 2.0


@pytest.mark.usefixtures("plain")
def test_histograms_are_kept_only_while_they_are_measured(tmp_path):
    # So many collisions that the rate is known: else one of the two runs a pilot first.
    fluid = carom.Simulation(FLUID, seed=1)
    fluid.run(collisions=1030)
    fluid.save(tmp_path / "fluid.h5")
    plain, seen = (carom.Simulation.load(tmp_path / "fluid.h5") for _ in range(2))
    kept = []

    def look(fraction):
        kept.append(seen._state.observer(Flights) is not None)
        seen.save(tmp_path / "during.h5")

    found = seen.measure(carom.FreeFlights(), carom.Pressure(), time=0.25, blocks=8, progress=look)
    assert found[1] == plain.measure(carom.Pressure(), time=0.25, blocks=8)
    assert (plain.frame().positions == seen.frame().positions).all()
    assert kept == [True] * 8
    # Neither the simulation nor what was saved on the way goes on with them.
    for sim in (seen, carom.Simulation.load(tmp_path / "during.h5")):
        assert sim._state.observer(Flights) is None


def test_sums_of_flights_are_in_the_unit_of_time_of_the_scene():
    from types import SimpleNamespace

    from carom.simulation.measuring.flying import _sums
    from carom.units import TimeUnit

    # Flights, their times and paths; collisions, their normal speeds.
    flown, met, unit = np.array([[2.0, 3.0, 5.0]]), np.array([[[7.0, 11.0]]]), TimeUnit(4)
    kept = SimpleNamespace(
        flown=unit.to_kernel(flown, np.array([0, 1, 0])), met=unit.to_kernel(met, np.array([0, -1])),
        times=np.zeros(1), paths=np.zeros(1), speeds=np.zeros(1), returns=np.zeros(1),
    )  # fmt: skip
    machine = SimpleNamespace(observer=lambda _: kept, unit=unit)
    found = _sums(machine)
    np.testing.assert_array_equal(found.flown, flown)
    np.testing.assert_array_equal(found.met, met)
