"""What holds of every format: it comes back as it was written, and what is cut is never read wrongly."""

import bz2
import gzip
import lzma
import re
import shlex
import subprocess
import warnings

import gsd.hoomd
import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

import carom
from carom.cli import app
from carom.errors import CaromError, CaromWarning, FileError, InputError
from carom.io.formats import FOREIGN

ROWS = ((1.5, 2.25, 3.125), (11.25, 12.5, 17.25))
"""Positions, whose digits are all needed."""
NUMBERED = "".join(f"{i} 1 {x} {y} {z}\n" for i, (x, y, z) in enumerate(ROWS, 1))
NAMED = "".join(f"Ar {x} {y} {z}\n" for x, y, z in ROWS)


def _dump(k):
    return (
        f"ITEM: TIME\n{k / 4}\nITEM: TIMESTEP\n{100 * k}\nITEM: NUMBER OF ATOMS\n2\n"
        f"ITEM: BOX BOUNDS pp pp pp\n0 20\n0 20\n0 20.5\nITEM: ATOMS id type x y z\n{NUMBERED}"
    )


def _data(k):
    head = (
        "a start\n\n2 atoms\n1 atom types\n\n0 20 xlo xhi\n0 20 ylo yhi\n0 20.5 zlo zhi\n\nMasses\n\n1 2.5\n"
    )
    return f"{head}\nAtoms # atomic\n\n{NUMBERED}\nVelocities\n\n1 0.5 0.25 1.5\n2 -0.5 0.25 -1.75\n"


def _xyz(k):
    return "2\n\n" + NAMED


def _extxyz(k):
    return f'2\nLattice="20 0 0 0 20 0 0 0 20.5" Properties=species:S:1:pos:R:3 time={k / 4}\n' + NAMED


def _gro(k):
    rows = "".join(
        f"    1Ar      A    {i}" + "".join(f"{c:8.3f}" for c in row) + "\n" for i, row in enumerate(ROWS)
    )
    return f"gas t= {k / 4}\n    2\n{rows}  20.00000  20.00000  20.50000\n"


def _sph(k):
    return "2\n20 20 20.5\n" + "".join(f"a {x} {y} {z} 0.25\n" for x, y, z in ROWS)


def _pdb(k):
    rows = "".join(
        f"ATOM  {i:5d}  AR  AR  X   1    "
        + "".join(f"{c:8.3f}" for c in row)
        + "  1.00  0.00          AR  \n"
        for i, row in enumerate(ROWS)
    )
    box = "CRYST1   20.000   20.000   20.500  90.00  90.00  90.00 P 1           1\n"
    return f"{box}MODEL     {k + 1:4d}\n{rows}ENDMDL\n"


def _xdatcar(k):
    head = "Ar\n1.0\n20.0 0.0 0.0\n0.0 20.0 0.0\n0.0 0.0 20.5\nAr\n2\n" if k == 0 else ""
    rows = "".join(f"  {x / 20:.8f}  {y / 20:.8f}  {z / 20.5:.8f}\n" for x, y, z in ROWS)
    return f"{head}Direct configuration=     {k + 1}\n{rows}"


TEXTS = {
    "a.lammpstrj": _dump, "a.data": _data, "a.xyz": _xyz, "a.extxyz": _extxyz, "a.gro": _gro, "a.sph": _sph,
    "a.pdb": _pdb, "XDATCAR": _xdatcar,
}  # fmt: skip
PACKERS = {"": bytes, ".gz": gzip.compress, ".bz2": bz2.compress, ".xz": lzma.compress}


def frames_in(path, **given):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)
        return carom.io.read(path, ":", **given)


