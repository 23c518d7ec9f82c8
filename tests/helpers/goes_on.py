"""A run that is looked at, saved and loaded, and the replay of its log: the bits of an undisturbed run."""

import numpy as np

import carom
from carom.simulation.replay import Replay


def assert_same_bits(one, other):
    """All that moves in two frames is the same to the last bit."""
    assert one.tilt == other.tilt
    for name in ("positions", "velocities", "images", "spins"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


def same(one, other, *names):
    """Tell whether two simulations have the same positions, velocities and other arrays of their frames."""
    a, b = one.frame(), other.frame()
    return all(
        np.array_equal(getattr(a, name), getattr(b, name)) for name in ("positions", "velocities", *names)
    )


def assert_goes_on(scene, folder, collisions, **given):
    """Return the undisturbed run and that from the file; ``given`` are models that no file holds."""
    whole = carom.Simulation(scene, seed=1)
    whole.run(collisions=collisions)
    with carom.Simulation(scene, seed=1, event_log=folder / "log.h5") as half:
        half.run(collisions=collisions // 3)
        assert len(list(half.sample(every=0.1 * half.time, count=3))) == 3
        half.save(folder / "half.h5")
    with carom.Simulation.load(folder / "half.h5", **given) as again:
        again.run(collisions=collisions - again.collisions)
    replay = Replay(folder / "log.h5", **given)
    while replay.step():
        pass
    for other in (again, replay):
        assert_same_bits(other.frame(), whole.frame())
    for name in ("motion", "obstacles", "drive", "impact"):
        assert getattr(again.scene, name) == getattr(scene, name)
    assert again.obstacles == whole.obstacles
    return whole, again
