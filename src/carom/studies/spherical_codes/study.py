"""A spherical code as a study: a table of the tries, and the best code."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from carom.errors import InputError
from carom.studies.folder import Record, Task
from carom.studies.signals import Interrupted
from carom.studies.signatures import documented
from carom.studies.spherical_codes.code import SphericalCode
from carom.studies.spherical_codes.search import Try, angle_of, best_of, exact, first_to_agree, reached
from carom.studies.spherical_codes.spec import CodeSpec
from carom.studies.study import Study
from carom.table import Column, Table, facts
from carom.texts import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Row:
    """One try: its code, and whether it is the best one."""

    seed: Annotated[int | None, Column("seed", missing="none", key=True)]
    rate: Annotated[float | None, Column("rate", "g", key=True)]
    angle: Annotated[float, Column("angle / degrees", ".9f")]
    contacts: Annotated[int | None, Column("contacts")]
    rattlers: Annotated[int | None, Column("rattlers")]
    best: Annotated[bool, Column("best", lambda value, row: "yes" if value else "", left=True)]
    note: Annotated[str, Column("note", left=True)]


@dataclass(frozen=True, repr=False)
class Codes(Study[CodeSpec]):
    """A search for a spherical code.

    Attributes are as for :class:`carom.studies.eos.study.EquationOfState`.
    """

    Spec: ClassVar[type[CodeSpec]] = CodeSpec
    name: ClassVar[str] = "code"
    unit: ClassVar[str] = "tries"
    anytime: ClassVar[bool] = True
    measure = staticmethod(Try.measure)

    @functools.cached_property
    def code(self) -> SphericalCode | None:
        """The best code so far; None if no try led to one."""
        if self.spec.exact:
            return exact(self.spec.n, self.spec.dimension, self.spec.digits)
        return best_of(self.records, self.spec.digits)

    def enough(self, records: Sequence[Record]) -> int | None:
        """Return how many of the first ``records`` hold as many as asked for that agree on the best code."""
        if self.spec.agree is None:
            return None
        return first_to_agree([record["result"]["cosine"] for record in records], self.spec.agree)

    def place(self, task: Task) -> str:
        """Return where a ``task`` is, in words: its seed."""
        return f"from seed {task['seed']}"

    @property
    def title(self) -> str:
        """What is searched for."""
        return f"Spherical code of {self.spec.n} points on S^{self.spec.dimension - 1}"

    @property
    def table(self) -> Table:
        """One :class:`Row` for each try; a code that is known without a search is one row."""
        if self.spec.exact and self.code is not None:
            numbers = len(self.code.contacts), len(self.code.rattlers)
            return Table(Row, [Row(None, None, self.code.angle, *numbers, True, self.code.note)], self.title)
        rows, best = [], set(reached(self.records))
        for task, result in ((record["task"], record["result"]) for record in self.records):
            held = None if result["points"] is None else {i for pair in result["contacts"] for i in pair}
            rows.append(
                Row(
                    task["seed"], task["rate"], angle_of(result["cosine"]),
                    None if held is None else len(result["contacts"]),
                    None if held is None else self.spec.n - len(held),
                    task["seed"] in best, result.get("problem", ""),
                )
            )  # fmt: skip
        return Table(Row, rows, self.title, flagged=lambda row: not best)

    @property
    def underway(self) -> str:
        """How far the search is, and the best angle so far."""
        angles = [angle_of(cosine) for r in self.records if (cosine := r["result"]["cosine"]) is not None]
        return f"{self.progress}, best {max(angles):.7f} degrees" if angles else self.progress

    def sentences(self) -> list[str]:
        """Return the results for the code."""
        if self.code is None:
            return [self._none()] if self.records or self.failures else []
        return [f"{name.capitalize()}: {text}." for name, text in self.code.words()]

    def _none(self) -> str:
        """Return why there is no code."""
        if not self.records:
            first = self.failures[0]
            return f"The search {self.place(first.task)} failed: {first.reason}."
        first_record = self.records[0]
        return (
            f"None of {counted(len(self.records), 'try')} led to a code; {self.place(first_record['task'])}, "
            f"{first_record['result']['problem'].rstrip('.')}. Give more tries."
        )

    def more(self) -> dict[str, Any]:
        """Return the results for the code."""
        return {} if self.code is None else self.code._words()

    def parts(self) -> Iterator[tuple[str, Table | Figure]]:
        """Yield the code of the page, and its picture on S^2."""
        if self.code is not None:
            yield "The best code", facts("", self.code.words())
            if self.spec.dimension == 3:
                yield "The best code", self.plot()

    def picture(self) -> Figure | None:
        """Return the caps of the best code, if it is on S^2."""
        return None if self.code is None else self.code.plot()

    def files(self) -> dict[str, Callable[[Path], object]]:
        """Return what writes the table of tries, the code, its points and, on S^2, its picture."""
        found: dict[str, Callable[[Path], object]] = {"code.csv": self.save}
        if self.records and self.code is None:
            return found
        found |= dict.fromkeys(("code.json", "points.csv"), self._write)
        return found | ({"code.png": self._draw} if self.spec.dimension == 3 else {})

    def _write(self, path: Path) -> None:
        """Write the best code, if there is one."""
        if self.code is not None:
            self.code.save(path)


@documented(Codes, n="Number of points, 2 to 1000, or a scene file (TOML) with [code].")
def spherical_code(
    n: int | str | PathLike[str], dimension: int | None = None, *, how: Mapping[str, Any], **given: Any
) -> SphericalCode:
    """Search for n points on the unit sphere in d dimensions whose smallest angle is as large as possible.

    In every try, random points move on great circles and grow into caps until they jam (Smith; the paper's
    sec. 11). In addition, sets of points that repel each other lead to other codes, in a hundredth of the
    time. Hops improve the better of both. Newton's method then solves the equations of the contacts, for the
    best code in ``mpmath``.

    @

    Returns
    -------
    SphericalCode
        The best code. For d = 2 and for n <= 2 d it is the known optimum, without a search.

    Notes
    -----
    With ``agree``, the tries are those of the shortest sequence of seeds of which so many led to its best
    code: the result is the same on any number of cores. After Ctrl-C, ``so_far`` of the exception is the
    best code until then.

    Examples
    --------
    >>> import carom
    >>> code = carom.spherical_code(6)
    >>> code.angle, len(code.contacts), code.note
    (90.0, 12, 'the cross-polytope, optimal (Rankin 1955)')
    """
    try:
        study = Codes(CodeSpec.of(n, {"dimension": dimension, **given})).run(**how)
    except Interrupted as stopped:
        raise Interrupted(str(stopped), stopped.so_far.code) from None
    if study.code is None:
        raise InputError(study._none())
    return study.code
