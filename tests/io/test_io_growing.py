"""Files that a run is writing: others read what is whole, nobody else writes, and nothing is lost."""

import dataclasses
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from helpers import forked
from helpers.events import INITIAL, assert_events, cut, make_events
from helpers.frames import SUFFIXES, assert_same, make_frames, write
from helpers.scripts import python

import carom
from carom.errors import FileError
from carom.io import checkpoint, hdf5, locks
from carom.io.events import EventLog, read_events, read_initial
from carom.io.locks import WriteLock, steady, under_way
from carom.paths import replacing

COUNT, FEW = 4000, 20


def frames_of_a_run():
    """Return frames that differ, of which the writer takes one after the other."""
    return make_frames(3, count=FEW, n=60)


def written(path):
    """Write frames, or events, until this process is killed."""
    if path.endswith("events.h5"):
        events = make_events(100 * COUNT)
        with EventLog(path, INITIAL) as log:
            for k in range(COUNT):
                log.append(*cut(events, 100 * k, 100 * k + 100))
        return
    frames = frames_of_a_run()
    with carom.io.open(path, "w") as writer:
        for k in range(COUNT):
            writer.write(dataclasses.replace(frames[k % FEW], step=k, time=float(k)))


class Growing:
    """A process that writes a file."""

    def __init__(self, path: Path):
        self.path = path
        self.process = forked.begun(written, str(path))

    def __enter__(self):
        while not self.path.exists() or self.path.stat().st_size < 200_000:
            assert not self.is_over()
            time.sleep(0.02)
        return self

    def __exit__(self, *_):
        os.kill(self.process, signal.SIGKILL)
        os.waitpid(self.process, 0)

    def is_over(self):
        return os.waitid(os.P_PID, self.process, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


@pytest.mark.needs("Linux")
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_trajectory_that_grows_is_read_as_far_as_it_is_whole(tmp_path, suffix):
    seen = []
    with Growing(tmp_path / f"a{suffix}") as growing:
        while len(seen) < 25 or seen[-1] == seen[0]:
            with carom.io.open(growing.path) as reader:
                frame = reader[len(reader) - 1]
                assert frame.step == len(reader) - 1
                assert reader[0].step == 0
                seen.append(len(reader))
            assert not growing.is_over(), "it was over before it was read"
    assert seen == sorted(seen)
    assert seen[0] > 0
    # What is whole is what was written.
    [right] = [each for k, each in enumerate(frames_of_a_run()) if k == (seen[-1] - 1) % FEW]
    if suffix != ".gsd":
        np.testing.assert_array_equal(frame.positions, right.positions)


@pytest.mark.needs("Linux")
def test_an_event_log_that_grows_is_read_as_far_as_it_is_whole(tmp_path):
    right = make_events(100 * COUNT)
    with Growing(tmp_path / "events.h5") as growing:
        for _ in range(15):
            found = read_events(growing.path)
            assert len(found.i) > 0
            assert_events(cut(right, 0, len(found.i)), found)
            np.testing.assert_array_equal(read_initial(growing.path)["box"], INITIAL["box"])
        assert not growing.is_over(), "it was over before it was read"


@pytest.mark.needs("Linux")
@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("mode", ["a", "w"])
def test_what_another_process_writes_is_left_to_it(tmp_path, suffix, mode):
    with Growing(tmp_path / f"a{suffix}") as growing:
        # Of HDF5 the size is no measure: a file is extended in advance, and cut back.
        with carom.io.open(growing.path) as reader:
            before = len(reader)
        with pytest.raises(FileError, match="is being written by another process"):
            carom.io.open(growing.path, mode)
        with carom.io.open(growing.path) as reader:
            assert len(reader) >= before > 0
    # The mark ends with the process, however it ends.
    assert not under_way(growing.path)
    carom.io.open(growing.path, "a").close()


@pytest.mark.needs("Linux")
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_reader_keeps_no_writer_out_and_a_writer_leaves_no_mark(tmp_path, suffix):
    frames = make_frames(2, count=3)
    path = write(tmp_path / f"a{suffix}", frames[:1])
    assert not under_way(path)
    with carom.io.open(path) as reader:
        assert not under_way(path)
        with carom.io.open(path, "a", keep=1) as writer:
            assert under_way(path)
            writer.write(frames[1])
        assert not under_way(path)
        assert reader[0].step == frames[0].step
    with pytest.raises(FileError):
        carom.io.open(path, "a", keep=9)
    assert not under_way(path)
    assert len(carom.io.read(path, ":")) == 2


@pytest.mark.needs("Linux")
def test_a_writer_waits_for_a_reader_but_not_for_ever(tmp_path, monkeypatch):
    sleep, waits = time.sleep, []
    monkeypatch.setattr(time, "sleep", lambda seconds: (waits.append(seconds), sleep(seconds)))
    write_lock = WriteLock(tmp_path / "file")
    with steady(tmp_path / "file"):
        begin = time.monotonic()
        with write_lock.changing():
            waited = time.monotonic() - begin
    assert waited >= locks._WAIT
    assert waits
    waits.clear()
    with write_lock.changing():
        assert not waits  # nobody reads it now
    write_lock.close()
    write_lock.close()
    assert not under_way(tmp_path / "file")
    write_lock = WriteLock(tmp_path / "file")
    del write_lock  # by whoever forgets to close it
    assert not under_way(tmp_path / "file")


@pytest.mark.needs("Linux")
@pytest.mark.parametrize("suffix", [".h5md", ".gsd"])
def test_a_file_that_is_written_and_cannot_be_read_is_not_called_damaged(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"half of a header")
    with pytest.raises(FileError, match="not a readable"):
        carom.io.open(path)
    write_lock = WriteLock(path)
    with pytest.raises(FileError, match="is being written, and cannot be read yet") as caught:
        carom.io.open(path)
    assert "damaged" not in str(caught.value)
    write_lock.close()


def test_where_there_are_no_locks_a_file_that_has_just_changed_counts_as_written(tmp_path, monkeypatch):
    monkeypatch.setattr(locks.sys, "platform", "plan9")
    path = write(tmp_path / "a.extxyz", make_frames(2))
    assert under_way(path)
    os.utime(path, (0, 0))
    assert not under_way(path)
    with carom.io.open(path, "a") as one, carom.io.open(path, "a") as other:
        assert len(one) == len(other) == 4


ENDS = {
    "no newline": lambda whole: whole[:-1],
    "half a frame": lambda whole: whole + whole[: len(whole) // 5],
    "half a line": lambda whole: whole[:-9],
    "Windows": lambda whole: whole.replace(b"\n", b"\r\n"),
    "Windows without a newline": lambda whole: whole.replace(b"\n", b"\r\n")[:-2],
    "blank lines": lambda whole: whole + b"\n\n",
    "blank lines of blanks": lambda whole: whole + b"  \n \t\n ",
}


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("end", ENDS)
def test_appending_keeps_every_frame_or_leaves_the_file_alone(tmp_path, end, count):
    frames = make_frames(3, count=count + 1, n=5)
    path = write(tmp_path / "a.extxyz", frames[:count])
    path.write_bytes(ENDS[end](path.read_bytes()))
    before = path.read_bytes()
    lost = 0
    keep = None
    if end == "half a line" or end.endswith("newline"):
        lost = 1
        torn = f"ends inside frame {count - 1}, after {count - 1} complete"
        with pytest.raises(FileError, match="add a newline" if end.endswith("newline") else torn):
            carom.io.read(path)
        if end.endswith("newline") or count == 1:
            with pytest.raises(FileError, match="was left as it is"):
                carom.io.open(path, "a")
            assert path.read_bytes() == before
            keep = count - 1  # as it says
    with carom.io.open(path, "a", keep=keep) as writer:
        assert len(writer) == count - lost
        writer.write(frames[count])
    found = carom.io.read(path, ":")
    for a, b in zip([*frames[: count - lost], frames[count]], found, strict=True):
        assert_same(a, b)


@pytest.mark.needs("a user who is not root")
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_appending_to_what_may_only_be_read_is_refused(tmp_path, suffix):
    path = write(tmp_path / f"a{suffix}", make_frames(2))
    path.chmod(0o444)
    before = path.read_bytes()
    with pytest.raises(FileError, match="Permission denied"):
        carom.io.open(path, "a")
    assert path.read_bytes() == before


def test_a_write_that_failed_before_is_named_with_its_cause(tmp_path, monkeypatch):
    """Whoever asks again hears why, too."""
    frames = make_frames(3)

    def full(self, offset, rest):
        raise OSError(28, "No space left on device")

    with carom.io.open(tmp_path / "a.h5md", "w") as writer, EventLog(tmp_path / "e.h5", INITIAL) as log:
        writer.write(frames[0])
        log.append(*make_events(10))
        with monkeypatch.context() as patch:
            patch.setattr(hdf5._Staged, "_put", full)
            for ask in (lambda: writer.write(frames[1]), lambda: log.append(*make_events(10, epoch=9))):
                with pytest.raises(FileError, match="cannot be written: No space left on device"):
                    ask()
        for ask in (lambda: writer.write(frames[1]), lambda: log.append(*make_events(10, epoch=9))):
            with pytest.raises(FileError, match=r"an earlier write .* failed \(No space left on device\)"):
                ask()
    assert len(carom.io.read(tmp_path / "a.h5md", ":")) == 1
    assert len(read_events(tmp_path / "e.h5").i) == 10


def write_to_a_full_disk(folder, limit):
    """Write all that can be written, where files end at a limit."""
    import resource

    os.chdir(folder)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    scene = carom.Scene.random(2000, 0.1, 2, seed=1)
    sim = carom.Simulation(scene, seed=1)
    frame = sim.frame()
    log = carom.Simulation(scene, seed=1, event_log="events.h5")
    log.run(collisions=10)  # compiled code is kept in files, too
    sim.save("old.h5")
    old = Path("old.h5").read_bytes()
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    def trajectory(name):
        write(name, [frame])

    def logging():
        log.run(collisions=20000)
        log.close()

    def packed():
        checkpoint.LARGE = 0.0
        sim.save("packed.h5")

    saves = [lambda: sim.save("new.h5"), lambda: sim.save("old.h5"), packed]
    for attempt in (*saves, lambda: trajectory("a.h5md"), lambda: trajectory("a.extxyz"), logging):
        with pytest.raises(FileError, match="File too large"):
            attempt()
    with pytest.raises(FileError):
        trajectory("a.gsd")
    assert Path("old.h5").read_bytes() == old
    assert not [path for path in os.listdir() if path.startswith(".")]


@pytest.mark.needs("Linux")
@pytest.mark.parametrize("limit", [600, 5000, 30_000])
def test_a_full_disk_is_a_sentence_wherever_it_fills_up(tmp_path, limit):
    assert forked.status(write_to_a_full_disk, tmp_path, limit) == 0


def logged_run(tmp_path):
    """Return a run with a log, saved, and then continued."""
    scene = carom.Scene.random(8, 0.1, 2, seed=1)
    sim = carom.Simulation(scene, seed=1, event_log=tmp_path / "events.h5")
    sim.run(collisions=200)
    sim.save(tmp_path / "state.h5")
    sim.run(collisions=300)
    sim._state.flush_log()
    return sim


def test_looking_at_a_checkpoint_leaves_the_log_of_its_run_alone(tmp_path):
    sim = logged_run(tmp_path)
    before = (tmp_path / "events.h5").read_bytes()
    with carom.Simulation.load(tmp_path / "state.h5") as other:
        assert other.collisions == 200
        other.frame()
        other.save(tmp_path / "copy.h5")
    assert (tmp_path / "events.h5").read_bytes() == before
    sim.run(collisions=100)
    sim.close()
    assert len(read_events(tmp_path / "events.h5").i) == 600
    # The copy continues the log as the first checkpoint does: what comes after it is cut off.
    with carom.Simulation.load(tmp_path / "copy.h5") as other:
        other.run(collisions=10)
    assert len(read_events(tmp_path / "events.h5").i) == 210
    # So does a run that goes on for a moment in which nothing happens.
    with carom.Simulation.load(tmp_path / "copy.h5") as other:
        other.run(time=1e-12)
        assert other.collisions == 200
    assert len(read_events(tmp_path / "events.h5").i) == 200


_LOOKS = """
import os
import carom
from helpers.plain import uncompiled
with uncompiled():
    sim = carom.Simulation.load("state.h5")
    os.chdir("/")
    try:
        sim.run(collisions=50)
        sim.close()
    except carom.FileError as error:
        print(error)
"""


def looked(folder):
    """Go on elsewhere from the checkpoint of a run with a log; return what this says."""
    paths = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return python("-c", _LOOKS, cwd=folder, PYTHONPATH=paths)


@pytest.mark.needs("Linux")
def test_a_log_is_not_cut_while_its_run_goes_on_elsewhere(plain, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sim = logged_run(Path())  # what goes on with it leaves the folder after it has loaded this path
    before = (tmp_path / "events.h5").read_bytes()
    assert "is being written by another process" in looked(tmp_path)
    assert (tmp_path / "events.h5").read_bytes() == before
    sim.close()
    assert looked(tmp_path) == ""
    assert len(read_events(tmp_path / "events.h5").i) == 250


@pytest.mark.parametrize(
    ("error", "found", "text"),
    [
        (OSError(28, "No space left on device"), FileError, "No space left"),
        (RuntimeError("x"), RuntimeError, "x"),
    ],
)
def test_a_table_that_cannot_be_written_says_why_and_a_bug_keeps_its_name(tmp_path, error, found, text):
    """What stands there stays as it is."""

    def save(temporary):
        temporary.write_text("half")
        raise error

    (tmp_path / "g.csv").write_text("old")
    with pytest.raises(found, match=text), replacing(tmp_path / "g.csv") as temporary:
        save(temporary)
    assert (tmp_path / "g.csv").read_text() == "old"
    assert os.listdir(tmp_path) == ["g.csv"]
