"""Random placement of spheres that do not overlap, at fluid densities and in any dimension."""

from __future__ import annotations

import numpy as np

from carom.errors import InputError
from carom.initial import sphere_volume
from carom.overlaps import pair_distances, pairs_within, wrapped

#: Packing fraction of random close packing in d dimensions, to two digits: O'Hern et al. (2003) for d = 2 and
#: 3, Skoge, Donev, Stillinger and Torquato (2006) for d = 4 to 6.
RANDOM_CLOSE_PACKING = {2: 0.84, 3: 0.64, 4: 0.46, 5: 0.31, 6: 0.20}

#: Up to this part of random close packing, well above freezing in every dimension, a few hundred steps
#: suffice.
REACH = 0.85

#: Pairs are moved to this distance [diameter], beyond contact, so that the last of them clear it after few
#: steps.
CLEARANCE = 1 + 1e-3

#: Pairs up to this much farther apart [diameter] are listed, and used until one sphere has moved half of it.
SKIN = 0.3

#: Steps after which a scene counts as jammed; the densest that are allowed took 100 to 500.
PATIENCE = 5000


def random_limit(dimension: int) -> float:
    """Return the highest packing fraction at which spheres are placed at random in d dimensions.

    From d = 7 on, the value of d = 6 reduced by 2 a dimension, below the known ones.
    """
    if dimension == 1:
        return 1.0
    known = min(dimension, 6)
    return REACH * RANDOM_CLOSE_PACKING[known] / 2 ** (dimension - known)


def default_fraction(dimension: int) -> float:
    """Return a moderate packing fraction: 0.3, or half of random close packing where that is less."""
    return min(0.3, random_limit(dimension) / (2 * REACH))


def random_positions(n: int, box: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the centres (n, d) of unit spheres without overlap.

    Parameters
    ----------
    n : int
        Number of spheres.
    box : (d,) array
        Edges [diameter].
    rng : numpy.random.Generator
        Source of randomness.

    Raises
    ------
    InputError
        If the box is too full.

    Notes
    -----
    For d = 1 this is the exact equilibrium distribution at any density: the gaps of n points thrown on a line
    of the free length. For d >= 2 the points are thrown into the box and pairs that overlap are moved apart
    along their centre line until none is left: a valid start, but no equilibrium, so equilibrate it. Below
    jamming this took 40 steps at packing fraction 0.3 and some 200 at 0.54 (d = 3).
    """
    dimension = len(box)
    fraction = n * sphere_volume(dimension) / float(np.prod(box))
    limit = random_limit(dimension)
    if fraction > limit or (dimension == 1 and n >= box[0]):
        raise InputError(
            f"Spheres are placed at random up to packing fraction {limit:.3g} in {dimension} "
            f"dimension{'s' * (dimension > 1)}, found {fraction:.6g}. Start from a lattice and equilibrate."
        )
    if dimension == 1:
        free = float(box[0]) - n
        starts = np.sort(rng.random(n)) * free + np.arange(n) + rng.random() * box[0]
        return wrapped(starts[:, None], box)
    positions = separated(rng.random((n, dimension)) * box, box)
    if positions is None:
        raise InputError(
            f"No random placement of {n} spheres was found in a box of {' x '.join(f'{x:.4g}' for x in box)} "
            "diameters. Lower packing_fraction, or start from a lattice and equilibrate."
        )
    return positions


def separated(
    positions: np.ndarray, box: np.ndarray, clearance: float = CLEARANCE, patience: int = PATIENCE
) -> np.ndarray | None:
    """Move unit spheres apart until none overlap, or return None if that does not end.

    Parameters
    ----------
    positions : (n, d) array
        Centres [diameter].
    box : (d,) array
        Edges [diameter].
    clearance : float
        Distance [diameter] to which pairs closer than that are moved.
    patience : int
        Steps after which it ends without a result.
    """
    n = len(positions)
    listed_at = positions = wrapped(positions, box)
    pairs = pairs_within(positions, box, clearance + SKIN)
    for _ in range(patience):
        moved = positions - listed_at
        if np.einsum("ij,ij->i", moved, moved).max() > (SKIN / 2) ** 2:
            listed_at = positions = wrapped(positions, box)
            pairs = pairs_within(positions, box, clearance + SKIN)
        separation, distance = pair_distances(positions, pairs, box)
        if not (distance < 1).any():
            return wrapped(positions, box)
        near = np.nonzero((distance < clearance) & (distance > 0))[0]
        i, j = pairs[near].T
        step = separation[near] * (0.5 * (clearance / distance[near] - 1))[:, None]
        shift = [np.bincount(j, s, n) - np.bincount(i, s, n) for s in step.T]
        positions = positions + np.stack(shift, axis=1)
    return None
