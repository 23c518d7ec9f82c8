"""The results of a transport study as one object: table, picture, report."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from carom.observables.statistics import Estimate
from carom.studies.coefficients.measured import Measured
from carom.studies.outcome import write_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = ("packing_fraction", "n", "quantity", "value", "error", "enskog", "ratio", "from", "to", "remark")


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

    def __repr__(self) -> str:
        return f"<Transport: {len(self.records)} of {len(self.spec.tasks())} runs done>"

    def __str__(self) -> str:
        head = (f"{'eta':>7}", f"{'N':>6} ", f"{'coefficient':<22}", f"{'value':>20}", f"{'Enskog':>10}")
        lines = [" ".join([*head, f"{'ratio':>7} ", "slope between"])]
        for eta, n, name, value, enskog, ratio, window in self.cells():
            line = f"{eta:>7} {n:>6}  {name:<22} {value:>20} {enskog:>10} {ratio:>7}  {window}"
            lines.append(line.rstrip())
        return "\n".join([*lines, *self.remarks()])

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
                rows.append((eta, str(each.n), name, *_beside(c.value, enskog), window))
            infinite, theory = each.self_diffusion_infinite, each.enskog
            if math.isfinite(infinite.mean) and theory is not None:
                rows.append((eta, "inf", "self_diffusion", *_beside(infinite, theory.self_diffusion), ""))
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

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write one line per coefficient to the file ``path``; unknown numbers are empty.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        write_csv(path, COLUMNS, (list(each.values()) for each in self.rows()))

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
    """Return a value, Enskog's and the ratio of the two, as text; the last two are empty where not known."""
    known = math.isfinite(enskog)
    return (value.value_text, *((f"{enskog:.5g}", f"{value.mean / enskog:.3f}") if known else ("", "")))
