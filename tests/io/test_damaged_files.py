"""Damaged and hostile files: no changed number is read, no other file is opened, nothing but one sentence."""

import contextlib
import dataclasses
import hashlib
import os
import pickle
import warnings

import h5py
import numpy as np
import pytest
from helpers.events import INITIAL, assert_events, cut, make_events
from helpers.frames import assert_same, make_frames, write
from hypothesis import HealthCheck, given, settings, strategies as st
from typer.testing import CliRunner

import carom.io
from carom.cli import app
from carom.errors import CaromError, CaromWarning, FileError, InputError
from carom.io import checkpoint, hdf5
from carom.io.events import EventLog, read_events, read_initial
from carom.io.hdf5 import Output
from carom.io.locks import WriteLock
from carom.io.validation import flaw
from carom.observables import RDF
from carom.simulation.replay import Replay, replay

FLIPS = 50
GROUP = "particles/trajectory"
EXAMPLES = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def mixture(count=3):
    """Frames with every field that a file can hold."""
    frames = make_frames(3, count=count)
    return [dataclasses.replace(f, species=np.arange(f.n) % 2, species_names=("a", "b")) for f in frames]


def flipped(content, rng, begin=0, end=None):
    """Return the bytes with one bit turned."""
    changed = bytearray(content)
    changed[rng.integers(begin, len(content) if end is None else end)] ^= 1 << rng.integers(8)
    return bytes(changed)


def chunks(path, name):
    """Return where the bytes of a data set lie."""
    found = []
    with h5py.File(path) as file:
        file[name].id.chunk_iter(found.append)
    return [(chunk.byte_offset, chunk.byte_offset + chunk.size) for chunk in found]


# ------------------------------------------------------------------------------------------------ one bit


def test_no_flipped_bit_changes_a_frame_of_h5md(tmp_path):
    frames = mixture()
    whole = write(tmp_path / "a.h5md", frames).read_bytes()
    rng, path, refused = np.random.default_rng(0), tmp_path / "b.h5md", 0
    for _ in range(FLIPS):
        path.write_bytes(flipped(whole, rng))
        try:
            found = carom.io.read(path, ":")
        except FileError:
            refused += 1
            continue
        for a, b in zip(frames, found, strict=True):
            assert_same(a, b)
            np.testing.assert_array_equal(a.species, b.species)
    assert refused > FLIPS // 10  # most of such a small file is the empty rest of chunks of times


