"""The pressure tensor by layers along an axis: momentum that particles carry and hand over in each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.block import Block
from carom.errors import InputError
from carom.figures import curves
from carom.figures.style import shade
from carom.models.interfaces.observer import ObserverModel
from carom.models.motions.free_flight import FreeFlight
from carom.models.motions.gravity import Gravity
from carom.observables.pressure_tensor import about_center, averaged, check_events, drift_of
from carom.observables.statistics import shown, unwarned
from carom.results import Binned
from carom.suggestions import corrected
from carom.texts import axis_name, counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.frame import Frame
    from carom.scene.scene import Scene


class LayerFlux(ObserverModel):
    """What flights and events of a stretch add to the pressure tensor of layers: an observer of events."""

    axis: int  # the axis along which layers follow each other
    edge: float  # edge of the box along it [length]
    wraps: bool  # whether the box is periodic along it
    g: np.ndarray  # acceleration of all particles, (d,) [length / time^2]
    masses: np.ndarray  # of each particle, (n,) [mass]
    drift: np.ndarray
    """Velocity of the center of mass along axes on which the momentum is conserved, else 0 (d,)."""
    x: np.ndarray  # where along the axis each particle began its flight, (n,) [length]
    v: np.ndarray  # its velocity then, (n, d) [length / time]
    since: np.ndarray  # when this was, (n,) [time]
    stays: np.ndarray  # time that particles spent in each layer, (b,) [time]
    carried: np.ndarray
    """Integral of the sum of ``m v_a v_b`` in each layer over time, (b, d, d) [energy time]."""
    virial: np.ndarray
    """Sum of ``r_a dp_b`` over events of pairs, by the part of r in each layer, (b, d, d) [energy time]."""
    pushed: np.ndarray
    """The same over contacts with walls and obstacles, with r from their surface to the center."""

    def at_pair(self, event):
        """Add a collision."""
        flux, axis = self, self.axis
        for which in range(2):
            i = event.i if which == 0 else event.j
            fly(flux, i, event.time)
            set_out(flux, i, event.x[which, axis], event.after[which], event.time)
        impulse = flux.masses[event.j], event.before[1], event.after[1]
        hand_over(flux, flux.virial, event.x[0, axis], (1.0, event.r), impulse)

    def at_obstacle(self, event):
        """Add a contact with a wall or an obstacle."""
        flux, axis = self, self.axis
        fly(flux, event.i, event.time)
        set_out(flux, event.i, event.x[axis], event.after, event.time)
        impulse = flux.masses[event.i], event.before, event.after
        surface = event.x[axis] - event.radius * event.normal[axis]
        hand_over(flux, flux.pushed, surface, (event.radius, event.normal), impulse)


def layer(flux, k):
    """Return the number of a layer that is counted through all images of the box."""
    bins = len(flux.stays)
    return k % bins if flux.wraps else min(max(k, 0), bins - 1)


def is_last(flux, k, way):
    """Return whether nothing follows layer k in the direction ``way``: there is a wall."""
    return not flux.wraps and ((way > 0.0 and k >= len(flux.stays) - 1) or (way < 0.0 and k <= 0))


def stay(flux, i, k, start, end, share):
    """Add that particle i was in layer k for a ``share`` of the time from ``start`` to ``end`` of its flight.

    With the velocity u in the middle it carries ``(u_a u_b + g_a g_b h^2 / 12) h`` in a time h.
    """
    middle, h = 0.5 * (start + end), end - start
    at = layer(flux, k)
    flux.stays[at] += share * h
    for a in range(len(flux.g)):
        u = flux.v[i, a] - flux.drift[a] + flux.g[a] * middle
        for b in range(len(flux.g)):
            w = flux.v[i, b] - flux.drift[b] + flux.g[b] * middle
            square = u * w + flux.g[a] * flux.g[b] * h * h / 12.0
            flux.carried[at, a, b] += share * flux.masses[i] * square * h


def time_to(c, v, g, way):
    """Return when a flight gets as far as c in the direction ``way``; infinity if it turns before."""
    if g == 0.0:
        return c / v
    root = v * v + 2.0 * g * c
    if root < 0.0:
        return math.inf
    w = way * math.sqrt(root)
    if v * way < 0.0:  # after it has turned round
        return (w - v) / g
    return 2.0 * c / (v + w) if v + w != 0.0 else 0.0


def fly(flux, i, now):
    """Add the flight of particle i up to the time ``now``, layer by layer."""
    bins = len(flux.stays)
    width = flux.edge / bins
    x, v, g = flux.x[i], flux.v[i, flux.axis], flux.g[flux.axis]
    whole = max(now - flux.since[i], 0.0)
    k = np.int64(math.floor(x / width))
    passed = 0.0
    if flux.wraps and abs(v) * whole >= flux.edge:  # whole boxes, each of which has every layer once
        turn = flux.edge / abs(v)
        passed = min(math.floor(whole / turn) * turn, whole)
        for each in range(bins):
            stay(flux, i, each, 0.0, passed, 1.0 / bins)
    offset = passed
    turning = -v / g if v * g < 0.0 else 0.0
    for leg in range(2):
        end = min(turning, whole) if leg == 0 else whole
        # Up to the turning point it moves as its velocity says, and then as the field does.
        pull = v if (leg == 0 or g == 0.0) else g
        way = 1.0 if pull > 0.0 else -1.0
        while passed < end and pull != 0.0 and not is_last(flux, k, way):
            ahead = (k + 1) * width if way > 0.0 else k * width
            t = offset + time_to(ahead - x, v, g, way)
            if not t < end:
                break
            t = max(t, passed)
            stay(flux, i, k, passed, t, 1.0)
            passed = t
            k += np.int64(way)
        if passed < end:
            stay(flux, i, k, passed, end, 1.0)
            passed = end
    flux.since[i] += whole


def set_out(flux, i, x, v, now):
    """Let a flight of particle i begin at the coordinate x along the axis with velocity v (d,)."""
    flux.x[i], flux.since[i] = x, now
    for a in range(len(v)):
        flux.v[i, a] = v[a]


def add(flux, virial, k, share, way, impulse):
    """Add a ``share`` of ``r_a dp_b`` to layer k."""
    at, (scale, r), (mass, before, after) = layer(flux, k), way, impulse
    for a in range(len(r)):
        for b in range(len(r)):
            virial[at, a, b] += share * (scale * r[a]) * (mass * (after[b] - before[b]))


def hand_over(flux, virial, x, along, impulse):
    """Add ``r_a dp_b`` to the layers on the way r, which begins at the coordinate x along the axis.

    The way is a number times a vector (d,), the ``impulse`` a mass, and both velocities (d,).
    """
    width, (scale, r) = flux.edge / len(flux.stays), along
    length = scale * r[flux.axis]
    way = 1.0 if length > 0.0 else -1.0
    k = np.int64(math.floor(x / width))
    passed = 0.0
    while length != 0.0 and not is_last(flux, k, way):
        ahead = (k + 1) * width if way > 0.0 else k * width
        part = (ahead - x) / length
        if not part < 1.0:
            break
        part = max(part, passed)
        add(flux, virial, k, part - passed, along, impulse)
        passed = part
        k += np.int64(way)
    add(flux, virial, k, 1.0 - passed, along, impulse)


def catch_up(flux, now):
    """Add the flights of all particles up to the time ``now``, from where they go on."""
    for i in range(len(flux.since)):
        passed = max(now - flux.since[i], 0.0)
        fly(flux, i, now)
        g = flux.g[flux.axis]
        x = flux.x[i] + (flux.v[i, flux.axis] + 0.5 * g * passed) * passed
        flux.x[i] = x % flux.edge if flux.wraps else x
        for a in range(len(flux.g)):
            flux.v[i, a] += flux.g[a] * passed


@cache
def _compiled() -> Any:
    """Return :func:`catch_up` as compiled code."""
    from carom.compiling.entry import entry

    return entry(catch_up)


@corrected()
@dataclass(frozen=True)
class PressureProfile:
    """The pressure tensor by layers along an axis: an observable of a run, for ``measure``.

    :class:`carom.PressureTensor` is that of the whole box. Fields are allowed here. An observer of all events
    is compiled into the engine while it is measured (:meth:`carom.Simulation.measure`). This does not affect
    the trajectory.

    Parameters
    ----------
    axis : int or str
        Number of the axis, from 0, or x, y or z.
    bins : int
        Layers of equal width from 0 to the edge of the box.

    Raises
    ------
    InputError
        From ``measure``: if there is no such axis; where particles are pinned, driven, follow rules, or do
        not fly straight or in :class:`carom.models.Gravity`; where a field pulls along a periodic axis; and
        where diameters grow.

    Notes
    -----
    In a layer of volume V, ``P_ab V t = int sum m v_a v_b dt + sum s r_a dp_b``. The integral is that over
    the times at which particles are in the layer, exact also in a field. The sum is that over collisions; s
    is the part of the line r between the two centers that lies in the layer (J. H. Irving and J. G. Kirkwood,
    J. Chem. Phys. 18, 817 (1950)). At a contact with a wall or an obstacle, r goes from its surface to the
    center: momentum reaches a large particle across the layers where small ones fly. Velocities are those
    about the center of mass along axes on which the momentum is conserved, and the kinetic part is multiplied
    by ``n / (n - 1)`` there.

    The normal pressure, P_aa for the axis a of the layers, is the momentum that passes through a plane,
    averaged over the planes of the layer. In equilibrium it is the same in all layers, and the pressure on
    the walls. Two layers differ by what the momentum in between changed, which does not grow with the run. In
    a field g along the axis its slope is ``rho m g``, and an obstacle changes it by the force on it.

    The mean over the layers, without the part of walls and obstacles, is the tensor of
    :class:`carom.PressureTensor` in the same stretch. The kinetic part of that is scaled so that its trace
    agrees with kT, if momentum is conserved along some axes, and not along others: both then differ by a
    fluctuation of the order of ``1 / n``.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(64, 0.3, 2, walls="y", seed=1), seed=1)
    >>> found = sim.measure(PressureProfile(axis=1, bins=8), collisions_per_particle=500)
    >>> found.tensor.shape, bool(np.ptp(found.normal) < 0.02 * found.normal.mean())
    ((8, 2, 2), True)
    """

    axis: Any = 0  # a number, or x, y or z
    bins: int = 64

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", checks.axis(self.axis))
        checks.integer(self.bins, "bins", low=1)

    def begin(self, scene: Scene) -> None:
        """Raise InputError if events do not tell the pressure tensor by layers of a ``scene``."""
        if self.axis >= scene.dimension:
            raise InputError(f"axis is {self.axis}, and the scene has axes 0 to {scene.dimension - 1}.")
        if not isinstance(scene.motion, FreeFlight | Gravity):
            raise InputError(
                "PressureProfile needs particles that fly straight or in a uniform field, found the motion "
                f"{type(scene.motion).__name__}."
            )
        if scene.pinned is not None:
            raise InputError("PressureProfile needs particles that move freely; leave out pinned.")
        check_events(scene, "PressureProfile")
        pulled = [p for p, g in zip(scene.periodic, _field(scene), strict=True) if g]
        if any(pulled):
            raise InputError(
                "PressureProfile needs walls along the axis of a field: in a periodic box all particles fall "
                "for ever."
            )

    def sums(self, scene: Scene, frame: Frame) -> LayerSums:
        """Return the sums of a stretch that begins with the ``frame``."""
        return LayerSums(self, scene, frame)


class LayerSums:
    """The pressure tensor of each layer in each block from ``frame`` on; ``observer`` sees the events."""

    def __init__(self, asked: PressureProfile, scene: Scene, frame: Frame):
        self._asked, self._scene, self._time = asked, scene, float(frame.time)
        n, d, axis, bins = scene.n, scene.dimension, asked.axis, asked.bins
        self.observer = LayerFlux(
            axis=axis,
            edge=float(scene.box[axis]),
            wraps=bool(scene.periodic[axis]),
            g=np.array(_field(scene), np.float64),
            masses=scene.masses,
            drift=drift_of(scene, frame.velocities),
            x=frame.positions[:, axis].copy(),
            v=frame.velocities.copy(),
            since=np.full(n, self._time),
            stays=np.zeros(bins),
            carried=np.zeros((bins, d, d)),
            virial=np.zeros((bins, d, d)),
            pushed=np.zeros((bins, d, d)),
        )
        self._durations: list[float] = []
        self._before = _sums(self.observer)
        self._blocks: list[tuple[np.ndarray, ...]] = []

    def add(self, block: Block) -> None:
        """Add a block, after which the observer holds these sums."""
        self._time += block.duration
        _compiled()(self.observer, self._time)
        sums = _sums(self.observer)
        if block.duration > 0.0:
            self._durations.append(block.duration)
            self._blocks.append(tuple(now - then for now, then in zip(sums, self._before, strict=True)))
        self._before = sums

    def result(self) -> PressureProfileResult:
        """Return the profile with its errors."""
        if not self._blocks:
            raise InputError("No block of positive duration was given; run before measuring the pressure.")
        scene, d, bins = self._scene, self._scene.dimension, self._asked.bins
        volume, durations = scene.volume / bins, np.array(self._durations)
        stays, carried, virial, pushed = (np.array(each) for each in zip(*self._blocks, strict=True))
        carried *= about_center(scene)
        virial, pushed = (0.5 * (each + np.swapaxes(each, 2, 3)) for each in (virial, pushed))
        with unwarned():  # few blocks have wide error bars
            parts = carried + virial + pushed, carried, virial, pushed, stays
            tensor, kinetic, collisional, walls, density = (
                averaged(each / volume, durations) for each in parts
            )
        edges = np.linspace(0.0, scene.box[self._asked.axis], bins + 1)
        return PressureProfileResult(
            edges,
            *tensor,
            *kinetic,
            *collisional,
            *walls,
            *density,
            self._asked.axis,
            scene.n,
            d,
            len(durations),
        )


def _sums(seen: LayerFlux) -> tuple[np.ndarray, ...]:
    """Return copies of the sums so far."""
    return tuple(each.copy() for each in (seen.stays, seen.carried, seen.virial, seen.pushed))


def _field(scene: Scene) -> tuple[float, ...]:
    """Return the acceleration of all particles, (d,) [length / time^2]."""
    return scene.motion.g if isinstance(scene.motion, Gravity) else (0.0,) * scene.dimension


@dataclass(frozen=True, eq=False, repr=False)
class PressureProfileResult(Binned):
    """The pressure tensor in layers.

    Attributes
    ----------
    edges : (b + 1,) array
        Edges of the layers [length].
    tensor, error : (b, d, d) arrays
        P_ab in each layer and its standard error [energy / length^d].
    kinetic, kinetic_error : (b, d, d) arrays
        The part that particles carry [energy / length^d].
    collisional, collisional_error : (b, d, d) arrays
        The part that they hand over at collisions [energy / length^d].
    walls, walls_error : (b, d, d) arrays
        The part that walls and obstacles hand over [energy / length^d].
    density, density_error : (b,) arrays
        Number density of centers, from the times that they spend in the layer [1 / length^d].
    axis : int
        Number of the axis.
    n, dimension, blocks : int
        Number of particles, of dimensions, and of blocks.
    """

    edges: np.ndarray
    tensor: np.ndarray
    error: np.ndarray
    kinetic: np.ndarray
    kinetic_error: np.ndarray
    collisional: np.ndarray
    collisional_error: np.ndarray
    walls: np.ndarray
    walls_error: np.ndarray
    density: np.ndarray
    density_error: np.ndarray
    axis: int
    n: int
    dimension: int
    blocks: int

    @property
    def normal(self) -> np.ndarray:
        """The normal pressure, P_aa for the axis a of the layers, (b,) [energy / length^d]."""
        return self.tensor[:, self.axis, self.axis]

    @property
    def normal_error(self) -> np.ndarray:
        """Its standard error, (b,) [energy / length^d]."""
        return self.error[:, self.axis, self.axis]

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("layers", str(self.normal.size)),
            ("lowest normal pressure", shown(self.normal, self.normal_error, int(np.argmin(self.normal)))),
            ("highest", shown(self.normal, self.normal_error, int(np.argmax(self.normal)))),
        ]
        title = f"Pressure tensor along axis {self.axis} [energy / length^{self.dimension}]"
        return f"{title}, {counted(self.blocks, 'block')}", rows

    def _draw_into(self, axes: Axes) -> None:
        across = [a for a in range(self.dimension) if a != self.axis]
        for k, a in enumerate((self.axis, *across)):
            label = f"$P_{{{2 * axis_name(a)}}}$"
            curves.curve(axes, self.middle, self.tensor[:, a, a], self.error[:, a, a], label, shade(k))
        axes.set(xlabel=axis_name(self.axis), ylabel="pressure tensor $P_{aa}$")

    def _columns(self) -> dict[str, Any]:
        found = self._bins() | self._with_errors("density")
        for name, values in (("", self.tensor), ("_error", self.error)):
            for a in range(self.dimension):
                for b in range(a, self.dimension):
                    found[f"P_{a}{b}{name}"] = values[:, a, b]
        return found
