"""What LAMMPS, DCD and PDB files hold, as other programs read them."""

import dataclasses
import sys

import ase.io
import MDAnalysis
import numpy as np
import pytest
from helpers.frames import frames_of, write

import carom.io
from carom.errors import CaromWarning, InputError


def exported(tmp_path, name, frames):
    write(tmp_path / "a.h5md", frames)
    count = carom.io.convert(tmp_path / "a.h5md", tmp_path / name)
    return tmp_path / name, count


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_lammps_dump_has_walls_types_masses_and_the_number_of_its_frame(tmp_path, dimension):
    frames = frames_of(dimension)
    path, count = exported(tmp_path, "a.lammpstrj", frames)
    assert count == 3
    lines = path.read_text().splitlines()
    assert lines[:2] == ["ITEM: TIME", f"{frames[0].time:.17g}"]
    lines = lines[2:]
    assert lines[1] == "0"
    flags = ["pp"] * (dimension - 1) + ["ff"] + ["pp"] * (3 - dimension)
    assert lines[4] == "ITEM: BOX BOUNDS " + " ".join(flags)
    names = lines[8].split()[2:]
    table = np.array([line.split() for line in lines[9:16]], dtype=float)
    np.testing.assert_array_equal(table[:, 1], frames[0].species + 1)
    np.testing.assert_allclose(table[:, names.index("mass")], frames[0].masses, rtol=1e-8)
    assert lines[16 + 3] == "1"


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_lammps_data_file_holds_the_last_frame_with_its_masses(tmp_path, dimension):
    """A disk has the density of the sphere around it: LAMMPS knows no other in two dimensions."""
    frames = frames_of(dimension)
    path, count = exported(tmp_path, "a.data", frames)
    assert count == 1
    text = path.read_text()
    assert "7 atoms" in text
    assert "2 atom types" in text
    rows = np.array([line.split() for line in text.split("Atoms # sphere\n\n")[1].splitlines()[:7]], float)
    np.testing.assert_allclose(rows[:, 3] * np.pi / 6 * rows[:, 2] ** 3, frames[-1].masses, rtol=1e-8)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("name", "head"), [("a.data", "Velocities\n\n"), ("a.lammpstrj", " omegaz\n")])
def test_files_of_lammps_have_the_spins_behind_the_velocities_or_at_the_end(tmp_path, dimension, name, head):
    """In the plane they turn about the third axis."""
    (frame,) = frames_of(dimension, count=1)
    spins = np.random.default_rng(1).normal(size=(frame.n, 2 * dimension - 3))
    path, _ = exported(tmp_path, name, [dataclasses.replace(frame, spins=spins)])
    rows = np.array([line.split() for line in path.read_text().split(head)[1].splitlines()], float)
    np.testing.assert_allclose(rows[:, -spins.shape[1] :], spins, rtol=1e-8)
    assert (rows[:, -3:] != 0.0).sum() == spins.size


@pytest.mark.filterwarnings("ignore:.*PDB holds no times")
def test_dcd_and_pdb_hold_unwrapped_positions(tmp_path):
    frames = frames_of(3)
    pdb, _ = exported(tmp_path, "a.pdb", frames)
    (tmp_path / "a.h5md").unlink()
    dcd, count = exported(tmp_path, "a.dcd", frames)
    assert count == 3
    universe = MDAnalysis.Universe(str(pdb), str(dcd))
    # Times go through a unit of CHARMM and a float32.
    assert universe.trajectory.dt == pytest.approx(0.1, rel=1e-5)
    for frame, ts in zip(frames, universe.trajectory, strict=True):
        np.testing.assert_allclose(ts.positions, frame.unwrapped, atol=2e-6)
        np.testing.assert_allclose(ts.dimensions[:3], frame.box, rtol=1e-6)
    assert len(MDAnalysis.Universe(str(pdb)).trajectory) == 3


