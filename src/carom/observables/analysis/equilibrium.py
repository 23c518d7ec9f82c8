"""Checks of every measured number for equilibrium."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.arithmetic import dot
from carom.observables.analysis.drift import LEVEL, PARTS, STUCK, drift, relaxation
from carom.observables.analysis.quantiles import normal_above, student_above
from carom.observables.statistics import FEW_SAMPLES, Estimate, blocking, too_few, unwarned
from carom.scene.fields import is_simple
from carom.theory import FREEZING, MELTING, NEAR_FREEZING

if TYPE_CHECKING:
    from carom.scene.scene import Scene

FEW = 8.0
"""Independent samples below which the error bar of a long series is unreliable. Their number is itself an
estimate: with a correlation of 0.3 between blocks, one series in a thousand seems to have fewer. Blocks of a
collision per particle hardly have such a correlation.
"""

PART = 8.0
"""Independent samples in each part of the test for a trend, where there are enough. Neighboring parts are
then correlated by 1/32, which hardly makes false alarms more frequent."""

FEWEST_PARTS = 4

STILL = 0.25
"""Independent samples of the temperature of a species below which no error bar is reliable. The stretch is
then shorter than half of the time in which the species exchanges energy."""

RENEWED = {2: 2.5, 3: 1.25}
"""Root of the mean square displacement during a stretch, in mean spacings, from which its error bar holds the
slow fluctuations near freezing; RENEWED_OTHERWISE in other dimensions. In the plane the orientation of
neighborhoods outlives them. Measured with 256 particles: below it, error bars are too small by 1.3 to 6
(disks at 0.68 to 0.72) and by 1.3 to 1.4 (spheres at 0.49); beyond it, by no more than 1.15.
"""

RENEWED_OTHERWISE = 1.0

CAGED = 0.22
"""The same displacement below which particles sit in the cages of a crystal or a glass, whose pressure
fluctuates fast. By Lindemann's rule a crystal melts at 0.15 about the sites: 0.21 from a start anywhere."""

SHARE = 0.5
"""Largest relative response of an observable to the temperature of one species; for the pressure it is the
species' fraction of the pressure."""


def doubts_about(result: Any) -> list[str]:
    """Return the :func:`doubts` about an observable with ``block_values`` that is ``steady``; else none."""
    values = getattr(result, "block_values", ()) if getattr(result, "steady", True) else ()
    return doubts(getattr(result, "quantity", "what was measured"), result.primary, values) if values else []


def doubts(name: str, found: Estimate, values: Sequence[float]) -> list[str]:
    """Return doubts about a number in equal blocks, sentences on a ``name`` such as "the pressure".

    Tested are a trend, else a decay at the start, each at 1e-3, and the number of independent samples.
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
    if found.n_eff < FEW_SAMPLES:
        said.append(too_few(found.n_eff, f" of {name}"))
    elif found.n_eff < FEW <= 0.5 * len(values):
        said.append(
            f"Only {found.n_eff:.0f} independent samples of {name} were found in {len(values)} blocks: it "
            "changes slowly, and its error bar is a guess. Run longer, after a longer equilibration."
        )
    return said


def equipartition(
    names: Sequence[str], series: Sequence[Sequence[float]], freedoms: Sequence[float]
) -> list[str]:
    """Return a sentence on the species that are hotter or colder than the whole, at a level of 1e-3, or none.

    ``series`` (m, K) is the temperature of each over that of all; its error is at most that of one sample in
    equilibrium, ``sqrt(2 / f (1 - f / F))`` for f of F degrees of freedom.
    """
    tail = 0.5 * LEVEL / max(len(names), 1)
    found = []
    for name, values, alone in _temperatures(names, series, freedoms):
        with unwarned():
            mean = blocking(values)
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


def slow_exchange(
    names: Sequence[str],
    series: Sequence[Sequence[float]],
    freedoms: Sequence[float],
    relative_error: float,
) -> list[str]:
    """Return a sentence on the species that exchanged too little energy for a reliable error bar, or none.

    The mean square change ``2 alone**2 (1 - a)`` between successive temperatures tells their correlation a,
    also in stretches far shorter than its decay. Of k samples ``m = k (1 - a) / (1 + a)`` are independent:
    too few if m < 1/4, or if m < 8 and half of ``alone / sqrt(max(m, 1))`` exceeds the ``relative_error``.
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


def slow_structure(scene: Scene, square: float) -> list[str]:
    """Return a sentence if a stretch is too short for the slow fluctuations near freezing, or nothing.

    They have relaxed when particles have left their neighborhoods, by their mean ``square`` displacement
    [length^2]: in space they are 1 % of the variance of a block, but double that of the mean.
    """
    freezing = FREEZING.get(scene.dimension)
    if freezing is None or scene.packing_fraction < NEAR_FREEZING * freezing:
        return []
    moved = math.sqrt(square) / (scene.volume / scene.n) ** (1.0 / scene.dimension)
    needed = RENEWED.get(scene.dimension, RENEWED_OTHERWISE)
    if moved >= needed or caged(scene, moved):
        return []
    return [
        f"The particles moved by {moved:.2g} mean spacings during the stretch. Near freezing (packing "
        f"fraction {freezing:g}) their arrangement changes as slowly as they move, and the error bar holds "
        f"nothing that is slower than the stretch. Run {(needed / moved) ** 2:.2g} times as long, for "
        f"{needed:g} mean spacings."
    ]


def caged(scene: Scene, moved: float) -> bool:
    """Tell whether particles that ``moved`` so far [mean spacing] sit in the cages of a crystal or a glass.

    The stable phase of equal particles beyond melting is a crystal; at melting itself it still changes
    slowly. In the plane its particles move the further, the more there are, as the logarithm of their number.
    """
    beyond = round(scene.packing_fraction, 9) > MELTING.get(scene.dimension, math.inf)
    frozen = beyond and is_simple(scene)
    return moved <= (STUCK if frozen else CAGED)


def _temperatures(
    names: Sequence[str], series: Sequence[Sequence[float]], freedoms: Sequence[float]
) -> Iterator[tuple[str, np.ndarray, float]]:
    """Yield name, temperatures and their standard deviation in equilibrium, for each species [kT]."""
    ratios = np.asarray(series, dtype=np.float64)
    if ratios.ndim != 2 or ratios.shape[1] < 2 or not len(ratios):
        return
    total = math.fsum(freedoms)
    for name, values, freedom in zip(names, ratios.T, freedoms, strict=True):
        if freedom > 0.0:
            yield name, values, math.sqrt(2.0 / freedom * max(1.0 - freedom / total, 0.0))


def _parts(values: np.ndarray) -> int:
    """Return the number of nearly independent parts of a series, after its linear trend is removed."""
    if values.size < 2:
        return FEWEST_PARTS
    times = np.arange(values.size) - 0.5 * (values.size - 1)
    rest = values - values.mean() - dot(times, values) / dot(times, times) * times
    with unwarned():
        known = min(blocking(rest).n_eff, float(values.size))
    return min(PARTS, max(FEWEST_PARTS, int(known / PART)))


def _beyond(level: float) -> float:
    """Return the bound that a standard normal number exceeds, on either side, with this probability."""
    return normal_above(0.5 * level)
