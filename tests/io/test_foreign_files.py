"""Files that other programs wrote, in odd but legal variants: as frames and as a start."""

import dataclasses
import gzip
import itertools
import json
import lzma
import sys
import warnings

import ase.io
import gsd.hoomd as gsd
import h5py
import MDAnalysis as mda
import numpy as np
import pytest
from typer.testing import CliRunner

import carom
from carom.cli import app
from carom.errors import CaromWarning, FileError, InputError, OverlapError
from carom.io.foreign_source import opened, pass_lines
from carom.io.lammps import _box

N, EDGE, COUNT = 27, 6.0, 3
RNG = np.random.default_rng(5)
PLACES = np.stack(np.meshgrid(*[np.arange(3) * 2.0 + 0.25] * 3), -1).reshape(-1, 3)
MOVES = RNG.normal(size=(N, 3))
KINDS = np.arange(N) % 2
SIZES = np.where(KINDS == 0, 1.0, 0.5)
SINGLE = 4 * float(np.finfo(np.float32).eps) * EDGE
"""Rounding of a position to single precision, and of what a shift to the middle of the box adds."""
THOUSANDTH = 0.5e-3 * (1 + 1e-9)
"""Rounding of what has three decimals."""


def at(k):
    """Positions of frame k, which are never put back into the box."""
    return PLACES + 0.5 * k * MOVES


def inside(places):
    return places - EDGE * np.floor(places / EDGE)


