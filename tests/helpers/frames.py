"""Frames of random doubles, of mixtures and of crystals; how they are written and compared."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np

import carom
import carom.io
from carom.frame import Frame
from carom.scene import lattices

SUFFIXES = (".h5md", ".extxyz", ".gsd")


def make_frames(dimension, count=4, n=13, *, images=True, masses=None, seed=0):
    """Frames of random doubles: full significands, and coordinates on both faces of the box."""
    rng = np.random.default_rng(seed)
    box = tuple(float(edge) for edge in 7.0 + rng.random(dimension))
    masses = np.ones(n) if masses is None else masses
    diameters = rng.uniform(0.5, 1.5, n)
    frames = []
    for k in range(count):
        positions = rng.random((n, dimension)) * box
        positions[0], positions[1] = 0.0, np.nextafter(box, 0.0)
        frames.append(
            Frame(
                time=0.1 * k,
                step=37 * k,
                positions=positions,
                velocities=rng.normal(size=(n, dimension)),
                box=box,
                diameters=diameters,
                masses=masses,
                images=rng.integers(-5, 5, (n, dimension)).astype(np.int32) if images else None,
            )
        )
    return frames


def assert_same(a, b):
    """Every bit of two frames, and their types."""
    assert (a.time, a.step, *a.box) == (b.time, b.step, *b.box)
    assert type(b.time) is float
    assert type(b.step) is int
    for name in ("positions", "velocities", "diameters", "masses", "images"):
        x, y = getattr(a, name), getattr(b, name)
        if x is None:
            assert y is None
        else:
            assert (x.dtype, x.shape, x.tobytes()) == (y.dtype, y.shape, y.tobytes()), name


def write(path, frames, mode="w", **options):
    with carom.io.open(path, mode, **options) as writer:
        for frame in frames:
            writer.write(frame)
    return path


def float32_spacing(frame):
    """Half the distance of neighboring float32 at the far face: how far rounding moves a coordinate."""
    return 0.5 * float(np.spacing(np.float32(max(frame.box))))


def endless(frames):
    """These frames again and again, at later and later times."""
    for k in itertools.count():
        yield dataclasses.replace(frames[k % len(frames)], time=0.1 * k, step=37 * k)


def frames_of(
    dimension: int, names: tuple[str, ...] = ("small", "big"), periodic: bool = False, count: int = 3
) -> list[Frame]:
    """Return frames of a mixture between walls along the last axis, with doubles that need all digits."""
    rng = np.random.default_rng(dimension)
    species = rng.permutation([0, 0, 1, 0, 1, 1, 0])
    box = tuple((5 + rng.random(dimension)).tolist())
    return [
        Frame(
            time=0.1 * k,
            step=3 * k,
            positions=rng.random((7, dimension)) * box,
            velocities=rng.normal(size=(7, dimension)),
            box=box,
            diameters=np.array([1 / 3, 0.1])[species],
            masses=np.array([8.0, 1 / 7])[species],
            images=rng.integers(-3, 3, (7, dimension)).astype(np.int32),
            species=species,
            species_names=names,
            periodic=(True,) * (dimension - 1) + (periodic,),
        )
        for k in range(count)
    ]


TOUCHING = 2.0**-40  # of a crystal that is expanded by this


def frame_of(positions, box, diameters=1.0, periodic=True, species=None) -> Frame:
    positions = np.asarray(positions, float)
    n, d = positions.shape
    sizes = np.broadcast_to(np.asarray(diameters, float), n).copy()
    return Frame(
        0.0, 0, positions, np.zeros((n, d)), tuple(box), sizes, np.ones(n), periodic=(periodic,) * d,
        species=species,
    )  # fmt: skip


def at_rest(scene, time=0.0, **more) -> Frame:
    """Return the frame of a scene whose particles rest."""
    still = np.zeros_like(scene.positions)
    return Frame(
        time, 0, scene.positions, still, scene.box, scene.diameters, scene.masses,
        **{"species": scene.species, **more},
    )  # fmt: skip


def crystal(dimension: int, cells, apart: float = TOUCHING) -> Frame:
    """The densest lattice, its neighbors `apart` of a diameter from contact."""
    lattice = lattices.densest(dimension)
    counts = lattices.cells_along(lattice, cells)
    edge = (1.0 + apart) / lattice.nearest
    return frame_of(lattice.points(counts, edge), lattice.box(counts, edge))


def without(frame: Frame, *gone: int) -> Frame:
    return frame_of(np.delete(frame.positions, gone, axis=0), frame.box)
