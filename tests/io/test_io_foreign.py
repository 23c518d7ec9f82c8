"""Trajectories that other programs wrote, and that they read: what they say is understood, or refused."""

import dataclasses
import os
import warnings

import ase
import h5py
import MDAnalysis as mda
import numpy as np
import pytest
from helpers.frames import make_frames, write
from typer.testing import CliRunner

import carom
from carom.cli import app
from carom.errors import CaromWarning, FileError, InputError

CELL = 'Lattice="10 0 0 0 10 0 0 0 10"'
ROWS = ("1 2 3", "4 5 6")


@pytest.fixture(autouse=True)
def bridge():
    import carom.io.mdanalysis  # noqa: F401

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        yield


def world(tmp_path, second, rows, read=mda.Universe):
    """Return what MDAnalysis makes of a file with this second line."""
    path = tmp_path / "other.extxyz"
    path.write_text(f"{len(rows)}\n{second}\n" + "\n".join(rows) + "\n")
    return read(str(path))


def full(second, *, pos=3, velo=3):
    """Return a frame that carom.io can read: all columns, in the words of another program."""
    properties = f"Properties=pos:R:{pos}:velo:R:{velo}:masses:R:1:radius:R:1:id:I:1"
    rows = [" ".join([number] * (pos + velo)) + f" 1 0.5 {k}" for k, number in ((1, "1.5"), (2, "4"))]
    return f"2\n{properties} {second}\n{rows[0]}\n{rows[1]}\n"


FLAGS = {
    '"T T F"': (True, True, False),
    '"true true false"': (True, True, False),
    '"True TRUE False"': (True, True, False),
    "T,T,F": (True, True, False),
    '"T, F, T"': (True, False, True),
    "[T, T, F]": (True, True, False),
    "[true,false,true]": (True, False, True),
    '"[1, 1, 0]"': (True, True, False),
    "{T F F}": (True, False, False),
    "'1 0 1'": (True, False, True),
    '"0 0 0"': (False, False, False),
    '"F F F"': (False, False, False),
}


@pytest.mark.parametrize("word", FLAGS)
def test_periodic_axes_are_understood_however_they_are_written(tmp_path, word):
    for key in ("pbc", "PBC"):
        found = world(tmp_path, f"{CELL} Properties=pos:R:3 {key}={word}", ROWS)
        assert found.trajectory.ts.data["periodic"] == FLAGS[word]
        path = tmp_path / "full.extxyz"
        path.write_text(full(f"{CELL} {key} = {word} time=0 step=0"))
        assert carom.io.read(path).periodic == FLAGS[word]


def test_two_flags_are_enough_in_two_dimensions(tmp_path):
    path = tmp_path / "full.extxyz"
    path.write_text(full(f'{CELL} pbc="T F" time=0 step=0', pos=2, velo=2))
    frame = carom.io.read(path)
    assert frame.periodic == (True, False)
    np.testing.assert_array_equal(frame.positions, [[1.5, 1.5], [4.0, 4.0]])


def test_axes_without_a_length_are_not_periodic(tmp_path):
    found = world(tmp_path, "Properties=pos:R:3 time=0.5", ROWS).trajectory.ts
    assert found.data["periodic"] == (False, False, False)
    assert found.dimensions is None
    slab = world(tmp_path, 'Lattice="9 0 0 0 9 0 0 0 0" pbc="T T F" Properties=pos:R:3', ROWS)
    assert slab.trajectory.ts.data["periodic"] == (True, True, False)
    (tmp_path / "full.extxyz").write_text(full("time=0 step=0"))
    with pytest.raises(FileError, match="holds no box; give its edges"):
        carom.io.read(tmp_path / "full.extxyz")


def test_frames_with_and_without_a_cell_do_not_share_it(tmp_path):
    path = tmp_path / "a.extxyz"
    frames = (f"{CELL} Properties=pos:R:3", "Properties=pos:R:3")
    path.write_text("".join(f"2\n{second}\n{ROWS[0]}\n{ROWS[1]}\n" for second in frames))
    found = mda.Universe(str(path)).trajectory
    assert found[0].data["periodic"] == (True, True, True)
    assert found[1].data["periodic"] == (False, False, False)
    assert found[1].dimensions is None