def read(path, **given):
    """Return the frames of a file, and the sentence about what was assumed."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", CaromWarning)
        frames = carom.io.read(path, ":", **given)
    return frames, " ".join(str(each.message) for each in told if each.category is CaromWarning)


def close(places, other, tolerance):
    """Assert that positions are equal, up to the rounding of a format, and to periodic images."""
    apart = places - other
    assert np.abs(apart - EDGE * np.rint(apart / EDGE)).max() <= tolerance


# ---------------------------------------------------------------------------------------------- LAMMPS


def dump(path, columns, row, *, box=("0 6", "0 6", "0 6"), flags="pp pp pp", ends="\n", count=COUNT, n=N):
    """Write a dump as LAMMPS does, the particles of each frame in another order."""
    lines = []
    for k in range(count):
        order = np.random.default_rng(k).permutation(n)
        lines += ["ITEM: UNITS", "lj"] if k == 0 else []
        lines += ["ITEM: TIMESTEP", str(1000 * k), "ITEM: NUMBER OF ATOMS", str(n)]
        lines += [f"ITEM: BOX BOUNDS {flags}".strip(), *box, f"ITEM: ATOMS {columns} "]
        lines += [row(i, k) for i in order]
    text = (ends.join(lines) + ends).encode()
    path.write_bytes(gzip.compress(text) if path.suffix == ".gz" else text)
    return path


def words(values):
    return " ".join(f"{value:.17g}" for value in values)


def wrapped(i, k):
    return words(inside(at(k)[i]))


@pytest.mark.parametrize("name", ["a.lammpstrj", "a.dump", "dump.fluid", "dump.fluid.gz", "a.out"])
@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_a_dump_is_found_by_its_name_or_its_first_line_and_particles_by_their_ids(tmp_path, name, ends):
    def row(i, k):
        return f"{10 + 3 * i} {KINDS[i] + 2} {SIZES[i] / 2} {wrapped(i, k)} 0.5"

    frames, told = read(dump(tmp_path / name, "id type radius x y z c_pe", row, ends=ends))
    assert [frame.time for frame in frames] == [0.0, 1000.0, 2000.0]
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.positions, inside(at(k)))
        np.testing.assert_array_equal(frame.diameters, SIZES)
        np.testing.assert_array_equal(frame.species, KINDS)
        assert frame.species_names == ("2", "3")
        assert frame.images is None
    says = "(LAMMPS dump): assumed a mass of 1, time steps for times; no velocities; left out c_pe."
    assert told.endswith(says)


def test_opening_a_format_imports_what_reads_it_and_no_other(tmp_path, monkeypatch):
    rooms = ("carom.io.lammps", "carom.io.foreign_formats", "carom.io.libraries")
    for name in rooms:
        monkeypatch.delitem(sys.modules, name, raising=False)
    (tmp_path / "a.data").write_text(
        "\n1 atoms\n0 9 xlo xhi\n0 9 ylo yhi\n0 9 zlo zhi\n\nAtoms # atomic\n\n1 1 1 2 3\n"
    )
    with pytest.warns(CaromWarning, match="a mass of 1"):
        assert carom.io.read(tmp_path / "a.data").n == 1
    assert [name in sys.modules for name in rooms] == [True, False, False]


def test_types_that_are_numbers_are_in_the_order_of_their_values(tmp_path):
    path = dump(tmp_path / "a.dump", "id type x y z", lambda i, k: f"{i + 1} {10 - KINDS[i]} {wrapped(i, k)}")
    for frame in read(path, diameter={"9": 0.5, "10": 1.0})[0]:
        assert frame.species_names == ("9", "10")
        np.testing.assert_array_equal(frame.species, 1 - KINDS)
        np.testing.assert_array_equal(frame.diameters, SIZES)


@pytest.mark.parametrize("columns", ["xs ys zs", "xu yu zu", "xsu ysu zsu", "x y z ix iy iz"])
def test_scaled_unwrapped_and_wrapped_coordinates_with_images_are_the_same(tmp_path, columns):
    """The corner of the box is not at 0; types are words."""
    corner = np.array([-3.0, 1.0, 10.0])

    def row(i, k):
        places = at(k)[i]
        images = np.floor(places / EDGE)
        own = {"x": places - EDGE * images + corner, "xu": places + corner, "xsu": places / EDGE}
        own["xs"] = own["xsu"] - images
        rest = f" {words(images)}" if "ix" in columns else ""
        return f"{i + 1} {'small' if KINDS[i] else 'big'} {words(own[columns.split()[0]])}{rest}"

    bounds = [f"{low} {low + EDGE}" for low in corner]
    frames, _ = read(dump(tmp_path / "a.dump", f"id type {columns}", row, box=bounds))
    eps = 8 * EDGE * float(np.finfo(float).eps)
    for k, frame in enumerate(frames):
        np.testing.assert_allclose(frame.positions, inside(at(k)), rtol=0, atol=4 * eps)
        assert frame.species_names == ("big", "small")
        if columns == "xs ys zs":
            assert frame.images is None
        else:
            np.testing.assert_allclose(frame.unwrapped, at(k), rtol=0, atol=4 * eps)


def test_a_dump_of_two_dimensions_between_walls_has_two(tmp_path):
    def row(i, k):
        return f"{i + 1} 1 {i % 3} {i // 3} 0 1 2 0"

    path = dump(tmp_path / "a.dump", "id type x y z vx vy vz", row,
                box=("0 6", "0 6", "-1.4 1.4"), flags="pp ff pp", n=9)  # fmt: skip
    (frame, *_), told = read(path, diameter=0.25)
    assert (frame.dimension, frame.periodic) == (2, (True, False))
    np.testing.assert_array_equal(frame.velocities, [[1.0, 2.0]] * 9)
    assert "velocities" not in told
    path.write_text(path.read_text().replace(" z vx", " q vx"))
    assert read(path)[0][0].dimension == 2  # there is no column z


def test_a_tilted_box_is_read_and_one_tilted_in_other_ways_is_refused(tmp_path):
    def row(i, k):
        return f"{i + 1} 1 {words(at(0)[i] / EDGE)}"

    path = dump(tmp_path / "a.dump", "id type xs ys zs", row, box=("0 7.5 1.5", "0 6 0", "0 6 0"),
                flags="xy xz yz pp pp pp")  # fmt: skip
    frames, _ = read(path, diameter=0.5)
    assert frames[0].tilt == 0.25
    np.testing.assert_array_equal(frames[0].box, [6.0, 6.0, 6.0])
    assert carom.RDF(rmax=1.9, bins=20).over(frames).frames == COUNT
    path.write_text(path.read_text().replace("0 6 0", "0 6 0.5"))
    with pytest.raises(FileError, match="a tilt of y along x alone"):
        carom.open(path)


@pytest.mark.parametrize("tilts", itertools.product((-1.0, 0.5), repeat=3))
def test_the_bounds_in_a_dump_are_those_of_all_corners_of_its_cell(tilts):
    bounds = np.array([[-3.0, 9.0], [1.0, 8.0], [2.0, 5.0]])
    cell, low, _ = _box("xy xz yz pp pp pp", np.column_stack([bounds, tilts]))
    assert (cell[1, 0], cell[2, 0], cell[2, 1]) == tilts
    corners = low + np.array(list(itertools.product((0.0, 1.0), repeat=3))) @ cell
    np.testing.assert_array_equal(corners.min(axis=0), bounds[:, 0])
    np.testing.assert_array_equal(corners.max(axis=0), bounds[:, 1])


def test_a_box_whose_shear_begins_at_right_angles_is_sheared_from_the_start(tmp_path):
    """Or its frames could not stand in one file."""
    cells = [[[EDGE, 0, 0], [0.25 * k * EDGE, EDGE, 0], [0, 0, EDGE]] for k in range(COUNT)]
    ase.io.write(tmp_path / "a.traj", [ase.Atoms(numbers=KINDS, positions=PLACES, cell=c) for c in cells])
    with pytest.warns(CaromWarning, match="a diameter of 1"):
        carom.io.convert(tmp_path / "a.traj", tmp_path / "a.h5md")
    assert [frame.tilt for frame in carom.open(tmp_path / "a.h5md")] == [0.0, 0.25, 0.5]


def test_velocities_of_which_a_component_is_unknown_are_none(tmp_path):
    path = dump(tmp_path / "a.dump", "id x y z vx vy", lambda i, k: f"{i + 1} {wrapped(i, k)} 1 2")
    frames, told = read(path)
    assert "no velocities" in told
    assert all("velocities" in frame.lacks for frame in frames)


def test_lines_are_passed_over_by_number_however_long_they_are(tmp_path):
    rng = np.random.default_rng(1)
    lines = [b"x" * int(length) + b"\n" for length in rng.integers(0, 300, 4000)] + [b"and no end"]
    whole = b"".join(lines)
    for content in (whole, lzma.compress(whole)):
        (tmp_path / "a").write_bytes(content)
        with opened(tmp_path / "a") as file:
            at = 0
            for count in (1, 0, 7, 600, 1, 2000):
                assert pass_lines(file, count) == (count, b"")
                at += count
                assert file.tell() == len(b"".join(lines[:at]))
            assert pass_lines(file, len(lines) - at) == (len(lines) - at - 1, lines[-1])
    (tmp_path / "a").write_bytes(b"1 2\n" * 3000 + b"ITEM: NEXT\n" * 2 + b"3 4\n" * 3000)
    with opened(tmp_path / "a") as file:
        assert pass_lines(file, 5000, b"ITEM:") == (3000, b"")


def test_the_number_of_particles_may_change(tmp_path):
    def row(i, k):
        return f"{i + 1} 1 {wrapped(i, k)}"

    texts = [dump(tmp_path / "a.dump", "id type x y z", row, count=1, n=n).read_text() for n in (20, 27)]
    (tmp_path / "a.dump").write_text("".join(texts) + "\n\n")
    assert [frame.n for frame in read(tmp_path / "a.dump")[0]] == [20, 27]


def test_who_is_in_a_later_frame_alone_was_not_followed_there(tmp_path):
    """Unwrapped coordinates of another particle are no displacement."""

    def rows(first):
        return lambda i, k: f"{i + first} 1 {words(at(k)[i])}"

    texts = [
        dump(tmp_path / "a.dump", "id type xu yu zu", rows(first), count=1).read_text() for first in (1, 1, 2)
    ]
    (tmp_path / "a.dump").write_text("".join(texts))
    frames, _ = read(tmp_path / "a.dump")
    assert [frame.images is None for frame in frames] == [False, False, True]


def data(style, rows, *, comment="made at 300 \xb0K", ends="\n"):
    """Return a data file of four particles as bytes in Windows' encoding."""
    head = f"{comment}\n\n4 atoms\n2 atom types\n\n-2 2 xlo xhi\n-2 2 ylo yhi\n0 4 zlo zhi\n"
    masses = "\nMasses\n\n1 1.0 # small\n2 2.5\n" if "sphere" not in style else ""
    moving = "\nVelocities\n\n2 1 0 0\n1 0 1 0\n4 0 0 1\n3 1 1 1\n\n"
    return (
        (head + masses + f"\nAtoms{style}\n\n" + "\n".join(rows) + "\n" + moving)
        .replace("\n", ends)
        .encode("cp1252")
    )


