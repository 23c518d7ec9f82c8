"""Speed against accuracy as a study: a table of methods, one of sizes, one of intervals of sampling."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from carom.paths import write_text
from carom.studies.folder import Record, Task
from carom.studies.job import Look
from carom.studies.study import Study
from carom.studies.trade.rows import Row, SamplingRow, SizeRow, row, sampling_row, size_row
from carom.studies.trade.spec import ENGINE, TradeSpec
from carom.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHOICE = "When to choose it"
FIRST = (
    "Speed; collisions a particle until positions are lost; relative bias of Z ± standard error; its error "
    "after one CPU second"
)
REST = (
    "All figures are in trade.csv, sizes.csv (how many particles) and sampling.csv (how often to sample); "
    "--report shows them on a page."
)

VIEWS: dict[str, tuple[str, ...]] = {
    "Speed, memory, faults in a million collisions": (
        "method", "collisions_per_second", "bytes_per_particle", "worst_overlap", "energy_drift",
        "momentum_drift",
    ),
    "Trajectories: collisions a particle until lost; error after one; error forward and back [σ]": (
        "method", "horizon_order", "horizon_position", "error_1", "back_5", "back_10", "back_20",
    ),
    "Bias, relative, ± standard error": ("method", "z_bias", "contact_bias", "diffusion_bias"),
    CHOICE: ("method", "choice"),
    "Relative error after one CPU second": ("method", "n_speed", "z_cost", "diffusion_cost", "diffusion"),
}  # fmt: skip
"""Columns of the rows of methods that are shown together."""


def measure(task: Task, look: Look) -> dict[str, Any]:
    """Return the row that a ``task`` describes; ``look`` ends it, as in any study."""
    from carom.studies.trade.trade import TradeRow

    return TradeRow.measure(task, look)


@dataclass(frozen=True, repr=False)
class Trade(Study[TradeSpec]):
    """Methods compared by speed and accuracy.

    Its numbers are those of this machine, and of one time: they are measured in CPU time.

    Attributes are as for :class:`carom.studies.eos.study.EquationOfState`.
    """

    Spec: ClassVar[type[TradeSpec]] = TradeSpec
    name: ClassVar[str] = "trade"
    unit: ClassVar[str] = "rows"
    measure = staticmethod(measure)

    @staticmethod
    def cost(task: Task) -> float:
        """Return the work of a ``task``, roughly in ``seconds``."""
        return 2.0 if task["row"] == "method" else 1.0

    def place(self, task: Task) -> str:
        """Return what a ``task`` is, in words."""
        given = {**task, **task.get("method", {})}
        names = ("kind", "precision", "digits", "step", "cells", "interval")
        words = [f"{name} {given[name]}" for name in names if given.get(name)]
        return f"of {', '.join([task['row'], *words])}"

    def _of(self, kind: str) -> list[Record]:
        """Return the finished rows of a kind."""
        return [record for record in self.records if record["task"]["row"] == kind]

    @property
    def _reference(self) -> dict[str, Any] | None:
        """What the engine found in the small scene, and how long trajectories can be followed."""
        return next((record["result"] for record in self._of("reference")), None)

    @functools.cached_property
    def rows(self) -> tuple[Row, ...]:
        """The figures of each method."""
        methods = self._of("method")
        engine = [record for record in methods if record["task"]["method"] == ENGINE]
        references = {}
        # Slow methods are compared with the engine on the small scene.
        for found in (record["result"] for record in [*self._of("reference"), *engine]):
            z = found["expected"]  # without a theory, the engine's own Z
            references[found["n"]] = (found["Z"][0] if z is None else z, found["D"])
        return tuple(row(record, references) for record in methods)

    @functools.cached_property
    def sizes(self) -> Table:
        """One :class:`SizeRow` for each number of particles."""
        return Table(SizeRow, [size_row(record) for record in self._of("size")], "Z: how many particles")

    @functools.cached_property
    def sampling(self) -> Table:
        """One :class:`SamplingRow` for each interval of sampling."""
        rows = [sampling_row(record) for record in self._of("interval")]
        return Table(SamplingRow, rows, "g(r): how often to sample one stretch of time")

    @property
    def table(self) -> Table:
        """One :class:`Row` for each method."""
        return self.tables()[0]

    def tables(self) -> list[Table]:
        """Return what is shown: the rows of methods in five views, sizes, intervals of sampling."""
        views = [Table(Row, self.rows, title, only=names) for title, names in VIEWS.items()]
        return [*views, self.sizes, self.sampling]

    def printed(self) -> list[Table]:
        """Return speed, horizon and bias of Z of each method, and when to choose it."""
        first = Table(
            Row,
            self.rows,
            FIRST,
            only=("method", "collisions_per_second", "horizon_position", "z_bias", "z_cost"),
        )
        return [first, replace(self.tables()[list(VIEWS).index(CHOICE)], notes=[REST])]

    def sentences(self) -> list[str]:
        """Return the scenes, and the horizon by theory."""
        found = self._reference
        if found is None:
            return []
        h = found["horizon"]
        exponent = h["published_to_one"]
        known = "" if exponent is None else f" (published exponent: {exponent:.1f})"
        return [
            f"Speed: {found['scene']}.",
            f"Trajectories: {found['small']}.",
            f"Theory for doubles, ln(1/eps) / λ times the collision rate: {h['to_one']:.1f} collisions a "
            f"particle to 1 σ{known}, {h['to_apart']:.1f} to 0.001 σ; λ = {h['lyapunov']:.3g}, rate "
            f"{h['rate']:.3g}.",
        ]

    def more(self) -> dict[str, Any]:
        """Return the other tables, and how long trajectories can be followed."""
        tables = {"sizes": self.sizes.dictionaries(), "sampling": self.sampling.dictionaries()}
        return {**tables, "horizon": None if self._reference is None else self._reference["horizon"]}

    def picture(self) -> Figure | None:
        """Return errors against speed, and the error of Z against N."""
        from carom.studies.trade.picture import picture

        return picture(self.rows, self.sizes) if self.rows else None

    def files(self) -> dict[str, Callable[[Path], object]]:
        """Return what writes the three tables and the picture."""
        tables = {"trade.csv": self.table, "sizes.csv": self.sizes, "sampling.csv": self.sampling}
        return super().files() | {
            name: functools.partial(write_text, text=table.csv()) for name, table in tables.items()
        }
