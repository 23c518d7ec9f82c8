"""Hard cores: when two components meet, and what the meeting does to their velocities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.kernel.constants import NEVER
from carom.kernel.dispatch import generic


class EqualCores(NamedTuple):
    """Hard cores of one diameter and one mass."""

    square: float
    """Diameter squared [length^2]."""
    mass: float
    """Mass of each component."""


@generic
def interaction_time(pair, i, j, rr, rv, vv, now):
    """Time from now until components i and j touch, or NEVER.

    Parameters
    ----------
    pair : model
        The pair interaction.
    i, j : int
        The components.
    rr, rv, vv : float
        r.r [length^2], r.v and v.v of j relative to i, both at the time ``now``.

    Notes
    -----
    Lubachevsky (1991), eq. (2), in the form ``c / (-b + sqrt(b^2 - a c))``, which keeps its digits at grazing
    contacts. A pair that overlaps by rounding and approaches meets now (sec. 6). No branch: the loop over
    candidates is vectorised.
    """
    raise NotImplementedError(type(pair))


@interaction_time.register
def _(pair: EqualCores, i, j, rr, rv, vv, now):
    c = rr - pair.square
    discriminant = rv * rv - vv * c
    t = c / (np.sqrt(max(discriminant, 0.0)) - rv)
    return max(t, 0.0) if (rv < 0.0) & (discriminant >= 0.0) else NEVER


@generic
def contact_time(pair, i, j, rr, rv, vv, now):
    """Time from now until i and j touch, where ``interaction_time`` said that they do.

    Rounded along another path a grazing contact may look like a miss; here it is a contact at the closest
    approach.

    Returns
    -------
    t : float
        Time until contact, not negative.
    clamped : bool
        Whether a negative root was replaced by zero (the paper's sec. 6).
    """
    raise NotImplementedError(type(pair))


@contact_time.register
def _(pair: EqualCores, i, j, rr, rv, vv, now):
    c = rr - pair.square
    t = c / (np.sqrt(max(rv * rv - vv * c, 0.0)) - rv)
    return max(t, 0.0), t < 0.0


@generic
def jump(pair, i, j, rr, rv):
    """Return what a contact adds to the velocities: ``v_i += a r``, ``v_j -= b r`` with r from i to j.

    Returns
    -------
    a, b : float
        The factors of r [1 / time].
    virial : float
        ``r . dp`` of the contact [energy].
    """
    raise NotImplementedError(type(pair))


@jump.register
def _(pair: EqualCores, i, j, rr, rv):
    # The distance found, not the diameter: the energy is then kept to rounding even where c was not quite
    # zero.
    factor = rv / rr
    return factor, factor, -pair.mass * rv


@generic
def depth(pair, i, j, rr):
    """Return ``(contact distance)^2 / r.r``: above one where i and j overlap."""
    raise NotImplementedError(type(pair))


@depth.register
def _(pair: EqualCores, i, j, rr):
    return pair.square / rr