@pytest.mark.parametrize("packed", PACKERS)
@pytest.mark.parametrize("name", TEXTS)
def test_text_that_is_cut_anywhere_is_refused_or_lacks_what_was_cut_and_no_digit(tmp_path, name, packed):
    if packed and name == "XDATCAR":
        return
    texts = [TEXTS[name](k) for k in range(1 if name == "a.data" else 3)]
    text, whole = "".join(texts), len("".join(texts[:-1]))
    given = {"box": (20, 20, 20.5)} if name == "a.xyz" else {}
    path = tmp_path / (name + packed)
    path.write_bytes(PACKERS[packed](text.encode()))
    right = frames_in(path, **given)
    np.testing.assert_allclose(right[-1].positions, ROWS, rtol=1e-7)
    refused = []
    for end in range(whole if not packed else len(text) - 12, len(text)):
        path.write_bytes(PACKERS[packed](text[:end].encode()))
        try:
            found = frames_in(path, **given)
        except FileError as error:
            refused.append(str(error))
            continue
        for frame, other in zip(found, right, strict=False):
            for of in {"positions", "velocities", "masses", "box", "time"} - {*frame.lacks}:
                np.testing.assert_array_equal(
                    getattr(frame, of), getattr(other, of), err_msg=repr(text[:end])
                )
    assert len(refused) >= 12 * (name != "a.pdb")
    words = ("\n", "could not", "inhomogeneous", "index", "invalid", "iteration")
    assert not [said for said in refused if any(word in said for word in words)]


@pytest.mark.parametrize("name", ["a.lammpstrj", "a.extxyz", "a.xyz", "a.gro", "a.sph"])
@pytest.mark.parametrize("harm", ["cut", "a word", "nan", "a bound", "no frame"])
def test_the_frames_before_a_bad_last_one_are_had_by_what_the_refusal_says(tmp_path, monkeypatch, name, harm):
    monkeypatch.chdir(tmp_path)
    texts = [TEXTS[name](k) for k in range(3)]
    last = {
        "cut": texts[2][:-3],
        "a word": texts[2].replace("12.5", "much"),
        "nan": texts[2].replace("12.5", " nan"),
        "no frame": "nothing of this\nis a frame\n",
        "a bound": texts[2].replace("0 20.5\n", "0 20.5x\n") if name == "a.lammpstrj" else texts[2][:-3],
    }[harm]
    given = {"box": (20, 20, 20.5)} if name == "a.xyz" else {}
    (tmp_path / name).write_text("".join([*texts[:2], last.replace(" 12.500", "    nan")]))
    with pytest.raises(FileError) as caught:
        frames_in(name, **given)
    assert str(caught.value).endswith("copies the 2 frames before.")
    assert "could not" not in str(caught.value)
    told = next(part for part in str(caught.value).split("; ") if part.startswith("carom.io.rebuild("))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)
        eval(told.partition(" copies")[0], {"carom": carom})
    assert len(frames_in("whole.h5md")) == 2


def moving(times, d=3, n=5):
    """Return frames of a mixture with these times, whose positions need all digits."""
    rng = np.random.default_rng(d)
    box, x, v = np.array((8.0, 9.5, 7.25, 6.5))[:d], rng.random((n, d)), rng.normal(size=(n, d))
    found, kinds = [], np.arange(n) % 2
    for k, time in enumerate(times):
        place = x * box + 0.5 * k * v
        images = np.floor(place / box)
        found.append(
            carom.Frame(
                time, 3 * k, place - images * box, v, box, 0.5 + 0.25 * kinds, 1.0 + kinds,
                images=images.astype(np.int32), species=kinds, species_names=("big", "small"),
            )
        )  # fmt: skip
    return found


def written(path, frames):
    with carom.open(path, "w") as file:
        for frame in frames:
            file.write(frame)
    return path


EQUAL, LATE, UNEQUAL = (0.25, 0.5, 0.75), (1000.1, 1000.2, 1000.3), (1.0, 2.0, 4.0)
DIGITS = {
    ".h5md": 0, ".extxyz": 0, ".gsd": 1e-6, ".lammpstrj": 1e-8, ".data": 1e-8, ".dcd": 1e-6, ".pdb": 1e-3,
}  # fmt: skip
"""Rounding of coordinates by format, in units of 10."""