PLACED = {3: "-1 -1 0.5", 1: "1 1 0.5", 2: "1 -1 2.5", 4: "-1 1 3.75"}


@pytest.mark.parametrize(
    ("style", "between", "after", "masses"),
    [
        ("", "{t}", "", [1.0, 2.5, 1.0, 1.0]),
        (" # atomic", "{t}", " 0 0 -1", [1.0, 2.5, 1.0, 1.0]),
        (" # full", "7 {t} 0.5", "", [1.0, 2.5, 1.0, 1.0]),
        (" # sphere", "{t} 0.5 2.0", " 0 0 -1", [np.pi / 24] * 4),
    ],
)
def test_a_data_file_is_a_start_with_or_without_sizes(tmp_path, style, between, after, masses):
    rows = [f"{i} {between.format(t=1 + (i == 2))} {xyz}{after}" for i, xyz in PLACED.items()]
    path = tmp_path / "data.start"
    path.write_bytes(data(style, rows, ends="\r\n"))
    sizes = {} if "sphere" in style else {"diameter": {"1": 1.0, "2": 1.5}}
    with pytest.warns(CaromWarning, match="every axis periodic"):
        scene = carom.Scene.from_file(path, **sizes)
    np.testing.assert_array_equal(scene.positions, [[3, 3, 0.5], [3, 1, 2.5], [1, 1, 0.5], [1, 3, 3.75]])
    np.testing.assert_allclose(scene.masses, masses, rtol=4e-16)
    np.testing.assert_array_equal(scene.velocities, [[0, 1, 0], [1, 0, 0], [1, 1, 1], [0, 0, 1]])
    assert scene.diameters[1] == (0.5 if "sphere" in style else 1.5)
    with pytest.warns(CaromWarning), pytest.raises(OverlapError):
        carom.Scene.from_file(path, diameter=2.2)


