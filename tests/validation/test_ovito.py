"""Mixtures between walls as OVITO itself reads them (``pip install ovito``)."""

import warnings

import numpy as np
import pytest
from helpers.frames import frames_of, write

import carom.io
from carom.figures.palette import FACES, rgb

pytestmark = [pytest.mark.slow, pytest.mark.needs("OVITO")]


@pytest.fixture
def read():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from ovito import io
    return lambda path: io.import_file(str(path)).compute()


def names_in(data):
    return {kind.name for kind in data.particles.particle_types.types}


@pytest.mark.parametrize("dimension", [2, 3])
def test_ovito_sees_names_radii_colors_and_walls_in_extended_xyz_but_never_two_dimensions(
    tmp_path, dimension, read
):
    """Its reader has no key for a flat cell (docs/files); should a new version learn one, this test fails."""
    (frame,) = frames_of(dimension, count=1)
    data = read(write(tmp_path / "a.extxyz", [frame]))
    assert names_in(data) == {"small", "big"}
    assert list(data.cell.pbc) == [*frame.periodic, *[False] * (3 - dimension)]
    np.testing.assert_allclose(data.particles["Radius"], frame.diameters / 2)
    np.testing.assert_allclose(data.particles["Color"], [rgb(FACES[k]) for k in frame.species], atol=5e-4)
    assert not data.cell.is2D


@pytest.mark.filterwarnings("ignore:.*GSD knows no walls")
@pytest.mark.parametrize("dimension", [2, 3])
def test_ovito_sees_the_dimension_in_gsd_and_in_memory(tmp_path, dimension, read):
    (frame,) = frames_of(dimension, count=1)
    for data in (read(write(tmp_path / "a.gsd", [frame])), frame.to_ovito()):
        assert data.cell.is2D == (dimension == 2)
        assert names_in(data) == {"small", "big"}
        np.testing.assert_allclose(data.particles["Radius"], frame.diameters / 2, rtol=1e-6)


@pytest.mark.filterwarnings("ignore:.*PDB holds no times")
def test_ovito_sees_the_names_of_a_lammps_data_file_and_no_samarium_in_pdb(tmp_path, read):
    source = write(tmp_path / "a.extxyz", frames_of(3, count=1))
    carom.io.convert(source, tmp_path / "a.data")
    assert names_in(read(tmp_path / "a.data")) == {"small", "big"}
    carom.io.convert(source, tmp_path / "a.pdb")
    assert names_in(read(tmp_path / "a.pdb")) == {"X"}


@pytest.mark.parametrize("name", ["a.lammpstrj", "a.data", "a.gsd", "a.extxyz"])
def test_ovito_sees_positions_and_radii_of_every_format_that_has_them(tmp_path, name, read):
    (frame,) = frames_of(3, periodic=True, count=1)
    source = write(tmp_path / "b.extxyz", [frame])
    carom.io.convert(source, tmp_path / name)
    data = read(tmp_path / name)
    order = np.argsort(data.particles.identifiers) if "Particle Identifier" in data.particles else ...
    corner = data.cell[:, 3]
    np.testing.assert_allclose(data.particles.positions[order] - corner, frame.positions, atol=2e-6)
    np.testing.assert_allclose(data.particles["Radius"][order], frame.diameters / 2, rtol=1e-6)


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("name", ["lammps/dump", "lammps/data", "gsd/hoomd", "xyz", "vasp"])
def test_carom_reads_what_ovito_writes(tmp_path, name, read):
    from ovito.io import export_file

    (frame,) = frames_of(3, ("Ar", "Kr"), periodic=True, count=1)
    data = read(write(tmp_path / "b.extxyz", [frame]))
    columns = ["Particle Identifier", "Particle Type", "Position.X", "Position.Y", "Position.Z", "Radius"]
    options = {
        "lammps/dump": {"columns": columns},
        "xyz": {"columns": columns},
        "lammps/data": {"atom_style": "sphere"},
    }.get(name, {})
    path = tmp_path / {"lammps/dump": "a.dump", "lammps/data": "a.data", "gsd/hoomd": "a.gsd", "xyz": "a.xyz",
                       "vasp": "POSCAR"}[name]  # fmt: skip
    export_file(data, str(path), name, **options)
    found = carom.io.read(path)
    np.testing.assert_allclose(found.box, frame.box, rtol=1e-6)
    if name != "vasp":  # which lists its atoms by kind
        np.testing.assert_allclose(found.positions, frame.positions, atol=1e-5)
    if name in ("lammps/dump", "xyz", "lammps/data"):
        np.testing.assert_allclose(found.diameters, frame.diameters, rtol=1e-5)
