"""Refits: whatever remembers something, or has a unit of time, goes through changes of that unit.
Nothing is forgotten, and nothing has another value than without such a change.

Each scene runs at two scales of time that differ by a power of two. One of the two stays near the engine's
usual unit, and keeps it. The other leaves it when particles are heated by 10^6, and comes back. All numbers
must then be equal, bit for bit, each by the dimension that its field declares.
"""

import math

import numpy as np
import pytest
from helpers import refits
from helpers.marks import slow

import carom
from carom.models.interfaces.memory import KEPT, fields_of
from carom.models.obstacles.moving import Displaced
from carom.simulation.workers.executive import Executive, Settings

SCALE = 15
"""Speeds of the other twin are so many powers of two larger; with kT times 10^6 they are beyond 2^20."""

HEAT = 1e6

OF_VELOCITIES = ("velocities", "kT", "spins", "energy_drift", "momentum_drift")
"""What a rescaling changes."""


def stages(name, s, between=lambda sim: sim, **more):
    """Yield a simulation before, in, and after a hot stretch."""
    sim = refits.simulation(name, s, **more)
    for hot in (False, True, False):
        if hot or sim.time > 0.0:
            growth = {"growth": 0.0625 * s * HEAT ** (0.5 * hot)} if name == "growth" else {}
            before, cold = remembered(sim), sim.kT
            sim.rescale((HEAT if hot else 1.0) * s * s, **growth)
            assert_remembered(before, remembered(sim), math.sqrt(sim.kT / cold))
            sim = between(sim)
        before = parameters(sim)
        sim.run(time=refits.duration(name, s, hot))
        after = parameters(sim)
        changed = [key for key in before if not np.array_equal(before[key], after[key], equal_nan=True)]
        assert not changed or name == "swaps", f"{changed} changed in a run, and nothing declares it"
        yield sim
        before = remembered(sim)
        sim = between(sim)
        assert_remembered(before, remembered(sim))


def remembered(sim):
    """What goes on in another engine, and what a user sees of it."""
    inside = {key: value for key, (value, what) in refits.held(sim).items() if what.role in KEPT}
    return inside | {key: value for key, (value, _) in refits.seen(sim).items() if key not in OF_VELOCITIES}


def assert_remembered(before, after, faster=1.0):
    """Nothing is forgotten; spins are ``faster`` by the factor of the velocities, a few times rounded."""
    assert before.keys() == after.keys()
    for key, value in before.items():
        if key.endswith(".spins"):
            np.testing.assert_allclose(after[key], faster * value, rtol=8 * np.finfo(float).eps)
        else:
            np.testing.assert_array_equal(after[key], value, err_msg=key)


def parameters(sim):
    """What no run may change."""
    return {key: value for key, (value, what) in refits.held(sim).items() if what.role == "parameter"}


def run_twins(name, between=lambda sim: sim, scale=SCALE, **more):
    exponents = []
    twins = stages(name, 1.0), stages(name, 2.0**scale, between, **more)
    for one, other in zip(*twins, strict=True):
        refits.assert_alike(one, other, scale)
        assert one._state.unit.exponent == 0
        exponents.append(other._state.unit.exponent)
    assert exponents[0] == exponents[2] == 0
    assert exponents[1] < -20
    assert one.collisions > 0


@pytest.mark.parametrize("name", refits.ROWS)
def test_memory_goes_on_in_another_unit_of_time_in_grown_arrays_and_from_a_file(name, plain, tmp_path):
    def between(sim):
        sim._state.enlarge_heap()
        sim._state.enlarge_neighbors(full_cell=True)
        sim._state.schedule()
        return refits.loaded(sim, tmp_path / "state.h5")

    run_twins(name, between)


@pytest.mark.parametrize("scale", [-30, 30])
@pytest.mark.parametrize(
    "name", [name for name in refits.ROWS if name[:3] == "own"] + ["units", "loss", "rough", "growth"]
)
def test_models_are_told_all_in_their_unit_from_the_start_at_any_speed(name, scale, plain):
    twins = [refits.simulation(name, 2.0**power) for power in (0, scale)]
    for sim, power in zip(twins, (0, scale), strict=True):
        sim.run(time=refits.duration(name, 2.0**power, False))
    assert abs(twins[1]._state.unit.exponent) > 20
    assert twins[0]._state.unit.exponent == 0
    refits.assert_alike(*twins, scale)


@pytest.mark.parametrize("name", ["loss", "rough", "shear", "langevin"])
def test_memory_goes_on_in_another_neighbor_scheme(name, plain):
    def between(sim):
        sim._state.requested = ("lists" if sim._state.scheme.kind == "sectors" else "sectors", None)
        return sim

    run_twins(name, between)


def moments_and_phases(sim):
    """Return what a run has now: no moment depends on when its epoch began."""
    now, found = sim._state.in_epoch(), refits.seen(sim)
    found |= {key: each for key, each in refits.held(sim).items() if each[1].role in KEPT}
    for model in refits.models_of(sim):
        if isinstance(model, Displaced):
            period = model.course.period
            angle = 2.0 * math.pi * ((model.phase[0] + now) % period) / period
            found["phase"] = np.array([math.cos(angle), math.sin(angle)]), None
    found = {key: value for key, (value, _) in found.items() if key not in NOT_OF_RUNS}
    told = {"events": 2, "times": 2, "speeds": 4}  # what an observer is told at an end of an epoch
    return {
        key: np.delete(value, told[name])
        if "Sums." in key and (name := key.rpartition(".")[2]) in told
        else value
        for key, value in found.items()
    }