@pytest.mark.parametrize(
    ("style", "between", "after"), [("sphere", "1 0.5 2.0", ""), ("dipole", "1 0.5", " 0 0.6 0.8")]
)
def test_images_of_a_data_file_stand_behind_all_that_its_style_has(tmp_path, style, between, after):
    rows = [f"{i} {between} {xyz}{after} {i} 0 -1" for i, xyz in PLACED.items()]
    (tmp_path / "a.data").write_bytes(data(f" # {style}", rows))
    (frame,), _ = read(tmp_path / "a.data")
    np.testing.assert_array_equal(frame.images, [[i, 0, -1] for i in sorted(PLACED)])


def test_the_density_of_a_point_in_a_data_file_is_its_mass(tmp_path):
    path = tmp_path / "a.data"
    path.write_bytes(data(" # sphere", [f"{i} 1 {0.5 * (i % 2)} 2.5 {xyz}" for i, xyz in PLACED.items()]))
    (frame,), _ = read(path)
    np.testing.assert_array_equal(frame.diameters, [0.5, 0.0, 0.5, 0.0])
    np.testing.assert_allclose(frame.masses, [2.5 * np.pi / 48, 2.5] * 2, rtol=4e-16)


def test_momenta_of_elements_that_are_numbers_are_velocities_as_ase_has_them(tmp_path):
    rows = [f"{z} {words(x)} 1 2 3" for z, x in zip(KINDS + 10, PLACES, strict=True)]
    head = f'{N}\nLattice="6 0 0 0 6 0 0 0 6" Properties=Z:I:1:pos:R:3:momenta:R:3'
    (tmp_path / "a.xyz").write_text("\n".join([head, *rows]) + "\n")
    (frame,), _ = read(tmp_path / "a.xyz")
    np.testing.assert_allclose(frame.velocities, ase.io.read(tmp_path / "a.xyz").get_velocities(), rtol=1e-15)
    np.testing.assert_array_equal(frame.species, KINDS)


def test_a_box_of_pdb_whose_edges_are_one_stands_for_none(tmp_path):
    path, places = tmp_path / "a.pdb", np.array([[1.0, 2.0, 3.0], [4.5, 5.5, 6.5]])
    atoms = [
        f"ATOM  {i + 1:5d}  X   X   X   1    " + "".join(f"{c:8.3f}" for c in x) + "  1.00  0.00\n"
        for i, x in enumerate(places)
    ]
    path.write_text(
        "CRYST1    1.000    1.000    1.000  90.00  90.00  90.00 P 1           1\n" + "".join(atoms)
    )
    with pytest.raises(FileError, match="holds no box"):
        carom.open(path)
    (frame,), _ = read(path, box=(9.0, 9.0, 9.0), diameter=0.5)
    close(frame.positions, places, THOUSANDTH)


def test_a_data_file_that_hides_its_style_or_lacks_rows_is_refused(tmp_path):
    rows = [f"{i} 1 0.5 2.0 {xyz}" for i, xyz in PLACED.items()]
    whole = data(" # sphere", rows)
    for changed, text in (
        (data("", rows), "expected a line 'Atoms # STYLE'"),
        (data(" # wild", rows), "its atom style is wild"),
        (data(" # sphere", rows[:3]), "has 3 rows, and 4 atoms were announced"),
        (whole.replace(b"2 1 0 0\n", b""), "Velocities lacks 1 atoms, such as 2"),
        (whole.replace(b"-2 2 xlo xhi", b""), "holds no box"),
        (whole.replace(b"0 4 zlo zhi", b""), "holds no box"),
    ):
        (tmp_path / "a.data").write_bytes(changed)
        with pytest.raises(FileError, match=text):
            carom.open(tmp_path / "a.data")


