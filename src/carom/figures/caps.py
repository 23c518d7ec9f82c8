"""Pictures of caps on the sphere S^2, shaded, with their contacts."""

from __future__ import annotations

import math
from os import PathLike
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.figures.palette import FACES, rgb

LIGHT = np.array([-0.45, 0.55, 0.70]) / math.sqrt(0.45**2 + 0.55**2 + 0.70**2)
"""Unit vector towards the light, in the axes of the picture: right, up, towards the eye."""

GROUND = 0.42
"""Gray of the sphere between the caps."""

COLORS = tuple(rgb(FACES[k]) for k in (5, 4, 4, 0, 1, 2, 3))
"""Colors of caps with 0, 1, 2, ... contacts; the last one with more, too."""

LEGEND = 9.0
"""Size of the letters of the legend [points], of a picture of 700 pixels."""

RIM = 0.96
"""Fraction of a cap's angular radius where its rim begins, which is darker."""


def caps(
    points: np.ndarray,
    radius: float,
    contacts: np.ndarray | None = None,
    *,
    view: tuple[float, float] = (35.0, 25.0),
    pixels: int = 700,
    path: str | PathLike[str] | None = None,
) -> Any:
    """Draw caps on the sphere S^2 from outside, with a line for every contact.

    The middles of the caps are unit vectors (n, 3); the ``radius`` is in degrees. The number of its
    ``contacts`` (m, 2) gives a cap its color, which a legend names. ``view`` is the longitude and latitude of
    the direction of view [degrees].
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from carom.figures.style import saved

    points = np.asarray(points, float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"Caps are drawn on a sphere in three dimensions, found points {points.shape}.")
    checks.integer(pixels, "pixels", low=16, high=10_000)
    seen = points @ _turn(*view)
    grid = (np.arange(pixels) + 0.5) / pixels * 2.1 - 1.05
    x, y = np.meshgrid(grid, grid)
    height = 1.0 - x * x - y * y
    inside = height > 0.0
    normals = np.column_stack([x[inside], y[inside], np.sqrt(height[inside])])
    products = normals @ seen.T
    nearest = products.argmax(axis=1)
    angle = np.degrees(np.arccos(np.clip(products[np.arange(len(nearest)), nearest], -1.0, 1.0)))
    pairs = np.empty((0, 2), int) if contacts is None else np.asarray(contacts)
    counts = np.bincount(pairs.ravel(), minlength=len(points))
    shades = np.array(COLORS)[np.minimum(counts, len(COLORS) - 1)]
    color = np.full((len(nearest), 3), GROUND)
    cap = angle <= radius
    color[cap] = shades[nearest[cap]]
    color[cap & (angle > RIM * radius)] *= 0.7
    diffuse = np.clip(normals @ LIGHT, 0.0, 1.0)
    shine = np.clip(2.0 * (normals @ LIGHT) * normals[:, 2] - LIGHT[2], 0.0, 1.0) ** 30
    color = color * (0.45 + 0.55 * diffuse)[:, None] + 0.2 * shine[:, None]
    picture = np.ones((pixels, pixels, 4))
    picture[..., 3] = 0.0
    picture[inside, :3] = np.clip(color, 0.0, 1.0)
    picture[inside, 3] = 1.0
    figure = Figure(figsize=(pixels / 100, pixels / 100), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(picture, origin="lower", extent=(-1.05, 1.05, -1.05, 1.05))
    for i, j in pairs:
        line = _arc(seen[i], seen[j])
        line[line[:, 2] < 0.0] = np.nan
        axes.plot(line[:, 0], line[:, 1], color="white", linewidth=1.6, alpha=0.9)
    axes.set_axis_off()
    _legend(axes, counts, pixels)
    return saved(figure, path)


def _legend(axes: Any, counts: np.ndarray, pixels: int) -> None:
    """Say in a corner which color has how many contacts."""
    from matplotlib.lines import Line2D

    last = len(COLORS) - 1
    names = {k: f"{k} contact{'s' * (k != 1)}" for k in range(last)} | {0: "rattler", last: f"{last} or more"}
    size = LEGEND * pixels / 700
    marks = [
        Line2D([], [], marker="o", ls="none", ms=size, color=COLORS[k], label=names[k])
        for k in np.unique(np.minimum(counts, last))
    ]
    axes.legend(
        handles=marks, loc="lower left", fontsize=size, frameon=False, borderaxespad=0.2, handletextpad=0.2
    )


def _turn(longitude: float, latitude: float) -> np.ndarray:
    """Return the matrix that rotates a direction of view towards the eye."""
    a, b = math.radians(longitude), math.radians(latitude)
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    towards = np.array([math.cos(b) * math.cos(a), math.cos(b) * math.sin(a), math.sin(b)])
    return np.column_stack([right, np.cross(towards, right), towards])


def _arc(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return points of the great circle from one unit vector to another, (m, 3)."""
    part = np.linspace(0.0, 1.0, 41)[:, None]
    line = a * (1.0 - part) + b * part
    return np.asarray(line / np.linalg.norm(line, axis=1)[:, None])
