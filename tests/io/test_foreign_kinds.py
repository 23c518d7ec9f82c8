"""Kinds of faults in files of other programs: names that lie, steps of one's own, wrapped or not, columns."""

import bz2
import dataclasses
import gzip
import lzma
import time
import warnings

import h5py
import MDAnalysis as mda
import numpy as np
import pytest
from helpers.frames import write
from typer.testing import CliRunner

import carom
import carom.io
from carom.cli import app
from carom.errors import CaromWarning, FileError, InputError

EDGE = 10.0
SINGLE = float(np.finfo(np.float32).eps) * EDGE


def opened(path, **given):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)
        return carom.open(path, **given)


def read(path, **given):
    with opened(path, **given) as frames:
        return list(frames)


# ------------------------------------------------------------------------------------------------- names

ATOMS = "LAMMPS data\n\n2 atoms\n1 atom types\n\n0 5 xlo xhi\n0 5 ylo yhi\n0 5 zlo zhi\n\nAtoms # atomic\n\n"
ATOMS += "1 1 1.0 1.0 1.0\n2 1 3.0 3.0 3.0\n"
CELL = "two\n1.0\n5 0 0\n0 5 0\n0 0 5\nAr\n2\nCartesian\n1 1 1\n3 3 3\n"


NAMES = {"data.melt": ATOMS, "melt.data": ATOMS, "POSCAR": CELL, "POSCAR.relaxed": CELL}
# ASE chooses how to unpack by the name.
PACKED = [
    (name, packed) for name in NAMES for packed in (None, gzip, bz2, lzma) if packed is None or "data" in name
]


@pytest.mark.parametrize(("name", "packed"), PACKED)
def test_a_name_tells_the_format_also_of_what_is_compressed_under_any_name(tmp_path, name, packed):
    text = NAMES[name]
    for suffix in {None: [""], gzip: [".gz", ""], bz2: [".bz2", ""], lzma: [".xz", ""]}[packed]:
        path = tmp_path / f"{name}{suffix}"
        path.write_bytes(text.encode() if packed is None else packed.compress(text.encode()))
        (frame,) = read(path)
        np.testing.assert_array_equal(frame.positions, [[1.0] * 3, [3.0] * 3])


