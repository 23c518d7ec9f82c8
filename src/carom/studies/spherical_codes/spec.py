"""What a search for a spherical code asks for: the section ``[code]``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from carom.declared import SEED, described, integer, needed, number, option
from carom.errors import InputError
from carom.spec import Spec

MOST = 1000
"""Largest number of points: every cap is compared with all others."""

MOST_DIGITS = 1000
"""Largest number of decimal digits of a code."""

RATES = (0.01, 0.2)
"""Default growth rates of the diameters over the thermal speed, for even and odd seeds. Slow growth orders,
and finds the best code of most sizes often. For some sizes it prefers another code: for 15 points on S^2 one
slow seed in 20 ends at the best known one, and one fast seed in six.
"""


@described
@dataclass(frozen=True)
class CodeSpec(Spec):
    """A search for points on a sphere whose smallest angle is as large as possible: one task for each try.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    study: ClassVar[str] = "spherical code"
    section: ClassVar[str] = "code"
    argument: ClassVar[str] = r"Number of points, or a file (TOML) with \[code]."
    argument_name: ClassVar[str] = "N"
    or_file: ClassVar[str] = "n"
    about: ClassVar[str] = """Spread N points on a sphere as far apart as possible.

    Caps on great circles grow until they jam, and points repel each other; hops lead to better codes. The
    contacts of the best are then solved for to many digits. The folder then holds code.json (everything),
    points.csv, code.csv (the tries), code.png, and a result file for each try in tasks/. Ctrl-C prints the
    best so far; the same command goes on.

    [bold]Examples[/bold]

    carom code 24
    carom code 24 -d 4 --out 24-cell
    carom code 19 --tries 8 --report --out nineteen
    carom code 12 --agree 3 --out icosahedron
    carom code search.toml --tries 100
    """
    grid: ClassVar[tuple[str, ...]] = ("tries", "seed", "agree", "digits")
    resets: ClassVar[Mapping[str, tuple[str, ...]]] = {"n": ("starts",), "tries": ("agree",)}

    n: int = needed(integer(low=2, high=MOST), "Number of points, 2 to 1000.", flags=None)
    dimension: int = option(integer(low=2, high=12), "Dimension of the space around the sphere.", default=3)
    tries: int | None = option(
        integer(low=1, high=10**6), "Number of random starts; by default 40 at most, until two agree."
    )
    seed: int = option(SEED, "Seed of the first try; each further one has the next.", default=1)
    agree: int | None = option(
        integer(low=2),
        "End as soon as so many tries have led to the best code; by default 2, unless tries are given.",
    )
    rate: float | None = option(
        number(low=0.0, high=1.0, open_low=True),
        "Growth rate of the diameters over the thermal speed. By default 0.01 for even seeds, as slow "
        "growth orders, and 0.2 for odd ones, as fast growth leads to more different codes.",
    )
    hops: int = option(
        integer(low=0),
        "Hops in each try. A hop moves one to three points into holes and optimizes again; a result that "
        "is not worse is kept.",
        default=20,
    )
    starts: int | None = option(
        integer(low=0),
        "Sets of points that repel each other, in each try. By default 50, and fewer for more than 60 "
        "points; with 0 the caps only grow.",
    )
    digits: int = option(integer(low=15, high=MOST_DIGITS), "Decimal digits of the result.", default=32)

    def complete(self) -> None:
        """Set the starts, which depend on n, and when to end; errors are those of :class:`CodeSpec`."""
        from carom.studies.spherical_codes.repulsion import starts_for

        if self.starts is None:
            self._put("starts", starts_for(self.n))
        if self.tries is None:
            self._put("tries", 40)
            self._put("agree", self.agree or 2)
        assert self.tries is not None
        if self.agree is not None and self.agree > self.tries:
            raise InputError(
                f"agree must be at most the number of tries ({self.tries}), found {self.agree}; give more "
                "tries."
            )

    @classmethod
    def of_argument(cls, path: str | Path) -> CodeSpec:
        """Return the search for a number, or of a file ``path``; errors are those of :class:`CodeSpec`."""
        text = str(path)
        if text.isdecimal():
            return cls(int(text))
        if Path(text).suffix != ".toml":
            raise InputError(f"N must be a number of points, or a file that ends with .toml; found {text!r}.")
        return cls.load(path)

    @property
    def exact(self) -> bool:
        """Whether the best code is known without a search: in the plane, and for at most 2 d points."""
        return self.dimension == 2 or self.n <= 2 * self.dimension

    def tasks(self) -> list[dict[str, Any]]:
        """Return the tries, by seed; none for a code that is known."""
        if self.exact:
            return []
        assert self.tries is not None
        seeds = range(self.seed, self.seed + self.tries)
        shared = self.settings()
        return [{**shared, "seed": seed, "rate": self.rate or RATES[seed % 2]} for seed in seeds]
