"""ASE, OVITO's columns and MDAnalysis: other programs see what Carom wrote."""

import dataclasses
import warnings

import ase
import MDAnalysis as mda
import numpy as np
import pytest
from helpers.frames import assert_same, float32_spacing, make_frames, write
from helpers.scripts import python

import carom.io
from carom.errors import FileError, InputError


def pad(vectors):
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize(
    "masses", [None, np.full(13, 2.5), np.linspace(0.1, 10.0, 13)], ids=["one", "equal", "unequal"]
)
def test_ase_reads_extxyz_bit_for_bit(tmp_path, dimension, masses):
    import ase.io

    frames = make_frames(dimension, masses=masses)
    path = write(tmp_path / "a.extxyz", frames)
    trajectory = ase.io.read(path, index=":")
    assert len(trajectory) == len(frames)
    for frame, atoms in zip(frames, trajectory, strict=True):
        np.testing.assert_array_equal(atoms.positions, pad(frame.positions))
        off = np.abs(atoms.get_velocities() - pad(frame.velocities))  # momenta over masses: in the last place
        assert (off <= (masses is not None) * np.spacing(np.abs(pad(frame.velocities)))).all()
        np.testing.assert_array_equal(atoms.arrays["velo"], pad(frame.velocities))
        np.testing.assert_array_equal(2 * atoms.arrays["radius"], frame.diameters)
        np.testing.assert_array_equal(atoms.get_masses(), frame.masses)
        np.testing.assert_array_equal(atoms.arrays["id"], np.arange(1, frame.n + 1))
        np.testing.assert_array_equal(atoms.arrays["images"], pad(frame.images))
        assert tuple(atoms.cell.lengths()[:dimension]) == tuple(frame.box)
        assert list(atoms.pbc) == [k < dimension for k in range(3)]
        assert atoms.cell.volume > 0
        assert (atoms.info["time"], atoms.info["step"]) == (frame.time, frame.step)
        assert isinstance(atoms.info["time"], float)
        assert_same(frame, carom.io.from_ase(atoms))


def test_from_ase_follows_momenta_that_were_changed():
    atoms = make_frames(3)[0].to_ase()
    atoms.set_velocities(np.full((13, 3), 0.25))
    np.testing.assert_array_equal(carom.io.from_ase(atoms).velocities, np.full((13, 3), 0.25))


def test_from_ase_wraps_positions_and_counts_the_images():
    frame = make_frames(2)[0]
    atoms = frame.to_ase()
    shift = np.array([[3, -2, 0]])
    atoms.positions += shift * atoms.cell.lengths()
    found = carom.io.from_ase(atoms)
    assert np.all((found.positions >= 0) & (found.positions < frame.box))
    # Four roundings (shift, unshift, and the two sums compared), each at the size of at most 5 + 3 + 1 edges.
    tolerance = 4 * 0.5 * np.spacing(9 * max(frame.box))
    expected = frame.unwrapped + shift[:, :2] * frame.box
    np.testing.assert_allclose(found.unwrapped, expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize(
    "x", [-1e-20, -1e-300, np.nextafter(10.0, 0.0), np.nextafter(-10.0, -20.0), 10.0, 1e9]
)
def test_from_ase_keeps_unwrapped_positions_at_a_face(x):
    """A tiny negative coordinate plus an edge is the edge: the face of the same image."""
    atoms = ase.Atoms("Ar", positions=[[x, 1, 1]], cell=[10, 10, 10], pbc=True)
    atoms.set_array("images", np.array([[2, 0, 0]]))
    atoms.set_array("radius", np.ones(1))
    found = carom.io.from_ase(atoms)
    assert 0.0 <= found.positions[0, 0] < 10.0
    # Three roundings, at the size of the sum.
    assert abs(found.unwrapped[0, 0] - (20.0 + x)) <= 3 * 0.5 * np.spacing(20.0 + abs(x))


def test_from_ase_takes_a_diameter_where_there_is_no_radius():
    atoms = ase.Atoms("Ar2", positions=[[0, 0, 0], [2, 2, 2]], cell=[5, 5, 5], pbc=True)
    frame = carom.io.from_ase(atoms, diameter=1.5)
    np.testing.assert_array_equal(frame.diameters, [1.5, 1.5])
    assert frame.images is None
    np.testing.assert_array_equal(frame.velocities, 0.0)
    with pytest.raises(InputError, match="diameter="):
        carom.io.from_ase(atoms)
    for wrong in ("a", -1.0, [1.0, 1.0]):
        with pytest.raises(InputError, match="diameter must be"):
            carom.io.from_ase(atoms, diameter=wrong)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"pbc": False}, "periodic axes"),
        ({"pbc": [False, True, True]}, "periodic axes"),
        ({"pbc": [True, True, False]}, "off zero"),
        ({"cell": [[5, 1, 0], [0, 5, 0], [0, 0, 5]]}, "rectangular"),
        ({"cell": [5, 5, 0]}, "edges > 0"),
    ],
)
def test_from_ase_refuses_what_is_no_periodic_box(change, text):
    options = {"positions": [[1, 2, 3]], "cell": [5, 5, 5], "pbc": True} | change
    with pytest.raises(InputError, match=text):
        carom.io.from_ase(ase.Atoms("X", **options), diameter=1.0)
    with pytest.raises(InputError, match="no atoms"):
        carom.io.from_ase(ase.Atoms(), diameter=1.0)


