"""Storage and loss modulus: the stress of a shear that oscillates, in phase with strain and with its rate."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.arithmetic import cosine_and_sine, least_squares
from carom.block import Block
from carom.errors import InputError
from carom.figures import curves
from carom.figures.palette import SERIES
from carom.models.motions.shear import STAGES, Shear
from carom.observables.pressure_tensor import about_center
from carom.observables.statistics import Estimate, FewSamples, blocking, unwarned
from carom.results import Result
from carom.suggestions import corrected
from carom.texts import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.frame import Frame
    from carom.scene.scene import Scene

LEAST = 8  # blocks in a period: half of that would do for a sine


@corrected()
@dataclass(frozen=True)
class ShearModuli:
    """G' and G'' of a shear that oscillates: an observable of a run, for :meth:`carom.Simulation.measure`.

    Raises
    ------
    InputError
        From ``measure``, where the scene has no ``carom.models.Shear`` with a period, where a block is longer
        than an eighth of the period, and where the run is shorter than a period.

    Notes
    -----
    With the strain ``g sin(w t)`` the stress ``-P_10`` is ``g (G' sin(w t) + G'' cos(w t))``, and harmonics
    where g is not small. Each whole period gives one value of both by least squares; their scatter is the
    error. Parts that follow from stretches of constant rate, and from means over blocks, are divided out.

    Examples
    --------
    >>> import carom
    >>> from carom.models import Shear
    >>> scene = carom.Scene.random(64, 0.3, motion=Shear(0.5, period=2.0))
    >>> found = carom.Simulation(scene, seed=1).measure(ShearModuli(), time=40.0, blocks=320)
    >>> found.periods, found.loss.mean > 0.0
    (20, True)
    """

    def begin(self, scene: Scene) -> None:
        """Raise InputError if the shear of a ``scene`` does not oscillate."""
        if not (isinstance(scene.motion, Shear) and scene.motion.period):
            raise InputError(
                "ShearModuli needs a shear that oscillates: give the scene motion=Shear(rate, period=...)."
            )

    def sums(self, scene: Scene, frame: Frame) -> ModuliSums:
        """Return the sums of a stretch that begins with the ``frame``."""
        assert isinstance(scene.motion, Shear)
        return ModuliSums(scene, scene.motion, frame.time)


class ModuliSums:
    """The stress in each block from a ``time`` on."""

    observer = None

    def __init__(self, scene: Scene, shear: Shear, time: float):
        self._scene, self._rate, self._time = scene, shear.rate, time
        self._period = shear.period or math.inf
        self._middles: list[float] = []  # of blocks, in periods
        self._stresses: list[float] = []  # [energy / length^d]
        self._block = 0.0  # length, in periods

    def add(self, block: Block) -> None:
        """Add a block."""
        scene, self._block = self._scene, block.duration / self._period
        if not 0.0 < self._block <= 1.0 / LEAST:
            raise InputError(
                f"A block is {self._block:.3g} periods long; expected at most 1 / {LEAST}: give measure() "
                f"blocks= at least {LEAST} for each period."
            )
        self._middles.append((self._time + 0.5 * block.duration) / self._period)
        self._time += block.duration
        flux = block.momentum_flux
        assert flux is not None
        passed = flux.carried * about_center(scene) + flux.handed_over
        self._stresses.append(-float(passed[1, 0]) / (scene.volume * block.duration))

    def result(self) -> ShearModuliResult:
        """Return the moduli with their errors."""
        size = round(1.0 / self._block)
        periods = len(self._stresses) // size
        if not periods:
            raise InputError("ShearModuli needs a whole period at least; measure for longer.")
        whole = periods * size
        columns = np.column_stack(
            [*cosine_and_sine(np.array(self._middles) % 1.0), np.ones(len(self._middles))]
        )
        fits = [
            least_squares(columns[k : k + size], np.array(self._stresses[k : k + size]))
            for k in range(0, whole, size)
        ]
        frequency = 2.0 * math.pi / self._period
        strain = self._rate / frequency
        # The sine of a polygon between its points, and the mean of a sine over a block.
        seen = strain * float(np.sinc(1.0 / STAGES)) ** 2 * float(np.sinc(self._block))
        # One period has no error bar, and says so by itself.
        with contextlib.nullcontext() if periods > 1 else unwarned(FewSamples):
            loss, storage = (blocking([fit[k] / seen for fit in fits]) for k in (0, 1))
        return ShearModuliResult(
            storage, loss, frequency, strain, periods, self._scene.n, self._scene.dimension
        )


@dataclass(frozen=True, eq=False, repr=False)
class ShearModuliResult(Result):
    """Moduli of a shear that oscillates.

    Attributes
    ----------
    storage, loss : Estimate
        G' and G'' [energy / length^d].
    frequency : float
        Radians a time [1 / time]; ``loss`` over it is the dynamic viscosity.
    strain : float
        Amplitude of the strain.
    periods : int
        Whole periods that were measured.
    n, dimension : int
        Number of particles, and of dimensions.
    """

    storage: Estimate
    loss: Estimate
    frequency: float
    strain: float
    periods: int
    n: int
    dimension: int

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [("G'", self.storage.value_text), ("G''", self.loss.value_text)]
        rows += [("frequency [1 / time]", f"{self.frequency:.6g}"), ("strain", f"{self.strain:.4g}")]
        unit = f"[energy / length^{self.dimension}]"
        return (
            f"Shear moduli of {counted(self.n, 'particle')} {unit}, {counted(self.periods, 'period')}",
            rows,
        )

    def _draw_into(self, axes: Axes) -> None:
        parts = (("storage $G'$", self.storage), ("loss $G''$", self.loss))
        known = [(each.mean, each.error if math.isfinite(each.error) else 0.0) for _, each in parts]
        curves.points(
            axes, ((name, *v, SERIES[k]) for k, ((name, _), v) in enumerate(zip(parts, known, strict=True)))
        )
        axes.set(xlabel=f"frequency {self.frequency:.4g}, strain {self.strain:.4g}", ylabel="shear modulus")
