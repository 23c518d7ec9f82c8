"""From the results of single runs to one row per point: means, errors, chi squared, tests of equilibrium."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from carom.errors import InputError
from carom.observables.analysis import drift
from carom.observables.analysis.quantiles import chi_squared_tail
from carom.studies.folder import Record
from carom.studies.phase import end, expected, finite_size_shift, usual_equation
from carom.table import Column, error
from carom.theory import Equation

LEVEL = 1e-3
"""Probability that replicas in agreement are called inconsistent."""

FEW = 16.0
"""Number of independent samples below which the error bar of a run is unreliable."""

OFF = 0.05
"""Relative deviation of kT from the requested one beyond which a point is flagged."""

UNKNOWN = ("contact", "interaction", "motion", "impact", "drive", "pinned")
"""Keys of a scene with which no equation of state is known."""


@dataclass(frozen=True)
class Row:
    """One point of a study: a packing fraction and a number of particles, over all its replicas.

    Attributes
    ----------
    packing_fraction, n, dimension
        The point, as simulated.
    phase : str
        Phase that is expected at this density: "fluid", "solid" or "coexistence".
    replicas : int
        Number of finished runs.
    Z, Z_error : float
        Z of n particles and its standard error: the mean over replicas weighted by their lengths; see
        :func:`combined`. Errors are nan where a remark says that the runs are too short for one.
    Z_infinite : float
        Z of infinitely many particles, by the correction of order 1 / n from theory; nan if there is none. It
        has the same error.
    reduced_pressure, reduced_pressure_error : float
        P sigma^d / kT, of n particles; in a mixture sigma is the largest diameter.
    kT : float
        Mean temperature of the replicas [energy]. With steps it fluctuates about the requested one.
    theory, deviation : float
        Z by the chosen equation of state, and ``Z_infinite - theory`` in standard errors.
    chi2 : float
        Chi squared of the replicas about their mean, with ``replicas - 1`` degrees of freedom; nan for one.
    drift : float
        Common trend of the pressure of the replicas, a standard normal number in equilibrium.
    order, order_error : float
        Mean of the modulus of the order parameter (psi_6 or Q_6), and its error from the replicas.
    susceptibility : float
        ``n (<|psi|^2> - <|psi|>^2)``.
    moved : float
        Median displacement of the particles before the measurement [mean spacing]; the smallest of the
        replicas.
    equilibrated : bool
        Whether all tests of equilibrium passed; other points are left out of fits.
    remarks : tuple of str
        Results of the tests in words.
    collisions : int
        Pair collisions of all replicas.
    """

    packing_fraction: Annotated[float, Column("η", ".6g", key=True)]
    n: Annotated[int, Column("N", key=True)]
    dimension: int
    phase: str
    replicas: int
    Z: Annotated[float, Column("Z", error("Z_error", told=True))]
    Z_error: float
    Z_infinite: Annotated[float, Column("infinite", error("Z_error"))]
    reduced_pressure: Annotated[float, Column("P*", error("reduced_pressure_error"))]
    reduced_pressure_error: float
    kT: float
    theory: Annotated[float, Column("theory", error("Z_error"))]
    deviation: Annotated[float, Column("dev.", "+.1f")]
    chi2: Annotated[float, Column("χ²", ".1f")]
    drift: float
    order: float
    order_error: float
    susceptibility: float
    moved: float
    equilibrated: bool
    remarks: Annotated[tuple[str, ...], Column("", lambda said, row: "*" * bool(said))]
    collisions: int


def combined(
    values: Sequence[float], errors: Sequence[float], lengths: Sequence[float]
) -> tuple[float, float, float]:
    """Return mean, error and chi squared of independent estimates of one quantity, weighted by their lengths.

    Parameters
    ----------
    values, errors, lengths : sequences of float
        Estimates, their standard errors, and the lengths of their runs.

    Notes
    -----
    Squared error times length estimates the same number for all runs, and the mean of these is taken. Weights
    from the single errors would prefer runs with errors that are too small by chance. A value with an
    infinite error is left out. If all errors are infinite, the mean is unweighted and its error infinite.
    """
    known = [(v, e, t) for v, e, t in zip(values, errors, lengths, strict=True) if 0.0 < e < math.inf]
    if not known:
        exact = all(e == 0.0 for e in errors)
        return math.fsum(values) / len(values), 0.0 if exact else math.inf, math.nan
    total = math.fsum(t for _, _, t in known)
    mean = math.fsum(v * t for v, _, t in known) / total
    variance = math.fsum(e * e * t for _, e, t in known) / len(known)
    chi2 = math.fsum((v - mean) ** 2 * t for v, _, t in known) / variance if len(known) > 1 else math.nan
    return mean, math.sqrt(variance / total), chi2


def compared(record: Record) -> bool:
    """Return whether the run of a ``record`` may be compared with theory.

    It must be of elastic, additive hard cores that all fly freely, without walls and obstacles.
    """
    return not (record["result"]["confined"] or any(name in record["task"]["scene"] for name in UNKNOWN))


def row(records: Sequence[Record], equation: Equation | None = None) -> Row:
    """Return the row of a point.

    Parameters
    ----------
    records : sequence of dict
        Its runs, in the order of the replicas.
    equation : callable, optional
        Equation of state to compare with and to correct for the finite size. By default it follows from phase
        and dimension.
    """
    results = [record["result"] for record in records]
    task, first = records[0]["task"], results[0]
    # The requested value: that of the scene differs by rounding, which depends on n.
    eta, n, d = float(task["scene"]["packing_fraction"]), int(first["n"]), int(first["dimension"])
    state = expected(eta, d, task["scene"]["initial"], mixture=len(first["species"]) > 1)
    z, z_error, chi2 = _quantity(results, "Z")
    pressure, pressure_error, _ = _quantity(results, "reduced_pressure")
    chosen, beside = equation, equation is not None or compared(records[0])
    if chosen is None and beside:
        chosen = usual_equation(d, state, first["species"])
    plain = equation is None and len(first["species"]) == 1 and state == "fluid"
    known = math.nan if plain and round(eta, 9) > end(d) else _value(chosen, eta)
    if state == "solid" and beside:
        # For a crystal the correction follows from its own Z.
        infinite = 1.0 + (z - 1.0) * n / (n - 1.0)
    else:
        infinite = z - finite_size_shift(state, eta, n, chosen)
    order, order_error, susceptibility, order_drifts = _order(results, n)
    drifts = [drift.drift(result["block_values"]) for result in results]
    moved = min(float(result["moved"]) for result in results)
    remarks = []
    kT, wanted = math.fsum(float(r["kT"]) for r in results) / len(results), task["scene"].get("kT", 1.0)
    if "interaction" in task["scene"] and abs(kT - wanted) > OFF * wanted:
        remarks.append(f"kT is {kT:.3g}, not {wanted:g}")
    if drift.drifts(drifts):
        remarks.append("the pressure drifts")
    if order_drifts and drift.drifts(order_drifts):
        name = next(result["order"]["name"] for result in results if result.get("order"))
        remarks.append(f"{name} drifts")
    # One run in a thousand fails this test by chance, but not two of the same row.
    if sum(bool(r.get("species_differ")) for r in results) >= min(len(results), 2):
        remarks.append("species differ in temperature")
    if state == "fluid" and d > 1 and moved < drift.STUCK:
        remarks.append("particles are where they began")
    if state == "solid" and d > 1 and max(float(r["moved_at_end"]) for r in results) > drift.STUCK:
        remarks.append("the crystal has melted")
    degrees = len(results) - 1
    if degrees and math.isfinite(chi2) and chi_squared_tail(chi2, degrees) < LEVEL:
        remarks.append("replicas disagree")
    few = any((r["Z"]["n_eff"] or 0.0) < FEW for r in results if z_error > 0.0)
    few = few or not all(r.get("relaxed", True) for r in results)
    if few:
        remarks.append("too short for an error bar")
    equilibrated = not remarks
    goal = task.get("relative_error")
    # The goal is that of one replica, the error that of their mean. A tenth more is not worth a remark.
    if goal is not None and z_error > 1.1 * goal / math.sqrt(len(results)) * abs(z):
        remarks.append("the error asked for was not reached")
    if few:
        z_error = pressure_error = order_error = math.nan
    return Row(
        packing_fraction=eta,
        n=n,
        dimension=d,
        phase=state,
        replicas=len(results),
        Z=z,
        Z_error=z_error,
        Z_infinite=infinite,
        reduced_pressure=pressure,
        reduced_pressure_error=pressure_error,
        kT=kT,
        theory=known,
        deviation=(infinite - known) / z_error if z_error > 0.0 else math.nan,
        chi2=chi2,
        drift=drift.together(drifts),
        order=order,
        order_error=order_error,
        susceptibility=susceptibility,
        moved=moved,
        equilibrated=equilibrated,
        remarks=tuple(remarks),
        collisions=sum(int(result["collisions"]) for result in results),
    )


def _quantity(results: list[dict[str, Any]], name: str) -> tuple[float, float, float]:
    """Return mean, error and chi squared of a quantity over the runs."""
    values = [_number(result[name]["mean"], math.nan) for result in results]
    errors = [_number(result[name]["error"], math.inf) for result in results]
    return combined(values, errors, [float(result["time"]) for result in results])


def _number(value: float | None, missing: float) -> float:
    return missing if value is None else float(value)


def _value(equation: Equation | None, eta: float) -> float:
    """Return Z by an equation of state; nan where it gives none."""
    if equation is None:
        return math.nan
    try:
        return float(equation(eta))
    except InputError:
        return math.nan


def _order(results: list[dict[str, Any]], n: int) -> tuple[float, float, float, list[float]]:
    """Return mean and error of the order parameter, its susceptibility, and the trends of the replicas."""
    series = [result["order"]["values"] for result in results if result.get("order")]
    if not series or not all(series):
        return math.nan, math.nan, math.nan, []
    means = [math.fsum(values) / len(values) for values in series]
    mean = math.fsum(means) / len(means)
    squares = math.fsum(value * value for values in series for value in values)
    variance = squares / sum(map(len, series)) - mean * mean
    error = math.nan
    if len(means) > 1:
        error = math.sqrt(math.fsum((m - mean) ** 2 for m in means) / len(means) / (len(means) - 1))
    return mean, error, n * max(variance, 0.0), [drift.drift(values, parts=8) for values in series]
