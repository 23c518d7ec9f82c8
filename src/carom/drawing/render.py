"""Shaded spheres as an array of pixels, for pictures in 3D and for the frames of a movie.

Band by band, a depth buffer holds the nearest sphere of each pixel; then pixels are shaded, and faces and
lines drawn over them. Light, colors and haze are those of the viewer (``viewer/shaders.js``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from carom.bridges.embedding import embed, upright
from carom.configuration import Configuration
from carom.drawing.shapes import shapes_of
from carom.figures.palette import colors_of
from carom.models.interfaces.obstacle import Obstacle

FINE = 2
"""Pixels of the buffer per pixel of the picture, along each axis; they make edges smooth."""

BAND = 64 * FINE
"""Rows of the buffer that are drawn at once: what is computed on the way takes little memory then."""

GROUND = np.array([1.0, 1.0, 1.0], dtype=np.float32)
INK = np.array([0.2, 0.24, 0.29], dtype=np.float32)
CHALK = np.array([0.72, 0.75, 0.78], dtype=np.float32)  # on a dark ground
STONE = (0.66, 0.64, 0.6)
# Unit vectors towards the light, and half-way between light and eye, the normal of a highlight. They are
# Python floats, so that pixels stay float32.
LIGHT = (-0.4381, 0.6133, 0.6572)
HALF = (-0.2406, 0.3369, 0.9103)

NOBODY = -1

Spheres = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Centers (n, 3), radii (n,) and colors (n, 3) of spheres, as float32."""

Extents = tuple[np.ndarray, np.ndarray]
"""First column and row (n, 2) of each sphere in the buffer, and those after its last."""


@dataclass(frozen=True)
class Camera:
    """A parallel projection."""

    middle: np.ndarray  # the point at the middle of the picture, (3,) [length]
    axes: np.ndarray  # unit vectors to the right, up, and towards the eye, (3, 3)
    width: int  # [pixels]
    height: int  # [pixels]
    scale: float  # pixels per length
    depth: float  # half the depth of the visible space, over which haze thickens [length]

    @classmethod
    def on(cls, frame: Configuration, size: int, azimuth: float = 30.0, elevation: float = 20.0) -> Camera:
        """Return the camera that sees the whole box, in a picture whose longer edge has `size` pixels."""
        box = embed(frame.box[None])[0]
        margin = 0.5 * float(frame.diameters.max())
        if frame.dimension < 3:
            axes, reach = np.eye(3), 0.5 * box[:2] + margin
            reach[1] = max(reach[1], 2.0 * margin)
        else:
            a, e = math.radians(azimuth), math.radians(elevation)
            towards = np.array([math.cos(e) * math.sin(a), -math.cos(e) * math.cos(a), math.sin(e)])
            right = np.array([math.cos(a), math.sin(a), 0.0])
            axes = np.stack([right, np.cross(towards, right), towards])
            reach = (np.abs(axes) @ (0.5 * box))[:2] + margin
        reach = 1.03 * reach
        scale = 0.5 * size / float(reach.max())
        # Even numbers, which many video codecs need.
        width, height = (2 * math.ceil(edge * scale) for edge in reach)
        depth = float(np.abs(axes[2]) @ (0.5 * box)) + margin
        return cls(0.5 * box, axes, width, height, scale, depth)

    def seen(self, x: np.ndarray) -> np.ndarray:
        """Return places (..., 3) in pixels from the upper left, and depths towards the eye [pixels]."""
        turned = (x - self.middle) @ self.axes.T * self.scale
        turned[..., 0] += 0.5 * self.width
        turned[..., 1] = 0.5 * self.height - turned[..., 1]
        return turned


