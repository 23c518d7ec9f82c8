"""Checkpoints that do not fit their scene are refused, and those whose calendar begins anywhere are not."""

import numpy as np
import pytest
from helpers.checkpoints import SCENES, saved

import carom
from carom.engine.domains.logical_process import refill_queue
from carom.errors import FileError
from carom.io import checkpoint


def test_an_array_that_does_not_fit_the_scene_is_refused(tmp_path):
    arrays, attributes = saved("disks", tmp_path / "state.h5")
    few = {name: array for name, array in arrays.items() if name != "state.crossing_time"}
    for given in (few, {**arrays, "state.crossing_time": np.ones(3)}):
        checkpoint.save(tmp_path / "c.h5", given, attributes)
        with pytest.raises(FileError, match=r"state\.crossing_time"):
            carom.Simulation.load(tmp_path / "c.h5")


def test_attributes_of_no_run_are_refused(tmp_path):
    arrays, attributes = saved("disks", tmp_path / "state.h5")
    for change in ({"base": "1/0"}, {"wish": "[]"}, {"scheme": "[]"}, {"scene": "{}"}):
        checkpoint.save(tmp_path / "c.h5", arrays, {**attributes, **change})
        with pytest.raises(FileError) as caught:
            carom.Simulation.load(tmp_path / "c.h5")
        assert "\n" not in str(caught.value)


def test_a_calendar_whose_window_begins_anywhere_goes_on(tmp_path):
    # As after a window of several workers, or where lines ran out. Its end is rounded, and may then be a hair
    # further from the beginning than its buckets are wide.
    scene, settings = SCENES["disks"]()
    sim = carom.Simulation(scene, seed=2, **settings)
    calendar, clock = sim._state.engine.calendar, sim._state.engine.state.clock
    control, count = calendar.control[0], len(calendar.buckets) - 1
    for _ in range(200):
        refill_queue(sim._state.engine, int(clock.epoch[0]), float(clock.now[0]))
        sim.run(collisions=1)
        if (control.end - control.start) * control.inverse > count:
            break
    else:
        pytest.fail("no end of a window was rounded up")
    sim.save(tmp_path / "state.h5")
    again = carom.Simulation.load(tmp_path / "state.h5")
    for each in (sim, again):
        each.run(collisions=100)
    assert np.array_equal(sim.frame().positions, again.frame().positions)