REFUSED = [
    *(
        (f"{CELL} Properties=pos:R:3 pbc={word}", "expected three flags")
        for word in ('"yes no no"', '"T T"', "T", '"T T F F"', '"2 1 0"', '""', '"TTF"', '"on on off"')
    ),
    *(
        (f"{key}={cell} Properties=pos:R:3", "expected nine numbers")
        for cell in ('"10 0 0"', '"a b c d e f g h i"', '"nan 0 0 0 1 0 0 0 1"', '""', "10")
        for key in ("Lattice", "lattice")
    ),
    ('pbc="T F F" Properties=pos:R:3', "axis 0 is periodic, and has no length"),
    ('Lattice="0 0 0 0 10 0 0 0 10" pbc="T T T" Properties=pos:R:3', "axis 0 is periodic, and has no length"),
    (f"{CELL} Properties=pos:R:2:q:R:1 dimension=flat", "expected an integer"),
    (f"{CELL} Properties=pos:R:1:radius:R:2", "2 columns of kind R for 'radius'"),
    (f"{CELL} Properties=pos:R:3:pos:R:3", "'pos' twice"),
    (f"{CELL} Properties=pos:Q:3", "of kind Q"),
    (f"{CELL} Properties=pos:S:3", "of kind S; expected R"),
    (f"{CELL} Properties=pos:R:x", "x columns"),
    (f"{CELL} Properties=pos:R", "no multiple of 3"),
    (f"{CELL} Properties=velo:R:3", "no column 'pos'"),
]
FOR_A_UNIVERSE = [
    (f"{CELL} Properties=pos:R:3 dimension=2", "along other axes are not 0"),
    (f"{CELL} Properties=pos:R:2:q:R:1 dimension=3", "expected 1 to 2"),
    (f"{CELL} Properties=pos:R:2:velo:R:1", "no vectors of 2 numbers"),
]


@pytest.mark.parametrize(("second", "says"), REFUSED + FOR_A_UNIVERSE)
def test_a_second_line_that_makes_no_sense_is_refused_by_carom_and_in_mdanalysis(tmp_path, second, says):
    for read in (mda.Universe, carom.io.read)[: 1 if (second, says) in FOR_A_UNIVERSE else 2]:
        with pytest.raises((FileError, ValueError), match=says):
            world(tmp_path, second, ROWS, read=read)


def test_a_cell_in_brackets_is_a_cell(tmp_path):
    for cell in ("[[10, 0, 0], [0, 11, 0], [0, 0, 12]]", '"10, 0, 0, 0, 11, 0, 0, 0, 12"'):
        found = world(tmp_path, f"Lattice={cell} Properties=pos:R:3", ROWS)
        np.testing.assert_allclose(found.dimensions, [10, 11, 12, 90, 90, 90])


@pytest.mark.parametrize(("pos", "velo"), [(1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 3)])
def test_vectors_have_as_many_columns_as_there_are_dimensions(tmp_path, pos, velo):
    rows = ["1 " * pos + "0.5 " * velo, "4 " * pos + "0.25 " * velo]
    second = f"{CELL} Properties=pos:R:{pos}:velo:R:{velo} Time=0.50"
    ts = world(tmp_path, second, rows).trajectory.ts
    np.testing.assert_array_equal(ts.positions[:, pos:], 0.0)
    np.testing.assert_array_equal(ts.velocities[:, :pos], [[0.5] * pos, [0.25] * pos])
    np.testing.assert_array_equal(ts.velocities[:, pos:], 0.0)
    assert ts.data["positions"].shape == ts.data["velocities"].shape == (2, pos)
    assert ts.time == 0.5


SHUFFLED = [
    ("1 1 1 1 .5 a", "2 5 5 5 .25 b", "3 7 7 7 1 c"),
    ("3 7 7 7 1 c", "1 1 1 1 .5 a", "2 5 5 5 .25 b"),
]


