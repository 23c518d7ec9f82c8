"""g(r): an observable of frames, of a run, of a file or of a folder; of a mixture that of every pair.

Histograms of pair distances have bins that begin at contact, to which g is extrapolated.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from carom import checks
from carom.arithmetic import exponential, power, pseudo_inverse
from carom.errors import InputError
from carom.frame import Frame
from carom.meant import corrected
from carom.observables.of_frames import OfFrames, count_pairs, species_pair
from carom.observables.pair_counts import counts_of
from carom.observables.statistics import MIN_BLOCKS, Estimate, blocking, shown, unwarned
from carom.results import Binned, Result, from_dict
from carom.scene.fields import is_equal
from carom.scene.species import pair_name
from carom.texts import counted, visible
from carom.theory import ball_volume

if TYPE_CHECKING:
    import pandas

    from carom.scene.scene import Scene

__all__ = ["RDF", "PartialRDF", "PartialRDFResult", "RDFResult", "contact_value"]

MOST_SPECIES = 4
"""Largest number of species whose pairs each have a g(r): ten pairs."""


# Default width of a bin [diameters]: up to freezing in 3D, g falls by at most a tenth in one bin.
DEFAULT_WIDTH = 0.02

# Default largest distance [diameters]: in a fluid structure fades beyond it, while the cost grows as r^d.
DEFAULT_REACH = 5.0

# Largest number of bins: each frame keeps a count for every bin.
MOST_BINS = 10_000_000

# The fit is a parabola in ln g from contact to where g has fallen to half, but at most over a quarter of a
# diameter. In this range g falls on a single scale at every density. For the reference histograms of the
# tests (densities 0.5 and 0.8) the parabola is within 1e-3 of the contact value that the pressure implies,
# and a cubic only has more noise. In a crystal g has fallen to a fifth within that range, and the parabola is
# 1 % too low at packing fraction 0.6 and 7 % at 0.7; there it is a cubic down to that fifth.
REACH = 0.25
FALL = 0.5
DEGREE = 2
CRYSTAL_FALL = 0.2
CRYSTAL_DEGREE = 3

# Blocks of frames for the jackknife: they give the error to 10 %, and are few enough to be cheap.
JACKKNIFE = 64

# Gauss quadrature with three points on (-1, 1).
NODES = (-math.sqrt(0.6), 0.0, math.sqrt(0.6))
WEIGHTS = (5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0)


def species_of(scene: Scene) -> np.ndarray | None:
    """Return the species (n,) for g_ij(r): those of the ``scene``, or each diameter, the largest first.

    None if there are more than four, as in a polydisperse fluid: no pair of sizes occurs often enough. Also
    if a contact matrix goes with species of several diameters.
    """
    given = scene.species
    if given is not None and all(np.ptp(scene.diameters[given == k]) == 0.0 for k in np.unique(given)):
        return given if np.unique(given).size <= MOST_SPECIES else None
    sizes, which = np.unique(-scene.diameters, return_inverse=True)
    return which.astype(np.int64) if sizes.size <= MOST_SPECIES and scene.contact is None else None


@dataclass(frozen=True, eq=False, repr=False)
class RDFResult(Binned):
    """A histogram of pair distances, normalized to 1 for an ideal gas of the same n particles.

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
        g(sigma+), extrapolated (see :func:`carom.observables.rdf.contact_value`); None if no bin begins
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


_Wanted = Mapping[str, tuple[tuple[int | str, int | str] | None, float | None]]
"""The two species of each g(r) and the distance at which they touch [length], by its name."""


class _Histograms(OfFrames):
    """Base of what counts the distances of several g(r) in one pass: ``_wanted``, in bins by ``_binning``."""

    _what = "g(r)"
    _uniform = True
    _same = ("n", "dimension", "diameters", "species")

    _wanted: _Wanted
    _binning: tuple[int | None, float | None, float | None] = (None, None, None)
    """The parameters bins, width and rmax of :class:`carom.RDF`."""

    def _begin(self, first: Frame) -> None:
        self._asked: dict[str, tuple[tuple[int, int] | None, np.ndarray]] = {}
        for name, (pair, contact) in self._wanted.items():
            chosen = None if pair is None else species_pair(first, pair)
            if contact is not None and chosen is None:
                raise InputError("contact is the distance of two species, and no pair is given.")
            diameter = _common_diameter(first) if chosen is None else _contact(first, chosen, contact)
            self._asked[name] = (chosen, _bin_edges(diameter, min(first.box), *self._binning))

    def _of(self, frame: Frame) -> tuple[dict[str, np.ndarray], float]:
        """Return the pairs in each bin of each g(r), and the volume [length^d]."""
        self._fit(0.5 * min(frame.box))
        return counts_of(frame, self._asked), math.prod(frame.box)

    def _fit(self, half: float) -> None:
        """Leave out the bins beyond half of the shortest edge of a frame [length]."""
        for name, (pair, edges) in self._asked.items():
            kept = int(np.searchsorted(edges, half, side="right"))
            if kept == len(edges):
                continue
            if kept < 2 or self._binning != (None, self._binning[1], None):
                _checked_rmax(float(edges[-1]), 2.0 * half, float(edges[0]))
            self._asked[name] = pair, edges[:kept]

    def _found(self) -> Any:
        """Return the fields of each :class:`carom.observables.RDFResult`, by name."""
        counted, volumes = zip(*self._samples, strict=True)
        found = {}
        for name, (pair, edges) in self._asked.items():
            counts = np.array([each[name][: len(edges) - 1] for each in counted])
            found[name] = _distribution(self._first, counts, edges, pair, np.array(volumes))
        return found


