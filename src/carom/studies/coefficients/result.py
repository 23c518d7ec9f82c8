"""The results of a transport study as a small object: table, picture, report."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

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
        What was asked for.
    records, failures, folder, engine, seconds
        As in ``carom.studies.outcome.Outcome``.
    """

    def __repr__(self) -> str:
        return f"<Transport: {len(self.records)} of {len(self.spec.tasks())} runs done>"

    def __str__(self) -> str:
        lines = [
            f"{'eta':>7} {'N':>6}  {'coefficient':<22} {'value':>20} {'Enskog':>10} {'ratio':>7}  "
            "slope between"
        ]
        remarks: dict[str, None] = {}
        for each in self.table:
            for name, (c, enskog) in each.quantities().items():
                ratio = f"{c.value.mean / enskog:7.3f}" if math.isfinite(enskog) else " " * 7
                expected = f"{enskog:10.5g}" if math.isfinite(enskog) else " " * 10
                lines.append(
                    f"{each.packing_fraction:7.4g} {each.n:6d}  {name:<22} {c.value.value_text:>20} "
                    f"{expected} {ratio}  {c.window[0]:.4g} and {c.window[1]:.4g}"
                )
            if math.isfinite(each.self_diffusion_infinite.mean):
                lines.append(
                    f"{each.packing_fraction:7.4g} {'inf':>6}  {'self_diffusion':<22} "
                    f"{each.self_diffusion_infinite.value_text:>20} "
                    f"{each.erpenbeck_wood:10.5g} by Erpenbeck and Wood"
                )
            place = f"* eta = {each.packing_fraction:g}, N = {each.n}"
            remarks |= dict.fromkeys(f"{place}: {remark}" for remark in each.remarks)
        return "\n".join([*lines, *remarks])

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write one line per coefficient; unknown numbers are empty.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        write_csv(path, COLUMNS, (list(each.values()) for each in self.rows()))

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """Draw the coefficients divided by Enskog's, and their convergence with time."""
        from carom.studies.coefficients import pictures

        return pictures.study(self, path)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a self-contained page (HTML) with the table, the pictures and their origin."""
        from carom.studies.coefficients.pictures import write_report

        write_report(self, Path(path))
