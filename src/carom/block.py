"""Sums over the realized events of one stretch of a run."""

from __future__ import annotations

from typing import Any, NamedTuple

from carom.table import in_html


class Sizes(NamedTuple):
    """Averages over the time of a stretch in which diameters grow."""

    packing_fraction: float
    cube: float  # the largest diameter to the power d [length^d]
    equal: bool  # whether all diameters are the same


class EnergySample(NamedTuple):
    """Potential energy and temperature [energy], at a time or as means over a stretch."""

    potential: float  # of all pairs on steps, and of all particles in a field
    kT: float


class MomentumFlux(NamedTuple):
    """Momentum along each axis that passes through a box along each axis, times its edge, over a stretch."""

    carried: Any  # (d, d), integral of ``sum m u_a u_b``, u about the center of mass, over time [energy time]
    handed_over: Any  # (d, d), ``sum r_a dp_b`` over collisions [energy time]


class VolumeSums(NamedTuple):
    """What adds up over a stretch in which a barostat changes the volume V."""

    volume: float  # integral of V over time [length^d time]
    inverse: float  # integral of 1 / V over time [time / length^d]
    virial: float  # sum of ``r_ij . dp_ij / V`` over collisions [mass length^2 / (time length^d)]


class Block(NamedTuple):
    """Sums over the collisions of one stretch of time.

    Attributes
    ----------
    duration : float
        Length of the stretch [time].
    collisions : int
        Pair collisions in the stretch.
    virial : float
        Sum of ``r_ij . dp_ij`` over these collisions [mass length^2 / time]. A collision of equal masses adds
        ``m sigma |u_n|``. Divided by a time the sum is an energy.
    impulses : tuple of float
        Momentum that each wall and obstacle took up [mass length / time], in the order of their numbers.
    momentum_changes : tuple of float
        Change of the weighted momentum of the particles that belongs to each wall and obstacle [mass length
        / time] (see ``carom.observables.analysis.momentum_balance``). Empty if it was not measured.
    surface_changes : tuple of float
        Changes of two sums for each obstacle that no such momentum belongs to [mass length / time] (see
        ``carom.observables.analysis.surface_changes``). Empty if there is none, or if they were not measured.
    works : tuple of float
        Energy that each wall and obstacle gave to particles [energy]. Known of the stretches of
        :func:`carom.run`, else empty.
    energy : EnergySample or None
        Means over the stretch, where there is a potential energy; None if it was not measured.
    kT_time : float or None
        Integral of kT over the stretch [energy time], where contacts change it (restitution, growth, steps).
    sizes : Sizes or None
        Averages over the stretch, if diameters grow. Not known of sums since the start.
    momentum_flux : MomentumFlux or None
        What makes the pressure tensor of a sheared box; None elsewhere.
    volumes : VolumeSums or None
        What makes the mean volume and the pressure where a barostat changes the volume; None elsewhere.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(64, 0.3, 2))
    >>> block = sim.run(collisions=500)
    >>> block.collisions, block.duration == sim.time
    (500, True)
    """

    duration: float
    collisions: int
    virial: float
    impulses: tuple[float, ...] = ()
    momentum_changes: tuple[float, ...] = ()
    kT_time: float | None = None
    sizes: Sizes | None = None
    surface_changes: tuple[float, ...] = ()
    works: tuple[float, ...] = ()
    energy: EnergySample | None = None
    momentum_flux: MomentumFlux | None = None
    volumes: VolumeSums | None = None

    def _repr_html_(self) -> str:
        rows = [("duration", f"{self.duration:.6g}"), ("collisions", f"{self.collisions}")]
        rows.append(("virial", f"{self.virial:.6g}"))
        if self.kT is not None:
            rows.append(("kT", f"{self.kT:.6g}"))
        if self.impulses:
            rows.append(("impulses", ", ".join(f"{impulse:.6g}" for impulse in self.impulses)))
        return in_html("Block", rows)

    @property
    def kT(self) -> float | None:
        """Average of kT over the stretch [energy], where contacts change it."""
        return None if self.kT_time is None or not self.duration else self.kT_time / self.duration


def weighted_sum(a: Any, b: Any, x: float, y: float) -> Any:
    """Return ``x a + y b``, number by number; None where one of them is not known."""
    if a is None or b is None:
        return None
    if isinstance(a, tuple):
        each = (weighted_sum(*pair, x, y) for pair in zip(a, b, strict=True))
        return type(a)(*each) if hasattr(a, "_fields") else tuple(each)
    return a and b if isinstance(a, bool) else x * a + y * b
