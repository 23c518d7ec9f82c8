"""Frames as ``ase.Atoms``.

All values are in the scene's own (reduced) units, not in ASE's angstroms, atomic mass units or kelvins.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.bridges.embedding import (
    about_axes,
    cell_of,
    embed,
    joined,
    periodic,
    require_at_most_three,
    symbols_of,
)
from carom.figures.palette import colors_of

if TYPE_CHECKING:
    import ase

    from carom.configuration import Configuration


def to_ase(frame: Configuration) -> ase.Atoms:
    """Return a frame as an ``ase.Atoms``, with the symbol X or species' names that are chemical symbols.

    Parameters
    ----------
    frame : Configuration
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
        cell=cell_of(frame),
        pbc=periodic(frame.periodic),
        info={"time": float(frame.time), "step": int(frame.step), "dimension": frame.dimension},
    )
    atoms.set_masses(frame.masses)
    atoms.set_momenta(embed(frame.velocities * frame.masses[:, None]))
    atoms.set_array("radius", frame.diameters / 2.0)
    atoms.set_array("velo", embed(frame.velocities))
    atoms.set_array("id", np.arange(1, frame.n + 1))
    if frame.images is not None:
        atoms.set_array("images", embed(frame.images))
    if frame.tilt is not None:
        atoms.info["tilt"] = float(frame.tilt)
    if frame.spins is not None:
        atoms.set_array("angular_velocity", about_axes(frame.spins))
    if frame.species is not None:
        atoms.set_array("kind", frame.species)
        atoms.set_tags(frame.species)
        atoms.set_array("color", np.array(colors_of(len(symbols)))[frame.species])
        if frame.species_names:
            atoms.info["species_names"] = joined(frame.species_names)
    return atoms
