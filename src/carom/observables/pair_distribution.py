"""g(r): an observable of frames, of a run, of a file or of a folder."""

from __future__ import annotations

from dataclasses import dataclass, field

from carom.frame import Frame
from carom.meant import corrected
from carom.observables.of_frames import OfFrames
from carom.observables.radial import RDFResult
from carom.observables.rdf import Histograms


@corrected()
@dataclass
class RDF(OfFrames):
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
    _counted: Histograms = field(init=False, repr=False)

    _what = "g(r)"
    _uniform = True

    def __post_init__(self) -> None:
        wanted = {"": (self.pair, self.contact)}
        self._counted = Histograms(wanted, bins=self.bins, width=self.width, rmax=self.rmax)

    def add(self, frame: Frame) -> None:
        """Add the next frame."""
        self._counted.add(frame)

    def result(self) -> RDFResult:
        """Return g(r) of all frames so far."""
        return self._counted.result()[""]
