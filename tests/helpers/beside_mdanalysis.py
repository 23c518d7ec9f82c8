"""Counts of pairs by MDAnalysis, which g(r) is compared with."""

import numpy as np


def counts(universe, bins, low, high, selection="all", other=None):
    """Return edges and the number of pairs in each bin, of all frames together."""
    from MDAnalysis.analysis.rdf import InterRDF

    atoms = universe.select_atoms(selection)
    around = atoms if other is None else universe.select_atoms(other)
    # Blocks of one exclude each particle with itself; in one selection each pair counts twice.
    block, twice = ((1, 1), 2.0) if other is None else (None, 1.0)
    found = InterRDF(atoms, around, nbins=bins, range=(low, high), norm="none", exclusion_block=block).run()
    return found.results.edges, np.rint(found.results.count / twice).astype(np.int64)
