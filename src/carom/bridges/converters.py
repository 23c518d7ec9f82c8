"""Frames for freud, OVITO, pandas and xarray, in memory. None of them is needed by Carom itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.bridges.embedding import about_axes, cell_of, embed, names_of, periodic, require_at_most_three
from carom.checks import needed
from carom.errors import InputError
from carom.figures.palette import colors_of

if TYPE_CHECKING:
    import freud
    import ovito
    import pandas
    import xarray

    from carom.configuration import Configuration

AXES = "xyz"


def to_freud(frame: Configuration) -> tuple[freud.box.Box, np.ndarray]:
    """Return freud's box, periodic where the frame is, and centered float32 positions (n, 3)."""
    if frame.dimension not in (2, 3):
        raise InputError(f"freud knows two and three dimensions, and this frame has {frame.dimension}.")
    box = needed("freud", "A frame for freud", "'carom[freud]'").box
    lengths = dict(zip(("Lx", "Ly", "Lz"), frame.box.tolist(), strict=False))
    if frame.tilt:
        lengths["xy"] = frame.tilt
    result = box.Box(**lengths, is2D=frame.dimension == 2)
    result.periodic = list(frame.periodic) + [False] * (3 - frame.dimension)
    middle = 0.5 * cell_of(frame)[: frame.dimension, : frame.dimension].sum(axis=0)
    return result, embed((frame.positions - middle).astype(np.float32))


def to_ovito(frame: Configuration) -> ovito.data.DataCollection:
    """Return OVITO's data collection of a frame."""
    require_at_most_three(frame.dimension, "OVITO")
    data = needed("ovito.data", "A frame for OVITO", "ovito")
    result = data.DataCollection()
    cell = data.SimulationCell(pbc=periodic(frame.periodic), is2D=frame.dimension < 3)
    cell[:, :3] = cell_of(frame).T
    result.objects.append(cell)
    particles = data.Particles()
    particles.create_property("Position", data=embed(frame.positions))
    names = names_of(frame)
    kinds = np.zeros(frame.n, dtype=int) if frame.species is None else frame.species
    types = particles.create_property("Particle Type", data=kinds.astype(np.int32) + 1)
    for k, (name, color) in enumerate(zip(names, colors_of(len(names)), strict=True)):
        types.types.append(data.ParticleType(id=k + 1, name=name, color=color))
    particles.create_property("Radius", data=0.5 * frame.diameters)
    particles.create_property("Mass", data=frame.masses)
    particles.create_property("Velocity", data=embed(frame.velocities))
    particles.create_property("Particle Identifier", data=np.arange(1, frame.n + 1))
    if frame.images is not None:
        particles.create_property("Periodic Image", data=embed(frame.images))
    if frame.spins is not None:
        particles.create_property("Angular Velocity", data=about_axes(frame.spins))
    result.objects.append(particles)
    result.attributes["time"], result.attributes["step"] = float(frame.time), int(frame.step)
    return result


def to_pandas(frame: Configuration) -> pandas.DataFrame:
    """Return a row for each component."""
    pandas = needed("pandas", "A DataFrame", "pandas")
    axes = AXES[: frame.dimension] if frame.dimension <= 3 else [f"x{k}" for k in range(frame.dimension)]
    columns: dict[str, Any] = dict(zip(axes, frame.positions.T, strict=True))
    columns |= {f"v{axis}": speeds for axis, speeds in zip(axes, frame.velocities.T, strict=True)}
    if frame.spins is not None:
        turns = ["w"] if frame.dimension == 2 else [f"w{axis}" for axis in axes]
        columns |= dict(zip(turns, frame.spins.T, strict=True))
    columns |= {"diameter": frame.diameters, "mass": frame.masses}
    if frame.species is not None:
        columns["species"] = np.array(names_of(frame))[frame.species]
    return pandas.DataFrame(columns)


def to_xarray(frames: Sequence[Configuration]) -> xarray.Dataset:
    """Return positions and velocities (time, component, axis) of frames, and the other fields."""
    xarray = needed("xarray", "A Dataset", "xarray")
    first = frames[0]
    each, vector = ("time", "particle"), ("time", "particle", "axis")
    found = {
        "positions": (vector, np.stack([frame.positions for frame in frames])),
        "velocities": (vector, np.stack([frame.velocities for frame in frames])),
        "diameters": (each, np.stack([frame.diameters for frame in frames])),
        "box": (("time", "axis"), np.stack([frame.box for frame in frames])),
        "step": (("time",), np.array([frame.step for frame in frames])),
        "masses": (("particle",), first.masses),
    }
    if all(frame.images is not None for frame in frames):
        found["unwrapped"] = (vector, np.stack([frame.unwrapped for frame in frames]))
    spins = [frame.spins for frame in frames if frame.spins is not None]
    if len(spins) == len(frames):
        found["spins"] = (("time", "particle", "turn"), np.stack(spins))
    axes = list(AXES[: first.dimension]) if first.dimension <= 3 else list(range(first.dimension))
    coordinates: dict[str, Any] = {"time": [frame.time for frame in frames], "axis": axes}
    if first.species is not None:
        coordinates["species"] = ("particle", np.array(names_of(first))[first.species])
    return xarray.Dataset(found, coords=coordinates)
