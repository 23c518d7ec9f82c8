"""Hard cores: when two components meet, and what the meeting does to their velocities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.columns import WIDTH, line_up
from carom.compiling.dispatch import generic, inner
from carom.engine.constants import NEVER

PLACES = 2 * WIDTH
"""Candidates that can be side by side: those of two searches."""


class EqualCores(NamedTuple):
    """Hard cores of one diameter and one mass."""

    square: float
    """Diameter squared [length^2]."""
    core: float
    """Radius [length]."""
    weight: float
    """Mass of each component."""


class UnequalCores(NamedTuple):
    """Hard cores that touch at the sum of their radii."""

    radii: np.ndarray
    """(n + 1,) float64; the ghost has one, too."""
    masses: np.ndarray
    """(n + 1,) float64."""
    lined_radii: np.ndarray
    """Room for the radii of candidates side by side, (PLACES,) float64."""


class SpeciesCores(NamedTuple):
    """Hard cores that touch at a distance of their own for every pair of species (non-additive)."""

    kinds: np.ndarray
    """Species, (n + 1,) int64."""
    squares: np.ndarray
    """Contact distances squared, (K * K,) float64."""
    species: int
    """K."""
    radii: np.ndarray
    """At obstacles, (n + 1,) float64."""
    masses: np.ndarray
    """(n + 1,) float64."""
    lined_kinds: np.ndarray
    """Room for the species of candidates side by side, (PLACES,) int64."""


class GrowingCores(NamedTuple):
    """Hard cores whose radii grow linearly (Lubachevsky and Stillinger; the paper's sec. 8)."""

    radii: np.ndarray
    """At the beginning of the epoch, (n + 1,) float64."""
    rates: np.ndarray
    """Radius gained a time, (n + 1,) float64."""
    masses: np.ndarray
    """(n + 1,) float64."""
    lined_radii: np.ndarray
    """Room for the radii of candidates side by side, (PLACES,) float64."""
    lined_rates: np.ndarray
    """And for their rates."""


@generic
def radius(pair, i, now):
    """Return the radius of component i at the time now."""
    raise NotImplementedError(type(pair))


@radius.register
def _(pair: EqualCores, i, now):
    return pair.core


@radius.register
def _(pair: UnequalCores, i, now):
    return pair.radii[i]


@radius.register
def _(pair: SpeciesCores, i, now):
    return pair.radii[i]


@radius.register
def _(pair: GrowingCores, i, now):
    return pair.radii[i] + pair.rates[i] * now


@generic
def growth(pair, i):
    """Return the rate at which the radius of component i grows."""
    raise NotImplementedError(type(pair))


@growth.register
def _(pair: EqualCores, i):
    return 0.0


@growth.register
def _(pair: UnequalCores, i):
    return 0.0


@growth.register
def _(pair: SpeciesCores, i):
    return 0.0


@growth.register
def _(pair: GrowingCores, i):
    return pair.rates[i]


@generic
def mass(pair, i):
    """Return the mass of component i."""
    raise NotImplementedError(type(pair))


@mass.register
def _(pair: EqualCores, i):
    return pair.weight


@mass.register
def _(pair: UnequalCores, i):
    return pair.masses[i]


@mass.register
def _(pair: SpeciesCores, i):
    return pair.masses[i]


@mass.register
def _(pair: GrowingCores, i):
    return pair.masses[i]


@generic
def age(pair, duration):
    """Bring what depends on time from the beginning of an epoch to that of the next."""
    raise NotImplementedError(type(pair))


@age.register
def _(pair: EqualCores, duration):
    return None


@age.register
def _(pair: UnequalCores, duration):
    return None


@age.register
def _(pair: SpeciesCores, duration):
    return None


@age.register
def _(pair: GrowingCores, duration):
    for i in range(len(pair.radii)):
        pair.radii[i] += pair.rates[i] * duration


@inner
def additive(pair, i, j):
    """Return the contact distance squared of cores that do not grow."""
    contact = pair.radii[i] + pair.radii[j]
    return contact * contact


@inner
def tabled(pair, i, j):
    """Return the contact distance squared of a pair of species."""
    return pair.squares[pair.kinds[i] * pair.species + pair.kinds[j]]


@inner
def first_contact(c, rv, vv):
    """Return the time until r.r has fallen by c, or NEVER (Lubachevsky 1991, eq. 2).

    In the form ``c / (-b + sqrt(b^2 - a c))``, which keeps its digits at grazing contacts. A pair that
    overlaps by rounding and approaches meets now (sec. 6). No branch: the loop over candidates is vectorised.
    """
    discriminant = rv * rv - vv * c
    t = c / (np.sqrt(max(discriminant, 0.0)) - rv)
    return max(t, 0.0) if (rv < 0.0) & (discriminant >= 0.0) else NEVER


@inner
def sure_contact(c, rv, vv):
    """Return the time until contact of a pair known to meet, and whether it was negative."""
    t = c / (np.sqrt(max(rv * rv - vv * c, 0.0)) - rv)
    return max(t, 0.0), t < 0.0


@inner
def growing(radii, rate, rr, rv, vv, now):
    """Return c, b, a of ``c + 2 b t + a t^2 = 0`` at the contact of two cores whose radii, of that sum at the
    beginning of the epoch, grow at that rate together.
    """
    contact = radii + rate * now
    return rr - contact * contact, rv - contact * rate, vv - rate * rate


@generic
def line_up_cores(pair, words, begin, bits, place):
    """Put side by side what ``interaction_time`` needs to know of eight candidates' cores: left to itself the
    compiler gathers, which takes several times as long.

    Parameters
    ----------
    pair : model
        The pair interaction.
    words : uint32 array
        ``words[begin : begin + 8] >> bits`` are the candidates.
    place : int
        Place of the first of them, below :data:`PLACES`.
    """
    raise NotImplementedError(type(pair))


@line_up_cores.register
def _(pair: EqualCores, words, begin, bits, place):
    return None


@line_up_cores.register
def _(pair: UnequalCores, words, begin, bits, place):
    line_up(pair.radii, words, begin, bits, pair.lined_radii, place)


@line_up_cores.register
def _(pair: SpeciesCores, words, begin, bits, place):
    line_up(pair.kinds, words, begin, bits, pair.lined_kinds, place)


@line_up_cores.register
def _(pair: GrowingCores, words, begin, bits, place):
    line_up(pair.radii, words, begin, bits, pair.lined_radii, place)
    line_up(pair.rates, words, begin, bits, pair.lined_rates, place)


@generic
def interaction_time(pair, i, j, place, rr, rv, vv, now):
    """Time from now until components i and j touch, or NEVER.

    Parameters
    ----------
    pair : model
        The pair interaction.
    i, j : int
        The components.
    place : int
        Where ``line_up_cores`` has put what is needed of j.
    rr, rv, vv : float
        r.r [length^2], r.v and v.v of j relative to i, both at the time ``now``.
    """
    raise NotImplementedError(type(pair))


@interaction_time.register
def _(pair: EqualCores, i, j, place, rr, rv, vv, now):
    return first_contact(rr - pair.square, rv, vv)


@interaction_time.register
def _(pair: UnequalCores, i, j, place, rr, rv, vv, now):
    contact = pair.radii[i] + pair.lined_radii[place]
    return first_contact(rr - contact * contact, rv, vv)


@interaction_time.register
def _(pair: SpeciesCores, i, j, place, rr, rv, vv, now):
    return first_contact(rr - pair.squares[pair.kinds[i] * pair.species + pair.lined_kinds[place]], rv, vv)


@interaction_time.register
def _(pair: GrowingCores, i, j, place, rr, rv, vv, now):
    radii, rate = pair.radii[i] + pair.lined_radii[place], pair.rates[i] + pair.lined_rates[place]
    c, b, a = growing(radii, rate, rr, rv, vv, now)
    discriminant = b * b - a * c
    t = c / (np.sqrt(max(discriminant, 0.0)) - b)
    # Cores that grow faster than their centres part are caught up with (a < 0); i grows into itself, which is
    # no meeting.
    meets = ((b < 0.0) | (a < 0.0)) & (discriminant >= 0.0) & (np.int64(i) != np.int64(j))
    return max(t, 0.0) if meets else NEVER


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
    return sure_contact(rr - pair.square, rv, vv)


@contact_time.register
def _(pair: UnequalCores, i, j, rr, rv, vv, now):
    return sure_contact(rr - additive(pair, i, j), rv, vv)


@contact_time.register
def _(pair: SpeciesCores, i, j, rr, rv, vv, now):
    return sure_contact(rr - tabled(pair, i, j), rv, vv)


@contact_time.register
def _(pair: GrowingCores, i, j, rr, rv, vv, now):
    radii, rate = pair.radii[i] + pair.radii[j], pair.rates[i] + pair.rates[j]
    c, b, a = growing(radii, rate, rr, rv, vv, now)
    return sure_contact(c, b, a)


@generic
def jump(pair, i, j, rr, rv, now):
    """Return what an elastic contact adds to the velocities: ``v_i += a r``, ``v_j -= b r`` with r from i to
    j.

    Returns
    -------
    a, b : float
        The factors of r [1 / time].
    virial : float
        ``r . dp`` of the contact [mass length^2 / time].
    """
    raise NotImplementedError(type(pair))


@jump.register
def _(pair: EqualCores, i, j, rr, rv, now):
    # The distance found, not the diameter: the energy is then kept to rounding even where c was not quite
    # zero.
    factor = rv / rr
    return factor, factor, -pair.weight * rv


@inner
def exchange(pair, i, j, rr, approach):
    """Return what the exchange of momentum of unequal masses does; ``approach`` is r.v of the surfaces."""
    total = pair.masses[i] + pair.masses[j]
    factor = 2.0 * approach / (rr * total)
    return (
        factor * pair.masses[j],
        factor * pair.masses[i],
        -2.0 * approach * (pair.masses[i] * pair.masses[j] / total),
    )


@jump.register
def _(pair: UnequalCores, i, j, rr, rv, now):
    return exchange(pair, i, j, rr, rv)


@jump.register
def _(pair: SpeciesCores, i, j, rr, rv, now):
    return exchange(pair, i, j, rr, rv)


@jump.register
def _(pair: GrowingCores, i, j, rr, rv, now):
    # Elastic in the frame of the surfaces, which approach each other faster than the centres: no pair sticks.
    return exchange(pair, i, j, rr, rv - np.sqrt(rr) * (pair.rates[i] + pair.rates[j]))


@generic
def depth(pair, i, j, rr, now):
    """Return ``(contact distance)^2 / r.r``: above one where i and j overlap."""
    raise NotImplementedError(type(pair))


@depth.register
def _(pair: EqualCores, i, j, rr, now):
    return pair.square / rr


@depth.register
def _(pair: UnequalCores, i, j, rr, now):
    return additive(pair, i, j) / rr


@depth.register
def _(pair: SpeciesCores, i, j, rr, now):
    return tabled(pair, i, j) / rr


@depth.register
def _(pair: GrowingCores, i, j, rr, now):
    contact = radius(pair, i, now) + radius(pair, j, now)
    return contact * contact / rr


class Inelastic(NamedTuple):
    """Contacts that lose energy."""

    restitution: float
    """Normal speed after over normal speed before a contact."""
    threshold: float
    """Normal speed below which a contact is elastic, so that no number of contacts piles up in a finite time
    (inelastic collapse).
    """
    spared: np.ndarray
    """How many contacts were elastic for that reason, (1,) int64."""


@generic
def transfer(impact, rr, rv):
    """Return the part of an elastic contact's momentum that is exchanged: ``(1 + e) / 2``.

    ``rv`` is r.v of the surfaces.
    """
    raise NotImplementedError(type(impact))


@transfer.register
def _(impact: None, rr, rv):
    return 1.0


@transfer.register
def _(impact: Inelastic, rr, rv):
    if rv * rv < impact.threshold * impact.threshold * rr:
        impact.spared[0] += 1
        return 1.0
    return 0.5 * (1.0 + impact.restitution)