@corrected()
@dataclass
class RDF(_Histograms):
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

    Compiled code counts the pairs over sorted cells (``carom.observables.pair_counts``), in double precision,
    in as many threads as Numba uses (``NUMBA_NUM_THREADS``); their number does not change the result. Pairs
    in contact, and those that overlap by no more than the rounding of positions stored in single precision
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


class PartialRDF(_Histograms):
    """g_ij(r) of every pair of species of a ``scene``, in the default bins of :class:`carom.RDF`.

    ``pairs`` has the names of those that occur, and whose contact lies within half of the box.
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


def _wanted(scene: Scene, species: np.ndarray, named: tuple[str, ...]) -> _Wanted:
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


def _distribution(
    first: Frame, counts: np.ndarray, edges: np.ndarray, pair: tuple[int, int] | None, volumes: np.ndarray
) -> dict[str, Any]:
    """Return the fields of g(r) from histograms (frames, m) of frames like the first, with their volumes."""
    expected = _ideal_counts(edges, count_pairs(first, pair), first.box)
    neighbors, neighbors_error = _running(first, counts, pair)
    larger = volumes / volumes[0]
    weighted = counts * larger[:, None] if (larger != 1.0).any() else counts
    return {
        "edges": edges,
        "g": weighted.mean(axis=0) / expected,
        "error": _errors(weighted, larger, expected),
        "counts": counts.sum(axis=0),
        "n": first.n,
        "dimension": first.dimension,
        "frames": len(counts),
        "diameter": float(edges[0]),
        "packing_fraction": _packing_fraction(first) * float(np.mean(1.0 / larger)),
        "contact_value": contact_value(weighted, expected, edges, first.dimension),
        "pair": pair,
        "neighbors": neighbors,
        "neighbors_error": neighbors_error,
    }


def _running(first: Frame, counts: np.ndarray, pair: tuple[int, int] | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of neighbors up to the end of each bin, and the errors of these sums, (m,) each."""
    centers = first.n if pair is None else int(np.count_nonzero(first.species == pair[0]))
    per_pair = 1.0 if pair is not None and pair[0] != pair[1] else 2.0
    numbers = np.cumsum(counts, axis=1) * (per_pair / centers)
    if len(counts) < MIN_BLOCKS:
        independent = np.sqrt(np.cumsum(counts.sum(axis=0))) * (per_pair / centers / len(counts))
        return numbers.mean(axis=0), independent
    return numbers.mean(axis=0), np.array([blocking(column).error for column in numbers.T])


def _common_diameter(frame: Frame) -> float:
    """Return the diameter of all particles."""
    diameters = np.unique(frame.diameters)
    if frame.n < 2:
        raise InputError(f"The frame holds {frame.n} particle; g(r) needs two or more.")
    if diameters.size != 1:
        raise InputError(
            f"Diameters differ, from {diameters[0]:.6g} to {diameters[-1]:.6g}; this g(r) needs equal ones, "
            "or two species: pair=(0, 1), as an option --pair 0,1."
        )
    return float(diameters[0])


def _contact(frame: Frame, pair: tuple[int, int], contact: float | None) -> float:
    """Return the distance at which two species touch."""
    assert frame.species is not None
    sizes = []
    for k in pair:
        diameters = np.unique(frame.diameters[frame.species == k])
        if diameters.size != 1:
            raise InputError(
                f"Diameters of species {k} differ, from {diameters[0]:.6g} to {diameters[-1]:.6g}; g(r) "
                "needs one diameter a species."
            )
        sizes.append(float(diameters[0]))
    if contact is None:
        return 0.5 * sum(sizes)
    if not checks.number(contact, "contact") > 0.0:
        raise InputError(f"contact is {contact!r}; it must be a positive length.")
    return float(contact)


def _packing_fraction(frame: Frame) -> float:
    volume = ball_volume(frame.dimension) * math.fsum(power(frame.diameters, frame.dimension))
    return float(volume / math.prod(frame.box))


