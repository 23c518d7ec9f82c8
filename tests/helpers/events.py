"""Events that a run could have logged, and how they are compared."""

import numpy as np

from carom.io.events import Events


def assert_identical(a, b):
    assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())


INITIAL = {
    "positions": np.random.default_rng(1).random((5, 3)),
    "velocities": np.random.default_rng(2).normal(size=(5, 3)),
    "box": np.array([4.0, 5.0, 6.0]),
    "diameters": np.ones(5),
    "masses": np.ones(5),
    "epoch_length": np.float64(1.5),
}


def make_events(count, seed=0, epoch=0):
    """Events that a run of 5 components could have, from an epoch on."""
    rng = np.random.default_rng(seed)
    i = rng.integers(0, 5, count)
    at = np.sort(9.0 * rng.random(count))
    return Events(
        epoch + at.astype(np.int64),
        at % 1.0,
        i.astype(np.int32),
        ((i + rng.integers(1, 5, count)) % 5).astype(np.int32),
        rng.integers(0, 27, count).astype(np.int32),
        rng.normal(size=count),
    )


def assert_events(a, b):
    assert (a.kind is None) == (b.kind is None)
    for x, y in zip(columns_of(a), columns_of(b), strict=True):
        assert_identical(x, y)


def cut(events, start, stop):
    return Events(*(column[start:stop] for column in columns_of(events)))


def columns_of(events):
    return [column for column in events if column is not None]
