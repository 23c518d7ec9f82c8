"""Checks of every measured number for equilibrium."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from carom.errors import CaromWarning
from carom.observables.drift import LEVEL, PARTS, drift, relaxation
from carom.observables.quantiles import normal_above, student_above
from carom.observables.statistics import FEW_SAMPLES, Estimate, blocking

FEW = 8.0
"""Independent samples below which the error bar of a long series is unreliable. Their number is itself an
estimate: with a correlation of 0.3 between blocks, one series in a thousand seems to have fewer. Blocks of a
collision per particle hardly have such a correlation.
"""

PART = 8.0
"""Independent samples in each part of the test for a trend, where there are enough. Neighbouring parts are
then correlated by 1/32, which hardly makes false alarms more frequent."""

FEWEST_PARTS = 4


def doubts_about(result: Any) -> list[str]:
    """Return the :func:`doubts` about the estimate of an observable.

    There are none if it has no ``block_values``, or is expected to change (not ``steady``).
    """
    values = getattr(result, "block_values", ()) if getattr(result, "steady", True) else ()
    return doubts(getattr(result, "quantity", "what was measured"), result.primary, values) if values else []


def doubts(name: str, found: Estimate, values: Sequence[float]) -> list[str]:
    """Return doubts about a measured number, a sentence each.

    Parameters
    ----------
    name : str
        Name of the quantity, with its article: "the pressure".
    found : Estimate
        Mean and error bar.
    values : sequence of float
        Values in equal blocks, in order of time.

    Returns
    -------
    list of str
        Empty for all but one of some thousand runs in equilibrium.

    Notes
    -----
    There are three tests. The first is for a trend: :func:`carom.observables.drift.drift` of up to 16 parts,
    each of at least 8 independent samples, at the level of 1e-3. If there is none, the second is for a decay
    at the start: :func:`carom.observables.drift.relaxation`, at the same level. The third is for fewer than 8
    independent samples in 16 blocks or more: the number then changes as slowly as in a relaxation. Below 4
    samples ``blocking`` has warned.
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
    """Return a sentence on the species that are hotter or colder than the whole; none if there are none.

    Parameters
    ----------
    names : sequence of K str
    series : (m, K) array_like
        Temperature of each species over that of all, at m equally spaced times.
    freedoms : sequence of K floats
        Degrees of freedom of each species.

    Notes
    -----
    The mean of each species is compared with 1, by Student's t at the level of 1e-3 for all species together.
    Its error is from blocking, but at most that of a single sample in equilibrium, ``sqrt(2 / f (1 - f /
    F))`` for f of F degrees of freedom. The second bound is needed for a species that exchanges no energy.
    """
    ratios = np.asarray(series, dtype=np.float64)
    if ratios.ndim != 2 or ratios.shape[1] < 2 or not len(ratios):
        return []
    total = math.fsum(freedoms)
    tail = 0.5 * LEVEL / ratios.shape[1]
    found = []
    for name, values, freedom in zip(names, ratios.T, freedoms, strict=True):
        if freedom <= 0.0:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CaromWarning)
            mean = blocking(values)
        alone = math.sqrt(2.0 / freedom * max(1.0 - freedom / total, 0.0))
        # Both are bounds on the deviation of the mean by chance.
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


def _parts(values: np.ndarray) -> int:
    """Return the number of nearly independent parts of a series, after its linear trend is removed."""
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