def _checked_rmax(rmax: float | None, shortest: float, rmin: float) -> float:
    """Return the end of the bins: ``rmax``, or by default half of the ``shortest`` edge [length]."""
    half = 0.5 * shortest
    end = half if rmax is None else checks.number(rmax, "rmax")
    if not end <= half:
        raise InputError(
            f"rmax is {end:.6g}, beyond half of the shortest box edge ({half:.6g}), where shells leave the "
            f"box; use rmax <= {half:.6g} or a larger box."
        )
    if not end > rmin:
        name = "Half of the shortest box edge" if rmax is None else "rmax"
        raise InputError(f"{name} is {end:.6g}; it must exceed {rmin:.6g}, where the bins begin.")
    return end


def _bin_edges(
    diameter: float, shortest: float, bins: int | None, width: float | None, rmax: float | None
) -> np.ndarray:
    """Return the edges of the bins from the diameter on."""
    if bins is not None and width is not None and rmax is not None:
        raise InputError("bins, width and rmax were all given; give two of them.")
    if bins is not None and (isinstance(bins, bool) or not isinstance(bins, (int, np.integer)) or bins < 1):
        raise InputError(f"bins is {bins!r}; it must be a positive integer.")
    if width is not None and not checks.number(width, "width") > 0.0:
        raise InputError(f"width is {width!r}; it must be a positive length.")
    if bins is not None and width is not None:
        rmax = diameter + bins * width
    elif rmax is None and 0.0 < DEFAULT_REACH * diameter < 0.5 * shortest:
        rmax = DEFAULT_REACH * diameter
    end = _checked_rmax(rmax, shortest, diameter)
    if bins is None:
        if width is None:
            width = DEFAULT_WIDTH * diameter if diameter > 0.0 else end / 200
        # A range that is a whole number of widths up to rounding keeps its last bin.
        asked = (end - diameter) / width * (1.0 + 1e-12)
        bins = max(int(min(asked, MOST_BINS + 1)), 1)
        end = min(diameter + bins * width, end) if asked <= MOST_BINS else end
    if bins > MOST_BINS:
        raise InputError(
            f"There would be more than {MOST_BINS} bins from {diameter:.6g} to {end:.6g}; give wider ones "
            "or fewer."
        )
    return np.linspace(diameter, end, int(bins) + 1)


def _ideal_counts(edges: np.ndarray, pairs: float, box: tuple[float, ...]) -> np.ndarray:
    """Return the expected number of pairs in each shell between ``edges``, for ``pairs`` of an ideal gas."""
    shells = ball_volume(len(box)) * np.diff(power(2.0 * edges, len(box)))
    return pairs * shells / math.prod(box)


