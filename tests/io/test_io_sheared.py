"""Sheared frames in files and other programs: tilts of either sign, in boxes whose edges differ."""

import dataclasses
import itertools
import warnings

import gsd.hoomd as hoomd
import numpy as np
import pytest
from helpers.frames import make_frames, write

import carom
from carom.bridges.embedding import embed
from carom.errors import CaromWarning

EDGES = (7.0, 5.0, 9.0)
DIGITS = 0.5e-8 * 30.0
"""Half of the ninth digit of the largest number in a text: nothing here is beyond 30."""


def sheared(d, tilt):
    """Return frames within a tilted cell, parts of its edges (frames, n, d), and the cell (3, 3)."""
    frames, parts = make_frames(d, count=2), []
    box = np.array(EDGES[:d])
    cell = np.diag([*box, *[box.max()] * (3 - d)])
    cell[1, 0] = tilt * box[1]
    for k, frame in enumerate(frames):
        parts.append(frame.positions / frame.box)
        positions = parts[k] * box
        positions[:, 0] += tilt * positions[:, 1]
        frames[k] = dataclasses.replace(
            frame, positions=positions, box=box, tilt=tilt, time=0.5 * k,
            species=np.arange(frame.n) % 2, species_names=("small", "big"),
        )  # fmt: skip
    return frames, np.array(parts), cell


both = pytest.mark.parametrize(("d", "tilt"), [(2, 0.3), (2, -0.3), (3, 0.3), (3, -0.3)])


@both
@pytest.mark.parametrize("name", ["a.extxyz", "a.h5md", "a.gsd", "a.lammpstrj", "a.data"])
def test_a_sheared_frame_comes_back_from_every_format(tmp_path, d, tilt, name):
    frames, parts, cell = sheared(d, tilt)
    if name.endswith(("trj", "data")):
        last = frames[-1:] if name == "a.data" else frames
        carom.io.convert(write(tmp_path / "b.h5md", last), tmp_path / name)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CaromWarning)  # a data file does not say what is periodic
            found = carom.io.read(tmp_path / name, ":")
        frames, parts = last, parts[-len(last) :]
    else:
        found = carom.io.read(write(tmp_path / name, frames), ":")
    near = {"a.extxyz": 0.0, "a.h5md": 0.0, "a.gsd": 8.0 * float(np.finfo(np.float32).eps) * 10.0}
    off = near.get(name, DIGITS)
    assert len(found) == len(frames)
    for frame, one, part in zip(frames, found, parts, strict=True):
        assert one.tilt == pytest.approx(tilt, rel=0.0 if name in near else 1e-8)
        np.testing.assert_allclose(one.box, frame.box, rtol=0, atol=off)
        # One is at the upper face of each axis, and may come to the lower one by rounding.
        inside = part.max(axis=1) < (1.0 - 1e-12 if off else 1.0)
        assert inside.sum() >= len(part) - 1
        np.testing.assert_allclose(one.positions[inside], frame.positions[inside], rtol=0, atol=off)
        np.testing.assert_allclose(one.velocities, frame.velocities, rtol=1e-6, atol=0)
        assert name not in near or one.species_names == ("small", "big")
        if name != "a.data":  # which has no image counts
            unwrapped = frame.positions + frame.images @ cell[:d, :d]
            np.testing.assert_allclose(one.unwrapped, unwrapped, rtol=0, atol=off + 1e-13)