def test_four_dimensions_fit_neither_ase_nor_mdanalysis():
    frame = make_frames(4)[0]
    with pytest.raises(InputError, match="at most 3"):
        frame.to_ase()
    with pytest.raises(InputError, match="at most 3"):
        carom.io.universe([frame])


@pytest.mark.filterwarnings("ignore:there is no reference attributes")
@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_mdanalysis_opens_h5md_alone(tmp_path, dimension):
    frames = make_frames(dimension)
    universe = mda.Universe(str(write(tmp_path / "a.h5md", frames)))
    assert universe.trajectory.n_frames == len(frames)
    for frame, ts in zip(frames, universe.trajectory, strict=True):
        np.testing.assert_allclose(ts.positions, pad(frame.positions), rtol=0, atol=float32_spacing(frame))
        np.testing.assert_array_equal(ts.velocities, pad(frame.velocities).astype(np.float32))
        np.testing.assert_array_equal(ts.dimensions[:dimension], np.float32(frame.box))
        assert ts.dimensions[2] > 0
        assert (ts.time, ts.data["step"]) == (frame.time, frame.step)


def test_a_file_open_in_carom_opens_in_mdanalysis_too(tmp_path):
    """HDF5 opens a file once in a process, with one setting of locks; Carom stays out of its way."""
    frames = make_frames(3)
    path = tmp_path / "a.h5md"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        with carom.io.open(path, "w") as writer:
            writer.write(frames[0])
            writer.write(frames[1])
            early = mda.Universe(str(path))
            assert early.trajectory.n_frames == 2
            assert_same(frames[1], carom.io.read(path))
            writer.write(frames[2])
        with carom.io.open(path) as reader:
            assert len(reader) == 3  # though the Universe to which HDF5 showed 2 is still there
            early.trajectory.close()
            assert mda.Universe(str(path)).trajectory.n_frames == 3


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("suffix", [".extxyz", ".h5md", ".gsd", None])
def test_universe_of_any_file_or_frames(tmp_path, dimension, suffix):
    masses = np.random.default_rng(3).uniform(0.1, 10.0, 13)
    frames = make_frames(dimension, masses=masses)
    source = frames if suffix is None else write(tmp_path / f"a{suffix}", frames)
    if suffix == ".gsd":
        frames = carom.io.read(source, ":")
    universe = carom.io.universe(source)
    np.testing.assert_array_equal(universe.atoms.radii, frames[0].diameters / 2)
    np.testing.assert_array_equal(universe.atoms.masses, frames[0].masses)
    assert universe.trajectory.n_frames == len(frames)
    for k in (0, 3, 1, 2):
        ts, frame = universe.trajectory[k], frames[k]
        assert (ts.frame, ts.time, ts.data["step"]) == (k, frame.time, frame.step)
        np.testing.assert_array_equal(universe.atoms.positions, pad(frame.positions).astype(np.float32))
        np.testing.assert_array_equal(universe.atoms.velocities, pad(frame.velocities).astype(np.float32))
        np.testing.assert_array_equal(ts.data["positions"], frame.positions)
        np.testing.assert_array_equal(ts.data["velocities"], frame.velocities)
        np.testing.assert_array_equal(ts.dimensions[:dimension], np.float32(frame.box))
    assert [ts.time for ts in universe.trajectory] == [frame.time for frame in frames]


def test_universe_of_one_frame_and_of_none():
    frame = make_frames(2)[0]
    assert carom.io.universe(frame).trajectory.n_frames == carom.io.universe([frame]).trajectory.n_frames == 1
    with pytest.raises(InputError, match="no frames"):
        carom.io.universe([])