@pytest.mark.parametrize("name", ["id", "ID"])
def test_components_are_followed_by_their_ids(tmp_path, name):
    head = f"3\n{CELL} Properties={name}:I:1:pos:R:3:radius:R:1:species:S:1\n"
    for order in (SHUFFLED, SHUFFLED[::-1]):
        path = tmp_path / "a.extxyz"
        path.write_text("".join(head + "\n".join(rows) + "\n" for rows in order))
        universe = mda.Universe(str(path))
        for ts in universe.trajectory:
            np.testing.assert_array_equal(ts.positions[:, 0], [1.0, 5.0, 7.0])
        np.testing.assert_array_equal(universe.atoms.radii, [0.5, 0.25, 1.0])
        assert list(universe.atoms.names) == ["a", "b", "c"]
        assert list(universe.atoms.ids) == [1, 2, 3]


@pytest.mark.parametrize("index", [0, 1, -1, ":"])
def test_carom_follows_ids_in_its_own_words(tmp_path, index):
    frames = make_frames(2, count=3)
    path = write(tmp_path / "a.extxyz", frames)
    lines, n = path.read_text().split("\n"), frames[0].n
    for k in range(3):  # each frame in another order
        begin = k * (n + 2) + 2
        order = np.random.default_rng(k).permutation(n)
        lines[begin : begin + n] = [lines[begin + m] for m in order]
    path.write_text("\n".join(lines))
    found = carom.io.read(path, index)
    right = frames if index == ":" else [frames[index]]
    for a, b in zip(right, found if index == ":" else [found], strict=True):
        for field in ("positions", "velocities", "diameters", "images"):
            np.testing.assert_array_equal(getattr(a, field), getattr(b, field))


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        (("1 1 1 1", "1 5 5 5"), "the same id"),
        (("1 1 1 1", "3 5 5 5"), "not those of the first frame"),
        (("1.5 1 1 1", "2 5 5 5"), "column of integers"),
    ],
)
def test_ids_that_name_nobody_are_refused(tmp_path, rows, text):
    path = tmp_path / "a.extxyz"
    first = ("1 1 1 1", "2 5 5 5")
    head = f"2\n{CELL} Properties=id:I:1:pos:R:3\n"
    path.write_text("".join(head + "\n".join(each) + "\n" for each in (first, rows)))
    with pytest.raises((FileError, ValueError), match=text):
        list(mda.Universe(str(path)).trajectory)


def test_ids_that_come_or_go_are_refused(tmp_path):
    whole = full(f"{CELL} time=0 step=0")
    bare = whole.replace(":id:I:1", ":mark:I:1")
    for texts in ((whole, bare), (bare, whole)):
        path = tmp_path / "a.extxyz"
        path.write_text("".join(texts))
        if texts[0] is whole:
            with pytest.raises(FileError, match="no column 'id'"):
                carom.io.read(path, ":")
        else:  # nobody can be followed, and nobody has changed places
            assert len(carom.io.read(path, ":")) == 2


def test_a_header_that_no_trajectory_has_is_refused_by_itself(tmp_path):
    path = tmp_path / "a.extxyz"
    row = " ".join(["word"] * 200) + "\n"  # whoever reads the rows first complains of their words
    path.write_text(f"40\n{CELL} Properties=pos:R:100:velo:R:100\n" + row * 40)
    with pytest.raises(FileError, match="100 columns of kind R for 'pos'; expected 1 to 3"):
        carom.io.read(path)


@pytest.mark.parametrize("second", ["time=soon step=0", "time=0 dimension=flat"])
def test_a_second_line_of_others_is_refused_in_a_sentence_by_every_command(tmp_path, second):
    path = tmp_path / "a.extxyz"
    path.write_text(full(f"{CELL} {second}"))
    with pytest.raises(FileError, match="expected") as caught:
        carom.io.read(path)
    assert "\n" not in str(caught.value)
    for words in (["export", path, tmp_path / "b.h5md"], ["measure", path], ["view", path, "--no-open"]):
        done = CliRunner().invoke(app, [str(word) for word in words])
        assert done.exit_code == 2, done.output


