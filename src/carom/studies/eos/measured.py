"""The results of a study for its pictures and its page: the table, and what follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom import theory
from carom.studies.eos import fits
from carom.studies.eos.spec import StudySpec
from carom.studies.eos.table import Row, table
from carom.studies.outcome import Outcome
from carom.theory import Equation


@dataclass(frozen=True, repr=False)
class Measured(Outcome):
    """Z at every point of a study, and derived results.

    Attributes
    ----------
    spec : StudySpec
        The requested study.
    equation : callable or None
        Equation of state to compare with, instead of the usual one.
    """

    spec: StudySpec
    equation: Equation | None = None

    @property
    def table(self) -> list[Row]:
        """One :class:`Row` for each point, in the order of packing fraction and n."""
        return table(self.records, self.equation)

    @property
    def chi2_per_point(self) -> float:
        """Mean square of the deviations from theory, over the fluid's points in equilibrium; nan if none."""
        squares = [
            row.deviation**2
            for row in self.table
            if row.equilibrated and row.phase == "fluid" and math.isfinite(row.deviation)
        ]
        return math.fsum(squares) / len(squares) if squares else math.nan

    def virials(self, *, up_to: float | None = None, order: int = 4) -> fits.Virials:
        """Fit virial coefficients; see :func:`carom.studies.eos.fits.virials`."""
        known = None
        species = self.records[0]["result"]["species"] if self.records else []
        if len(species) > 1:
            diameters, total = [s for s, _ in species], sum(c for _, c in species)
            fractions = [c / total for _, c in species]
            known = [theory.mixture_second_virial(fractions, diameters, self.spec.dimension)]
        return fits.virials(self.table, up_to=up_to, order=order, known=known)

    def extrapolate(self) -> list[fits.Extrapolation]:
        """Extrapolate to infinite size; see :func:`carom.studies.eos.fits.extrapolate`."""
        return fits.extrapolate(self.table)
