"""Random placement of spheres that do not overlap, at fluid densities and in any dimension.

Spheres are equal or not, in a periodic box or between walls and obstacles.
"""

from __future__ import annotations

import numpy as np

from carom.arithmetic import power
from carom.compiling.entry import entry
from carom.densities import CLOSEST_PACKING, sphere_volume
from carom.errors import InputError
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import MANY, Geometry

#: Packing fraction of random close packing in d dimensions, to two digits: O'Hern et al. (2003) for d = 2 and
#: 3, Skoge, Donev, Stillinger and Torquato (2006) for d = 4 to 6.
RANDOM_CLOSE_PACKING = {2: 0.84, 3: 0.64, 4: 0.46, 5: 0.31, 6: 0.20}

#: Up to this part of random close packing, which is above freezing in every dimension, a few hundred steps
#: suffice.
REACH = 0.85

#: Growth (``carom.simulation.moves.growth``) reaches this part.
GROWTH_REACH = 0.96

#: Packing fraction at which growth starts, over the highest of random placement; about ten steps reach it.
GROWTH_START = 0.4

#: Pairs are moved to this many contact distances, so that the last of them clear contact after few steps.
CLEARANCE = 1 + 1e-3

#: The same for many components, of which only pairs that overlap are moved: half as many sweeps as at 1e-3.
WIDE_CLEARANCE = 1.01

#: Skin of the list of pairs, in diameters of their sizes. The list is used until a sphere has moved half of
#: its skin.
SKIN = 0.3

#: The same for many components: compiled sweeps over longer lists take less time than listing more often.
WIDE_SKIN = 0.6

#: Steps after which a scene counts as jammed; the densest scenes allowed took 100 to 500.
PATIENCE = 5000

#: How often a component that overlaps an obstacle, or a larger component, is placed again. After that it is
#: pushed out instead.
THROWS = 50

#: Weight of a component that stays: above all others, and a power of two, which leaves products exact.
UNMOVED = 2.0**900


def random_limit(dimension: int) -> float:
    """Return the highest packing fraction at which spheres are placed at random in d dimensions.

    From d = 7 on, it is the value of d = 6, halved for each further dimension: less than the known values.
    """
    if dimension == 1:
        return 1.0
    known = min(dimension, 6)
    return REACH * RANDOM_CLOSE_PACKING[known] / 2 ** (dimension - known)


def growth_limit(dimension: int) -> float:
    """Return the highest packing fraction that is reached by growth from a random placement."""
    return GROWTH_REACH / REACH * random_limit(dimension)


def to_grow(packing_fraction: float, dimension: int) -> bool:
    """Tell whether growth reaches a density that random placement cannot reach."""
    limit = random_limit(dimension)
    if dimension == 1 or packing_fraction > growth_limit(dimension):
        return False
    return packing_fraction > limit


def growth_start(dimension: int) -> float:
    """Return the packing fraction from which to grow."""
    return GROWTH_START * random_limit(dimension)


def default_fraction(dimension: int) -> float:
    """Return a moderate packing fraction: 0.3, or half of random close packing where that is less."""
    return min(0.3, random_limit(dimension) / (2 * REACH))


def random_positions(
    room: Geometry, contacts: Contacts, rng: np.random.Generator, kinds: np.ndarray | None = None
) -> np.ndarray:
    """Return centers (n, d) without overlap, each of ``kinds`` sorted in space (:func:`ordered`).

    For additive rods (d = 1) this is the exact equilibrium: in random order, with the gaps of n points thrown
    on the free length. For d >= 2 points are thrown, and overlapping pairs moved apart along their center
    line: a valid start, no equilibrium. That took 40 steps at packing fraction 0.3, some 200 at 0.54 (d = 3).
    If sizes differ by a factor of 2 or more, the largest are placed first.
    """
    box, dimension, n = room.box, len(room.box), len(contacts.diameters)
    fraction = sphere_volume(dimension) * float(np.sum(np.prod(contacts.diameters[:, None] / box, axis=1)))
    limit = random_limit(dimension)
    if fraction > limit or (dimension == 1 and fraction >= 1):
        if dimension > 1 and contacts.additive and not room.tilt:
            limit = growth_limit(dimension)
        densest = CLOSEST_PACKING.get(dimension, 1.0)
        cure = f"Start from a lattice (Scene.crystal, --lattice), for equal ones up to {densest:.3g}"
        raise InputError(
            f"Spheres are placed at random up to packing fraction {limit:.3g} in {dimension} "
            f"dimension{'s' * (dimension > 1)}, found {fraction:.6g}. "
            + (f"{cure}, and equilibrate." if fraction <= 1 else "Take a larger box or fewer particles.")
        )
    if dimension == 1 and contacts.additive and not room.obstacles:
        return _rods(room, contacts, rng)
    positions, radii = np.zeros((n, dimension)), 0.5 * contacts.diameters
    placed = np.empty(0, dtype=np.int64)
    result: np.ndarray | None = positions
    for members in contacts.classes:
        places = _thrown(room, contacts, positions, placed, members, rng)
        positions[members] = places if kinds is None else ordered(places, box, kinds[members])
        placed = np.concatenate([placed, members])
        clearance = WIDE_CLEARANCE if len(placed) >= MANY else CLEARANCE
        result = separated(positions[placed], room, contacts.part(placed), radii[placed], clearance)
        if result is None:
            raise InputError(
                f"No random placement of {n} spheres was found in a box of "
                f"{' x '.join(f'{x:.4g}' for x in box / contacts.size(0))} (largest) diameters. "
                "Lower packing_fraction, or start from a lattice and equilibrate."
            )
        positions[placed] = result
    return positions


