"""Pictures of mixtures, walls and obstacles: what is drawn, and to which scale."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.frames import at_rest
from matplotlib.colors import to_hex
from matplotlib.patches import Circle, Polygon

from carom import Species
from carom.drawing.particles import FACES
from carom.frame import Frame
from carom.models import Ball, CylindricalContainer, Plane, SphericalContainer
from carom.pictures import plots


def frame_of(dimension: int, periodic: tuple[bool, ...] | None = None) -> Frame:
    positions = np.full((3, dimension), 2.0)
    positions[:, 0] = [0.2, 2.0, 3.9]
    return Frame(
        0.0, 0, positions, positions, (4.0,) * dimension, np.array([1.0, 0.5, 1.0]), np.ones(3),
        species=np.array([0, 1, 0]), periodic=periodic or (True,) * dimension,
    )  # fmt: skip


def ellipses(figure):
    """Widths, offsets and colors of all circles drawn as collections."""
    found = []
    for collection in figure.axes[0].collections:
        if type(collection).__name__ == "EllipseCollection":
            colors = [to_hex(c) for c in collection.get_facecolor()]
            widths = collection.get_widths()
            colors = colors * len(widths) if len(colors) == 1 else colors
            found += list(zip(widths, collection.get_offsets()[:, 0], colors, strict=True))
    return found


def test_disks_have_their_own_sizes_and_the_color_of_their_species():
    drawn = ellipses(plots.snapshot(frame_of(2)))
    real = sorted((x, c) for _, x, c in drawn if 0 <= x < 4)
    assert [(round(x, 9), c) for x, c in real] == [(0.2, FACES[0]), (2.0, FACES[1]), (3.9, FACES[0])]
    sizes = {round(x, 9): w for w, x, _ in drawn}
    assert sizes[2.0] / sizes[0.2] == 0.5
    # Both large ones cross the border along x.
    assert sorted(round(x, 9) for _, x, _ in drawn if not 0 <= x < 4) == [-0.1, 4.2]


def test_nothing_comes_through_a_wall():
    figure = plots.snapshot(frame_of(2, (False, True)))
    assert all(0 <= x < 4 for _, x, _ in ellipses(figure))
    thick = [c for c in figure.axes[0].collections if max(c.get_linewidth(), default=0) == 3.0]
    assert len(thick) == 1
    assert {tuple(path.vertices[:, 0]) for path in thick[0].get_paths()} == {(0.0, 0.0), (4.0, 4.0)}


def test_obstacles_are_drawn_to_scale_with_their_images():
    obstacles = [Ball((0.5, 1.0), 0.75), SphericalContainer((2.0, 2.0), 1.9), Plane((0.0, 2.0), 1.0)]
    figure = plots.snapshot(frame_of(2, (True, False)), obstacles=obstacles)
    circles = sorted((p.radius, *p.center) for p in figure.axes[0].patches if isinstance(p, Circle))
    assert circles == [(0.75, -3.5, 1.0), (0.75, 0.5, 1.0), (0.75, 4.5, 1.0), (1.9, 2.0, 2.0)]
    (half_plane,) = (p for p in figure.axes[0].patches if type(p) is Polygon)
    assert half_plane.get_xy()[:, 1].max() == pytest.approx(0.5)
    tube = plots.snapshot(frame_of(2, (True, False)), obstacles=[CylindricalContainer(0, (0.0, 2.0), 1.5)])
    assert [line.get_ydata()[0] for line in tube.axes[0].lines] == [0.5, 3.5]


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_mixtures_between_walls_are_drawn_in_every_dimension(dimension, tmp_path):
    frame = frame_of(dimension, (False,) * dimension)
    plots.snapshot(frame, obstacles=[Ball((1.0,) * dimension, 0.2)], path=tmp_path / "s.png")
    assert (tmp_path / "s.png").stat().st_size > 1000


def test_distances_of_all_pairs_are_in_the_largest_diameter():
    from carom.observables.rdf import PartialRDF
    from carom.scene.scene import Scene

    scene = Scene.random(
        species=[Species(count=60), Species(count=60, diameter=0.5)], packing_fraction=0.2, seed=1
    )
    found = PartialRDF(scene).over([at_rest(scene)])
    lines = plots.partial_rdf(found).axes[0].lines[1:]
    assert sorted(line.get_xdata()[0] for line in lines) == pytest.approx([0.5, 0.75, 1.0], rel=1e-9)