@pytest.mark.parametrize(
    "name", ["position/value", "velocity/value", "image/value", "position/step", "position/time", "diameter"]
)
def test_every_flipped_bit_in_the_data_of_h5md_is_refused(tmp_path, name):
    n = 9000 if name == "diameter" else 200  # fewer would lie in the header, which has a checksum of its own
    path = write(tmp_path / "a.h5md", make_frames(3, count=2, n=n))
    whole, places = path.read_bytes(), chunks(path, f"{GROUP}/{name}")
    rng = np.random.default_rng(1)
    for _ in range(FLIPS // 3):
        begin, end = places[rng.integers(len(places))]
        path.write_bytes(flipped(whole, rng, begin, end))
        with pytest.raises(FileError):
            carom.io.read(path, ":")


def logged(tmp_path, count=1000):
    path = tmp_path / "e.h5"
    with EventLog(path, INITIAL) as log:
        log.append(*make_events(count))
    return path


def test_no_flipped_bit_changes_an_event(tmp_path):
    path = logged(tmp_path)
    whole, events = path.read_bytes(), make_events(1000)
    rng, refused = np.random.default_rng(2), 0
    places = [chunks(path, name)[0] for name in events._fields[:6]]
    for k in range(2 * FLIPS):
        path.write_bytes(flipped(whole, rng, *(places[k % 6] if k < FLIPS else (0, None))))
        try:
            assert_events(events, read_events(path))
            for name, array in read_initial(path).items():
                np.testing.assert_array_equal(array, INITIAL[name])
        except FileError:
            refused += 1
    assert refused >= FLIPS  # all that hit a column


def test_appending_refuses_a_file_with_a_flipped_bit_among_what_is_kept(tmp_path):
    trajectory = write(tmp_path / "a.h5md", make_frames(3, n=200))
    log = logged(tmp_path)
    rng = np.random.default_rng(3)
    for path, name in ((trajectory, f"{GROUP}/position/value"), (log, "impulse")):
        path.write_bytes(flipped(path.read_bytes(), rng, *chunks(path, name)[0]))
        before = path.read_bytes()
        with pytest.raises(FileError):
            carom.io.open(path, "a", keep=2) if path is trajectory else EventLog(path, keep=1000)
        assert path.read_bytes() == before


@pytest.mark.parametrize("name", ["epoch", "time", "i", "j", "image", "impulse", "initial"])
def test_a_log_of_another_run_is_refused_whatever_column_differs(tmp_path, name):
    """The checksums of HDF5 are right: the values were written, by somebody else."""
    path = tmp_path / "e.h5"
    with EventLog(path, INITIAL) as log:
        log.append(*make_events(1000))
        sums = log.sums
    EventLog(path, keep=1000, sums=sums).close()
    with h5py.File(path, "r+") as file:
        data = file["initial/positions"] if name == "initial" else file[name]
        if data.dtype.kind == "f":
            data[0] = np.nextafter(data[0], np.inf)
        else:
            data[999] += 1
    before = path.read_bytes()
    with pytest.raises(FileError, match=f"its {name} is not what was written"):
        EventLog(path, keep=1000, sums=sums)
    assert path.read_bytes() == before


def reworded(content, rng):
    """Return the text with another word in the place of one."""
    words = content.split(b" ")
    others = (b"nan", b"1e999", b"", b"X", b"-1", b"0", b"9" * 20, b'"', b"T", b"\0", b"1_0", "é".encode())
    words[rng.integers(len(words))] = others[rng.integers(len(others))]
    return b" ".join(words)


@pytest.mark.parametrize("harm", [flipped, reworded])
def test_text_without_a_digest_is_refused_or_still_a_frame(tmp_path, harm):
    whole = write(tmp_path / "a.extxyz", mixture(1)).read_bytes()
    rng, path = np.random.default_rng(4), tmp_path / "b.extxyz"
    for _ in range(2 * FLIPS):
        path.write_bytes(harm(whole, rng))
        try:
            found = carom.io.read(path, ":")
        except FileError:
            continue
        assert [flaw(frame) for frame in found] == [None] * len(found)


# ------------------------------------------------------------------------------------------------ kills


@contextlib.contextmanager
def states_of(path):
    """Yield a list that gets every state of a file on the disk, with each write also half done."""
    states, whole = [], hdf5._Staged._put

    def torn(self, offset, rest):
        for part in (rest[: len(rest) // 2], rest[len(rest) // 2 :]):
            whole(self, offset, part)
            offset += len(part)
            states.append(path.read_bytes())

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hdf5._Staged, "_put", torn)
        yield states


def test_a_kill_between_any_two_writes_loses_no_frame(tmp_path):
    """Every state opens with the old frames or the new."""
    path, killed = tmp_path / "a.h5md", []
    frames = make_frames(3, count=3, n=20)
    with carom.io.open(path, "w") as writer:
        writer.write(frames[0])
        for done in (1, 2):
            with states_of(path) as states:
                writer.write(frames[done])
            killed += [(done, content) for content in states]
    assert len(killed) > 20
    for done, content in killed[::7]:
        path.write_bytes(content)
        with carom.io.open(path) as reader:
            assert len(reader) in (done, done + 1)
            for a, b in zip(frames, reader, strict=False):
                assert_same(a, b)
        with carom.io.open(path, "a", keep=done) as writer:
            writer.write(frames[2])
        assert_same(frames[done - 1], carom.io.read(path, done - 1))


@pytest.mark.parametrize("at", [0, 90, 95])  # within, up to the end, and beyond it
def test_a_kill_between_any_two_writes_leaves_the_old_bytes_or_the_new(tmp_path, at):
    path, old = tmp_path / "a", bytes(100)
    path.write_bytes(old)
    with states_of(path) as states, hdf5._Staged(path, "r+", WriteLock(path)) as staged:
        staged.seek(at)
        staged.write(b"x" * 10)
        staged.commit()
    new = path.read_bytes()
    assert new == old[:at] + b"x" * 10 + old[at + 10 :]
    for content in states:
        path.write_bytes(content)
        with hdf5._Staged(path, "r") as staged:
            assert staged.read()[:100] in (old, new[:100])


# ------------------------------------------------------------------------------------------------ ways out


def secret(tmp_path):
    path = tmp_path / "secret"
    path.write_bytes(bytes(range(1, 249)) * 100)
    return path


def external(file, name, tmp_path):
    shape, dtype = file[name].shape, file[name].dtype
    del file[name]
    size = int(np.prod(shape)) * dtype.itemsize
    file.create_dataset(name, shape=shape, dtype=dtype, external=[(str(secret(tmp_path)), 0, size)])


def virtual(file, name, tmp_path):
    shape, dtype = file[name].shape, file[name].dtype
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = np.ones(shape, dtype)
    layout = h5py.VirtualLayout(shape=shape, dtype=dtype)
    layout[...] = h5py.VirtualSource(tmp_path / "other.h5", "x", shape=shape)
    del file[name]
    file.create_virtual_dataset(name, layout)


def external_link(file, name, tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = file[name][()]
    del file[name]
    file[name] = h5py.ExternalLink(str(tmp_path / "other.h5"), "x")


def soft_link(file, name, tmp_path):
    file.move(name, "elsewhere")
    file[name] = h5py.SoftLink("/elsewhere")


WAYS_OUT = [external, virtual, external_link, soft_link]


def readers(path, tmp_path):
    """Return everything that opens this trajectory."""
    return [
        lambda: carom.io.read(path),
        lambda: carom.io.open(path),
        lambda: carom.io.open(path, "a"),
        lambda: carom.io.open(path, "a", keep=1),
        lambda: carom.io.convert(path, tmp_path / "out.extxyz"),
        lambda: carom.io.rebuild(path, tmp_path / "out.extxyz", 1),
        lambda: carom.io.universe(path),
    ]


@pytest.mark.parametrize("name", ["mass", "diameter", "velocity/value"])
@pytest.mark.parametrize("way", WAYS_OUT)
def test_no_path_leads_out_of_a_trajectory(tmp_path, way, name):
    path = write(tmp_path / "a.h5md", make_frames(3))
    with h5py.File(path, "r+") as file:
        way(file, f"{GROUP}/{name}", tmp_path)
    for read in readers(path, tmp_path):
        with pytest.raises(FileError, match=r"follows n|lies in another"):
            read()
    assert not (tmp_path / "out.extxyz").exists()


@pytest.mark.parametrize("way", WAYS_OUT)
def test_no_path_leads_out_of_an_event_log_or_a_checkpoint(tmp_path, way):
    path = logged(tmp_path)
    with h5py.File(path, "r+") as file:
        way(file, "initial/masses", tmp_path)
    for read in (read_events, read_initial, EventLog, Replay):
        with pytest.raises(FileError, match="follows n"):
            read(path)
    checkpoint.save(tmp_path / "c", {"x": np.arange(100.0)}, {})
    with h5py.File(tmp_path / "c", "r+") as file:
        way(file, "arrays/x", tmp_path)
    sign(tmp_path / "c")
    with pytest.raises(FileError, match="follows n"):
        checkpoint.load(tmp_path / "c")


def sign(path):
    """Put the right digest at the head of a changed checkpoint, as whoever means harm would."""
    content = path.read_bytes()[512:]
    line = f"carom-checkpoint 1 {len(content)} {hashlib.sha256(content).hexdigest()} written by carom x\n"
    path.write_bytes(line.encode().ljust(512, b"\0") + content)


def test_hdf5_files_that_do_not_end_are_refused_at_once(tmp_path):
    """10^12 frames of which none is stored; compressed zeros; groups that contain themselves."""
    path = write(tmp_path / "a.h5md", make_frames(3))
    whole = path.read_bytes()
    with h5py.File(path, "r+") as file:
        for name in ("position/value", "position/step", "position/time", "velocity/value", "image/value"):
            file[f"{GROUP}/{name}"].resize(10**12, axis=0)
        file[f"{GROUP}/box/edges/value"].resize(10**12, axis=0)
    with pytest.raises(FileError, match=r"declares \d+ chunks"):
        carom.io.read(path)
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file.create_dataset("x", shape=(10**9,), chunks=(10**6,), dtype="f4", compression="gzip")
    with pytest.raises(FileError, match="compressed"):
        carom.io.read(path)
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file["h5md/itself"] = file["h5md"]
    assert len(carom.io.read(path, ":")) == 4


def test_gsd_of_more_particles_than_bytes_is_refused_at_once(tmp_path):
    """Its library makes room for what is missing: for 4 billion particles 300 GB."""
    from gsd import fl

    path = write(tmp_path / "a.gsd", make_frames(3, count=1))
    whole = path.read_bytes()
    for value in (2**32 - 1, len(whole) + 1):
        with fl.open(str(path), "w", "gsd.hoomd", "hoomd", (1, 4)) as file:
            file.write_chunk("particles/N", np.array([value], np.uint32))
            file.write_chunk("log/carom/time", np.zeros(1))
            file.end_frame()
        with pytest.raises(FileError, match=r"announces \d+ particles"):
            carom.io.read(path)
    path.write_bytes(whole)
    assert carom.io.read(path).n == 13


def test_gsd_of_another_program_may_not_announce_more_particles_in_a_later_frame(tmp_path):
    import gsd.hoomd as hoomd

    with hoomd.open(str(tmp_path / "a.gsd"), "w") as file:
        for n in (2, 3, 100_000):
            frame = hoomd.Frame()
            frame.particles.N, frame.configuration.box = n, [4.0] * 3 + [0.0] * 3
            file.append(frame)
    with pytest.raises(FileError, match="frame 2 announces 100000 particles"):
        carom.io.open(tmp_path / "a.gsd")


def test_a_text_file_of_holes_is_refused_at_once(tmp_path):
    path = tmp_path / "a.extxyz"
    for head in (b"", b"3\n", write(path, make_frames(3, count=1)).read_bytes(), b"9" * 18 + b"\n"):
        path.write_bytes(head)
        os.truncate(path, 1 << 40)
        with pytest.raises(FileError):
            carom.io.read(path)


# ------------------------------------------------------------------------------------------------ fields


def put(file, name, values):
    del file[f"{GROUP}/{name}"]
    file[f"{GROUP}/{name}"] = values


def first(name, value):
    """Return an edit that sets the first number of a data set."""

    def edit(file):
        file[f"{GROUP}/{name}"][(0,) * file[f"{GROUP}/{name}"].ndim] = value

    return edit


BAD_FIELDS = {
    "NaN position": first("position/value", np.nan),
    "infinite velocity": first("velocity/value", np.inf),
    "mass -5": first("mass", -5.0),
    "mass 0": first("mass", 0.0),
    "diameter -1": first("diameter", -1.0),
    "edge 0": first("box/edges/value", 0.0),
    "edge -3": first("box/edges/value", -3.0),
    "NaN time": first("position/time", np.nan),
    "time that goes back": first("position/time", 1e9),
    "step -1": first("position/step", -1),
    "step that goes back": first("position/step", 10**9),
    "species -3": first("species", -3),
    "species without a name": first("species", 2),
    "steps in floats": lambda f: put(f, "position/step", np.full(3, 1e23)),
    "masses in int": lambda f: put(f, "mass", np.ones(13, int)),
    "images in int64": lambda f: put(f, "image/value", np.full((3, 13, 3), 2**40)),
    "species as texts": lambda f: put(f, "species", np.full(13, b"x")),
    "masses of others": lambda f: put(f, "mass", np.ones(12)),
    "a scalar mass": lambda f: put(f, "mass", 1.0),
    "a group of masses": lambda f: (f.pop(f"{GROUP}/mass"), f.create_group(f"{GROUP}/mass")),
    "no boundary": lambda f: f[f"{GROUP}/box"].attrs.pop("boundary"),
    "a boundary of one axis": lambda f: f[f"{GROUP}/box"].attrs.update(boundary=np.array([b"none"])),
    **{
        f"dimension {d}": lambda f, d=d: f["parameters/carom"].attrs.update(dimension=d)
        for d in (0, -1, 2**62, 4, 13, np.nan, "three", [1, 2])
    },
}


@pytest.mark.parametrize("case", BAD_FIELDS)
def test_a_field_that_no_frame_has_is_refused_by_reader_export_and_rdf(tmp_path, case):
    path = write(tmp_path / "a.h5md", mixture())
    with h5py.File(path, "r+") as file:
        BAD_FIELDS[case](file)
    with pytest.raises(FileError) as caught:
        carom.io.read(path, ":")
    assert "\n" not in str(caught.value)
    for command in (
        ["export", path, tmp_path / "b.extxyz"],
        ["measure", path, "rdf", "--out", tmp_path / "g"],
    ):
        done = CliRunner().invoke(app, [str(word) for word in command])
        assert (done.exit_code, type(done.exception)) == (2, SystemExit), done.exception
    assert os.listdir(tmp_path) == ["a.h5md"]


def word(column, new):
    """Return an edit that replaces a word of the first component."""

    def edit(text):
        first, second, row, rest = text.split("\n", 3)
        words = row.split(" ")
        words[column] = new
        return "\n".join([first, second, " ".join(words), rest])

    return edit


@pytest.mark.parametrize(
    "edit",
    [
        ("step=0", "step=100000000000000000000000"),
        ("step=0", "step=-1"),
        ("time=0.0", "time=nan"),
        ("time=0.0", "time=1e9"),
        ("dimension=3", "dimension=0"),
        ('pbc="T T T"', 'pbc="T"'),
        ("kind:I:1", "kind:R:1"),
        ("images:I:3", "images:I:-3"),
        ("pos:R:3", "pos:R:999999999999"),
        ('species_names="a,b"', 'species_names="a"'),
        *map(word, (-5, -5, -6, 7, 8), ("-3", "0.5", "3000000000", "-5", "-1")),
    ],
)
def test_a_word_that_no_frame_has_is_refused(tmp_path, edit):
    path = write(tmp_path / "a.extxyz", mixture())
    text = path.read_text()
    changed = text.replace(*edit, 1) if isinstance(edit, tuple) else edit(text)
    assert changed != text
    path.write_text(changed)
    with pytest.raises(FileError):
        carom.io.read(path, ":")


def ending_in(value, array):
    """Return a copy of an array, or number, that ends in a value."""
    array = np.array(array, dtype=float)
    array.reshape(-1)[-1] = value
    return array if array.ndim else float(array)


@pytest.mark.parametrize("suffix", [".h5md", ".extxyz", ".gsd"])
def test_what_readers_refuse_is_never_written(tmp_path, suffix):
    frame = mixture()[0]
    bad = [
        ("masses", -frame.masses), ("diameters", -frame.diameters), ("box", (-1.0, 5.0, 5.0)),
        ("species", frame.species - 1), ("step", -1), ("time", -1.0), ("images", np.full((13, 3), 2**40)),
        ("velocities", frame.velocities[:, :2]),
    ]  # fmt: skip
    reals = ("positions", "velocities", "box", "diameters", "masses", "time")
    infinite = [(name, ending_in(x, getattr(frame, name))) for name in reals for x in (np.nan, np.inf)]
    with carom.io.open(tmp_path / f"a{suffix}", "w") as writer:
        writer.write(frame)
        for name, value in bad + infinite:
            with pytest.raises(InputError, match=f"The frame's {name} "):
                writer.write(dataclasses.replace(frame, **{name: value}))
    assert len(carom.io.read(tmp_path / f"a{suffix}", ":")) == 1


def test_points_are_written_and_read(tmp_path):
    """Packings grow from diameters of zero."""
    frame = dataclasses.replace(mixture()[0], diameters=np.zeros(13))
    for suffix in (".h5md", ".extxyz"):
        assert_same(frame, carom.io.read(write(tmp_path / f"a{suffix}", [frame])))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("time", np.nan),
        ("time", -1.0),
        ("impulse", np.inf),
        ("epoch", -1),
        ("epoch", 99),
        ("i", -1),
        ("j", -1),
    ],
)
def test_an_event_that_no_run_has_is_refused(tmp_path, name, value):
    path = logged(tmp_path)
    with h5py.File(path, "r+") as file:
        file[name][500] = value
    with pytest.raises(FileError):
        read_events(path)
    with pytest.raises(FileError):
        EventLog(path, keep=600)
    assert_events(cut(make_events(1000), 0, 400), read_events(path, 0, 400))


# ------------------------------------------------------------------------------------------------ anything


@st.composite
def damages(draw):
    """A function that damages bytes: overwrites, cuts out, repeats."""
    kind, part = st.sampled_from(["set", "cut", "copy"]), st.floats(0, 1)
    steps = draw(st.lists(st.tuples(kind, part, part, st.binary(max_size=16)), min_size=1, max_size=4))

    def damage(content):
        changed = bytearray(content)
        for kind, here, there, data in steps:
            at = int(here * (len(changed) - 1))
            if kind == "set":
                changed[at : at + len(data)] = data
            elif kind == "cut":
                del changed[at : at + 1 + int(50 * there)]
            else:
                other = int(there * len(changed))
                changed[at:at] = changed[other : other + 100]
        return bytes(changed)

    return damage


@pytest.mark.parametrize("suffix", [".h5md", ".extxyz", ".gsd"])
@EXAMPLES
@given(damage=damages())
def test_any_damage_is_a_sentence_of_the_reader_of_export_and_of_rdf(tmp_path, suffix, damage):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(damage(write(path, mixture(2)).read_bytes()))
    target = tmp_path / ("b.extxyz" if suffix == ".h5md" else "b.h5md")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", CaromWarning)
        for use in (
            lambda: carom.io.convert(path, target, overwrite=True),
            lambda: RDF().over(carom.io.read(path, ":")),
            lambda: carom.io.open(path, "a").close(),
        ):
            with contextlib.suppress(CaromError):
                use()


@EXAMPLES
@given(damage=damages())
def test_any_damage_to_a_log_or_a_checkpoint_is_a_sentence(tmp_path, damage):
    log = logged(tmp_path, 50)
    log.write_bytes(damage(log.read_bytes()))
    checkpoint.save(tmp_path / "c", {"x": np.arange(9.0), "s": np.array(["a"])}, {"step": 7})
    (tmp_path / "c").write_bytes(damage((tmp_path / "c").read_bytes()))
    sign(tmp_path / "c")  # so that HDF5 sees it at all
    for read, path in (
        (read_events, log),
        (read_initial, log),
        (EventLog, log),
        (checkpoint.load, tmp_path / "c"),
    ):
        with contextlib.suppress(FileError):
            read(path)


HEADS = {
    ".h5md": b"\x89HDF\r\n\x1a\n", ".gsd": b"\xdb\x1d\x2a\x5f\x2e\xb0\x0f\xef", ".extxyz": b"3\n",
    ".h5": b"carom-checkpoint 1 3 ",
}  # fmt: skip


@pytest.mark.parametrize("suffix", HEADS)
@EXAMPLES
@given(data=st.data())
def test_random_bytes_are_file_errors_only(tmp_path, suffix, data):
    path = tmp_path / f"random{suffix}"
    path.write_bytes(data.draw(st.sampled_from([b"", HEADS[suffix]])) + data.draw(st.binary(max_size=600)))
    for read in (checkpoint.load, read_events, read_initial) if suffix == ".h5" else (carom.io.read,):
        with pytest.raises(FileError):
            read(path)


def test_an_output_that_is_refused_leaves_the_file_as_it_was(tmp_path):
    path = write(tmp_path / "a.h5md", make_frames(3))
    with h5py.File(path, "r+") as file:
        soft_link(file, f"{GROUP}/mass", tmp_path)
    before = path.read_bytes()
    with pytest.raises(ValueError, match="follows none"):
        Output(path, "r+")
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("masses", 0.0),
        ("radius", -1.0),
        ("images", 2**40),
        ("kind", -3),
        ("kind", 0.5),
        ("positions", np.nan),
    ],
)
def test_atoms_that_make_no_frame_are_refused(name, value):
    atoms = mixture()[0].to_ase()
    atoms.arrays[name] = np.full(atoms.arrays[name].shape, value)
    with pytest.raises(InputError):
        carom.io.from_ase(atoms)


