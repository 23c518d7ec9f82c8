"""Frames as ``ase.Atoms`` and back.

Everything is in the scene's own (reduced) units: what ASE calls angstrom, atomic mass units or kelvin means
nothing here.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError
from carom.frame import Frame
from carom.io.embedding import (
    edges,
    embed,
    joined,
    momenta,
    parted,
    periodic,
    require_at_most_three,
    symbols_of,
)
from carom.io.palette import colours_of
from carom.io.validation import flaw

if TYPE_CHECKING:
    import ase


def to_ase(frame: Frame) -> ase.Atoms:
    """Return a frame as an ``ase.Atoms``, with the symbol X or species' names that are chemical symbols.

    Parameters
    ----------
    frame : Frame
        A frame in at most three dimensions. Missing coordinates become 0, and their axes are not periodic.

    Returns
    -------
    ase.Atoms
        It has masses, momenta, and the arrays ``radius`` (n,), ``velo`` (n, 3) and ``id`` (n,); ``images``
        (n, 3) if the frame has image counts. A mixture also has ``kind`` (n,), the numbers of the species
        (also the tags), and ``color`` (n, 3), for ``plot_atoms(atoms, colors=atoms.arrays["color"])``.
        ``info`` holds ``time``, ``step``, ``dimension`` and ``species_names``.

    Raises
    ------
    InputError
        If the frame has more than three dimensions.

    Notes
    -----
    ASE stores momenta. ``get_velocities()`` equals the velocities exactly if the masses are powers of two
    (such as 1), and to one unit in the last place otherwise. ``arrays["velo"]`` is always exact.
    """
    require_at_most_three(frame.dimension, "ASE")
    import ase

    symbols = np.array(symbols_of(frame))
    atoms = ase.Atoms(
        symbols=symbols[np.zeros(frame.n, dtype=int) if frame.species is None else frame.species].tolist(),
        positions=embed(frame.positions),
        cell=edges(frame.box),
        pbc=periodic(frame.periodic),
        info={"time": float(frame.time), "step": int(frame.step), "dimension": frame.dimension},
    )
    atoms.set_masses(frame.masses)
    atoms.set_momenta(embed(momenta(frame.velocities, frame.masses)))
    atoms.set_array("radius", frame.diameters / 2.0)
    atoms.set_array("velo", embed(frame.velocities))
    atoms.set_array("id", np.arange(1, frame.n + 1))
    if frame.images is not None:
        atoms.set_array("images", embed(frame.images))
    if frame.species is not None:
        atoms.set_array("kind", frame.species)
        atoms.set_tags(frame.species)
        atoms.set_array("color", np.array(colours_of(len(symbols)))[frame.species])
        if frame.species_names:
            atoms.info["species_names"] = joined(frame.species_names)
    return atoms


def from_ase(atoms: ase.Atoms, *, diameter: float | None = None) -> Frame:
    """Return an ``ase.Atoms`` as a frame.

    Parameters
    ----------
    atoms : ase.Atoms
        Atoms in a rectangular cell. If ``info`` has no ``dimension``, axes that are not periodic must be the
        last ones, and all coordinates along them 0: they are dropped. Positions outside the cell are wrapped
        into it along periodic axes.
    diameter : float, optional
        Diameter [length] of every particle. By default twice ``atoms.arrays["radius"]``.

    Raises
    ------
    InputError
        If there are no atoms, no diameters, a cell that is not rectangular, coordinates along axes that are
        not periodic, or values that no frame can hold, such as masses of 0.
    """
    dimension = _dimension(atoms)
    cell = np.asarray(atoms.cell[:], dtype=np.float64)
    if np.any(cell != np.diag(np.diag(cell))) or not np.all(np.diag(cell)[:dimension] > 0.0):
        raise InputError(
            f"The cell of these atoms is {cell.tolist()}; expected a rectangular one with edges > 0."
        )
    box = np.diag(cell)[:dimension]
    positions, images = _wrap(
        np.array(atoms.positions[:, :dimension], dtype=np.float64),
        np.where(atoms.pbc[:dimension], box, np.inf),
        atoms.arrays.get("images"),
    )
    kinds = atoms.arrays.get("kind")
    if diameter is not None:
        diameters = np.full(len(atoms), float(diameter))
    elif "radius" in atoms.arrays:
        diameters = 2.0 * np.asarray(atoms.arrays["radius"], dtype=np.float64)
    else:
        raise InputError("These atoms have no array 'radius', so their size is unknown; give diameter=.")
    frame = Frame(
        time=float(atoms.info.get("time", 0.0)),
        step=int(atoms.info.get("step", 0)),
        positions=positions,
        velocities=np.ascontiguousarray(_velocities(atoms)[:, :dimension]),
        box=tuple(float(edge) for edge in box),
        diameters=diameters,
        masses=np.array(atoms.get_masses(), dtype=np.float64),
        images=images,
        species=None if kinds is None else np.asarray(kinds),
        species_names=() if kinds is None else parted(str(atoms.info.get("species_names", ""))),
        periodic=tuple(bool(flag) for flag in atoms.pbc[:dimension]),
    )
    wrong = flaw(frame)
    if wrong is not None:
        raise InputError(f"These atoms make no frame: their {wrong}.")
    if frame.images is not None:
        frame = dataclasses.replace(frame, images=frame.images.astype(np.int32))
    if frame.species is not None:
        frame = dataclasses.replace(frame, species=frame.species.astype(np.int64))
    return frame


def _dimension(atoms: ase.Atoms) -> int:
    """Return how many axes there are: the leading periodic ones, all else being zero."""
    if len(atoms) == 0:
        raise InputError("There are no atoms here; expected at least one.")
    flags = [bool(flag) for flag in atoms.pbc]
    said = atoms.info.get("dimension")
    if said in (1, 2, 3) and not any(flags[said:]) and not np.any(atoms.positions[:, said:]):
        return int(said)
    dimension = sum(flags)
    if dimension == 0 or flags != list(periodic((True,) * dimension)):
        raise InputError(
            f"The periodic axes of these atoms are {flags}; expected the first one, two or three."
        )
    if np.any(atoms.positions[:, dimension:]):
        raise InputError(
            f"Only the first {dimension} axes are periodic, yet some atoms are off zero along the others; "
            "make those axes periodic, or set their coordinates to zero."
        )
    return dimension


def _wrap(
    positions: np.ndarray, box: np.ndarray, images: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return (n, d) positions in ``0 <= x < edge``, those inside untouched, and their images.

    The edge of an axis that is not periodic is infinite, and nothing is moved along it.
    """
    counts = np.floor(positions / box) * np.isfinite(box)
    outside = ((positions < 0.0) | (positions >= box)) & np.isfinite(box)
    wrapped = np.where(outside, positions - counts * np.where(np.isfinite(box), box, 0.0), positions)
    # A small negative coordinate plus an edge can round to the edge itself, and a quotient just below 1 to 1.
    wrapped = np.where(outside & ((wrapped < 0.0) | (wrapped >= box)), 0.0, wrapped)
    if images is None:
        return wrapped, None
    moved = np.where(outside, counts, 0.0).astype(np.int64)
    return wrapped, np.asarray(images[:, : len(box)]) + moved


def _velocities(atoms: ase.Atoms) -> np.ndarray:
    """Return the (n, 3) velocities: the exact ones, unless the momenta were changed since."""
    velocities = np.asarray(atoms.get_velocities(), dtype=np.float64)
    exact = atoms.arrays.get("velo")
    if exact is not None and np.array_equal(momenta(exact, atoms.get_masses()), atoms.get_momenta()):
        return np.asarray(exact, dtype=np.float64)
    return velocities