def ordered(positions: np.ndarray, box: np.ndarray, kinds: np.ndarray) -> np.ndarray:
    """Return the same positions (n, d), with those of each kind (n,) sorted in space.

    Neighbors in space are then neighbors in memory: a million spheres run up to a fifth faster.
    """
    n, dimension = positions.shape
    # Cells of about eight positions, in blocks of four cells along each axis.
    cells = np.floor(positions / box * max((n / 8.0) ** (1.0 / dimension), 1.0)).astype(np.int64)
    # One number sorts by kind, then by block, then by cell in the block.
    key = kinds.astype(np.int64)
    for part, count in ((cells // 4, int(cells.max()) // 4 + 1), (cells % 4, 4)):
        for axis in reversed(range(dimension)):
            key = key * count + part[:, axis]
    order = np.argsort(key, kind="stable")
    result = np.empty_like(positions)
    result[np.argsort(kinds, kind="stable")] = positions[order]
    return result


def _rods(room: Geometry, contacts: Contacts, rng: np.random.Generator) -> np.ndarray:
    """Return the centers (n, 1) of rods on a line, in equilibrium."""
    n, edge = len(contacts.diameters), float(room.box[0])
    order = np.arange(n)
    if len(np.unique(contacts.diameters)) > 1:
        order = rng.permutation(n)
    lengths = contacts.diameters[order]
    gaps = np.sort(rng.random(n)) * (edge - float(lengths.sum()))
    centers = np.empty((n, 1))
    centers[order, 0] = gaps + np.cumsum(lengths) - 0.5 * lengths
    if room.periodic[0]:
        centers += rng.random() * edge
    return room.wrapped(centers)


def _thrown(
    room: Geometry,
    contacts: Contacts,
    positions: np.ndarray,
    placed: np.ndarray,
    members: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return random places (m, d) of ``members``, if possible outside obstacles and spheres ``placed``."""
    places = rng.random((len(members), len(room.box))) * room.box
    radii = 0.5 * contacts.diameters[members]
    both = np.concatenate([placed, members])
    of_both = contacts.part(both) if len(placed) else None
    for _ in range(THROWS):
        wrong = np.zeros(len(members), dtype=bool)
        for _, who, gap in room.gaps(places, radii):
            wrong[who[gap < 0]] = True
        if of_both is not None:
            there = np.concatenate([positions[placed], places])
            pairs = room.pairs(there, of_both)
            # Only overlaps with spheres placed earlier count: the later sphere is thrown again.
            pairs = pairs[(pairs < len(placed)).sum(axis=1) == 1]
            near = room.distances(there, pairs) < of_both.of(pairs)
            wrong[pairs[near].max(axis=1) - len(placed)] = True
        if not wrong.any():
            break
        places[wrong] = rng.random((int(wrong.sum()), len(room.box))) * room.box
    return places


def separated(
    positions: np.ndarray,
    room: Geometry,
    contacts: Contacts,
    radii: np.ndarray,
    clearance: float = CLEARANCE,
    patience: int = PATIENCE,
    pinned: np.ndarray | None = None,
) -> np.ndarray | None:
    """Return spheres moved apart and out of obstacles, or None if that takes more than ``patience`` steps.

    Pairs closer than ``clearance`` contact distances are moved to that. Those ``pinned`` (n,) stay, and may
    overlap each other.
    """
    n, dimension = positions.shape
    # The displacements of a pair are inversely proportional to the volumes: the smaller sphere moves more.
    weight = power(contacts.diameters / contacts.size(0), dimension)
    if pinned is not None:
        weight = np.where(pinned, UNMOVED, weight)
    obstructed = bool(room.everything())
    if n >= MANY and not room.tilt:
        return _swept(positions, room, contacts, radii, weight, clearance, patience, pinned)
    far = (0.5 * SKIN * contacts.sizes) ** 2
    listed_at = positions = room.wrapped(positions)
    pairs = _movable(room.pairs(positions, contacts, clearance, SKIN), pinned)
    contact = contacts.of(pairs)
    for _ in range(patience):
        moved = positions - listed_at
        if (np.einsum("ij,ij->i", moved, moved) > far).any():
            listed_at = positions = room.wrapped(positions)
            pairs = _movable(room.pairs(positions, contacts, clearance, SKIN), pinned)
            contact = contacts.of(pairs)
        separation = room.separations(positions, pairs)
        distance = np.sqrt(np.einsum("ij,ij->i", separation, separation))
        outside = _moved_out(positions, room, radii, clearance) if obstructed else None
        if not (distance < contact).any() and outside is None:
            return room.wrapped(positions)
        near = np.nonzero((distance < clearance * contact) & (distance > 0))[0]
        i, j = pairs[near].T
        step = separation[near] * (clearance * contact[near] / distance[near] - 1)[:, None]
        share = (weight[i] / (weight[i] + weight[j]))[:, None]
        forwards, backwards = step * share, step * (1 - share)
        shift = [
            np.bincount(j, f, n) - np.bincount(i, b, n) for f, b in zip(forwards.T, backwards.T, strict=True)
        ]
        positions = (positions if outside is None else outside) + np.stack(shift, axis=1)
    return None


def _movable(pairs: np.ndarray, pinned: np.ndarray | None) -> np.ndarray:
    """Return the pairs (m, 2) of which one moves at least."""
    return pairs if pinned is None else pairs[~pinned[pairs].all(axis=1)]


def _swept(
    positions: np.ndarray,
    room: Geometry,
    contacts: Contacts,
    radii: np.ndarray,
    weight: np.ndarray,
    clearance: float,
    patience: int,
    pinned: np.ndarray | None,
) -> np.ndarray | None:
    """Do the same as :func:`separated` for many components, by compiled sweeps over the pairs.

    Each pair is moved at once, so that later pairs see the new positions. This takes fewer steps.
    """
    far = (0.5 * WIDE_SKIN * contacts.sizes) ** 2
    obstructed = bool(room.everything())
    edges = np.where(room.periodic, room.box, 0.0)
    inverse = np.where(room.periodic, 1.0 / room.box, 0.0)
    listed_at = None
    for _ in range(patience):
        if listed_at is None or (((positions - listed_at) ** 2).sum(axis=1) > far).any():
            listed_at = room.wrapped(positions)
            positions = listed_at.copy()
            pairs = _movable(room.pairs(positions, contacts, clearance, WIDE_SKIN), pinned)
            contact = contacts.of(pairs)
        outside = _moved_out(positions, room, radii, clearance) if obstructed else None
        if outside is not None:
            positions = outside
        what = positions, pairs, contact, weight, edges, inverse, clearance, np.empty(len(edges))
        if not sweep(*what) and outside is None:
            return room.wrapped(positions)
    return None


def _moved_out(
    positions: np.ndarray, room: Geometry, radii: np.ndarray, clearance: float
) -> np.ndarray | None:
    """Return positions moved out of obstacles, or None if no component is inside one.

    An obstacle gives only its distance; components move along the gradient of the distance.
    """
    box, periodic = tuple(room.box.tolist()), tuple(room.periodic.tolist())
    result = None
    for obstacle, who, gap in room.gaps(positions, radii):
        over = np.nonzero(gap < 0)[0]
        inside = who[over]
        if not len(inside):
            continue
        if result is None:
            result = positions.copy()
        here, size = positions[inside], radii[inside]
        slope = np.empty_like(here)
        for axis in range(len(box)):
            step = np.zeros_like(here)
            step[:, axis] = 1e-4 * size
            ahead = obstacle.gap(here + step, size, box, periodic)
            behind = obstacle.gap(here - step, size, box, periodic)
            slope[:, axis] = (ahead - behind) / (2e-4 * size)
        result[inside] += slope * ((clearance - 1) * size - gap[over])[:, None]
    return result


@entry
def sweep(positions, pairs, contact, weight, edges, inverse, clearance, separation):
    """Move apart each of ``pairs`` (m, 2) that overlaps, one by one, in place; return how many did.

    The component with less ``weight`` moves more, to ``clearance`` contact distances. ``inverse`` is 0 along
    axes with walls; ``separation`` (d,) is room.
    """
    dimension = len(edges)
    overlaps = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        square = 0.0
        for axis in range(dimension):
            x = positions[j, axis] - positions[i, axis]
            x -= edges[axis] * np.rint(x * inverse[axis])
            separation[axis] = x
            square += x * x
        distance = np.sqrt(square)
        if distance < contact[k]:
            overlaps += 1
            if distance > 0.0:
                stretch = clearance * contact[k] / distance - 1.0
                share = stretch * weight[i] / (weight[i] + weight[j])
                for axis in range(dimension):
                    positions[j, axis] += share * separation[axis]
                    positions[i, axis] -= (stretch - share) * separation[axis]
    return overlaps
