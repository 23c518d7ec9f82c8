"""How particles are drawn, to scale, one function for each kind of space."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.frame import Frame

FACE = "#6f9bc8"
EDGE = "#1f3b57"
PALE_FACE = "#dbe6f1"
PALE_EDGE = "#9fb3c7"
BORDER = "#333333"

# Where the camera of the 3D picture stands: right of the box, above it.
AZIMUTH = math.radians(30.0)
ELEVATION = math.radians(20.0)


def draw_rods(axes: Axes, frame: Frame) -> None:
    """1D: rods on a line; one that crosses the border is drawn at both ends."""
    from matplotlib.collections import PolyCollection

    length = frame.box[0]
    x = np.concatenate([frame.positions[:, 0] + shift for shift in (-length, 0.0, length)])
    half = 0.5 * np.tile(frame.diameters, 3)
    kept = (x + half > 0.0) & (x - half < length)
    x, half = x[kept], half[kept]
    corners = np.stack([[x - half, x - half, x + half, x + half], np.outer([-1, 1, 1, -1], 0.5 + 0 * x)])
    rods = list(np.moveaxis(corners, (0, 1), (2, 1)))
    axes.add_collection(PolyCollection(rods, facecolor=FACE, edgecolor=EDGE, linewidth=0.6))
    axes.set_xlim(0.0, length)
    axes.set_ylim(-1.0, 1.0)
    axes.set_yticks([])
    axes.spines[["left"]].set_visible(False)
    axes.set_xlabel("x")


def draw_disks(axes: Axes, frame: Frame) -> None:
    """2D: disks in the box, and pale the periodic copies of those that cross its border."""
    centres, owners, copies = _with_copies(frame.positions, frame.diameters, frame.box)
    radii = 0.5 * frame.diameters[owners]
    _circles(axes, centres[copies], radii[copies], PALE_FACE, PALE_EDGE)
    _circles(axes, centres[~copies], radii[~copies], FACE, EDGE)
    _box_and_axes(axes, frame.box, float(frame.diameters.max()))


def draw_projection(axes: Axes, frame: Frame) -> None:
    """Beyond 3D: the first two coordinates of every particle, as translucent disks."""
    order = np.argsort(frame.positions[:, 2])
    circles = (frame.positions[order, :2], 0.5 * frame.diameters[order])
    _circles(axes, *circles, FACE, EDGE, alpha=max(0.08, min(0.5, 60.0 / frame.n)))
    _box_and_axes(axes, frame.box[:2], float(frame.diameters.max()))


def draw_spheres(axes: Axes, frame: Frame) -> None:
    """3D: shaded spheres in parallel projection, the far ones first and hazier, in the edges of the box."""
    from matplotlib.collections import LineCollection

    right, up, towards = _camera()
    centre = 0.5 * np.asarray(frame.box)
    x = frame.positions - centre
    depth = x @ towards
    order = np.argsort(depth)
    flat = np.stack([x @ right, x @ up], axis=1)[order]
    radii = 0.5 * frame.diameters[order]
    corners = np.array(list(itertools.product((-1, 1), repeat=3))) * centre
    # The corner farthest from the camera: its three edges lie behind the spheres, all others before them.
    far = int(np.argmin(corners @ towards))
    pairs = [(a, b) for a in range(8) for b in range(a) if np.count_nonzero(corners[a] != corners[b]) == 1]
    plane = np.stack([corners @ right, corners @ up], axis=1)
    for behind in (True, False):
        lines = [plane[[a, b]] for a, b in pairs if (far in (a, b)) is behind]
        order_in_picture = 1 if behind else 4
        axes.add_collection(LineCollection(lines, color=BORDER, linewidth=0.9, zorder=order_in_picture))
    haze = (depth[order] - depth.min()) / (np.ptp(depth) or 1.0)
    _shaded(axes, flat, radii, haze)
    reach = np.abs(plane).max(axis=0) + float(frame.diameters.max())
    axes.set_xlim(-reach[0], reach[0])
    axes.set_ylim(-reach[1], reach[1])
    axes.set_aspect("equal")
    axes.set_axis_off()


def _camera() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors to the right, up, and towards the eye."""
    towards = np.array(
        [
            math.cos(ELEVATION) * math.sin(AZIMUTH),
            -math.cos(ELEVATION) * math.cos(AZIMUTH),
            math.sin(ELEVATION),
        ]
    )
    right = np.array([math.cos(AZIMUTH), math.sin(AZIMUTH), 0.0])
    return right, np.cross(towards, right), towards


def _shaded(axes: Axes, centres: np.ndarray, radii: np.ndarray, nearness: np.ndarray) -> None:
    """Spheres as stacks of discs that brighten towards a light at the upper left; far ones fade to white."""
    from matplotlib.collections import PatchCollection
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Circle

    dark, light = np.array(to_rgb(EDGE)), np.array(to_rgb("#e9f2fb"))
    body = np.array(to_rgb(FACE))
    # Outline, body, and three highlights: (radius, shift towards the light, colour).
    layers = [(1.0, 0.0, dark), (0.94, 0.02, 0.72 * body + 0.28 * dark), (0.80, 0.11, body)]
    layers += [(0.55, 0.22, 0.6 * body + 0.4 * light), (0.25, 0.33, light)]
    patches, colours = [], []
    for centre, radius, near in zip(centres, radii, nearness, strict=True):
        fade = 0.55 * (1.0 - near)
        for size, shift, colour in layers:
            patches.append(Circle(centre + radius * shift * np.array([-0.7, 0.7]), size * radius))
            colours.append(colour * (1.0 - fade) + fade)
    axes.add_collection(PatchCollection(patches, facecolors=colours, edgecolors="none", zorder=2))


def _circles(
    axes: Axes, centres: np.ndarray, radii: np.ndarray, face: str, edge: str, alpha: float | None = None
) -> None:
    from matplotlib.collections import EllipseCollection

    axes.add_collection(
        EllipseCollection(
            2.0 * radii, 2.0 * radii, np.zeros(radii.size), units="xy", offsets=centres,
            offset_transform=axes.transData, facecolor=face, edgecolor=edge, linewidth=0.5, alpha=alpha,
        )
    )  # fmt: skip


def _with_copies(
    positions: np.ndarray, diameters: np.ndarray, box: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres of the particles and of the copies that reach into the box; their owners; which are copies."""
    edges = np.asarray(box)
    centres, owners, copies = [], [], []
    index = np.arange(len(positions))
    for shift in itertools.product((-1.0, 0.0, 1.0), repeat=len(box)):
        moved = positions + np.array(shift) * edges
        outside = np.maximum(np.maximum(-moved, moved - edges), 0.0)
        near = np.linalg.norm(outside, axis=1) < 0.5 * diameters
        kept = near if any(shift) else np.ones_like(near)
        centres.append(moved[kept])
        owners.append(index[kept])
        copies.append(np.full(int(kept.sum()), any(shift)))
    return np.concatenate(centres), np.concatenate(owners), np.concatenate(copies)


def _box_and_axes(axes: Axes, box: tuple[float, ...], margin: float) -> None:
    from matplotlib.patches import Rectangle

    axes.add_patch(Rectangle((0.0, 0.0), *box, fill=False, edgecolor=BORDER, linewidth=1.2, zorder=5))
    axes.set_xlim(-margin, box[0] + margin)
    axes.set_ylim(-margin, box[1] + margin)
    axes.set_aspect("equal")
    # The box has its own border.
    axes.spines[:].set_visible(False)
    axes.set_xlabel("x")
    axes.set_ylabel("y")
