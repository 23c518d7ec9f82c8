"""The equation of state: Z over packing fractions, sizes and replicas, compared with theory."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from carom import theory
from carom.errors import InputError
from carom.studies.eos import fits
from carom.studies.eos.measure import Point
from carom.studies.eos.spec import StudySpec
from carom.studies.eos.table import Row, compared, row
from carom.studies.grid import SCENE
from carom.studies.grid_study import GridStudy
from carom.studies.phase import end
from carom.studies.signatures import documented
from carom.table import Column, Table, error
from carom.texts import counted, superscript
from carom.theory import Equation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_NAMED = 6
"""Largest number of diameters in the title of a mixture."""


@dataclass(frozen=True)
class Virial:
    """A virial coefficient fitted to the dilute points, as the page shows it."""

    k: Annotated[int, Column("k", key=True)]
    value: Annotated[float, Column("B_k / v^(k-1)", error("error", told=True))]
    error: float
    known: Annotated[float, Column("published", ".7g")]


@dataclass(frozen=True, repr=False)
class EquationOfState(GridStudy[StudySpec]):
    """Z at every point of a study, and derived results.

    Attributes
    ----------
    spec : StudySpec
        The requested study.
    records : sequence of dict
        Results of the finished tasks, in the order of the tasks.
    failures : sequence of Failure
        Tasks that failed in this session; they run again when the study does.
    folder : Path or None
        Where the records are kept.
    engine : str
        Where this session ran.
    seconds : float
        Wall time of this session [s].
    equation : callable or None
        Equation of state to compare with, instead of the usual one.
    """

    equation: Equation | None = None

    Spec: ClassVar[type[StudySpec]] = StudySpec
    name: ClassVar[str] = "eos"
    measure = staticmethod(Point.measure)

    @functools.cached_property
    def table(self) -> Table:
        """One :class:`Row` for each point, in the order of packing fraction and n."""
        rows = [row(records, self.equation) for records in self.by_point()]
        units = (
            f"P* = P σ{superscript(self.spec.dimension)}/kT, σ the largest diameter. "
            "dev. = (infinite - theory) / standard error."
        )
        remarks = [
            f"* η = {each.packing_fraction:.5g}, N = {each.n}: {'; '.join(each.remarks)}"
            for each in rows
            if each.remarks
        ]
        last = end(self.spec.dimension)
        if self.equation is None and any(r.phase == "fluid" and r.packing_fraction > last for r in rows):
            units += f" The equation of state of the fluid ends at {last:g}: no theory beyond."
        d = self.spec.dimension
        beyond = any(round(r.packing_fraction, 9) >= theory.FREEZING.get(d, 1.0) for r in rows)
        if beyond and len(self._species()) == 1 and compared(self.records[0]):
            units += (
                f" In {d}D the fluid freezes at {theory.FREEZING[d]:g} and the solid melts at "
                f"{theory.MELTING[d]:g}: between these, phases may coexist."
            )
        return Table(Row, rows, notes=[units, *remarks], flagged=lambda each: not each.equilibrated)

    @property
    def chi2_per_point(self) -> float:
        """Mean square of the deviations from theory, over the fluid's points in equilibrium; nan if none."""
        fluid = (each for each in self.table if each.equilibrated and each.phase == "fluid")
        squares = [each.deviation**2 for each in fluid if math.isfinite(each.deviation)]
        return math.fsum(squares) / len(squares) if squares else math.nan

    def _species(self) -> Sequence[Sequence[float]]:
        """Return the diameters, and the number of particles with each."""
        return self.records[0]["result"]["species"] if self.records else []

    def virials(self, *, up_to: float | None = None, order: int = 4) -> fits.Virials:
        """Fit virial coefficients; ``up_to`` and ``order`` as in :func:`carom.studies.eos.fits.virials`."""
        known = None
        if len(species := self._species()) > 1:
            diameters, total = [s for s, _ in species], sum(c for _, c in species)
            fractions = [c / total for _, c in species]
            known = [theory.mixture_second_virial(fractions, diameters, self.spec.dimension)]
        return fits.virials(self.table, up_to=up_to, order=order, known=known)

    def extrapolate(self) -> list[fits.Extrapolation]:
        """Extrapolate to infinite size; see :func:`carom.studies.eos.fits.extrapolate`."""
        return fits.extrapolate(self.table)

    def with_theory(self, equation: Equation) -> EquationOfState:
        """Return the study compared with another ``equation`` of state, e.g. ``theory.henderson``."""
        return dataclasses.replace(self, equation=equation)

    def sentences(self) -> list[str]:
        """Return the comparison with theory, and how many points are flagged."""
        said, flagged = super().sentences(), sum(not each.equilibrated for each in self.table)
        if math.isfinite(chi2 := self.chi2_per_point):
            said.append(f"Mean squared deviation of the fluid from theory, in standard errors: {chi2:.2f}.")
        if flagged:
            said.append(f"{counted(flagged, 'point')} flagged, and left out of fits.")
        return said

    @property
    def title(self) -> str:
        """What was studied, with the diameters of a mixture."""
        from carom.studies.eos.pictures import kind

        mixed = len(species := self._species()) > 1
        name = kind(self.spec.dimension, self.spec.scene, mixture=mixed)
        return f"Equation of state of {'a ' * mixed}{name}{composition(species)}"

    def __repr__(self) -> str:
        return f"<EquationOfState: {counted(len(self.table), 'point')}, {self.progress} done>"

    def more(self) -> dict[str, Any]:
        """Return the fits in 1 / N, and the comparison with theory."""
        fitted = [dataclasses.asdict(fit) for fit in self.extrapolate()]
        return {"extrapolation": fitted, "chi2_per_point": self.chi2_per_point}

    def parts(self) -> Iterator[tuple[str, Table | Figure]]:
        """Yield the pictures and fits of the page."""
        from carom.studies.eos import pictures

        yield from super().parts()
        if (figure := pictures.order(self)) is not None:
            yield "Order parameter", figure
        if (figure := pictures.sizes(self)) is not None:
            yield "Size of the system", Table(fits.Extrapolation, self.extrapolate())
            yield "Size of the system", figure
        try:
            found = self.virials()
        except InputError:
            return
        each = zip(found.values, found.errors, found.known, strict=True)
        lines = [Virial(k, *numbers) for k, numbers in enumerate(each, start=2)]
        said = f"From {counted(found.points, 'point')}, χ² = {found.chi2:.1f}."
        yield "Virial coefficients", Table(Virial, lines, notes=[said])

    def picture(self) -> Figure | None:
        """Return what :meth:`plot` draws."""
        return self.plot() if self.table else None

    def plot(
        self,
        path: str | PathLike[str] | None = None,
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


def composition(species: Sequence[Sequence[float]]) -> str:
    """Return the diameters of a mixture and their fractions, at most six; "" for one diameter."""
    if len(species) < 2:
        return ""
    total = sum(count for _, count in species)
    sizes = [f"{count / total:.3g} of diameter {diameter:.4g}" for diameter, count in species[:MOST_NAMED]]
    more = f" and {len(species) - MOST_NAMED} sizes more" if len(species) > MOST_NAMED else ""
    return ": " + ", ".join(sizes) + more


@documented(
    EquationOfState, scene=SCENE, equation="Equation of state to compare with, instead of the usual one."
)
def equation_of_state(
    packing_fraction: Iterable[float] | float | None = None,
    *,
    scene: str | PathLike[str] | Mapping[str, Any] | None = None,
    equation: Equation | None = None,
    how: Mapping[str, Any],
    **given: Any,
) -> EquationOfState:
    """Measure Z over packing fractions, numbers of particles and replicas.

    @

    Returns
    -------
    EquationOfState
        Z at every point.

    Examples
    --------
    >>> import carom
    >>> study = carom.equation_of_state(
    ...     [0.1, 0.2], n=100, collisions_per_particle=200, equilibration=50, executor="serial"
    ... )
    >>> [row.equilibrated for row in study.table]
    [True, True]
    """
    spec = StudySpec.of(scene, {"packing_fraction": packing_fraction, **given})
    return EquationOfState(spec, equation=equation).run(**how)
