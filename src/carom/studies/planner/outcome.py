"""The outcome of a plan: the promise, and the result."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from carom.observables.statistics import Estimate
from carom.paths import write_text
from carom.studies.folder import Record
from carom.studies.planner.choice import duration

NAME = "outcome.json"
"""File of the outcome, in the folder of a plan."""

KEPT = 1.3
"""Reached error over promised error up to which a promise is kept: error bars are themselves uncertain."""


@dataclass(frozen=True)
class Outcome:
    """What a plan promised, and what its runs reached.

    Attributes
    ----------
    plan : RunPlan
        The plan that was run.
    value : Estimate
        The quantity of the infinite system, with the statistical error.
    bias : float
        Possible remaining bias after the correction to infinite size.
    cpu_seconds : float
        CPU time of all runs [s].
    records : list of dict
        Results of the single runs.
    remarks : tuple of str
        Doubts about the result.
    """

    plan: Any
    value: Estimate
    bias: float
    cpu_seconds: float
    records: list[Record]
    remarks: tuple[str, ...] = ()

    @property
    def error(self) -> float:
        """Error that was reached, bias included."""
        return math.hypot(self.value.error, self.bias)

    @property
    def error_ratio(self) -> float:
        """Reached error over promised error."""
        return self.error / self.plan.error

    @property
    def kept(self) -> bool:
        """Whether the promised error was reached, within its own uncertainty."""
        return self.error_ratio <= KEPT

    @property
    def time_ratio(self) -> float:
        """CPU time used over promised CPU time."""
        return self.cpu_seconds / self.plan.cpu_seconds

    def words(self) -> dict[str, Any]:
        """Return promise and outcome as JSON values."""
        return {
            "target": str(self.plan.target),
            "quantity": self.plan.target.quantity,
            "value": self.value.mean,
            "promised": {"error": self.plan.error, "cpu_seconds": self.plan.cpu_seconds},
            "reached": {
                "error": self.error,
                "statistical": self.value.error,
                "bias": self.bias,
                "cpu_seconds": self.cpu_seconds,
            },
            "remarks": list(self.remarks),
        }

    def save(self, folder: str | PathLike[str]) -> Path:
        """Write ``outcome.json`` to a ``folder``, and return its path.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        path = Path(folder) / NAME
        write_text(path, json.dumps(self.words(), indent=1, allow_nan=False) + "\n")
        return path

    def __str__(self) -> str:
        shown = Estimate(self.value.mean, self.error, 1.0, 1.0, 1).value_text
        lines = [
            f"{self.plan.target.quantity} = {shown} for infinitely many, bias included",
            f"error   promised {self.plan.error:.2g}, reached {self.error:.2g}: {self.error_ratio:.2f} of it",
            f"CPU     promised {duration(self.plan.cpu_seconds)}, taken {duration(self.cpu_seconds)}: "
            f"{self.time_ratio:.2f} of it",
        ]
        return "\n".join([*lines, *self.remarks])
