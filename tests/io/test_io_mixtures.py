"""Trajectories of mixtures, of walls, and of diameters that grow: every format, other readers."""

import dataclasses
import warnings
from itertools import product

import ase.io
import h5py
import MDAnalysis
import numpy as np
import pytest
from helpers.frames import frames_of, write

import carom
import carom.io
from carom import Species
from carom.errors import CaromWarning, InputError
from carom.frame import Frame
from carom.scene.scene import Scene

NAMES = {"plain": ("small", "big"), "elements": ("He", "Ar"), "odd": ('a "b", c', "é%"), "none": ()}


def assert_equal(a: Frame, b: Frame, float32: bool = False) -> None:
    for field in dataclasses.fields(Frame):
        x, y = getattr(a, field.name), getattr(b, field.name)
        if float32 and field.name in ("positions", "velocities", "diameters", "masses", "box"):
            np.testing.assert_allclose(x, y, rtol=3e-7, atol=1e-6)
        else:
            np.testing.assert_array_equal(x, y)


def written(path, frames):
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*GSD knows no walls", CaromWarning)
        return write(path, frames)


@pytest.mark.parametrize(
    ("suffix", "dimension"), [*product([".h5md", ".extxyz", ".gsd"], [1, 2, 3]), (".h5md", 4)]
)
@pytest.mark.parametrize("names", NAMES.values(), ids=NAMES)
def test_species_names_and_walls_come_back(suffix, dimension, names, tmp_path):
    frames = frames_of(dimension, names)
    read = carom.io.read(written(tmp_path / f"a{suffix}", frames), ":")
    assert len(read) == len(frames)
    for a, b in zip(read, frames, strict=True):
        assert_equal(a, b, float32=suffix == ".gsd")


@pytest.mark.parametrize("suffix", [".h5md", ".extxyz", ".gsd"])
def test_growing_diameters_come_back(suffix, tmp_path):
    frames = [
        dataclasses.replace(frame, diameters=frame.diameters * scale)
        for frame, scale in zip(frames_of(3, count=5), (1, 1, 1.1, 1.2, 1.2), strict=True)
    ]
    path = written(tmp_path / f"a{suffix}", frames)
    for a, b in zip(carom.io.read(path, ":"), frames, strict=True):
        assert_equal(a, b, float32=suffix == ".gsd")
    # Cut off and continued: with the growing ones behind, or all of them gone.
    for keep in (3, 1):
        with carom.io.open(path, "a", keep=keep) as writer:
            for frame in frames[keep:]:
                writer.write(frame)
        for a, b in zip(carom.io.read(path, ":"), frames, strict=True):
            assert_equal(a, b, float32=suffix == ".gsd")


def test_h5md_says_what_h5md_asks_for(tmp_path):
    frames = frames_of(2)
    frames[1] = dataclasses.replace(frames[1], diameters=2 * frames[1].diameters)
    with h5py.File(written(tmp_path / "a.h5md", frames)) as file:
        group = file["particles/trajectory"]
        assert list(group["box"].attrs["boundary"]) == [b"periodic", b"none", b"none"]
        np.testing.assert_array_equal(group["species"][:], frames[0].species)
        assert group["diameter/value"].shape == (3, 7)
        assert group["diameter/step"] == group["position/step"]
        assert file["parameters/carom"].attrs["layout"] == 2
    universe = MDAnalysis.Universe(str(tmp_path / "a.h5md"), to_guess=())
    assert universe.trajectory.n_frames == 3


def test_h5md_keeps_what_is_fixed(tmp_path):
    frame = frames_of(3)[0]
    for change in (
        {"species": 1 - frame.species},
        {"species": None, "species_names": ()},
        {"species_names": ("a", "b")},
        {"periodic": (True,) * 3},
        {"masses": 2 * frame.masses},
    ):
        with carom.io.open(tmp_path / "a.h5md", "w") as writer:
            writer.write(frame)
            with pytest.raises(InputError, match=r"differ from those .*\.extxyz"):
                writer.write(dataclasses.replace(frame, **change))


@pytest.mark.parametrize(
    ("names", "symbols"), [(NAMES["elements"], ("He", "Ar")), (NAMES["plain"], ("X", "X"))]
)
def test_ase_reads_species_and_walls(names, symbols, tmp_path):
    frames = frames_of(3, names)
    path = written(tmp_path / "a.extxyz", frames)
    for atoms, frame in zip(ase.io.read(path, ":"), frames, strict=True):
        assert atoms.get_chemical_symbols() == [symbols[k] for k in frame.species]
        assert atoms.pbc.tolist() == [True, True, False]
        np.testing.assert_array_equal(atoms.arrays["kind"], frame.species)
        np.testing.assert_array_equal(atoms.positions, frame.positions)
        assert_equal(carom.io.from_ase(atoms), frame)


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("names", NAMES.values(), ids=NAMES)
def test_a_frame_becomes_atoms_and_comes_back(dimension, names):
    frame = frames_of(dimension, names)[0]
    for each in (frame, dataclasses.replace(frame, images=None)):
        assert_equal(carom.io.from_ase(each.to_ase()), each)
    assert frame.to_ase().pbc.tolist() == [*frame.periodic, *[False] * (3 - dimension)]


@pytest.mark.parametrize("kind", ["frames", ".extxyz", ".h5md"])
def test_mdanalysis_selects_a_species_by_name(kind, tmp_path):
    frames = frames_of(3)
    source = frames if kind == "frames" else written(tmp_path / f"a{kind}", frames)
    universe = carom.io.universe(source)
    assert universe.select_atoms("name big").indices.tolist() == np.flatnonzero(frames[0].species).tolist()
    if kind == ".extxyz":
        alone = MDAnalysis.Universe(str(source), to_guess=())
        assert alone.select_atoms("name small").n_atoms == 4


def test_a_run_between_walls_is_written_and_started_again_from(unscheduled, tmp_path):
    species = [Species("a", count=4), Species("b", count=8, diameter=0.5)]
    scene = Scene.random(species=species, box=(6.0, 5.0), walls="y", seed=0)
    frame = carom.Simulation(scene).frame()
    for suffix in (".h5md", ".extxyz"):
        again = Scene.from_frame(carom.io.read(written(tmp_path / f"a{suffix}", [frame])))
        np.testing.assert_array_equal(again.positions, scene.positions)
        assert again.periodic == scene.periodic
        assert again.species_names == scene.species_names
        np.testing.assert_array_equal(again.species, scene.species)
