"""From a jammed configuration to a code of many digits: Newton's method for the equations of its contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from carom.studies.spherical_codes.contacts import (
    ROUNDING,
    contact_graph,
    forces,
    is_rigid,
    jacobian,
    pairs_by_product,
)
from carom.studies.spherical_codes.linear_programs import climb

STEPS = 60
"""Steps of Newton's method, at most; six or fewer are used, unless the solution is singular."""

ROUNDS = 8
"""Rounds of removing and adding contacts, at most."""

GUARD = 10
"""Decimal digits beyond those wanted."""

Digits = list[list[Any]]
"""Coordinates as numbers of mpmath, (n, k)."""


@dataclass(frozen=True, eq=False)
class Polished:
    """A code whose contacts are equal up to rounding."""

    points: np.ndarray  # unit vectors (n, k)
    cosine: float  # of the smallest angle
    contacts: np.ndarray  # pairs at that angle that bear a force, (m, 2)
    forces: np.ndarray  # along the contacts, (m,), all positive; they add up to 1

    @property
    def rattlers(self) -> np.ndarray:
        """Points that no contact holds."""
        return np.setdiff1d(np.arange(len(self.points)), np.unique(self.contacts))

    @property
    def rigid(self) -> bool:
        """Whether the code is a strict local optimum, apart from rattlers and rotations.

        All forces are positive, so it is one if every first-order motion changes the length of a contact.
        """
        return is_rigid(self.points, self.contacts)


def residuals(points: np.ndarray, cosine: float, pairs: np.ndarray) -> np.ndarray:
    """Return the residual of each equation, (m + n,)."""
    products = np.einsum("ij,ij->i", points[pairs[:, 0]], points[pairs[:, 1]])
    return np.r_[products - cosine, 0.5 * (np.einsum("ij,ij->i", points, points) - 1.0)]


def newton(points: np.ndarray, pairs: np.ndarray) -> tuple[np.ndarray, float]:
    """Return points and cosine at which the pairs have equal products, by Gauss-Newton steps in doubles.

    Each step is the shortest solution of the linear equations, and so moves no rattlers.
    """
    n, k = points.shape
    x = np.array(points)
    cosine = float(np.einsum("ij,ij->i", x[pairs[:, 0]], x[pairs[:, 1]]).max())
    best = np.inf
    for _ in range(STEPS):
        missed = residuals(x, cosine, pairs)
        size = float(np.abs(missed).max())
        if size <= 2.0**-52 or (size >= 0.5 * best and size <= ROUNDING):
            break
        best = min(best, size)
        step = np.linalg.lstsq(jacobian(x, pairs), -missed, rcond=max(np.sqrt(size), 1e-8))[0]
        x += step[:-1].reshape(n, k)
        cosine += float(step[-1])
    x /= np.linalg.norm(x, axis=1)[:, None]
    return x, cosine


def polish(points: np.ndarray) -> Polished:
    """Return the code near a jammed configuration (n, k), in doubles.

    One that was not jammed yet, whose contacts cannot all be equal, climbs to the next optimum first.
    """
    try:
        return _settled(points)
    except ValueError:
        return _settled(climb(points))


def _settled(points: np.ndarray) -> Polished:
    """Return the code with those contacts of the configuration that bear a force."""
    pairs, x = contact_graph(points), points
    for _ in range(ROUNDS):
        x, cosine = newton(x, pairs)
        if np.abs(residuals(x, cosine, pairs)).max() > ROUNDING:
            raise ValueError("its contacts cannot all be equal")
        bear = forces(x, pairs)
        if not bear.any():
            raise ValueError("no forces hold its contacts")
        pairs, bear = pairs[bear > 0.0], bear[bear > 0.0]
        every, products = pairs_by_product(x)
        pushed = every[products > cosine + ROUNDING]
        if not len(pushed):
            return Polished(x, cosine, pairs, bear / bear.sum())
        pairs = np.unique(np.vstack([pairs, pushed]), axis=0)
    raise ValueError("its contacts change for ever")


def equations(x: Digits, cosine: Any, contacts: np.ndarray, digits: int) -> list[Any]:
    """Return the residual of each equation to so many decimal digits, (m + n)."""
    import mpmath

    with mpmath.workdps(digits + GUARD):
        missed = [mpmath.fdot(x[i], x[j]) - cosine for i, j in contacts.tolist()]
        return missed + [(mpmath.fdot(row, row) - 1) / 2 for row in x]


def refine(code: Polished, digits: int) -> tuple[Digits, Any, Any]:
    """Return coordinates and cosine to so many decimal digits, and the largest residual.

    Steps with the pseudo-inverse of the Jacobian in doubles each add some fifteen digits.
    """
    import mpmath

    n, k = code.points.shape
    inverse = np.linalg.pinv(jacobian(code.points, code.contacts), rcond=1e-7)
    with mpmath.workdps(digits + GUARD):
        x = [[mpmath.mpf(value) for value in row] for row in code.points.tolist()]
        cosine = mpmath.mpf(code.cosine)
        goal = mpmath.mpf(10) ** -(digits + GUARD // 2)
        before = mpmath.inf
        for _ in range(STEPS):
            missed = equations(x, cosine, code.contacts, digits)
            size = max(map(abs, missed))
            if size <= goal:
                return x, cosine, size
            if size >= before:
                break
            before = size
            step = inverse @ np.array([float(each / size) for each in missed])
            for i in range(n):
                for axis in range(k):
                    x[i][axis] -= size * mpmath.mpf(float(step[i * k + axis]))
            cosine -= size * mpmath.mpf(float(step[-1]))
    raise ValueError(f"Newton's method stops at {float(before):.1g}.")
