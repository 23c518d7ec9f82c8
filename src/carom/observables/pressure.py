"""The pressure from collisions: virial, collision rate, and the contact value that they imply."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from carom import theory
from carom.block import Block
from carom.errors import InputError, warn
from carom.figures import curves
from carom.figures.palette import INK, PALE, THEORIES
from carom.figures.style import state
from carom.models.motions.shear import Shear
from carom.observables.analysis.drifting_kT import Course
from carom.observables.of_blocks import OneNumber
from carom.observables.statistics import UNKNOWN, Estimate, unwarned
from carom.scene.fields import is_elastic, is_simple, standing
from carom.scene.velocities import kept_by_motion
from carom.suggestions import corrected
from carom.texts import counted, html, label as label_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.scene.scene import Scene

# With fewer collisions than this, the error of the virial is uncertain by a fifth, and blocks are mostly
# empty.
FEW_COLLISIONS = 16


# More blocks than this are drawn as means of groups, so that points do not merge.
MOST_POINTS = 64

# Edge of a box [diameters] and fraction of the freezing density: images bias Z in smaller, denser boxes.
SMALL, DENSE = 6.0, 0.7


@corrected()
@dataclass(frozen=True)
class Pressure:
    """The pressure from collisions: an observable of a run, for :meth:`carom.Simulation.measure`.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.crystal(108, 0.3), seed=1)
    >>> block = sim.run(collisions_per_particle=100)
    >>> 2.0 < sim.measure(Pressure(), collisions_per_particle=1000).contact_value.mean < 3.0
    True
    """

    def begin(self, scene: Scene) -> None:
        """Raise InputError if the virial is not the pressure of a ``scene``; the text says why."""
        if reason := without_pressure(scene):
            raise InputError(reason)

    def of_scene(self, blocks: Sequence[Block], scene: Scene, *, kT: float) -> PressureResult:
        """Return the pressure of a scene, from blocks of its run at the temperature ``kT``: :meth:`estimate`.

        Raises
        ------
        InputError
            If the virial is not the pressure of such a scene; the text says why.
        """
        self.begin(scene)
        return self.estimate(
            blocks,
            n=scene.n,
            dimension=scene.dimension,
            volume=scene.volume,
            diameter=scene.diameter,
            kT=kT,
            mass=scene.mass,
            packing_fraction=scene.packing_fraction,
            simple=is_simple(scene),
            exchanges=_keeps_its_temperature(scene),
            heated=_is_heated(scene),
            source=_source(scene),
        )

    @staticmethod
    def estimate(
        blocks: Sequence[Block],
        *,
        n: int,
        dimension: int,
        volume: float,
        diameter: float,
        kT: float,
        mass: float = 1.0,
        packing_fraction: float | None = None,
        simple: bool = True,
        exchanges: bool = False,
        heated: bool = False,
        source: str = Course.source,
    ) -> PressureResult:
        """Pressure of n particles in a periodic box.

        Parameters
        ----------
        blocks : sequence of Block
            Sums over the collisions of successive stretches of the run.
        n, dimension : int
            Number of particles, and of dimensions.
        volume : float
            Volume of the box [length^d].
        diameter : float
            Diameter of every particle, in a mixture the largest [length].
        kT : float
            Twice the kinetic energy about the motion of the center of mass over the degrees of freedom,
            d (n - 1) in a periodic box [energy]. Not used for blocks that hold their own kT.
        mass : float
            Mass of every particle, in a mixture any mass [mass].
        packing_fraction : float, optional
            Packing fraction of a mixture; by default it follows from the diameter.
        simple : bool
            Whether all particles are equal and elastic, and alone in a periodic box. Otherwise contact
            values and Z from the collision rate are left out.
        exchanges : bool
            Whether kT changes in exchange with a potential energy (``carom.models``), and not
            because contacts lose energy.
        heated : bool
            Whether a drive or a surface makes up for what is lost, so that kT fluctuates.
        source : str
            What changes the energy otherwise, with its verb, for the note.

        Returns
        -------
        PressureResult
            Z, the pressure and what follows from them.

        Raises
        ------
        InputError
            If there is no block of positive duration, or a parameter is not positive and finite.

        Warns
        -----
        CaromWarning
            If fewer than 16 collisions were seen, or too few independent blocks. Without any collision the
            errors are ``inf``: nothing is known.

        Notes
        -----
        ``Z = 1 + W / (d n kT t)`` with the virial W, the sum of ``r_ij . dp_ij`` over the collisions in the
        time t. With this kT it is the canonical Z of n particles; with ``2 K / (d n)`` instead it would be
        wrong by 1 / n. One particle has Z = 1 exactly. The formula does not depend on diameters or masses,
        and so holds for mixtures as well. Between the walls of a box it is the average over the axes of
        ``force on a wall times free length of the axis / (n kT)``; for the force itself see
        :class:`~carom.WallPressure`.

        If contacts lose energy, or diameters grow, kT changes: its integral over each block replaces ``kT
        t``. While a gas cools, blocks are weighted by their collisions, and Z is that of inelastic spheres at
        constant density. While diameters grow, Z is ``<P> V / (n <kT>)`` with averages over time, and the
        packing fraction is averaged in the same way. The contact value is the average of g(sigma+) with the
        weight kT times packing fraction of each block. Errors exclude the trend along the stretch, a cubic in
        time. Where kT fluctuates, that of P holds its scatter. In a gas that only cools P is Z times the mean
        kT, and its error that of Z.
        """
        for name, value in (("volume", volume), ("diameter", diameter), ("kT", kT), ("mass", mass)):
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f"{name} is {value!r}; it must be positive and finite.")
        if n < 1 or dimension < 1:
            raise InputError(f"n is {n} and dimension is {dimension}; both must be at least 1.")
        if packing_fraction is None:
            packing_fraction = n * theory.ball_volume(dimension, diameter) / volume
        kept = [block for block in blocks if block.duration > 0.0]
        if not kept:
            raise InputError("No block of positive duration was given; run before measuring the pressure.")
        course = Course.of(kept, kT, packing_fraction, diameter**dimension, exchanges, source)
        durations, kT, simple = course.durations, course.kT, simple and course.equal
        if n == 1:
            z, rate = Estimate.exact(1.0), Estimate.exact(0.0)
            return PressureResult(
                z, rate, Estimate.exact(diameter**dimension / volume), UNKNOWN, z, n, dimension,
                packing_fraction, tuple(durations.tolist()), (1.0,) * len(kept), simple, kT,
                (course.pressure(np.zeros(len(kept))) if course.changes else z).scaled(kT / volume),
                course.note,
            )  # fmt: skip
        virials = np.array([block.virial for block in kept])
        collisions = np.array([float(block.collisions) for block in kept])
        scale = dimension * n * kT
        with unwarned():  # The virial warns; counts of the same series would only repeat the warning.
            count = _of_events(course.average(collisions, durations), collisions)
            paced = _of_events(course.rate(collisions, dimension), collisions)
            contact = _of_events(course.contact(virials / scale), collisions)
            pressure = course.pressure(virials / scale)
        excess = _of_events(course.excess(virials / scale), collisions)
        _warn_few_collisions(int(collisions.sum()))
        z = excess.scaled(1.0, offset=1.0)
        steady = course.changes and (heated or not course.cools)
        over_time = pressure if steady and collisions.any() else z
        rate = count.scaled(2.0 / n)
        size = diameter if not course.grows else course.cube ** (1.0 / dimension)
        per_rate = 1.0 / theory.collision_rate(2.0, dimension, n=n, diameter=size, mass=mass, kT=kT)
        per_excess = theory.contact_value(2.0, course.packing_fraction, dimension, n)
        return PressureResult(
            Z=z,
            collision_rate=rate,
            reduced_pressure=z.scaled(n * course.cube / volume),
            contact_value=contact.scaled(per_excess) if simple else UNKNOWN,
            Z_from_rate=(
                paced.scaled(2.0 / n).scaled(per_rate, offset=1.0) if simple and dimension > 1 else UNKNOWN
            ),
            n=n,
            dimension=dimension,
            packing_fraction=course.packing_fraction,
            block_durations=tuple(durations.tolist()),
            block_values=tuple((1.0 + virials / (scale * course.heat * durations)).tolist()),
            simple=simple,
            kT=kT,
            pressure=over_time.scaled(n * kT / volume),
            note=course.note,
            steady=not course.grows,
        )


@dataclass(frozen=True, eq=False)
class PressureResult(OneNumber):
    """Pressure of a fluid, from the virial and, for equal particles, from the collision rate.

    Parameters
    ----------
    Z : Estimate
        The compressibility factor P V / (n kT), canonical, of n particles.
    collision_rate : Estimate
        Collisions of one particle [1 / time]; each collision counts for both partners.
    reduced_pressure : Estimate
        P sigma^d / kT; in a mixture sigma is the largest diameter.
    contact_value : Estimate
        g(sigma+) that Z implies, with g normalized by (n - 1) / V; nan for one particle, and where the
        particles are not ``simple``.
    Z_from_rate : Estimate
        Z from the collision rate omega, ``Z - 1 = omega sqrt(pi) sigma / (2 d c_D) sqrt(m / kT)``. It must
        agree with the first within a few standard errors, which are correlated. It is nan if the particles
        are not ``simple``, and on a line: collisions there only exchange the initial velocities, on which
        their number depends, but W does not.
    n, dimension : int
        Number of particles, and of dimensions.
    packing_fraction : float
        Packing fraction.
    block_durations : tuple of float
        Duration of each block [time].
    block_values : tuple of float
        Z of each block.
    simple : bool
        Whether all particles are equal and elastic, and alone in a periodic box.
    kT : float
        Temperature; its average over time if contacts change it [energy].
    pressure : Estimate
        P, averaged over time; where kT fluctuates, its error has that of kT [energy / length^d].
    note : str
        A sentence on the meaning of Z and P if kT or diameters change; else empty.
    steady : bool
        Whether a constant value is expected, which is not so while diameters grow.
    solid : bool
        Whether equal particles beyond freezing are a crystal or a glass: they stay where the run began.
    """

    Z: Estimate
    collision_rate: Estimate
    reduced_pressure: Estimate
    contact_value: Estimate
    Z_from_rate: Estimate
    n: int
    dimension: int
    packing_fraction: float
    block_durations: tuple[float, ...] = field(repr=False)
    block_values: tuple[float, ...] = field(repr=False)
    simple: bool = True
    kT: float = math.nan
    pressure: Estimate = UNKNOWN
    note: str = ""
    steady: bool = True
    solid: bool = False

    _main = "Z"
    quantity = "the pressure"

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("Z = PV / NkT", self.Z),
            ("P σ^d / kT", self.reduced_pressure),
            ("P [energy / length^d]", self.pressure),
            ("g(σ+)", self.contact_value),
            ("collisions of one [1 / time]", self.collision_rate),
        ]
        title = f"{counted(self.n, 'particle')} at packing fraction {self.packing_fraction:.6g}"
        return title, [(name, e.value_text) for name, e in rows if math.isfinite(e.mean)]

    def _heading(self) -> str:
        return state(self.n, self.dimension, self.packing_fraction)

    def _draw_into(self, axes: Axes, equations: Mapping[str, theory.Equation | float] | None = None) -> None:
        """Draw the convergence of Z: block values, the running mean with its error band, and theory."""
        if not self.block_values:
            raise InputError("The estimate holds no block of the run, so there is nothing to draw.")
        durations, values = np.array(self.block_durations), np.array(self.block_values)
        time = np.cumsum(durations)
        running = np.cumsum(durations * values) / time
        z = self.Z
        group = math.ceil(values.size / MOST_POINTS)
        means, middles = curves.grouped(values, durations, group)
        label = "blocks" if group == 1 else f"means of {group} blocks"
        axes.plot(middles, means, ".", color=PALE, markersize=4, zorder=1, label=label)
        if math.isfinite(z.error):
            # The final error times sqrt(total time / time so far): that of a stationary run of that length.
            half = z.error * np.sqrt(time[-1] / time)
            low, high = running - half, running + half
            axes.fill_between(time, low, high, color=INK, alpha=0.18, linewidth=0, zorder=2)
        label = f"running mean, Z = {curves.stated(z.value_text)}"
        axes.plot(time, running, color=INK, linewidth=1.6, zorder=4, label=label)
        eta = self.packing_fraction
        if equations is None:
            fluid = self.simple and self.steady and theory.is_stable_fluid(self.dimension, eta)
            equations = theory.equations(self.dimension) if fluid else {}
        shown = [z.mean]
        law = theory.crystal_finite_size_shift if self.solid else theory.finite_size_shift
        for (name, equation), (color, line) in zip(
            equations.items(), THEORIES * len(equations), strict=False
        ):
            value = equation(eta) + law(eta, self.n, equation) if callable(equation) else equation
            shown.append(value)
            label = f"{label_of(name)}, {value:.4f}"
            axes.axhline(value, color=color, linestyle=line, linewidth=1.3, zorder=5, label=label)
        axes.set_xlim(0.0, time[-1])
        curves.show_convergence(axes, shown, means)
        axes.set(xlabel="time t", ylabel="compressibility factor Z")

    def _repr_html_(self) -> str:
        return super()._repr_html_() + (f"<p>{html(self.note)}</p>" if self.note else "")

    def __str__(self) -> str:
        lines = [f"Z = {self.Z}"]
        if math.isfinite(self.pressure.mean):
            lines.append(f"P = {self.pressure.value_text} energy / length^{self.dimension}")
        return "\n".join([*lines, *filter(None, [self.note])])

    def infinite_size(self, equation: theory.Equation | None = None) -> Estimate:
        """Return Z of infinitely many particles, by the correction of order 1 / n.

        Parameters
        ----------
        equation : callable, optional
            Equation of state that gives the correction; by default the best one known for the fluid of this
            dimension. The correction of a ``solid`` follows from its own Z.

        Raises
        ------
        InputError
            If no equation of state is given, and the particles are not ``simple``, or are disks between
            freezing and melting, where two phases coexist. If it is no function of the packing fraction.

        Warns
        -----
        CaromWarning
            If the box is too small for this correction.
        """
        eta, n, d = self.packing_fraction, self.n, self.dimension
        if equation is None and not self.simple:
            raise InputError(
                "The correction to infinite size is known of equal elastic spheres alone: give equation=, a "
                "function of the packing fraction; for a mixture, subtract carom.theory."
                "mixture_finite_size_shift(packing_fraction, fractions, diameters, dimension, n, "
                "carom.theory.bmcsl) of its species."
            )
        if equation is not None:
            _try(equation, eta)
        if equation is None and d == 2 and theory.FREEZING[2] <= round(eta, 9) < theory.MELTING[2]:
            raise InputError(
                f"At packing fraction {eta:.4g} fluid and solid are there side by side, whose correction to "
                "infinite size is not known; give equation=."
            )
        if self.solid:
            if equation is None:
                return self.Z.scaled(n / (n - 1.0), offset=-1.0 / (n - 1.0))
            return self.Z.scaled(1.0, offset=-theory.crystal_finite_size_shift(eta, n, equation))
        if doubt := finite_size_doubt(eta, n, d):
            warn(doubt)
        law = theory.best(d) if equation is None else equation
        return finite_size_correction(self.Z, packing_fraction=eta, n=n, equation=law)


def _keeps_its_temperature(scene: Scene) -> bool:
    """Tell whether kT only fluctuates: by exchange of energy, or as a sheared stream makes up for losses."""
    stepped, sheared = hasattr(scene.interaction, "steps"), isinstance(scene.motion, Shear)
    return stepped or sheared or bool(getattr(scene.impact, "conserves_energy", False))


def _is_heated(scene: Scene) -> bool:
    """Tell whether a drive, or a surface that moves or is hot, gives energy to the particles."""
    return scene.drive is not None or any(
        getattr(each, "kT", None) is not None or getattr(each, "fastest", 0.0) > 0.0
        for each in standing(scene)
    )


def _source(scene: Scene) -> str:
    """Return what changes the kinetic energy of a scene, with its verb."""
    names = [] if scene.drive is None else [f"the drive {type(scene.drive).__name__}"]
    if not names or not is_elastic(scene):
        names = ["contacts", *names]
    said = " and ".join(names)
    return f"{said[0].upper()}{said[1:]} change{'s' * (names[0] != 'contacts')}"


def without_pressure(scene: Scene) -> str | None:
    """Return why the virial is not the pressure (pinned particles, fields, curved flights), or None."""
    if scene.pinned is not None:
        return (
            "The virial gives no pressure where components are pinned: forces from outside hold them. "
            "Measure Simulation.pinned_impulse, or leave out pinned."
        )
    motion = type(scene.motion).__name__
    if getattr(scene.motion, "curved", False):
        return (
            f"The virial is the pressure of straight flight, and {motion} bends the paths; count collisions "
            "with Simulation.run()."
        )
    if not all(kept_by_motion(scene)):
        return (
            f"The virial gives no pressure where {motion} changes the total momentum: the pressure is not "
            "the same everywhere. Measure that on a wall or an obstacle, carom.WallPressure(), or by layers, "
            "carom.PressureProfile()."
        )
    return None


def _try(equation: theory.Equation, packing_fraction: float) -> None:
    """Raise InputError if an equation of state is no function of the packing fraction alone."""
    try:
        float(equation(packing_fraction))
    except TypeError as error:
        raise InputError(
            f"equation must give Z as a function of the packing fraction alone ({error}); give what else it "
            "needs, as in lambda eta: carom.theory.bmcsl(eta, fractions, diameters)."
        ) from None


def finite_size_correction(
    compressibility_factor: Estimate, *, packing_fraction: float, n: int, equation: theory.Equation
) -> Estimate:
    """Return Z of infinitely many particles from that of n: :func:`carom.theory.finite_size_shift`."""
    shift = theory.finite_size_shift(packing_fraction, n, equation)
    return compressibility_factor.scaled(1.0, offset=-shift)


def finite_size_doubt(packing_fraction: float, n: int, dimension: int) -> str:
    """Return a sentence on why the correction to infinite size is not reliable, or "".

    In a small dense box a particle is correlated with the shells around its own images, which is not of order
    1 / n: at 0.8, Z of 108 spheres (edge 5.1) stays 0.026 low after the correction of 0.017.
    """
    dense = packing_fraction > DENSE * theory.FREEZING.get(dimension, math.inf)
    edge = (n * theory.ball_volume(dimension) / packing_fraction) ** (1.0 / dimension)
    if not dense or edge >= SMALL:
        return ""
    return (
        f"A box of {edge:.2g} diameters is too small for the correction to infinite size at packing fraction "
        f"{packing_fraction:.3g}: its error is larger than the error bar says. Take more particles, for an "
        f"edge of {SMALL:g} diameters."
    )


def _of_events(found: Estimate, collisions: np.ndarray) -> Estimate:
    """Return an estimate of a sum over collisions; without any collision its error is infinite, not zero."""
    return found if collisions.any() else Estimate(0.0, math.inf, 0.0, math.inf, len(collisions))


def _warn_few_collisions(collisions: int) -> None:
    if collisions < FEW_COLLISIONS:
        warn(
            f"The pressure and its error are a guess: {counted(collisions, 'collision')} in all. Run longer."
        )
