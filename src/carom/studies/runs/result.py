"""A finished run as a value: its summary, its g(r) and its frames."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from carom.errors import InputError
from carom.frame import Frame
from carom.io.formats import Reader
from carom.io.trajectory import open_reader
from carom.observables.rdf import rdf_of
from carom.observables.statistics import UNKNOWN, Estimate, value_with_error
from carom.results import Result
from carom.scene.scene import Scene
from carom.studies.runs.summary import HEADS, Summary, checked, read_timing
from carom.texts import counted

QUANTITIES = (
    "Z", "Z_infinite", "reduced_pressure", "contact_value", "collision_rate", "U", "temperature", "volume",
)  # fmt: skip
"""Quantities of a summary with a mean and an error."""


@dataclass(frozen=True, repr=False)
class RunResult(Result):
    """A finished run.

    Attributes
    ----------
    folder : Path
        Folder with the files of the run.
    summary : dict
        Contents of ``summary.json``.
    new : bool
        Whether the run was finished just now, and not before.
    """

    folder: Path
    summary: dict[str, Any]
    new: bool = False

    @functools.cached_property
    def _found(self) -> Summary:
        """The summary as a value with a field for each of its keys."""
        return Summary.of(self.summary)

    @property
    def n(self) -> int:
        """Number of particles."""
        return self._found.n

    @property
    def packing_fraction(self) -> float:
        """Packing fraction; under a barostat that of the mean volume."""
        return self._found.packing_fraction

    @property
    def Z(self) -> Estimate:
        """Z = PV / NkT of this number of particles; NaN where there is none."""
        return self._estimate("Z")

    @property
    def Z_infinite(self) -> Estimate:
        """Z of infinitely many particles; NaN where no theory gives the correction."""
        return self._estimate("Z_infinite")

    @property
    def reduced_pressure(self) -> Estimate:
        """P sigma^d / kT, with the largest diameter sigma; NaN where there is none."""
        return self._estimate("reduced_pressure")

    @property
    def volume(self) -> Estimate:
        """Mean volume under a barostat [length^d]; NaN in a box that keeps its volume."""
        return self._estimate("volume")

    @property
    def contact_value(self) -> Estimate:
        """g(sigma+) from the collisions; NaN where there is none."""
        return self._estimate("contact_value")

    @property
    def U(self) -> Estimate:
        """Potential energy per particle; NaN where there is none."""
        return self._estimate("U")

    @property
    def _rules_logged(self) -> bool:
        """Whether to show the run is to call the rules of its units again, which is code."""
        return bool(self._found.units) and (self.folder / "events.h5").is_file()

    def _estimate(self, name: str) -> Estimate:
        found: Estimate = getattr(self._found, name) or UNKNOWN
        return dataclasses.replace(found, n_eff=0.0) if math.isnan(found.n_eff) else found

    @property
    def frames(self) -> Reader:
        """The frames of the trajectory, as :func:`carom.open` reads them.

        Raises
        ------
        FileError
            If the run has no trajectory.
        """
        return open_reader(self.folder)

    @functools.cached_property
    def rdf(self) -> Any:
        """g(r), from the frames; of a mixture a dictionary of one for each pair of species.

        Raises
        ------
        InputError
            If the run has none; the message says why.
        FileError
            If the frames are missing or damaged.
        """
        if reason := self._found.without_rdf:
            raise InputError(f"{self.folder}: {reason}")
        with self.frames as frames:
            scene = Scene.from_frame(frames[0])
            return rdf_of(scene).over(frames)

    @property
    def timing(self) -> dict[str, float]:
        """``seconds`` of wall time, and ``collisions_per_second`` while measuring; empty if not known.

        Raises
        ------
        FileError
            If ``timing.json`` is damaged.
        """
        return read_timing(self.folder / "timing.json")

    def _words(self) -> dict[str, Any]:
        """Return numbers by name, each quantity with its error: Z, Z_error, reduced_pressure, ..."""
        names = ("n", "dimension", "packing_fraction", "kT", "collisions", "time")
        held = self._found.to_dict()
        found = {name: held[name] for name in names}
        for name in QUANTITIES:
            found |= {name: held[name]["mean"], f"{name}_error": held[name]["error"]}
        return found

    def _saved(self) -> dict[str, Any]:
        return {"folder": str(self.folder.absolute()), "summary": self.summary}

    @classmethod
    def _made(cls, values: Mapping[str, Any]) -> RunResult:
        return cls(Path(values["folder"]), checked(values["summary"], "its summary"))

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Draw g(r), or the last frame where there is no g(r).

        Parameters and errors are those of :meth:`carom.results.Result.plot`.
        """
        from carom.pictures import plots
        from carom.pictures.view import standing_beside

        if self._found.without_rdf is None and not isinstance(self.rdf, dict):
            return self.rdf.plot(path)
        last: Frame = self.frames[-1]
        return plots.snapshot(last, obstacles=standing_beside(self.folder / "trajectory", last), path=path)

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        """Return the system, and what was measured."""
        s = self._found
        title = f"{s.n} {s.system} at packing fraction {s.packing_fraction:.6g}, kT = {s.kT:.6g}"
        known = {name: x for name in ("Z", "reduced_pressure", "U") if (x := getattr(s, name)) is not None}
        return title, [
            (HEADS[k].replace(" / ", "/"), value_with_error(v.mean, v.error)) for k, v in known.items()
        ]

    def _lines(self) -> list[str]:
        """Return what is printed: the system, what was measured, where it is."""
        title, rows = self._rows()
        said = [", ".join(f"{name} = {value}" for name, value in rows)] if rows else []
        return [title, *said, f"{counted(self._found.collisions, 'collision')}; files in {self.folder}"]

    def __repr__(self) -> str:
        return f"<RunResult: {self._lines()[0]}, in {self.folder}>"
