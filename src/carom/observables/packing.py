"""Jammed packings: contacts, rattlers, and whether the backbone is isostatic.

At a reduced pressure p the gaps that carry it are about 1/p of a diameter, and others are much larger. In
between is a void of several decades; a pair is in contact if its gap is below that.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from carom.arithmetic import power
from carom.errors import InputError
from carom.frame import Frame
from carom.geometry import overlaps
from carom.geometry.contacts import Contacts
from carom.models.obstacles import Obstacle, checked, outwards, walls
from carom.scene.species import contact_matrix, labels
from carom.texts import counted
from carom.theory import ball_volume

#: Largest gap considered, over the contact distance: smaller than that of second neighbors in any dense
#: lattice (0.41 in fcc), larger than that of any contact.
REACH = 0.3

#: Least width of a void, as a factor, that separates contacts from near contacts. By chance, two successive
#: gaps among hundreds over some decades differ by a factor of 2 or 3.
DISTINCT = 10.0

#: Tolerance for a sum of directions to be zero: directions of contacts are known to about the relative gap.
BALANCED = 1e-6


@dataclass(frozen=True, eq=False)
class PackingNetwork:
    """The contacts of a packing, and its backbone: all particles that are not rattlers.

    Attributes
    ----------
    frame : Frame
        The packing.
    gap : float
        Pairs are in contact if their gap is below this fraction of the contact distance.
    void : (float, float)
        Largest gap of a contact, and smallest gap of a near pair without contact, at most ``REACH``.
    gaps : (p,) array
        Gap over contact distance of all near pairs, in increasing order; negative for pairs that overlap.
    bonds : (m, 2) int array
        Pairs in contact, i < j; i twice where a particle touches its own image; or a particle i and n + k,
        the number of a wall or an obstacle. The walls come first, axis after axis, lower before upper.
    vectors : (m, d) array
        Vector from i to the touching image of j, or to the wall or obstacle [length].
    backbone : (n,) bool array
        Which particles are not rattlers.
    sided : bool
        Whether a particle with contacts on one side only counts as a rattler.
    obstacles : tuple of obstacles
        Obstacles of the scene.
    """

    frame: Frame
    gap: float
    void: tuple[float, float]
    gaps: np.ndarray = field(repr=False)
    bonds: np.ndarray = field(repr=False)
    vectors: np.ndarray = field(repr=False)
    backbone: np.ndarray = field(repr=False)
    sided: bool = True
    obstacles: tuple[Obstacle, ...] = ()

    @property
    def rattlers(self) -> np.ndarray:
        """Indices of the particles that their neighbors do not hold in place."""
        return np.flatnonzero(~self.backbone)

    @property
    def rattler_fraction(self) -> float:
        """Fraction of the particles that are rattlers."""
        return 1.0 - float(self.backbone.mean())

    @property
    def held(self) -> np.ndarray:
        """Which contacts belong to the backbone, (m,) bool: those without a rattler."""
        fixed = np.ones(2 * self.frame.dimension + len(self.obstacles), dtype=bool)
        solid = np.append(self.backbone, fixed)
        return solid[self.bonds].all(axis=1)

    @property
    def contacts(self) -> int:
        """Contacts of the backbone, those with walls and obstacles included."""
        return int(self.held.sum())

    @property
    def coordination(self) -> float:
        """Mean number of contacts of a particle of the backbone; nan without a backbone."""
        ends = int((self.bonds[self.held] < self.frame.n).sum())
        solid = int(self.backbone.sum())
        return ends / solid if solid else math.nan

    @property
    def isostatic(self) -> int:
        """Number of contacts of an isostatic backbone.

        It is the number of degrees of freedom plus one for the state of stress. The degrees of freedom are
        ``d N_b`` minus one for each rigid motion of the whole. In a periodic box the sum is ``d (N_b - 1) +
        1`` (Donev, Torquato and Stillinger, Phys. Rev. E 71, 011105 (2005)). Along walls the whole can be
        shifted, and in a round container rotated. It is 0 without a backbone.
        """
        solid = int(self.backbone.sum())
        return self.frame.dimension * solid - self._together() + 1 if solid else 0

    def _together(self) -> int:
        """Return the number of rigid motions of the whole that no touched wall or obstacle opposes."""
        fixed = self.held & (self.bonds[:, 1] >= self.frame.n)
        x = self.frame.positions[self.bonds[fixed, 0]] / max(self.frame.box)
        normals = self.vectors[fixed] / np.linalg.norm(self.vectors[fixed], axis=1, keepdims=True)
        turning = [axis for axis, repeats in enumerate(self.frame.periodic) if not repeats]
        opposed = [*normals.T]
        for a, b in itertools.combinations(turning, 2):
            opposed.append(normals[:, b] * x[:, a] - normals[:, a] * x[:, b])
        rank = int(np.linalg.matrix_rank(np.stack(opposed, axis=1), tol=BALANCED)) if fixed.any() else 0
        return len(opposed) - rank

    @property
    def distinct(self) -> bool:
        """Whether contacts can be distinguished from near contacts, and hold a backbone."""
        return self.separated and self.contacts > 0

    @property
    def separated(self) -> bool:
        """Whether a void separates the gaps of contacts from all others.

        Notes
        -----
        Two conditions must hold. The void is at least a decade wide, and it begins where forces end. At a
        reduced pressure p a contact with force f has a gap of about 1 / (p f), with f in units of the mean
        force. Small forces are distributed as f^theta, theta > 0 (Charbonneau et al., Phys. Rev. Lett. 114,
        125504 (2015)). The weakest of m forces is therefore at least about 1 / m of the typical one, and no
        contact has a gap of more than m times the median of all, or 10 times where they are few.
        """
        m = int(np.searchsorted(self.gaps, self.gap))
        if m == 0:
            return False
        exact = overlaps.rounding(np.asarray(self.frame.box)) / float(self.frame.diameters.max())
        weakest = max(m, DISTINCT) * max(float(np.median(self.gaps[:m])), exact)
        return DISTINCT * max(self.void[0], 0.0) <= self.void[1] and self.void[0] <= weakest

    @property
    def counted(self) -> str:
        """The number of contacts in words, or of near pairs if contacts are not distinct."""
        if self.distinct:
            return f"{counted(self.contacts, 'contact')} in the backbone (isostatic: {self.isostatic})"
        return f"{self.contacts} pairs nearer than {self.gap:.1e}, contacts not distinct yet"

    @property
    def note(self) -> str:
        """Warning about the number of contacts; empty if contacts are distinct."""
        if self.distinct:
            return ""
        if self.separated:
            return (
                f"Pairs with a gap below {self.gap:.1e} are in contact, but nothing is held by them: without "
                "rattlers nobody remains. Compress more slowly and to a higher pressure."
            )
        return (
            "Contacts cannot be told from near contacts yet: no void separates their gaps, and "
            f"{self.contacts} is the number of pairs in the backbone with a gap below {self.gap:.1e}. "
            "Compress more slowly, at a tenth of the rate, and to Z = 1e10 at least; disks of one size, "
            "which crystallize, may need more."
        )

    @property
    def packing_fraction(self) -> float:
        """Fraction of the box that all spheres fill, rattlers included."""
        d = self.frame.dimension
        return ball_volume(d) * math.fsum(power(self.frame.diameters, d)) / math.prod(self.frame.box)

    def __str__(self) -> str:
        return (
            f"packing fraction {self.packing_fraction:.6f}, {counted(len(self.rattlers), 'rattler')} of "
            f"{self.frame.n} "
            f"({100 * self.rattler_fraction:.1f} %), {self.counted}, coordination "
            f"{self.coordination:.4f}; contact is a gap below "
            f"{self.gap:.1e}, in the void from {self.void[0]:.1e} to {self.void[1]:.1e}"
            + (f". {self.note}" if self.note else "")
        )


def network_of(frame: Frame, *, obstacles: Sequence[Obstacle] = ()) -> PackingNetwork:
    """Return the :func:`packing_network`; by the number of contacts alone if no backbone remains otherwise.

    None may, after fast compression or in crystalline grains, if contacts on one side make a rattler.
    """
    network = packing_network(frame, obstacles=obstacles)
    return network if network.backbone.any() else packing_network(frame, sided=False, obstacles=obstacles)


def packing_network(
    frame: Frame,
    *,
    gap: float | None = None,
    contact: ArrayLike | None = None,
    sided: bool = True,
    obstacles: Sequence[Obstacle] = (),
) -> PackingNetwork:
    """Return the contacts, rattlers and backbone of a packing.

    Parameters
    ----------
    frame : Frame
        The packing. Axes that are not periodic have walls, which hold it as well.
    gap : float, optional
        Pairs are in contact if their gap is below this fraction of the contact distance. By default it is the
        middle, in the logarithm, of the widest void in the distribution of gaps. At least half as many pairs
        as there are particles lie below that void, and at least d + 1, which a single one needs.
    contact : (K, K) array_like, optional
        Contact distances between species [length], where they are not the means of the diameters.
    sided : bool
        Whether a particle with contacts on one side only counts as a rattler. If False, only the number of
        contacts decides.
    obstacles : sequence of obstacles
        Obstacles of the scene, which hold the packing as well.

    Raises
    ------
    InputError
        If no pair is near contact, the gap is not between 0 and ``REACH``, or an obstacle is of another
        dimension.

    Notes
    -----
    A rattler has fewer than d + 1 contacts, or contacts on one side only. Then no combination of their
    directions with positive coefficients is zero, and it can be moved away from all of them. A particle held
    only by rattlers is a rattler, too: rattlers are removed until none is left.

    If spheres were compressed too fast for their forces to balance, contacts are missing at any pressure.
    Removing rattlers then removes all spheres. Compress more slowly, from a reduced pressure of some hundreds
    on; or, with ``sided=False``, count contacts only. Crystalline grains vanish in the same way, because a
    disk at the straight edge of a grain has its neighbors on one side.
    """
    # A file may have lost which axes have walls: any box of this dimension will do.
    obstacles = checked(obstacles, tuple(frame.box), (False,) * frame.dimension)
    pairs, vectors, gaps = _near(frame, contact, obstacles)
    if not len(gaps):
        raise InputError(
            f"No two components are nearer than {1 + REACH:g} contact distances; this is no packing."
        )
    order = np.argsort(gaps, kind="stable")
    pairs, vectors, gaps = pairs[order], vectors[order], gaps[order]
    if gap is None:
        smallest = overlaps.rounding(np.asarray(frame.box)) / float(frame.diameters.max())
        gap = _widest_void(gaps, smallest, max(frame.n // 2, frame.dimension + 1))
    elif not 0.0 < gap < REACH:
        raise InputError(f"gap is {gap!r}; expected a part of a diameter between 0 and {REACH:g}.")
    count = int(np.searchsorted(gaps, gap))
    void = (
        float(gaps[count - 1]) if count else 0.0,
        float(gaps[count]) if count < len(gaps) else REACH,
    )
    bonds, vectors = pairs[:count], vectors[:count]
    backbone = _backbone(frame, bonds, vectors, sided)
    return PackingNetwork(frame, float(gap), void, gaps, bonds, vectors, backbone, sided, tuple(obstacles))


def _near(
    frame: Frame, contact: ArrayLike | None, obstacles: Sequence[Obstacle]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return all pairs (p, 2) near contact, with all images, their vectors (p, d) and relative gaps (p,)."""
    from scipy.spatial import cKDTree

    species = labels(frame.species, frame.n)
    matrix = contact_matrix(contact, species, frame.diameters)
    contacts = Contacts(frame.diameters, species, matrix)
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    classes, room = contacts.classes, overlaps.geometry_of_frame(frame)
    positions, _ = room.images(frame.positions, 0.0)
    for a, b in itertools.combinations_with_replacement(range(len(classes)), 2):
        reach = (1.0 + REACH) * contacts.reach(a, b)
        places, who = room.images(frame.positions[classes[b]], reach)
        ours = cKDTree(positions[classes[a]])
        near = ours.sparse_distance_matrix(cKDTree(places), reach, output_type="ndarray")
        i, j = classes[a][near["i"]], classes[b][who[near["j"]]]
        vectors = places[near["j"]] - positions[i]
        kept = np.ones(len(i), dtype=bool)
        if a == b:  # every pair is found twice, and so is every image of a component itself
            kept = (i < j) | ((i == j) & _first_half(vectors))
        pairs = np.stack([i, j], axis=1)[kept]
        distance = contacts.of(pairs)
        found.append((pairs, vectors[kept], near["v"][kept] / distance - 1.0))
    radii = 0.5 * frame.diameters
    for k, fixed in enumerate((*walls(frame.box, frame.periodic), *obstacles)):
        gap = fixed.gap(frame.positions, radii, frame.box, frame.periodic)
        i = np.flatnonzero(gap < REACH * frame.diameters)
        pairs = np.stack([i, np.full_like(i, frame.n + k)], axis=1)
        away = outwards(fixed, frame.positions[i], frame.box, frame.periodic)
        found.append((pairs, -(gap + radii)[i, None] * away, (gap / frame.diameters)[i]))
    pairs, vectors, gaps = (np.concatenate(column) for column in zip(*found, strict=True))
    swapped = pairs[:, 0] > pairs[:, 1]
    pairs[swapped] = pairs[swapped][:, ::-1]
    vectors[swapped] *= -1.0
    kept = gaps < REACH
    return pairs[kept], vectors[kept], gaps[kept]