@pytest.mark.parametrize(
    ("names", "written", "elements"),
    [
        (("small", "big"), ["smal", "big"], ["", ""]),  # no samarium and no bismuth
        (("large one", "large two"), ["lar1", "lar2"], ["", ""]),
        (("Ar", "Kr"), ["Ar", "Kr"], ["Ar", "Kr"]),
    ],
)
@pytest.mark.filterwarnings("ignore:Unknown element X:UserWarning", "ignore:.*PDB holds no times")
def test_a_pdb_file_names_every_species_and_no_element_that_is_none(tmp_path, names, written, elements):
    frames = frames_of(3, names)
    path, _ = exported(tmp_path, "a.pdb", frames)
    universe = MDAnalysis.Universe(str(path))
    assert universe.atoms.names.tolist() == [written[k] for k in frames[0].species]
    assert universe.atoms.elements.tolist() == [elements[k] for k in frames[0].species]
    assert ase.io.read(path, index=0).get_chemical_symbols() == [
        elements[k] or "X" for k in frames[0].species
    ]


@pytest.mark.parametrize(("names", "labeled"), [(("small", "big"), True), (("1st", "2nd"), False)])
def test_a_lammps_data_file_labels_its_types_where_lammps_takes_the_names(tmp_path, names, labeled):
    frames = frames_of(3, names)
    path, _ = exported(tmp_path, "a.data", frames)
    text = path.read_text()
    assert ("Atom Type Labels\n\n1 small\n2 big\n\nAtoms" in text) == labeled
    assert len(MDAnalysis.Universe(str(path), format="DATA", atom_style="id type diam den x y z").atoms) == 7


def test_a_lammps_data_file_of_points_holds_their_masses(tmp_path):
    frames = [dataclasses.replace(frame, diameters=np.zeros(frame.n)) for frame in frames_of(3)]
    path, _ = exported(tmp_path, "a.data", frames)
    with pytest.warns(CaromWarning, match="periodic"):
        found = carom.io.read(path)
    assert not found.diameters.any()
    np.testing.assert_allclose(found.masses, frames[-1].masses, rtol=1e-8)


def test_what_is_only_written_is_not_opened(tmp_path):
    with pytest.raises(InputError, match="written by carom export"):
        carom.io.open(tmp_path / "a.dcd", "w")


def test_what_cannot_be_written_is_told_all_that_can(tmp_path):
    with pytest.raises(InputError, match=r"\.gro', which .* one of \.h5md, .*\.gsd, \.lammpstrj, .*\.dcd"):
        exported(tmp_path, "a.gro", frames_of(3))


def test_where_gsd_is_not_installed_the_file_that_was_asked_for_is_named(tmp_path, monkeypatch):
    """Not the temporary one that would have taken its place."""
    path, far = write(tmp_path / "a.extxyz", frames_of(3, periodic=True)), tmp_path / "far.gsd"
    monkeypatch.setitem(sys.modules, "gsd.hoomd", None)
    for ask in (lambda: carom.io.convert(path, far), lambda: carom.io.open(far, "w")):
        with pytest.raises(InputError) as caught:
            ask()
        assert str(caught.value) == (
            f"{far} needs the package gsd, which is not installed: pip install 'carom[gsd]'."
        )
    assert [file.name for file in tmp_path.iterdir()] == ["a.extxyz"]


def test_ase_and_a_universe_of_carom_read_a_lammps_dump_and_gsd_its_own_file(tmp_path):
    import gsd.hoomd as gsd

    frames = frames_of(3, periodic=True)
    path, _ = exported(tmp_path, "a.lammpstrj", frames)
    universe = carom.io.universe(path)  # that of MDAnalysis reads no dump with times
    atoms = ase.io.read(path, index=":", format="lammps-dump-text")
    write(tmp_path / "a.gsd", frames)
    with gsd.open(str(tmp_path / "a.gsd"), "r") as stored:
        for frame, ts, each, one in zip(frames, universe.trajectory, atoms, stored, strict=True):
            np.testing.assert_allclose(ts.positions, frame.positions, atol=2e-6)
            assert ts.time == frame.time
            np.testing.assert_allclose(each.positions, frame.positions, rtol=1e-8)
            np.testing.assert_allclose(each.cell.lengths(), frame.box, rtol=1e-8)
            np.testing.assert_allclose(one.particles.diameter, frame.diameters, rtol=1e-7)
            assert [one.particles.types[k] for k in one.particles.typeid] == [
                frame.species_names[k] for k in frame.species
            ]
