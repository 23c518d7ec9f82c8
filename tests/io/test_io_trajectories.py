"""Trajectory files: what goes in comes out, bit for bit, and nothing else is accepted."""

import dataclasses
import itertools
import os
import signal
import time

import h5py
import numpy as np
import pytest
from helpers import forked
from helpers.frames import SUFFIXES, assert_same, endless, float32_spacing, make_frames, write

import carom.io
from carom.errors import CaromWarning, FileError, InputError
from carom.frame import Frame

LOSSLESS = [
    (d, suffix) for d in (1, 2, 3, 4) for suffix in (".h5md", ".extxyz") if d <= 3 or suffix == ".h5md"
]


@pytest.mark.parametrize("images", [True, False])
@pytest.mark.parametrize(("dimension", "suffix"), LOSSLESS)
def test_frames_come_back_bit_for_bit(tmp_path, dimension, suffix, images):
    masses = np.random.default_rng(1).uniform(0.3, 3.0, 13)
    frames = make_frames(dimension, images=images, masses=masses)
    path = write(tmp_path / f"a{suffix}", frames)
    with carom.io.open(path) as reader:
        assert len(reader) == len(frames)
        assert repr(reader) == f"<{path}: 4 frames>"
        for a, b in zip(frames, reader, strict=True):
            assert_same(a, b)
        assert_same(frames[-1], reader[-1])
        assert [frame.step for frame in reader[1::2]] == [frames[1].step, frames[3].step]
        with pytest.raises(IndexError, match="no frame 4"):
            reader[4]


@pytest.mark.parametrize("suffix", [".h5md", ".extxyz"])
def test_one_particle_and_extreme_doubles_come_back(tmp_path, suffix):
    values = np.array([[5e-324, -0.0, 1.7976931348623157e308]])
    frame = Frame(
        2.0**70, 2**62, np.abs(values), values, (1e308, 3.0, 1.7e308), np.array([1e-300]), np.ones(1)
    )
    assert_same(frame, carom.io.read(write(tmp_path / f"a{suffix}", [frame])))


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_gsd_keeps_float32(tmp_path, dimension):
    frames = make_frames(dimension)
    path = write(tmp_path / "a.gsd", frames)
    for a, b in zip(frames, carom.io.read(path, ":"), strict=True):
        # Centered coordinates reach half the box: float32 rounds them, and the edge they are shifted by.
        tolerance = 2 * float32_spacing(a)
        difference = np.abs(a.positions - b.positions)
        assert np.minimum(difference, np.asarray(a.box) - difference).max() <= tolerance
        assert np.all((b.positions >= 0) & (b.positions < b.box))
        np.testing.assert_array_equal(b.velocities, a.velocities.astype(np.float32))
        np.testing.assert_array_equal(b.diameters, a.diameters.astype(np.float32))
        carried = (b.positions == 0.0) & (a.positions > 0.5 * np.asarray(a.box))
        np.testing.assert_array_equal(b.images, a.images + carried)
        assert carried[1].all()
        assert (b.time, b.step) == (a.time, a.step)


def test_gsd_keeps_unwrapped_positions_at_faces_and_places_at_walls(tmp_path):
    """Rounding to float32 carries a component onto the face: of the next image, or a wall."""
    [frame] = make_frames(2, count=1)
    frame.positions[2] = np.nextafter(frame.box, 0.0)
    frame = dataclasses.replace(frame, periodic=(True, False))
    with pytest.warns(CaromWarning, match="GSD knows no walls"):
        path = write(tmp_path / "a.gsd", [frame])
    with carom.io.open(path) as file:
        found = file[0]
    assert (found.positions[:, 0] < frame.box[0]).all()
    # Positions and edges are rounded; images multiply the edges.
    tolerance = (2 + np.abs(frame.images).max()) * np.spacing(np.float32(max(frame.box)))
    np.testing.assert_allclose(found.unwrapped, frame.unwrapped, rtol=0, atol=float(tolerance))


@pytest.mark.parametrize("source", SUFFIXES)
@pytest.mark.parametrize("target", SUFFIXES)
def test_convert_between_all_formats(tmp_path, source, target):
    frames = make_frames(3)
    a = write(tmp_path / f"a{source}", frames)
    seen = []
    assert carom.io.convert(a, tmp_path / f"b{target}", progress=lambda *done: seen.append(done)) == 4
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    result = carom.io.read(tmp_path / f"b{target}", ":")
    for x, y, z in zip(frames, carom.io.read(a, ":"), result, strict=True):
        if ".gsd" not in (source, target):
            assert_same(x, z)
        elif target != ".gsd":
            assert_same(y, z)
        else:
            np.testing.assert_array_equal(z.velocities, x.velocities.astype(np.float32))
    assert sorted(os.listdir(tmp_path)) == sorted({f"a{source}", f"b{target}"})


