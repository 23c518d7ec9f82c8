"""g(r) by MDAnalysis, for comparison."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING

import numpy as np

from carom.arithmetic import power
from carom.errors import FileError, InputError
from carom.observables.radial import RDFResult
from carom.observables.rdf import checked_rmax, independent_errors
from carom.theory import ball_volume

if TYPE_CHECKING:
    import MDAnalysis


def rdf_mdanalysis(
    universe: MDAnalysis.Universe | str | os.PathLike[str],
    *,
    bins: int = 200,
    rmin: float = 0.0,
    rmax: float | None = None,
    dimension: int | None = None,
    selection: str = "all",
    other: str | None = None,
    diameter: float = 1.0,
) -> RDFResult:
    """g(r) by MDAnalysis's ``InterRDF``, in three dimensions or two.

    Parameters
    ----------
    universe : MDAnalysis.Universe or path
        A path that MDAnalysis opens by itself, e.g. an ``.h5md`` file that Carom wrote.
    bins : int
        Number of bins.
    rmin, rmax : float
        Range [length]; by default from 0 to half of the shortest edge.
    dimension : int, optional
        2 or 3; by default 2 if all particles of the first frame lie in the plane z = 0, else 3.
    selection : str
        The particles, in MDAnalysis's selection language.
    other : str, optional
        The particles around them, for a partial g(r). No particle may be in both selections.
    diameter : float
        Diameter of all particles [length], for the packing fraction and the distance at contact.

    Returns
    -------
    RDFResult
        It has the errors of independent pairs, and no contact value: MDAnalysis has single precision.

    Raises
    ------
    InputError
        If `rmax` exceeds half of the shortest edge (InterRDF is silently wrong there), fewer than two
        particles are selected, or one is in both selections.
    FileError
        If the file cannot be opened.

    Notes
    -----
    In 3D ``exclusion_block=(1, 1)`` leaves out each particle with itself, so that g tends to 1. InterRDF
    always divides by the volumes of spherical shells. In 2D its raw counts are therefore normalised here, by
    ``N (N - 1) pi (r2^2 - r1^2) / area`` for each frame.
    """
    import MDAnalysis
    from MDAnalysis.analysis.rdf import InterRDF

    if not isinstance(universe, MDAnalysis.Universe):
        path = os.fspath(universe)
        if path.endswith((".h5md", ".h5")):
            # MDAnalysis would follow any links and external storage in the file.
            from carom.io.hdf5 import inspect

            inspect(path)
        try:
            universe = MDAnalysis.Universe(path)
        except (OSError, ValueError, TypeError) as error:
            raise FileError(f"MDAnalysis cannot open {path}: {error}") from error
    atoms = universe.select_atoms(selection)
    n = atoms.n_atoms
    if n < 2 and other is None:
        raise InputError(f"{selection!r} selects {n} particles; g(r) needs two or more.")
    around = atoms if other is None else universe.select_atoms(other)
    if other is not None and (not n or not around.n_atoms or (atoms & around).n_atoms):
        raise InputError(
            f"{selection!r} selects {n} particles and {other!r} {around.n_atoms}, "
            f"{(atoms & around).n_atoms} of them in both; expected one or more in each, and none in both."
        )
    universe.trajectory[0]
    if dimension is None:
        dimension = 2 if not atoms.positions[:, 2].any() else 3
    if dimension not in (2, 3):
        raise InputError(f"dimension is {dimension}; MDAnalysis knows 2 (in the plane z = 0) and 3.")
    box = np.asarray(universe.dimensions[:dimension], dtype=np.float64)
    rmax = checked_rmax(rmax, float(box.min()), rmin)
    # Blocks of one exclude each particle with itself.
    analysis = InterRDF(
        atoms,
        around,
        nbins=bins,
        range=(rmin, rmax),
        norm="none",
        exclusion_block=(1, 1) if other is None else None,
    ).run()
    edges = np.asarray(analysis.results.edges, dtype=np.float64)
    frames = int(analysis.n_frames)
    # In one selection each pair counts twice, i with j and j with i. With norm="none" frames are summed.
    twice = 2.0 if other is None else 1.0
    pairs = 0.5 * n * (n - 1) if other is None else float(n * around.n_atoms)
    counts = np.rint(np.asarray(analysis.results.count) / twice).astype(np.int64)
    volumes = [math.prod(float(edge) for edge in step.dimensions[:dimension]) for step in universe.trajectory]
    shells = ball_volume(dimension) * np.diff(power(2.0 * edges, dimension))
    expected = pairs * shells * float(np.mean(1.0 / np.array(volumes)))
    return RDFResult(
        edges=edges,
        g=counts / (frames * expected),
        error=independent_errors(counts, frames * expected),
        counts=counts,
        n=universe.atoms.n_atoms if other is not None else n,
        dimension=dimension,
        frames=frames,
        diameter=diameter,
        packing_fraction=(n if other is None else universe.atoms.n_atoms)
        * ball_volume(dimension, diameter)
        * float(np.mean(1.0 / np.array(volumes))),
    )