def test_mdanalysis_opens_extxyz_once_the_bridge_is_imported(tmp_path):
    frames = make_frames(2)
    path = str(write(tmp_path / "a.extxyz", frames))
    import carom.io.mdanalysis  # noqa: F401

    universe = mda.Universe(path)
    assert universe.trajectory.n_frames == 4
    np.testing.assert_array_equal(universe.trajectory[2].data["positions"], frames[2].positions)
    assert universe.trajectory[2].data["periodic"] == (True, True)
    walled = str(write(tmp_path / "b.extxyz", [dataclasses.replace(frames[0], periodic=(True, False))]))
    assert mda.Universe(walled).trajectory.ts.data["periodic"] == (True, False)
    np.testing.assert_array_equal(universe.atoms.radii, frames[0].diameters / 2)
    copy = universe.copy()
    assert copy.trajectory[3].time == frames[3].time


@pytest.mark.parametrize("dimension", [2, 3])
def test_mdanalysis_knows_types_radii_and_spacing_of_h5md_once_the_bridge_is_imported(tmp_path, dimension):
    import carom.io.mdanalysis  # noqa: F401

    frames = [
        dataclasses.replace(frame, species=np.arange(13) % 2, species_names=("big", "small"))
        for frame in make_frames(dimension, masses=np.linspace(1.0, 2.0, 13))
    ]
    path = str(write(tmp_path / "a.h5md", frames))
    universe = mda.Universe(path)
    assert universe.trajectory.dt == pytest.approx(0.1)
    ts = universe.trajectory[1]
    np.testing.assert_array_equal(ts.data["positions"], frames[1].positions)
    np.testing.assert_array_equal(ts.data["velocities"], frames[1].velocities)
    assert ts.data["periodic"] == frames[1].periodic
    assert list(universe.atoms.types[:3]) == ["big", "small", "big"]
    np.testing.assert_array_equal(universe.atoms.radii, frames[0].diameters / 2)
    np.testing.assert_array_equal(universe.atoms.masses, frames[0].masses)
    ts = mda.Universe(path, unwrapped=True).copy().trajectory[2]
    np.testing.assert_array_equal(ts.data["positions"], frames[2].unwrapped)
    assert ts.time == frames[2].time


def test_h5md_of_others_opens_as_before_once_the_bridge_is_imported(tmp_path):
    import h5py

    import carom.io.mdanalysis  # noqa: F401

    path = write(tmp_path / "a.h5md", make_frames(3, images=False))
    with pytest.raises(InputError, match="no image counts"):
        mda.Universe(str(path), unwrapped=True)
    with h5py.File(path, "r+") as file:
        del file["parameters/carom"]
    universe = mda.Universe(str(path))
    assert (universe.atoms.n_atoms, universe.trajectory.n_frames) == (13, 4)
    assert not hasattr(universe.atoms, "radii")


def test_mdanalysis_opens_extxyz_of_ase_with_a_tilted_cell(tmp_path):
    import ase.build
    import ase.io

    import carom.io.mdanalysis  # noqa: F401

    atoms = ase.build.bulk("Cu")
    atoms.rattle(0.1, seed=1)
    ase.io.write(tmp_path / "cu.extxyz", [atoms, atoms])
    universe = mda.Universe(str(tmp_path / "cu.extxyz"))
    np.testing.assert_allclose(
        universe.dimensions, atoms.cell.cellpar(), rtol=1e-6
    )  # float32, and a few operations
    np.testing.assert_allclose(universe.atoms.positions, atoms.positions, atol=1e-7)  # ASE writes 8 decimals
    assert list(universe.atoms.names) == ["Cu"]
    assert not hasattr(universe.trajectory.ts, "_velocities") or not universe.trajectory.ts.has_velocities


def test_mdanalysis_hears_of_bad_extxyz(tmp_path):
    import carom.io.mdanalysis as bridge

    path = tmp_path / "a.extxyz"
    path.write_text("no numbers here\n")
    with pytest.raises((FileError, ValueError), match="does not start with a number"):
        mda.Universe(str(path))
    with pytest.raises(FileError):
        bridge.ExtxyzReader(str(path))


def test_importing_carom_and_its_files_is_light():
    heavy = ("ase", "MDAnalysis", "h5py", "gsd")
    code = f"import sys, carom, carom.io; print([name for name in {heavy} if name in sys.modules])"
    assert python("-c", code) == "[]\n"
