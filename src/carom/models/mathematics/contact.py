"""Times and impulses of hard contacts, for every model that has them."""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import inner
from carom.models.questions.particles import NEVER

MOST_DIAMETERS = 32.0
"""Contact distances from which a contact is computed again from nearby.

The square of a distance r is rounded by ``eps r^2``. The distance at contact is then off by
``eps (r / sigma)^2 / 2`` diameters: 1e-13 from 32 diameters away, less than a scene tolerates.
"""


@inner
def first_contact(c, rv, vv):
    """Return the time until r.r has fallen by c, or NEVER (Lubachevsky 1991, eq. 2).

    The form ``c / (-b + sqrt(b^2 - a c))`` keeps its digits at grazing contacts. A pair that overlaps by
    rounding and approaches meets now (sec. 6). There is no branch, so that the loop over candidates is
    vectorized.
    """
    discriminant = rv * rv - vv * c
    t = c / (np.sqrt(max(discriminant, 0.0)) - rv)
    return max(t, 0.0) if (rv < 0.0) & (discriminant >= 0.0) else NEVER


@inner
def contact_time_known(c, rv, vv):
    """Return the time until r.r of a pair known to meet has fallen by ``c``, and if it is negative."""
    t = c / (np.sqrt(max(rv * rv - vv * c, 0.0)) - rv)
    return max(t, 0.0), t < 0.0


@inner
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
    total = pair.masses[i] + pair.masses[j]
    factor = 2.0 * approach / (rr * total)
    return (
        factor * pair.masses[j],
        factor * pair.masses[i],
        -2.0 * approach * (pair.masses[i] * pair.masses[j] / total),
    )


@inner
def exit_sphere(c, b, a):
    """Return the later root of ``c + 2 b t + a t^2`` (c <= 0: inside), or now for what leaves already."""
    if c > 0.0 and b > 0.0:
        return 0.0
    root = np.sqrt(max(b * b - a * c, 0.0))
    if b > 0.0:
        return -c / (b + root)
    return (root - b) / a if a > 0.0 else NEVER