def test_a_dump_that_announces_another_number_names_the_frame(tmp_path):
    path = dump(tmp_path / "a.dump", "id type x y z", lambda i, k: f"{i + 1} 1 {wrapped(i, k)}")
    whole = path.read_text()
    for number, text in (("28", "frame 0 ends after 27 of 28"), ("26", "where an ITEM was expected")):
        path.write_text(whole.replace("ATOMS\n27", f"ATOMS\n{number}", 1))
        with pytest.raises(FileError, match=text):
            carom.open(path)


@pytest.mark.parametrize("row", ["inf 1 1", "nan 1 2", "1 2 nan"])
def test_coordinates_that_are_no_numbers_are_named_and_not_taken_for_equal_ones(tmp_path, row):
    path = dump(tmp_path / "a.dump", "id type x y z ix iy iz", lambda i, k: f"{i + 1} 1 {row} 0 0 0",
                box=("0 6", "0 6", "0 1"))  # fmt: skip
    with (
        pytest.warns(CaromWarning, match="a mass of 1, time steps for times; no velocities") as told,
        pytest.raises(FileError, match="in frame 0 the positions hold NaN or infinite values"),
    ):
        carom.io.read(path, 0)
    assert "dimensions" not in str(told[0].message)


# ------------------------------------------------------------------------ ASE, MDAnalysis, HOOMD-blue, H5MD


def atoms(k=0):
    found = ase.Atoms(
        np.where(KINDS == 0, "Ar", "Ne"), at(k), cell=[EDGE] * 3, pbc=True, info={"time": 0.5 * k}
    )
    found.set_velocities(MOVES)
    return found


def world():
    """Return MDAnalysis's Universe of the three frames, in which one is far outside of the box at the end."""
    found = mda.Universe.empty(N, trajectory=True, velocities=True)
    found.add_TopologyAttr("names", np.where(KINDS == 0, "Ar", "Ne"))
    found.load_new(np.array([at(k) for k in range(COUNT)]), order="fac", dt=0.5,
                   dimensions=[EDGE] * 3 + [90] * 3)  # fmt: skip
    return found


def by_ase(path, **options):
    ase.io.write(path, [atoms(k) for k in range(options.pop("count", COUNT))], **options)