def _first_half(vectors: np.ndarray) -> np.ndarray:
    """Return which vectors (m, d) are not zero and have a positive first component that is not zero."""
    first = np.argmax(vectors != 0.0, axis=1)
    return np.asarray(np.take_along_axis(vectors, first[:, None], axis=1)[:, 0] > 0.0)


def _widest_void(gaps: np.ndarray, smallest: float, least: int) -> float:
    """Return the middle of the widest void in the logarithm of gaps that has ``least`` pairs below it.

    Gaps below ``smallest`` are equal. A run ends with a collision, and the gap of that pair alone is zero.
    """
    logarithms = np.log(np.append(np.maximum(gaps, smallest), REACH))
    first = min(least, len(gaps)) - 1
    widths = np.diff(logarithms)[first:]
    k = first + int(np.argmax(widths))
    return math.exp(0.5 * (logarithms[k] + logarithms[k + 1]))


def _backbone(frame: Frame, bonds: np.ndarray, vectors: np.ndarray, sided: bool) -> np.ndarray:
    """Return which particles (n,) remain when rattlers are removed until there is none."""
    n = frame.n
    touching: list[list[tuple[int, np.ndarray]]] = [[] for _ in range(n)]
    directions = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    for (i, j), direction in zip(bonds.tolist(), directions, strict=True):
        touching[i].append((j, direction))
        if j < n:
            touching[j].append((i, -direction))
    solid = np.ones(n, dtype=bool)
    waiting = set(range(n))
    while waiting:
        i = waiting.pop()
        held = [direction for j, direction in touching[i] if j >= n or solid[j]]
        few = len(held) < frame.dimension + 1
        if solid[i] and (few or (sided and not is_held(np.array(held)))):
            solid[i] = False
            waiting.update(j for j, _ in touching[i] if j < n and solid[j])
    return solid


def is_held(directions: np.ndarray) -> bool:
    """Return whether directions (m, d) of contacts span the space, and a positive combination is zero."""
    from scipy.optimize import nnls

    m, dimension = directions.shape
    if m < dimension + 1 or np.linalg.matrix_rank(directions, tol=BALANCED) < dimension:
        return False
    _, residual = nnls(directions.T, -directions.sum(axis=0), maxiter=100 * m)
    return bool(residual < BALANCED * m)
