"""The radial distribution function g(r) in any dimension, in float64, with bins that begin at contact."""

from __future__ import annotations

import contextlib
import math
import os
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import CaromWarning, FileError, InputError
from carom.frame import Frame
from carom.observables.contact import contact_value
from carom.observables.statistics import MIN_BLOCKS, Estimate, blocking
from carom.theory import ball_volume

if TYPE_CHECKING:
    import MDAnalysis

# Bins of a fiftieth of a diameter where nothing is said: g falls by at most a tenth in one, up to freezing in
# 3D.
DEFAULT_WIDTH = 0.02

# Structure fades beyond five diameters in a fluid, while the cost goes on growing as r^d.
DEFAULT_REACH = 5.0

# For the pairs of a frame that one tree query holds at once: 4 million pairs are 64 MB.
_CHUNK_PAIRS = 4_000_000


@dataclass(frozen=True, eq=False)
class RadialDistribution:
    """A histogram of pair distances, normalised to 1 for an ideal gas of the same n particles.

    Parameters
    ----------
    edges : (m + 1,) float64 array
        Of the bins [length]; the first is the diameter exactly.
    g, error : (m,) float64 arrays
        g(r) averaged over each shell, and its standard error: by blocking over the frames where there are 16
        or more, otherwise that of independent pairs. A bin that never saw a pair has the error of one pair.
    counts : (m,) int64 array
        Pairs seen in all frames.
    n, dimension, frames : int
    diameter : float
        At contact [length]: of two of different species, the distance at which they touch.
    packing_fraction : float
        Of everything.
    contact_value : Estimate or None
        g(sigma+), extrapolated (see :func:`carom.observables.contact.contact_value`); None where bins are not
        aligned at contact.
    pair : (int, int) or None
        The species of the two particles; None where all particles are counted.
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
    contact_value: Estimate | None = field(default=None)
    pair: tuple[int, int] | None = None

    @property
    def r(self) -> np.ndarray:
        """Centres of the bins (m,) [length]."""
        return 0.5 * (self.edges[:-1] + self.edges[1:])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file: ``.csv`` (see :meth:`to_csv`) or ``.npz`` (numpy arrays, no pickle), by its suffix.

        Raises
        ------
        FileError
            If the suffix is another one, or the file cannot be written.
        """
        path = Path(path)
        if path.suffix == ".csv":
            self.to_csv(path)
        elif path.suffix == ".npz":
            arrays = {"edges": self.edges, "g": self.g, "error": self.error, "counts": self.counts}
            if self.pair is not None:
                arrays["pair"] = np.array(self.pair)
            numbers = {name: np.array(value) for name, value in self._header().items()}
            with _writing(path):
                np.savez(path, allow_pickle=False, **arrays, **numbers)
        else:
            raise FileError(f"{path} ends in {path.suffix!r}; g(r) is written as .csv or .npz.")

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write columns ``r_lo, r_hi, g, error, counts``, every float with all its digits.

        Lines that begin with # before them say what was measured.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        lines = [f"# {name}: {value}" for name, value in self._header().items()]
        if self.pair is not None:
            lines.append(f"# pair: {self.pair[0]} {self.pair[1]}")
        lines.append("r_lo,r_hi,g,error,counts")
        for k in range(self.g.size):
            row = (self.edges[k], self.edges[k + 1], self.g[k], self.error[k])
            lines.append(",".join(f"{value:.17g}" for value in row) + f",{self.counts[k]:d}")
        with _writing(Path(path)):
            Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")

    def _header(self) -> dict[str, float]:
        names = ("n", "dimension", "frames", "diameter", "packing_fraction")
        header = {name: getattr(self, name) for name in names}
        if self.contact_value is not None:
            header |= {"contact_value": self.contact_value.mean, "contact_error": self.contact_value.error}
        return header


