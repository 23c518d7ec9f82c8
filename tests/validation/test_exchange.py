"""Mixtures between walls, in two and three dimensions, as OVITO, ASE, MDAnalysis and freud see them."""

from __future__ import annotations

import ase.io
import MDAnalysis
import numpy as np
import pytest
from helpers.frames import frames_of, write
from helpers.mixtures import mixture
from MDAnalysis.analysis.msd import EinsteinMSD

import carom
import carom.io
from carom.errors import CaromWarning, InputError
from carom.figures.palette import FACES, rgb


@pytest.mark.parametrize("dimension", [2, 3])
def test_extxyz_names_the_species_of_a_mixture_for_ovito_and_colors_them_as_our_pictures(tmp_path, dimension):
    """OVITO 3.17 takes ``species`` for types, ``color`` for colors and ``radius`` for radii (docs/files)."""
    (frame,) = frames_of(dimension, count=1)
    lines = write(tmp_path / "a.extxyz", [frame]).read_text().splitlines()
    assert "species:S:1:" in lines[1]
    assert ":color:R:3:Z:I:1 " in lines[1]
    flags = ["T"] * (dimension - 1) + ["F"] * (4 - dimension)
    assert f'pbc="{" ".join(flags)}"' in lines[1]
    assert f"dimension={dimension} " in lines[1]
    for line, kind in zip(lines[2:], frame.species, strict=True):
        words = line.split()
        assert words[0] == ("small", "big")[kind]
        np.testing.assert_allclose([float(word) for word in words[-4:-1]], rgb(FACES[kind]), atol=5e-4)
        assert words[-1] == "0"


def test_ase_reads_names_that_are_no_chemical_symbols_as_no_element(tmp_path):
    (frame,) = frames_of(2, ("small ones", "100 %"), count=1)
    atoms = ase.io.read(write(tmp_path / "a.extxyz", [frame]))
    assert set(atoms.numbers) == {0}
    assert atoms.pbc.tolist() == [True, False, False]
    assert carom.io.from_ase(atoms).species_names == ("small ones", "100 %")
    assert frame.to_ase().get_tags().tolist() == frame.species.tolist()


def test_a_scene_from_ase_keeps_the_species_that_carom_wrote(tmp_path):
    start = mixture(
        [20, 10], diameters=[1.0, 0.5], names=["big", "small"], dimension=3, packing_fraction=0.2, seed=1
    )
    frame = carom.Frame(
        0.0, 0, start.positions, np.ones((30, 3)), start.box, start.diameters, start.masses,
        species=start.species, species_names=start.species_names,
    )  # fmt: skip
    scene = carom.Scene.from_ase(ase.io.read(write(tmp_path / "a.extxyz", [frame])))
    assert scene.species_names == ("big", "small")
    np.testing.assert_array_equal(scene.species, start.species)
    np.testing.assert_array_equal(scene.diameters, start.diameters)


def test_gsd_says_that_it_knows_no_walls_and_holds_types_and_radii(tmp_path):
    from gsd import hoomd

    frames = frames_of(2)
    with pytest.warns(CaromWarning, match="GSD knows no walls") as told:
        write(tmp_path / "a.gsd", frames)
    assert len(told) == 1
    (stored, *_) = hoomd.open(str(tmp_path / "a.gsd"))
    assert stored.particles.types == ["small", "big"]
    assert stored.configuration.dimensions == 2
    np.testing.assert_array_equal(stored.particles.typeid, frames[0].species)
    np.testing.assert_array_equal(stored.particles.diameter, frames[0].diameters.astype(np.float32))


def test_gsd_of_a_periodic_box_says_nothing(tmp_path):
    write(tmp_path / "a.gsd", frames_of(3, periodic=True))


# ------------------------------------------------------------------------------------------------ MDAnalysis


@pytest.mark.parametrize("suffix", [".h5md", ".extxyz"])
def test_universe_has_time_types_and_radii(tmp_path, suffix):
    frames = frames_of(3, periodic=True)
    universe = carom.io.universe(write(tmp_path / f"a{suffix}", frames))
    assert universe.trajectory.dt == pytest.approx(0.1, rel=1e-15)
    assert universe.trajectory.totaltime == pytest.approx(0.2, rel=1e-15)
    assert universe.atoms.types.tolist() == [("small", "big")[kind] for kind in frames[0].species]
    np.testing.assert_array_equal(2.0 * universe.atoms.radii, frames[0].diameters)
    assert universe.trajectory.ts.data["periodic"] == frames[0].periodic


def walkers(count=40, n=30):
    """Return frames of walkers that leave the box many times; the msd of step k is known from them."""
    steps = np.random.default_rng(7).normal(scale=0.4, size=(count, n, 3))
    x = np.cumsum(steps, axis=0) + 1.5
    images = np.floor(x / 3.0).astype(np.int32)
    ones = np.ones(n)
    return x, [
        carom.Frame(
            0.25 * k, k, x[k] - 3.0 * images[k], steps[k], (3.0,) * 3, 0.1 * ones, ones, images=images[k]
        )
        for k in range(count)
    ]


@pytest.mark.parametrize("source", [".h5md", ".extxyz", "module"])
def test_unwrapped_positions_give_the_mean_squared_displacement_that_wrapped_ones_do_not(tmp_path, source):
    import carom.io.mdanalysis  # teaches MDAnalysis extended XYZ

    x, frames = walkers()
    lags = len(x)
    expected = [np.mean(np.sum((x[lag:] - x[: lags - lag]) ** 2, axis=2)) for lag in range(lags)]
    path = write(tmp_path / f"a{'.extxyz' if source == 'module' else source}", frames)
    if source == "module":
        universe = MDAnalysis.Universe(str(path), unwrapped=True)
    else:
        universe = carom.io.universe(path, unwrapped=True)
    found = EinsteinMSD(universe, fft=False).run().results.timeseries
    # float32 coordinates up to 20, differences as small as 0.4: 20 * 2^-24 / 0.4 each.
    np.testing.assert_allclose(found[1:], expected[1:], rtol=1e-5)
    wrapped = EinsteinMSD(carom.io.universe(path), fft=False).run().results.timeseries
    assert wrapped[-1] < 0.5 * expected[-1]


def test_frames_without_image_counts_cannot_be_unwrapped():
    _, frames = walkers(count=1)
    bare = carom.Frame(**{**vars(frames[0]), "images": None})
    with pytest.raises(InputError, match="images=True"):
        carom.io.universe([bare], unwrapped=True)


# ----------------------------------------------------------------------------------------- Scene.from_ase


def argon():
    return ase.Atoms("ArNeAr", positions=[[1, 1, 1], [6, 1, 1], [1, 6, 6]], cell=[11, 11, 11], pbc=True)


def test_atoms_without_radii_get_diameter_1_and_a_warning_that_says_so():
    with pytest.warns(CaromWarning, match=r"diameter of 1 was assumed.*angstrom.*diameter="):
        scene = carom.Scene.from_ase(argon())
    assert scene.diameter == 1.0


def test_a_diameter_for_every_symbol_needs_no_guess():
    scene = carom.Scene.from_ase(argon(), diameter={"Ar": 3.4, "Ne": 2.75})
    assert scene.diameters.tolist() == [3.4, 2.75, 3.4]
    assert carom.Scene.from_ase(argon(), diameter=3.0).diameter == 3.0
    with pytest.raises(InputError, match="names no Ne"):
        carom.Scene.from_ase(argon(), diameter={"Ar": 3.4})
