"""Checkpoints and event logs: whole and unchanged, or refused."""

import os
import signal

import h5py
import numpy as np
import pytest
from helpers import forked
from helpers.events import INITIAL, assert_events, assert_identical, cut, make_events
from hypothesis import HealthCheck, given, settings, strategies as st

from carom.errors import FileError, InputError
from carom.io import array_compression, checkpoint, hdf5
from carom.io.events import EventLog, read_events, read_initial

FIXTURE = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


DTYPES = [
    *"?bBhHiIlLqQefdgFDG",
    *(">f8", ">i2", "S7", "U5", "V3", "M8[ns]", "m8[D]"),
    np.dtype([("a", "<f8"), ("b", ">i4", (2, 3)), ("c", [("d", "U2"), ("e", "?")])]),
]


@pytest.mark.parametrize("shape", [(), (0,), (3,), (2, 0, 3), (2, 3)])
@pytest.mark.parametrize("dtype", DTYPES, ids=str)
def test_every_dtype_comes_back_bit_for_bit(tmp_path, dtype, shape):
    dtype = np.dtype(dtype)
    size = int(np.prod(shape))
    raw = np.random.default_rng(0).integers(0, 256, size * dtype.itemsize, dtype=np.uint8).tobytes()
    if dtype.kind == "b" or dtype.names or dtype.kind == "U":  # not all bytes are a value
        raw = bytes(size * dtype.itemsize)
    array = np.frombuffer(raw, dtype=dtype).reshape(shape)
    checkpoint.save(tmp_path / "c", {"a": array}, {})
    arrays, attributes = checkpoint.load(tmp_path / "c")
    assert attributes == {}
    assert_identical(array, arrays["a"])
    if arrays["a"].size:
        assert arrays["a"].flags.writeable


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@FIXTURE
@given(attributes=st.dictionaries(st.text(), JSON, max_size=4))
def test_any_attributes_come_back(tmp_path, attributes):
    checkpoint.save(tmp_path / "c", {}, attributes)
    assert checkpoint.load(tmp_path / "c")[1] == attributes


def test_the_state_of_a_generator_survives(tmp_path):
    rng = np.random.default_rng(7)
    checkpoint.save(
        tmp_path / "c", {}, {"rng": rng.bit_generator.state, "nan": float("nan"), "n": np.int64(3)}
    )
    attributes = checkpoint.load(tmp_path / "c")[1]
    again = np.random.default_rng(0)
    again.bit_generator.state = attributes["rng"]
    np.testing.assert_array_equal(again.random(5), rng.random(5))
    assert np.isnan(attributes["nan"])
    assert attributes["n"] == 3


def test_h5py_opens_a_checkpoint(tmp_path):
    checkpoint.save(tmp_path / "c.h5", {"x": np.arange(3.0)}, {"a": 1})
    with h5py.File(tmp_path / "c.h5", "r") as file:
        np.testing.assert_array_equal(file["arrays/x"][:], np.arange(3.0))
        assert bytes(file["attributes"][:]) == b'{"a": 1}'


@pytest.mark.parametrize(
    ("arrays", "attributes", "text"),
    [
        ({"a": np.array([object()])}, {}, "holds Python objects"),
        ({"a": np.array([("x", 1)], dtype=[("s", object), ("i", int)])}, {}, "holds Python objects"),
        ({"a/b": np.zeros(1)}, {}, "without '/'"),
        ({"": np.zeros(1)}, {}, "without '/'"),
        ({}, {"f": open}, "attributes must be"),
        ({}, {1: 2}, "name is 1"),
    ],
)
def test_what_cannot_be_kept_is_refused_and_the_old_file_stays(tmp_path, arrays, attributes, text):
    checkpoint.save(tmp_path / "c", {"x": np.ones(2)}, {"old": True})
    with pytest.raises(InputError, match=text):
        checkpoint.save(tmp_path / "c", arrays, attributes)
    assert checkpoint.load(tmp_path / "c")[1] == {"old": True}
    assert os.listdir(tmp_path) == ["c"]


def saved(tmp_path):
    path = tmp_path / "c"
    checkpoint.save(path, {"x": np.arange(100.0), "s": np.array(["a", "b"])}, {"step": 7})
    return path, path.read_bytes()


@FIXTURE
@given(at=st.integers(0, 10**9), flip=st.integers(1, 255))
def test_one_changed_byte_is_found(tmp_path, at, flip):
    path, content = saved(tmp_path)
    changed = bytearray(content)
    # The line of text names the program after the digest, and zeros fill the block: neither is content.
    end = content.index(b" written by")
    at %= len(content) - (512 - end)
    at += 0 if at < end else 512 - end
    changed[at] ^= flip
    path.write_bytes(changed)
    with pytest.raises(FileError):
        checkpoint.load(path)


