"""Transport coefficients: diffusion, viscosities, thermal conductivity, compared with Enskog's theory."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from carom.errors import InputError
from carom.observables.statistics import UNKNOWN
from carom.studies.eos.study import composition
from carom.studies.grid import SCENE
from carom.studies.grid_study import GridStudy
from carom.studies.signatures import documented
from carom.studies.transport.analysis import Coefficient, Extrapolation, line
from carom.studies.transport.measure import Currents
from carom.studies.transport.points import Coefficients, coefficients_of
from carom.studies.transport.spec import TransportSpec
from carom.table import Column, Table, error

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from carom.observables.statistics import Estimate

UNITS = "Units are those of the scene, with k = 1; without a scene file σ = m = kT = 1."


def _slope(begin: float, row: Row) -> str:
    return f"{begin:.4g} and {row.end:.4g}"


def _name(name: str, row: Row) -> str:
    return name.replace("_infinite", ", N = inf").replace("_", " ")


@dataclass(frozen=True)
class Row:
    """One coefficient of one point."""

    packing_fraction: Annotated[float, Column("η", ".4g", key=True)]
    n: Annotated[int, Column("N", key=True)]
    quantity: Annotated[str, Column("", _name, left=True, key=True)]
    # nan in the plane, where it grows with the window.
    value: Annotated[float, Column("value", error("error", told=True), missing="unknown")]
    error: float
    enskog: Annotated[float, Column("Enskog", ".5g")]
    ratio: Annotated[float, Column("ratio", ".3f")]
    # Times between which the slope was taken.
    begin: Annotated[float, Column("slope between", _slope, missing="blocks too short")]
    end: float
    remark: str


@dataclass(frozen=True, repr=False)
class Transport(GridStudy[TransportSpec]):
    """Transport coefficients at every point of a study.

    Attributes are as for :class:`carom.studies.eos.study.EquationOfState`.
    """

    Spec: ClassVar[type[TransportSpec]] = TransportSpec
    name: ClassVar[str] = "transport"
    measure = staticmethod(Currents.measure)

    @functools.cached_property
    def points(self) -> list[Coefficients]:
        """The coefficients of each point, with the data behind them, by packing fraction and n."""
        return [coefficients_of(records) for records in self.by_point()]

    @functools.cached_property
    def table(self) -> Table:
        """One :class:`Row` for each coefficient of each point."""
        rows: list[Row] = []
        unsettled = []
        for each in self.points:
            quantities = each.quantities()
            if math.isfinite(each.self_diffusion_infinite.mean):
                at = each.self_diffusion[0].window
                enskog = each.enskog.self_diffusion if each.enskog else math.nan
                quantities["self_diffusion_infinite"] = (
                    Coefficient.of(each.self_diffusion_infinite, at),
                    enskog,
                )
            for name, (c, enskog) in quantities.items():
                value: Estimate = c if each.exists else UNKNOWN
                rows.append(
                    Row(
                        each.packing_fraction, each.n, name, value.mean, value.error, enskog,
                        value.mean / enskog, *c.window, "; ".join(each.remarks),
                    )
                )  # fmt: skip
                if each.exists and not c.settled:
                    unsettled.append(rows[-1])
        return Table(Row, rows, notes=[*self.remarks(), UNITS], flagged=lambda row: row in unsettled)

    @property
    def self_diffusion(self) -> Coefficient:
        """Self-diffusion of a study of one point and one species [length^2 / time].

        Raises
        ------
        InputError
            If there are several species, or not one point.
        """
        found = self._only("self_diffusion").self_diffusion
        if len(found) > 1:
            raise InputError(f"Each of {len(found)} species has its own: study.points[0].self_diffusion.")
        return found[min(found)]

    @property
    def shear_viscosity(self) -> Coefficient:
        """Shear viscosity of a study of one point."""
        return self._only("shear_viscosity").shear_viscosity

    @property
    def bulk_viscosity(self) -> Coefficient:
        """Bulk viscosity of a study of one point."""
        return self._only("bulk_viscosity").bulk_viscosity

    @property
    def thermal_conductivity(self) -> Coefficient:
        """Thermal conductivity of a study of one point."""
        return self._only("thermal_conductivity").thermal_conductivity

    def _only(self, name: str) -> Coefficients:
        """Return the one point of a study; InputError if there are others, or none is done."""
        if len(self.points) != 1:
            raise InputError(
                f"This study has {len(self.points)} points, each with its {name}: take it from one of them, "
                f"as in study.points[0].{name}."
            )
        return self.points[0]

    def extrapolate(self) -> list[Extrapolation]:
        """Return self-diffusion of the infinite system by a line in 1 / L, for densities with several sizes.

        Its points are D of each size times ``at_rest`` of the point. Nothing is assumed about its slope,
        which :func:`carom.theory.diffusion_shift` predicts. Only in d = 3.
        """
        groups: dict[float, list[Coefficients]] = {}
        for each in self.points:
            first = each.self_diffusion[min(each.self_diffusion)]
            if each.dimension == 3 and math.isfinite(first.mean):
                groups.setdefault(each.packing_fraction, []).append(each)
        found = []
        for eta, rows in groups.items():
            if len(rows) > 1:
                k = min(rows[0].self_diffusion)
                values: list[Estimate] = [r.self_diffusion[k].scaled(r.at_rest[k]) for r in rows]
                value, slope, chi2 = line(
                    np.array([1.0 / r.edge for r in rows]),
                    np.array([v.mean for v in values]),
                    np.array([v.error for v in values]),
                )
                found.append(Extrapolation(eta, value, slope, tuple(r.n for r in rows), chi2))
        return found

    def remarks(self) -> list[str]:
        """Return what else is known of the points, and the remarks about them, one line each."""
        said: dict[str, None] = {}
        for each in self.points:
            eta = f"* eta = {each.packing_fraction:g}"
            if math.isfinite(each.erpenbeck_wood):
                known = f"{each.erpenbeck_wood:.5g} by Erpenbeck and Wood's fit to simulations"
                said[f"{eta}, N = inf: D is {known}"] = None
            said |= dict.fromkeys(f"{eta}, N = {each.n}: {remark}" for remark in each.remarks)
        return list(said)

    @property
    def title(self) -> str:
        """What was simulated."""
        from carom.studies.eos.pictures import kind

        if not self.records:
            return "Transport coefficients"
        found = self.records[0]["result"]
        species = list(zip(found["diameters"], found["counts"], strict=True))
        name = kind(found["dimension"], self.spec.scene, mixture=len(species) > 1)
        article = "a " if len(species) > 1 else ""
        return f"Transport coefficients of {article}{name}{composition(species)}"

    def picture(self) -> Figure | None:
        """Return the coefficients divided by Enskog's, and their convergence in time."""
        from carom.studies.transport import pictures

        return pictures.study(self.points) if self.points else None


@documented(Transport, scene=SCENE)
def transport(
    packing_fraction: Iterable[float] | float | None = None,
    *,
    scene: str | PathLike[str] | Mapping[str, Any] | None = None,
    how: Mapping[str, Any],
    **given: Any,
) -> Transport:
    """Measure self-diffusion, shear and bulk viscosity and thermal conductivity of fluids.

    For mixtures, mutual and thermal diffusion are measured, too.

    @

    Returns
    -------
    Transport
        The coefficients at every point.

    Notes
    -----
    In two dimensions the coefficients diverge with the size of the system. Helfand's moments are exact
    between collisions, so that no result depends on a time step. The rule for the times of the slopes is in
    ``carom.studies.transport.windows``.

    Examples
    --------
    >>> import carom
    >>> study = carom.transport(
    ...     0.1, n=108, replicas=1, collisions_per_particle=400, equilibration=20, executor="serial"
    ... )
    >>> print(str(study).splitlines()[0])
    Transport coefficients of hard spheres: 1 run
    """
    spec = TransportSpec.of(scene, {"packing_fraction": packing_fraction, **given})
    return Transport(spec).run(**how)
