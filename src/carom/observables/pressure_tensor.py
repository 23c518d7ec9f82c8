"""The pressure tensor: momentum that particles carry and hand over, along every pair of axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.block import Block
from carom.errors import InputError
from carom.figures import curves
from carom.figures.palette import GRAY, INK, WARM
from carom.models.interfaces.observer import ObserverModel
from carom.models.motions.shear import Shear
from carom.observables.pressure import without_pressure
from carom.observables.statistics import Estimate, arrays, ratio, shown
from carom.results import Result
from carom.scene.velocities import conserved, degrees_of_freedom, peculiar
from carom.suggestions import corrected
from carom.texts import axis_name, counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.frame import Frame
    from carom.scene.scene import Scene


class MomentumObserver(ObserverModel):
    """What the events of a stretch add to the pressure tensor: an observer of events."""

    masses: np.ndarray  # of each particle, (n,) [mass]
    drift: np.ndarray
    """Velocity of the center of mass along axes on which the momentum is conserved, else 0 (d,)."""
    origin: float  # when the stretch began [time]
    virial: np.ndarray  # sum of ``r_a dp_b`` over events of pairs, (d, d) [mass length^2 / time]
    change: np.ndarray  # sum of the changes of ``m v_a v_b`` at events, (d, d) [energy]
    moment: np.ndarray  # sum of these changes times the time since the origin, (d, d) [energy time]

    def at_pair(self, event):
        """Add a collision."""
        later = event.time - self.origin
        mi, mj = self.masses[event.i], self.masses[event.j]
        for a in range(len(event.r)):
            for b in range(len(event.r)):
                u, w = self.drift[a], self.drift[b]
                gained = mi * (
                    (event.after[0, a] - u) * (event.after[0, b] - w)
                    - (event.before[0, a] - u) * (event.before[0, b] - w)
                ) + mj * (
                    (event.after[1, a] - u) * (event.after[1, b] - w)
                    - (event.before[1, a] - u) * (event.before[1, b] - w)
                )
                self.change[a, b] += gained
                self.moment[a, b] += gained * later
                self.virial[a, b] += event.r[a] * mj * (event.after[1, b] - event.before[1, b])

    def at_obstacle(self, event):
        """Add a contact with a wall or an obstacle."""
        later = event.time - self.origin
        for a in range(len(event.x)):
            for b in range(len(event.x)):
                u, w = self.drift[a], self.drift[b]
                gained = self.masses[event.i] * (
                    (event.after[a] - u) * (event.after[b] - w)
                    - (event.before[a] - u) * (event.before[b] - w)
                )
                self.change[a, b] += gained
                self.moment[a, b] += gained * later


@corrected()
@dataclass(frozen=True)
class PressureTensor:
    """The pressure tensor from events: an observable of a run, for :meth:`carom.Simulation.measure`.

    An observer of all events is compiled into the engine while it is measured. This does not affect the
    trajectory.

    Raises
    ------
    InputError
        From ``measure``, where the virial is not the pressure (pinned particles, a field), where particles
        are driven or follow rules, and where diameters grow.

    Notes
    -----
    ``P_ab V t = int sum m v_a v_b dt + sum r_a dp_b``, with the integral over the time t of the stretch and
    the sum over the collisions in it (J. H. Irving and J. G. Kirkwood, J. Chem. Phys. 18, 817 (1950),
    averaged over the box). Velocities are those about the center of mass. Its own motion takes part of the
    thermal one: along axes on which the momentum is conserved the kinetic part is multiplied by ``n / (n -
    1)``. All of it is then scaled so that its trace is ``n d kT``. The trace of P is so d times the pressure
    of :class:`carom.Pressure` in the same stretch, where no contact loses energy.

    In a sheared box (``carom.models.Shear``) velocities are those relative to the stream, which fall in
    flight; the integral is exact. The result then has a ``viscosity`` and ``normal_stresses``.

    With walls or obstacles it is the average over the whole box; :class:`carom.PressureProfile` has it by
    layers, in a field as well. P_aa is then the force on the walls of axis
    a times the free length of the axis, over the volume of the box.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.crystal(108, 0.3), seed=1)
    >>> p, tensor = sim.measure(carom.Pressure(), PressureTensor(), collisions_per_particle=200)
    >>> abs(tensor.pressure.mean / p.pressure.mean - 1.0) < 1e-9
    True
    """

    def begin(self, scene: Scene) -> None:
        """Raise InputError if events do not tell the pressure tensor of a ``scene``."""
        if reason := without_pressure(scene):
            raise InputError(reason)
        if isinstance(scene.motion, Shear):
            return  # its blocks have the sums, whatever else changes velocities
        check_events(scene, "PressureTensor")

    def sums(self, scene: Scene, frame: Frame) -> TensorSums | StreamTensor:
        """Return the sums of a stretch that begins with the ``frame``."""
        return StreamTensor(scene) if isinstance(scene.motion, Shear) else TensorSums(scene, frame)


def check_events(scene: Scene, what: str) -> None:
    """Raise InputError if velocities in a ``scene`` change otherwise than at events, which ``what`` needs."""
    if scene.drive is not None or getattr(scene.interaction, "decides", False):
        raise InputError(
            f"{what} needs velocities that change at events only; here a drive or rules change them, so "
            "measure carom.Pressure()."
        )


def drift_of(scene: Scene, velocities: np.ndarray) -> np.ndarray:
    """Return the velocity of the center of mass, (d,): 0 along axes on which no momentum is conserved."""
    moving = np.sum(scene.masses[:, None] * velocities, axis=0) / scene.masses.sum()
    return np.where(np.array(conserved(scene)), moving, 0.0)


def about_center(scene: Scene) -> np.ndarray:
    """Return the factors of the kinetic part, (d, d): ``n / (n - 1)`` on axes whose momentum is conserved."""
    factor = np.sqrt([scene.n / (scene.n - 1.0) if still else 1.0 for still in conserved(scene)])
    return np.outer(factor, factor)


def averaged(parts: np.ndarray, durations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rates of sums in blocks, (blocks, ...), and their standard errors, (...) each."""
    values, errors = arrays([ratio(column, durations) for column in parts.reshape(len(parts), -1).T])
    return values.reshape(parts.shape[1:]), errors.reshape(parts.shape[1:])