def rdf(
    frames: Iterable[Frame],
    *,
    bins: int | None = None,
    width: float | None = None,
    rmax: float | None = None,
    pair: tuple[int | str, int | str] | None = None,
    contact: float | None = None,
) -> RadialDistribution:
    """g(r) of equal particles, or the partial g_ij(r) of two species of a mixture, in a periodic box.

    Parameters
    ----------
    frames : iterable of Frame
        Of the same n, dimension, diameters, species and box; read once, one at a time.
    bins : int, optional
        Number of bins from contact to `rmax`.
    width : float, optional
        Width of a bin [length]; 0.02 diameters where neither `bins` nor `width` is given.
    rmax : float, optional
        End of the last bin [length]; without it what `bins` of `width` reach, or half of the shortest edge
        but at most five diameters. Where `width` does not divide the range, the last bin ends before it.
    pair : two ints or strs, optional
        Numbers or names of the species, equal or not, each of one diameter.
    contact : float, optional
        Distance at which the two species touch [length], where it is not the mean of their diameters. With a
        pair, diameters in what is said above stand for it.

    Returns
    -------
    RadialDistribution

    Raises
    ------
    InputError
        If there is no frame, frames differ, an axis has walls (the fluid is not the same everywhere, and g
        depends on more than r), diameters are unequal and no pair is given, a species is unknown, a pair
        overlaps, all three of bins, width and rmax are given, or `rmax` exceeds half of the shortest edge
        (beyond it the shells leave the box) or does not exceed the diameter.

    Notes
    -----
    ``g = counts / (n (n - 1) / 2 shell / V)`` with the exact volume of each shell: 1 at large distances for
    an ideal gas of n particles, so that ``Z - 1 = 2^(d - 1) eta g(sigma+) (n - 1) / n`` holds for every n.
    The pairs of two species are ``n_i n_j``, of one with itself ``n_i (n_i - 1) / 2``.

    Pairs are found by scipy's cKDTree with periodic edges, in portions of some 4 million (100 MB), whatever
    n. Pairs in contact, and those that overlap by no more than the rounding of positions stored in single
    precision (1.2e-7 box edges), belong to the first bin.
    """
    source = iter(frames)
    first = next(source, None)
    if first is None:
        raise InputError("No frame was given; sample some with Simulation.sample(every=0.5, count=100).")
    if not all(first.periodic):
        raise InputError(
            f"Axis {first.periodic.index(False)} of the box has walls; g(r) is that of a fluid which is the "
            "same everywhere, in a box with periodic axes only."
        )
    chosen = None if pair is None else _species(first, pair)
    if contact is not None and chosen is None:
        raise InputError("contact is the distance of two species, and no pair is given.")
    diameter = _common_diameter(first) if chosen is None else _contact(first, chosen, contact)
    edges = _bin_edges(diameter, min(first.box), bins, width, rmax)
    histograms = [_histogram(first, edges, chosen)]
    for index, frame in enumerate(source, start=1):
        _check_same(first, frame, index)
        histograms.append(_histogram(frame, edges, chosen))
    counts = np.array(histograms)
    expected = _ideal_counts(edges, _pairs(first, chosen), first.box)
    return RadialDistribution(
        edges=edges,
        g=counts.mean(axis=0) / expected,
        error=_errors(counts, expected),
        counts=counts.sum(axis=0),
        n=first.n,
        dimension=first.dimension,
        frames=len(counts),
        diameter=diameter,
        packing_fraction=_packing_fraction(first),
        contact_value=contact_value(counts, expected, edges, first.dimension),
        pair=chosen,
    )


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
) -> RadialDistribution:
    """g(r) by MDAnalysis's ``InterRDF``, in three dimensions or two.

    Parameters
    ----------
    universe : MDAnalysis.Universe or path
        A path that MDAnalysis opens by itself, e.g. an ``.h5md`` file that Carom wrote.
    bins : int
    rmin, rmax : float
        Range [length]; from 0 to half of the shortest edge.
    dimension : int, optional
        2 or 3; without it, 2 if no particle of the first frame has left the plane z = 0.
    selection : str
        Of particles, in MDAnalysis's language.
    other : str, optional
        Of the particles around those, for a partial g(r); none may be in both.
    diameter : float
        For the packing fraction in the result, of all particles, and its distance at contact [length].

    Returns
    -------
    RadialDistribution
        With the errors of independent pairs, and no contact value: positions are single precision there.

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
    divides by the volumes of spherical shells, always: in 2D its raw counts are normalised here, by ``N (N -
    1) pi (r2^2 - r1^2) / area`` for each frame.
    """
    import MDAnalysis
    from MDAnalysis.analysis.rdf import InterRDF

    if not isinstance(universe, MDAnalysis.Universe):
        path = os.fspath(universe)
        if path.endswith((".h5md", ".h5")):
            # MDAnalysis would follow whatever links and external storage the file names.
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
    rmax = _checked_rmax(rmax, float(box.min()), rmin)
    # Pairs of the same index in blocks of one are each particle with itself.
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
    # Of one selection ordered pairs, i with j and j with i; with norm="none" a sum over the frames.
    twice = 2.0 if other is None else 1.0
    pairs = 0.5 * n * (n - 1) if other is None else float(n * around.n_atoms)
    counts = np.rint(np.asarray(analysis.results.count) / twice).astype(np.int64)
    volumes = [math.prod(float(edge) for edge in step.dimensions[:dimension]) for step in universe.trajectory]
    shells = ball_volume(dimension) * np.diff((2.0 * edges) ** dimension)
    expected = pairs * shells * float(np.mean(1.0 / np.array(volumes)))
    return RadialDistribution(
        edges=edges,
        g=counts / (frames * expected),
        error=_independent_errors(counts, frames * expected),
        counts=counts,
        n=universe.atoms.n_atoms if other is not None else n,
        dimension=dimension,
        frames=frames,
        diameter=diameter,
        packing_fraction=(n if other is None else universe.atoms.n_atoms)
        * ball_volume(dimension, diameter)
        * float(np.mean(1.0 / np.array(volumes))),
    )


