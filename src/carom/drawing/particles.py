"""Drawings of particles to scale, one function for each kind of space."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import theory
from carom.bridges.embedding import cell_of, upright
from carom.configuration import Configuration
from carom.drawing.render import Camera, rendered
from carom.drawing.shapes import along, border
from carom.figures.palette import FACES
from carom.figures.style import DPI, PIXELS, TITLE, TOP, saved, sheet, state
from carom.models.interfaces.obstacle import Obstacle
from carom.models.obstacles import outlines
from carom.models.obstacles.outlines import Disk, HalfPlane

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EDGE = "#1f3b57"
PALE_FACE = "#dbe6f1"
PALE_EDGE = "#9fb3c7"
BORDER = "#333333"
SOLID = "#b9b4ab"
BOND = "#c0392b"
THIN = 0.05  # width of a bond, in diameters, if axes filled the figure

SIZE = 540
"""Pixels of the longer edge of a picture in 3D."""
MARGIN = 12
"""Pixels below it."""

STRIP = 16
"""Rows of it that are copied into a figure at once."""

MOST_OUTLINES = 20_000
"""Largest number of disks with outlines; with more, an outline is as wide as its disk."""


def draw_rods(axes: Axes, frame: Configuration) -> None:
    """1D: rods on a line; one that crosses the border is drawn at both ends."""
    from matplotlib.collections import PolyCollection

    length = frame.box[0]
    x = np.concatenate([frame.positions[:, 0] + shift for shift in (-length, 0.0, length)])
    half = 0.5 * np.tile(frame.diameters, 3)
    kept = (x + half > 0.0) & (x - half < length)
    if not frame.periodic[0]:
        kept &= np.repeat([False, True, False], frame.n)
    faces = np.tile(_faces(frame), 3)[kept]
    x, half = x[kept], half[kept]
    corners = np.stack([[x - half, x - half, x + half, x + half], np.outer([-1, 1, 1, -1], 0.5 + 0 * x)])
    rods = list(np.moveaxis(corners, (0, 1), (2, 1)))
    axes.add_collection(PolyCollection(rods, facecolor=faces, edgecolor=EDGE, linewidth=0.6))
    axes.set_xlim(0.0, length)
    if not frame.periodic[0]:
        axes.spines[["left", "right"]].set_visible(True)
        axes.spines[["left", "right"]].set_linewidth(2.5)
    axes.set_ylim(-1.0, 1.0)
    axes.set_yticks([])
    if frame.periodic[0]:
        axes.spines[["left"]].set_visible(False)
    axes.set_xlabel("x")


def draw_disks(axes: Axes, frame: Configuration) -> None:
    """2D: disks in the box; periodic copies of those that cross its border are pale."""
    centers, owners, copies = with_copies(frame)
    radii = 0.5 * frame.diameters[owners]
    circles(axes, centers[copies], radii[copies], PALE_FACE, PALE_EDGE)
    circles(axes, centers[~copies], radii[~copies], _faces(frame)[owners[~copies]], EDGE)
    box_and_axes(axes, frame.box, float(frame.diameters.max()), frame.periodic)


def draw_obstacles(axes: Axes, obstacles: Sequence[Obstacle], frame: Configuration) -> None:
    """2D: planes, fixed bodies with their images, containers, and all others that have an outline."""
    from matplotlib.patches import Circle, Polygon

    reach = math.hypot(*frame.box) + float(frame.diameters.max())
    solid: dict[str, Any] = {"facecolor": SOLID, "edgecolor": BORDER, "zorder": 0.5}
    for shape in outlines.of_all(obstacles, frame.box, frame.periodic):
        if isinstance(shape, HalfPlane):
            normal = np.array(shape.normal)
            beside, behind = 2 * reach * np.array([-normal[1], normal[0]]), 2 * reach * normal
            ends = shape.point - beside, shape.point + beside
            axes.add_patch(Polygon([*ends, ends[1] - behind, ends[0] - behind], **solid))
        elif isinstance(shape, Disk):
            axes.add_patch(Circle(shape.center, shape.radius, **solid))
        elif isinstance(shape, outlines.Circle):
            axes.add_patch(Circle(shape.center, shape.radius, fill=False, edgecolor=BORDER, linewidth=2.0))
        elif isinstance(shape, outlines.Hull):
            corners = border(shape)
            if len(corners) > 2:
                axes.add_patch(Polygon(corners, **solid))
            else:
                axes.plot(*corners.T, color=BORDER, linewidth=2.0, zorder=0.5)
        elif isinstance(shape, outlines.Arc):
            axes.plot(*along(shape).T, color=BORDER, linewidth=2.0, zorder=0.5)
        else:
            line = axes.axhline if shape.axis == 0 else axes.axvline
            line(shape.offset, color=BORDER, linewidth=2.0)


def _faces(frame: Configuration) -> np.ndarray:
    """Return the color of each particle, by its species."""
    kinds = np.zeros(frame.n, dtype=np.int64) if frame.species is None else frame.species
    return np.array(FACES)[kinds % len(FACES)]


def draw_projection(axes: Axes, frame: Configuration) -> None:
    """Beyond 3D: the first two coordinates of every particle, as translucent disks."""
    order = np.argsort(frame.positions[:, 2])
    centers, radii = upright(frame)[order, :2], 0.5 * frame.diameters[order]
    circles(axes, centers, radii, _faces(frame)[order], EDGE, alpha=max(0.08, min(0.5, 60.0 / frame.n)))
    box_and_axes(axes, frame.box[:2], float(frame.diameters.max()), frame.periodic[:2])


def draw_spheres(axes: Axes, frame: Configuration, obstacles: Sequence[Obstacle] = ()) -> None:
    """3D: shaded spheres and obstacles in parallel projection, with the edges of the box."""
    figure: Any = axes.get_figure(root=True)
    *color, opacity = figure.get_facecolor()  # dark in some styles
    ground = (opacity * np.array(color) + 1.0 - opacity).astype(np.float32)
    image = rendered(frame, Camera.on(frame, SIZE), obstacles=obstacles, ground=ground)
    # Pixel by pixel: resampling would take as long as drawing.
    left = (round(figure.bbox.width) - image.shape[1]) // 2
    # Strip by strip, because matplotlib takes 100 bytes and more for each pixel that it copies.
    for top in range(0, len(image), STRIP):
        strip = image[top : top + STRIP]
        figure.figimage(strip, left, MARGIN + len(image) - top - len(strip), origin="upper")
    axes.set_axis_off()


def circles(
    axes: Axes,
    centers: np.ndarray,
    radii: np.ndarray,
    face: str | np.ndarray,
    edge: str,
    alpha: float | None = None,
    linestyle: str = "-",
) -> None:
    """Draw circles in units of the axes; very many filled ones have no outline."""
    from matplotlib.collections import EllipseCollection

    if radii.size > MOST_OUTLINES and not (isinstance(face, str) and face == "none"):
        edge = "none"
    axes.add_collection(
        EllipseCollection(
            2.0 * radii, 2.0 * radii, np.zeros(radii.size), units="xy", offsets=centers,
            offset_transform=axes.transData, facecolor=face, edgecolor=edge, linewidth=0.5, alpha=alpha,
            linestyle=linestyle,
        )
    )  # fmt: skip


def with_copies(frame: Configuration) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return centers of disks and of copies that reach into the box, owners, and which are copies."""
    positions, edges, cell = upright(frame), np.asarray(frame.box), cell_of(frame)[:2, :2]
    centers, owners, copies = [], [], []
    index = np.arange(len(positions))
    turns = [(-1.0, 0.0, 1.0) if repeats else (0.0,) for repeats in frame.periodic]
    for shift in itertools.product(*turns):
        moved = positions + np.array(shift) @ cell
        outside = np.maximum(np.maximum(-moved, moved - edges), 0.0)
        near = np.linalg.norm(outside, axis=1) < 0.5 * frame.diameters
        kept = near if any(shift) else np.ones_like(near)
        centers.append(moved[kept])
        owners.append(index[kept])
        copies.append(np.full(int(kept.sum()), any(shift)))
    return np.concatenate(centers), np.concatenate(owners), np.concatenate(copies)