def test_convert_leaves_an_existing_target_alone_unless_told(tmp_path):
    a = write(tmp_path / "a.extxyz", make_frames(3))
    b = tmp_path / "b.h5md"
    b.write_text("precious")
    with pytest.raises(FileError, match="exists already"):
        carom.io.convert(a, b)
    assert b.read_text() == "precious"
    carom.io.convert(a, b, overwrite=True)
    assert len(carom.io.read(b, ":")) == 4


def test_a_failed_convert_leaves_nothing_and_spoils_nothing(tmp_path):
    a = write(tmp_path / "a.h5md", make_frames(4))
    b = tmp_path / "b.extxyz"
    b.write_text("precious")
    with pytest.raises(InputError, match="at most 3"):
        carom.io.convert(a, b, overwrite=True)
    assert b.read_text() == "precious"
    assert sorted(os.listdir(tmp_path)) == ["a.h5md", "b.extxyz"]


@pytest.mark.parametrize("index", [-1, 2, "2", slice(1, 3), "1:3", ":", "::2"])
def test_read_selects_as_a_list_does(tmp_path, index):
    frames = make_frames(2)
    path = write(tmp_path / "a.extxyz", frames)
    plain = index
    if isinstance(index, str):
        parts = [int(part) if part else None for part in index.split(":")]
        plain = slice(*parts) if len(parts) > 1 else parts[0]
    expected = frames[plain]
    found = carom.io.read(path, index)
    if isinstance(expected, Frame):
        assert_same(expected, found)
    else:
        for a, b in zip(expected, found, strict=True):
            assert_same(a, b)


def test_read_names_what_is_not_there(tmp_path):
    path = write(tmp_path / "a.extxyz", make_frames(2))
    with pytest.raises(FileError, match="holds 4 frames; there is no frame 9"):
        carom.io.read(path, 9)
    with pytest.raises(InputError, match="a number or a slice"):
        carom.io.read(path, "last")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_modes_w_x_a(tmp_path, suffix):
    frames = make_frames(3, count=6)
    path = write(tmp_path / f"a{suffix}", frames[:2], "x")
    with pytest.raises(FileError, match="exists already"):
        carom.io.open(path, "x")
    assert len(carom.io.read(path, ":")) == 2
    write(path, frames[2:4], "a")
    assert [f.step for f in carom.io.read(path, ":")] == [f.step for f in frames[:4]]
    write(path, frames[4:], "w")
    assert [f.step for f in carom.io.read(path, ":")] == [f.step for f in frames[4:]]
    write(tmp_path / f"new{suffix}", frames[:1], "a")
    assert len(carom.io.read(tmp_path / f"new{suffix}", ":")) == 1


@pytest.mark.parametrize("keep", [0, 1, 3, 5])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_keep_drops_later_frames_as_if_they_had_never_been(tmp_path, suffix, keep):
    frames = make_frames(3, count=5)
    other = make_frames(3, count=5, seed=9)
    other = [dataclasses.replace(f, diameters=frames[0].diameters) for f in other]
    path = write(tmp_path / f"a{suffix}", frames)
    with carom.io.open(path, "a", keep=keep) as writer:
        assert len(writer) == keep
        for frame in other[keep:]:
            writer.write(frame)
    once = write(tmp_path / f"b{suffix}", frames[:keep] + other[keep:])
    for a, b in zip(carom.io.read(once, ":"), carom.io.read(path, ":"), strict=True):
        assert_same(a, b)
    if suffix == ".extxyz":
        assert path.read_bytes() == once.read_bytes()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_keep_more_than_there_is_changes_nothing(tmp_path, suffix):
    path = write(tmp_path / f"a{suffix}", make_frames(3, count=2))
    before = path.read_bytes()
    with pytest.raises(FileError, match="holds 2 complete frames, and 3 were to be kept"):
        carom.io.open(path, "a", keep=3)
    with pytest.raises(FileError, match="does not exist"):
        carom.io.open(tmp_path / f"none{suffix}", "a", keep=1)
    assert path.read_bytes() == before


def test_wrong_modes_and_keeps_are_input_errors(tmp_path):
    path = write(tmp_path / "a.extxyz", make_frames(3))
    for mode, keep in (("rw", None), ("w", 1), ("r", 1), ("a", -1)):
        with pytest.raises(InputError):
            carom.io.open(path, mode, keep=keep)
    with pytest.raises(InputError, match=r"\.pdb.*\.h5md"):
        carom.io.open(tmp_path / "a.pdb", "w")
    assert len(carom.io.read(path, ":")) == 4


