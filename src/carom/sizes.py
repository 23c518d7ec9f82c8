"""Diameters of polydisperse particles: quantiles of a distribution, in random order, with mean 1.

They are no random draws. Particle k of n has the quantile of ``(k + 1/2) / n``, so that all seeds give one
composition, and its moments are those of the distribution within ``1 / n``. In the end all are divided by
their mean: the *mean diameter* is 1, so other moments are not. Every function returns an array (n,) for
``Scene.random(diameter=...)``, and an array of your own does as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from statistics import NormalDist
from typing import Any

import numpy as np

from carom import checks, seeds
from carom.errors import InputError


def power(n: int, *, ratio: float, exponent: float = 3.0, seed: int | np.random.Generator = 1) -> np.ndarray:
    """Return diameters with the density ``P(s) ~ s**-exponent`` between two sizes, (n,) [length].

    Parameters
    ----------
    n : int
        Number of particles.
    ratio : float
        Smallest over largest diameter of the distribution, between 0 and 1.
    exponent : float
        With 3, each octave of sizes has the same volume per area: sizes of a common model of glasses.
    seed : int or numpy.random.Generator
        Source of the order.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    Berthier, Coslovich, Ninarello, Ozawa, Phys. Rev. Lett. 116 (2016) 238002, take the ratio 0.4492: a
    polydispersity (standard deviation over mean) of 23 %.

    Examples
    --------
    >>> import carom
    >>> s = carom.sizes.power(1000, ratio=0.4492)
    >>> float(s.std().round(3)), float((s.min() / s.max()).round(2))
    (0.23, 0.45)
    """
    ratio = checks.number(ratio, "ratio", low=0.0, high=1.0, open_low=True)
    exponent = checks.number(exponent, "exponent", low=-100.0, high=100.0)
    if exponent == 1.0:
        return _quantiles(n, lambda p: float(ratio ** (1.0 - p)), seed)
    power = 1.0 - exponent
    part = math.expm1(abs(power) * math.log(ratio))  # neither cancels near 1, nor overflows
    if power < 0.0:
        return _quantiles(n, lambda p: ratio * math.exp(math.log1p(p * part) / power), seed)
    return _quantiles(n, lambda p: math.exp(math.log1p((1.0 - p) * part) / power), seed)


def uniform(n: int, *, polydispersity: float, seed: int | np.random.Generator = 1) -> np.ndarray:
    """Return diameters spread evenly between two sizes, (n,) [length].

    Parameters
    ----------
    n : int
        Number of particles.
    polydispersity : float
        Standard deviation over mean, below ``1 / sqrt(3)``: no diameter is zero.
    seed : int or numpy.random.Generator
        Source of the order.

    Raises
    ------
    InputError
        If an argument is out of range.

    Examples
    --------
    >>> import carom
    >>> carom.sizes.uniform(3, polydispersity=0.3).mean().round(12)
    np.float64(1.0)
    """
    wide = math.sqrt(3.0) * checks.number(polydispersity, "polydispersity", low=0.0)
    return _quantiles(n, lambda p: 1.0 + wide * (2.0 * p - 1.0), seed)


def gaussian(n: int, *, polydispersity: float, seed: int | np.random.Generator = 1) -> np.ndarray:
    """Return normally distributed diameters, (n,) [length].

    Parameters
    ----------
    n : int
        Number of particles.
    polydispersity : float
        Standard deviation over mean. The quantiles of n particles end where ``1 / 2n`` are smaller.
    seed : int or numpy.random.Generator
        Source of the order.

    Raises
    ------
    InputError
        If an argument is out of range, or a diameter were not positive.

    Examples
    --------
    >>> import carom
    >>> carom.sizes.gaussian(1000, polydispersity=0.1).std().round(3)
    np.float64(0.1)
    """
    width = checks.number(polydispersity, "polydispersity", low=0.0)
    normal = NormalDist()
    return _quantiles(n, lambda p: 1.0 + width * normal.inv_cdf(p), seed)


DISTRIBUTIONS: dict[str, tuple[Callable[..., np.ndarray], tuple[str, ...], tuple[str, ...]]] = {
    "power": (power, ("ratio",), ("exponent",)),
    "uniform": (uniform, ("polydispersity",), ()),
    "gaussian": (gaussian, ("polydispersity",), ()),
}
"""By the ``type`` of a table: the function, the keys that it needs, and those that have defaults."""


def of_table(table: Mapping[str, Any], n: int, seed: int | np.random.Generator = 1) -> np.ndarray:
    """Return the diameters that a table of a scene file says, (n,) [length].

    Parameters
    ----------
    table : mapping
        Its ``type`` names a function of this module, and its other keys are arguments: ``{"type": "power",
        "ratio": 0.45}``.
    n : int
        Number of particles.
    seed : int or numpy.random.Generator
        Source of the order.

    Raises
    ------
    InputError
        If the table has other keys, or an argument is out of range.

    Examples
    --------
    >>> import carom
    >>> carom.sizes.of_table({"type": "uniform", "polydispersity": 0.1}, 500).std().round(3)
    np.float64(0.1)
    """
    given = dict(table)
    kind = given.pop("type", None)
    if not isinstance(kind, str) or kind not in DISTRIBUTIONS:
        raise InputError(f"type must be one of {', '.join(DISTRIBUTIONS)}; found {checks.describe(kind)}.")
    make, needed, optional = DISTRIBUTIONS[kind]
    checks.keys(given, f"the type {kind}", (*needed, *optional), needed=needed)
    return make(n, **given, seed=seed)


def _quantiles(n: int, quantile: Callable[[float], float], seed: int | np.random.Generator) -> np.ndarray:
    """Return the quantiles of n particles in random order, over their mean."""
    n = checks.integer(n, "n", low=1)
    sizes = np.array([quantile((k + 0.5) / n) for k in range(n)])
    if not 0.0 < sizes.min() <= sizes.max() < math.inf:
        raise InputError(
            f"The smallest of {n} diameters would be {sizes.min():.3g} of the mean; lower polydispersity."
        )
    return seeds.generator(seed, "sizes").permutation(sizes / sizes.mean())
