"""g(r): an observable of frames, of a run, of a file or of a folder; of a mixture that of every pair."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from carom.errors import InputError
from carom.frame import Frame
from carom.meant import corrected
from carom.observables.histograms import Histograms, Wanted
from carom.observables.statistics import Estimate, shown
from carom.results import Binned, Result, from_dict
from carom.scene.fields import is_equal
from carom.scene.species import pair_name
from carom.texts import counted, visible

if TYPE_CHECKING:
    import pandas

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


@dataclass(frozen=True, eq=False, repr=False)
class RDFResult(Binned):
    """A histogram of pair distances, normalised to 1 for an ideal gas of the same n particles.

    Parameters
    ----------
    edges : (m + 1,) float64 array
        Edges of the bins [length]; the first is exactly the diameter.
    g, error : (m,) float64 arrays
        g(r) averaged over each shell, and its standard error: by blocking over 16 frames or more, otherwise
        that of independent pairs. A bin without any pair has the error of one pair.
    counts : (m,) int64 array
        Pairs seen in all frames.
    n, dimension, frames : int
        Number of particles, of dimensions and of frames.
    diameter : float
        Distance at contact [length]; for two species the distance at which they touch.
    packing_fraction : float
        Packing fraction of all particles together.
    contact_value : Estimate or None
        g(sigma+), extrapolated (see :func:`carom.observables.contact.contact_value`); None if no bin begins
        at contact.
    pair : (int, int) or None
        The species of the two particles; None if all particles are counted.
    neighbors, neighbors_error : (m,) float64 arrays or None
        Running coordination numbers and their errors, which :meth:`coordination` returns.
    """

    edges: np.ndarray
    g: np.ndarray
    error: np.ndarray
    counts: np.ndarray
    n: int
    dimension: int
    frames: int
    diameter: float
    packing_fraction: float
    contact_value: Estimate | None = None
    pair: tuple[int, int] | None = None
    neighbors: np.ndarray | None = None
    neighbors_error: np.ndarray | None = None

    @property
    def r(self) -> np.ndarray:
        """Centers of the bins (m,) [length]."""
        return self.middle

    def coordination(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean number of neighbors up to the upper edge of each bin, and its error, (m,) each.

        For two species it is the number of neighbors of the second one around a particle of the first.
        Errors are by blocking over 16 frames or more, otherwise those of independent pairs.

        Raises
        ------
        InputError
            If the distribution was made by MDAnalysis, which does not count frame by frame.
        """
        if self.neighbors is None or self.neighbors_error is None:
            raise InputError("Running coordination numbers need each frame by itself: RDF().over(frames).")
        return self.neighbors, self.neighbors_error

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        peak = int(np.argmax(self.g))
        rows = [
            ("frames", str(self.frames)),
            ("bins", f"{self.g.size}, r = {self.edges[0]:.6g} to {self.edges[-1]:.6g} [length]"),
            ("highest g", f"{shown(self.g, self.error, peak)} at r = {self.r[peak]:.4g}"),
        ]
        if self.contact_value is not None:
            rows.append(("g(σ+)", self.contact_value.value_text))
        return f"g(r) of {counted(self.n, 'particle')} at packing fraction {self.packing_fraction:.6g}", rows

    def __str__(self) -> str:
        contact = "" if self.contact_value is None else f"; contact value {self.contact_value.value_text}"
        return (
            f"g(r) in {self.g.size} bins from {self.edges[0]:.6g} to {self.edges[-1]:.6g} [length], "
            f"{counted(self.frames, 'frame')}{contact}"
        )

    def _columns(self) -> dict[str, Any]:
        return self._bins("r") | {"g": self.g, "error": self.error, "counts": self.counts}

    def to_dataframe(self) -> pandas.DataFrame:
        """Return r, the edges of each bin, g, its error and the counts as a pandas DataFrame.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        found = super().to_dataframe()
        found.insert(0, "r", self.r)
        return found


@corrected()
@dataclass
class RDF(Histograms):
    """The radial distribution function and running coordination numbers: an observable of frames.

    g(r) of equal particles, or the partial g_ij(r) of two species of a mixture, in a periodic box. Give it to
    :meth:`carom.Simulation.measure`, or frames or a path to :meth:`over`.

    Parameters
    ----------
    bins : int, optional
        Number of bins from contact to `rmax`.
    width : float, optional
        Width of a bin [length]; 0.02 diameters where neither `bins` nor `width` is given.
    rmax : float, optional
        End of the last bin [length]. By default it follows from `bins` and `width`, or it is half of the
        shortest edge but at most five diameters. If `width` does not divide the range, the last bin ends
        before `rmax`.
    pair : two ints or strs, optional
        Names or numbers of the two species, which may be the same. Each must have one diameter. A number may
        be text; a species with that name comes first.
    contact : float, optional
        Distance at which the two species touch [length], if it is not the mean of their diameters. For a
        pair, "diameter" above means this distance.

    Raises
    ------
    InputError
        From :meth:`result`, if there is no frame. From :meth:`add`, if frames differ in n, dimension,
        diameters or species. If an axis has walls: the fluid is then not homogeneous, and g depends on
        more than r. Frames hold no obstacles: around them this g is not that of a fluid, either. If diameters
        are unequal and no pair is given, a species is unknown, or a pair overlaps. If bins, width and rmax
        are all given, or there are more than ten million bins. If `rmax` does not exceed the diameter, or
        exceeds half of the shortest edge, beyond which the shells leave the box. From :meth:`begin`, if the
        scene has obstacles.

    Notes
    -----
    ``g = counts / (n (n - 1) / 2 shell / V)`` with the exact volume of each shell. It is 1 for an ideal gas
    of n particles, so that ``Z - 1 = 2^(d - 1) eta g(sigma+) (n - 1) / n`` holds for every n. For two species
    the number of pairs is ``n_i n_j``, for one species ``n_i (n_i - 1) / 2``. V is the volume of each frame;
    by default the bins end at half of the shortest edge of the smallest box.

    Compiled code counts the pairs over sorted cells (``carom.observables.pairs``), in double precision, in as
    many threads as Numba uses (``NUMBA_NUM_THREADS``); their number does not change the result. Pairs in
    contact, and those that overlap by no more than the rounding of positions stored in single precision
    (1.2e-7 box edges), belong to the first bin.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.crystal(108, 0.3), seed=1)
    >>> sim.measure(RDF(rmax=2.0), time=16.0, blocks=64).frames
    65
    >>> RDF(width=0.05).over(sim.sample(every=0.5, count=10)).frames
    10
    """

    bins: int | None = None
    width: float | None = None
    rmax: float | None = None
    pair: tuple[int | str, int | str] | None = None
    contact: float | None = None

    def __post_init__(self) -> None:
        self._wanted, self._binning = {"": (self.pair, self.contact)}, (self.bins, self.width, self.rmax)

    def _found(self) -> RDFResult:
        return RDFResult(**super()._found()[""])


class PartialRDFResult(Result, dict[str, RDFResult]):
    """g_ij(r) of every pair of species by its name, a dictionary, and one table of all of them.

    The table has the columns ``r_lo, r_hi, g, error, counts`` of each pair, named "g large-small". Bins of
    a pair begin at its contact. A pair with fewer bins than another leaves its cells empty.

    Parameters
    ----------
    pairs : mapping of str to RDFResult
        The g_ij(r) by the name of the pair.
    """

    _digits = ".17g"

    def __init__(self, pairs: Mapping[str, RDFResult]):
        super().__init__(pairs)

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        highest = [(found, int(np.argmax(found.g))) for found in self.values()]
        texts = [f"{shown(found.g, found.error, k)} at r = {found.r[k]:.4g}" for found, k in highest]
        return "Highest g(r) of each pair", list(zip(self, texts, strict=True))

    def _words(self) -> dict[str, Any]:
        return {"pairs": {name: found.to_dict() for name, found in self.items()}}

    @classmethod
    def _made(cls, values: Mapping[str, Any]) -> PartialRDFResult:
        return cls({name: from_dict(found) for name, found in values["pairs"].items()})

    def _above(self) -> dict[str, Any]:
        some = next(iter(self.values()))
        above = {key: getattr(some, key) for key in ("n", "dimension", "frames", "packing_fraction")}
        for name, found in self.items():
            above[f"contact {visible(name)}"] = found.diameter
            if (value := found.contact_value) is not None:
                above[f"contact_value {visible(name)}"] = f"{value.mean} +- {value.error}"
        return above

    def _columns(self) -> dict[str, Any]:
        longest = max((found.g.size for found in self.values()), default=0)
        return {
            f"{column} {name}": [*values.tolist(), *[None] * (longest - len(values))]
            for name, found in self.items()
            for column, values in found._columns().items()
        }


class PartialRDF(Histograms):
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
        self._scene, self._species = scene, species_of(scene)
        self._by_size = self._species is not None and self._species is not scene.species
        self._wanted = {}
        if self._species is not None:
            self._labels = np.sort(self._species) if self._by_size else self._species
            self._named = scene.species_names if self._species is scene.species else ()
            self._wanted = _wanted(scene, self._species, self._named)
        self.pairs = list(self._wanted)

    def fresh(self) -> Self:
        """Return the same observable without any frame."""
        return type(self)(self._scene)

    def add(self, frame: Frame) -> None:
        """Add the next frame.

        Where each diameter is a species, it is that of the frame: swaps hand diameters on.
        """
        if not self.pairs:
            return
        if self._by_size:
            order = np.argsort(-frame.diameters, kind="stable")
            frame = dataclasses.replace(
                frame, positions=frame.positions[order], diameters=frame.diameters[order]
            )
        super().add(dataclasses.replace(frame, species=self._labels, species_names=self._named))

    def result(self) -> Any:
        """Return the g_ij(r) of all frames so far, by the name of the pair."""
        return super().result() if self.pairs else PartialRDFResult({})

    def _found(self) -> PartialRDFResult:
        return PartialRDFResult({name: RDFResult(**found) for name, found in super()._found().items()})


def rdf_of(scene: Scene) -> RDF | PartialRDF:
    """Return what measures g(r) of a scene; of a mixture that of every pair of species."""
    return RDF() if is_equal(scene) else PartialRDF(scene)


def _wanted(scene: Scene, species: np.ndarray, named: tuple[str, ...]) -> Wanted:
    """Return each pair of species and its contact, by the name of the pair."""
    kinds, counts = np.unique(species, return_counts=True)
    wanted = {}
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
