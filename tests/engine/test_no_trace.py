"""Scheduling leaves no trace: the time of a contact is a function of two rows (decision 3)."""

import numpy as np
import pytest
from helpers.marks import slow
from helpers.mixtures import mixture

import carom
from carom.engine import build
from carom.engine.constants import LAMBDA
from carom.engine.domains.logical_process import refill_queue
from carom.models import Shear
from carom.models.interactions.hard_cores import EqualCores
from carom.simulation.measuring import stretches

SCENES = {
    "sectors": lambda: carom.Scene.crystal(cells=6, packing_fraction=0.3),
    "lists": lambda: carom.Scene.crystal(cells=6, packing_fraction=0.49),
    "thin": lambda: carom.Scene.crystal(cells=6, packing_fraction=0.05),
    "disks": lambda: carom.Scene.random(n=900, dimension=2, packing_fraction=0.65, seed=1),
    "four dimensions": lambda: carom.Scene.crystal(
        lattice="cubic", cells=5, dimension=4, packing_fraction=0.1
    ),
    "walls": lambda: carom.Scene.random(n=800, packing_fraction=0.25, walls="z", seed=1),
    "a mixture": lambda: mixture([400, 400], diameters=[1.0, 1.6], packing_fraction=0.4, seed=1),
}

DEFAULT = ("sectors", "thin", "disks")
"""Whose kernels other tests have; the others see the same code."""


def schedule_anew(sim):
    """Let all components look for their next event at the present."""
    machine = sim._state
    state = machine.engine.state
    state.partner[:] = LAMBDA
    state.rows["event_time"][: machine.scene.n] = state.clock.now[0]
    refill_queue(machine.engine, int(state.clock.epoch[0]), float(state.clock.now[0]))


@pytest.mark.parametrize("name", [name if name in DEFAULT else slow(name) for name in SCENES])
def test_a_run_whose_events_are_all_scheduled_anew_goes_on_with_the_same_bits(name, tmp_path):
    scene = SCENES[name]()
    logs = [
        tmp_path / f"{k}.h5" if name == "disks" else None for k in range(2)
    ]  # as several workers have them
    alone, disturbed = (carom.Simulation(scene, seed=3, event_log=log) for log in logs)
    assert type(alone._state.engine.model.timing).__name__ == "FromRows"
    alone.run(collisions_per_particle=8)
    disturbed.run(collisions_per_particle=8)
    step = alone.time / 80
    while alone._state.engine.state.clock.epoch[0] < 1 or stretches.tally(alone).collisions < 20 * scene.n:
        alone.run(time=step)
        disturbed.run(time=step)
        schedule_anew(disturbed)
    one, other = alone.frame(), disturbed.frame()
    np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_array_equal(one.velocities, other.velocities)
    assert stretches.tally(alone).collisions == stretches.tally(disturbed).collisions


def test_contacts_computed_from_shortly_before_them_leave_none_either():
    """Most flights are longer than a quarter of the box: too long to be computed from the rows."""
    scene = carom.Scene.crystal(lattice="cubic", cells=9, packing_fraction=0.01)
    alone, disturbed = (
        carom.Simulation(scene, seed=3, tuning=carom.Tuning(neighbors="sectors")) for _ in range(2)
    )
    assert alone._state.engine.model.timing.square == 64.0  # eight diameters; the mean free path is twelve
    alone.run(collisions_per_particle=0.2)
    step = alone.time
    disturbed.run(time=step)
    while stretches.tally(alone).collisions < 6 * scene.n:
        schedule_anew(disturbed)
        for sim in (alone, disturbed):
            sim.run(time=step)
    np.testing.assert_array_equal(alone.frame().velocities, disturbed.frame().velocities)


def engine_of(distance, **settings):
    """Return the simulation of two disks that approach at the speed 1/2."""
    scene = carom.Scene(
        [[1.0, 20.0], [1.0 + distance, 20.0]],
        (40.0, 40.0),
        velocities=[[0.5, 0.0], [0.0, 0.0]],
        **settings,
    )
    return carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"))._state


def found(machine, t):
    """Return what is made of a time until the contact that a search has found, and what the law says."""
    model, state, *_ = machine.engine
    ref = (1 << model.boundary.bits) | 4  # the nearest image
    given = model, state, 0, ref, 0.0, t
    return model.timing.found_time(*given), model.timing.contact_time(*given)


def test_the_time_that_a_search_has_computed_is_kept_but_for_pairs_far_away_or_touching(unscheduled):
    t = 4.0 * (1.0 + 2.0**-40)
    kept, computed = found(engine_of(3.0), t)
    assert (kept, computed) == ((t, False), (4.0, False))
    kept, computed = found(engine_of(11.0), 5.0 * t)  # corrected
    assert kept == computed == (20.0, False)
    kept, computed = found(engine_of(1.0 - 2.0**-50), 0.0)
    assert kept == computed == (0.0, True)  # counted


def test_it_is_kept_where_the_search_computes_it_as_the_law_does(unscheduled):
    class Own(EqualCores):
        def contact_time(self, i, j, rr, rv, vv, now):
            return max(-rv / vv, 0.0), False

    machine = engine_of(3.0)
    model = machine.engine.model
    own = build.timing_of(machine.scheme, machine.system, None, Own(*model.pair), model.motion)
    assert model.timing.as_found
    assert not own.as_found
    assert not engine_of(3.0, motion=Shear(0.1)).engine.model.timing.as_found