@pytest.mark.parametrize(
    "name",
    ["data.csv", ".datastore", ".data", "data.json", "dump.sql", "POSCAR.png", "CONTCAR.txt", "XDATCARS"],
)
@pytest.mark.parametrize("content", [b"time,x,y,z\n0.0,1.0,2.0,3.0\n", b"", b"\x1f\x8b and no more"])
def test_what_only_begins_with_the_name_of_a_format_is_no_file_of_it(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises((InputError, FileError), match=r"tells no format|not a readable compressed"):
        carom.open(tmp_path / name)


@pytest.mark.parametrize("name", ["a.h5md.gz", "a.gsd.xz", "a.dcd.bz2", "a.xtc.gz"])
def test_binary_files_are_unpacked_first(tmp_path, name):
    (tmp_path / name).write_bytes(gzip.compress(b"anything"))
    with pytest.raises(FileError, match=r"is compressed.*unpack the file first"):
        carom.open(tmp_path / name)


# -------------------------------------------------------------------------------------------------- H5MD

N, FRAMES = 8, 6


def h5md(path, elements, *, clock="step", explicit=False, interval=10):
    """Write positions at every step, and elements, (every, value of a step), at some of them."""
    with h5py.File(path, "w") as file:
        file.create_group("h5md").attrs["version"] = [1, 1]
        group = file.create_group("particles/all")
        box = group.create_group("box")
        box.attrs["dimension"], box.attrs["boundary"] = 3, ["periodic"] * 3
        box["edges"] = [EDGE] * 3
        own = {"position": (1, lambda step: np.full((N, 3), step / 100.0) + np.arange(N)[:, None])}
        for name, (every, value) in (own | elements).items():
            element, steps = group.create_group(name), np.arange(0, FRAMES, every)
            element["value"] = np.array([value(k) for k in steps * 10])
            if explicit:
                element[clock] = interval * steps
            else:
                element[clock] = interval * every
    return path


@pytest.mark.parametrize("explicit", [False, True])
@pytest.mark.parametrize(("clock", "interval"), [("step", 10), ("time", 0.1)])
def test_a_velocity_of_h5md_is_that_of_its_own_step(tmp_path, explicit, clock, interval):
    path = h5md(
        tmp_path / "a.h5md",
        {
            "velocity": (2, lambda step: np.full((N, 3), step + 1.0)),
            "image": (3, lambda step: np.full((N, 3), step)),
        },
        clock=clock, explicit=explicit, interval=interval,
    )  # fmt: skip
    for k, frame in enumerate(read(path)):
        np.testing.assert_array_equal(frame.positions, np.full((N, 3), k / 10.0) + np.arange(N)[:, None])
        if k % 2:
            assert "velocities" in frame.lacks
        else:
            np.testing.assert_array_equal(frame.velocities, 10.0 * k + 1.0)
            assert "velocities" not in frame.lacks
        assert (frame.images is None) == (k % 3 > 0)
        if frame.images is not None:
            np.testing.assert_array_equal(frame.images, 10 * k)


def test_elements_that_begin_later_have_an_offset(tmp_path):
    path = h5md(tmp_path / "a.h5md", {"velocity": (2, lambda step: np.full((N, 3), step + 1.0))})
    with h5py.File(path, "r+") as file:
        file["particles/all/velocity/step"].attrs["offset"] = 10
    frames = read(path)
    assert ["velocities" in frame.lacks for frame in frames] == [True, False] * 3
    np.testing.assert_array_equal(frames[1].velocities, 1.0)


@pytest.mark.parametrize("name", ["mass", "species", "diameter", "id"])
def test_what_every_frame_needs_is_not_taken_from_another_one(tmp_path, name):
    """Between two steps it is unknown, unless it is always the same, or fixed in time."""
    value = np.arange(1, N + 1)
    path = h5md(tmp_path / "a.h5md", {name: (2, lambda step: value + step)})
    with pytest.raises(FileError, match=rf"it has no {name} at the step of frame 5"):
        carom.open(path)
    field = {"mass": "masses", "diameter": "diameters"}.get(name)
    for fixed in (False, True):
        path = h5md(tmp_path / "a.h5md", {} if fixed else {name: (2, lambda step: value)})
        if fixed:
            with h5py.File(path, "r+") as file:
                file[f"particles/all/{name}"] = value
        for frame in read(path):
            if field is not None:
                np.testing.assert_array_equal(getattr(frame, field), value)
            assert (frame.species is not None) == (name == "species")


def test_edges_of_a_box_at_other_steps_are_not_guessed(tmp_path):
    path = h5md(tmp_path / "a.h5md", {})
    for last, says in ((EDGE, None), (2 * EDGE, "it has no edges at the step of frame 5")):
        with h5py.File(path, "r+") as file:
            del file["particles/all/box/edges"]
            edges = file.create_group("particles/all/box/edges")
            edges["value"], edges["step"] = np.array([[EDGE] * 3, [last] * 3]), 30
        if says is None:
            np.testing.assert_array_equal([frame.box for frame in read(path)], EDGE)
            continue
        with pytest.raises(FileError, match=says):
            carom.open(path)


def test_without_velocities_correlations_with_them_are_unknown_and_displacements_are_not(tmp_path):
    """In a straight line: the displacement of t is v t, whatever velocities the file lacks."""
    v = np.random.default_rng(1).normal(size=(N, 3))
    with h5py.File(tmp_path / "a.h5md", "w") as file:
        group = file.create_group("particles/all")
        box = group.create_group("box")
        box.attrs["boundary"], box["edges"] = ["periodic"] * 3, [EDGE] * 3
        path = 5.0 + 0.5 * np.arange(24)[:, None, None] * v
        for name, every, values in (
            ("position", 1, path % EDGE), ("image", 1, np.floor(path / EDGE)), ("velocity", 2, [v] * 12),
        ):  # fmt: skip
            group[f"{name}/value"], group[f"{name}/step"] = values, np.arange(0, 24, every)
            group[f"{name}/time"] = 0.5 * np.arange(0, 24, every)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = carom.Dynamics(conserved=(False,) * 3).over(tmp_path / "a.h5md")
    assert "no velocities in some frames" in str(told[0].message)
    np.testing.assert_allclose(found.mean_square, np.mean(np.sum(v**2, axis=1)) * found.times**2, rtol=1e-12)
    assert np.isnan(
        [*found.velocity_autocorrelation, *found.running_diffusion, found.velocity_square.mean]
    ).all()


# ----------------------------------------------------------------------------------- wrapped or unwrapped


def gas(n, frames, *, low, out=0.0, wrap=True, d=3, tilt=0.0):
    """Return the paths of an ideal gas in a box whose corner is at ``low``, out of which some stick."""
    rng = np.random.default_rng(2)
    x, v = rng.random((n, d)) * EDGE, rng.normal(size=(n, d))
    found = []
    for k in range(frames):
        places = x + 0.3 * k * v
        places = (places - low - out) % EDGE + low + out if wrap else places
        places[:, 0] += tilt * places[:, 1]
        found.append(places)
    return found, np.mean(np.sum(v**2, axis=1))


def xyz(path, paths, tilt):
    with path.open("w") as file:
        for k, x in enumerate(paths):
            d = x.shape[1]
            flags = " ".join("TTF"[d < 3 and axis == 2] for axis in range(3))
            lattice = f"{EDGE} 0 0 {tilt * EDGE} {EDGE} 0 0 0 {EDGE}"
            file.write(
                f'{len(x)}\nLattice="{lattice}" Properties=species:S:1:pos:R:{d} pbc="{flags}" '
                f"time={0.3 * k}\n"
            )
            file.writelines("A " + " ".join(f"{c:.10g}" for c in row) + "\n" for row in x)


def dcd(path, paths, tilt):
    with mda.Writer(str(path), n_atoms=len(paths[0])) as writer, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        world = mda.Universe.empty(len(paths[0]), trajectory=True)
        for x in paths:
            world.atoms.positions = x
            world.dimensions = mda.lib.mdamath.triclinic_box(
                [EDGE, 0, 0], [tilt * EDGE, EDGE, 0], [0, 0, EDGE]
            )
            writer.write(world.atoms)


def gro(path, paths, tilt):
    with path.open("w") as file:
        for k, x in enumerate(paths):
            file.write(f"gas t= {0.3 * k}\n{len(x):5d}\n")
            file.writelines(
                f"{1:5d}A    {'A':>5}{(i + 1) % 100000:5d}" + "".join(f"{c:12.7f}" for c in row) + "\n"
                for i, row in enumerate(x)
            )
            box = (*(EDGE,) * 3, 0.0, 0.0, tilt * EDGE, 0.0, 0.0, 0.0)
            file.write("".join(f"{edge:10.5f}" for edge in box) + "\n")


def sph(path, paths, tilt):
    with path.open("w") as file:
        for x in paths:
            file.write(f"# EDMD\n{len(x)}\n{EDGE} {EDGE} {EDGE}\n")
            file.writelines(f"a {row[0]:.12f}  {row[1]:.12f}  {row[2]:.12f}  0.001\n" for row in x)


WRITERS = {"a.xyz": xyz, "a.dcd": dcd, "a.gro": gro, "a.sph": sph}


# A box of EDMD has right angles.
TILTED = [(name, tilt) for name in WRITERS for tilt in (0.0, 0.3) if not (name == "a.sph" and tilt)]


@pytest.mark.parametrize(("name", "tilt"), TILTED)
@pytest.mark.parametrize("low", [0.0, -0.5 * EDGE, 0.7 * EDGE, -12.2 * EDGE])
def test_wrapped_positions_stay_wrapped_wherever_the_corner_of_the_box_is(tmp_path, name, low, tilt):
    for out in (0.0, -0.004 * EDGE, 1e-7 * EDGE)[: 1 if name == "a.sph" else 3]:
        paths, _ = gas(300, 10, low=low, out=out, tilt=tilt)
        WRITERS[name](tmp_path / name, paths, tilt)
        frames = read(tmp_path / name)
        assert all(frame.images is None for frame in frames)
        with pytest.raises(InputError, match=r"need image counts or unwrapped positions|is sheared"):
            carom.Dynamics(conserved=(False,) * 3).over(frames)
        for frame, x in zip(frames, paths, strict=True):
            assert (frame.positions[:, 1:] >= 0.0).all()
            assert (frame.positions[:, 1:] < EDGE).all()
            apart = frame.positions - x
            apart[:, 0] -= tilt * EDGE * np.rint(apart[:, 1] / EDGE)
            assert np.abs(apart - EDGE * np.rint(apart / EDGE)).max() < 20 * SINGLE * (1 + abs(low) / EDGE)


@pytest.mark.parametrize(("name", "d"), [("a.xyz", 2), *((name, 3) for name in WRITERS)])
def test_unwrapped_positions_give_their_displacements(tmp_path, name, d):
    paths, square = gas(300, 24, low=0.0, wrap=False, d=d)
    WRITERS[name](tmp_path / name, paths, 0.0)
    frames = read(tmp_path / name)
    for frame, x in zip(frames, paths, strict=True):
        np.testing.assert_allclose(frame.unwrapped, x, rtol=0, atol=20 * SINGLE)
    found = carom.Dynamics(conserved=(False,) * d).over(frames)
    every = frames[1].time
    np.testing.assert_allclose(found.mean_square, square * (0.3 / every * found.times) ** 2, rtol=1e-4)


def test_particles_of_edmd_that_only_just_left_the_box_are_unwrapped(tmp_path):
    """They fill a box and a little: more than wrapped ones can."""
    x = np.array([[0.1, 1.0, 1.0], [EDGE + 0.2, 2.0, 2.0], [5.0, 5.0, 5.0]])
    sph(tmp_path / "a.sph", [x, x], 0.0)
    frame = read(tmp_path / "a.sph")[-1]
    np.testing.assert_allclose(frame.unwrapped, x, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(frame.diameters, 0.002)


def test_a_file_of_edmd_is_a_start_and_a_trajectory(tmp_path):
    path = tmp_path / "mov.n2.v210.0000.sph"
    path.write_text("2\n5.0 6.0 7.0\na 1.0 1.0 1.0 0.5\nb -12.0 2.0 2.0 0.25\n" * 3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)
        scene = carom.Scene.from_file(path)
    assert (scene.n, scene.diameters.tolist(), list(scene.box)) == (2, [1.0, 0.5], [5.0, 6.0, 7.0])
    assert scene.species_names == ("a", "b")
    np.testing.assert_array_equal(scene.positions, [[1.0, 1.0, 1.0], [3.0, 2.0, 2.0]])
    assert [frame.time for frame in read(path)] == [0.0, 1.0, 2.0]


def test_what_touches_a_wall_is_between_the_walls_whatever_single_precision_says(tmp_path):
    rows = [[1.0, 0.0 - 3e-7, 1.0], [3.0, EDGE + 4e-7, 3.0], [5.0, 4.0, 5.0]]
    path = tmp_path / "a.xyz"
    path.write_text(
        f'3\nLattice="{EDGE} 0 0 0 {EDGE} 0 0 0 {EDGE}" pbc="T F T" Properties=species:S:1:pos:R:3\n'
        + "".join(f"A {x} {y:.9g} {z}\n" for x, y, z in rows)
    )
    (frame,) = read(path)
    np.testing.assert_array_equal(frame.positions[:, 1], [0.0, EDGE, 4.0])
    assert carom.BondOrder(6, nearest=2).over([frame]).neighbors.mean == 2.0


# --------------------------------------------------------------------------------------------------- GRO

HEAD = "    1SOL     OW    1   0.100   0.200   0.300", "    2SOL     OW    2   1.000   2.000   3.000"


@pytest.mark.parametrize(
    ("last", "edges"),
    [
        ("   5.00000   6.00000   7.00000", [5.0, 6.0, 7.0]),
        ("20000.0000020000.0000020000.00000", [20000.0] * 3),
        ("1234567.123 1.500 4.000", [1234567.123, 1.5, 4.0]),
        ("5 6 7", [5.0, 6.0, 7.0]),
        ("5 6 7 0 0 0 0 0 0", [5.0, 6.0, 7.0]),
    ],
)
def test_the_box_of_gro_needs_no_blanks(tmp_path, last, edges):
    (tmp_path / "a.gro").write_text("\n".join(["12 boxes of 3", "    2", *HEAD, last]) + "\n")
    (frame,) = read(tmp_path / "a.gro")
    np.testing.assert_array_equal(frame.box, edges)
    np.testing.assert_array_equal(frame.positions, np.array([[0.1, 0.2, 0.3], [1.0, 2.0, 3.0]]) % edges)


@pytest.mark.parametrize("moving", [(0,), (1,), (0, 1), ()])
def test_velocities_of_gro_are_those_of_all_or_none(tmp_path, moving):
    rows = [row + "  0.1000 -0.2000  0.3000" * (k in moving) for k, row in enumerate(HEAD)]
    (tmp_path / "a.gro").write_text("\n".join(["some t= 2.5", "2", *rows, "5 5 5"]) + "\n\n")
    (frame,) = read(tmp_path / "a.gro")
    assert frame.time == 2.5
    assert ("velocities" in frame.lacks) == (len(moving) < 2)
    np.testing.assert_array_equal(frame.velocities, [[0.1, -0.2, 0.3] if len(moving) == 2 else [0.0] * 3] * 2)


@pytest.mark.parametrize("decimals", [2, 3, 5, 8])
def test_gro_has_as_many_decimals_as_its_writer_likes(tmp_path, decimals):
    x = np.array([[0.1, 19.2, 3.4], [-1.2, 2.0, 7.7]])
    place, speed = f"{decimals + 5}.{decimals}f", f"{decimals + 5}.{decimals + 1}f"
    rows = [
        f"{1:5d}A    {'A':>5}{k:5d}"
        + "".join(f"{c:{place}}" for c in row)
        + "".join(f"{-c:{speed}}" for c in row)
        for k, row in enumerate(x)
    ]
    (tmp_path / "a.gro").write_text("\n".join(["t", "2", *rows, "20 20 20"]) + "\n")
    (frame,) = read(tmp_path / "a.gro")
    np.testing.assert_allclose(frame.positions, x % 20.0, rtol=1e-15)
    np.testing.assert_array_equal(frame.velocities, -x)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.gro", "t\n2\n{0}\n{1}\n5 5\n", "the box of frame 0 is '5 5'; expected three numbers"),
        (
            "a.gro",
            "t\n2\n{0}\n    2SOL     OW    2   1.000   2.0x0   3.000\n5 5 5\n",
            "'   2.0x0' where particle 2",
        ),
        ("a.gro", "t\nmany\n{0}\n{1}\n5 5 5\n", "'many' for its number of particles"),
        ("a.gro", "t\n2\n{0}\n5 5 5\n", "ends inside frame 0"),
        ("a.sph", "0.1 1.2\n0.2 1.3\n", "for its number of particles"),  # press.n2.v210.0000.sph
        ("a.sph", "2\n5 6 7\na 1 1 1 .5\n", "ends inside frame 0"),
        ("a.sph", "1\n5 6\na 1 1 1 .5\n", "three edges"),
        ("a.sph", "1\n5 6 7\na 1 1 .5\n", "five words"),
        ("a.sph", "0\n5 6 7\n", "for its number of particles"),
    ],
)
def test_lines_of_gro_and_of_edmd_that_are_wrong_are_named(tmp_path, name, text, says):
    (tmp_path / name).write_text(text.format(*HEAD))
    with pytest.raises(FileError, match=says):
        carom.open(tmp_path / name)


