"""The partial g_ij(r) of a mixture, one for each pair of its species, and a table of all of them."""

from __future__ import annotations

import csv
import dataclasses
import io
import itertools
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import FileError
from carom.frame import Frame
from carom.observables.radial import RDFResult
from carom.observables.rdf import Histograms
from carom.scene.species import pair_name
from carom.texts import visible

if TYPE_CHECKING:
    from carom.scene.scene import Scene

MOST_SPECIES = 4
"""Largest number of species whose pairs each have a g(r): ten pairs."""


def species_of(scene: Scene) -> np.ndarray | None:
    """Return the species (n,) of a ``scene`` for g_ij(r).

    They are those of the scene if each has one diameter. Otherwise each diameter is a species, the largest
    first.

    Returns
    -------
    (n,) int64 array or None
        None if there are more than four, as in a polydisperse fluid: no pair of sizes occurs often enough.
        Also None if a contact matrix goes with species of several diameters.
    """
    given = scene.species
    if given is not None and all(np.ptp(scene.diameters[given == k]) == 0.0 for k in np.unique(given)):
        return given if np.unique(given).size <= MOST_SPECIES else None
    sizes, which = np.unique(-scene.diameters, return_inverse=True)
    return which.astype(np.int64) if sizes.size <= MOST_SPECIES and scene.contact is None else None


class PartialRDF:
    """g_ij(r) of every pair of species of a mixture, in the default bins of :class:`carom.RDF`.

    Parameters
    ----------
    scene : Scene
        Scene of the frames, with its species and contact distances.

    Attributes
    ----------
    pairs : list of str
        Names of the pairs by ``carom.scene.species.pair_name``: "large-small", or "0-1". Pairs that do not
        occur are left out, and pairs whose contact lies beyond half of the box. It is empty if
        :func:`species_of` is None.
    """

    def __init__(self, scene: Scene):
        self._species = species_of(scene)
        self._by_size = self._species is not None and self._species is not scene.species
        wanted: dict[str, tuple[tuple[int | str, int | str] | None, float | None]] = {}
        if self._species is not None:
            self._labels = np.sort(self._species) if self._by_size else self._species
            self._named = scene.species_names if self._species is scene.species else ()
            wanted = _wanted(scene, self._species, self._named)
        self.pairs = list(wanted)
        self._counted = Histograms(wanted)

    def add(self, frame: Frame) -> None:
        """Add the next frame.

        Where each diameter is a species, it is that of the frame: swaps hand diameters on.
        """
        if self._by_size:
            order = np.argsort(-frame.diameters, kind="stable")
            frame = dataclasses.replace(
                frame, positions=frame.positions[order], diameters=frame.diameters[order]
            )
        self._counted.add(dataclasses.replace(frame, species=self._labels, species_names=self._named))

    def result(self) -> dict[str, RDFResult]:
        """Return the g_ij(r) of all frames so far, by the name of the pair."""
        return self._counted.result() if self.pairs else {}


def _wanted(
    scene: Scene, species: np.ndarray, named: tuple[str, ...]
) -> dict[str, tuple[tuple[int | str, int | str] | None, float | None]]:
    """Return each pair of species and its contact, by the name of the pair."""
    kinds, counts = np.unique(species, return_counts=True)
    wanted: dict[str, tuple[tuple[int | str, int | str] | None, float | None]] = {}
    for a, b in itertools.combinations_with_replacement(range(kinds.size), 2):
        i, j = int(kinds[a]), int(kinds[b])
        if scene.contact is not None:
            contact = float(scene.contact[i, j])
        else:
            contact = 0.5 * sum(float(scene.diameters[species == k][0]) for k in (i, j))
        if (a == b and counts[a] < 2) or 2.0 * contact >= min(scene.box):
            continue
        name = pair_name(*(named[k] if named else k for k in (i, j)))
        wanted[name] = ((i, j), None if scene.contact is None else contact)  # of points it is 0
    return wanted


def partial_rdf(scene: Scene, frames: Callable[[], Iterable[Frame]]) -> dict[str, RDFResult]:
    """Return g_ij(r) of every pair of species by its name, as :class:`PartialRDF` measures it.

    Parameters
    ----------
    scene : Scene
        Scene of the frames, with its species and contact distances.
    frames : callable
        Returns the frames; called once, if there are pairs.
    """
    found = PartialRDF(scene)
    for frame in frames() if found.pairs else ():
        found.add(frame)
    return found.result()


def write_partial(distributions: Mapping[str, RDFResult], path: str | os.PathLike[str]) -> None:
    """Write a table with the columns ``r_lo, r_hi, g, error, counts`` of each pair, named "g large-small".

    The bins of every pair begin at its contact. A pair with fewer bins than another leaves its cells empty.
    Lines that begin with # before the table say what was measured.

    Parameters
    ----------
    distributions : mapping of str to RDFResult
        The g_ij(r) by name, as from :func:`partial_rdf`.
    path : path
        Where to write.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    some = next(iter(distributions.values()))
    text = io.StringIO()
    for key in ("n", "dimension", "frames", "packing_fraction"):
        text.write(f"# {key}: {getattr(some, key)}\n")
    for name, found in distributions.items():
        text.write(f"# contact {visible(name)}: {found.diameter}\n")
        if (value := found.contact_value) is not None:
            text.write(f"# contact_value {visible(name)}: {value.mean} +- {value.error}\n")
    table = csv.writer(text, lineterminator="\n")
    names = ("r_lo", "r_hi", "g", "error", "counts")
    table.writerow(f"{column} {name}" for name in distributions for column in names)
    columns = [_columns(found) for found in distributions.values()]
    for rows in itertools.zip_longest(*columns, fillvalue=("",) * len(names)):
        table.writerow(itertools.chain(*rows))
    try:
        Path(path).write_text(text.getvalue(), encoding="utf-8")
    except OSError as error:
        raise FileError(f"{path} cannot be written ({error.strerror}); choose another place.") from error


def _columns(found: RDFResult) -> list[tuple[str, ...]]:
    """Return the rows of one g(r) as text, with all digits."""
    floats = (found.edges[:-1], found.edges[1:], found.g, found.error)
    return [
        (*(f"{value:.17g}" for value in row), f"{count:d}")
        for *row, count in zip(*floats, found.counts, strict=True)
    ]