@pytest.mark.parametrize("reopen", [False, True])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_frames_of_one_file_are_alike(tmp_path, suffix, reopen):
    path = write(tmp_path / f"a{suffix}", make_frames(2, count=1))
    with carom.io.open(path, "a" if reopen else "w") as writer:
        if not reopen:
            writer.write(make_frames(2)[0])
        for wrong in (make_frames(2, n=4)[0], make_frames(3)[0], make_frames(2, images=False)[0]):
            with pytest.raises(InputError, match="write it to another file"):
                writer.write(wrong)
    assert len(carom.io.read(path, ":")) == 1


def test_h5md_keeps_one_frame_in_memory(tmp_path):
    """HDF5 keeps up to eight MiB of each data set by default."""
    frame = make_frames(3)[0]
    path = tmp_path / "run.h5md"
    with carom.io.open(path, "w") as writer:
        writer.write(frame)
        kept = [_cache(writer, name) for name in ("position", "velocity")]
    with carom.io.open(path) as reader:
        kept += [_cache(reader, name) for name in ("position", "velocity")]
    assert kept == 2 * [frame.positions.nbytes, frame.velocities.nbytes]


def _cache(file, name):
    """Return how many bytes of a data set HDF5 keeps in memory."""
    return file._store.columns[name].id.get_access_plist().get_chunk_cache()[1]


def test_frames_must_belong_to_the_scene(tmp_path):
    class Scene:
        n, dimension = 5, 3

    with (
        carom.io.open(tmp_path / "a.h5md", "w", Scene()) as writer,
        pytest.raises(InputError, match="5 components"),
    ):
        writer.write(make_frames(3)[0])


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_missing_folder_and_foreign_files_are_file_errors(tmp_path, suffix):
    folder, foreign = tmp_path / f"folder{suffix}", tmp_path / f"foreign{suffix}"
    folder.mkdir()
    foreign.write_text("The quick brown fox\n" * 100)
    for ask, text in (
        (lambda: carom.io.read(tmp_path / f"none{suffix}"), "does not exist"),
        (lambda: carom.io.read(folder), "is a folder"),
        (lambda: carom.io.open(folder, "w"), "is a folder"),
        (lambda: carom.io.read(foreign), "not a readable|cannot be read as XYZ"),
        (lambda: carom.io.open(foreign, "a", keep=1), None),
        (lambda: carom.io.open(tmp_path / "no" / f"a{suffix}", "w"), r"folder .* does not exist"),
    ):
        with pytest.raises(FileError, match=text):
            ask()
    assert foreign.read_text().startswith("The quick brown fox")


def test_hdf5_of_others_needs_a_box(tmp_path):
    with h5py.File(tmp_path / "a.h5md", "w") as file:
        file["particles/trajectory/position/value"] = np.zeros((2, 3, 3))
    with pytest.raises(FileError, match="holds no box"):
        carom.io.open(tmp_path / "a.h5md")