def _common_diameter(frame: Frame) -> float:
    diameters = np.unique(frame.diameters)
    if frame.n < 2:
        raise InputError(f"The frame holds {frame.n} particle; g(r) needs two or more.")
    if diameters.size != 1:
        raise InputError(
            f"Diameters differ, from {diameters[0]:.6g} to {diameters[-1]:.6g}; this g(r) needs equal ones, "
            "or two species: pair=(0, 1), as an option --pair 0,1."
        )
    return float(diameters[0])


def _species(frame: Frame, pair: tuple[int | str, int | str]) -> tuple[int, int]:
    """Return the numbers of two species."""
    if frame.species is None:
        raise InputError("pair is given, and the frames have no species; leave it out.")
    if not isinstance(pair, tuple | list) or len(pair) != 2:
        raise InputError(f"pair is {pair!r}; expected two species, such as (0, 1).")
    count = int(frame.species.max()) + 1
    found = []
    for which in pair:
        k = frame.species_names.index(which) if which in frame.species_names else which
        if isinstance(k, bool) or not isinstance(k, int | np.integer) or not 0 <= k < count:
            known = ", ".join(frame.species_names) or f"0 to {count - 1}"
            raise InputError(f"There is no species {which!r}; known are {known}.")
        found.append(int(k))
    if _pairs(frame, (found[0], found[1])) == 0:
        raise InputError(f"There are too few components of species {found[0]} and {found[1]} for any pair.")
    return found[0], found[1]


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
    if not (math.isfinite(contact) and contact > 0.0):
        raise InputError(f"contact is {contact!r}; it must be a positive length.")
    return float(contact)


def _pairs(frame: Frame, pair: tuple[int, int] | None) -> float:
    """Return the number of pairs of all components, or of two species."""
    if pair is None:
        return 0.5 * frame.n * (frame.n - 1)
    a, b = (int(np.count_nonzero(frame.species == k)) for k in pair)
    return 0.5 * a * (a - 1) if pair[0] == pair[1] else float(a * b)


def _packing_fraction(frame: Frame) -> float:
    volume = ball_volume(frame.dimension) * math.fsum(frame.diameters**frame.dimension)
    return float(volume / math.prod(frame.box))


def _checked_rmax(rmax: float | None, shortest: float, rmin: float) -> float:
    half = 0.5 * shortest
    end = half if rmax is None else float(rmax)
    # The edge of a box in a file of single precision is rounded, and so may be its half.
    if not end <= half:
        raise InputError(
            f"rmax is {end:.6g}, beyond half of the shortest box edge ({half:.6g}), where shells leave the "
            f"box; use rmax <= {half:.6g} or a larger box."
        )
    if not end > rmin:
        raise InputError(f"rmax is {end:.6g}; it must exceed {rmin:.6g}, where the bins begin.")
    return end


def _bin_edges(
    diameter: float, shortest: float, bins: int | None, width: float | None, rmax: float | None
) -> np.ndarray:
    if bins is not None and width is not None and rmax is not None:
        raise InputError("bins, width and rmax were all given; give two of them.")
    if bins is not None and (isinstance(bins, bool) or not isinstance(bins, (int, np.integer)) or bins < 1):
        raise InputError(f"bins is {bins!r}; it must be a positive integer.")
    if width is not None and not (math.isfinite(width) and width > 0.0):
        raise InputError(f"width is {width!r}; it must be a positive length.")
    if bins is not None and width is not None:
        rmax = diameter + bins * width
    elif rmax is None and diameter > 0.0:
        rmax = min(0.5 * shortest, DEFAULT_REACH * diameter)
    end = _checked_rmax(rmax, shortest, diameter)
    if bins is None:
        if width is None:
            width = DEFAULT_WIDTH * diameter if diameter > 0.0 else end / 200
        # A range that is a whole number of widths, but for rounding, keeps its last bin.
        bins = max(int((end - diameter) / width * (1.0 + 1e-12)), 1)
        end = min(diameter + bins * width, end)
    return np.linspace(diameter, end, int(bins) + 1)


