"""Mixtures between walls as OVITO itself reads them (``pip install ovito``)."""

import warnings

import numpy as np
import pytest
from helpers.frames import frames_of, write

import carom.io
from carom.bridges.palette import FACES, rgb

pytestmark = pytest.mark.slow


@pytest.fixture
def read():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        io = pytest.importorskip("ovito.io")
    return lambda path: io.import_file(str(path)).compute()


def names_in(data):
    return {kind.name for kind in data.particles.particle_types.types}


@pytest.mark.parametrize("dimension", [2, 3])
def test_ovito_sees_names_radii_colours_and_walls_in_extended_xyz_but_never_two_dimensions(
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


def test_ovito_sees_the_names_of_a_lammps_data_file_and_no_samarium_in_pdb(tmp_path, read):
    source = write(tmp_path / "a.extxyz", frames_of(3, count=1))
    carom.io.convert(source, tmp_path / "a.data")
    assert names_in(read(tmp_path / "a.data")) == {"small", "big"}
    carom.io.convert(source, tmp_path / "a.pdb")
    assert names_in(read(tmp_path / "a.pdb")) == {"X"}
