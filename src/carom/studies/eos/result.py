"""The results of a study as one object: table, fits, pictures, report."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom.observables.statistics import value_with_error
from carom.results import plain
from carom.studies.eos.measured import Measured
from carom.studies.eos.spec import StudySpec
from carom.studies.eos.table import Row
from carom.theory import Equation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = tuple(f.name for f in dataclasses.fields(Row))


@dataclass(frozen=True, repr=False)
class EquationOfState(Measured):
    """Z at every point of a study, and derived results.

    Attributes
    ----------
    spec : StudySpec
        The requested study.
    records, failures, folder, engine, seconds
        As in ``carom.studies.outcome.Outcome``.
    equation : callable or None
        Equation of state to compare with, instead of the usual one.
    """

    _asked = StudySpec

    def with_theory(self, equation: Equation) -> EquationOfState:
        """Return the study compared with another ``equation`` of state, e.g. ``theory.henderson``."""
        return dataclasses.replace(self, equation=equation)

    def __repr__(self) -> str:
        rows = self.table
        done, tasks = len(self.records), len(self.spec.tasks())
        return f"<EquationOfState: {len(rows)} points, {done} of {tasks} runs done>"

    def _lines(self) -> list[str]:
        """Return what is printed: the grid, the range of Z, the comparison with theory."""
        rows = self.table
        d = self.spec.dimension
        lines = [f"Equation of state in {d}D: {len(rows)} points, {self._done()}"]
        if rows:
            low, high = rows[0], rows[-1]
            ends = [
                f"Z = {value_with_error(row.Z, row.Z_error)} at packing fraction {row.packing_fraction:g}"
                for row in ([low] if low is high else [low, high])
            ]
            lines.append(", ".join(ends))
        said = []
        if math.isfinite(self.chi2_per_point):
            said.append(f"chi squared per point against theory {self.chi2_per_point:.2f}")
        if flagged := sum(not row.equilibrated for row in rows):
            said.append(f"{flagged} flagged, and left out of fits")
        return [*lines, *([", ".join(said)] if said else [])]

    def _columns(self) -> dict[str, Any]:
        """Return the columns of ``eos.csv``, with a row for each point."""
        table = self.table
        return {name: [getattr(row, name) for row in table] for name in COLUMNS}

    def _words(self) -> dict[str, Any]:
        """Return the study, its table and its fits."""
        fits = [plain(dataclasses.asdict(fit)) for fit in self.extrapolate()]
        return {**super()._words(), "extrapolation": fits, "chi2_per_point": plain(self.chi2_per_point)}

    def plot(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        equations: Mapping[str, Equation] | None = None,
    ) -> Figure:
        """Draw Z, its deviation from theory in standard errors, and the pressure.

        Parameters
        ----------
        path : path, optional
            Where to save the picture; the suffix is the format.
        equations : mapping of str to callable, optional
            Equations of state to draw; the first is compared with the data. By default the usual ones.

        Raises
        ------
        FileError
            If the picture cannot be saved.
        """
        from carom.studies.eos import pictures

        return pictures.study(self, equations=equations, path=path)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a self-contained page (HTML) of tables, pictures and provenance to the file ``path``.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        from carom.studies.eos.html import write

        write(self, Path(path))