# No file that is read can run code: pickles and arrays of objects are refused by every reader, unopened.


class Bomb:
    """What leaves a file behind when it is unpickled."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return (open, (str(self.mark), "w"))


READERS = {
    "io.read": lambda path: carom.io.read(path, ":"),
    "io.open": lambda path: carom.io.open(path, "r").__enter__()[0],
    "io.rebuild": lambda path: carom.io.rebuild(path, path.with_name(f"again{path.suffix}"), 1),
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
    with h5py.File(path, "w") as file:
        word = np.void(pickle.dumps(bomb))
        for name in ("particles/all/position/value", "state/rows", "positions", "events", "scene"):
            file[name] = word
        for name in ("version", "kind", "creator", "format"):
            file.attrs[name] = word


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("suffix", [".h5md", ".extxyz", ".gsd", ".h5", ".npy"])
@pytest.mark.parametrize("hide", [pickled, array_of_objects, pickle_inside])
def test_a_file_that_would_run_code_is_refused(tmp_path, reader, suffix, hide):
    path, mark = tmp_path / f"hostile{suffix}", tmp_path / "mark"
    hide(path, Bomb(mark))
    with pytest.raises(CaromError):
        READERS[reader](path)
    assert not mark.exists()


@pytest.mark.parametrize("hide", [pickled, array_of_objects])
def test_the_bomb_is_one(tmp_path, hide):
    path, mark = tmp_path / "hostile.npy", tmp_path / "mark"
    hide(path, Bomb(mark))
    np.load(path, allow_pickle=True)
    assert mark.exists()