def rendered(
    frame: Configuration,
    camera: Camera,
    *,
    obstacles: Sequence[Obstacle] = (),
    colors: np.ndarray | None = None,
    ground: np.ndarray = GROUND,
) -> np.ndarray:
    """Return a picture of a frame, (height, width, 3) uint8; one and two dimensions are seen from above.

    Obstacles are drawn if they have an outline or a surface (:mod:`carom.drawing.shapes`). ``colors`` (n,
    3) are red, green and blue from 0 to 1; by default those of the species.
    """
    fine = replace(camera, width=FINE * camera.width, height=FINE * camera.height, scale=FINE * camera.scale)
    if colors is None:
        kinds = np.zeros(frame.n, dtype=np.int64) if frame.species is None else frame.species
        colors = np.array(colors_of(int(kinds.max()) + 1))[kinds]
    shapes = shapes_of(obstacles if frame.dimension > 1 else (), frame.box, frame.periodic)
    places = np.concatenate([embed(upright(frame)), shapes.spheres[:, :3]])
    radii = np.concatenate([0.5 * frame.diameters, shapes.spheres[:, 3]]) * fine.scale
    tints = np.concatenate([colors, np.tile(STONE, (len(shapes.spheres), 1))]).astype(np.float32)
    centers = fine.seen(places)
    flat = frame.dimension < 3
    order = np.argsort(centers[:, 2], kind="stable")
    if not flat:
        order = order[visible(centers[order, :2], radii[order])]
    # Near spheres come first, so that the pixels that they hide are rejected early.
    order = order[::-1]
    centers, radii, tints = centers[order], radii[order], tints[order]
    spheres = centers.astype(np.float32), radii.astype(np.float32), tints
    squares = (radii**2).astype(np.float32)
    extents = np.floor(centers[:, :2] - radii[:, None]), np.ceil(centers[:, :2] + radii[:, None]) + 1
    faces = [fine.seen(corners) for corners in shapes.triangles]
    ink = INK if ground.mean() > 0.5 else CHALK
    lines = [(fine.seen(ends), wide) for ends, wide in edges_of(frame)]
    lines += [(fine.seen(ends), 1) for ends in shapes.segments]
    picture = np.empty((camera.height, camera.width, 3), dtype=np.uint8)
    for top in range(0, fine.height, BAND):
        owner, depth = _nearest(spheres[0], squares, extents, fine, top)
        image = _shaded(owner, depth, top, spheres, fine, ground, flat=flat)
        for corners in faces:
            _face(image, depth, top, corners, opacity=0.9 if flat else 0.3)
        for ends, wide in lines:
            _line(image, depth, top, ends, wide, ink)
        picture[top // FINE : (top + BAND) // FINE] = _mean(image)
    return picture


def _mean(image: np.ndarray) -> np.ndarray:
    """Return the pixels (rows, columns, 3) uint8 of a band of the buffer."""
    parts = [image[row::FINE, column::FINE] for row in range(FINE) for column in range(FINE)]
    mean = parts[0].copy()
    for part in parts[1:]:
        mean += part
    mean *= np.float32(255.0 / FINE**2)
    mean += np.float32(0.5)
    return np.clip(mean, 0, 255, out=mean).astype(np.uint8)


def _nearest(
    centers: np.ndarray, squares: np.ndarray, extents: Extents, camera: Camera, top: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the nearest sphere at each pixel of a band, or NOBODY, and its depth, or -inf."""
    bottom = min(top + BAND, camera.height)
    owner = np.full((bottom - top, camera.width), NOBODY, dtype=np.int32)
    depth = np.full((bottom - top, camera.width), -np.inf, dtype=np.float32)
    columns = np.arange(camera.width, dtype=np.float32) + 0.5
    rows = np.arange(top, bottom, dtype=np.float32) + 0.5
    low, high = extents
    here = np.flatnonzero((high[:, 1] > top) & (low[:, 1] < bottom))
    firsts = np.maximum(low[here] - (0, top), 0).astype(np.int64).tolist()
    lasts = (high[here] - (0, top)).astype(np.int64).tolist()
    for k, (left, upper), (right, lower) in zip(here.tolist(), firsts, lasts, strict=True):
        x, y = columns[left:right], rows[upper:lower]
        if not len(x) or not len(y):
            continue
        before = depth[upper:lower, left:right]
        height = squares[k] - ((x - centers[k, 0]) ** 2 + ((y - centers[k, 1]) ** 2)[:, None])
        inside = height > 0.0
        near = centers[k, 2] + np.sqrt(np.maximum(height, 0.0))
        inside &= near > before
        np.copyto(before, near, where=inside)
        np.copyto(owner[upper:lower, left:right], k, where=inside)
    return owner, depth


def _shaded(
    owner: np.ndarray,
    depth: np.ndarray,
    top: int,
    spheres: Spheres,
    camera: Camera,
    ground: np.ndarray,
    *,
    flat: bool,
) -> np.ndarray:
    """Return a band (rows, columns, 3) of lit spheres, from the row ``top`` on; far ones are in haze.

    If all points of a pixel belong to one sphere, they get the color of their middle.
    """
    image = np.empty((*owner.shape, 3), dtype=np.float32)
    image[:] = ground
    haze = float(2.0 * camera.depth * camera.scale)

    def lit(rows: np.ndarray, columns: np.ndarray, who: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Return the colors (m, 3) of points of the spheres ``who`` at the depths ``near``."""
        centers, radii, tints = (each[who] for each in spheres)
        x, y = (columns - centers[:, 0]) / radii, (centers[:, 1] - rows) / radii  # [radii]
        if flat:
            return _inked(x, y, radii, tints)
        shade = _lit(x, y, tints)
        far = np.clip(0.5 - near / haze, 0.0, 1.0)
        return shade + (0.62 * far * far)[:, None] * (ground - shade)

    parts = [owner[row::FINE, column::FINE] for row in range(FINE) for column in range(FINE)]
    whole = parts[0] != NOBODY
    for part in parts[1:]:
        whole &= part == parts[0]
    rows, columns = np.nonzero(whole)
    middle = np.float32(0.5 * FINE)
    near = depth[::FINE, ::FINE][rows, columns]
    color = lit(FINE * rows.astype(np.float32) + (top + middle), FINE * columns.astype(np.float32) + middle,
                 parts[0][rows, columns], near)  # fmt: skip
    for row in range(FINE):
        for column in range(FINE):
            image[row::FINE, column::FINE][rows, columns] = color
    rest = (owner != NOBODY) & ~whole.repeat(FINE, axis=0).repeat(FINE, axis=1)
    rows, columns = np.nonzero(rest)
    half = np.float32(0.5)
    image[rows, columns] = lit(
        rows.astype(np.float32) + (top + half), columns.astype(np.float32) + half, owner[rows, columns],
        depth[rows, columns],
    )  # fmt: skip
    return image


def _inked(x: np.ndarray, y: np.ndarray, size: np.ndarray, tints: np.ndarray) -> np.ndarray:
    """Return the colors (m, 3) of points on disks with a rim, whose radius is the ``size`` [pixels]."""
    rim = np.clip(2.0 - (1.0 - np.sqrt(x * x + y * y)) * size / FINE, 0.0, 1.0) * (size > 3 * FINE)
    light = 1.06 - 0.13 * ((x + 0.3) ** 2 + (y - 0.35) ** 2)
    return tints * (light * (1.0 - 0.55 * rim))[:, None]


def _lit(x: np.ndarray, y: np.ndarray, tints: np.ndarray) -> np.ndarray:
    """Return the colors (m, 3) of points on spheres, without haze."""
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    diffuse = np.maximum(LIGHT[0] * x + LIGHT[1] * y + LIGHT[2] * z, 0.0)
    shine = np.maximum(HALF[0] * x + HALF[1] * y + HALF[2] * z, 0.0)
    for _ in range(6):  # to the power 64
        shine *= shine
    bright = (0.42 + 0.12 * y + 0.58 * diffuse) * (1.0 - 0.35 * (1.0 - z) ** 3)
    return tints * bright[:, None] + (0.3 * shine)[:, None]


def edges_of(frame: Configuration) -> list[tuple[np.ndarray, int]]:
    """Return the edges of the box (2, 3) and their widths [pixels]; walls are wide."""
    box = embed(frame.box[None])[0]
    corners = [tuple((k >> axis) & 1 for axis in range(3)) for k in range(4 if frame.dimension < 3 else 8)]
    result = []
    for i, a in enumerate(corners):
        for b in corners[:i]:
            differ = [axis for axis in range(3) if a[axis] != b[axis]]
            if len(differ) == 1:
                across = [axis for axis in range(frame.dimension) if axis != differ[0]]
                walled = any(not frame.periodic[axis] for axis in across)
                result.append((np.array([a, b]) * box, 3 if walled else 1))
    return result


def _line(
    image: np.ndarray, depth: np.ndarray, top: int, ends: np.ndarray, wide: int, ink: np.ndarray
) -> None:
    """Draw a line (2, 3) of the width ``wide`` [pixels of the picture] in a band, where nothing hides it."""
    reach = range(-(wide * FINE) // 2 + 1, (wide * FINE) // 2 + 1)
    first, last = sorted(ends[:, 1].tolist())
    if last + reach[-1] < top or first + reach[0] >= top + len(image):
        return
    count = int(np.abs(ends[1] - ends[0])[:2].max()) + 2
    points = ends[0] + np.linspace(0.0, 1.0, count)[:, None] * (ends[1] - ends[0])
    columns, rows = (np.floor(points[:, axis]).astype(np.int64) for axis in (0, 1))
    for right in reach:
        for down in reach:
            x, y = columns + right, rows + (down - top)
            kept = (x >= 0) & (x < image.shape[1]) & (y >= 0) & (y < image.shape[0])
            x, y, z = x[kept], y[kept], points[kept, 2]
            free = z >= depth[y, x] - (1.0 if np.isfinite(z).all() else 0.0)
            image[y[free], x[free]] = ink


def _face(image: np.ndarray, depth: np.ndarray, top: int, corners: np.ndarray, opacity: float) -> None:
    """Draw a translucent triangle (3, 3) in a band, where nothing hides it."""
    low, high = np.floor(corners[:, :2].min(axis=0)), np.ceil(corners[:, :2].max(axis=0)) + 1.0
    left, first = max(int(low[0]), 0), max(int(low[1]), top)
    right, last = min(int(high[0]), image.shape[1]), min(int(high[1]), top + len(image))
    if left >= right or first >= last:
        return
    part, near = image[first - top : last - top, left:right], depth[first - top : last - top, left:right]
    rows, columns = np.mgrid[first:last, left:right] + 0.5
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    if area == 0.0:  # seen from its edge
        return
    b = ((columns - ax) * (cy - ay) - (cx - ax) * (rows - ay)) / area
    c = ((bx - ax) * (rows - ay) - (columns - ax) * (by - ay)) / area
    inside = (b >= 0.0) & (c >= 0.0) & (b + c <= 1.0)
    inside &= az + b * (bz - az) + c * (cz - az) >= near
    part[inside] += np.float32(opacity) * (np.array(STONE, dtype=np.float32) - part[inside])


PER_RADIUS = 6.0
"""Grid points per radius. In a picture of 10^5 spheres, parts between the points are smaller than a pixel."""

MOST_POINTS = 2e7
"""Largest number of points in all discs together, for some half a second; beyond it, the grid is coarser."""

FEW = 5000
"""Number of discs up to which all are drawn, which takes little time."""


def visible(centers: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return which discs (n,), the last on top, show on a fine grid, or are too small for its points."""
    n = len(radii)
    if n <= FEW:
        return np.ones(n, dtype=bool)
    side = max(
        float(np.median(radii)) / PER_RADIUS, math.sqrt(math.pi * float(np.sum(radii**2)) / MOST_POINTS)
    )
    x = (centers - (centers - radii[:, None]).min(axis=0)) / side
    near = np.rint(x).astype(np.int64)
    # Offset of the center from the nearest point, and radius, in units of the grid.
    off, r = near - x, radii / side
    margin = int(r.max()) + 2
    row = int(near[:, 1].max()) + 2 * margin
    place = (near[:, 0] + margin) * row + near[:, 1] + margin
    last = np.full((int(near[:, 0].max()) + 2 * margin) * row, -1, dtype=np.int64)
    # Discs of about one size together, as each size covers another range of grid steps.
    sizes = np.ceil(np.log2(r) * 2.0)
    for size in np.unique(sizes):
        members = np.flatnonzero(sizes == size)
        reach = int(r[members].max() + 1.0)
        for i in range(-reach, reach + 1):
            across = r[members] ** 2 - (off[members, 0] + i) ** 2
            for j in range(-reach, reach + 1):
                if max(abs(i) - 0.5, 0.0) ** 2 + max(abs(j) - 0.5, 0.0) ** 2 > reach**2:
                    continue
                inside = members[(off[members, 1] + j) ** 2 <= across]
                np.maximum.at(last, place[inside] + (i * row + j), inside)
    seen = r < 1.0
    seen[last[last >= 0]] = True
    return seen