class TensorSums:
    """The pressure tensor of each block from ``frame`` on; ``observer`` sees the events."""

    def __init__(self, scene: Scene, frame: Frame):
        self._scene, self._origin, self._time = scene, frame.time, frame.time
        d, masses = scene.dimension, scene.masses
        drift = drift_of(scene, frame.velocities)
        v = peculiar(scene, frame.velocities)
        self._kinetic = np.einsum("i,ia,ib->ab", masses, v, v)
        empty = np.zeros((d, d))
        self.observer = MomentumObserver(
            masses, drift, float(frame.time), empty, np.zeros((d, d)), np.zeros((d, d))
        )
        self._before = (empty.copy(),) * 3
        self._blocks: list[tuple[float, np.ndarray, np.ndarray]] = []

    def add(self, block: Block) -> None:
        """Add a block, after which the observer holds these sums."""
        seen = self.observer
        virial, change, moment = (part.copy() for part in (seen.virial, seen.change, seen.moment))
        before, self._before = self._before, (virial, change, moment)
        self._time += block.duration
        elapsed = self._time - self._origin
        flown = (self._kinetic + before[1]) * block.duration
        flown += (change - before[1]) * elapsed - (moment - before[2])
        if block.duration > 0.0:
            self._blocks.append((block.duration, flown, virial - before[0]))

    def result(self) -> PressureTensorResult:
        """Return the tensor with its errors."""
        if not self._blocks:
            raise InputError("No block of positive duration was given; run before measuring the pressure.")
        scene, d, n = self._scene, self._scene.dimension, self._scene.n
        durations = np.array([each[0] for each in self._blocks])
        flown, virial = (np.array([each[k] for each in self._blocks]) for k in (1, 2))
        carried = flown * about_center(scene)
        heat = n * d * np.trace(flown, axis1=1, axis2=2) / degrees_of_freedom(scene)
        carried *= (heat / np.trace(carried, axis1=1, axis2=2))[:, None, None]
        virial = 0.5 * (virial + np.swapaxes(virial, 1, 2))
        return _averaged(scene, durations, carried, virial)


class StreamTensor:
    """The pressure tensor of each block of a sheared box, whose blocks hold the sums."""

    observer = None

    def __init__(self, scene: Scene):
        self._scene = scene
        self._blocks: list[Block] = []

    def add(self, block: Block) -> None:
        """Add a block."""
        if block.duration > 0.0:
            self._blocks.append(block)

    def result(self) -> PressureTensorResult:
        """Return the tensor with its errors."""
        if not self._blocks:
            raise InputError("No block of positive duration was given; run before measuring the pressure.")
        durations = np.array([block.duration for block in self._blocks])
        parts = [block.momentum_flux for block in self._blocks if block.momentum_flux is not None]
        carried, handed_over = (np.array(each) for each in zip(*parts, strict=True))
        scene, motion = self._scene, self._scene.motion
        assert isinstance(motion, Shear)
        rate = 0.0 if motion.period else motion.rate
        return _averaged(scene, durations, carried * about_center(scene), handed_over, rate)