def test_truncated_foreign_newer_missing_and_folder_are_file_errors(tmp_path):
    path, content = saved(tmp_path)
    sizes = (0, 5, 100, 511, 512, 600, len(content) - 1)
    for changed, says in (
        *((content[:size], r"truncated|no checkpoint") for size in sizes),
        (content + b"x", "has grown"),
        (content.replace(b"carom-checkpoint 1 ", b"carom-checkpoint 3 ", 1), "version 3"),
        (b"hello", "no checkpoint of Carom"),
    ):
        path.write_bytes(changed)
        with pytest.raises(FileError, match=says):
            checkpoint.load(path)
    for ask, says in (
        (lambda: checkpoint.load(tmp_path / "none"), "does not exist"),
        (lambda: checkpoint.load(tmp_path), "is a folder"),
        (lambda: checkpoint.save(tmp_path, {}, {}), "is a folder"),
        (lambda: checkpoint.save(tmp_path / "no" / "c", {}, {}), "does not exist"),
    ):
        with pytest.raises(FileError, match=says):
            ask()


@pytest.mark.parametrize("kind", ["i4", "u2", "i8", "?", "f8", ">i4"])
@pytest.mark.parametrize("shape", [(), (0,), (1,), (3000,), (40, 0, 3), (7, 11, 13)])
def test_a_packed_array_comes_back_bit_for_bit(kind, shape):
    array = (np.random.default_rng(1).normal(size=shape) * 100.0).astype(kind)
    found = array_compression.unpack(array_compression.pack(array), array.dtype, array.shape)
    assert (found.dtype, found.shape) == (array.dtype, array.shape)
    assert found.tobytes() == array.tobytes()
    found[...] = 0  # it can be written to


def test_packed_bytes_of_another_array_are_refused_and_none_is_unpacked_for_ever():
    """A thousand bytes hold a million zeros at most, so that a shape of 10^12 asks for no memory."""
    zeros = array_compression.pack(np.zeros(10**6, np.uint8))
    for shape in ((10**6 - 1,), (10**6 + 1,), (10**12,), (-1,), (), (10**30,)):
        with pytest.raises(ValueError, match=r"come out|cannot have the shape"):
            array_compression.unpack(zeros, np.dtype(np.uint8), shape)
    for content in (zeros[:-1], b"", b"hello"):
        with pytest.raises(ValueError, match=r"come out|cannot be unpacked"):
            array_compression.unpack(content, np.dtype(np.uint8), (10**6,))


def test_what_numbers_take_packed_is_known_from_a_sample():
    """Of 32 binary digits 20 are random and remain; zeros take nothing; coordinates stay as they are."""
    dice = np.random.default_rng(1)
    neighbors = dice.integers(0, 2**20, 300_000, dtype=np.uint32)
    assert array_compression.expected(neighbors) == pytest.approx(300_000 * 20 / 8, rel=1e-2)
    assert len(array_compression.pack(neighbors)) == pytest.approx(300_000 * 20 / 8, rel=0.05)
    assert array_compression.expected(np.zeros((300_000, 3), np.int32)) == 0.0
    coordinates = dice.uniform(size=(100_000, 3))
    assert array_compression.expected(coordinates) == coordinates.nbytes
    # With an even step only one of the columns would be seen.
    rows = np.zeros((100_000, 2), np.uint32)
    rows[:, 1] = dice.integers(0, 2**32, 100_000)
    assert array_compression.expected(rows) > 0.5 * rows.nbytes


def test_a_full_disk_leaves_the_old_checkpoint(tmp_path, monkeypatch):
    path, content = saved(tmp_path)

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileError, match="No space left on device"):
        checkpoint.save(path, {}, {})
    assert path.read_bytes() == content
    assert os.listdir(tmp_path) == ["c"]


@pytest.mark.parametrize("short", ["impulse", "epoch", "j"])
def test_events_of_which_a_kill_left_some_columns_shorter_are_dropped(short, tmp_path):
    events = make_events(20)
    with EventLog(tmp_path / "e.h5", INITIAL) as log:
        log.append(*events)
    with h5py.File(tmp_path / "e.h5", "r+") as file:
        file[short].resize(17, axis=0)
    assert_events(cut(events, 0, 17), read_events(tmp_path / "e.h5"))
    with EventLog(tmp_path / "e.h5") as log:
        assert len(log) == 17
        log.append(*cut(events, 17, 20))
    assert_events(events, read_events(tmp_path / "e.h5"))


