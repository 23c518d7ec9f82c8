"""Sheared fluids: viscosity and normal stresses against the shear rate, compared with Enskog's theory."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from carom import theory
from carom.observables.analysis.drift import drift, drifts
from carom.observables.statistics import (
    FEW_SAMPLES,
    Estimate,
    blocking,
    linear_ratio,
    unwarned,
)
from carom.studies.folder import Record, Task
from carom.studies.grid_study import GridStudy
from carom.studies.shear.measure import Flow
from carom.studies.shear.spec import ShearSpec, duration
from carom.studies.signatures import documented
from carom.table import Column, Table, error

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOTE = "Units are those of the scene, with k = 1. N1 = P_xx - P_yy, N2 = P_yy - P_zz; the flow is along x."

MOST_TICKS = 8
"""Largest number of rates that are written below the picture."""


@dataclass(frozen=True)
class Row:
    """One point of a study of sheared fluids."""

    packing_fraction: Annotated[float, Column("η", ".4g", key=True)]
    n: Annotated[int, Column("N", key=True)]
    rate: Annotated[float, Column("rate", ".4g", key=True)]  # [1 / time]
    # Of the velocities relative to the stream [energy].
    kT: Annotated[float, Column("kT", error("kT_error", told=True))]
    kT_error: float
    # Of one particle, impulses at steps included [1 / time].
    collision_rate: Annotated[float, Column("collision rate", error("collision_rate_error", told=True))]
    collision_rate_error: float
    # -P_10 over the rate [mass length^(2 - d) / time]; Enskog's is of equal elastic cores at this kT.
    viscosity: Annotated[float, Column("viscosity", error("viscosity_error", told=True))]
    viscosity_error: float
    enskog: Annotated[float, Column("Enskog", ".4g")]
    pressure: Annotated[float, Column("p", error("pressure_error", told=True))]
    pressure_error: float
    # (P_00 - P_11) / p and (P_11 - P_22) / p, the latter nan in two dimensions.
    N1: Annotated[float, Column("N1/p", error("N1_error", told=True))]
    N1_error: float
    N2: Annotated[float, Column("N2/p", error("N2_error", told=True))]
    N2_error: float
    strain: Annotated[float, Column("strain", ".4g")]  # of all replicas together
    remark: str


@dataclass(frozen=True, repr=False)
class ShearFlow(GridStudy[ShearSpec]):
    """Viscosity and normal stresses at every point of a study.

    Attributes are as for :class:`carom.studies.eos.study.EquationOfState`.
    """

    Spec: ClassVar[type[ShearSpec]] = ShearSpec
    name: ClassVar[str] = "shear"
    unit_of_cost: ClassVar[str] = "particles times time"
    measure = staticmethod(Flow.measure)

    @staticmethod
    def cost(task: Task) -> float:
        """Return the work of a task."""
        return duration(task)

    @staticmethod
    def point(task: Task) -> tuple[Any, ...]:
        """Return what tells the point of a task from others."""
        return (*GridStudy.point(task), task["rate"])

    def place(self, task: Task) -> str:
        """Return where a task is, in words."""
        return f"{super().place(task)} and rate {task['rate']:g}"

    @functools.cached_property
    def table(self) -> Table:
        """One :class:`Row` for each point, in the order of packing fraction, n and rate."""
        rows = [_row(records) for records in self.by_point()]
        remarks = [
            f"* η = {each.packing_fraction:.4g}, N = {each.n}, rate {each.rate:.4g}: {each.remark}"
            for each in rows
            if each.remark
        ]
        return Table(Row, rows, notes=[NOTE, *remarks], flagged=lambda each: bool(each.remark))

    def printed(self) -> list[Table]:
        """Return kT and the viscosity of each point, and below them the stresses, each within 80 columns."""
        point, flow = ("packing_fraction", "n", "rate"), ("kT", "viscosity", "enskog", "strain")
        rest = [name for name, _ in self.table.columns() if name not in flow]
        return [replace(self.table, only=(*point, *flow), notes=()), replace(self.table, only=rest)]

    def picture(self) -> Figure | None:
        """Return the viscosity against the rate, or of one rate the packing fraction, with Enskog's."""
        from carom.figures import style

        if not self.table:
            return None
        figure, axes = style.sheet(5.0, 3.6)
        rates = sorted({row.rate for row in self.table})
        one_rate = len(rates) == 1 < len({row.packing_fraction for row in self.table})
        several = len({row.n for row in self.table}) > 1
        curves: dict[str, list[Row]] = {}
        for row in self.table:
            one = f"rate {row.rate:g}" if one_rate else rf"$\eta$ = {row.packing_fraction:.3g}"
            curves.setdefault(one + f", $N$ = {row.n}" * several, []).append(row)
        for k, (label, rows) in enumerate(curves.items()):
            x, color = [row.packing_fraction if one_rate else row.rate for row in rows], style.shade(k)
            axes.errorbar(
                x, [row.viscosity for row in rows], [row.viscosity_error for row in rows], fmt="o", ms=4,
                color=color, label=label,
            )  # fmt: skip
            if any(math.isfinite(row.enskog) for row in rows):
                told = "Enskog" if k == len(curves) - 1 else None
                axes.plot(x, [row.enskog for row in rows], "--", lw=1.0, color=color, label=told)
        if not one_rate:
            axes.set_xscale("log")
        if not one_rate and len(rates) <= MOST_TICKS:
            axes.set_xticks(rates, [f"{rate:g}" for rate in rates])
            axes.set_xticks([], minor=True)
        axes.set_xlabel("packing fraction" if one_rate else "shear rate")
        axes.set_ylabel("viscosity")
        axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])  # room for the names
        axes.legend(frameon=False, fontsize=8, ncols=3, loc="upper center")
        style.lay_out(figure, axes)
        return figure


