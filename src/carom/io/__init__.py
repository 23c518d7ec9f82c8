"""Files and bridges: trajectories (H5MD, extended XYZ, GSD), checkpoints, event logs, ASE and MDAnalysis.

Nothing here is imported before it is used: h5py, ASE, MDAnalysis and gsd load with the first call that needs
them. Reading a file never runs code from it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.bridges.ase import to_ase
from carom.frame import Frame
from carom.io.ase import from_ase
from carom.io.conversion import convert, rebuild
from carom.io.formats import Reader, Writer
from carom.io.trajectory import open, read

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    import MDAnalysis

__all__ = ["Reader", "Writer", "convert", "from_ase", "open", "read", "rebuild", "to_ase", "universe"]


def universe(
    source: str | os.PathLike[str] | Reader | Sequence[Frame] | Frame, *, unwrapped: bool = False
) -> MDAnalysis.Universe:
    """Return an MDAnalysis Universe of a file or of Frames.

    Parameters
    ----------
    source : path, Reader, Frame or sequence of Frames
        A trajectory that :func:`carom.open` reads (it stays open as long as the Universe), or frames in
        memory.
    unwrapped : bool
        Whether positions are ``positions + images * box``, as mean squared displacements need them, instead
        of in the box.

    Returns
    -------
    MDAnalysis.Universe
        With radii, masses, velocities, box and time (``trajectory.dt`` is the spacing of the frames); of
        fewer than three dimensions padded with zeros. The species are the names and types of its atoms, so
        that ``select_atoms("name small")`` selects one.
    """
    from carom.io import mdanalysis

    return mdanalysis.universe(source, unwrapped=unwrapped)


def __dir__() -> list[str]:
    return sorted(__all__)
