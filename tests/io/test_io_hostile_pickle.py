"""No file that is read can run code: pickles and arrays of objects are refused by every reader, unopened."""

import pickle

import numpy as np
import pytest

import carom
from carom import io
from carom.errors import CaromError
from carom.io.events import read_events, read_initial
from carom.simulation.replay import replay


class Bomb:
    """What leaves a file behind when it is unpickled."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return (open, (str(self.mark), "w"))


READERS = {
    "io.read": lambda path: io.read(path, ":"),
    "io.open": lambda path: io.open(path, "r").__enter__()[0],
    "io.rebuild": lambda path: io.rebuild(path, path.with_name(f"again{path.suffix}"), 1),
    "Simulation.load": carom.Simulation.load,
    "read_events": read_events,
    "read_initial": read_initial,
    "replay": lambda path: replay(path, time=0.0),
}


def pickled(path, bomb):
    path.write_bytes(pickle.dumps(bomb))


def array_of_objects(path, bomb):
    with path.open("wb") as file:
        np.save(file, np.array([bomb], dtype=object), allow_pickle=True)


def pickle_inside(path, bomb):
    """Make an HDF5 file whose positions, and all else, are one opaque pickle."""
    import h5py

    with h5py.File(path, "w") as file:
        word = np.void(pickle.dumps(bomb))
        for name in ("particles/all/position/value", "state/rows", "positions", "events", "scene"):
            file[name] = word
        for name in ("version", "kind", "creator", "format"):
            file.attrs[name] = word


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("suffix", [".h5md", ".extxyz", ".gsd", ".h5", ".npy"])
@pytest.mark.parametrize("write", [pickled, array_of_objects, pickle_inside])
def test_a_file_that_would_run_code_is_refused(tmp_path, reader, suffix, write):
    path, mark = tmp_path / f"hostile{suffix}", tmp_path / "mark"
    write(path, Bomb(mark))
    with pytest.raises(CaromError):
        READERS[reader](path)
    assert not mark.exists()


@pytest.mark.parametrize("write", [pickled, array_of_objects])
def test_the_bomb_is_one(tmp_path, write):
    path, mark = tmp_path / "hostile.npy", tmp_path / "mark"
    write(path, Bomb(mark))
    np.load(path, allow_pickle=True)
    assert mark.exists()
