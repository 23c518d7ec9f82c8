"""Results of a whole study: virial coefficients from its dilute points, and extrapolation in 1 / N."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carom import checks, theory
from carom.errors import InputError
from carom.observables.analysis.drift import LEVEL
from carom.observables.analysis.quantiles import chi_squared_tail
from carom.studies.eos.table import Row

TERMS = 10
"""Terms of the fitted polynomial in ``y = eta / (1 - eta)``: more than any data can resolve."""

FREE = 3
"""Terms without a prior: those that B_2 to B_4 depend on."""


@dataclass(frozen=True)
class Virials:
    """Virial coefficients fitted to a study.

    Attributes
    ----------
    values, errors : (m,) tuple of float
        ``beta_k = B_k / v^(k-1)`` of ``Z = 1 + sum_k beta_k eta^(k-1)``, from k = 2 on.
    known : (m,) tuple of float
        Published coefficients; nan for unknown ones.
    points : int
        Number of fitted points.
    chi2 : float
        Chi squared of these points; somewhat less than their number if the fit is good.
    """

    values: tuple[float, ...]
    errors: tuple[float, ...]
    known: tuple[float, ...]
    points: int
    chi2: float

    def __str__(self) -> str:
        return "\n".join(
            f"B_{k} / v^{k - 1} = {value:.6g} +- {error:.2g} ({known:.6g})"
            for k, (value, error, known) in enumerate(
                zip(self.values, self.errors, self.known, strict=True), start=2
            )
        )


def virials(
    rows: Sequence[Row],
    *,
    up_to: float | None = None,
    order: int = 4,
    known: Sequence[float] | None = None,
) -> Virials:
    """Fit virial coefficients to the fluid points that have equilibrated.

    Parameters
    ----------
    rows : sequence of Row
        Points of a study.
    up_to : float, optional
        Highest packing fraction used; 0.75 of freezing if left out.
    order : int
        Order of the highest coefficient to fit, 2 to 7.
    known : sequence of float, optional
        Published coefficients to compare with, from B_2 on; by default those of equal particles.

    Raises
    ------
    InputError
        If there are fewer points than three, or `order` is out of range.

    Notes
    -----
    The fit is by weighted least squares for ``Z - 1 = sum_j c_j y^j`` in ``y = eta / (1 - eta)``. There the
    coefficients stay of the order of ``B_2 = 2^(d-1)`` instead of growing; ``beta_k = sum_j c_j C(k - 2,
    j - 1)``. A polynomial of the lowest sufficient order would have errors too small by a factor of up to
    ten, because the missing terms bias the others. Ten terms are therefore fitted, and those beyond the third
    have the prior ``0 +- 2^(d-1)``. This was tested on data from the known equations of state in 2 to 4
    dimensions, with relative errors of 6e-5 and 5e-4. The deviations of B_2 to B_4 are 0.4 to 1.0 standard
    errors (root mean square).
    """
    order = checks.integer(order, "order", low=2, high=7)
    used = [
        row
        for row in rows
        if row.equilibrated
        and row.phase == "fluid"
        and math.isfinite(row.Z_infinite)
        and 0.0 < row.Z_error < math.inf
        and row.packing_fraction
        <= (0.75 * theory.FREEZING.get(row.dimension, 1.0) if up_to is None else up_to)
    ]
    if len(used) < FREE:
        raise InputError(
            f"{len(used)} points of the dilute fluid can be fitted, and virial coefficients need at least "
            f"{FREE}; add packing fractions, or raise up_to."
        )
    dimension = used[0].dimension
    eta = np.array([row.packing_fraction for row in used])
    excess = np.array([row.Z_infinite - 1.0 for row in used])
    error = np.array([row.Z_error for row in used])
    y = eta / (1.0 - eta)
    powers = np.stack([y**j for j in range(1, TERMS + 1)], axis=1)
    # The prior enters as further data: each c_j beyond the third is 0 +- 2^(d-1).
    assumed = np.eye(TERMS)[FREE:]
    design = np.concatenate([powers, assumed])
    values = np.concatenate([excess, np.zeros(TERMS - FREE)])
    errors = np.concatenate([error, np.full(TERMS - FREE, 2.0 ** (dimension - 1))])
    c, covariance, _ = _solve(design, values, errors)
    # y^j = sum_k C(k - 2, j - 1) eta^(k - 1).
    to_beta = np.array([[math.comb(k - 2, j - 1) for j in range(1, TERMS + 1)] for k in range(2, order + 1)])
    rest = (excess - powers @ c) / error
    return Virials(
        tuple(map(float, to_beta @ c)),
        tuple(map(float, np.sqrt(np.diag(to_beta @ covariance @ to_beta.T)))),
        _known(dimension, order - 1) if known is None else _padded(known, order - 1),
        len(used),
        float(rest @ rest),
    )


@dataclass(frozen=True)
class Extrapolation:
    """Z of infinitely many particles from several finite numbers of them.

    Attributes
    ----------
    packing_fraction : float
        Packing fraction.
    sizes : tuple of int
        Numbers of particles in the fit.
    Z, Z_error : float
        Z at 1 / N = 0 and its standard error.
    slope, slope_error : float
        Slope of Z against 1 / N and its standard error.
    theory_slope : float
        The slope by theory, to order 1 / N; nan if there is none.
    chi2 : float
        Chi squared of the line, with ``len(sizes) - 2`` degrees of freedom.
    """

    packing_fraction: float
    sizes: tuple[int, ...]
    Z: float
    Z_error: float
    slope: float
    slope_error: float
    theory_slope: float
    chi2: float


def extrapolate(rows: Sequence[Row]) -> list[Extrapolation]:
    """Extrapolate Z to 1 / N = 0 at every packing fraction with two sizes or more.

    The ``rows`` are the points of a study. Points that have not equilibrated are left out, as are those
    without an error bar.

    Notes
    -----
    The next order, ``1 / N^2``, is visible in small and dense systems. The smallest size is left out as long
    as chi squared of the line is larger than in one of a thousand cases.
    """
    groups: dict[tuple[float, str], list[Row]] = {}
    for row in rows:
        if row.equilibrated and 0.0 < row.Z_error < math.inf:
            groups.setdefault((row.packing_fraction, row.phase), []).append(row)
    found = []
    for (eta, _), group in sorted(groups.items()):
        if len({row.n for row in group}) < 2:
            continue
        group.sort(key=lambda row: row.n)
        c, covariance, chi2 = _line(group)
        while len(group) > 2 and chi_squared_tail(chi2, len(group) - 2) < LEVEL:
            group = group[1:]
            c, covariance, chi2 = _line(group)
        last = group[-1]
        found.append(
            Extrapolation(
                packing_fraction=eta,
                sizes=tuple(row.n for row in group),
                Z=float(c[0]),
                Z_error=math.sqrt(covariance[0, 0]),
                slope=float(c[1]),
                slope_error=math.sqrt(covariance[1, 1]),
                theory_slope=(
                    1.0 - last.theory if last.phase == "solid" else last.n * (last.Z - last.Z_infinite)
                ),
                chi2=chi2,
            )
        )
    return found


def _line(group: Sequence[Row]) -> tuple[np.ndarray, np.ndarray, float]:
    """Fit Z against 1 / N."""
    inverse = np.array([1.0 / row.n for row in group])
    z = np.array([row.Z for row in group])
    error = np.array([row.Z_error for row in group])
    return _solve(np.stack([np.ones_like(inverse), inverse], axis=1), z, error)


def _solve(
    design: np.ndarray, values: np.ndarray, errors: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Weighted least squares: coefficients, their covariance, and chi squared."""
    weighted = design / errors[:, None]
    # Without scaled columns, powers of a small y would look linearly dependent.
    scale = np.linalg.norm(weighted, axis=0)
    inverse = np.linalg.pinv(weighted / scale)
    c = inverse @ (values / errors) / scale
    covariance = inverse @ inverse.T / np.outer(scale, scale)
    rest = (values - design @ c) / errors
    return c, covariance, float(rest @ rest)


def _known(dimension: int, count: int) -> tuple[float, ...]:
    """Return the published virial coefficients from B_2 on; unknown ones are nan."""
    try:
        return _padded(theory.virial_coefficients(dimension), count)
    except InputError:
        return _padded((), count)


def _padded(known: Sequence[float] | np.ndarray, count: int) -> tuple[float, ...]:
    """Return the first ``count`` numbers; missing ones are nan."""
    return tuple(float(known[k]) if k < len(known) else math.nan for k in range(count))
