"""Overlaps of spheres with each other and with obstacles: the check of every initial state, and of frames.

Two overlap if and only if their *nearest* images do; none meets its own, as edge > diameter. The k-d trees
and cells are the scene's own: no fault of the engine's search is shared.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from carom.cells import wrapped
from carom.geometry.contacts import Contacts
from carom.geometry.nearby import near_pairs
from carom.models.obstacles import Obstacle, Wall, checked, named_walls
from carom.models.obstacles.cells import CROWD_FROM, together
from carom.models.obstacles.faces import standing_walls
from carom.models.obstacles.planes import Plane
from carom.models.obstacles.with_properties import Dressed

#: Overlap, relative to the contact distance, that the engine's own rounding may leave in a frame it writes.
ENGINE_OVERLAP = 1e-12

EPSILON = float(np.finfo(np.float64).eps)

FEW = 400  # components up to which checking every pair is faster than loading SciPy

MANY = 20_000
"""Components from which compiled code lists pairs. For fewer, loading it takes longer than a k-d tree."""

#: Further overlap, in units of :func:`rounding`, that flights through the box may leave (see tolerance).
FLIGHTS = 16


class Overlap(NamedTuple):
    """Two spheres that overlap, or one that is inside a wall or an obstacle."""

    i: int
    other: int | str  # sphere j > i, or the name of the wall or obstacle
    distance: float  # to the nearest image's center, or the obstacle [length]
    contact: float  # distance at which they would touch [length]

    @property
    def depth(self) -> float:
        """How far they overlap [length]."""
        return self.contact - self.distance

    @property
    def relative(self) -> float:
        """How far they overlap, over the contact distance of two, or over the diameter; at most 1."""
        whole = 2.0 * self.contact if isinstance(self.other, str) else self.contact
        return self.depth / max(whole, self.depth)

    def __str__(self) -> str:
        # Enough digits to show the depth with three of them.
        part = self.depth / max(self.contact, abs(self.distance))
        digits = min(17, max(4, 3 - math.floor(math.log10(part))))
        pair = f"spheres {self.i} and {self.other} overlap"
        alone = f"sphere {self.i} is inside an obstacle, {self.other},"
        return (
            f"{alone if isinstance(self.other, str) else pair} by {self.depth:.3g} "
            f"(distance {self.distance:#.{digits}g}, contact {self.contact:#.{digits}g})"
        )


@dataclass(frozen=True, eq=False)
class Geometry:
    """Where the components are: a box, which of its axes are periodic, and the obstacles in it."""

    box: np.ndarray  # (d,), edges [length]
    periodic: np.ndarray  # (d,) bool
    obstacles: Sequence[Obstacle] = ()  # without the walls of the box
    tilt: float = 0.0  # in edges: shift along axis 0 of the image up axis 1 (Shear)

    def __post_init__(self) -> None:
        """Take the tilt less whole edges, at most half of their ratio: the lattice is the same."""
        if self.tilt:
            ratio = float(self.box[0] / self.box[1])
            less = ratio * round(self.tilt / ratio) if self.periodic[0] else 0.0
            object.__setattr__(self, "tilt", self.tilt - less if self.periodic[1] else 0.0)

    @property
    def half(self) -> float:
        """Half of the shortest periodic edge [length]: nearer than that, a pair has one image."""
        return 0.5 * float(self.box[self.periodic].min(initial=math.inf))

    def wrapped(self, positions: np.ndarray) -> np.ndarray:
        """Return positions (n, d) moved into ``0 <= x < edge`` along periodic axes, or the tilted cell."""
        inside = self.along(positions)
        if self.periodic.all():
            inside = wrapped(inside, self.box)
        else:
            inside = inside.copy()
            inside[:, self.periodic] = wrapped(inside[:, self.periodic], self.box[self.periodic])
        return self._tilted(inside, 1.0) if self.tilt else inside

    def _tilted(self, positions: np.ndarray, sign: float) -> np.ndarray:
        """Return positions along the axes of the lattice as those in space, or with ``sign = -1`` back."""
        found = positions.copy()
        found[:, 0] += sign * self.tilt * positions[:, 1]
        return found

    def along(self, positions: np.ndarray) -> np.ndarray:
        """Return positions as coordinates along the axes of the lattice."""
        return self._tilted(positions, -1.0) if self.tilt else positions

    def _straight(self, places: np.ndarray) -> tuple[Geometry, np.ndarray, float]:
        """Return the room with right angles, the places in it, and the norm of the map to it."""
        longer = 0.5 * (abs(self.tilt) + math.hypot(self.tilt, 2.0))
        straight = Geometry(self.box, self.periodic)
        return straight, straight.wrapped(self.along(places)), longer

    def separations(self, positions: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """Return the vectors (m, d) from i to the nearest image of j, for ``pairs`` (m, 2).

        In a tilted box one that is farther than the shortest edge may not be the nearest.
        """
        i, j = pairs.T
        result, up = np.empty((len(pairs), len(self.box))), np.zeros(1)
        # One axis at a time takes half as long as all axes at once, which gathers rows of few numbers.
        for axis, (edge, periodic) in reversed([*enumerate(zip(self.box, self.periodic, strict=True))]):
            place = np.ascontiguousarray(positions[:, axis])
            separation = place[j] - place[i]
            if axis == 0 and self.tilt:  # an image up axis 1 is shifted along axis 0
                separation -= self.tilt * up
            if periodic:
                up = edge * np.rint(separation / edge)
                separation -= up
            result[:, axis] = separation
        if self.tilt and self.periodic[0]:
            # From half an edge on, the image on the other side along axis 1 may be nearer.
            far = np.flatnonzero(np.einsum("ij,ij->i", result, result) > self.half**2)
            other = result[far]
            steps = np.copysign(self.box[1], other[:, 1])
            other[:, 1] -= steps
            other[:, 0] -= self.tilt * steps
            other[:, 0] -= self.box[0] * np.rint(other[:, 0] / self.box[0])
            nearer = np.sum(other**2, axis=1) < np.sum(result[far] ** 2, axis=1)
            result[far[nearer]] = other[nearer]
        return result

    def images(self, places: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return places (n, d) in the box, then their images up to ``reach`` beyond it, and whose they are.

        A tilted box is that with right angles, whose images up axis 1 are shifted (Lees and Edwards).
        """
        points = Geometry(self.box, self.periodic).wrapped(self.wrapped(places) if self.tilt else places)
        who = np.arange(len(points))
        # Axis 0 comes last, because images up axis 1 are shifted along it.
        for axis in reversed(np.flatnonzero(self.periodic).tolist()):
            edge = float(self.box[axis])
            most = math.ceil(reach / edge)
            parts, owners = [points], [who]
            for turn in (k for k in range(-most, most + 1) if k):
                there = points[:, axis] + turn * edge
                near = (there >= -reach) & (there <= edge + reach)
                image = points[near]
                image[:, axis] = there[near]
                if axis == 1 and self.tilt:
                    image[:, 0] += turn * self.tilt * edge
                    image[:, :1] = Geometry(self.box[:1], self.periodic[:1]).wrapped(image[:, :1])
                parts.append(image)
                owners.append(who[near])
            points, who = np.concatenate(parts), np.concatenate(owners)
        return points, who

    def distances(self, positions: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """Return the distances (m,) of the nearest images of ``pairs`` (m, 2)."""
        separation = self.separations(positions, pairs)
        return np.sqrt(np.einsum("ij,ij->i", separation, separation))

    def pairs(
        self, positions: np.ndarray, contacts: Contacts, factor: float = 1.0, skin: float = 0.0
    ) -> np.ndarray:
        """Return pairs (m, 2), in either order, which include all that are near contact.

        For contact s and class sizes a and b they are nearer than ``factor * s + skin * (a + b) / 2``.
        """
        # Wrapped again, because a change of unit can round a coordinate up to the edge.
        places = self.wrapped(positions)
        classes = contacts.classes
        if len(classes) == 1:
            return self.near(places, factor * contacts.reach(0, 0) + skin * contacts.size(0))
        found = []
        for a in range(len(classes)):
            for b in range(a, len(classes)):
                size = 0.5 * (contacts.size(a) + contacts.size(b))
                within = factor * contacts.reach(a, b) + skin * size
                if a == b:
                    found.append(classes[a][self.near(places[classes[a]], within)])
                else:
                    i, j = self.between(places[classes[a]], places[classes[b]], within).T
                    found.append(np.stack([classes[a][i], classes[b][j]], axis=1))
        return np.concatenate(found)

    def between(self, ours: np.ndarray, theirs: np.ndarray, within: float) -> np.ndarray:
        """Return the pairs (m, 2) of one of our places and one of theirs that are nearer than ``within``."""
        if self.tilt:
            straight, one, longer = self._straight(ours)
            near = straight.between(one, self._straight(theirs)[1], longer * within)
            both = np.concatenate([ours, theirs])
            return near[self.distances(both, near + np.array([0, len(ours)])) <= within]
        if len(ours) + len(theirs) >= MANY:
            pairs = near_pairs(self.box, self.periodic, ours, theirs, within)
            if pairs is not None:
                return pairs
        from scipy.spatial import cKDTree

        period = np.where(self.periodic, self.box, 0.0)
        trees = [cKDTree(places, boxsize=period) for places in (ours, theirs)]
        near = trees[0].sparse_distance_matrix(trees[1], within, output_type="ndarray")
        return np.stack([near["i"], near["j"]], axis=1)

    def near(self, places: np.ndarray, within: float) -> np.ndarray:
        """Return the pairs (m, 2) of places (n, d), inside the box, that are nearer than ``within``."""
        if self.tilt:
            straight, along, longer = self._straight(places)
            near = straight.near(along, longer * within)
            return near[self.distances(places, near) <= within]
        if len(places) >= MANY:
            pairs = near_pairs(self.box, self.periodic, places, None, within)
            if pairs is not None:
                return pairs
        from scipy.spatial import cKDTree

        if not 4.0 * within < self.box.min():
            period = np.where(self.periodic, self.box, 0.0)
            return cKDTree(places, boxsize=period).query_pairs(within, output_type="ndarray")
        # A tree without periods, of the places and their images, takes half the time of a periodic tree.
        points, names = self._with_images(places, within)
        pairs = cKDTree(points, balanced_tree=False).query_pairs(within, output_type="ndarray")
        return names[pairs[pairs[:, 0] < len(places)]]

    def _with_images(self, places: np.ndarray, within: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the places followed by their images near the box, and the component of each.

        Images move forward along the last axis of their move, so that one of the two of a pair is listed.
        """
        points, names = [places], [np.arange(len(places))]
        for axis in np.flatnonzero(self.periodic):
            near = np.flatnonzero(places[:, axis] < within)
            images = places[near]
            images[:, axis] += self.box[axis]
            for other in np.flatnonzero(self.periodic[:axis]):
                edge = self.box[other]
                low, high = images[:, other] < within, images[:, other] > edge - within
                step = edge * np.eye(len(self.box))[other]
                images = np.concatenate([images, images[low] + step, images[high] - step])
                near = np.concatenate([near, near[low], near[high]])
            points.append(images)
            names.append(near)
        return np.concatenate(points), np.concatenate(names)

    def everything(self) -> tuple[Obstacle, ...]:
        """Return the walls for which no obstacle stands, then the obstacles."""
        return (*self._walls, *self.obstacles)

    @cached_property
    def _walls(self) -> list[Plane]:
        return standing_walls(self.obstacles, self.box.tolist(), self.periodic.tolist())

    @cached_property
    def _crowds(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Numbers in ``everything`` of many obstacles of one kind, centers and radii of balls around each."""
        kinds: dict[type, list[int]] = {}
        before = len(self._walls)
        for k, obstacle in enumerate(self.obstacles):
            kinds.setdefault(type(obstacle), []).append(k)
        found = []
        for numbers in kinds.values():
            if len(numbers) < CROWD_FROM or hasattr(self.obstacles[numbers[0]], "live"):
                continue
            crowd = together([self.obstacles[k].model() for k in numbers])
            if crowd is not None:
                low, high = crowd.extent()
                balls = 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1)
                found.append((np.array(numbers) + before, *balls))
        return found

    def near_obstacles(self, positions: np.ndarray, radii: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """Yield the number of each wall and obstacle, and who may touch it: all, or of many those near."""
        asked = dict.fromkeys(range(len(self.everything())), np.arange(len(positions)))
        for numbers, centers, reaches in self._crowds:
            from scipy.spatial import cKDTree

            tree = cKDTree(self.wrapped(positions), boxsize=np.where(self.periodic, self.box, 0.0))
            near = tree.query_ball_point(centers, reaches + radii.max(initial=0.0) + rounding(self.box))
            asked |= zip(numbers.tolist(), (np.array(who, np.int64) for who in near), strict=True)
        yield from ((k, who) for k, who in asked.items() if len(who))

    def gaps(
        self, positions: np.ndarray, radii: np.ndarray, time: float | Fraction = 0
    ) -> Iterator[tuple[Obstacle, np.ndarray, np.ndarray]]:
        """Yield walls and obstacles, who may touch each, and their distances at a time, negative inside."""
        room = tuple(self.box.tolist()), tuple(self.periodic.tolist())
        everything = self.everything()
        for k, who in self.near_obstacles(positions, radii):
            moment = (time,) if isinstance(everything[k], Dressed) else ()
            yield everything[k], who, everything[k].gap(positions[who], radii[who], *room, *moment)


def geometry_of(
    edges: Sequence[float], sides: Mapping[str, Wall], obstacles: Sequence[Obstacle], tilt: float = 0.0
) -> Geometry:
    """Return the room that a box with walls by name and with obstacles is, checked."""
    repeats = named_walls.periodic_axes(sides, len(edges))
    standing = checked(obstacles, edges, repeats, named_walls.standing(sides, edges))
    return Geometry(np.asarray(edges), np.asarray(repeats), standing, tilt)


def geometry_of_frame(frame: Any) -> Geometry:
    """Return where the components of a frame are, without obstacles."""
    return Geometry(np.asarray(frame.box), np.asarray(frame.periodic), (), frame.tilt or 0.0)


def rounding(box: np.ndarray, epsilon: float = EPSILON) -> float:
    """Overlap [length] that rounded coordinates can produce between spheres in exact contact.

    A coordinate is below the edge L_k: four roundings by epsilon L_k / 2 (product and sum of a lattice
    position, wrapping, a change of unit) move it by 2 epsilon L_k, a difference by 4 epsilon L_k, and a
    distance by at most 4 epsilon |L|.
    """
    return 4 * epsilon * math.hypot(*map(float, box))


def tolerance(box: np.ndarray, contact: Any = 1.0, epsilon: float = EPSILON) -> Any:
    """Overlap [length] that is accepted: what engine and rounding may leave, relative to lengths.

    Before its clock is reset, a component flies up to four box lengths, at twice the usual speed eight. Such
    numbers are rounded in the product of speed and time, its sum with the start, and the time of contact: 16
    times :func:`rounding` for two spheres.
    """
    return ENGINE_OVERLAP * contact + FLIGHTS * rounding(box, epsilon)


def deepest(
    positions: np.ndarray,
    room: Geometry,
    contacts: Contacts,
    pinned: np.ndarray | None = None,
    epsilon: float = EPSILON,
) -> Overlap | None:
    """Return the overlap beyond :func:`tolerance` deepest for its contact, or None; not two ``pinned``."""
    if pinned is not None:
        return _deepest_of(positions, room, contacts, pinned, epsilon)
    if len(positions) <= FEW:
        pairs = np.stack(np.triu_indices(len(positions), 1), axis=1)
    else:
        pairs = _crowded(positions, contacts)
        pairs = pairs if len(pairs) else room.pairs(positions, contacts)
    return worst(positions, room, pairs, contacts.of(pairs), epsilon)


def _crowded(positions: np.ndarray, contacts: Contacts) -> np.ndarray:
    """Return pairs (m, 2) of spheres that share a cell, and thus overlap.

    They are found first: a crowd of m spheres has m^2 / 2 overlapping pairs, too many to list.
    """
    crowds = [
        members[_sharing_a_cell(positions[members], float(contacts.diameters[members].min()))]
        for members in contacts.classes
    ]
    return np.concatenate(crowds)


def _deepest_of(
    positions: np.ndarray, room: Geometry, contacts: Contacts, pinned: np.ndarray, epsilon: float
) -> Overlap | None:
    """Return the deepest overlap in which at least one is not pinned, or any one of very many."""
    free, fixed = np.flatnonzero(~pinned), np.flatnonzero(pinned)
    diameters = contacts.diameters
    found = deepest(positions[free], room, Contacts(diameters[free]), epsilon=epsilon)
    if found is not None:
        found = found._replace(i=int(free[found.i]), other=int(free[int(found.other)]))
        if len(free) > FEW and len(_crowded(positions[free], Contacts(diameters[free]))):
            return found
    reach = 0.5 * (float(diameters[free].max()) + float(diameters[fixed].max()))
    i, j = room.between(positions[free], positions[fixed], reach).T
    pairs = np.stack([free[i], fixed[j]], axis=1)
    both = found, worst(positions, room, pairs, contacts.of(pairs), epsilon)
    return max((each for each in both if each is not None), key=lambda each: each.relative, default=None)


def worst(
    positions: np.ndarray, room: Geometry, pairs: np.ndarray, contact: np.ndarray, epsilon: float = EPSILON
) -> Overlap | None:
    """Return the deepest overlap of some pairs (m, 2) with distances (m,) of contact, or None."""
    distances = room.distances(positions, pairs)
    over = distances < contact - tolerance(room.box, contact, epsilon)
    if not over.any():
        return None
    k = int(np.argmin(np.divide(distances, contact, out=np.full(len(over), np.inf), where=over)))
    i, j = sorted(map(int, pairs[k]))
    return Overlap(i, j, float(distances[k]), float(contact[k]))


def closest(positions: np.ndarray, room: Geometry, contacts: Contacts) -> float:
    """Return the least distance of two spheres over that at which they touch."""
    skin, pairs = 0.01, np.empty((0, 2), np.int64)
    if len(positions) <= FEW:
        pairs = np.stack(np.triu_indices(len(positions), 1), axis=1)
    while not len(pairs):
        skin *= 4.0
        pairs = room.pairs(positions, contacts, 1.0 + skin)
    return float((room.distances(positions, pairs) / contacts.of(pairs)).min())


def intruder(
    positions: np.ndarray,
    room: Geometry,
    radii: np.ndarray,
    time: float | Fraction = 0,
    epsilon: float = EPSILON,
    unknown: Container[int] = (),
) -> Overlap | None:
    """Return the component deepest inside a wall or obstacle beyond :func:`tolerance`, or None.

    Obstacles are where they are at a time since the start, but for those whose id is ``unknown``.
    """
    found = []
    for obstacle, who, gap in room.gaps(positions, radii, time):
        if id(obstacle) in unknown:
            continue
        sizes = radii[who]
        over = np.flatnonzero(gap < -tolerance(room.box, 2.0 * sizes, epsilon))
        if len(over):
            deep = -gap[over]
            k = int(over[np.argmax(deep / np.maximum(2.0 * sizes[over], deep))])
            found.append(Overlap(int(who[k]), obstacle.name, float(gap[k] + sizes[k]), float(sizes[k])))
    return max(found, key=lambda overlap: overlap.relative, default=None)


def _sharing_a_cell(positions: np.ndarray, contact: float) -> np.ndarray:
    """Return pairs (m, 2) in the same cell, whose diagonal is (1 - 2^-20) contact: they surely overlap."""
    # The division comes first: where the unit is far from 1, the inverse of a length would be rounded too.
    cells = np.floor(positions / contact * (math.sqrt(positions.shape[1]) / (1.0 - 2.0**-20)))
    cells -= cells.min(axis=0)
    along = cells.max(axis=0) + 1.0
    if math.prod(along.tolist()) < 2.0**53:  # one number for each cell is sorted faster, in the same order
        order = np.argsort(cells @ np.cumprod([1.0, *along[:-1]]), kind="stable")
    else:
        order = np.lexsort(cells.T)
    cells = cells[order]
    shared = np.nonzero((cells[1:] == cells[:-1]).all(axis=1))[0]
    return np.stack([order[shared], order[shared + 1]], axis=1)
