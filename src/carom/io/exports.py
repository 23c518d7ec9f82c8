"""Trajectories for other programs: LAMMPS dump and data, DCD, PDB.

MDAnalysis writes DCD and PDB; positions are unwrapped where frames hold image counts. The two formats of
LAMMPS are text, written here with 9 significant digits.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from carom.bridges.embedding import about_axes, embed, names_of, one_word, require_at_most_three, symbols_of
from carom.errors import InputError
from carom.frame import Frame
from carom.io.formats import EXPORTED

Report = Callable[[int, int], object]


_STEPS = 2**20
"""Steps between two frames of DCD, at most: the first time is a number of them, below 2^31."""


def export(frames: Any, path: Path, suffix: str, report: Report | None = None) -> str:
    """Write frames to a file of a format of ``EXPORTED``; of LAMMPS's data files the last one alone.

    Return what the format does to their times, or "".
    """
    name = EXPORTED[suffix]
    require_at_most_three(frames[0].dimension, name)
    if name == "LAMMPS data":
        with path.open("w", encoding="ascii") as file:
            _data(frames[-1], file)
        if report is not None:
            report(1, 1)
    elif name == "LAMMPS dump":
        with path.open("w", encoding="ascii") as file:
            for k in range(len(frames)):
                _dump(frames[k], k, file)
                if report is not None:
                    report(k + 1, len(frames))
    else:
        return _by_mdanalysis(frames, path, name, report)
    return ""


def _bounds(frame: Frame) -> list[tuple[float, float]]:
    """Return the lower and upper ends of three axes; LAMMPS needs a thin third one in two dimensions."""
    known = [(0.0, float(edge)) for edge in frame.box]
    thin = 0.5 * float(frame.diameters.max()) or 0.5
    return known + [(-thin, thin)] * (3 - frame.dimension)


def _kinds(frame: Frame) -> np.ndarray:
    """Return the species of all components, numbered from 1 as LAMMPS does."""
    return (np.zeros(frame.n, dtype=np.int64) if frame.species is None else frame.species) + 1


def _dump(frame: Frame, k: int, file: TextIO) -> None:
    """Write one frame of a dump; its number is the time step."""
    # Axes that a frame lacks are periodic, as LAMMPS needs them in two dimensions.
    flags = [*frame.periodic, *[True] * (3 - frame.dimension)]
    images = np.zeros((frame.n, frame.dimension), np.int32) if frame.images is None else frame.images
    file.write(f"ITEM: TIME\n{frame.time:.17g}\nITEM: TIMESTEP\n{k}\nITEM: NUMBER OF ATOMS\n{frame.n}\n")
    bounds, tilts = _bounds(frame), [""] * 3
    head = " ".join("pp" if flag else "ff" for flag in flags)
    if frame.tilt is not None:  # the ends of a tilted cell, not of its edges
        shift = frame.tilt * float(frame.box[1])
        low, high = bounds[0]
        bounds[0] = low + min(shift, 0.0), high + max(shift, 0.0)
        head, tilts = f"xy xz yz {head}", [f" {shift:.9g}", " 0", " 0"]
    file.write(f"ITEM: BOX BOUNDS {head}\n")
    file.writelines(f"{low:.9g} {high:.9g}{tilt}\n" for (low, high), tilt in zip(bounds, tilts, strict=True))
    turns = [] if frame.spins is None else [about_axes(frame.spins)]
    names = " omegax omegay omegaz" if turns else ""
    file.write(f"ITEM: ATOMS id type x y z ix iy iz vx vy vz radius mass{names}\n")
    table = np.column_stack(
        [np.arange(1, frame.n + 1), _kinds(frame), embed(frame.positions), embed(images),
         embed(frame.velocities), 0.5 * frame.diameters, frame.masses, *turns]
    )  # fmt: skip
    np.savetxt(file, table, fmt="%d %d" + " %.9g" * 3 + " %d" * 3 + " %.9g" * (5 + 3 * len(turns)))


def _data(frame: Frame, file: TextIO) -> None:
    """Write the data file of one frame, of atoms of the style "sphere"."""
    kinds, names = _kinds(frame), names_of(frame)
    volumes = math.pi / 6.0 * frame.diameters**3
    # LAMMPS reads the density of a point particle as its mass.
    densities = np.divide(frame.masses, volumes, out=frame.masses.copy(), where=volumes > 0.0)
    file.write(f"Carom, time {frame.time:.17g}; types: {', '.join(map(one_word, names))}\n\n")
    file.write(f"{frame.n} atoms\n{max(len(names), int(kinds.max()))} atom types\n\n")
    for axis, (low, high) in zip("xyz", _bounds(frame), strict=True):
        file.write(f"{low:.9g} {high:.9g} {axis}lo {axis}hi\n")
    if frame.tilt is not None:
        file.write(f"{frame.tilt * float(frame.box[1]):.9g} 0 0 xy xz yz\n")
    labels = [one_word(name) for name in names]
    # LAMMPS refuses labels that begin like a number, a comment or a wildcard.
    if frame.species_names and not any(label[0] in "0123456789#*" for label in labels):
        file.write("\nAtom Type Labels\n\n")
        file.writelines(f"{k} {label}\n" for k, label in enumerate(labels, 1))
    file.write("\nAtoms # sphere\n\n")
    rows = np.column_stack(
        [np.arange(1, frame.n + 1), kinds, frame.diameters, densities, embed(frame.positions)]
    )
    np.savetxt(file, rows, fmt="%d %d" + " %.9g" * 5)
    file.write("\nVelocities\n\n")
    turns = np.zeros((frame.n, 3)) if frame.spins is None else about_axes(frame.spins)
    moving = np.column_stack([np.arange(1, frame.n + 1), embed(frame.velocities), turns])
    np.savetxt(file, moving, fmt="%d" + " %.9g" * 6)


def _short(names: tuple[str, ...]) -> list[str]:
    """Return names of at most the four letters of a PDB file; those that would become equal are numbered."""
    cut = [name[:4] for name in names]
    return [
        short if cut.count(short) == 1 else f"{short[: 4 - len(str(k))]}{k}" for k, short in enumerate(cut, 1)
    ]


def _name_atoms(world: Any, frame: Frame) -> None:
    """Name the atoms of a PDB file after their species, with elements, which programs guess otherwise."""
    kinds = _kinds(frame) - 1
    world.atoms.names = np.array(_short(names_of(frame)), dtype=object)[kinds]
    world.add_TopologyAttr("elements", np.array(symbols_of(frame), dtype=object)[kinds])


def _fits_into_columns(step: Any, k: int) -> None:
    """Raise InputError if coordinates or edges of a frame have more digits than a PDB file has columns."""
    low, high, edge = step.positions.min(), step.positions.max(), step.dimensions[:3].max()
    if low <= -999.9995 or high >= 9999.9995 or edge >= 99999.9995:
        raise InputError(
            f"Frame {k} has coordinates from {low:.6g} to {high:.6g} in a box of {edge:.6g}; PDB has columns "
            "for -999 to 9999 and an edge of 99999. Export .dcd, .lammpstrj or .extxyz."
        )


def _by_mdanalysis(frames: Any, path: Path, name: str, report: Report | None) -> str:
    import MDAnalysis

    from carom.io.mdanalysis import universe

    world = universe(frames, unwrapped=frames[0].images is not None)
    if name == "PDB":
        _name_atoms(world, frames[0])
    with warnings.catch_warnings():
        # MDAnalysis warns that elements, charges, occupancies and the like of a PDB file are unknown.
        warnings.simplefilter("ignore", UserWarning)
        settings: dict[str, Any] = {}
        start, every = Fraction(0), 1.0  # PDB has frames without times
        if name == "DCD":
            every = world.trajectory.dt or 1.0
            first = Fraction(frames[0].time / every)
            start = first.limit_denominator(max(1, min(_STEPS, math.floor(2**30 / (1 + abs(first))))))
            settings = {"dt": every, "istart": start.numerator, "nsavc": start.denominator}
            str(path).encode()  # a writer that cannot open a name that is no text fails once more at its end
        writer = MDAnalysis.Writer(
            str(path), n_atoms=world.atoms.n_atoms, format=name, multiframe=True, **settings
        )
        other = False  # times than those that come back, but for single precision
        with writer:
            for k, step in enumerate(world.trajectory):
                slack = 2.0**-20 * every + 2.0**-22 * abs(step.time)
                other = other or not abs(step.time - (k + float(start)) * every) <= slack
                if name == "PDB":
                    _fits_into_columns(step, k)
                writer.write(world.atoms)
                if report is not None:
                    report(k + 1, len(frames))
    if not other:
        return ""
    holds = "no times" if name == "PDB" else "one interval of time, and these frames have several"
    back = ", ".join(f"{float(k + start) * every:g}" for k in (0, 1))
    return (
        f"{name} holds {holds}: they come back as {back} and so on; .lammpstrj, .extxyz, .gsd and .h5md hold "
        "each time"
    )