@both
def test_hoomd_lammps_and_ase_have_the_edges_and_the_tilt(tmp_path, d, tilt):
    frames, parts, cell = sheared(d, tilt)
    path = write(tmp_path / "a.gsd", frames)
    with hoomd.open(str(path), "r") as file:
        for stored, part in zip(file, parts, strict=True):
            *edges, xy, xz, yz = stored.configuration.box
            assert stored.configuration.dimensions == d
            # HOOMD's second edge is (xy L_y, L_y, 0), and the middle of the cell is at the origin.
            own = np.diag(np.array(edges, float))
            own[1, 0] = xy * edges[1]
            assert (xz, yz) == (0.0, 0.0)
            np.testing.assert_allclose(own, cell, rtol=1e-6)
            known = stored.particles.position @ np.linalg.inv(own)
            np.testing.assert_allclose(known[:, :d], part - 0.5, atol=4.0 * float(np.finfo(np.float32).eps))
    carom.io.convert(write(tmp_path / "a.h5md", frames), tmp_path / "a.lammpstrj")
    lines = (tmp_path / "a.lammpstrj").read_text().splitlines()
    at = lines.index("ITEM: BOX BOUNDS xy xz yz pp pp pp")
    bounds = np.array([[float(word) for word in line.split()] for line in lines[at + 1 : at + 1 + d]])
    corners = np.array(list(itertools.product((0, 1), repeat=d))) @ cell[:d, :d]
    np.testing.assert_allclose(bounds[:, 0], corners.min(axis=0), atol=DIGITS)
    np.testing.assert_allclose(bounds[:, 1], corners.max(axis=0), atol=DIGITS)
    assert bounds[:, 2].tolist() == pytest.approx([cell[1, 0], 0.0, 0.0][:d])
    carom.io.convert(write(tmp_path / "b.h5md", frames[:1]), tmp_path / "a.data")
    (line,) = (line for line in (tmp_path / "a.data").read_text().splitlines() if "xy xz yz" in line)
    assert [float(word) for word in line.split()[:3]] == pytest.approx([cell[1, 0], 0.0, 0.0])
    atoms = frames[0].to_ase()
    np.testing.assert_array_equal(atoms.cell[:], cell)
    np.testing.assert_allclose(atoms.get_scaled_positions(wrap=False)[:, :d], parts[0], atol=1e-14)
    del atoms.info["tilt"]  # of other programs the cell alone tells it
    assert carom.io.from_ase(atoms).tilt == pytest.approx(tilt, rel=1e-14)
    assert carom.io.from_ase(frames[0].to_ase()).tilt == tilt


@both
def test_mdanalysis_and_freud_have_the_edges_and_the_tilt(tmp_path, d, tilt):
    frames, parts, cell = sheared(d, tilt)
    for source in (frames, write(tmp_path / "a.h5md", frames), write(tmp_path / "a.extxyz", frames)):
        universe = carom.io.universe(source, unwrapped=True)
        for frame, ts in zip(frames, universe.trajectory, strict=True):
            np.testing.assert_allclose(ts.triclinic_dimensions, cell, atol=1e-5)
            np.testing.assert_allclose(ts.velocities, embed(frame.velocities), atol=1e-6)
    text = (tmp_path / "a.extxyz").read_text()
    (tmp_path / "b.extxyz").write_text(text.replace(f"tilt={tilt!r} ", ""))  # the cell alone tells it
    assert carom.io.read(tmp_path / "b.extxyz").tilt == pytest.approx(tilt, rel=1e-14)
    box, places = frames[0].to_freud()
    assert (box.Lx, box.Ly, box.xy) == pytest.approx((*EDGES[:2], tilt))
    np.testing.assert_allclose(box.make_fractional(places)[:, :d], parts[0], atol=1e-5)


@pytest.mark.parametrize("xy", [0.3, -0.3])
def test_a_sheared_gsd_file_of_hoomd_has_its_cell(tmp_path, xy):
    parts = np.random.default_rng(1).random((5, 3))
    cell = np.diag(EDGES)
    cell[1, 0] = xy * EDGES[1]
    with hoomd.open(str(tmp_path / "a.gsd"), "w") as file:
        frame = hoomd.Frame()
        frame.configuration.box = [*EDGES, xy, 0.0, 0.0]
        frame.particles.N = 5
        frame.particles.position = (parts - 0.5) @ cell
        frame.particles.diameter = np.full(5, 0.1)
        frame.particles.velocity = parts
        file.append(frame)
    with pytest.warns(CaromWarning, match="assumed a mass of 1"):
        (found,) = carom.io.read(tmp_path / "a.gsd", ":")
    assert found.tilt == pytest.approx(xy, rel=1e-6)
    np.testing.assert_allclose(found.positions, parts @ cell, atol=1e-5)
