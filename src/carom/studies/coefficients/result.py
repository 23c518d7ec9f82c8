"""The results of a transport study as one object: table, picture, report."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from carom.errors import InputError
from carom.observables.statistics import Estimate, value_with_error
from carom.studies.coefficients.analysis import Coefficient
from carom.studies.coefficients.measured import Measured, Row
from carom.studies.coefficients.spec import TransportSpec

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Transport(Measured):
    """Transport coefficients at every point of a study.

    Attributes
    ----------
    spec : TransportSpec
        The requested study.
    records, failures, folder, engine, seconds
        As in ``carom.studies.outcome.Outcome``.
    """

    _asked = TransportSpec

    def __repr__(self) -> str:
        return f"<Transport: {len(self.records)} of {len(self.spec.tasks())} runs done>"

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
            raise InputError(f"Each of {len(found)} species has its own: study.table[0].self_diffusion.")
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

    def _only(self, name: str) -> Row:
        """Return the one point of a study.

        Raises
        ------
        InputError
            If there are others, or none is done.
        """
        table = self.table
        if len(table) != 1:
            raise InputError(
                f"This study has {len(table)} points, each with its {name}: take it from one of them, as in "
                f"study.table[0].{name}."
            )
        return table[0]

    def _lines(self) -> list[str]:
        """Return what is printed: the grid, the coefficients of one point, and the remarks."""
        rows = self.table
        what = f"{len(rows)} points"
        if len(rows) == 1:
            what = f"N = {rows[0].n} at packing fraction {rows[0].packing_fraction:g}"
        lines = [f"Transport coefficients in {self.spec.dimension}D: {what}, {self._done()}"]
        if len(rows) == 1:
            values = [
                f"{name.replace('_', ' ')} {value_with_error(c.mean, c.error)}"
                for name, (c, _) in rows[0].quantities().items()
            ]
            lines.append(f"{', '.join(values)} (units of the scene, k = 1)")
        if remarks := self.remarks():
            lines.append(remarks[0] if len(remarks) == 1 else f"{len(remarks)} remarks: remarks()")
        return lines

    def cells(self) -> list[tuple[str, ...]]:
        """Return the printed columns for each coefficient.

        These are the packing fraction, N, the name, the value, Enskog's value, the ratio of the two, and the
        times between which the slope is taken.
        """
        rows: list[tuple[str, ...]] = []
        for each in self.table:
            eta = f"{each.packing_fraction:.4g}"
            for name, (c, enskog) in each.quantities().items():
                window = f"{c.window[0]:.4g} and {c.window[1]:.4g}"
                if not math.isfinite(c.mean):
                    window = "blocks too short for a slope"
                rows.append((eta, str(each.n), name.replace("_", " "), *_beside(c, enskog), window))
            infinite, theory = each.self_diffusion_infinite, each.enskog
            if math.isfinite(infinite.mean) and theory is not None:
                rows.append((eta, "inf", "self diffusion", *_beside(infinite, theory.self_diffusion), ""))
        return rows

    def remarks(self) -> list[str]:
        """Return what else is known of the points, and the remarks about them, one line each."""
        said: dict[str, None] = {}
        for each in self.table:
            eta = f"* eta = {each.packing_fraction:g}"
            if math.isfinite(each.erpenbeck_wood):
                known = f"{each.erpenbeck_wood:.5g} by Erpenbeck and Wood's fit to simulations"
                said[f"{eta}, N = inf: D is {known}"] = None
            said |= dict.fromkeys(f"{eta}, N = {each.n}: {remark}" for remark in each.remarks)
        return list(said)

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """Draw the coefficients divided by Enskog's, and their convergence in time; save them to ``path``.

        Raises
        ------
        FileError
            If the picture cannot be saved.
        """
        from carom.studies.coefficients import pictures

        return pictures.study(self, path)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a self-contained page (HTML) of table, pictures and provenance to the file ``path``.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        from carom.studies.coefficients.pictures import write_report

        write_report(self, Path(path))


def _beside(value: Estimate, enskog: float) -> tuple[str, str, str]:
    """Return a value, Enskog's and the ratio of the two, as text; what is not known is "unknown" or empty."""
    theory = f"{enskog:.5g}" if math.isfinite(enskog) else ""
    if not math.isfinite(value.mean):
        return "unknown", theory, ""
    text = value.value_text if math.isfinite(value.error) else f"{value.mean:.4g} +- ?"
    return text, theory, f"{value.mean / enskog:.3f}" if theory else ""
