"""Frames of a replay beside those of the run."""

import numpy as np


def assert_same_frame(a, b):
    assert a.time == b.time
    assert a.step == b.step
    assert tuple(a.box) == tuple(b.box)
    for name in ("positions", "velocities", "images", "diameters", "masses"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


def round_up(sim):
    """Return a time that is a double and not past: a collision's is an epoch and an offset."""
    return np.nextafter(sim.time, np.inf)