def by_mdanalysis(path, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        moving = world()
        with mda.Writer(str(path), n_atoms=N, multiframe=options.pop("count", COUNT) > 1) as writer:
            for _ in moving.trajectory:
                writer.write(moving.atoms)
                if not writer.multiframe:
                    return


def by_gsd(path):
    with gsd.open(str(path), "w") as file:
        for k in range(COUNT):
            frame = gsd.Frame()
            frame.configuration.box, frame.configuration.step = [EDGE] * 3 + [0] * 3, 10 * k
            frame.particles.N, frame.particles.types, frame.particles.typeid = N, ["Ar", "Ne"], KINDS
            frame.particles.position = inside(at(k)) - EDGE / 2
            frame.particles.image = np.floor(at(k) / EDGE)
            file.append(frame)


def by_h5py(path):
    with h5py.File(path, "w") as file:
        group = file.create_group("particles/everything")
        group["species"] = KINDS
        box = group.create_group("box")
        box.attrs["boundary"] = np.array(["periodic"] * 3, dtype=h5py.string_dtype())
        box["edges"] = np.full(3, EDGE)
        places = group.create_group("position")
        places["value"] = np.array([inside(at(k)) for k in range(COUNT)])
        places["step"], places["time"] = 10, 0.5  # an interval each
        group["image/value"] = np.array([np.floor(at(k) / EDGE) for k in range(COUNT)], dtype=np.int32)


NANO = 10.0
WRITTEN = {
    # name: writer, frames, unit, rounding, species, times, unwrapped
    "a.traj": (by_ase, {}, 1.0, 0.0, True, 0.5, True),
    "a.extxyz": (by_ase, {}, 1.0, 1e-8, True, 0.5, True),
    "a.pdb": (by_ase, {}, 1.0, THOUSANDTH, True, 1.0, True),
    "a.gro": (by_ase, {"count": 1}, NANO, 10 * THOUSANDTH, True, 0.0, False),
    "a.cif": (by_ase, {"count": 1}, 1.0, 1e-5, True, 0.0, False),
    "POSCAR": (by_ase, {"count": 1, "format": "vasp", "sort": False}, 1.0, 1e-14, True, 0.0, False),
    "a.xtc": (by_mdanalysis, {}, NANO, 10 * THOUSANDTH, False, 0.5, True),
    "a.trr": (by_mdanalysis, {}, NANO, SINGLE, False, 0.5, True),
    "a.dcd": (by_mdanalysis, {}, 1.0, SINGLE, False, 1.0, True),
    "a.gsd": (by_gsd, {}, 1.0, SINGLE, True, 10.0, True),
    "a.h5md": (by_h5py, {}, 1.0, 1e-15, True, 0.5, True),
}
"""Who writes a file, with which options; its unit; rounding; and whether it has species, times and images."""


@pytest.mark.parametrize("name", WRITTEN)
def test_files_of_other_programs_hold_what_was_written(tmp_path, name):
    maker, options, unit, rounding, species, step, unwrapped = WRITTEN[name]
    path = tmp_path / name
    maker(path, **dict(options))
    frames, told = read(path)
    assert len(frames) == options.get("count", COUNT)
    assert "assumed a diameter of 1" in told
    for k, frame in enumerate(frames):
        np.testing.assert_allclose(frame.box, EDGE / unit, rtol=1e-6)
        close(frame.positions * unit, at(k), 3 * rounding + 1e-14 * EDGE)
        assert frame.time == pytest.approx(step * k, rel=1e-5)  # DCD: a unit of CHARMM and a float32
        if species:
            np.testing.assert_array_equal(frame.species, KINDS)
            assert frame.species_names == (("0", "1") if name == "a.h5md" else ("Ar", "Ne"))
        if name == "a.traj":
            np.testing.assert_allclose(frame.velocities, MOVES, rtol=1e-15)
    far = np.abs(at(COUNT - 1) / EDGE - 0.5).max() > 1.0
    assert far == (frames[-1].images is not None) or not unwrapped or name in ("a.gsd", "a.h5md")
    if frames[-1].images is not None:
        np.testing.assert_allclose(frames[-1].unwrapped * unit, at(COUNT - 1), atol=3 * rounding + 1e-14)
    if "velocities" in told:  # as a start, velocities are drawn
        with pytest.warns(CaromWarning):
            assert carom.Scene.from_file(path, diameter=0.05).velocities is None


def test_a_gsd_file_of_hoomd_has_sizes_of_its_shapes_and_two_dimensions(tmp_path):
    with gsd.open(str(tmp_path / "a.gsd"), "w") as file:
        frame = gsd.Frame()
        frame.configuration.box, frame.configuration.dimensions = [8, 8, 0, 0, 0, 0], 2
        frame.particles.N, frame.particles.types, frame.particles.typeid = 2, ["A", "B"], [0, 1]
        frame.particles.position = [[-3, 0, 0], [3, 1, 0]]
        frame.particles.type_shapes = [{"type": "Sphere", "diameter": x} for x in (0.5, 0.75)]
        file.append(frame)
    (found,), told = read(tmp_path / "a.gsd")
    assert (found.dimension, found.diameters.tolist()) == (2, [0.5, 0.75])
    np.testing.assert_array_equal(found.positions, [[1, 4], [7, 5]])
    assert "diameter" not in told


def test_what_gsd_leaves_out_has_its_default(tmp_path):
    """HOOMD-blue does not write what all particles have by default, such as images at first."""
    with gsd.open(str(tmp_path / "a.gsd"), "w") as file:
        for k in range(2):
            frame = gsd.Frame()
            frame.configuration.box, frame.configuration.step = [4, 4, 4, 0, 0, 0], k
            frame.particles.N, frame.particles.position = 2, [[-1, -1, -1], [1, 1, 1]]
            frame.particles.velocity, frame.particles.image = [[k, 0, 0]] * 2, [[k, 0, 0]] * 2
            file.append(frame)
    frames, told = read(tmp_path / "a.gsd")
    assert "velocities" not in told
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.images, [[k, 0, 0]] * 2)
        np.testing.assert_array_equal(frame.velocities, [[k, 0, 0]] * 2)
    with pytest.warns(CaromWarning):
        assert carom.io.convert(tmp_path / "a.gsd", tmp_path / "b.h5md") == 2


