"""Correlations in time during a run, at times from one frame to the whole run, without a trajectory.

The latest 16 frames are kept, 16 at twice the spacing, and so on: memory is logarithmic, and times have no
gap. So J. Ramirez, S. K. Sukumaran, B. Vorselaars and A. E. Likhtman, J. Chem. Phys. 133, 154103 (2010), but
without averaging, which would blur the times.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.compiling.entry import entry
from carom.errors import InputError
from carom.figures import curves
from carom.figures.palette import WARM
from carom.frame import Frame
from carom.observables.analysis.self_diffusion import NO_LINE, Line, line_of
from carom.observables.analysis.waves import Waves
from carom.observables.of_frames import OfFrames, of_species
from carom.observables.statistics import UNKNOWN, Estimate, arrays, blocking, shown
from carom.results import Result
from carom.scene import velocities as scene_velocities
from carom.suggestions import corrected

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.scene.scene import Scene

KEPT = 16
"""Frames kept at each spacing. A new frame is correlated with those 8 to 15 spacings before; at the shortest
spacing, with those 1 to 15 before."""

SAME = 1e-5
"""Change of the total momentum, in units of the sum of all magnitudes, up to which it counts as conserved:
velocities of files may be in single precision."""

OCTAVES = ((1, 2), (2, 4), (4, 8), (KEPT // 2, KEPT - 1))
"""Lags from which to which a slope is fitted at the shortest spacing; at the others the last of these."""

FEW = 8
"""Least number of origins of a time; with fewer, the scatter does not give the error."""


@entry
def _correlate(r, v, later, w, chosen, sums):
    """Put sums over the particles ``chosen`` in two frames: displacement squared, its square, v w, v r."""
    square_sum = fourth = product_sum = moved_sum = 0.0
    for i in chosen:
        square = product = moved = 0.0
        for a in range(len(r[0])):
            step = later[i, a] - r[i, a]
            square += step * step
            product += v[i, a] * w[i, a]
            moved += 0.5 * (v[i, a] + w[i, a]) * step
        square_sum += square
        fourth += square * square
        product_sum += product
        moved_sum += moved
    sums[0] = square_sum
    sums[1] = fourth
    sums[2] = product_sum
    sums[3] = moved_sum


@corrected()
@dataclass
class Dynamics(OfFrames):
    """Mean square displacement, velocity autocorrelation, non-Gaussian parameter: an observable of frames.

    Give it to :meth:`carom.Simulation.measure`, or frames at equal times or a path to :meth:`over`.

    Parameters
    ----------
    species : int, optional
        Species to measure; by default all particles.
    shells : int
        Number of lengths of wave vectors at which F(q, t) is measured, from the shortest that the box allows.
    conserved : sequence of bool, optional
        Axes along which the total momentum is conserved. The motion of the center of mass is subtracted
        there.
        ``measure`` knows them. Frames alone do not: the periodic axes are taken, of more than one particle.

    Raises
    ------
    InputError
        From :meth:`add`, if frames have no image counts, or are not equally spaced in time, or if the
        momentum changes along an axis that was taken, or with ``shells`` the box. From :meth:`result`, if
        there are fewer than 9 frames.

    Notes
    -----
    Frames of other programs may have no velocities: correlations with them are then nan, and the motion of
    the center of mass stays in the displacements.

    ``diffusion`` is the slope of a line ``2 d D t + c`` through the mean square displacements of an octave of
    times. It is the octave after the first whose slope agrees, within two standard errors, with those of all
    later ones. The error is by blocking over the ends of the displacements, and at least that of independent
    Brownian particles. There is no D where slopes still change at the end, or an axis has walls.

    Where the box changes, a particle moves from one frame to the next by the change of its coordinates in
    edges, times the mean of the edges of both frames. So what a barostat takes along is no displacement. Nor
    do image counts multiply the edge of another frame, which would add a displacement that grows with time
    (S. von Bülow, J. T. Bullerjahn and G. Hummer, J. Chem. Phys. 153, 021101 (2020)).

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.crystal(108, 0.3), seed=1)
    >>> found = sim.measure(carom.Dynamics(), time=16.0, blocks=64)
    >>> float(found.times[0])
    0.25
    """

    species: int | None = None
    shells: int = 0
    conserved: Sequence[bool] | None = None

    _what = "correlation in time"
    _upright = "displacements grow with the flow, which is no diffusion"

    def __post_init__(self) -> None:
        checks.integer(self.shells, "shells", low=0)

    def begin(self, scene: Scene) -> None:
        """Note which momenta are conserved, unless ``conserved`` was given: ``measure`` calls this first."""
        if self.conserved is None:
            self.conserved = scene_velocities.conserved(scene)

    def _begin(self, first: Frame) -> None:
        momentum = np.sum(first.masses[:, None] * first.velocities, axis=0)
        still, self._momentum = self.conserved, None
        if still is None and "velocities" in first.lacks:
            still = (False,) * first.dimension
        elif still is None:
            still = [wraps and first.n > 1 for wraps in first.periodic]
            self._momentum = np.where(still, momentum, np.nan)  # a difference from nan is never too large
        elif len(still) != first.dimension:
            raise InputError(f"conserved has {len(still)} values, and a frame has {first.dimension} axes.")
        self._drift = np.where(still, momentum / first.masses.sum(), 0.0)
        self._chosen = np.flatnonzero(of_species(first, self.species))
        self._waves = Waves.of(first.box, self.shells) if self.shells else None
        self._levels: list[_Level] = []
        self._every = 0.0
        self._last: Frame = first
        self._ways: np.ndarray | None = None  # since the box changed for the first time

    def _of(self, frame: Frame) -> tuple[float, np.ndarray]:
        """Return the mean of v^2 and S(q) of a frame, after it was correlated with those before it."""
        self._check(frame)
        v = frame.velocities - self._drift
        v[:] = np.nan if "velocities" in frame.lacks else v
        r = self._moved(frame) - self._drift * (frame.time - self._first.time)
        rho = None if self._waves is None else self._waves.density(frame.positions[self._chosen])
        count, level = len(self._samples), 0
        while True:
            if level == len(self._levels):
                self._levels.append(_Level(frame.n, frame.dimension, 0 if rho is None else len(rho)))
            self._levels[level].take(r, v, rho, level, self._chosen, self._waves)
            if count % 2:
                break
            count //= 2
            level += 1
            if count == 0 and level > 0:
                break
        square = float(np.mean(np.sum(v[self._chosen] ** 2, axis=1)))
        if rho is None or self._waves is None:
            return square, np.zeros(0)
        return square, self._waves.average(np.sum(rho * rho, axis=1)) / len(self._chosen)

    def _moved(self, frame: Frame) -> np.ndarray:
        """Return where the particles came to [length], without what the box took along."""
        last, self._last = self._last, frame
        if self._ways is None and np.array_equal(frame.box, last.box):
            return frame.unwrapped
        before = last.unwrapped if self._ways is None else self._ways
        edges = frame.unwrapped / frame.box - last.unwrapped / last.box
        self._ways = before + edges * (0.5 * (frame.box + last.box))
        return self._ways

    def _check(self, frame: Frame) -> None:
        if self.shells and not np.array_equal(frame.box, self._first.box):
            raise InputError(
                f"A frame has box {frame.box.tolist()}, the first one {self._first.box.tolist()}, and waves "
                "of F(q, t) fit one box: leave out shells, or run at constant volume."
            )
        if frame.images is None:
            raise InputError(
                "Displacements need image counts or unwrapped positions, which a frame lacks; sample with "
                "carom.Tuning(images=True)."
            )
        if self._momentum is not None and "velocities" not in frame.lacks:
            momenta = frame.masses[:, None] * frame.velocities
            change = np.abs(np.sum(momenta, axis=0) - self._momentum)
            if (change > SAME * float(np.sum(np.abs(momenta)))).any():
                raise InputError(
                    f"The total momentum changed along axis {int(np.nanargmax(change))}, for example at an "
                    "obstacle: the motion of the center of mass is no mere drift. Say along which axes it is "
                    "conserved, Dynamics(conserved=...), or let Simulation.measure take the frames."
                )
        elapsed, count = frame.time - self._first.time, len(self._samples)
        if count == 1:
            self._every = elapsed
        # XTC, TRR and DCD hold times in single precision: the first two and this one are rounded.
        single = all(float(np.float32(time)) == time for time in (self._first.time, frame.time))
        rounding = abs(frame.time) + count * (abs(self._first.time) + self._every)
        slack = 1e-6 * self._every + (2.0**-23 if single else 2.0**-52) * rounding
        if count and not (self._every > 0.0 and abs(elapsed - count * self._every) <= slack):
            raise InputError(
                f"A frame at time {frame.time:g} is not {self._every:g} after the one before; correlations "
                "in time need equal spacing: sim.sample(every=...)."
            )

    def means(self) -> tuple[np.ndarray, np.ndarray]:
        """Return times (l,) and four means over all origins of time, (l, 4).

        They are the means of the squared displacement, of its square, and of v(0).v(t). The fourth is the
        mean of the displacement times the average of the velocities at both ends.
        """
        rows = self._rows(1)
        return (
            np.array([lag * self._every for lag, _, _ in rows]),
            np.array([x.mean(axis=0) for _, x, _ in rows]).reshape(-1, 4),
        )

    def _found(self) -> DynamicsResult:
        rows = self._rows(FEW)
        if not rows:
            raise InputError(
                f"{len(self._samples)} frames are too few for a correlation in time; take {FEW + 1} or more."
            )
        d = self._first.dimension
        squares: list[Estimate] = []
        gaussian: list[Estimate] = []
        velocities: list[Estimate] = []
        diffusion: list[Estimate] = []
        scattering: list[tuple[np.ndarray, np.ndarray]] = []
        for _, x, f in rows:
            square, fourth, product, moved = x.T
            squares.append(blocking(square))
            gaussian.append(_non_gaussian(square, fourth, d))
            velocities.append(_mean(product / d))
            diffusion.append(_mean(moved / d))
            scattering.append(arrays([blocking(column) for column in f.T]))
        now, later = zip(*self._samples, strict=True)
        structure = arrays([blocking(column) for column in np.transpose(later)])
        square_now = _mean(np.array(now) / d)
        q = np.zeros(0) if self._waves is None else self._waves.lengths
        return DynamicsResult(
            d,
            np.array([lag * self._every for lag, _, _ in rows]),
            *arrays(squares),
            *arrays(gaussian),
            *arrays(velocities),
            *arrays(diffusion),
            square_now,
            q,
            *structure,
            np.array([means for means, _ in scattering]),
            np.array([errors for _, errors in scattering]),
            assumed_times="time" in self._first.lacks,
            **self._line()._asdict(),
        )

    def _line(self) -> Line:
        """Return the line through mean square displacements."""
        if not all(self._first.periodic):
            return NO_LINE
        octaves = []
        for k, level in enumerate(self._levels):
            for first, last in OCTAVES[-1:] if k else OCTAVES:
                if (ends := len(level.values.get(last, ()))) >= FEW:
                    lags = range(first, last + 1)
                    squares = np.array([np.array(level.values[lag][-ends:])[:, 0] for lag in lags])
                    octaves.append((np.array(lags), squares, self._every * 2**k))
        return line_of(octaves, len(self._chosen), self._first.dimension)

    def _rows(self, least: int) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """Return for every lag with enough origins: the lag [frames], sums (o, 4), and scattering (o, s)."""
        found = []
        for k, level in enumerate(self._levels):
            for lag, values in sorted(level.values.items()):
                if len(values) >= least:
                    f = np.array(level.scattered[lag]) if level.scattered[lag] else np.zeros((len(values), 0))
                    found.append((lag << k, np.array(values), f))
        return found


def _mean(values: np.ndarray) -> Estimate:
    """Return the mean with its error, which is unknown where a frame has no velocities."""
    return UNKNOWN if np.isnan(values).any() else blocking(values)


def _non_gaussian(square: np.ndarray, fourth: np.ndarray, d: int) -> Estimate:
    """Return ``d <r^4> / ((d + 2) <r^2>^2) - 1`` with a linearized error."""
    a, b = float(square.mean()), float(fourth.mean())
    if a == 0.0:
        return UNKNOWN
    scale = d / (d + 2.0) / a**2
    linear = blocking(scale * (fourth - 2.0 * b / a * (square - a)))
    return Estimate(scale * b - 1.0, linear.error, linear.n_eff, linear.tau, linear.blocks)


class _Level:
    """The latest frames at one spacing, and their correlations."""

    def __init__(self, n: int, d: int, waves: int):
        self.positions, self.velocities = np.zeros((KEPT, n, d)), np.zeros((KEPT, n, d))
        self.densities = np.zeros((KEPT, waves, 2))
        self.count = 0
        self.values: dict[int, list[np.ndarray]] = {}
        self.scattered: dict[int, list[np.ndarray]] = {}

    def take(
        self,
        r: np.ndarray,
        v: np.ndarray,
        rho: np.ndarray | None,
        level: int,
        chosen: np.ndarray,
        waves: Waves | None,
    ) -> None:
        """Correlate a frame with the kept ones, and keep it."""
        sums = np.zeros(4)
        for lag in range(KEPT // 2 if level else 1, min(KEPT, self.count + 1)):
            k = (self.count - lag) % KEPT
            _correlate(self.positions[k], self.velocities[k], r, v, chosen, sums)
            self.values.setdefault(lag, []).append(sums / len(chosen))
            scattered = self.scattered.setdefault(lag, [])
            if rho is not None and waves is not None:
                product = np.sum(rho * self.densities[k], axis=1)
                scattered.append(waves.average(product) / len(chosen))
        k = self.count % KEPT
        self.positions[k], self.velocities[k] = r, v
        if rho is not None:
            self.densities[k] = rho
        self.count += 1


@dataclass(frozen=True, eq=False, repr=False)
class DynamicsResult(Result):
    """Correlations in time of one particle: arrays by time, each with its standard error.

    Attributes
    ----------
    dimension : int
        d.
    times : (l,) array
        Times between two frames, evenly spaced up to 15 frames and then logarithmically [time].
    mean_square, mean_square_error : (l,) arrays
        Mean square displacement at each time [length^2].
    non_gaussian, non_gaussian_error : (l,) arrays
        ``d <r^4> / ((d + 2) <r^2>^2) - 1``.
    velocity_autocorrelation, velocity_autocorrelation_error : (l,) arrays
        ``<v(0).v(t)> / d`` [length^2 / time^2].
    running_diffusion, running_diffusion_error : (l,) arrays
        ``<v(0).(r(t) - r(0))> / d``: the exact integral of the velocity autocorrelation up to the time. Its
        plateau is the coefficient of self-diffusion [length^2 / time].
    velocity_square : Estimate
        The velocity autocorrelation at time zero [length^2 / time^2].
    wave_numbers : (s,) array
        Lengths q of the wave vectors [1 / length].
    structure_factor, structure_factor_error : (s,) arrays
        S(q), by wave number.
    scattering, scattering_error : (l, s) arrays
        F(q, t), by time and wave number.
    diffusion : Estimate
        The coefficient of self-diffusion D in this box [length^2 / time], from the slope of the mean square
        displacement; its mean is nan where no times are long enough.
    fit_first, fit_last : float
        The times between which the line ``2 d D t + fit_offset`` is fitted [time].
    fit_offset : float
        Where that line begins [length^2].
    assumed_times : bool
        Whether the frames have no times: those of this result count time steps, or frames.
    """

    dimension: int
    times: np.ndarray
    mean_square: np.ndarray
    mean_square_error: np.ndarray
    non_gaussian: np.ndarray
    non_gaussian_error: np.ndarray
    velocity_autocorrelation: np.ndarray
    velocity_autocorrelation_error: np.ndarray
    running_diffusion: np.ndarray
    running_diffusion_error: np.ndarray
    velocity_square: Estimate
    wave_numbers: np.ndarray
    structure_factor: np.ndarray
    structure_factor_error: np.ndarray
    scattering: np.ndarray
    scattering_error: np.ndarray
    diffusion: Estimate = UNKNOWN
    fit_first: float = math.nan
    fit_last: float = math.nan
    fit_offset: float = math.nan
    assumed_times: bool = False

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            (
                "last mean square displacement [length^2]",
                shown(self.mean_square, self.mean_square_error, -1),
            ),
            ("D [length^2 / time]", self._coefficient),
        ]
        return f"Displacements at {self._moments()}, the last {self.times[-1]:g}", rows

    def _draw_into(self, axes: Axes) -> None:
        curves.curve(axes, self.times, self.mean_square, self.mean_square_error, "measured")
        axes.set_xscale("log")
        if (self.mean_square > 0.0).all():
            axes.set_yscale("log")
            low, high = axes.get_ylim()
            # At first all fly freely.
            flights = self.dimension * self.velocity_square.mean * self.times**2
            axes.plot(self.times, flights, "--", color=WARM, linewidth=1.1, label="free flight, ⟨v²⟩ t²")
            if np.isfinite(self.fit_first):
                fitted = np.linspace(self.fit_first, self.fit_last)
                line = 2 * self.dimension * self.diffusion.mean * fitted + self.fit_offset
                label = f"2dDt + c, D = {curves.stated(self.diffusion.value_text)}"
                axes.plot(fitted, line, color=WARM, linewidth=2.4, label=label)
            axes.set_ylim(low, high)
        axes.set(xlabel="time t", ylabel="mean square displacement")

    @property
    def _coefficient(self) -> str:
        """D as text, with the times of its fit."""
        if math.isnan(self.fit_first):
            return "unknown: no times are on a straight line"
        return f"{self.diffusion.value_text} by a line from time {self.fit_first:g} to {self.fit_last:g}"

    def _moments(self) -> str:
        """Return how many times there are, and whether they were assumed."""
        if self.assumed_times:
            return f"{len(self.times)} assumed times (steps or frames, as the file holds none)"
        return f"{len(self.times)} times"

    def _columns(self) -> dict[str, Any]:
        names = ("mean_square", "non_gaussian", "velocity_autocorrelation", "running_diffusion")
        return {"time": self.times, **self._with_errors(*names)}

    def __str__(self) -> str:
        return (
            f"{self._moments()} from {self.times[0]:g} to {self.times[-1]:g}; there the mean square "
            f"displacement is {shown(self.mean_square, self.mean_square_error, -1)} length^2; D [length^2 / "
            f"time] is {self._coefficient}"
        )