@pytest.mark.timing
def test_many_frames_of_gro_are_found_in_time_proportional_to_them(tmp_path):
    """Eight times as many take 8 times as long, and 40 to 150 times where each is sought in all the rest."""

    def seconds(count):
        frame = "\n".join(["t", "30", *[HEAD[0]] * 30, "5 5 5"]) + "\n"
        (tmp_path / "a.gro").write_text(frame * count)
        spent = []
        for _ in range(3):
            began = time.process_time()
            opened(tmp_path / "a.gro").close()
            spent.append(time.process_time() - began)
        return min(spent)

    assert seconds(8000) < 24 * seconds(1000)


# --------------------------------------------------------------------------------------------------- PDB


@pytest.mark.parametrize(
    ("images", "edge", "fits"),
    [(-300, 6.0, False), (2000, 6.0, False), (-100, 6.0, True), (0, 99999.0, True), (0, 1e5, False)],
)
def test_what_the_columns_of_pdb_cannot_hold_is_refused_and_nothing_is_written(tmp_path, images, edge, fits):
    frame = carom.Frame(
        0.0, 0, np.array([[1.0] * 3, [3.0] * 3]), np.zeros((2, 3)), (edge,) * 3, np.ones(2), np.ones(2),
        images=np.array([[0, 0, 0], [images, 0, 0]], np.int32),
    )  # fmt: skip
    with carom.io.open(tmp_path / "a.h5md", "w") as writer:
        writer.write(dataclasses.replace(frame, images=0 * frame.images))
        writer.write(frame)
    done = CliRunner().invoke(app, ["export", str(tmp_path / "a.h5md"), str(tmp_path / "a.pdb")])
    assert done.exit_code == (0 if fits else 2)
    assert (tmp_path / "a.pdb").exists() == fits
    if fits:
        last = read(tmp_path / "a.pdb")[-1]
        np.testing.assert_allclose(last.box, edge)
        apart = last.positions - frame.positions
        np.testing.assert_allclose(apart - edge * np.rint(apart / edge), 0.0, atol=1e-3)
    else:
        assert "PDB has columns" in done.output


