"""Times and impulses of hard contacts, for every model that has them."""

from __future__ import annotations

import numpy as np

from carom.models.interfaces.particles import NEVER
from carom.models.mathematics.double_double import exact_product, exact_sum

MOST_DIAMETERS = 32.0
"""Contact distances from which a contact is computed again from nearby.

The square of a distance r is rounded by ``eps r^2``. The distance at contact is then off by
``eps (r / sigma)^2 / 2`` diameters: 1e-13 from 32 diameters away, less than a scene tolerates.
"""

LONGER = 1.0 + 2.0**-34
"""Length over that of r of the vector along which momentum is exchanged, so that its rounding is fair.

A number near a power of two, such as r.r of spheres of diameter 1, times or over another one is nearly on the
grid of that one, and just below the power it is rounded to the same side more often than not. Every collision
would heat the spheres by 1e-17. The longer vector is rounded too, fairly, and is nowhere near.
"""


def first_contact(c: float, rv: float, vv: float) -> float:
    """Return the time until r.r has fallen by c, or NEVER (Lubachevsky 1991, eq. 2).

    The form ``c / (-b + sqrt(b^2 - a c))`` keeps its digits at grazing contacts. A pair that overlaps by
    rounding and approaches meets now (sec. 6). There is no branch, so that the loop over candidates is
    vectorized.
    """
    discriminant = rv * rv - vv * c
    t = c / (np.sqrt(max(discriminant, 0.0)) - rv)
    return max(t, 0.0) if (rv < 0.0) & (discriminant >= 0.0) else NEVER


def contact_time_known(c, rv, vv):
    """Return the time until r.r of a pair known to meet has fallen by ``c``, and if it is negative."""
    t = c / (np.sqrt(max(rv * rv - vv * c, 0.0)) - rv)
    return max(t, 0.0), t < 0.0


def elastic(pair, i, j, rr, approach):
    """Return what an elastic contact of unequal masses adds: the answer of ``jump``.

    Parameters
    ----------
    pair : model
        With ``masses``.
    i, j : int
        The particles.
    rr, approach : float
        r.r [length^2] and r.v of the surfaces.
    """
    ours, theirs = pair.masses[i], pair.masses[j]
    a, b = shares(ours, theirs, rr, 2.0 * approach)
    return a, b, -2.0 * approach * (ours * theirs / (ours + theirs))


def shares(ours, theirs, rr, lost):
    """Return the first two numbers of a ``jump`` in which r.v loses ``lost``, for two masses.

    The share of each mass in the sum would be rounded alike at all contacts of the two, so it has twice the
    digits: only the numbers returned are rounded.
    """
    total, rest = exact_sum(ours, theirs)
    high, low = exact_product(LONGER, total)
    sums = high, low + LONGER * rest, 1.0 / high
    factor = LONGER * lost / rr
    return _share(theirs, sums, factor), _share(ours, sums, factor)


def _share(mass, sums, factor):
    """Return ``factor mass / (high + low)``, rounded once; ``sums`` are high, low and 1 / high."""
    high, low, inverse = sums
    part = mass * inverse
    product, error = exact_product(part, high)
    rest = ((mass - product) - error - part * low) * inverse
    product, error = exact_product(factor, part)
    return product + (error + factor * rest)


def exit_sphere(c, b, a):
    """Return the later root of ``c + 2 b t + a t^2`` (c <= 0: inside), or now for what leaves already."""
    if c > 0.0 and b > 0.0:
        return 0.0
    root = np.sqrt(max(b * b - a * c, 0.0))
    if b > 0.0:
        return -c / (b + root)
    return (root - b) / a if a > 0.0 else NEVER