def _independent_errors(counts: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return the errors (m,) of g for independent pairs: ``counts`` seen, ``expected`` for an ideal gas."""
    return np.sqrt(np.maximum(counts, 1)) / expected


def _errors(weighted: np.ndarray, larger: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return the standard errors (m,) of g from histograms (frames, m), weighted by volumes (frames,)."""
    frames = weighted.shape[0]
    total = np.sum(weighted * larger[:, None], axis=0)  # the variance of independent pairs
    errors = _independent_errors(total, frames * expected)
    if frames < MIN_BLOCKS:
        return errors
    for k in np.flatnonzero(total):
        errors[k] = blocking(weighted[:, k]).error / expected[k]
    return errors


def contact_value(
    counts: np.ndarray, ideal: np.ndarray, edges: np.ndarray, dimension: int
) -> Estimate | None:
    """Extrapolate g to contact.

    Parameters
    ----------
    counts : (frames, m) int array
        Pairs in each bin of each frame, in order of time.
    ideal : (m,) float array
        Expected counts of an ideal gas.
    edges : (m + 1,) float array
        Edges of the bins [length]; the first is the diameter.
    dimension : int
        d.

    Returns
    -------
    Estimate or None
        None for a diameter of zero, if no pair was seen near contact, or if bins are too wide for the first
        peak of a crystal: fewer than six of them until g has fallen to a fifth. Its ``n_eff`` and ``tau`` are
        in blocks of frames. With fewer than 8 frames the error is that of independent pairs, with fewer than
        64 at least that; where it is that error, ``n_eff`` is the number of frames.

    Notes
    -----
    ``ln g`` is a parabola in r - sigma (of lower degree with fewer than five bins), fitted by maximum
    likelihood to Poisson counts. It is averaged over each shell by three-point Gauss quadrature, so that the
    width of the bins introduces no bias. The range ends where g, smoothed over three bins, has fallen to half
    of its first value, and at 0.25 diameters at the latest. Where it falls to a fifth within these, as in
    crystals, the range ends there, and ``ln g`` is a cubic. The error is by a jackknife over up to 64 blocks
    of frames. The pseudo-values pass through :func:`carom.observables.blocking`, so that correlated frames do
    not make it too small.
    """
    total = counts.sum(axis=0)
    used, degree = _range(total / ideal, edges)
    if used == 0 or total[:used].sum() == 0:
        return None
    fit = _Fit(ideal[:used], edges[: used + 1], dimension, degree)
    frames = counts.shape[0]
    start = fit.start(total[:used], frames)
    full, variance = fit.solve(total[:used], frames, start)
    value = math.exp(full[0])
    independent = Estimate(value, value * math.sqrt(variance), float(frames), 1.0, frames)
    groups = min(frames, JACKKNIFE)
    if groups < 8:
        return independent
    # Groups have equal sizes, so that pseudo-values are alike; the error leaves out some first frames.
    size = frames // groups
    kept = counts[frames - groups * size :, :used].reshape(groups, size, used).sum(axis=1)
    without = [math.exp(fit.solve(total[:used] - part, frames - size, full)[0][0]) for part in kept]
    with unwarned():  # As for g: a wide error bar shows too few samples.
        pseudo = blocking(groups * value - (groups - 1) * np.array(without))
    if groups < JACKKNIFE and pseudo.error < independent.error:
        return independent
    return Estimate(value, pseudo.error, pseudo.n_eff, pseudo.tau, pseudo.blocks)


def _range(g: np.ndarray, edges: np.ndarray) -> tuple[int, int]:
    """Return the number of bins, from contact on, that the fit uses (0 if none will do), and its degree."""
    diameter = edges[0]
    if diameter <= 0.0:
        return 0, 0
    # A range that ends within rounding of a bin's edge includes that bin.
    reach = int(np.searchsorted(edges[1:], diameter * (1.0 + REACH) + 0.5 * (edges[1] - diameter)))
    near = g[: reach + 2]
    smooth = (near[:-2] + near[1:-1] + near[2:]) / 3.0

    def until(fall: float) -> int:
        """Return the number of bins until g has fallen to a part of its first value, or 0."""
        fallen = np.flatnonzero(smooth < fall * smooth[0]) if smooth.size else np.empty(0, dtype=int)
        return int(fallen[0]) + 1 if fallen.size else 0

    if used := until(CRYSTAL_FALL):
        return (used, CRYSTAL_DEGREE) if used >= CRYSTAL_DEGREE + 3 else (0, 0)
    return min(max(until(FALL) or reach, DEGREE + 3), g.size), DEGREE


class _Fit:
    """Poisson likelihood of ``ln g`` as a polynomial, averaged over shells."""

    def __init__(self, ideal: np.ndarray, edges: np.ndarray, dimension: int, degree: int) -> None:
        nodes, weights = np.array(NODES), np.array(WEIGHTS)
        half = 0.5 * np.diff(edges)[:, None]
        r = edges[:-1, None] + half * (1.0 + nodes)
        shell = weights * power(r, dimension - 1)
        self.ideal = ideal
        self.weights = shell / shell.sum(axis=1, keepdims=True)
        # Two bins more than coefficients, so that the polynomial smooths and does not interpolate noise.
        degree = max(min(degree, ideal.size - 3), 0)
        x = (r - edges[0]) / (edges[-1] - edges[0])
        self.powers = np.stack([power(x, k) for k in range(degree + 1)], axis=-1)

    def start(self, counts: np.ndarray, frames: int) -> np.ndarray:
        """Return the coefficients of a constant g with the same number of pairs."""
        coefficients = np.zeros(self.powers.shape[-1])
        coefficients[0] = math.log(counts.sum() / (frames * self.ideal.sum()))
        return coefficients

    def solve(self, counts: np.ndarray, frames: int, start: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the coefficients of ln g by Fisher scoring, and the variance of ln g at contact."""
        a = start
        inverse = np.eye(a.size)
        for _ in range(50):
            g = exponential(np.sum(self.powers * a, axis=-1)) * self.weights
            expected = frames * self.ideal * g.sum(axis=1)
            jacobian = (frames * self.ideal)[:, None] * np.sum(g[..., None] * self.powers, axis=1)
            both = jacobian[:, :, None] * (jacobian / expected[:, None])[:, None, :]
            information = np.sum(both, axis=0)
            inverse = pseudo_inverse(information)
            score = np.sum(jacobian * (counts / expected - 1.0)[:, None], axis=0)
            step = np.sum(inverse * score, axis=1)
            # A step from a poor start may be too long; ln g never needs to change by more than 1 at once.
            a = a + step * min(1.0, 1.0 / max(float(np.abs(step).max()), 1e-300))
            # Converged when the step is a hundredth of the statistical error.
            if np.sum(information * step[:, None] * step) < 1e-4:
                break
        return a, float(inverse[0, 0])