NOT_OF_RUNS = ("advancements", "transits", "third_party_first", "returns", "energy_drift", "momentum_drift")
"""What counts ends of epochs as well, or is rounding only."""


@pytest.mark.parametrize("name", refits.ROWS)
def test_nothing_is_forgotten_at_an_end_of_an_epoch_after_a_refit(name, plain, shorten_epochs):
    whole, refitted = refits.simulation(name, 1.0), refits.simulation(name, 1.0)
    duration = refits.duration(name, 1.0, False)
    whole.run(time=duration)
    shorten_epochs(duration / 16.0)
    hits = []
    for part in (0.25, 0.375, 0.375):
        refitted._state.refit()
        refitted.run(time=part * duration)
        assert refitted._state.clock.epoch > 3 or name == "barostat"  # whose moves refit
        hits.append([each.hits for each in refitted.obstacles])
    assert not hits[0] or hits[2][-1] > hits[0][-1]
    one, other = moments_and_phases(whole), moments_and_phases(refitted)
    assert one.keys() == other.keys()
    for key, value in one.items():
        # Places are rounded at each refit, and some collisions multiply that.
        np.testing.assert_allclose(other[key], value, rtol=1e-9, atol=1e-9, err_msg=key)


def equal_spheres():
    return carom.Scene.crystal(cells=12, packing_fraction=0.3)


@pytest.mark.parametrize("scene", [equal_spheres, slow(refits.species_between_walls)])
def test_sums_of_two_workers_go_on_in_another_unit_of_time_as_those_of_one(scene):
    one, other = (carom.Simulation(scene(), kT=4.0**scale, seed=3) for scale in (0, SCALE))
    settings = Settings(collisions=0.5, least=0.0, compare=False)
    executive = other._state.executive = Executive(other._state, 2, settings)
    for hot in (1.0, 1e3, HEAT, 1e3, 1.0):
        for sim, s in ((one, 1.0), (other, 2.0**SCALE)):
            sim.rescale(hot * s * s)
            sim.run(time=0.25 * 2.0 ** -round(0.5 * math.log2(hot)) / s)
        assert one._state.unit.exponent == 0
        assert (other._state.unit.exponent != 0) == (hot > 1.0)
        refits.assert_alike(one, other, SCALE)
    executive.close()
    # As long as ever, whatever the unit was before: else there are thousands.
    assert 10 < executive.timings.windows < 300


def latest_times(name, sim):
    """The last times that drives, observers and rules were told."""
    if name == "units":
        told = sim.interaction.memory[:, 1] / np.hypot(*sim.velocities.T)
        return told[told > 0.0]
    return sim.drive.latest if name == "own drive" else sim.observers[0].latest


@pytest.mark.parametrize("name", ["own drive", "loss", "units"])
def test_drives_observers_and_rules_are_told_the_time_since_the_start_after_two_changes(name, plain):
    sim = refits.simulation(name, 2.0**SCALE)
    for hot in (False, True, False):
        if sim.time > 0.0:
            sim.rescale((HEAT if hot else 1.0) * 4.0**SCALE)
        before = sim.time
        sim.run(time=refits.duration(name, 2.0**SCALE, hot))
    told = latest_times(name, sim)
    assert before < told.max() <= sim.time
    assert len(told)


@pytest.mark.parametrize("name", ["shaken floor", "floor on parabolas"])
def test_a_floor_is_where_its_path_says_after_two_changes(name, plain):
    sim = refits.simulation(name, 2.0**SCALE)
    floor = sim.scene.obstacles[0]

    def assert_in_place():
        (model,) = (each for each in refits.models_of(sim) if isinstance(each, Displaced))
        along = sim._state.unit.to_scene(model.phase[0] + sim._state.in_epoch(), 1)
        assert along % floor.shake.period == sim.time % floor.shake.period

    for hot in (False, True, False):
        if sim.time > 0.0:
            sim.rescale((HEAT if hot else 1.0) * 4.0**SCALE)
            assert_in_place()
        sim.run(time=(2.0**-10 if hot else 0.625) * floor.shake.period)
        assert_in_place()


def test_every_model_of_carom_that_remembers_something_is_in_the_table(unscheduled):
    covered = {kind for name in refits.ROWS for kind in refits.models_in(refits.simulation(name, 1.0))}
    remember = {
        kind for kind in refits.known_models() if any(each.role in KEPT for each in fields_of(kind).values())
    }
    assert {kind.__name__ for kind in remember - covered} == set()
    assert len(remember) > 15


def test_times_of_an_epoch_are_told_from_the_next_one(unscheduled):
    found = set()
    for name in refits.ROWS:
        for model in refits.models_of(refits.simulation(name, 1.0)):
            moments = [key for key, each in fields_of(type(model)).items() if each.role == "moment"]
            for key in moments:
                getattr(model, key)[...] = 8.0
            if moments:
                model.shift_epoch(3.0)
                assert all((getattr(model, key) == 5.0).all() for key in moments)
                found.add(type(model).__name__)
    assert {"Losing", "Lossy", "Units", "Remembering", "Ledge"} <= found