def _row(records: list[Record]) -> Row:
    """Return the row of a point from the records of its replicas."""
    results, task = [record["result"] for record in records], records[0]["task"]
    first, rate = results[0], task["rate"]
    eta, d = float(task["scene"]["packing_fraction"]), first["dimension"]

    def series(name: str) -> list[float]:
        return [value for result in results for value in result["series"][name]]

    with unwarned():  # the remark says it
        kT, collision_rate, stress, pressure = (
            blocking(series(name)) for name in ("kT", "collision_rate", "stress", "pressure")
        )
        # Wells may pull more than the particles push: the pressure of a block may have either sign.
        trace, names = np.array(series("pressure")), ("first", "second")[: min(d, 3) - 1]
        normal = [linear_ratio(np.array(series(name)), trace) for name in names]
    viscosity = stress.scaled(1.0 / rate)
    normal.append(Estimate(math.nan, math.nan, 0.0, math.inf, 0))
    enskog = math.nan
    if first["simple"] and theory.is_stable_fluid(d, eta) and d in theory.FREEZING:
        z = float(theory.best(d)(eta))
        diameter, mass = first["diameter"], first["mass"]
        enskog = theory.enskog(z, eta, d, diameter=diameter, mass=mass, kT=kT.mean).shear_viscosity
    remarks = []
    if viscosity.n_eff < FEW_SAMPLES:
        remarks.append("the error bars are guesses; run longer")
    if any(drifts([drift(result["series"][name]) for result in results]) for name in ("kT", "stress")):
        remarks.append("the flow had not settled; raise equilibration")
    return Row(
        eta, first["n"], rate, kT.mean, kT.error, collision_rate.mean, collision_rate.error, viscosity.mean,
        viscosity.error, enskog, pressure.mean, pressure.error, normal[0].mean, normal[0].error,
        normal[1].mean, normal[1].error, rate * first["duration"] * len(series("kT")), "; ".join(remarks),
    )  # fmt: skip


@documented(ShearFlow)
def shear(rate: Iterable[float] | float | None = None, *, how: Mapping[str, Any], **given: Any) -> ShearFlow:
    """Measure viscosity and normal stresses of sheared fluids against the shear rate.

    @

    Returns
    -------
    ShearFlow
        Viscosity, normal stresses, pressure and temperature at every point.

    Notes
    -----
    The box is that of :class:`carom.models.Shear`. Velocities of elastic particles are scaled whenever the
    flow has heated them by a tenth, so that the mean is about kT; the row has it. Between collisions the
    pressure tensor is exact.

    Examples
    --------
    >>> import carom
    >>> study = carom.shear(
    ...     1.0, n=64, packing_fraction=0.2, restitution=0.9, strains=60, replicas=1, executor="serial"
    ... )
    >>> print(str(study).splitlines()[0])
    Shear flow: 1 run
    """
    return ShearFlow(ShearSpec(**given) if rate is None else ShearSpec(rate=rate, **given)).run(**how)  # type: ignore[arg-type]
