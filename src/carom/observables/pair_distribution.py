"""g(r) during a run: an observable of frames, together with others in one pass."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from carom import checks
from carom.errors import InputError
from carom.frame import Frame
from carom.observables.radial import RadialDistribution
from carom.observables.rdf import Histograms

if TYPE_CHECKING:
    from carom.scene.scene import Scene


@dataclass
class PairDistribution:
    """The radial distribution function and running coordination numbers: an observable of frames.

    Give it to :meth:`carom.Simulation.measure`, or call :meth:`update` with frames of a simulation or of a
    trajectory file, and :meth:`result` whenever wanted. :func:`carom.rdf` does the same with all frames of an
    iterable.

    Parameters
    ----------
    bins, width, rmax, pair, contact
        As for :func:`carom.rdf`.
    blocks : int
        Number of frames that ``measure`` takes.

    Raises
    ------
    InputError
        From :meth:`update`, as from :func:`carom.rdf`; from :meth:`result`, before any frame; from
        :meth:`prepare`, if the scene has obstacles.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.crystal(108, 0.3), seed=1)
    >>> found = sim.measure(carom.observables.PairDistribution(rmax=2.0), time=16.0)
    >>> found.frames
    65
    """

    bins: int | None = None
    width: float | None = None
    rmax: float | None = None
    pair: tuple[int | str, int | str] | None = None
    contact: float | None = None
    blocks: int = 64
    _counted: Histograms = field(init=False, repr=False)

    def __post_init__(self) -> None:
        checks.integer(self.blocks, "blocks", low=2)
        wanted = {"": (self.pair, self.contact)}
        self._counted = Histograms(wanted, bins=self.bins, width=self.width, rmax=self.rmax)

    def prepare(self, scene: Scene) -> None:
        """Refuse a scene with obstacles, which frames do not show: ``measure`` calls this first."""
        if scene.obstacles:
            raise InputError(
                f"The scene has {len(scene.obstacles)} obstacles; g(r) is that of a fluid which is the same "
                "everywhere."
            )

    def update(self, frame: Frame) -> None:
        """Add the next frame."""
        self._counted.update(frame)

    def result(self) -> RadialDistribution:
        """Return g(r) of all frames so far."""
        return self._counted.result()[""]
