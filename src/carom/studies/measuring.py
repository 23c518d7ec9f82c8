"""All that frames alone give, in one pass over them: ``carom measure``, and ``carom.measure`` in Python."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator, Sized
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np

from carom import checks, suggestions
from carom.errors import CaromError, InputError, warn
from carom.frame import Frame
from carom.io.formats import Reader
from carom.io.trajectory import open_reader
from carom.layout import kind_at, scene_at
from carom.models.interactions.rule_files import RuleFile
from carom.observables.bond_order import NEAREST, BondOrder
from carom.observables.crystallinity import Crystallinity
from carom.observables.density_profile import DensityProfile
from carom.observables.dynamics import FEW, Dynamics
from carom.observables.of_frames import OfFrames, as_points
from carom.observables.protocol import Underway, sees
from carom.observables.rdf import DEFAULT_REACH, MOST_SPECIES, RDF, PartialRDF
from carom.observables.statistics import unwarned
from carom.observables.structure_factor import StructureFactor
from carom.scene.fields import is_equal
from carom.scene.scene import Scene
from carom.scene.velocities import conserved
from carom.scene_file.scene_file import SceneFile
from carom.theory import ball_volume

PRODUCTS = 5e7
"""Most products of particles and wave vectors in a frame, for S(k): a second for a few frames."""

WAVES = 15.0
"""Largest wave number of S(k) [(density)^(1 / d)]: in a dense fluid beyond the second peak."""

FEWEST_SHELLS = 8
"""Lengths of wave vectors of S(k) in large systems."""

BOND_WIDTH = 0.1
"""Width of a bin of the correlation of orders [mean diameter]."""

EQUAL = 1e-6
"""Differences of intervals, relative to them, up to which frames are equally spaced in time."""


@dataclass
class _System:
    """The first frame, and what is known besides frames: of a run its scene."""

    frame: Frame
    scene: Scene | None = None
    decides: bool = False
    """Whether something may push them that is not known here: rules of a file, or another program."""

    @property
    def confined(self) -> str:
        """What makes the system different from place to place: walls, obstacles or nothing."""
        if not all(self.frame.periodic):
            return "walls"
        return "obstacles" if self.scene is not None and self.scene.obstacles else ""

    @property
    def along(self) -> int | None:
        """The axis of a profile: that of gravity, or else the first with walls; None if there is none."""
        if self.scene is not None and (g := getattr(self.scene.motion, "g", None)) is not None:
            return int(np.argmax(np.abs(g)))
        return None if all(self.frame.periodic) else self.frame.periodic.index(False)

    @property
    def equal(self) -> bool:
        """Whether all particles are alike: points, if their species are one, or too many to tell apart."""
        if not self.frame.diameters.any():
            kinds = 1 if self.frame.species is None else np.unique(self.frame.species).size
            return not 1 < kinds <= MOST_SPECIES
        if self.scene is not None:
            return is_equal(self.scene)
        return bool(np.ptp(self.frame.diameters) == 0.0 and np.ptp(self.frame.masses) == 0.0)

    @property
    def diameter(self) -> float:
        """Mean diameter, or of points the mean distance [length]."""
        return float(self.frame.diameters.mean()) or self.spacing

    @property
    def spacing(self) -> float:
        """Edge of the volume of one particle [length]."""
        volume = float(np.prod(self.frame.box)) / self.frame.n
        return float(volume ** (1.0 / self.frame.dimension))

    @property
    def half(self) -> float:
        """Half of the shortest edge [length]."""
        return 0.5 * min(self.frame.box)


def _rdf(system: _System) -> Any:
    frame = system.frame
    if system.confined:
        raise InputError(
            f"with {system.confined} the fluid is not the same everywhere, and g depends on more than r"
        )
    if frame.n < 2:
        raise InputError("it needs two particles")
    if system.equal:
        return RDF()
    pairs = PartialRDF(cast("Scene", _Mixture(frame)) if system.scene is None else system.scene)
    if not pairs.pairs:
        raise InputError(f"more than {MOST_SPECIES} sizes, or none that touch within half of the box")
    return pairs


def _structure(system: _System) -> StructureFactor:
    frame, d = system.frame, system.frame.dimension
    if system.confined:
        raise InputError(
            f"with {system.confined} the fluid is not the same everywhere, and S depends on more than k"
        )
    # The number of wave vectors up to k, one of each k and -k.
    per_volume = 0.5 * 2.0**d * ball_volume(d) * float(np.prod(frame.box / (2.0 * np.pi)))
    kmax = min((PRODUCTS / frame.n / per_volume) ** (1.0 / d), WAVES / system.spacing)
    few = per_volume * kmax**d < 2.0 * d * FEWEST_SHELLS
    return StructureFactor(shells=FEWEST_SHELLS) if few else StructureFactor(kmax=kmax)


def _displacement(system: _System) -> Dynamics:
    frame = system.frame
    if frame.tilt is not None:
        raise InputError("the box is sheared, and displacements grow with the shear")
    if frame.images is None:
        raise InputError("the frames do not say how often a particle crossed the box (no image counts)")
    if system.decides:
        return Dynamics(conserved=(False,) * frame.dimension)
    return Dynamics(conserved=None if system.scene is None else conserved(system.scene))


def _order(system: _System) -> BondOrder:
    frame = system.frame
    if frame.dimension not in NEAREST:
        raise InputError(f"it is measured in 2 to {max(NEAREST)} dimensions, and there are {frame.dimension}")
    if frame.n <= NEAREST[frame.dimension]:
        raise InputError(f"it needs {NEAREST[frame.dimension] + 1} particles, and there are {frame.n}")
    rmax = min(system.half, DEFAULT_REACH * system.diameter)
    return BondOrder(rmax=rmax, width=min(BOND_WIDTH * system.diameter, rmax))


def _profile(system: _System) -> DensityProfile:
    if system.frame.tilt is not None:
        return DensityProfile(axis=1)  # across the flow
    return DensityProfile(axis=system.along or 0)


def _crystal(system: _System) -> Crystallinity:
    frame = system.frame
    if frame.dimension != 3:
        raise InputError(f"solid-like particles are those of 3 dimensions, and there are {frame.dimension}")
    if frame.n <= NEAREST[3]:
        raise InputError(f"it needs {NEAREST[3] + 1} particles, and there are {frame.n}")
    return Crystallinity()


@dataclass(frozen=True)
class Quantity:
    """A quantity that frames give."""

    what: str  # what it is, in a few words
    observable: type  # its class
    make: Callable[[_System], Any]
    """Returns the observable for a system, or raises InputError with the end of a sentence on why there is
    none."""
    usual: Callable[[_System], bool] = field(default=lambda system: True)
    """Whether it is measured where no quantity is named."""


QUANTITIES = {
    "rdf": Quantity("g(r)", RDF, _rdf),
    "structure": Quantity("S(k)", StructureFactor, _structure),
    "msd": Quantity("mean square displacement", Dynamics, _displacement),
    "order": Quantity(
        "bond order", BondOrder, _order, lambda s: s.frame.dimension in (2, 3)
    ),
    "profile": Quantity(
        "density profile", DensityProfile, _profile, lambda s: s.along is not None
    ),
    "crystal": Quantity(
        "crystallinity", Crystallinity, _crystal, lambda s: s.frame.dimension == 3
    ),
}  # fmt: skip
"""What :func:`measure` knows by name."""


def measure(
    frames: Iterable[Frame] | str | os.PathLike[str],
    *quantities: Any,
    progress: Callable[[float, str], object] | None = None,
) -> dict[str, Any]:
    """Measure several quantities in one pass over the frames of a run, a packing or a file.

    Parameters
    ----------
    frames : iterable of Frame, or path
        Frames in order, or the path of a trajectory, or of the folder of a run or packing. Of a packing only
        the last frame is taken: the diameters of the others differ.
    *quantities : str or observable
        ``"rdf"``, ``"structure"``, ``"msd"``, ``"order"``, ``"profile"``, ``"crystal"``; or an observable of
        frames, such as ``carom.RDF(width=0.05)`` or one of your own, whose name is that of its class. Without
        any, all that apply: the order in two and three dimensions, crystallinity in three, the profile along
        an axis with walls or gravity.
    progress : callable, optional
        Called as ``progress(fraction, text)`` after each frame.

    Returns
    -------
    dict
        The result of each quantity by its name. g(r) of a mixture is a dictionary by pairs of species.

    Raises
    ------
    InputError
        If a name is unknown, or the frames give none of the quantities.
    FileError
        If a file cannot be read.

    Warns
    -----
    CaromWarning
        For each quantity that the frames cannot give, with the reason.

    Examples
    --------
    >>> import carom
    >>> found = carom.run(carom.Scene.crystal(32, 0.3), "run3", collisions_per_particle=50, frames=16)
    >>> both = carom.measure("run3", "rdf", "msd")
    >>> both["rdf"].frames, bool(both["msd"].mean_square[-1] > both["msd"].mean_square[0])
    (16, True)
    """
    wanted = _wanted(quantities)
    with _opened(frames) as (several, total, path, foreign):
        underway: dict[str, Any] = {}
        reasons: dict[str, str] = {}
        times: list[float] = []
        for k, frame in enumerate(several):
            if not isinstance(frame, Frame):
                raise InputError(f"frames must hold frames, found {checks.describe(frame)}.")
            frame = as_points(frame)
            if k == 0:
                underway = _begun(wanted, _known(frame, path, foreign), reasons)
            times.append(frame.time)
            for name, observable in [*underway.items()]:
                try:
                    if isinstance(observable, Dynamics):
                        _check_time(times)
                    observable.add(frame)
                except InputError as error:
                    reasons[name] = _clause(error)
                    del underway[name]
            if progress is not None:
                progress((k + 1) / total if total else 0.0, "Measuring")
    if not times:
        raise InputError("There is no frame to measure.")
    found: dict[str, Any] = {}
    for name, observable in underway.items():
        try:
            if isinstance(observable, Dynamics) and len(times) <= FEW:
                raise InputError(f"{len(times)} frames are too few; {FEW + 1} are the least")
            found[name] = observable.result()
        except InputError as error:
            reasons[name] = _clause(error)
    if not found:
        raise InputError("; ".join(f"No {name}: {why}" for name, why in reasons.items()) + ".")
    for name, why in reasons.items():
        warn(f"No {name}: {why}.")
    return found


def _wanted(quantities: tuple[Any, ...]) -> dict[str, Any]:
    """Return the quantities by name, each True or an observable; empty if none is named."""
    wanted: dict[str, Any] = {}
    for each in quantities:
        if isinstance(each, str):
            if each not in QUANTITIES:
                raise InputError(
                    f"{each!r} is no quantity of frames{suggestions.suggestion(each, QUANTITIES)}."
                )
            name, value = each, True
        elif callable(getattr(each, "add", None)) and not isinstance(each, type):
            if sees(each) != "frame":
                raise InputError(f"{type(each).__name__} is of blocks, and there are frames only.")
            known = [name for name, one in QUANTITIES.items() if type(each) is one.observable]
            name, value = (*known, type(each).__name__)[0], each
        else:
            raise InputError(
                f"measure() takes names of quantities ({', '.join(QUANTITIES)}) or observables of frames, "
                f"found {checks.describe(each)}."
            )
        if name in wanted:
            raise InputError(f"{name} is named twice; measure the second one by itself.")
        wanted[name] = value
    return wanted


@contextlib.contextmanager
def _opened(frames: Any) -> Iterator[tuple[Iterable[Any], int, Path | None, bool]]:
    """Open what holds frames: yield them, their number if known, the path, and whether they are foreign."""
    if isinstance(frames, str | os.PathLike):
        where = Path(frames)
        with open_reader(where) as reader:
            kind = kind_at(where)
            if kind is not None and kind.grows and len(reader):
                yield [reader[-1]], 1, where, False
            else:
                yield reader, len(reader), where, reader.foreign
        return
    if isinstance(frames, Frame) or not isinstance(frames, Iterable):
        raise InputError(
            f"frames must be a list or an iterator of frames, or a path, found {checks.describe(frames)}."
        )
    many = len(frames) if isinstance(frames, Sized) else 0
    if isinstance(frames, Reader):
        yield frames, many, frames.path, frames.foreign
    else:
        yield frames, many, None, False


def _known(frame: Frame, path: Path | None, foreign: bool) -> _System:
    """Return the system of the first frame, with the scene of the run in whose folder the frames lie."""
    if path is None or foreign:
        return _System(frame, decides=foreign)
    if (file := scene_at(path)) is None:
        return _System(frame)
    try:
        plan = SceneFile.load(file).scene
        given = {
            name: value
            for name in ("contact", "obstacles", "walls", "motion", "drive", "pinned", "interaction")
            if (value := getattr(plan, name)) not in (None, ())
        }
        decides = isinstance(given.get("interaction"), RuleFile)
        if decides or isinstance(given.get("pinned"), int):  # who is pinned is drawn by the seed
            given = {name: value for name, value in given.items() if name not in ("interaction", "pinned")}
            decides = True
        if "pinned" in given:
            given["pinned"] = np.array(given["pinned"], np.int64)
        with unwarned():
            return _System(frame, Scene.from_frame(frame, **given), decides)
    except CaromError:  # the frames are of another system, or the file was edited
        return _System(frame)


class _Mixture:
    """A frame with the names of a scene: that of a frame with overlaps cannot be made."""

    contact = None

    def __init__(self, frame: Frame):
        self.species, self.species_names = frame.species, frame.species_names
        self.diameters, self.box = frame.diameters, frame.box


def _begun(wanted: dict[str, Any], system: _System, reasons: dict[str, str]) -> dict[str, Any]:
    """Return the observables by name; note the reasons why some cannot be measured."""
    usual: dict[str, Any] = {name: True for name, one in QUANTITIES.items() if one.usual(system)}
    begun: dict[str, Any] = {}
    for name, given in (wanted or usual).items():
        try:
            if given is True:
                begun[name] = QUANTITIES[name].make(system)
                continue
            mine = given.fresh() if hasattr(given, "fresh") else given
            # One of one's own may need to begin: a frame has the names of its scene.
            if hasattr(mine, "begin") and not (system.scene is None and isinstance(mine, OfFrames)):
                mine.begin(system.scene or system.frame)
            begun[name] = mine if hasattr(mine, "result") else Underway(mine)
        except InputError as error:
            reasons[name] = _clause(error)
    return begun


def _check_time(times: list[float]) -> None:
    """Raise InputError, with the end of a sentence, unless the last frame comes at its time."""
    if len(times) < 2:
        return
    first, last = times[1] - times[0], times[-1] - times[-2]
    if not first > 0.0:
        raise InputError("the frames have no times")
    if abs(last - first) > EQUAL * first:
        raise InputError("the frames are not at equal times from each other")


def _clause(error: InputError) -> str:
    """Return an error as the end of a sentence."""
    text = str(error).rstrip(".")
    return text if text[1:2].isupper() else text[:1].lower() + text[1:]
