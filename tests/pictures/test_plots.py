"""Pictures: what they show, that they are drawn to scale, and that they leave no trace in pyplot."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.drawn import bars, outside, segments, strange_bars
from helpers.estimates import estimate
from helpers.frames import at_rest, frame_of as frame
from helpers.mixtures import mixture
from helpers.scripts import python
from matplotlib import rc_context
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from PIL import Image

from carom import theory
from carom.block import Block
from carom.drawing.render import Camera, rendered
from carom.errors import FileError, InputError
from carom.figures import curves
from carom.figures.palette import FACES, THEORIES, rgb
from carom.models import Ball, CylindricalContainer, Plane, SphericalContainer
from carom.observables import RDF
from carom.observables.packing import packing_network
from carom.observables.pressure import Pressure
from carom.observables.rdf import PartialRDF
from carom.observables.statistics import Estimate
from carom.pictures import plots
from carom.studies.packings.packing import HISTORY


def dashed(figure):
    """Labels and heights of the lines of theory."""
    looks = dict(THEORIES)
    lines = [line for line in figure.axes[0].lines if looks.get(line.get_color()) == line.get_linestyle()]
    return {line.get_label().rpartition(",")[0]: line.get_ydata()[0] for line in lines}


def lattice(dimension, cells=4, diameters=1.0):
    sites = np.stack(np.meshgrid(*[1.1 * np.arange(cells)] * dimension, indexing="ij"), axis=-1)
    return frame(sites.reshape(-1, dimension), (1.1 * cells,) * dimension, diameters)


TOUCHING = 1.1 - 1e-9
"""Diameters of a lattice of contacts."""


def is_png(path):
    return path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("dimension", [1, 2, 3, 4, 7])
def test_pressure_draws_the_mean_and_theory_at_finite_n(dimension, tmp_path):
    result = estimate(dimension) if dimension < 7 else estimate(7, n=5)
    figure = plots.pressure(result, path=tmp_path / "p.png")
    axes = figure.axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    running = next(line for label, line in lines.items() if label.startswith("running"))
    assert running.get_ydata()[-1] == pytest.approx(result.Z.mean, rel=1e-12)
    count = len(result.block_values)
    middle, half = np.transpose(bars(axes))
    np.testing.assert_allclose(middle, running.get_ydata(), rtol=1e-12)
    np.testing.assert_allclose(half, result.Z.error * np.sqrt(count / np.arange(1.0, count + 1.0)), rtol=1e-9)
    if dimension == 3:
        shown = next(line.get_ydata()[0] for label, line in lines.items() if label.startswith("Carnahan"))
        eta = result.packing_fraction
        shift = theory.finite_size_shift(eta, result.n, theory.carnahan_starling)
        assert shown == pytest.approx(theory.carnahan_starling(eta) + shift, rel=1e-12)
    if dimension == 7:
        # No equation of state is known there, and none is drawn.
        assert len(lines) == 2
    low, high = axes.get_ylim()
    assert low < result.Z.mean < high
    assert is_png(tmp_path / "p.png")


def test_no_equation_of_the_fluid_is_drawn_for_what_is_no_fluid_of_equal_spheres():
    assert dashed(plots.pressure(estimate(3, eta=0.6))) == {}  # a crystal
    assert dashed(plots.pressure(estimate(2, eta=0.71))) == {}  # coexisting phases
    assert dashed(plots.pressure(estimate(3, simple=False))) == {}  # a mixture, or walls
    crystal = {"Almarza (fcc)": 15.25}
    assert dashed(plots.pressure(estimate(3, eta=0.6), equations=crystal)) == crystal  # as it is
    assert list(dashed(plots.pressure(estimate(2, eta=0.69)))) == ["Henderson", "Padé of ten virials"]


def test_an_equation_of_the_solid_is_drawn_at_its_own_finite_n():
    crystal = dataclasses.replace(estimate(3, eta=0.6), solid=True)
    drawn = dashed(plots.pressure(crystal, equations={"Almarza": theory.almarza}))
    infinite = theory.almarza(0.6)
    assert drawn["Almarza"] == pytest.approx(1.0 + (infinite - 1.0) * (1.0 - 1.0 / crystal.n), rel=1e-12)


def test_the_axis_of_time_claims_no_unit_that_its_numbers_do_not_have():
    axes = plots.pressure(estimate(3, blocks=30)).axes[0]
    assert axes.get_xlim()[1] == 30.0  # as in the scene, whatever its diameter and temperature
    assert axes.get_xlabel() == "time t"


@pytest.mark.parametrize(("virial", "scatter"), [(300.0, 9.0), (3e7, 1e3), (1e-3, 1e-5), (0.0, 1e-9)])
def test_all_numbers_and_labels_stand_inside_the_picture(virial, scatter):
    """Room is made for the longest number without drawing it."""
    rng = np.random.default_rng(1)
    data = [Block(1.0, 200, float(rng.normal(virial, scatter))) for _ in range(64)]
    result = Pressure.estimate(data, n=50, dimension=3, volume=100.0, diameter=1.0, kT=1.0)
    figure = plots.pressure(result, equations={})
    figure.draw_without_rendering()
    axes = figure.axes[0]
    for part in (axes.xaxis, axes.yaxis, axes.title):
        box = part.get_tightbbox(figure.canvas.get_renderer())
        assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1


def test_many_blocks_are_drawn_as_means_that_keep_the_mean():
    result = estimate(3, blocks=1000)
    points = plots.pressure(result, equations={}).axes[0].lines[0]
    assert len(points.get_ydata()) <= 64
    # 1000 blocks in groups of 16: the last one has 8.
    weights = np.append(np.full(62, 16), 8)
    mean = np.average(points.get_ydata(), weights=weights)
    assert mean == pytest.approx(result.Z.mean, rel=1e-12)


def test_the_running_mean_is_one_over_time_where_blocks_differ_in_length():
    rng = np.random.default_rng(1)
    data = [Block(float(t), 9, 30.0 + 20.0 * float(t > 1.0)) for t in rng.choice([1.0, 4.0], 64)]
    result = Pressure.estimate(data, n=50, dimension=3, volume=100.0, diameter=1.0, kT=1.0)
    lines = plots.pressure(result, equations={}).axes[0].lines
    time, running = next(line for line in lines if "running" in line.get_label()).get_data()
    durations, virials = np.transpose([(each.duration, each.virial) for each in data])
    np.testing.assert_allclose(time, np.cumsum(durations))
    np.testing.assert_allclose(running, 1.0 + np.cumsum(virials) / time / 150.0, rtol=1e-12)


def test_a_pressure_of_infinite_error_is_drawn_without_a_band():
    one = Pressure.estimate([Block(1.0, 0, 0.0)] * 4, n=1, dimension=3, volume=2.0, diameter=1.0, kT=1.0)
    assert len(plots.pressure(one).axes[0].lines) >= 2
    result = estimate(3)
    unknown = Estimate(2.0, math.inf, 0.0, math.inf, 1)
    figure = plots.pressure(type(result)(**{**vars(result), "Z": unknown}))
    assert not figure.axes[0].collections


def test_an_estimate_without_blocks_is_refused():
    result = estimate(3)
    with pytest.raises(InputError, match="no block"):
        plots.pressure(type(result)(**{**vars(result), "block_values": (), "block_durations": ()}))


def test_rdf_draws_g_and_both_contact_values(tmp_path):
    rng = np.random.default_rng(1)
    frames = []
    for _ in range(20):
        gaps = rng.dirichlet(np.ones(30)) * 30.0
        frames.append(frame(np.mod(np.cumsum(gaps + 1.0), 60.0)[:, None], (60.0,)))
    distribution = RDF(width=0.05).over(frames)
    implied = Estimate(2.0, 0.01, 100.0, 1.0, 64)
    figure = plots.rdf(distribution, contact_value=implied, path=tmp_path / "g.png")
    axes = figure.axes[0]
    curve = max(axes.lines, key=lambda line: len(line.get_ydata()))
    np.testing.assert_array_equal(curve.get_ydata(), distribution.g)
    inset = axes.child_axes[0]
    count, strange = strange_bars(axes, [distribution, implied])
    near = int((distribution.r < 1.25 * distribution.diameter).sum())
    assert (count, strange) == (len(distribution.g) + near + 2, [])
    marks = [line for line in inset.get_lines() if line.get_marker() in "Do"]
    assert [line.get_xdata().tolist() for line in marks] == [[1.0], [1.0]]  # both at contact
    labels = inset.get_legend_handles_labels()[1]
    assert any("pressure 2.000" in label for label in labels)
    assert any(distribution.contact_value.value_text[:4] in label for label in labels)
    assert is_png(tmp_path / "g.png")


def test_rdf_of_point_particles_has_no_contact():
    rng = np.random.default_rng(2)
    figure = plots.rdf(RDF(bins=20).over([frame(rng.random((50, 2)), (1.0, 1.0), diameters=0.0)]))
    assert not figure.axes[0].child_axes


def test_disks_are_drawn_to_scale_with_copies_at_the_border():
    # One inside, one across the left edge, one across a corner: 1 and 3 copies.
    figure = plots.snapshot(frame([[2.0, 2.0], [0.2, 2.5], [3.9, 4.9]], (4.0, 5.0), diameters=0.8))
    axes = figure.axes[0]
    circles = [c for c in axes.collections if isinstance(c, EllipseCollection)]
    copies, originals = sorted(circles, key=lambda c: np.mean(c.get_facecolor()[0, :3]), reverse=True)
    np.testing.assert_allclose(sorted(originals.get_offsets().tolist()), [[0.2, 2.5], [2.0, 2.0], [3.9, 4.9]])
    expected = [[-0.1, -0.1], [-0.1, 4.9], [3.9, -0.1], [4.2, 2.5]]
    np.testing.assert_allclose(sorted(copies.get_offsets().tolist()), expected, atol=1e-15)
    # Data units, in both directions alike.
    np.testing.assert_allclose(originals.get_widths(), 0.8)
    assert originals._units == "xy"
    assert axes.get_aspect() == 1.0


@pytest.mark.parametrize(
    ("places", "edge", "periodic", "drawn"),
    [
        ([[0.25], [3.0]], 6.0, True, [(-0.25, 0.75), (2.5, 3.5), (5.75, 6.75)]),
        ([[0.5], [2.0], [3.5]], 4.0, False, [(0.0, 1.0), (1.5, 2.5), (3.0, 4.0)]),
    ],
)
def test_rods_are_drawn_where_they_are_and_across_a_periodic_border_at_both_ends(
    places, edge, periodic, drawn
):
    kinds = np.arange(len(places))
    figure = plots.snapshot(frame(places, (edge,), periodic=periodic, species=kinds))
    (rods,) = (c for c in figure.axes[0].collections if isinstance(c, PolyCollection))
    spans = [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in rods.get_paths()]
    np.testing.assert_allclose(sorted(spans), drawn)
    for span, color in zip(spans, rods.get_facecolors(), strict=True):
        (kind,) = np.flatnonzero(np.isclose(np.mean(span) % edge, np.ravel(places)))
        assert tuple(color[:3]) == pytest.approx(rgb(FACES[kind]))


def test_blocks_that_are_drawn_as_one_have_their_mean_at_the_middle_of_their_time():
    means, middles = curves.grouped(np.array([1.0, 4.0, 5.0]), np.array([1.0, 2.0, 3.0]), 2)
    assert (means.tolist(), middles.tolist()) == ([3.0, 5.0], [1.5, 4.5])


def test_near_spheres_are_drawn_over_far_ones():
    camera = Camera.on(frame([[5.0, 5.0, 5.0]], (10.0, 10.0, 10.0)), 200)
    pair = np.array([5.0, 5.0, 5.0]) + np.outer([1.0, -1.0], camera.axes[2])
    both = frame(pair, (10.0, 10.0, 10.0))
    middle = camera.height // 2, camera.width // 2
    # Both project to the same point; and the far one alone is hazier.
    red, blue = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    picture = rendered(both, camera, colors=np.array([red, blue]))[middle]
    assert picture[0] > picture[2]
    picture = rendered(both, camera, colors=np.array([blue, red]))[middle]
    assert picture[2] > picture[0]
    near, far = (rendered(frame([x], (10.0, 10.0, 10.0)), camera)[middle].mean() for x in pair)
    assert far > near


def test_spheres_stand_on_the_ground_of_the_style_and_their_box_can_be_seen_on_it(tmp_path):
    box = frame([[0.0, 0.0, 0.0]], (10.0, 10.0, 10.0))
    for name, ground in {"white": 255, "black": 0, "none": 255}.items():
        with rc_context({"figure.facecolor": name}):
            plots.snapshot(box, path=tmp_path / "box.png")
        shown = np.asarray(Image.open(tmp_path / "box.png").convert("L")).astype(int)[60:]
        assert np.median(shown) == ground
        assert (abs(shown - ground) > 150).sum() > 1000, "edges of the box"


@pytest.mark.parametrize("tilt", [0.25, -0.25])
def test_copies_of_a_disk_of_a_sheared_box_stand_in_its_tilted_lattice(tilt):
    one = dataclasses.replace(frame([[2.0, 3.875]], (5.0, 4.0)), tilt=tilt)
    centers = [
        c.get_offsets() for c in plots.snapshot(one).axes[0].collections if isinstance(c, EllipseCollection)
    ]
    copies, here = centers
    assert here.tolist() == [[2.0, 3.875]]
    assert copies.tolist() == [[2.0 - 4.0 * tilt, -0.125]]


@pytest.mark.parametrize("dimension", [1, 2, 3, 4, 6])
def test_snapshots_of_every_dimension_are_saved(dimension, tmp_path):
    places = lattice(dimension, 4 if dimension < 5 else 2)
    changes = {"species": np.arange(places.n) % 2, "periodic": (False,) * dimension}
    mixture = dataclasses.replace(places, positions=places.positions + 0.5, **changes)
    figure = plots.snapshot(mixture, obstacles=[Ball((1.0,) * dimension, 0.2)], path=tmp_path / "s.png")
    assert isinstance(figure, Figure)
    assert is_png(tmp_path / "s.png")
    assert ("first two coordinates" in figure.axes[0].get_title()) is (dimension > 3)
    assert plots.snapshot(places).axes


def test_pictures_leave_pyplot_alone():
    script = (
        "import sys; from carom.pictures import plots; from carom.frame import Frame; import numpy as np; "
        "x = np.zeros((1, 2)); plots.snapshot(Frame(0.0, 0, x, x, (2.0, 2.0), np.ones(1), np.ones(1))); "
        "sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    python("-c", script)


def test_unwritable_pictures_are_refused(tmp_path):
    with pytest.raises(FileError, match="cannot be written"):
        plots.snapshot(lattice(2), path=tmp_path / "missing" / "s.png")
    with pytest.raises(FileError, match="cannot be written"):
        plots.snapshot(lattice(2), path=tmp_path / "s.nonsense")


def test_every_picture_of_numbers_holds_its_data_within_its_axes():
    found = estimate(simple=True)
    figure = plots.pressure(found)
    # Most of the blocks and of the wide band at the beginning, on purpose: they would flatten the mean.
    strays = {*figure.axes[0].collections, figure.axes[0].lines[0]}
    assert not outside(figure, but=lambda artist: artist in strays)
    (running,) = [line for line in figure.axes[0].lines if "running" in line.get_label()]
    assert running.get_ydata()[-1] == pytest.approx(found.Z.mean, rel=1e-12)
    rng = np.random.default_rng(1)
    places = [lattice(3, 5).positions + 0.1 * rng.random((125, 3)) for _ in range(20)]
    g = RDF().over([frame(each, (5.5,) * 3, 1.0 - 0.1 * 3**0.5) for each in places])
    figure = plots.rdf(g)
    # Errors reach below zero where few pairs are seen, and the zero below contact is cut off at the left.
    cut = {c for axes in (figure.axes[0], *figure.axes[0].child_axes) for c in axes.collections}
    cut |= {line for line in figure.axes[0].lines if line.get_xdata()[0] == 0.0}
    assert not outside(figure, but=lambda artist: artist in cut)
    drawn = [line.get_data() for line in figure.axes[0].lines if len(line.get_xdata()) == len(g.g)]
    np.testing.assert_array_equal(drawn[0], [g.r / g.diameter, g.g])
    assert (
        np.max((g.g + g.error)[g.r > 0.5 * sum(figure.axes[0].get_xlim())])
        < 0.4 * figure.axes[0].get_ylim()[1]
    )
    far = g.r > 0.5 * sum(figure.axes[0].get_xlim()) * g.diameter
    wide = dataclasses.replace(g, error=np.where(far, 3.0, g.error))  # their bars end below the inset
    top = plots.rdf(wide).axes[0].get_ylim()[1]
    assert (wide.g + wide.error)[far].max() == pytest.approx(0.38 * top)
    figure = plots.rdf(dataclasses.replace(g, contact_value=None))
    assert np.max(g.g + g.error) <= figure.axes[0].get_ylim()[1]
    figure = plots.partial_rdf({"a-b": g})
    assert not outside(figure, but=lambda artist: artist in figure.axes[0].collections)
    np.testing.assert_array_equal(figure.axes[0].lines[1].get_ydata()[2:], g.g)
    assert strange_bars(figure.axes[0], g) == (len(g.g), [])
    network = packing_network(lattice(2, 6), gap=0.2)
    figure = plots.gaps(network)
    assert not outside(figure)
    assert figure.axes[0].lines[0].get_ydata()[-1] == len(network.gaps)
    history = np.zeros(9, dtype=HISTORY)
    history["Z"] = np.geomspace(10.0, 1e6, 9)
    history["packing_fraction"] = 0.64 * (1.0 - 2.0 / history["Z"])
    for jammed in (0.64, math.nan):
        figure = plots.compression(history, jammed, 3)
        assert not outside(figure)
        assert len(figure.axes[0].lines[0].get_ydata()) == 9


@pytest.mark.parametrize("dimension", [1, 2, 4])
def test_every_particle_of_a_snapshot_is_drawn_within_its_axes(dimension):
    sites = lattice(dimension)
    figure = plots.snapshot(frame(sites.positions + 0.55, sites.box))  # in one dimension the border cuts rods
    assert not outside(figure)
    shown = sum(
        len(c.get_paths()) if isinstance(c, PolyCollection) else len(c.get_offsets())
        for c in figure.axes[0].collections
    )
    assert shown >= 4**dimension


@pytest.mark.parametrize("dimension", [2, 3])
def test_every_bond_of_a_backbone_is_drawn_from_both_of_its_ends(dimension):
    places = lattice(dimension, 3, TOUCHING)
    network = packing_network(places)
    assert network.contacts == dimension * 3**dimension
    figure = plots.packing(network)
    assert not outside(figure)
    if dimension == 3:
        right, up, _ = Camera.on(places, 100).axes
        plane, center = np.stack([right, up], axis=1), 0.5 * np.asarray(places.box)
    else:
        plane, center = np.eye(2), 0.0
    middles = (places.positions - center) @ plane
    expected = []
    for (i, j), step in zip(network.bonds, network.vectors @ plane, strict=True):
        expected += [[middles[i], middles[i] + step], [middles[j], middles[j] - step]]
    drawn = np.array([each for each in segments(figure) if len(each) == 2])
    off = np.abs(np.array(expected)[:, None] - drawn).max(axis=(2, 3))
    assert off.min(axis=1).max() < 1e-12


@pytest.mark.parametrize(("dimension", "edge"), [(2, 3), (2, 60), (3, 3)])
def test_bonds_of_a_packing_are_thinner_than_a_tenth_of_a_disk(dimension, edge):
    figure = plots.packing(packing_network(lattice(dimension, edge, TOUCHING)))
    figure.canvas.draw()
    axes = figure.axes[0]
    scale = np.diff(axes.transData.transform([[0.0, 0.0], [1.1, 0.0]])[:, 0])[0] * 72.0 / figure.dpi
    bonds = [each for each in axes.collections if isinstance(each, LineCollection) and each.zorder == 3]
    assert 0.0 < bonds[0].get_linewidth()[0] < 0.1 * scale


def test_a_packing_in_space_is_drawn_with_its_obstacles():
    network = packing_network(lattice(3, 3, TOUCHING))
    kinds = {"EllipseCollection": "get_offsets", "PolyCollection": "get_paths", "LineCollection": "get_paths"}
    drawn = []
    for obstacles in ([], [Ball((0.5, 0.5, 0.5), 0.2)], [Plane((0.0, 0.0, 1.0), 0.0)]):
        collections = (
            plots.packing(dataclasses.replace(network, obstacles=tuple(obstacles))).axes[0].collections
        )
        drawn.append(
            [
                sum(len(getattr(c, get)()) for c in collections if type(c).__name__ == kind)
                for kind, get in kinds.items()
            ]
        )
    none, ball, plane = np.array(drawn)
    assert ball[0] > none[0]
    assert (plane[1:] > none[1:]).all(), "a face and its border"


def test_a_compression_is_drawn_at_the_density_in_the_middle_of_each_stretch():
    history = np.zeros(3, dtype=HISTORY)
    history["packing_fraction"], history["Z"] = [0.4, 0.5, 0.56], [10.0, 20.0, 50.0]
    dots = plots.compression(history, 0.64, 3).axes[0].lines[0].get_xdata()
    assert dots == pytest.approx(1.0 - np.array([0.4, 0.45, 0.53]) / 0.64, rel=1e-12)
    assert plots.compression(history, math.nan, 3).axes[0].lines[0].get_xdata() == pytest.approx(
        [0.4, 0.45, 0.53], rel=1e-12
    )


# Mixtures, walls and obstacles.


def three(dimension, periodic=None):
    """Return a small one between two large ones at the border."""
    places = np.full((3, dimension), 2.0)
    places[:, 0] = [0.2, 2.0, 3.9]
    found = frame(places, (4.0,) * dimension, [1.0, 0.5, 1.0], species=np.array([0, 1, 0]))
    return dataclasses.replace(found, periodic=periodic or (True,) * dimension)


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
    drawn = ellipses(plots.snapshot(three(2)))
    real = sorted((x, c) for _, x, c in drawn if 0 <= x < 4)
    assert [(round(x, 9), c) for x, c in real] == [(0.2, FACES[0]), (2.0, FACES[1]), (3.9, FACES[0])]
    sizes = {round(x, 9): w for w, x, _ in drawn}
    assert sizes[2.0] / sizes[0.2] == 0.5
    # Both large ones cross the border along x.
    assert sorted(round(x, 9) for _, x, _ in drawn if not 0 <= x < 4) == [-0.1, 4.2]


def test_nothing_comes_through_a_wall():
    figure = plots.snapshot(three(2, (False, True)))
    assert all(0 <= x < 4 for _, x, _ in ellipses(figure))
    thick = [c for c in figure.axes[0].collections if max(c.get_linewidth(), default=0) == 3.0]
    assert len(thick) == 1
    assert {tuple(path.vertices[:, 0]) for path in thick[0].get_paths()} == {(0.0, 0.0), (4.0, 4.0)}


def test_obstacles_are_drawn_to_scale_with_their_images():
    obstacles = [Ball((0.5, 1.0), 0.75), SphericalContainer((2.0, 2.0), 1.9), Plane((0.0, 2.0), 1.0)]
    figure = plots.snapshot(three(2, (True, False)), obstacles=obstacles)
    circles = sorted((p.radius, *p.center) for p in figure.axes[0].patches if isinstance(p, Circle))
    assert circles == [(0.75, -3.5, 1.0), (0.75, 0.5, 1.0), (0.75, 4.5, 1.0), (1.9, 2.0, 2.0)]
    (half_plane,) = (p for p in figure.axes[0].patches if type(p) is Polygon)
    assert half_plane.get_xy()[:, 1].max() == pytest.approx(0.5)
    tube = plots.snapshot(three(2, (True, False)), obstacles=[CylindricalContainer(0, (0.0, 2.0), 1.5)])
    assert [line.get_ydata()[0] for line in tube.axes[0].lines] == [0.5, 3.5]


def test_distances_of_all_pairs_are_in_the_largest_diameter():
    scene = mixture([60, 60], diameters=[1.0, 0.5], packing_fraction=0.2, seed=1)
    found = PartialRDF(scene).over([at_rest(scene)])
    lines = plots.partial_rdf(found).axes[0].lines[1:]
    assert sorted(line.get_xdata()[0] for line in lines) == pytest.approx([0.5, 0.75, 1.0], rel=1e-9)