def box_and_axes(axes: Axes, box: tuple[float, ...], margin: float, periodic: tuple[bool, ...]) -> None:
    """Draw the box with thick walls, and set the axes around it."""
    from matplotlib.patches import Rectangle

    if not periodic[0]:
        axes.vlines([0.0, box[0]], 0.0, box[1], color=BORDER, linewidth=3.0, zorder=5)
    if not periodic[1]:
        axes.hlines([0.0, box[1]], 0.0, box[0], color=BORDER, linewidth=3.0, zorder=5)

    axes.add_patch(Rectangle((0.0, 0.0), *box, fill=False, edgecolor=BORDER, linewidth=1.2, zorder=5))
    axes.set_xlim(-margin, box[0] + margin)
    axes.set_ylim(-margin, box[1] + margin)
    axes.set_aspect("equal")
    axes.spines[:].set_visible(False)
    axes.set_xlabel("x")
    axes.set_ylabel("y")


def snapshot(
    frame: Configuration,
    *,
    obstacles: Sequence[Obstacle] = (),
    path: str | os.PathLike[str] | None = None,
) -> Figure:
    """The particles of a frame, to scale, in their box; species in different colors, walls thick.

    Parameters
    ----------
    frame : Frame
        In 1D it is drawn as rods on a line, in 2D as disks, with periodic copies at the border, and in 3D as
        shaded spheres in parallel projection. From 4D on only the first two coordinates are drawn, which the
        title says.
    obstacles : sequence of obstacles, optional
        Obstacles of the scene, drawn in 2D and 3D. Those of your own class need ``outline`` or ``surface``.
    path : path, optional
        Where to save the picture.
    """
    space = frame.dimension == 3
    figure, axes = sheet(6.0, 1.6 if frame.dimension == 1 else 6.4, PIXELS if space else DPI)
    if space:
        # Without axes there is nothing to lay out, and a layout engine would draw everything twice.
        figure.set_layout_engine("none")
        axes.set_position((0.0, 0.0, 1.0, 0.93))
        draw_spheres(axes, frame, obstacles)
    else:
        {1: draw_rods, 2: draw_disks}.get(frame.dimension, draw_projection)(axes, frame)
    if frame.dimension == 2:
        draw_obstacles(axes, obstacles, frame)
    volume = sum(theory.ball_volume(frame.dimension, float(s)) for s in frame.diameters)
    title = state(frame.n, frame.dimension, volume / math.prod(frame.box))
    if frame.dimension > 3:
        title += "\nfirst two coordinates"
    axes.set_title(title, fontsize=TITLE, y=TOP)
    return saved(figure, path)