@pytest.mark.parametrize("d", [1, 2, 3, 4])
@pytest.mark.parametrize("times", [EQUAL, LATE, UNEQUAL, (7.5,), (0.0,)], ids=str)
@pytest.mark.parametrize("suffix", DIGITS)
def test_what_is_written_comes_back_or_it_is_said_at_the_writing(tmp_path, suffix, times, d):
    frames = moving(times, d)
    source = written(tmp_path / "a.h5md", frames)
    if d == 4 and suffix != ".h5md":
        with pytest.raises(InputError, match="at most 3"):
            carom.io.convert(source, tmp_path / f"b{suffix}")
        return
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", CaromWarning)
        count = carom.io.convert(source, tmp_path / f"b{suffix}")
    said = [str(each.message) for each in told if each.category is CaromWarning]
    back = frames_in(tmp_path / f"b{suffix}")
    assert len(back) == count == (1 if suffix == ".data" else len(frames))
    plain = suffix in (".dcd", ".pdb")  # which hold positions alone
    lammps = suffix in (".lammpstrj", ".data")  # which knows no line
    for frame, found in zip(frames[-count:], back, strict=True):
        assert found.dimension == (
            3 if plain and d == 3 else found.dimension if plain else max(d, 1 + lammps)
        )
        apart = found.positions[:, :d] - frame.positions
        apart -= frame.box * np.rint(apart / frame.box)
        np.testing.assert_allclose(apart, 0.0, atol=10.0 * DIGITS[suffix])
        np.testing.assert_allclose(found.box[:d], frame.box, rtol=1e-6)
        if suffix not in (".data", ".pdb", ".dcd"):
            np.testing.assert_array_equal(found.images[:, :d], frame.images)
        if not plain:
            np.testing.assert_allclose(found.velocities[:, :d], frame.velocities, rtol=DIGITS[suffix])
            np.testing.assert_allclose(found.diameters, frame.diameters, rtol=DIGITS[suffix])
            np.testing.assert_allclose(found.masses, frame.masses, rtol=DIGITS[suffix])
            np.testing.assert_array_equal(found.species, frame.species)
    same = np.allclose([f.time for f in back], times[-count:], rtol=2.0**-22, atol=0.0)
    assert same != any("holds no times" in each or "interval of time" in each for each in said)
    assert same or suffix == ".pdb" or (suffix, times) == (".dcd", UNEQUAL)
    if suffix == ".dcd":
        assert back[0].time == pytest.approx(times[0], rel=2.0**-22)


def test_displacements_at_times_that_no_file_holds_are_told_first(tmp_path):
    frames = moving([0.5 * k for k in range(12)])
    source = written(tmp_path / "a.h5md", frames)
    with pytest.warns(CaromWarning, match="PDB holds no times: they come back as 0, 1 and so on"):
        carom.io.convert(source, tmp_path / "a.pdb")
    carom.io.convert(source, tmp_path / "a.lammpstrj")
    steps = (tmp_path / "a.lammpstrj").read_text()
    steps = re.sub("ITEM: TIME\n.*\n", "", steps)
    (tmp_path / "steps.lammpstrj").write_text(steps)
    for name, assumed in (("a.h5md", 0), ("a.lammpstrj", 0), ("steps.lammpstrj", 1), ("a.pdb", 1)):
        done = CliRunner().invoke(
            app, ["measure", str(tmp_path / name), "msd", "--no-pictures", "--overwrite"]
        )
        assert done.exit_code == 0, done.output
        assert done.stdout.splitlines()[0].startswith("msd: ")
        assert (
            "assumed times (steps or frames, as the file holds none)" in done.stdout.splitlines()[0]
        ) == assumed


