"""Drawings of packings: the contacts of the backbone as bonds, rattlers dotted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from carom.drawing.particles import (
    BOND,
    BORDER,
    EDGE,
    PALE_EDGE,
    PALE_FACE,
    SIZE,
    SOLID,
    THIN,
    box_and_axes,
    circles,
    with_copies,
)  # fmt: skip
from carom.drawing.render import Camera, edges_of
from carom.drawing.shapes import shapes_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.observables.packing import PackingNetwork


def draw_network(axes: Axes, network: PackingNetwork) -> None:
    """2D: a packing, its backbone's contacts as bonds, its rattlers dotted."""
    frame = network.frame
    centers, owners, copies = with_copies(frame)
    radii, solid = 0.5 * frame.diameters[owners], network.backbone[owners]
    for here, face, edge in ((copies, "none", PALE_EDGE), (~copies, PALE_FACE, EDGE)):
        circles(axes, centers[here & solid], radii[here & solid], face, edge)
        circles(axes, centers[here & ~solid], radii[here & ~solid], "none", edge, linestyle=":")
    _bonds(axes, network, np.eye(2))
    box_and_axes(axes, frame.box, float(frame.diameters.max()), frame.periodic)


def draw_network_in_space(axes: Axes, network: PackingNetwork) -> None:
    """3D, in parallel projection: bonds of a packing's backbone, rattlers as dotted circles, obstacles."""
    from matplotlib.collections import LineCollection, PolyCollection

    frame = network.frame
    plane = Camera.on(frame, SIZE).axes[:2].T
    center = 0.5 * np.asarray(frame.box)
    shapes = shapes_of(network.obstacles, np.asarray(frame.box), frame.periodic)
    circles(axes, (shapes.spheres[:, :3] - center) @ plane, shapes.spheres[:, 3], SOLID, BORDER, alpha=0.6)
    axes.add_collection(PolyCollection((shapes.triangles - center) @ plane, facecolor=SOLID, alpha=0.3))
    lines = np.concatenate([[ends for ends, _ in edges_of(frame)], shapes.segments])
    axes.add_collection(LineCollection((lines - center) @ plane, color=BORDER, linewidth=0.9))
    _bonds(axes, network, plane, center)
    loose = network.rattlers
    flat = (frame.positions[loose] - center) @ plane
    circles(axes, flat, 0.5 * frame.diameters[loose], "none", EDGE, linestyle=":")
    axes.set_aspect("equal")
    axes.set_axis_off()


def _bonds(axes: Axes, network: PackingNetwork, plane: np.ndarray, center: np.ndarray | float = 0.0) -> None:
    """Draw the bonds of the backbone, from both ends, as they may cross the border."""
    from matplotlib.collections import LineCollection

    frame, held = network.frame, network.held
    starts, steps = network.bonds[held], network.vectors[held]
    first = (frame.positions[starts[:, 0]] - center) @ plane
    pairs = starts[:, 1] < frame.n
    second = (frame.positions[starts[pairs, 1]] - center) @ plane
    lines = [np.stack([first, first + steps @ plane], axis=1)]
    lines.append(np.stack([second, second - steps[pairs] @ plane], axis=1))
    # Thinner than a tenth of a disk, of which there is room for so many in the figure.
    many = 2.0 + float(np.ptp(frame.positions @ plane, axis=0).max()) / float(frame.diameters.min())
    figure: Any = axes.get_figure(root=True)
    width = min(0.9, THIN * 72.0 * float(min(figure.get_size_inches())) / many)
    axes.add_collection(LineCollection(list(np.concatenate(lines)), color=BOND, linewidth=width, zorder=3))
