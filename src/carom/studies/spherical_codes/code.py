"""A spherical code: its points to many digits, its contacts, and the files that hold it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.io import records
from carom.paths import write_text
from carom.results import Result
from carom.studies.spherical_codes.newton import GUARD
from carom.studies.spherical_codes.spec import MOST_DIGITS
from carom.texts import counted

FORMAT = "carom spherical code"
"""Value of the key "format" in a file."""


@dataclass(frozen=True, eq=False)
class SphericalCode(Result):
    """Points on the unit sphere in d dimensions, with the largest minimal angle that was found.

    Attributes
    ----------
    coordinates : (n, d) object array
        Coordinates of the points, as ``mpmath`` numbers.
    cosine : mpf
        Cosine of the smallest angle.
    residual : mpf
        Largest residual of the equations: of ``x_i . x_j - cosine`` at contacts, and of ``(x_i . x_i - 1) /
        2``.
    digits : int
        Number of known decimal digits of coordinates and cosine.
    contacts : (m, 2) array
        Pairs at the smallest angle that bear a force.
    forces : (m,) array
        Forces along the contacts, all positive, with the sum 1.
    rattlers : (r,) array
        Indices of the points that no contact holds.
    rigid : bool
        Whether the code is a strict local optimum, apart from rattlers and rotations.
    seed : int or None
        The first seed that led to this code; None without a search.
    angles : dict of int to float
        Smallest angle found from each seed [degrees]; NaN if its caps did not jam.
    reached : int
        Number of tries that led to this angle.
    note : str
        Origin of the code.
    """

    coordinates: np.ndarray
    cosine: Any
    residual: Any
    digits: int
    contacts: np.ndarray
    forces: np.ndarray
    rattlers: np.ndarray
    rigid: bool
    seed: int | None
    angles: dict[int, float]
    reached: int
    note: str

    @property
    def n(self) -> int:
        """Number of points."""
        return len(self.coordinates)

    @property
    def dimension(self) -> int:
        """Number of dimensions of the space around the sphere, d."""
        return self.coordinates.shape[1]

    @property
    def points(self) -> np.ndarray:
        """Points in double precision, (n, d)."""
        return self.coordinates.astype(np.float64)

    @property
    def precise_angle(self) -> Any:
        """Smallest angle, a number of ``mpmath`` [degrees]."""
        import mpmath

        with mpmath.workdps(self.digits + GUARD):
            return mpmath.degrees(mpmath.acos(self.cosine))

    @property
    def angle(self) -> float:
        """Smallest angle [degrees]."""
        return float(self.precise_angle)

    _numbers_above = False

    def _words(self) -> dict[str, Any]:
        """Return the results as numbers and texts, by name; angles are in degrees."""
        return {
            "n": self.n,
            "dimension": self.dimension,
            "angle": _text(self.precise_angle, self.digits),
            "cosine": _text(self.cosine, self.digits),
            "residual": float(self.residual),
            "contacts": len(self.contacts),
            "rattlers": self.rattlers.tolist(),
            "rigid": self.rigid,
            "seed": self.seed,
            "tries": len(self.angles),
            "reached": self.reached,
            "note": self.note,
        }

    def _columns(self) -> dict[str, Any]:
        """Return the coordinates of all points, in double precision."""
        return dict(zip(self._axes(), self.points.T.tolist(), strict=True))

    def _axes(self) -> list[str]:
        """Return the names of the coordinates."""
        d = self.dimension
        return ["x", "y", "z"][:d] if d <= 3 else [f"x{j + 1}" for j in range(d)]

    def save(self, path: str | PathLike[str]) -> None:
        """Write the code to a file.

        Parameters
        ----------
        path : path
            With the suffix ``.json`` or ``.npz`` the whole code, for :func:`carom.load`. With ``.png``,
            ``.pdf`` or ``.svg`` a picture. With ``.csv`` a table of the points with all digits and a line of
            names; with any other suffix one point per line, as public tables have.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        path = Path(path)
        if path.suffix.lower() in self._writers():
            super().save(path)
            return
        text = "".join(" ".join(row) + "\n" for row in self._places(self.digits))
        write_text(path, text)

    def _writers(self) -> dict[str, Callable[[Path], object]]:
        def table(path: Path) -> None:
            rows = [self._axes(), *self._places(self.digits)]
            path.write_text("".join(",".join(row) + "\n" for row in rows), encoding="utf-8")

        return {**super()._writers(), ".csv": table}

    def _places(self, digits: int) -> list[list[str]]:
        """Return the coordinates of the points as texts with so many digits."""
        return [[_text(x, digits) for x in row] for row in self.coordinates.tolist()]

    def _saved(self) -> dict[str, Any]:
        digits = self.digits + GUARD  # which load() needs
        return {
            "format": FORMAT,
            "cosine": _text(self.cosine, digits),
            "digits": self.digits,
            "points": self._places(digits),
            "pairs": self.contacts.tolist(),
            "forces": self.forces.tolist(),
            "angles": [[seed, angle if angle == angle else None] for seed, angle in self.angles.items()],
        }

    @classmethod
    def _made(cls, values: Mapping[str, Any]) -> SphericalCode:
        return _of_words(values, "a spherical code")

    def plot(self, path: str | PathLike[str] | None = None, **options: Any) -> Any:
        """Draw the caps of a code on S^2; ``path`` and ``options`` are for ``carom.figures.caps.caps``."""
        from carom.figures.caps import caps

        return caps(self.points, 0.5 * self.angle, self.contacts, path=path, **options)

    def words(self) -> list[tuple[str, str]]:
        """Return the results as text, by name, as ``carom code`` prints them."""
        words = self._words()
        who = ", ".join(map(str, words["rattlers"])) or "none"
        kind = "a strict local optimum" if self.rigid else "held by forces, but parts of it can move"
        rows = [
            ("smallest angle", f"{words['angle']} degrees"),
            ("its cosine", words["cosine"]),
            ("contacts", f"{words['contacts']}, {kind}"),
            ("rattlers", who),
            ("residual", f"{words['residual']:.1e}"),
        ]
        if self.angles:
            rows.append(("tries", self._reached(f"{len(self.angles)}")))
        return [*rows, ("source", self.note)]

    def _reached(self, tries: str) -> str:
        """Return how many of the tries led to the code, in words."""
        return f"reached by {self.reached} of {tries}, first by seed {self.seed}"

    def _lines(self) -> list[str]:
        """Return what is printed: the angle, the contacts, the search."""
        loose = counted(len(self.rattlers), "rattler")
        kind = "a strict local optimum" if self.rigid else "parts of it can move"
        angle = f"smallest angle {self.angle:.9f} degrees, to {self.digits} digits"
        return [
            f"{self.n} points on S^{self.dimension - 1}: {angle}",
            f"{counted(len(self.contacts), 'contact')}, {loose}: {kind}",
            self._reached(counted(len(self.angles), "try")) if self.angles else self.note,
        ]

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        return f"{self.n} points on S^{self.dimension - 1}", self.words()

    def __repr__(self) -> str:
        return f"<SphericalCode of {self.n} points on S^{self.dimension - 1}: {self.angle:.9f} degrees>"