NEEDLESS = {
    "words": lambda file: file.update({"parameters/names": np.array([b"Ar"] * 3, dtype=object)}),
    "a table": lambda file: file.create_dataset(
        "observables/table", (3,), dtype=[("step", "i8"), ("name", h5py.string_dtype())]
    ),
    "what is compressed": lambda file: file.create_dataset(
        "observables/e", data=np.zeros(99), compression="gzip"
    ),
    "a link to nowhere": lambda file: file.update({"observables/x": h5py.SoftLink("/nowhere")}),
    "a link to another file": lambda file: file.update({"parameters/y": h5py.ExternalLink("other.h5", "/")}),
    "a group that is a link": lambda file: file.update({"particles/b": h5py.ExternalLink("other.h5", "/")}),
    "words in the group": lambda file: file.update(
        {"particles/all/label": np.array([b"x"] * 5, dtype=object)}
    ),
    "an empty data set": lambda file: file.create_dataset("particles/all/nothing", data=h5py.Empty("f8")),
    "a type": lambda file: file.update({"parameters/type": np.dtype("f4")}),
    "a link in the file": lambda file: (
        file["particles/all"].move("position/step", "/steps"),
        file.update({"particles/all/position/step": h5py.SoftLink("/steps")}),
    ),
    "species as words": lambda file: file.update(
        {"particles/all/species": np.array([b"Ar", b"Kr"] * 2 + [b"Ar"], dtype=object)}
    ),
}


@pytest.mark.parametrize("more", NEEDLESS)
def test_h5md_of_others_is_read_whatever_it_holds_that_nobody_needs(tmp_path, more):
    x = np.random.default_rng(1).random((4, 5, 3)) * 8.0
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("particles/all")
        group["position/value"], group["position/step"] = x, np.arange(4)
        group["position/time"] = 0.5 * np.arange(4)
        group.create_group("box").attrs["boundary"] = ["periodic"] * 3
        group["box/edges"] = [8.0, 8.0, 8.0]
        NEEDLESS[more](file)
    frames = frames_in(path)
    np.testing.assert_array_equal([frame.positions for frame in frames], x)
    assert [frame.time for frame in frames] == [0.0, 0.5, 1.0, 1.5]
    if more == "species as words":
        assert frames[0].species_names == ("Ar", "Kr")
    with h5py.File(path, "r+") as file:  # and what is needed must be in the file
        del file["particles/all/position/value"]
        file["particles/all/position/value"] = h5py.ExternalLink("other.h5", "/")
    with pytest.raises(FileError, match="link to somewhere else"):
        carom.open(path)


@pytest.mark.parametrize("noise", [0.0, 1e-9, 1e-6])
@pytest.mark.parametrize("height", [1.0, 0.0])
def test_disks_of_hoomd_have_two_dimensions_whatever_rounding_is_in_their_z(tmp_path, noise, height):
    rng = np.random.default_rng(1)
    x = rng.random((3, 5, 2)) * [8, 9] - [4, 4.5]
    with gsd.hoomd.open(str(tmp_path / "a.gsd"), "w") as file:
        for k in range(3):
            one = gsd.hoomd.Frame()
            one.configuration.step, one.configuration.dimensions = 10 * k, 2
            one.configuration.box = [8, 9, height, 0, 0, 0]
            one.particles.N = 5
            one.particles.position = np.c_[x[k], noise * rng.standard_normal(5)]
            file.append(one)
    frames = frames_in(tmp_path / "a.gsd")
    for k, frame in enumerate(frames):
        assert (frame.dimension, frame.time, "time" in frame.lacks) == (2, 10 * k, True)
        np.testing.assert_allclose(frame.positions, x[k] + [4, 4.5], atol=1e-6)
    with gsd.hoomd.open(str(tmp_path / "b.gsd"), "w") as file:
        one.particles.position = np.c_[x[2], np.arange(5)]
        file.append(one)
    with pytest.raises(FileError, match="beyond the 2 dimensions"):
        frames_in(tmp_path / "b.gsd")


