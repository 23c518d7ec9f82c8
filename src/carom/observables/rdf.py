"""The radial distribution function g(r) in any dimension, in float64, with bins that begin at contact."""

from __future__ import annotations

import contextlib
import itertools
import math
import os
import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from carom.cells import Grid, SortedCells
from carom.errors import CaromWarning, FileError, InputError
from carom.frame import Frame
from carom.observables.contact import contact_value
from carom.observables.pairs import distance_counts
from carom.observables.statistics import MIN_BLOCKS, Estimate, blocking
from carom.scene.overlaps import Room
from carom.theory import ball_volume

if TYPE_CHECKING:
    import MDAnalysis
    import pandas

# Bins of a fiftieth of a diameter where nothing is said: g falls by at most a tenth in one, up to freezing in
# 3D.
DEFAULT_WIDTH = 0.02

# Structure fades beyond five diameters in a fluid, while the cost goes on growing as r^d.
DEFAULT_REACH = 5.0


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

    def coordination(self) -> tuple[np.ndarray, np.ndarray]:
        """Return how many neighbours are nearer than the upper edge of each bin, with errors, (m,) each.

        Errors of the bins count as independent.

        Raises
        ------
        InputError
            If the distribution is of a pair of species, or does not begin at contact.
        """
        if self.pair is not None or self.contact_value is None:
            raise InputError("Running coordination numbers need g(r) of all components, from contact on.")
        added = 2.0 * self.counts / (self.n * self.frames)
        errors = np.divide(added * self.error, self.g, out=np.zeros_like(self.g), where=self.g > 0.0)
        return np.cumsum(added), np.sqrt(np.cumsum(errors**2))

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

    def to_pandas(self) -> pandas.DataFrame:
        """Return r, g and its error as a pandas DataFrame."""
        import pandas

        return pandas.DataFrame({"r": self.r, "g": self.g, "error": self.error})

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

    Compiled code counts the pairs over sorted cells (``carom.observables.pairs``), in double precision, in
    as many threads as Numba uses (``NUMBA_NUM_THREADS``); their number changes no bit. Pairs in contact, and
    those that overlap by no more than the rounding of positions stored in single precision (1.2e-7 box
    edges), belong to the first bin.
    """
    return distributions(frames, {"": (pair, contact)}, bins=bins, width=width, rmax=rmax)[""]


def distributions(
    frames: Iterable[Frame],
    wanted: Mapping[str, tuple[tuple[int | str, int | str] | None, float | None]],
    *,
    bins: int | None = None,
    width: float | None = None,
    rmax: float | None = None,
) -> dict[str, RadialDistribution]:
    """Several g(r) of the same frames, each as from :func:`carom.rdf`, in one pass over them.

    Parameters
    ----------
    frames, bins, width, rmax
        As for :func:`carom.rdf`.
    wanted : mapping of str to (pair, contact)
        What to compute, by name, in the words of :func:`carom.rdf`.

    Raises
    ------
    InputError
        As :func:`carom.rdf` does.
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
    asked = {}
    for name, (pair, contact) in wanted.items():
        chosen = None if pair is None else _species(first, pair)
        if contact is not None and chosen is None:
            raise InputError("contact is the distance of two species, and no pair is given.")
        diameter = _common_diameter(first) if chosen is None else _contact(first, chosen, contact)
        asked[name] = (chosen, _bin_edges(diameter, min(first.box), bins, width, rmax))
    histograms: dict[str, list[np.ndarray]] = {name: [] for name in asked}
    for index, frame in enumerate(itertools.chain([first], source)):
        if index:
            _check_same(first, frame, index)
        for name, counts in _histograms(frame, asked).items():
            histograms[name].append(counts)
    return {
        name: _distribution(first, np.array(histograms[name]), edges, chosen)
        for name, (chosen, edges) in asked.items()
    }


def _distribution(
    first: Frame, counts: np.ndarray, edges: np.ndarray, pair: tuple[int, int] | None
) -> RadialDistribution:
    """Return g(r) from the histograms (frames, m) of frames like the first."""
    expected = _ideal_counts(edges, _pairs(first, pair), first.box)
    return RadialDistribution(
        edges=edges,
        g=counts.mean(axis=0) / expected,
        error=_errors(counts, expected),
        counts=counts.sum(axis=0),
        n=first.n,
        dimension=first.dimension,
        frames=len(counts),
        diameter=float(edges[0]),
        packing_fraction=_packing_fraction(first),
        contact_value=contact_value(counts, expected, edges, first.dimension),
        pair=pair,
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
    count = max(int(frame.species.max()) + 1, len(frame.species_names))
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
        ours, theirs = (np.asarray(getattr(each, name)) for each in (frame, first))
        if not np.array_equal(ours, theirs):
            raise InputError(
                f"Frame {index} has {name} {ours.tolist()}, the first one {theirs.tolist()}; "
                "g(r) averages frames of the same system."
            )
    for name in ("diameters", "species"):
        if not np.array_equal(getattr(frame, name), getattr(first, name)):
            raise InputError(f"Frame {index} has other {name} than the first; g(r) averages one system.")


def _histograms(
    frame: Frame, asked: Mapping[str, tuple[tuple[int, int] | None, np.ndarray]]
) -> dict[str, np.ndarray]:
    """Return the pairs (m,) of one frame, or of two of its species, in each bin, by name."""
    box = np.asarray(frame.box, dtype=np.float64)
    grid = Grid.of(box, np.ones(len(box), dtype=np.bool_), frame.n, max(e[-1] for _, e in asked.values()))
    rounding = float(np.finfo(np.float32).eps) * float(box.max())
    kinds = {kind for pair, _ in asked.values() for kind in (pair or (None,))}
    x = frame.positions
    places = {kind: x if kind is None else x[frame.species == kind] for kind in kinds}
    cells = {kind: SortedCells.of(grid, place) for kind, place in places.items()}
    found = {}
    for name, (pair, edges) in asked.items():
        a, b = pair or (None, None)
        counts, closer = distance_counts(
            cells[a], None if a == b else cells[b], edges, closest=float(edges[0]) - rounding
        )
        if closer:
            _refuse_overlap(frame, pair, float(edges[0]))
        found[name] = counts
    return found


def _refuse_overlap(frame: Frame, pair: tuple[int, int] | None, contact: float) -> None:
    """Raise InputError that names the closest pair of a frame, or of two of its species."""
    box = np.asarray(frame.box, dtype=np.float64)
    room = Room(box, np.ones(len(box), dtype=np.bool_))
    members = np.arange(frame.n)
    species = np.zeros(frame.n, dtype=np.int64) if frame.species is None else frame.species
    if pair is not None:
        members = np.flatnonzero(np.isin(species, pair))
    places = room.wrapped(frame.positions[members])
    pairs = room.near(places, contact)
    if pair is not None and pair[0] != pair[1]:
        kinds = species[members]
        pairs = pairs[kinds[pairs[:, 0]] != kinds[pairs[:, 1]]]
    distances = room.distances(places, pairs)
    closest = int(np.argmin(distances))
    i, j = sorted(members[pairs[closest]].tolist())
    raise InputError(
        f"Particles {i} and {j} overlap at time {frame.time:.6g} (distance {distances[closest]:.6g}, "
        f"{'diameter' if pair is None else 'contact'} {contact:.6g}); g(r) needs a valid frame."
    )


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