def test_h5md_with_a_box_in_time_rare_velocities_and_a_wall_is_read(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("particles/disks")
        group.create_group("box").attrs["boundary"] = np.array([b"periodic", b"none"])
        for name, steps, values in (
            ("position", [0, 10, 20], np.arange(12.0).reshape(3, 2, 2) / 4),
            ("velocity", [0, 10, 20, 30], np.arange(16.0).reshape(4, 2, 2)),
            ("box/edges", [0, 10, 20], np.array([[4.0, 5.0]] * 3)),
        ):
            group[f"{name}/value"], group[f"{name}/step"] = values, steps
        group["radius"] = np.array([0.25, 0.5])
        file["particles/few/position/value"] = np.zeros((1, 1, 2))
    frames, told = read(tmp_path / "a.h5")
    assert [frame.time for frame in frames] == [0, 10, 20]
    assert frames[1].periodic == (True, False)
    np.testing.assert_array_equal(frames[1].velocities, [[4, 5], [6, 7]])
    np.testing.assert_array_equal(frames[1].diameters, [0.5, 1.0])
    assert "left out group few" in told


# ------------------------------------------------------------------------------------------------ XYZ


def test_plain_xyz_needs_a_box_and_takes_any_comment_and_more_columns(tmp_path):
    path = tmp_path / "a.xyz"
    frame = "3\r\n300 \xb0K, i = 1, time = 2.5, E = -1\r\nAr 0 0 9 7\r\nAr 0 2 2 7\r\nKr 2 0 2 7\r\n"
    path.write_bytes(frame.encode("cp1252"))
    with pytest.raises(
        FileError, match=r"give its edges, as box=\(10, 10, 10\) or --box 10,10,10 of `carom measure` and"
    ):
        carom.open(path)
    (found,), _ = read(path, box=(4, 4, 4), diameter={"Ar": 1.0, "Kr": 1.25})
    assert (found.time, found.species_names, found.diameters.tolist()) == (2.5, ("Ar", "Kr"), [1, 1, 1.25])
    np.testing.assert_array_equal(found.positions, [[0, 0, 1], [0, 2, 2], [2, 0, 2]])
    for cube in (4, 4.0):
        (one,), _ = read(path, box=cube, diameter={"Ar": 1.0, "Kr": 1.25})
        assert one.box.tolist() == found.box.tolist() == [4, 4, 4]
    (tmp_path / "flat.xyz").write_text("2\n\nA 0 0 5\nA 1 2 5\n")
    (flat,), _ = read(tmp_path / "flat.xyz", box=4.0)
    assert flat.box.tolist() == [4, 4]
    done = CliRunner().invoke(app, ["measure", str(path), "rdf", "--box", "4", "--no-pictures"])
    assert done.exit_code == 0, done.output
    assert "g(r) in 200 bins from 0 to 2 [length]" in done.output
    with pytest.raises(InputError, match="diameter names no Kr"):
        carom.open(path, box=(4, 4, 4), diameter={"Ar": 1.0})
    done = CliRunner().invoke(
        app, ["export", str(path), str(tmp_path / "b.h5md"), "--box", "4,4,4", "--diameter", "Ar:1,Kr:1.25"]
    )
    assert done.exit_code == 0, done.output
    np.testing.assert_array_equal(carom.io.read(tmp_path / "b.h5md").positions, found.positions)
    with pytest.raises(InputError, match="was written by Carom"):
        carom.open(tmp_path / "b.h5md", diameter=2.0)


def test_extended_xyz_with_an_origin_radii_and_no_time_is_read(tmp_path):
    head = '2\nLattice="4 0 0 0 4 0 0 0 4" Origin="-2 -2 0" Properties=species:S:1:pos:R:3:radius:R:1:q:R:1\n'
    (tmp_path / "a.xyz").write_text(head + "A -1 0 1 0.5 9\nA 1.5 0 1 0.5 9\n")
    (found,), told = read(tmp_path / "a.xyz")
    np.testing.assert_array_equal(found.positions, [[1, 2, 1], [3.5, 2, 1]])
    assert (found.diameters.tolist(), found.time) == ([1, 1], 0.0)
    assert found.lacks == {"masses", "velocities", "time"}
    assert told.endswith("assumed a mass of 1; no velocities; left out q.")


def test_extended_xyz_of_disks_has_two_dimensions_and_names_in_any_letters(tmp_path):
    head = (
        '2\nLattice="4 0 0 0 4 0 0 0 1" Properties=Species:S:1:pos:R:3:Velocity:R:3:Radius:R:1 pbc="T T F"\n'
    )
    (tmp_path / "a.xyz").write_text((head + "A 1 1 0 1 2 0 0.5\nB 3 3 0 3 4 0 0.25\n") * 2)
    (found, _), told = read(tmp_path / "a.xyz")
    assert (found.dimension, found.periodic, found.species_names) == (2, (True, True), ("A", "B"))
    np.testing.assert_array_equal(found.velocities, [[1, 2], [3, 4]])
    np.testing.assert_array_equal(found.diameters, [1.0, 0.5])
    assert "2 dimensions, as the other coordinates are all equal, times 0, 1, 2 and so on." in told


# -------------------------------------------------------------------------------- as a start, and as a source


def test_a_run_starts_from_a_file_of_frames(tmp_path):
    path = tmp_path / "a.xyz"
    path.write_text("2\n\nA 1 1 1\nA 3 3 3\n")
    done = CliRunner().invoke(app, ["run", str(path), "--box", "4,4,5", "--diameter", "0.5", "--dry-run"])
    assert done.exit_code == 0, done.output
    assert "Scene(n=2, dimension=3, box=(4, 4, 5), diameter=0.5" in done.output
    for more, text in (
        ([], "holds no box"),
        (["--box", "4,4"], "coordinates beyond the 2 dimensions"),
        (["--n", "3"], "n has no meaning"),
    ):
        done = CliRunner().invoke(app, ["run", str(path), *more, "--out", str(tmp_path / "r")])
        assert (done.exit_code, text in done.output) == (2, True), done.output
    assert not (tmp_path / "r").exists()


def test_what_a_format_cannot_hold_is_said_of_the_file_that_was_asked_for(tmp_path):
    path = dump(tmp_path / "a.dump", "type x y z", lambda i, k: f"{KINDS[i]} {wrapped(i, k)}")
    with (
        pytest.warns(CaromWarning),
        pytest.raises(InputError, match=r"differ from those of \S*/b\.h5md, where"),
    ):
        carom.io.convert(path, tmp_path / "b.h5md")


# ------------------------------------------------------------------------------------- what cannot be read


@pytest.mark.parametrize(
    "name", ["a.dump", "a.data", "a.xyz", "a.gsd", "a.h5md", "a.pdb", "a.gro", "a.xtc", "a.trr", "a.dcd",
             "a.traj", "a.cif", "POSCAR"],
)  # fmt: skip
def test_empty_cut_and_wrong_files_are_one_sentence_of_every_command(tmp_path, name):
    path = tmp_path / name
    contents = [b"", b"\x89PNG\r\n\x1a\n" + RNG.bytes(2000)]
    if name in WRITTEN and name != "a.cif":  # which does not say how many atoms there are
        maker, options, *_ = WRITTEN[name]
        maker(path, **dict(options))
        whole = path.read_bytes()
        contents.append(whole[: int(0.6 * len(whole))])
    for content in contents:
        path.write_bytes(content)
        with pytest.raises(FileError) as caught:
            carom.io.read(path, ":")
        assert "\n" not in str(caught.value)
    done = CliRunner().invoke(app, ["measure", str(path)])
    assert (done.exit_code, "Traceback" in done.output) == (2, False), done.output


# ------------------------------------------------------------------------------------------- measuring


@pytest.mark.parametrize("kinds", [2, 5])
def test_g_of_points_is_that_of_each_pair_of_a_few_species(tmp_path, kinds):
    path = dump(tmp_path / "a.dump", "id type x y z", lambda i, k: f"{i} {i % kinds} {wrapped(i, k)}")
    with pytest.warns(CaromWarning):
        found = carom.measure(path, "rdf")["rdf"]
    names = ["0-0", "0-1", "1-1"] if kinds == 2 else None
    counts = [each.counts for each in found.values()] if names else [found.counts]
    assert names is None or list(found) == names
    with pytest.warns(CaromWarning):
        every = carom.RDF().over(
            dataclasses.replace(frame, diameters=np.zeros(N)) for frame in carom.open(path)
        )
    np.testing.assert_array_equal(sum(counts), every.counts)


def test_frames_of_others_are_measured_as_points_where_nobody_knows_their_size(tmp_path):
    path = tmp_path / "a.lammpstrj"

    def row(i, k):
        return f"{i} 1 {wrapped(i, k)} {words(np.floor(at(k)[i] / EDGE))}"

    dump(path, "id type x y z ix iy iz", row, count=12)
    done = CliRunner().invoke(app, ["measure", str(path), "--json", "--no-pictures", "--quiet"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert {*found} == {"rdf", "structure", "msd", "order", "crystal"}
    assert found["rdf"]["diameter"] == 0.0
    square = 0.25 * np.mean(np.sum(MOVES**2, axis=1))
    assert found["msd"]["mean_square"][0] == pytest.approx(square, rel=1e-12)
    for name in found:
        assert (tmp_path / f"{name}.csv").is_file()
    done = CliRunner().invoke(app, ["measure", str(path), "--no-pictures", "--quiet", "--diameter", "0.1"])
    assert "27 spheres in 3 dimensions" in done.output
    assert "g(r) in 200 bins from 0.1" in done.output
    with pytest.warns(CaromWarning, match="a mass of 1"):
        given = carom.open(path, diameter=0.1)
    assert carom.RDF().over(given).diameter == 0.1
