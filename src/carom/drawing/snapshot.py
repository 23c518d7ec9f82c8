"""A picture of the particles of a frame, to scale."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from carom import theory
from carom.configuration import Configuration
from carom.figures.style import DPI, PIXELS, TITLE, TOP, saved, sheet, state
from carom.models.obstacles import Obstacle

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
    from carom.drawing.particles import draw_disks, draw_obstacles, draw_projection, draw_rods, draw_spheres

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