def test_a_second_line_of_a_million_letters_is_refused(tmp_path):
    """10^12 comparisons would take hours."""
    path = tmp_path / "a.extxyz"
    path.write_text("1\n" + "a" * 1_000_000 + "\n1 1 1\n")
    with pytest.raises(FileError):
        carom.io.read(path)


# ------------------------------------------------------------------------------------------------ ASE


def test_atoms_come_in_the_order_of_their_ids():
    frame = make_frames(3)[0]
    atoms = frame.to_ase()[np.random.default_rng(1).permutation(frame.n)]
    found = carom.io.from_ase(atoms)
    np.testing.assert_array_equal(found.positions, frame.positions)
    np.testing.assert_array_equal(found.velocities, frame.velocities)
    atoms.arrays["id"][:2] = 7
    with pytest.raises(InputError, match=r"del atoms\.arrays\['id'\]"):
        carom.io.from_ase(atoms)


@pytest.mark.parametrize("width", [1, 2, 3])
def test_atoms_whose_program_wrote_velocities_and_no_momenta_move(width):
    atoms = ase.Atoms("Ar2", positions=[[1, 1, 1], [5, 5, 5]], cell=[9, 9, 9], pbc=True)
    velocities = np.arange(1.0, 2 * width + 1).reshape(2, width)
    atoms.set_array("velo", velocities)
    found = carom.io.from_ase(atoms, diameter=1.0).velocities
    np.testing.assert_array_equal(found[:, :width], velocities)
    np.testing.assert_array_equal(found[:, width:], 0.0)


# ------------------------------------------------------------------------------------------------ H5MD


@pytest.mark.parametrize(("unit", "ps"), [("fs", 1e-3), ("ps", 1.0), ("ns", 1e3), ("s", 1e12)])
def test_h5md_of_others_keeps_its_units(tmp_path, unit, ps):
    with h5py.File(tmp_path / "other.h5md", "w") as file:
        file.create_group("h5md").attrs["version"] = np.array([1, 1])
        atoms = file.create_group("particles/trajectory")
        atoms.create_group("box").attrs["dimension"] = 3
        atoms["box"].attrs["boundary"] = np.array([b"none"] * 3)
        for name, units in (("position", "nm"), ("velocity", "nm ps-1")):
            group = atoms.create_group(name)
            group["value"] = np.arange(18.0).reshape(3, 2, 3)
            group["value"].attrs["unit"] = units
            group["step"] = np.arange(3)
            group["time"] = 50.0 * np.arange(3)
            group["time"].attrs["unit"] = unit
    found = mda.Universe(str(tmp_path / "other.h5md")).trajectory
    assert found.dt == pytest.approx(50.0 * ps)
    assert found.totaltime == pytest.approx(100.0 * ps)
    assert [ts.time for ts in found] == pytest.approx([0.0, 50.0 * ps, 100.0 * ps])
    np.testing.assert_allclose(found[1].positions[0], [60.0, 70.0, 80.0])
    np.testing.assert_allclose(found[1].velocities[0], [60.0, 70.0, 80.0])
    plain = mda.Universe(str(tmp_path / "other.h5md"), convert_units=False).trajectory
    assert plain.dt == 50.0


# ------------------------------------------------------------------------------------------------ GSD


def frames_of(diameters, dimension=3):
    """Return a frame of each of the diameters, all else alike."""
    frame = make_frames(dimension, count=1, n=4)[0]
    frame.positions[:] = np.arange(1.0, 8.0, 2.0)[:, np.newaxis] / 1.2  # apart, on a diagonal
    return [dataclasses.replace(frame, diameters=np.array(each, float)) for each in diameters]


