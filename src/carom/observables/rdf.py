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
from carom.arithmetic import power
from carom.errors import InputError
from carom.figures import curves
from carom.figures.palette import INK, WARM
from carom.figures.style import TOP, shade, state
from carom.frame import Frame
from carom.observables.analysis.contact_extrapolation import contact_value
from carom.observables.analysis.pair_counts import counts_of
from carom.observables.of_frames import OfFrames, count_pairs, species_pair
from carom.observables.statistics import MIN_BLOCKS, Estimate, blocking, shown
from carom.results import Binned, Result, from_dict
from carom.scene.fields import is_equal
from carom.scene.species import pair_name
from carom.suggestions import corrected
from carom.texts import counted, label as label_of, visible
from carom.theory import ball_volume

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

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

    def _heading(self) -> str:
        title = state(self.n, self.dimension, self.packing_fraction)
        return f"{title}, {counted(self.frames, 'frame')}"

    def _draw_into(self, axes: Axes, contact_value: Estimate | None = None) -> None:
        """Draw g(r), with the region near contact enlarged, and the contact value by the pressure."""
        unit = self.diameter or 1.0
        r, g, error, edges = self.r / unit, self.g, self.error, self.edges / unit
        curves.level(axes, 1.0, zorder=1)
        curves.curve(axes, r, g, error)
        if edges[0] > 0.0:
            # g is zero below contact, and jumps at contact.
            axes.plot([0.0, edges[0], edges[0]], [0.0, 0.0, g[0]], color=INK, linewidth=1.4, zorder=3)
        axes.set_xlim(max(edges[0] - 0.15 * (edges[-1] - edges[0]), 0.0), edges[-1])
        # Of a bin that is all but empty the error says more of the bin than of g.
        reach = np.where(error < g, g + error, g)
        top = 1.12 * float(np.max(reach))
        if self.contact_value is not None:
            # The inset lies above the right half, from 0.4 of the height on.
            far = reach[edges[1:] > 0.5 * sum(axes.get_xlim())]
            top = max(top, float(np.max(far)) / 0.38)
        axes.set_ylim(0.0, top)
        axes.set_xlabel("distance r/σ" if self.diameter else "distance r")
        axes.set_ylabel("radial distribution function g(r)")
        if self.contact_value is not None and (near := self.r < 1.25 * unit).sum() >= 3:
            marked = [("extrapolated", self.contact_value), ("from the pressure", contact_value)]
            _draw_contact(axes, r[near], g[near], error[near], marked)

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


def _draw_contact(
    axes: Axes, r: np.ndarray, g: np.ndarray, error: np.ndarray, marked: list[tuple[str, Estimate | None]]
) -> None:
    """Draw the first quarter of a diameter enlarged, with the contact values at its left border."""
    inset = axes.inset_axes((0.52, 0.48, 0.46, 0.44))
    inset.errorbar(r, g, error, fmt=".", color=INK, markersize=4, linewidth=0.8)
    looks = (("D", INK, 3.5), ("o", WARM, 8.0))
    for (name, value), (marker, color, size) in zip(marked, looks, strict=True):
        if value is None or not (name == "extrapolated" or math.isfinite(value.mean)):
            continue
        half = value.error if math.isfinite(value.error) else 0.0
        inset.errorbar(
            [1.0], [value.mean], [half], fmt=marker, color=color, markersize=size,
            markerfacecolor="none", capsize=2, label=f"{name} {curves.stated(value.value_text)}",
        )  # fmt: skip
    inset.set_xlim(0.98, 1.25)
    inset.set_title("contact value g(σ⁺)", fontsize=8.5, y=TOP)
    inset.tick_params(labelsize=7.5)
    inset.legend(fontsize=7.5, frameon=False, loc="best", handletextpad=0.2)


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

    Compiled code counts the pairs over sorted cells (``analysis.pair_counts``), in double precision,
    in as many threads as the process may use cores; their number does not change the result. Pairs
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

    def _heading(self) -> str:
        return next(iter(self.values()))._heading()

    def _draw_into(self, axes: Axes) -> None:
        if not self:
            raise InputError("There is no g(r), so there is nothing to draw.")
        unit = max(found.diameter for found in self.values())
        curves.level(axes, 1.0, zorder=1)
        for k, (name, found) in enumerate(self.items()):
            r, g, error, color = found.r / unit, found.g, found.error, shade(k)
            axes.fill_between(r, g - error, g + error, color=color, alpha=0.25, linewidth=0, zorder=2)
            # g is zero below contact, and jumps at contact.
            contact = found.edges[0] / unit
            label = label_of(name)
            axes.plot(
                [contact, contact, *r], [0.0, g[0], *g], color=color, linewidth=1.3, label=label, zorder=3
            )
        axes.set_ylim(bottom=0.0)
        axes.set(xlabel="distance r/σₘₐₓ", ylabel="partial distribution function gᵢⱼ(r)")

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
