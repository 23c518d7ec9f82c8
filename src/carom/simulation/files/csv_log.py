"""A table of a run that grows while it runs: time, collisions, kT, Z, potential energy, or others."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom.errors import FileError, InputError
from carom.paths import replacing, writing
from carom.simulation.measuring import stretches

if TYPE_CHECKING:
    from carom.block import Block
    from carom.simulation.simulation import Simulation

COLUMNS = ("time", "collisions", "kT", "Z", "U")


class CSVLog:
    """What writes a row of a CSV file whenever a run calls it.

    Parameters
    ----------
    path : path
        The file.
    columns : sequence of str, or dict of str to callable, optional
        Names of columns: ``time``, ``collisions`` (of pairs), ``kT``, ``Z`` = PV/NkT, ``U`` (potential energy
        a particle). By default those that the scene has. Or a dict of a name and a function of the simulation
        each; ``None`` in place of the function of a column that has one of these names.
    append : bool
        Go on with a file that exists, after a resumed run. Rows at or after the present time are dropped.

    Raises
    ------
    InputError
        If there is no column of a name.
    FileError
        When it is first called: if the file exists and ``append`` is not given, has other columns, or cannot
        be written.

    Notes
    -----
    Z is that of the time since the row before, and of the first row since the start of the simulation; it is
    empty in the first row after a resume. Means over many rows are means over time.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(100, 0.3))
    >>> block = sim.run(time=10.0, every=1.0, call=carom.CSVLog("fluid.csv"))  # doctest: +SKIP
    """

    def __init__(
        self,
        path: str | PathLike[str],
        columns: Sequence[str] | Mapping[str, Callable[[Any], object] | None] | None = None,
        *,
        append: bool = False,
    ):
        self.path = Path(path)
        self._place = self.path.absolute()  # the folder of the process may change before it grows
        self._append = append
        given = columns if isinstance(columns, Mapping) else dict.fromkeys(columns or ())
        for name, function in given.items():
            if function is None and name not in COLUMNS:
                raise InputError(
                    f"CSVLog has no column {name!r}; known are {', '.join(COLUMNS)}, and for others a "
                    "function of the simulation is needed."
                )
        self._columns = dict(given)
        self._numbers = Numbers()
        self._open = False

    def __call__(self, sim: Simulation) -> None:
        """Write a row."""
        if not self._columns:
            self._columns = dict.fromkeys(columns_of(sim))
        if not self._open:
            self._begin(stretches.tally(sim))
        found = self._numbers(sim, [name for name, function in self._columns.items() if function is None])
        entries = [found[n] if function is None else function(sim) for n, function in self._columns.items()]
        _write(self._place, [["" if entry is None else entry for entry in entries]], "a")

    def _begin(self, now: Block) -> None:
        """Begin the file, or go on with it."""
        earlier_rows: list[list[str]] = []
        head = list(self._columns)
        if self._place.exists():
            if not self._append:
                raise FileError(
                    f"{self.path} exists already and was left as it is; choose another name, or append=True."
                )
            earlier_rows = _rows(self._place)
            if earlier_rows and earlier_rows[0] != head:
                raise FileError(
                    f"{self.path} has the columns {', '.join(earlier_rows[0])}; expected {', '.join(head)}."
                )
            earlier_rows = earlier_rows[1:]
            if "time" in head:
                time_column = head.index("time")
                try:
                    earlier_rows = [row for row in earlier_rows if float(row[time_column]) < now.duration]
                except (ValueError, IndexError):
                    raise FileError(
                        f"{self.path} has a row without a time, and was left as it is; choose another name."
                    ) from None
            self._numbers = Numbers(now)
        with replacing(self._place) as whole:  # a full disk leaves the rows that were there
            _write(whole, [head, *earlier_rows], "w")
        self._open = True


class Numbers:
    """The columns of a run at the present; Z is that of the time since it was last called."""

    def __init__(self, before: Block | None = None):
        self._before = before

    def __call__(self, sim: Simulation, names: Iterable[str]) -> dict[str, float | int | None]:
        """Return the columns of some names; Z is None where no time has passed."""
        now = stretches.tally(sim)
        found = {name: self._value(name, sim, now) for name in names}
        self._before = now
        return found

    def _value(self, name: str, sim: Simulation, now: Block) -> float | int | None:
        if name == "time":
            return now.duration
        if name == "collisions":
            return now.collisions
        if name == "kT":
            return sim.kT
        if name == "U":
            return sim.potential_energy / sim.n
        before = self._before
        time = now.duration - (0.0 if before is None else before.duration)
        virial = now.virial - (0.0 if before is None else before.virial)
        heat = sim.kT * time
        if now.kT_time is not None:
            heat = now.kT_time - (0.0 if before is None else before.kT_time or 0.0)
        z = 1.0 + virial / (sim.scene.dimension * sim.n * heat) if heat > 0.0 else math.nan
        return None if math.isnan(z) else z


def columns_of(sim: Simulation) -> tuple[str, ...]:
    """Return the columns that a scene has."""
    from carom.observables.energy import without_potential
    from carom.observables.pressure import without_pressure

    missing = {"Z": without_pressure(sim.scene), "U": without_potential(sim.scene)}
    return tuple(name for name in COLUMNS if not missing.get(name))


def _rows(path: Path) -> list[list[str]]:
    """Return the rows of a file."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            return [row for row in csv.reader(file) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FileError(f"{path} cannot be read as a table: {error}.") from error


def _write(path: Path, rows: Sequence[Sequence[object]], mode: str) -> None:
    """Write rows to a file."""
    with writing(path), path.open(mode, newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)
