"""Positions, velocities and times in single precision: what holds, and to how many digits."""

import numpy as np
import pytest
from helpers.oracle import moving

import carom
from carom.simulation.replay import Replay

EPSILON = float(np.finfo(np.float32).eps)


@pytest.fixture(scope="module")
def fluid():
    """Return the same fluid in double and in single precision after 50 collisions a particle."""
    scene = moving(carom.Scene.crystal(cells=5, packing_fraction=0.3), 3)
    runs = {
        name: carom.Simulation(scene, tuning=carom.Tuning(precision=name)) for name in ("double", "single")
    }
    for sim in runs.values():
        sim.run(collisions_per_particle=50)
    return runs


def test_overlaps_and_drift_are_those_of_single_precision(fluid):
    sim = fluid["single"]
    found = sim.statistics
    # A coordinate is rounded by half an ulp of the box; two of them and their motion make a few.
    assert found.worst_overlap < 16 * EPSILON * max(sim.scene.box)
    # A random walk of one rounding for each of the 50 collisions of a particle, averaged over all.
    assert 0.0 < found.energy_drift < 50 * EPSILON
    assert fluid["double"].statistics.worst_overlap < 1e-13


def test_both_measure_the_same_pressure(fluid):
    z = [sim.measure(carom.Pressure(), collisions=400_000).Z for sim in fluid.values()]
    assert abs(z[0].mean - z[1].mean) < 4.0 * np.hypot(z[0].error, z[1].error)


def test_a_run_in_single_precision_is_resumed_bit_for_bit(fluid, tmp_path):
    sim = fluid["single"]
    sim.save(tmp_path / "run.h5")
    again = carom.Simulation.load(tmp_path / "run.h5")
    for run in (sim, again):
        run.run(collisions=1000)
    np.testing.assert_array_equal(sim.frame().positions, again.frame().positions)
    assert again._state.engine.state.rows["x"].dtype == np.float32


def test_a_log_of_single_precision_is_not_replayed(unscheduled, tmp_path):
    sim = carom.Simulation(
        carom.Scene.crystal(cells=3, packing_fraction=0.3),
        tuning=carom.Tuning(precision="single"),
        event_log=tmp_path / "e.h5",
    )
    sim.close()
    with pytest.raises(carom.FileError, match="cannot be replayed: its run was in single precision"):
        Replay(tmp_path / "e.h5")