def test_events_and_the_initial_state_come_back_bit_for_bit(tmp_path):
    events = make_events(50_000)
    with EventLog(tmp_path / "e.h5", INITIAL) as log:
        for start in (0, 1, 20_000):
            stop = {0: 1, 1: 20_000, 20_000: 50_000}[start]
            log.append(*cut(events, start, stop))
        log.append(*cut(events, 0, 0))
        assert len(log) == 50_000
        assert_events(events, read_events(tmp_path / "e.h5"))  # a log that grows can be read
    assert_events(events, read_events(tmp_path / "e.h5"))
    assert_events(cut(events, 17_000, 17_003), read_events(tmp_path / "e.h5", 17_000, 17_003))
    for name, array in read_initial(tmp_path / "e.h5").items():
        assert_identical(np.asarray(INITIAL[name]), np.asarray(array))


@pytest.mark.parametrize("keep", [None, 0, 1, 999, 1000])
def test_a_log_continues_after_what_it_keeps(tmp_path, keep):
    events, others = make_events(1000), make_events(500, seed=5, epoch=9)
    with EventLog(tmp_path / "e.h5", INITIAL) as log:
        log.append(*events)
    with EventLog(tmp_path / "e.h5", keep=keep) as log:
        log.append(*others)
    found = read_events(tmp_path / "e.h5")
    kept = 1000 if keep is None else keep
    assert_events(cut(events, 0, kept), cut(found, 0, kept))
    assert_events(others, cut(found, kept, None))
    np.testing.assert_array_equal(read_initial(tmp_path / "e.h5")["positions"], INITIAL["positions"])


def test_bad_logs_and_arguments_are_refused(tmp_path):
    path = tmp_path / "e.h5"
    with EventLog(path, INITIAL) as log:
        log.append(*make_events(3))
        with pytest.raises(InputError, match="column j has the shape"):
            log.append(*make_events(3)._replace(j=np.zeros(2, np.int32)))
        with pytest.raises(InputError, match="column i is of float64"):
            log.append(*make_events(3)._replace(i=np.zeros(3)))
        with pytest.raises(InputError, match="column image holds numbers that int32 cannot"):
            log.append(*make_events(3)._replace(image=np.full(3, 2**31)))
    with pytest.raises(FileError, match="holds 3 events, and 4"):
        EventLog(path, keep=4)
    for options in ({"initial": INITIAL, "keep": 1}, {"keep": -1}):
        with pytest.raises(InputError, match="keep is"):
            EventLog(path, **options)
    with pytest.raises(InputError, match="holds <U1"):
        EventLog(tmp_path / "f.h5", initial={"name": np.array("x")})
    with pytest.raises(FileError, match="does not exist"):
        EventLog(tmp_path / "none.h5")
    content = path.read_bytes()
    for size in (0, 100, len(content) // 2):
        path.write_bytes(content[:size])
        with pytest.raises(FileError):
            read_events(path)
        with pytest.raises(FileError):
            EventLog(path)


def log_for_ever(path, reports):
    """Append events, and report each time how many there are."""
    events = make_events(100_000)
    with EventLog(path, INITIAL) as log:
        for start in range(0, 100_000, 100):
            log.append(*cut(events, start, start + 100))
            os.write(reports, b".")


@pytest.mark.needs("Unix")
def test_kill_9_costs_no_event_that_was_appended(tmp_path):
    path = tmp_path / "e.h5"
    told, reports = os.pipe()
    child = forked.begun(log_for_ever, path, reports)
    os.close(reports)
    reported = 100 * sum(len(os.read(told, 1)) for _ in range(20))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os.close(told)
    with EventLog(path, keep=reported) as log:
        assert len(log) == reported
    assert_events(cut(make_events(100_000), 0, reported), read_events(path))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_for_the_whole_state(tmp_path, monkeypatch, number):
    """HDF5 loses an exception that is raised where it writes, and the command ended as by a bug."""
    write, handler = hdf5._Patient.write, signal.getsignal(number)

    def interrupted(self, data):
        signal.raise_signal(number)
        return write(self, data)

    monkeypatch.setattr(hdf5._Patient, "write", interrupted)
    signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            checkpoint.save(tmp_path / "state.h5", {"a": np.arange(3)}, {"b": 1})
    finally:
        signal.signal(number, handler)
    arrays, attributes = checkpoint.load(tmp_path / "state.h5")
    assert (arrays["a"].tolist(), attributes) == ([0, 1, 2], {"b": 1})
