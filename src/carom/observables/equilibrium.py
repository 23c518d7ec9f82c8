"""Whether what was measured was in equilibrium: what every measured number is checked for."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from carom.errors import CaromWarning
from carom.observables.drift import LEVEL, PARTS, drift, relaxation
from carom.observables.quantiles import normal_above, student_above
from carom.observables.statistics import FEW_SAMPLES, Estimate, blocking

FEW = 8.0
"""Independent samples below which the error bar of a long series is a guess. Their number is itself
estimated: of blocks with a correlation of 0.3, which those of a collision a particle hardly have, one series
in a thousand seems to have less.
"""

PART = 8.0
"""Independent samples in each of the parts whose trend is looked at, where there are enough: neighbouring
parts are then correlated by 1/32, which hardly makes false alarms more frequent."""

FEWEST_PARTS = 4

STILL = 0.25
"""Independent samples of the temperature of a species below which no error bar is trusted: a stretch half as
long as the time in which energy is exchanged."""

SHARE = 0.5
"""How far an observable may follow the temperature of one species: for the pressure, its part of it."""


def doubts_about(result: Any) -> list[str]:
    """Return the :func:`doubts` about an observable's estimate, if it keeps its ``block_values`` and is not
    expected to change (``steady``).
    """
    values = getattr(result, "block_values", ()) if getattr(result, "steady", True) else ()
    return doubts(getattr(result, "quantity", "what was measured"), result.primary, values) if values else []


def doubts(name: str, found: Estimate, values: Sequence[float]) -> list[str]:
    """Return what speaks against a measured number, a sentence each.

    Parameters
    ----------
    name : str
        What was measured, with its article: "the pressure".
    found : Estimate
        Mean and error bar.
    values : sequence of float
        Its values in equal blocks, in order of time.

    Returns
    -------
    list of str
        Empty for all but one of some thousand runs in equilibrium.

    Notes
    -----
    Three things are looked for. A trend: :func:`carom.observables.drift.drift` of up to 16 parts, each of at
    least 8 independent samples, at the level of 1e-3. Where there is none, a decay at the start:
    :func:`carom.observables.drift.relaxation`, at the same level. And less than 8 independent samples in at
    least twice as many blocks: then the number changes as slowly as a relaxation does. Below 4 ``blocking``
    has warned.
    """
    said = []
    trend = drift(values, _parts(np.asarray(values, dtype=np.float64))) if found.error > 0.0 else 0.0
    if abs(trend) > _beyond(LEVEL):
        said.append(
            f"{name[:1].upper()}{name[1:]} drifts: its trend is {abs(trend):.1f} standard errors, and one "
            f"run of {1.0 / LEVEL:.0f} in equilibrium has {_beyond(LEVEL):.1f}. Equilibrate longer, then "
            "measure again."
        )
    elif abs(decay := relaxation(values)) > _beyond(LEVEL):
        said.append(
            f"{name[:1].upper()}{name[1:]} relaxes: its first quarter is {abs(decay):.1f} standard errors "
            f"from its second half, and one run of {1.0 / LEVEL:.0f} in equilibrium has "
            f"{_beyond(LEVEL):.1f}. Equilibrate longer, then measure again."
        )
    if FEW_SAMPLES <= found.n_eff < FEW <= 0.5 * len(values):
        said.append(
            f"Only {found.n_eff:.0f} independent samples of {name} were found in {len(values)} blocks: it "
            "changes slowly, and its error bar is a guess. Run longer, after a longer equilibration."
        )
    return said


def equipartition(
    names: Sequence[str], series: Sequence[Sequence[float]], freedoms: Sequence[float]
) -> list[str]:
    """Return which species are hotter or colder than the whole, a sentence or none.

    Parameters
    ----------
    names : sequence of K str
    series : (m, K) array_like
        Temperature of each species in units of that of all, at m equally spaced times.
    freedoms : sequence of K floats
        Degrees of freedom of each species.

    Notes
    -----
    The mean of each species is compared with 1, by Student's t at the level of 1e-3 for all species together.
    Its error is from blocking, but not more than a single look has in equilibrium, ``sqrt(2 / f (1 - f /
    F))`` of f of F degrees of freedom: a species that exchanges no energy at all has no other.
    """
    tail = 0.5 * LEVEL / max(len(names), 1)
    found = []
    for name, values, alone in _temperatures(names, series, freedoms):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CaromWarning)
            mean = blocking(values)
        # Both are bounds on how far the mean may be off by chance.
        bound = min(
            student_above(tail, mean.degrees_of_freedom) * mean.error if mean.error > 0.0 else math.inf,
            normal_above(tail) * alone * (1.0 + alone),
        )
        if abs(mean.mean - 1.0) > bound:
            found.append(f"{name} at {mean.mean:.3g} kT")
    if not found:
        return []
    return [
        f"The species differ in temperature ({', '.join(found)}): energy has not been shared out. "
        "Equilibrate longer, then measure over a longer stretch."
    ]


def slow_exchange(
    names: Sequence[str],
    series: Sequence[Sequence[float]],
    freedoms: Sequence[float],
    relative_error: float,
) -> list[str]:
    """Return which species exchanged too little energy for an error bar to be trusted, a sentence or none.

    Parameters
    ----------
    names, series, freedoms
        As of :func:`equipartition`.
    relative_error : float
        Of what was measured in the same stretch.

    Notes
    -----
    What is slower than a stretch is in no error bar. The temperature of a species has the variance
    ``alone**2`` in equilibrium (:func:`equipartition`), and changes by ``2 alone**2 (1 - a)`` in the mean
    square from one look to the next, where a is the correlation of the two. Of k looks, ``m = k (1 - a) /
    (1 + a)`` are independent if it relaxes exponentially. This estimate of m holds in stretches far shorter
    than the relaxation, too. A species is named if m < 1/4. It is also named if m < 8 and half of ``alone /
    sqrt(m)``, by which the mean temperature is off by chance, is more than ``relative_error``.
    """
    found = []
    for name, values, alone in _temperatures(names, series, freedoms):
        if not alone > 0.0 or len(values) < 2:
            continue
        lost = min(float(np.mean(np.diff(values) ** 2)) / (2.0 * alone**2), 1.0)
        samples = len(values) * lost / (2.0 - lost)
        few = samples < FEW and SHARE * alone > relative_error * math.sqrt(max(samples, 1.0))
        if samples < STILL or few:
            found.append(f"{name}: {samples:.2g} independent samples")
    if not found:
        return []
    return [
        f"The temperatures of species change slowly ({', '.join(found)}): the error bar holds nothing that "
        "is slower than this stretch. Run longer."
    ]


def _temperatures(
    names: Sequence[str], series: Sequence[Sequence[float]], freedoms: Sequence[float]
) -> Iterator[tuple[str, np.ndarray, float]]:
    """Yield of each species its name, its temperatures, and their spread in equilibrium, in units of kT."""
    ratios = np.asarray(series, dtype=np.float64)
    if ratios.ndim != 2 or ratios.shape[1] < 2 or not len(ratios):
        return
    total = math.fsum(freedoms)
    for name, values, freedom in zip(names, ratios.T, freedoms, strict=True):
        if freedom > 0.0:
            yield name, values, math.sqrt(2.0 / freedom * max(1.0 - freedom / total, 0.0))


def _parts(values: np.ndarray) -> int:
    """Return into how many parts a series can be cut that know little of each other, a trend left out."""
    if values.size < 2:
        return FEWEST_PARTS
    times = np.arange(values.size) - 0.5 * (values.size - 1)
    rest = values - values.mean() - float(times @ values / (times @ times)) * times
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)
        known = min(blocking(rest).n_eff, float(values.size))
    return min(PARTS, max(FEWEST_PARTS, int(known / PART)))


def _beyond(level: float) -> float:
    """Return the bound that a standard normal number exceeds, on either side, with this probability."""
    return normal_above(0.5 * level)