@pytest.mark.parametrize("noise", [0.0, 1e-9])
@pytest.mark.parametrize("name", ["a.lammpstrj", "a.data", "a.extxyz", "a.gro"])
def test_disks_of_any_text_have_two_dimensions_whatever_rounding_is_in_their_z(tmp_path, name, noise):
    text = TEXTS[name](0).replace("0 20.5\n", "-0.25 0.25\n").replace("0 20.5 z", "-0.25 0.25 z")
    text = text.replace("0 0 20.5", "0 0 0.5").replace("20.50000", "0.50000")
    if name != "a.gro":
        text = text.replace(" 3.125\n", f" {noise}\n").replace(" 17.25\n", f" {-noise}\n")
    else:
        text = text.replace("   3.125\n", "   0.000\n").replace("  17.250\n", "   0.000\n")
    (tmp_path / name).write_text(text)
    (frame,) = frames_in(tmp_path / name)
    assert frame.dimension == 2
    np.testing.assert_array_equal(frame.positions, np.array(ROWS)[:, :2])


@pytest.mark.parametrize(
    ("columns", "rows", "names"),
    [
        ("pos:R:3:type:I:1", ("1 1 1 2", "3 3 3 10"), ("2", "10")),
        ("type:S:1:pos:R:3", ("big 1 1 1", "small 3 3 3"), ("big", "small")),
        ("species:S:1:pos:R:3:Type:I:1", ("X 1 1 1 1", "X 3 3 3 2"), ("1", "2")),
        ("species:S:1:pos:R:3:type:I:1", ("Ar 1 1 1 1", "Kr 3 3 3 2"), ("Ar", "Kr")),
        ("id:I:1:element:S:1:pos:R:3", ("1 Ar 1 1 1", "2 Kr 3 3 3"), ("Ar", "Kr")),
    ],
)
def test_species_of_extended_xyz_may_be_called_types(tmp_path, columns, rows, names):
    head = f'2\nLattice="5 0 0 0 5 0 0 0 5" Properties={columns}\n'
    (tmp_path / "a.xyz").write_text(head + "\n".join(rows) + "\n")
    (frame,) = frames_in(tmp_path / "a.xyz", diameter={names[0]: 1.0, names[1]: 0.5})
    assert (frame.species_names, frame.diameters.tolist()) == (names, [1.0, 0.5])
    with pytest.warns(CaromWarning) as told:
        carom.open(tmp_path / "a.xyz")
    assert "left out" not in str(told[0].message)


@pytest.mark.parametrize("name", ["frames.txt", "-x", "two words"])
def test_a_name_that_tells_no_format_is_given_one_by_what_is_told(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(_extxyz(0))
    for told in (InputError, None):
        if told is None:
            said = CliRunner().invoke(app, ["info", f"./{name}"]).output
        else:
            with pytest.raises(told) as caught:
                carom.open(name)
            said = str(caught.value)
        command = re.search("`(ln .*)`", said)[1]
        subprocess.run(command, shell=True, check=True)
        (found,) = (tmp_path / each for each in shlex.split(command)[2:])
        assert frames_in(found)[0].n == 2
        found.unlink()


@pytest.mark.filterwarnings("ignore::UserWarning", "ignore::DeprecationWarning")
@pytest.mark.parametrize(
    "content", [b"", b"\n", b"ITEM: ", bytes(100), b"nothing of this\nis a frame\n"], ids=repr
)
@pytest.mark.parametrize("name", FOREIGN)
def test_what_holds_no_frame_is_a_sentence(tmp_path, name, content):
    path = tmp_path / (f"a{name}" if name.startswith(".") else f"{name}.a")
    path.write_bytes(content)
    with pytest.raises(CaromError) as caught:
        frames_in(path)
    assert isinstance(caught.value, FileError | InputError)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