def test_a_newer_layout_is_refused(tmp_path):
    path = write(tmp_path / "a.h5md", make_frames(2))
    with h5py.File(path, "r+") as file:
        file["parameters/carom"].attrs["layout"] = 99
    with pytest.raises(FileError, match="99, newer"):
        carom.io.open(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_truncated_anywhere_is_a_file_error_or_whole_frames(tmp_path, suffix):
    """A file cut at any byte never yields a frame that was not written."""
    frames = make_frames(2, count=3, n=3)
    content = write(tmp_path / f"a{suffix}", frames).read_bytes()
    expected = carom.io.read(tmp_path / f"a{suffix}", ":")
    path = tmp_path / f"cut{suffix}"
    refused = 0
    for size in np.linspace(0, len(content) - 1, 60).astype(int):
        path.write_bytes(content[:size])
        try:
            found = carom.io.read(path, ":")
        except FileError:
            refused += 1
        else:
            for a, b in zip(expected, found, strict=False):
                assert_same(a, b)
    assert refused > 30


def test_rebuild_makes_the_h5md_anew_from_a_torn_extxyz(tmp_path):
    frames = make_frames(3, count=4)
    source = write(tmp_path / "a.extxyz", frames)
    source.write_bytes(source.read_bytes()[:-20])
    target = tmp_path / "a.h5md"
    target.write_bytes(b"\x89HDF\r\n\x1a\n destroyed")
    with pytest.raises(FileError, match=r"carom\.io\.rebuild"):
        carom.io.open(target, "a", keep=2)
    with pytest.raises(FileError, match="holds 3 complete frames, and 4"):
        carom.io.rebuild(source, target, 4)
    assert carom.io.rebuild(source, target, 0) == 0
    assert len(carom.io.open(write(target, frames[:1], "a"))) == 1
    assert carom.io.rebuild(source, target, 2) == 2
    for a, b in zip(frames[:2], carom.io.read(target, ":"), strict=True):
        assert_same(a, b)


def fill(path):
    """Write to a disk that has no room for all."""
    import resource

    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
    with pytest.raises(FileError, match=r"^[^\n]*cannot be written[^\n]*$"):
        write(path, make_frames(3, count=50, n=200))


@pytest.mark.needs("Linux")
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_file_that_cannot_grow_is_a_file_error(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    assert forked.status(fill, path) == 0
    if suffix != ".gsd":  # the frame that did not fit was taken back
        expected = make_frames(3, count=50, n=200)
        found = carom.io.read(path, ":")
        assert len(found) > 2
        for a, b in zip(expected, found, strict=False):
            assert_same(a, b)


def write_for_ever(folder, reports):
    """Write frames to two files, and report each that is complete in both."""
    frames = endless(make_frames(3, count=10, n=300))
    with carom.io.open(folder / "a.extxyz", "w") as text, carom.io.open(folder / "a.h5md", "w") as native:
        for frame in frames:
            text.write(frame)
            native.write(frame)
            os.write(reports, b".")


@pytest.mark.needs("Unix")
@pytest.mark.parametrize("seed", range(3))
def test_kill_9_leaves_files_that_open_and_continue(tmp_path, seed):
    told, reports = os.pipe()
    child = forked.begun(write_for_ever, tmp_path, reports)
    os.close(reports)
    os.read(told, 1)
    time.sleep(np.random.default_rng(seed).uniform(0.0, 0.15))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    with open(told, "rb") as file:
        reported = 1 + len(file.read())

    frames = list(itertools.islice(endless(make_frames(3, count=10, n=300)), reported + 1))
    with carom.io.open(tmp_path / "a.extxyz", "a") as text:
        assert len(text) >= reported
    with carom.io.open(tmp_path / "a.h5md", "a", keep=reported) as native:
        native.write(frames[reported])
    with carom.io.open(tmp_path / "a.extxyz", "a", keep=reported) as text:
        text.write(frames[reported])
    for name in ("a.extxyz", "a.h5md"):
        with carom.io.open(tmp_path / name) as reader:
            assert len(reader) == reported + 1
            for k in {0, reported // 2, reported - 1, reported}:
                assert_same(frames[k], reader[k])


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_ctrl_c_waits_for_the_frame(tmp_path, suffix, monkeypatch):
    frames = make_frames(3)
    writer = carom.io.open(tmp_path / f"a{suffix}", "w")
    append = writer._append

    def interrupted(frame):
        signal.raise_signal(signal.SIGINT)
        append(frame)

    monkeypatch.setattr(writer, "_append", interrupted)
    with pytest.raises(KeyboardInterrupt):
        writer.write(frames[0])
    assert len(writer) == 1
    monkeypatch.undo()
    writer.write(frames[1])
    writer.close()
    assert [f.step for f in carom.io.read(tmp_path / f"a{suffix}", ":")] == [0, 37]


def test_no_data_set_is_gone_through_element_by_element(tmp_path, monkeypatch):
    """`"value" in dataset` compares every element in a call of its own: 11.7 s at N = 10^6."""

    def iterate(self):
        raise AssertionError("a data set was iterated")

    monkeypatch.setattr(h5py.Dataset, "__iter__", iterate)
    frames = make_frames(3, count=2)
    path = write(tmp_path / "a.h5md", frames[:1])
    write(path, frames[1:], "a")
    assert_same(frames[1], carom.io.read(path))


class FullOnce:
    """A file on a disk that is full in the middle of one write."""

    def __init__(self, file):
        self._file, self._left = file, 1000

    def write(self, part):
        if self._left == 0:
            self._left = -1
            raise OSError(28, "No space left on device")
        if self._left > 0:
            part, self._left = part[: self._left], 0
        return self._file.write(part)

    def __getattr__(self, name):
        return getattr(self._file, name)


def test_the_frame_after_one_that_did_not_fit_follows_the_last_whole_one(tmp_path):
    path, frames = tmp_path / "a.extxyz", make_frames(3, count=3, n=50)
    with carom.io.open(path, "w") as writer:
        writer.write(frames[0])
        writer._file = FullOnce(writer._file)
        with pytest.raises(FileError, match="No space"):
            writer.write(frames[1])
        writer.write(frames[2])
    first, last = carom.io.read(path, ":")
    assert_same(first, frames[0])
    assert_same(last, frames[2])
