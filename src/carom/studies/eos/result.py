"""A study's results as a small object: table, fits, pictures, report."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom import notebook, theory
from carom.errors import InputError
from carom.studies.eos import fits
from carom.studies.eos.spec import StudySpec
from carom.studies.eos.table import Row, table
from carom.studies.outcome import Outcome, write_csv
from carom.theory import Equation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = tuple(f.name for f in dataclasses.fields(Row))


@dataclass(frozen=True, repr=False)
class EquationOfState(Outcome):
    """Z at every point of a study, and derived results.

    Attributes
    ----------
    spec : StudySpec
        What was asked for.
    records, failures, folder, engine, seconds
        As in ``carom.studies.outcome.Outcome``.
    equation : callable or None
        Equation of state to compare with, instead of the usual one.
    """

    spec: StudySpec
    equation: Equation | None = None

    @property
    def table(self) -> list[Row]:
        """One :class:`Row` for each point, in the order of packing fraction and n."""
        return table(self.records, self.equation)

    def with_theory(self, equation: Equation) -> EquationOfState:
        """Return the study compared with another equation of state, e.g. ``theory.henderson``."""
        return dataclasses.replace(self, equation=equation)

    def __repr__(self) -> str:
        rows = self.table
        done, tasks = len(self.records), len(self.spec.tasks())
        return f"<EquationOfState: {len(rows)} points, {done} of {tasks} runs done>"

    def __str__(self) -> str:
        lines = [f"{'eta':>8} {'N':>7} {'Z':>12} {'error':>9} {'infinite':>12} {'theory':>12} {'dev.':>6}"]
        for row in self.table:
            measured = f"{row.compressibility_factor:12.6f} {row.error:9.6f} {row.infinite:12.6f}"
            beside = f"{row.theory:12.6f} {row.deviation:+6.1f} {'; '.join(row.remarks)}"
            lines.append(f"{row.packing_fraction:8.5g} {row.n:7d} {measured} {beside}".rstrip())
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        head, *lines = str(self).splitlines()
        return notebook.table(repr(self).strip("<>"), [line.split(None, 6) for line in lines], head.split())

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

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the table, one line per point; unknown numbers are empty.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        rows = ([_cell(getattr(row, name)) for name in COLUMNS] for row in self.table)
        write_csv(path, COLUMNS, rows)

    def to_pandas(self) -> Any:
        """Return the table as a pandas DataFrame.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise InputError(
                "A DataFrame needs the package pandas; pip install pandas, or use to_csv."
            ) from None
        return pandas.DataFrame([dataclasses.asdict(row) for row in self.table], columns=list(COLUMNS))

    def plot(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        equations: Mapping[str, Equation] | None = None,
    ) -> Figure:
        """Draw Z, its deviation from theory in units of the error, and the pressure.

        Parameters
        ----------
        path : path, optional
            Where to save the picture; the suffix is the format.
        equations : mapping of str to callable, optional
            Equations of state to draw; the first is compared with the data. By default the usual ones.
        """
        from carom.studies.eos import pictures

        return pictures.study(self, equations=equations, path=path)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a self-contained page (HTML) of tables, pictures and provenance."""
        from carom.studies.eos.html import write

        write(self, Path(path))


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else ""
    return "; ".join(value) if isinstance(value, Sequence) and not isinstance(value, str) else value