SIZES = {
    "unit spheres": [[1, 1, 1, 1]] * 2,
    "at first unit spheres": [[1, 1, 1, 1], [1, 2, 1, 2], [1, 1, 1, 1]],
    "at first others": [[1, 2, 1, 2], [1, 1, 1, 1], [3, 3, 3, 3]],
    "of one size": [[0.5] * 4] * 2,
}


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("name", SIZES)
def test_gsd_says_how_large_the_spheres_of_every_frame_are(tmp_path, name, dimension):
    from gsd import fl

    frames = frames_of(SIZES[name], dimension)
    path = write(tmp_path / "a.gsd", frames)
    with carom.io.open(path, "a", keep=1) as writer:  # which writes the first frame anew
        for frame in frames[1:]:
            writer.write(frame)
    with fl.open(str(path), "r") as file:
        for k, frame in enumerate(frames):
            # What a frame lacks is what the first has.
            at = k if file.chunk_exists(k, "particles/diameter") else 0
            np.testing.assert_array_equal(file.read_chunk(at, "particles/diameter"), frame.diameters)
        assert file.chunk_exists(0, "particles/mass")
    for frame, found in zip(frames, carom.io.read(path, ":"), strict=True):
        np.testing.assert_array_equal(found.diameters, frame.diameters)


@pytest.mark.needs("OVITO")
@pytest.mark.parametrize("name", SIZES)
def test_ovito_draws_the_spheres_of_gsd_as_large_as_they_are(tmp_path, name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import ovito.io as ovito
    frames = frames_of(SIZES[name])
    pipeline = ovito.import_file(str(write(tmp_path / "a.gsd", frames)))
    for k, frame in enumerate(frames):
        np.testing.assert_allclose(pipeline.compute(k).particles["Radius"], frame.diameters / 2)


# ------------------------------------------------------------------------------------------------ modes


@pytest.mark.parametrize(("mask", "mode"), [(0o077, 0o600), (0o002, 0o664)])
def test_every_file_has_the_mode_that_the_mask_leaves(tmp_path, mask, mode):
    """Trajectories, those cut and those converted; a checkpoint, a log, and what takes another's place."""
    before = os.umask(mask)
    try:
        frames = frames_of(SIZES["unit spheres"])
        for suffix in ("h5md", "extxyz", "gsd"):
            write(tmp_path / f"a.{suffix}", frames)
            carom.io.open(tmp_path / f"a.{suffix}", "a", keep=1).close()
            carom.io.convert(tmp_path / "a.h5md", tmp_path / f"b.{suffix}")
        for suffix in ("lammpstrj", "data", "dcd", "pdb"):
            carom.io.convert(tmp_path / "a.h5md", tmp_path / f"b.{suffix}")
        sim = carom.Simulation(
            carom.Scene.random(8, 0.1, 2, seed=1), seed=1, event_log=tmp_path / "events.h5"
        )
        for _ in range(2):
            sim.save(tmp_path / "state.h5")
        sim.close()
        for words in (["init", "scene.toml"], ["measure", "a.h5md", "rdf"], ["view", "a.h5md"]):
            given = [str(tmp_path / word) if "." in word else word for word in words]
            done = CliRunner().invoke(app, [*given, *(["--no-open"] if words[0] == "view" else [])])
            assert done.exit_code == 0, done.output
    finally:
        os.umask(before)
    modes = {path.name: path.stat().st_mode & 0o777 for path in tmp_path.iterdir()}
    assert len(modes) == 16
    assert set(modes.values()) == {mode}, {name: oct(each) for name, each in modes.items()}


def test_h5md_of_others_with_an_interval_of_time_begins_at_its_offset(tmp_path):
    with h5py.File(tmp_path / "other.h5md", "w") as file:
        atoms = file.create_group("particles/all")
        box = atoms.create_group("box")
        box.attrs["dimension"], box.attrs["boundary"] = 3, np.array([b"periodic"] * 3)
        box["edges"] = [9.0, 9.0, 9.0]
        group = atoms.create_group("position")
        group["value"] = np.ones((3, 1, 3))
        group["time"] = 0.25
        group["time"].attrs["offset"] = 5.0
    with pytest.warns(CaromWarning, match="assumed"):
        frames = carom.io.read(tmp_path / "other.h5md", ":")
    assert [frame.time for frame in frames] == [5.0, 5.25, 5.5]