def _text(x: Any, digits: int) -> str:
    """Return a number of ``mpmath`` with so many digits."""
    import mpmath

    return str(mpmath.nstr(x, digits, strip_zeros=False))


_COUNT = records.integer()
_PRECISE = records.number(low=-1.0, high=1.0)


def _precise(value: Any, name: str) -> Any:
    """Return a number of many digits, from -1 to 1, from its text."""
    import mpmath

    try:
        found = mpmath.mpf(records.text(value, name))
    except (ValueError, TypeError):
        raise InputError(f"{name} must be a number as text, found {checks.describe(value)}.") from None
    _PRECISE(float(found), name)
    return found


def _angle(value: Any, name: str) -> tuple[int, float]:
    """Return a seed and the angle that it led to; NaN for null."""
    seed, angle = records.listed(records.anything, length=2)(value, name)
    found = records.optional(records.number(low=0.0))(angle, name)
    return _COUNT(seed, name), math.nan if found is None else found


def _of_words(value: Any, name: str) -> SphericalCode:
    """Return the code in the words that ``SphericalCode.save`` wrote."""
    import mpmath

    if not isinstance(value, dict) or value.get("format") != FORMAT:
        raise InputError(f"its format is not {FORMAT!r}")
    n, k = (records.integer(low=1, high=10**7)(value.get(key), key) for key in ("n", "dimension"))
    digits = records.integer(low=1, high=MOST_DIGITS)(value.get("digits"), "digits")
    index = records.integer(high=n - 1)
    with mpmath.workdps(digits + GUARD):
        words = records.table(
            {
                "points": records.listed(records.listed(_precise, length=k), length=n),
                "cosine": _precise,
                "pairs": records.listed(records.listed(index, length=2)),
                "residual": records.number(low=0.0),
                "rattlers": records.listed(index),
                "rigid": records.switch,
                "seed": records.optional(_COUNT),
                "angles": records.listed(_angle),
                "reached": _COUNT,
                "note": records.text,
            }
        )(value, name)
        forces = records.listed(records.number(low=0.0), length=len(words["pairs"]))(
            value.get("forces"), "forces"
        )
        return SphericalCode(
            np.array(words["points"], object),
            words["cosine"],
            mpmath.mpf(words["residual"]),
            digits,
            np.array(words["pairs"], np.int64).reshape(-1, 2),
            np.array(forces, float),
            np.array(words["rattlers"], np.int64),
            words["rigid"],
            words["seed"],
            dict(words["angles"]),
            words["reached"],
            words["note"],
        )
