"""Packings as a study: one for each seed, and the means over them."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np

from carom.errors import InputError
from carom.observables.statistics import value_with_error
from carom.results import as_saved, from_dict
from carom.studies.folder import Task
from carom.studies.packings.compression import PER_FACTOR, Compression, N
from carom.studies.packings.pack import asked_of
from carom.studies.packings.packing import Packing
from carom.studies.packings.spec import PackSpec
from carom.studies.signatures import documented
from carom.studies.study import Study
from carom.table import Column, Table
from carom.texts import counted, particles

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEEDS = 8
"""Default number of packings of a study."""

MEANS = ("packing_fraction", "jamming_fraction", "rattler_fraction")
"""Results of which the means are known."""


@dataclass(frozen=True)
class Row:
    """One packing."""

    seed: Annotated[int, Column("seed", key=True)]
    packing_fraction: Annotated[float, Column("packing fraction", ".8f")]
    jamming_fraction: Annotated[float | None, Column("jams at", ".8f", missing="unknown")]
    Z: Annotated[float | None, Column("Z", ".3g", missing="unknown")]
    rattlers: Annotated[int | None, Column("rattlers", missing="unknown")]
    rattler_fraction: float | None
    contacts: int | None
    excess: Annotated[int | None, Column("excess", "+d", missing="unclear")]
    collisions: int
    note: str


class Seed(Compression):
    """The packing of a seed."""

    @classmethod
    def begin(cls, task: Task) -> Self:
        """Return the packing that a ``task`` describes, at its start."""
        asked = PackSpec.of_task(task)
        return cls.begun(asked.start(asked.seed), asked)

    def result(self) -> dict[str, Any]:
        """Return the packing as JSON values."""
        return as_saved(self.packing())


@dataclass(frozen=True, repr=False)
class Packings(Study[PackSpec]):
    """Packings of several seeds.

    Attributes are as for :class:`carom.studies.eos.study.EquationOfState`.
    """

    Spec: ClassVar[type[PackSpec]] = PackSpec
    name: ClassVar[str] = "pack"
    unit: ClassVar[str] = "packings"
    measure = staticmethod(Seed.measure)

    @staticmethod
    def cost(task: Task) -> float:
        """Return the work of a task [collisions], as far as it is known before."""
        n = task.get("n") or sum(each.get("count") or 0 for each in task.get("species", ())) or N
        ends = [
            (stage.rate, math.log(stage.until_Z)) for stage in PackSpec.of_task(task).plan if stage.until_Z
        ]
        steps = zip(ends, [0.0, *(end for _, end in ends)], strict=False)
        factor = 0.5 * n * PER_FACTOR.get(task["dimension"], PER_FACTOR[3])
        wanted = sum(factor / rate * max(end - begin, 0.0) for (rate, end), begin in steps)
        return min(max(wanted, 1.0) if ends else math.inf, task.get("collisions") or math.inf)

    @property
    def first(self) -> str:
        """What is said before the first task is done: what a packing costs."""
        return f"{super().first}, of about {self.cost(self.tasks[0]):.2g} collisions each"

    @functools.cached_property
    def packings(self) -> tuple[Packing, ...]:
        """The packings, by seed."""
        return tuple(from_dict(record["result"]) for record in self.records)

    @functools.cached_property
    def table(self) -> Table:
        """One :class:`Row` for each packing; ``excess`` is the number of contacts less the isostatic one."""
        rows: list[Row] = []
        ends: dict[str, list[int]] = {}
        for found in (record["result"] for record in self.records):
            values = {name: found[name] for name in Row.__dataclass_fields__}
            if found["contacts_note"]:  # the number of contacts is not known then
                values |= {"contacts": None, "excess": None}
            rows.append(Row(**values))
            ends.setdefault(found["note"], []).append(found["seed"])
        notes = ["excess: contacts - isostatic number."] if rows else []
        if any(row.excess is None for row in rows):
            notes.append("unclear: no void separates the gaps of contacts from those of other pairs.")
        for note, seeds in ends.items():
            which = f" (seeds {', '.join(map(str, seeds))})" if len(ends) > 1 else ""
            notes.append(f"Ended: {note}{which}.")
        return Table(Row, rows, notes=notes)

    def mean(self, name: str) -> tuple[float, float]:
        """Return the mean of a column of the table and its standard error; NaN where they are not known.

        Parameters
        ----------
        name : str
            Name of a column of numbers, e.g. ``"jamming_fraction"``.

        Raises
        ------
        InputError
            If there is no such column.
        """
        if name not in self.table.names() or name == "note":
            raise InputError(f"The table has no numbers {name!r}; expected one of {', '.join(MEANS)}.")
        values = [value for row in self.table if (value := getattr(row, name)) is not None]
        if not values:
            return math.nan, math.nan
        error = float(np.std(values, ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else math.nan
        return float(np.mean(values)), error

    def place(self, task: Task) -> str:
        """Return where a ``task`` is, in words: its seed."""
        return f"of seed {task['seed']}"

    @property
    def title(self) -> str:
        """What was packed."""
        if not self.records:
            return "Packings"
        found = self.records[0]["result"]
        return f"Packings of {found['n']} {particles(found['dimension'], found['n'])}"

    def sentences(self) -> list[str]:
        """Return the means."""
        found = {name.replace("_", " "): self.mean(name) for name in MEANS}
        known = [
            f"{name} {value_with_error(*mean)}" for name, mean in found.items() if math.isfinite(mean[1])
        ]
        if not known:
            return []
        return [f"Means and standard errors over {counted(len(self.table), 'packing')}: {', '.join(known)}."]

    def more(self) -> dict[str, Any]:
        """Return the means and their standard errors."""
        found = {name: self.mean(name) for name in MEANS}
        return {
            **{name: mean for name, (mean, _) in found.items()},
            **{f"{name}_error": error for name, (_, error) in found.items()},
        }

    def picture(self) -> Figure | None:
        """Return the jamming fraction of each seed, their mean and its standard error."""
        from carom.figures import style

        known = [(row.jamming_fraction, row.seed) for row in self.table if row.jamming_fraction is not None]
        if not known:
            return None
        figure, axes = style.sheet(5.0, 3.6)
        mean, error = self.mean("jamming_fraction")
        axes.axvline(mean, color="0.4", lw=0.8)
        if math.isfinite(error):
            axes.axvspan(mean - error, mean + error, color="0.85", lw=0.0)
        axes.plot(*zip(*known, strict=True), "o", ms=4)
        axes.set_xlabel("jamming fraction, mean and standard error")
        axes.set_ylabel("seed")
        axes.locator_params(axis="y", integer=True)
        axes.locator_params(axis="x", nbins=5)
        axes.ticklabel_format(axis="x", useOffset=False)
        style.lay_out(figure, axes)
        return figure

    def files(self) -> dict[str, Callable[[Path], object]]:
        """Return what writes the table, the picture, and a folder for each packing."""
        seeds = [task["seed"] for task in self.tasks]
        return super().files() | {f"seed-{seed}": functools.partial(self._write, seed) for seed in seeds}

    def _write(self, seed: int, folder: Path) -> None:
        """Write the folder of the packing of a seed, if it is done."""
        for packing in self.packings:
            if packing.seed == seed:
                packing.save(folder, pictures=False)


@documented(
    Packings,
    n="Number of points; 1000, or that of the species, if left out. Or a scene file (TOML) with [pack].",
    seeds="Number of packings; 8 if left out.",
)
def packings(n: int | str | PathLike[str] | None = None, *, how: Mapping[str, Any], **given: Any) -> Packings:
    """Pack points of several seeds, each as :func:`carom.pack` does.

    @

    Returns
    -------
    Packings
        The packings, and the means over them.

    Examples
    --------
    >>> import carom
    >>> study = carom.packings(30, dimension=2, seeds=3, rate=0.1, until_Z=1e6, executor="serial")
    >>> [row.seed for row in study.table], study.packings[0].note
    ([1, 2, 3], 'Z = PV/NkT = 1e+06 reached')
    """
    asked, _ = asked_of(n, given)
    return Packings(asked.replaced(seeds=asked.seeds or SEEDS)).run(**how)
