"""The results of a study as one object: table, fits, pictures, report."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom import notebook
from carom.errors import InputError
from carom.studies.eos.measured import Measured
from carom.studies.eos.table import Row
from carom.studies.outcome import write_csv
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

    def with_theory(self, equation: Equation) -> EquationOfState:
        """Return the study compared with another ``equation`` of state, e.g. ``theory.henderson``."""
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

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the table to the file ``path``, one line per point; unknown numbers are empty.

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


def _cell(value: Any) -> Any:
    """Return a value of the table as the CSV file has it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else ""
    return "; ".join(value) if isinstance(value, Sequence) and not isinstance(value, str) else value