def test_a_name_that_is_no_text_is_one_sentence_of_dcd(tmp_path):
    carom.io.open(tmp_path / "a.h5md", "w").close()
    folder = tmp_path / "\udcff"
    folder.mkdir()
    frame = carom.Frame(0.0, 0, np.ones((2, 3)), np.zeros((2, 3)), (6.0,) * 3, np.ones(2), np.ones(2))
    write(tmp_path / "a.h5md", [frame])
    with pytest.raises(UnicodeEncodeError):
        carom.io.convert(tmp_path / "a.h5md", folder / "a.dcd")
    done = CliRunner().invoke(app, ["export", str(tmp_path / "a.h5md"), str(folder / "a.dcd")])
    assert (done.exit_code, "no text" in done.output, "Traceback" in done.output) == (2, True, False)
    assert [*folder.iterdir()] == []


# ------------------------------------------------------------------------------------------- MDAnalysis


@pytest.mark.parametrize("suffix", [".h5md", ".extxyz", ".gsd"])
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("n", [3, 4])
@pytest.mark.parametrize("sheared", [True, False])
def test_mdanalysis_unwraps_along_the_edges_of_the_tilted_cell_of_each_frame(tmp_path, suffix, d, n, sheared):
    import carom.io.mdanalysis

    rng = np.random.default_rng(3)
    edges = np.array([5.0, 6.0, 7.0])[:d]
    with carom.io.open(tmp_path / f"a{suffix}", "w") as writer:
        frames = []
        for k, tilt in enumerate((0.1, -0.4, 0.5)):
            x = rng.random((n, d)) * edges
            x[:, 0] += tilt * x[:, 1] if sheared else 0.0
            frames.append(
                carom.Frame(
                    float(k), k, x, np.zeros((n, d)), edges, np.ones(n), np.ones(n),
                    images=rng.integers(-9, 9, (n, d)).astype(np.int32), tilt=tilt if sheared else None,
                )
            )  # fmt: skip
            writer.write(frames[-1])
    own = carom.io.mdanalysis.universe(tmp_path / f"a{suffix}", unwrapped=True)
    worlds = [own] if suffix == ".gsd" else [own, mda.Universe(str(tmp_path / f"a{suffix}"), unwrapped=True)]
    for world in worlds:
        for step, frame in zip(world.trajectory, frames, strict=True):
            np.testing.assert_allclose(step.positions[:, :d], frame.unwrapped, rtol=1e-5, atol=1e-5)
            assert not step.positions[:, d:].any()
            rounding = 1e-5 if suffix == ".gsd" else 1e-13
            np.testing.assert_allclose(step.data["positions"], frame.unwrapped, rtol=rounding, atol=rounding)


@pytest.mark.filterwarnings("ignore::UserWarning", "ignore::DeprecationWarning")
def test_mdanalysis_does_not_unwrap_by_image_counts_of_other_steps(tmp_path):
    import carom.io.mdanalysis  # noqa: F401

    path = h5md(tmp_path / "a.h5md", {"image": (2, lambda step: np.full((N, 3), step))}, explicit=True)
    with h5py.File(path, "r+") as file:
        group = file["particles"]
        group.move("all", "trajectory")
        box = group["trajectory/box"]
        del box["edges"]
        box["edges/value"] = np.full((FRAMES, 3), EDGE)
        group["trajectory/position/time"] = np.arange(FRAMES) * 0.1
    with pytest.raises(InputError, match=r"steps of their own; take carom\.io\.universe"):
        mda.Universe(str(path), unwrapped=True, convert_units=False)
