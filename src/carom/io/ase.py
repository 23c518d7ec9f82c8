"""Frames from ``ase.Atoms``; ``carom.bridges.ase`` converts the other way.

All values are in the scene's own (reduced) units, not in ASE's angstroms, atomic mass units or kelvins.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from carom import checks
from carom.bridges.embedding import embed, parted, periodic, spins_of
from carom.errors import InputError
from carom.frame import Frame
from carom.io.validation import flaw

if TYPE_CHECKING:
    import ase


def from_ase(atoms: ase.Atoms, *, diameter: float | None = None) -> Frame:
    """Return an ``ase.Atoms`` as a frame, in the order of ``atoms.arrays["id"]`` if there is one.

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
        If there are no atoms, no diameters or one that is not positive, or a cell that is not rectangular.
        If there are coordinates along axes that are not periodic, two atoms of one id, or values that no
        frame can hold, such as masses of 0.
    """
    atoms = _in_order(atoms)
    dimension = _dimension(atoms)
    cell = np.asarray(atoms.cell[:], dtype=np.float64)
    tilt = _tilt(atoms, cell)
    if not np.all(np.diag(cell)[:dimension] > 0.0):
        raise InputError(f"The cell of these atoms is {cell.tolist()}; expected edges > 0.")
    box = np.diag(cell)[:dimension]
    places = np.array(atoms.positions[:, :dimension], dtype=np.float64)
    if tilt:
        places[:, 0] -= tilt * places[:, 1]
    positions, images = wrapped(
        places,
        np.where(atoms.pbc[:dimension], box, np.inf),
        atoms.arrays.get("images"),
    )
    if tilt:
        # Within the cell nothing has moved: what is there keeps its bits.
        inside = (positions == places).all(axis=1)
        positions[:, 0] += tilt * positions[:, 1]
        positions[inside] = atoms.positions[inside, :dimension]
    kinds = atoms.arrays.get("kind")
    if diameter is not None:
        diameters = np.full(len(atoms), checks.positive(diameter, "diameter"))
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
        spins=spins_of(atoms.arrays.get("angular_velocity"), dimension),
        tilt=tilt,
    )
    wrong = flaw(frame)
    if wrong is not None:
        raise InputError(f"These atoms make no frame: their {wrong}.")
    if frame.images is not None:
        frame = dataclasses.replace(frame, images=frame.images.astype(np.int32))
    if frame.species is not None:
        frame = dataclasses.replace(frame, species=frame.species.astype(np.int64))
    return frame


def _tilt(atoms: ase.Atoms, cell: np.ndarray) -> float | None:
    """Return the tilt of a sheared box, or None of one with right angles."""
    others = cell - np.diag(np.diag(cell))
    shift = float(others[1, 0])
    others[1, 0] = 0.0
    if others.any():
        raise InputError(
            f"The cell of these atoms is {cell.tolist()}; expected a rectangular one, or one that is sheared "
            "along its first axis."
        )
    told = atoms.info.get("tilt")
    return float(told) if told is not None else (shift / float(cell[1, 1]) if shift else None)


def _in_order(atoms: ase.Atoms) -> ase.Atoms:
    """Return the atoms in the order of their ids: programs may list them in any."""
    ids = atoms.arrays.get("id")
    if ids is None:
        return atoms
    if ids.ndim != 1 or ids.dtype.kind not in "iu" or len(np.unique(ids)) != len(ids):
        raise InputError(
            "The array 'id' of these atoms holds what is no integer, or one twice; "
            "del atoms.arrays['id'] where it names nobody."
        )
    return atoms if (np.diff(ids) > 0).all() else atoms[np.argsort(ids)]


def _dimension(atoms: ase.Atoms) -> int:
    """Return ``info["dimension"]`` if the atoms fit it, otherwise the number of leading periodic axes."""
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


def wrapped(
    positions: np.ndarray, box: np.ndarray, images: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return (n, d) positions in ``0 <= x < edge`` (infinite: not periodic), and their image counts."""
    counts = np.floor(positions / box) * np.isfinite(box)
    outside = ((positions < 0.0) | (positions >= box)) & np.isfinite(box)
    result = np.where(outside, positions - counts * np.where(np.isfinite(box), box, 0.0), positions)
    # By rounding, a small negative coordinate plus an edge can be the edge: the face of the next image. And a
    # quotient just below an integer can become that integer.
    counts = counts + (outside & (result >= box))
    result = np.where(outside & ((result < 0.0) | (result >= box)), 0.0, result)
    if images is None:
        return result, None
    moved = np.where(outside, counts, 0.0).astype(np.int64)
    return result, np.asarray(images[:, : len(box)]) + moved


def _velocities(atoms: ase.Atoms) -> np.ndarray:
    """Return the (n, 3) velocities: those in ``velo``, unless there are momenta that were changed since."""
    exact = atoms.arrays.get("velo")
    if exact is not None:
        if exact.dtype.kind not in "if" or exact.ndim > 2 or exact.size > 3 * len(atoms):
            raise InputError("The array 'velo' of these atoms holds no vectors of up to three numbers.")
        exact = embed(np.asarray(exact, dtype=np.float64).reshape(len(atoms), -1))
        if not atoms.has("momenta") or np.array_equal(
            exact * atoms.get_masses()[:, None], atoms.get_momenta()
        ):
            return exact
    return np.asarray(atoms.get_velocities(), dtype=np.float64)