def _averaged(
    scene: Scene, durations: np.ndarray, carried: np.ndarray, handed_over: np.ndarray, rate: float = 0.0
) -> PressureTensorResult:
    """Return the tensor from its parts in each block, (blocks, d, d) [energy time]."""
    n, d = scene.n, scene.dimension
    whole = carried + handed_over
    pressure = ratio(np.trace(whole, axis1=1, axis2=2) / (d * scene.volume), durations)
    viscosity: Estimate | None = None
    stresses: tuple[Estimate, ...] = ()
    if rate:
        viscosity = ratio(whole[:, 1, 0] / scene.volume, durations).scaled(-1.0 / rate)
        differences = [whole[:, a, a] - whole[:, a + 1, a + 1] for a in range(min(d, 3) - 1)]
        stresses = tuple(ratio(each / scene.volume, durations) for each in differences)
    return PressureTensorResult(
        *averaged(whole / scene.volume, durations), *averaged(carried / scene.volume, durations),
        *averaged(handed_over / scene.volume, durations), pressure, n, d, len(durations), viscosity, stresses,
    )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class PressureTensorResult(Result):
    """The pressure tensor of a run.

    Attributes
    ----------
    tensor, error : (d, d) arrays
        P_ab and its standard error [energy / length^d].
    kinetic, kinetic_error : (d, d) arrays
        The part that particles carry [energy / length^d].
    collisional, collisional_error : (d, d) arrays
        The part that they hand over at collisions [energy / length^d].
    pressure : Estimate
        A d-th of the trace [energy / length^d].
    n, dimension, blocks : int
        Number of particles, of dimensions, and of blocks.
    viscosity : Estimate or None
        Of a box sheared at a constant rate: ``-P_10`` over it [energy time / length^d].
    normal_stresses : tuple of Estimate
        Of such a box: ``P_00 - P_11``, and ``P_11 - P_22`` in three dimensions [energy / length^d].
    """

    tensor: np.ndarray
    error: np.ndarray
    kinetic: np.ndarray
    kinetic_error: np.ndarray
    collisional: np.ndarray
    collisional_error: np.ndarray
    pressure: Estimate
    n: int
    dimension: int
    blocks: int
    viscosity: Estimate | None = None
    normal_stresses: tuple[Estimate, ...] = ()

    def _pairs(self) -> list[tuple[int, int]]:
        """Return the diagonal, and then each pair of axes once."""
        d = self.dimension
        return [(a, a) for a in range(d)] + [(a, b) for a in range(d) for b in range(a + 1, d)]

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [(f"P_{a}{b}", shown(self.tensor[a], self.error[a], b)) for a, b in self._pairs()]
        return f"Pressure tensor of {counted(self.n, 'particle')} [energy / length^{self.dimension}]", rows

    def _draw_into(self, axes: Axes) -> None:
        pairs = self._pairs()
        colors = [INK if a == b else WARM for a, b in pairs]
        names = [axis_name(a) + axis_name(b) for a, b in pairs]
        values = ((float(self.tensor[each]), float(self.error[each])) for each in pairs)
        curves.points(axes, ((n, *v, c) for n, v, c in zip(names, values, colors, strict=True)))
        axes.axhline(self.pressure.mean, color=GRAY, linestyle="--", linewidth=0.9)
        axes.set(xlabel="axes a, b", ylabel="pressure tensor $P_{ab}$")

    def _columns(self) -> dict[str, Any]:
        axes = np.array(self._pairs()).T
        found: dict[str, Any] = {"a": axes[0], "b": axes[1]}
        for name in ("tensor", "error", "kinetic", "kinetic_error", "collisional", "collisional_error"):
            found[name] = getattr(self, name)[axes[0], axes[1]]
        return found

    def __str__(self) -> str:
        lines = [f"P = {self.pressure.value_text} energy / length^{self.dimension}"]
        for name, pairs in (
            ("diagonal", self._pairs()[: self.dimension]),
            ("off it", self._pairs()[self.dimension :]),
        ):
            if pairs:
                lines.append(
                    f"{name}: " + ", ".join(shown(self.tensor[a], self.error[a], b) for a, b in pairs)
                )
        if self.viscosity is not None:
            lines[0] += f", viscosity = {self.viscosity.value_text}"
        return "\n".join(lines)

    def __float__(self) -> float:
        """Return the mean of the pressure."""
        return self.pressure.mean