def _check_same(first: Frame, frame: Frame, index: int) -> None:
    for name in ("n", "dimension", "box"):
        if getattr(frame, name) != getattr(first, name):
            raise InputError(
                f"Frame {index} has {name} {getattr(frame, name)}, the first one {getattr(first, name)}; "
                "g(r) averages frames of the same system."
            )
    for name in ("diameters", "species"):
        if not np.array_equal(getattr(frame, name), getattr(first, name)):
            raise InputError(f"Frame {index} has other {name} than the first; g(r) averages one system.")


def _histogram(frame: Frame, edges: np.ndarray, pair: tuple[int, int] | None = None) -> np.ndarray:
    """Pairs (m,) of one frame, or of two of its species, in each bin."""
    from scipy.spatial import cKDTree

    box = np.asarray(frame.box, dtype=np.float64)
    x = np.mod(frame.positions, box)
    # A small negative coordinate is rounded up to the edge itself, which the tree refuses.
    x[x >= box] = 0.0
    who = [np.arange(frame.n)] * 2
    if pair is not None:
        who = [np.flatnonzero(frame.species == k) for k in pair]
    ours, theirs = who
    alike = pair is None or pair[0] == pair[1]
    tree = cKDTree(x[theirs], boxsize=box)
    # Ordered neighbours of a particle in the largest sphere, twice the mean to leave room for crystals.
    neighbours = 2.0 * frame.n * ball_volume(frame.dimension, 2.0 * edges[-1]) / math.prod(frame.box)
    step = max(int(_CHUNK_PAIRS / max(neighbours, 1.0)), 1)
    rounding = float(np.finfo(np.float32).eps) * float(box.max())
    counts = np.zeros(edges.size - 1, dtype=np.int64)
    for start in range(0, len(ours), step):
        part = cKDTree(x[ours[start : start + step]], boxsize=box)
        pairs = part.sparse_distance_matrix(tree, edges[-1], output_type="ndarray")
        if alike:
            pairs = pairs[pairs["i"] + start != pairs["j"]]
        closest = int(np.argmin(pairs["v"])) if pairs.size else 0
        if pairs.size and pairs["v"][closest] < edges[0] - rounding:
            i, j, r = ours[pairs["i"][closest] + start], theirs[pairs["j"][closest]], pairs["v"][closest]
            raise InputError(
                f"Particles {i} and {j} overlap at time {frame.time:.6g} (distance {r:.6g}, "
                f"{'diameter' if pair is None else 'contact'} {edges[0]:.6g}); g(r) needs a valid frame."
            )
        distances = np.maximum(pairs["v"], edges[0])
        counts += np.histogram(distances, bins=edges.size - 1, range=(edges[0], edges[-1]))[0]
    # Of one kind, every pair was met from both sides, with the same bits.
    return counts // 2 if alike else counts


def _ideal_counts(edges: np.ndarray, pairs: float, box: tuple[float, ...]) -> np.ndarray:
    """Pairs (m,) in each shell of one frame of an ideal gas."""
    shells = ball_volume(len(box)) * np.diff((2.0 * edges) ** len(box))
    return pairs * shells / math.prod(box)


def _independent_errors(counts: np.ndarray, expected: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(counts, 1)) / expected


def _errors(counts: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Standard errors (m,) of g from the histograms (frames, m)."""
    frames = counts.shape[0]
    total = counts.sum(axis=0)
    errors = _independent_errors(total, frames * expected)
    if frames < MIN_BLOCKS:
        return errors
    with warnings.catch_warnings():
        # One message for all bins is the contact value's task.
        warnings.simplefilter("ignore", CaromWarning)
        for k in np.flatnonzero(total):
            errors[k] = blocking(counts[:, k]).error / expected[k]
    return errors


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Turn the system's complaint about a path into ours."""
    try:
        yield
    except OSError as error:
        raise FileError(f"{path} cannot be written ({error.strerror}); choose another place.") from error
