"""Shapes that stand in the way: segments, polygons, arcs, boxes and triangles."""

import math

import numpy as np
import pytest

import carom
from carom.errors import InputError, OverlapError
from carom.models import Arc, Ball, Cuboid, CylindricalContainer, Loss, Segment, Sine, Triangle, polygon
from carom.models.files.tables import from_table, obstacle_to_table
from carom.models.interfaces.particles import NEVER
from carom.models.obstacles import outwards
from carom.models.obstacles.with_properties import Shaken, Surface

EPS = np.finfo(float).eps


def shapes(dimension):
    """Return one of each that there is in a dimension."""
    rng = np.random.default_rng(dimension)
    a, b, c = rng.normal(size=(3, dimension))
    found = [
        Segment(tuple(a), tuple(b)),
        Segment(tuple(a), tuple(b), radius=0.4),
        Ball(tuple(a), 0.4),
        Cuboid(tuple(np.minimum(a, b) - 0.1), tuple(np.maximum(a, b) + 0.1)),
        Cuboid(tuple(np.minimum(a, b) - 0.1), tuple(np.maximum(a, b) + 0.1), radius=0.3),
    ]
    if dimension > 1:
        found += [Triangle(tuple(a), tuple(b), tuple(c)), Triangle(tuple(a), tuple(b), tuple(c), radius=0.2)]
    if dimension == 2:
        found += [Arc((0.1, 0.2), 1.3, start=30.0, angle=angle) for angle in (40.0, 180.0, 300.0, 360.0)]
    return found


CASES = [pytest.param(d, k, id=f"{d}D {s.name} {k}") for d in (1, 2, 3, 4) for k, s in enumerate(shapes(d))]


@pytest.mark.parametrize(("dimension", "k"), CASES)
@pytest.mark.parametrize(("growth", "far"), [(0.0, 4.0), (0.07, 4.0), (0.07, 1e4)])
def test_the_first_contact_is_found_and_none_before_it(dimension, k, growth, far):
    # A path is looked at in steps of a hundredth, and the distance at the contact computed apart, by `gap`.
    shape = shapes(dimension)[k]
    model, rng = shape.model(), np.random.default_rng(7)
    box, periodic = (100.0,) * dimension, (False,) * dimension
    met, rounding = 0, 0.25e-12 * far
    for _ in range(25):
        x = rng.normal(size=dimension)
        x *= far / np.linalg.norm(x)
        v = rng.normal(size=dimension) * 0.5 - 0.4 * x
        radius = float(rng.choice([1e-3, 0.2, 0.8]))

        def gap(t, x=x, v=v, radius=radius):
            times = np.atleast_1d(t)
            places = x + np.multiply.outer(times, v)
            return shape.gap(places, radius + growth * times, box, periodic)

        if gap(0.0)[0] <= 0.0:
            continue
        t = model.encounter(tuple(x), tuple(v), radius, growth)
        end = 8.0 if t == NEVER else t
        # 64 roundings of a coordinate, over the slope at which a graze meets.
        assert (gap(np.linspace(0.0, end, 101)[:-1]) > -rounding).all()
        if t < NEVER:
            met += 1
            assert abs(gap(t)[0]) < rounding
            normal = np.array([model.outward(tuple(x + v * t), axis) for axis in range(dimension)])
            assert normal @ normal == pytest.approx(1.0, rel=1e-12)
            assert normal @ v < growth + 1e-6  # it approaches
            h = 1e-6  # the normal is the slope of the distance
            slope = [
                (shape.gap((x + v * t + h * e)[None], np.zeros(1), box, periodic)
                 - shape.gap((x + v * t - h * e)[None], np.zeros(1), box, periodic))[0] / (2 * h)
                for e in np.eye(dimension)
            ]  # fmt: skip
            if radius > 0.1:  # nearer to an end than h, no slope is seen
                np.testing.assert_allclose(normal, slope, atol=1e-4)
            bounced = v - 2.0 * (normal @ v - growth) * normal
            again = model.encounter(tuple(x + v * t), tuple(bounced), radius + growth * t, growth)
            assert again > 1e-9  # condition V: it does not meet the same surface at once
    assert met > 1


@pytest.mark.parametrize("start", [-350.0, -100.0, -10.0, 0.0, 80.0, 200.0, 350.0])
@pytest.mark.parametrize("angle", [20.0, 100.0, 200.0, 300.0])
def test_the_extent_of_an_arc_is_that_of_all_its_points(start, angle):
    low, high = Arc((5.0, 4.0), 2.0, start, angle).extent()
    on = np.radians(np.linspace(start, start + angle, 10_001))
    points = np.array([5.0, 4.0]) + 2.0 * np.stack([np.cos(on), np.sin(on)], axis=1)
    # Between two points the arc rises by 2 (1 - cos h), with h of at most 3e-4.
    np.testing.assert_allclose(low, points.min(axis=0), atol=1e-7)
    np.testing.assert_allclose(high, points.max(axis=0), atol=1e-7)


@pytest.mark.slow
def test_a_sphere_in_an_arc_goes_round_by_whispering():
    # A component in a whole circle, from inside: chords of one length, for ever.
    ring = Arc((5.0, 5.0), 4.0)
    scene = carom.Scene(
        [[5.0, 2.0]], 10.0, diameter=0.5, velocities=[[1.0, 0.3]], walls=True, obstacles=[ring]
    )
    sim = carom.Simulation(scene, seed=0)
    sim.run(time=2000.0)
    (hits,) = [impacts.hits for impacts in sim.obstacles if impacts.name == "arc"]
    x, v, r = np.array([0.0, -3.0]), np.array([1.0, 0.3]), 3.75
    moment = abs(x[0] * v[1] - x[1] * v[0]) / math.hypot(*v)
    chord = 2.0 * math.sqrt(r * r - moment * moment)
    assert hits == pytest.approx(2000.0 * math.hypot(*v) / chord, abs=1.0)
    frame = sim.frame()
    place, speed = frame.positions[0] - 5.0, frame.velocities[0]
    # Angular momentum and energy: a thousand bounces of some roundings each.
    assert abs(place[0] * speed[1] - place[1] * speed[0]) == pytest.approx(moment * math.hypot(*v), rel=1e-10)
    assert sim.statistics.energy_drift < 1e-12


@pytest.mark.slow
def test_many_shapes_in_two_dimensions_let_nobody_through():
    obstacles = [
        *polygon([(4.0, 4.0), (8.0, 4.5), (6.0, 8.0)], name="house"),
        Segment((10.0, 2.0), (13.0, 5.0), radius=0.3, name="stick"),
        Cuboid((2.0, 10.0), (4.0, 12.0), name="block"),
        Triangle((11.0, 10.0), (13.0, 10.0), (12.0, 12.5), radius=0.2, name="wedge"),
        Arc((8.0, 12.0), 1.5, start=180.0, angle=200.0, name="bowl"),
    ]
    start = carom.Scene.random(30, dimension=2, packing_fraction=0.1, seed=3, walls=True, obstacles=obstacles)
    sim = carom.Simulation(start, seed=1)
    # Within the walls of the house nobody starts: whoever is inside later has gone through a wall.
    from matplotlib.path import Path

    house = Path([(4.0, 4.0), (8.0, 4.5), (6.0, 8.0)])
    inside = house.contains_points(start.positions)
    for frame in sim.sample(every=2.0, count=150):
        for obstacle in obstacles:
            gaps = obstacle.gap(frame.positions, 0.5 * frame.diameters, frame.box, frame.periodic)
            assert gaps.min() > -1e-12
        assert (house.contains_points(frame.positions) == inside).all()
    assert sim.statistics.energy_drift < 1e-12
    assert all(impacts.hits > 5 for impacts in sim.obstacles if impacts.name != "axis")
    again = [from_table(obstacle_to_table(obstacle), "obstacle") for obstacle in obstacles]
    assert again == obstacles


@pytest.mark.slow  # a minute of compilation
def test_solids_in_three_dimensions_stand_in_every_image():
    obstacles = [
        Cuboid((0.2, 0.2, 0.2), (2.0, 1.5, 1.0), name="block"),
        Segment((6.0, 6.0, 6.0), (7.5, 8.0, 6.5), radius=0.5, name="capped cylinder"),
        Triangle((3.0, 7.0, 3.0), (5.0, 7.5, 3.5), (4.0, 9.0, 5.0), name="facet"),
    ]
    sim = carom.Simulation(carom.Scene.random(60, 0.03, seed=2, obstacles=obstacles), seed=1)
    for frame in sim.sample(every=1.0, count=60):
        for obstacle in obstacles:
            gaps = obstacle.gap(frame.positions, 0.5 * frame.diameters, frame.box, frame.periodic)
            assert gaps.min() > -1e-12
    assert sim.statistics.energy_drift < 1e-12
    assert all(impacts.hits > 5 for impacts in sim.obstacles)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Segment((0.0, 0.0), (0.0, 0.0)), "must differ"),
        (lambda: Segment((0.0, 0.0), (1.0,)), "one number of coordinates"),
        (lambda: Segment((0.0, 0.0), (1.0, 0.0), radius=-1.0), "radius of a segment"),
        (lambda: Cuboid((0.0, 0.0), (1.0, 0.0)), "below high"),
        (lambda: Triangle((0.0, 0.0), (1.0, 1.0), (2.0, 2.0)), "on a line"),
        (lambda: Arc((0.0, 0.0), 1.0, angle=0.0), "angle of an arc"),
        (lambda: Arc((0.0, 0.0), 1.0, angle=400.0), "angle of an arc"),
        (lambda: polygon([(0.0, 0.0), (1.0, 0.0)]), "three corners"),
        (lambda: CylindricalContainer(2, (1.0, 1.0), 1.0), "axis of a cylinder must be"),
        (lambda: Cuboid((0.0, 0.0), (1.0, 1.0)).check((3.0, 3.0, 3.0), (False,) * 3), "3 coordinates"),
        (lambda: Cuboid((0.0, 0.0), (2.0, 1.0)).check((3.0, 3.0), (True, True)), "fit into half"),
        *(
            (lambda body=body: body.check((3.0, 9.0), (True, True)), "1.6 wide along x.*fit into half")
            for body in (
                Segment((0.0, 0.0), (1.0, 0.0), radius=0.3),
                Triangle((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), radius=0.3),
                Cuboid((0.0, 0.0), (1.0, 1.0), radius=0.3),
            )
        ),
        (lambda: Arc((1.0, 2.0), 1.5).check((4.0, 4.0), (True, False)), "crosses the edge"),
        (lambda: Arc((1.0, 2.0, 3.0), 1.5).check((4.0, 4.0, 4.0), (False,) * 3), "two dimensions"),
    ],
)
def test_what_cannot_stand_is_refused(make, says):
    with pytest.raises(InputError, match=says):
        make()


def test_an_arc_stands_in_every_image():
    # A disk of diameter 1 at 9.8 is at -0.2, 0.25 inside the circle; at 9.5 it would touch it at 10.05.
    arc = Arc((1.05, 5.0), 1.0)
    for angle in (360.0, 300.0):
        with pytest.raises(OverlapError, match="inside an obstacle, arc"):
            carom.Scene([[9.8, 5.0]], 10.0, obstacles=[Arc((1.05, 5.0), 1.0, start=30.0, angle=angle)])
    gaps = arc.gap(np.array([[9.5, 5.0], [2.6, 5.0]]), np.full(2, 0.5), (10.0, 10.0), (True, True))
    np.testing.assert_allclose(gaps, [0.05, 0.05], rtol=1e-13)
    assert arc.model().is_periodic()
    normals = outwards(arc, np.array([[9.55, 5.0], [2.55, 5.0]]), (10.0, 10.0), (True, True))
    np.testing.assert_allclose(normals, [[-1.0, 0.0], [1.0, 0.0]], atol=EPS)
    # A quarter of a circle: its images are told apart by its middle, not by the center of the circle.
    quarter = Arc((5.0, 5.0), 4.5, start=-45.0, angle=90.0)
    x = np.array([[0.2, 5.0]])
    assert quarter.gap(x, np.full(1, 0.5), (10.0, 10.0), (True, True)) == pytest.approx(0.2)
    assert outwards(quarter, x, (10.0, 10.0), (True, True))[0] == pytest.approx([1.0, 0.0], abs=EPS)


def test_a_triangle_is_told_from_its_image_by_the_middle_of_its_widths():
    # Its tip reaches twice as far from the centroid as its side: a disk of radius 2.4 touches the tip there.
    wedge = Triangle((2.0, 3.0), (2.0, 7.0), (7.0, 5.0))
    touching = np.array([[9.4, 5.0]])
    assert wedge.gap(touching, np.full(1, 2.4), (10.0, 10.0), (True, True)) == pytest.approx(0.0, abs=1e-14)
    assert outwards(wedge, touching, (10.0, 10.0), (True, True))[0] == pytest.approx([1.0, 0.0], abs=EPS)


@pytest.mark.parametrize(
    "obstacle",
    [
        Segment((2.5, 2.5), (7.5, 7.5)),
        Arc((5.0, 5.0), 2.5, angle=200.0),
        Surface(Segment((2.5, 2.5), (7.5, 7.5)), Loss(0.9, contact_time=1e-3)),
        Shaken(Ball((5.0, 5.0), 1.0), (1.0, 1.0), Sine(2.4, period=1.0)),
    ],
    ids=["segment", "arc", "surface", "shaken"],
)
def test_a_shape_too_wide_to_tell_its_images_apart_is_refused(obstacle):
    # The disk touches the far end of the segment 6.5 from its middle: the nearest image would be another one.
    with pytest.raises(InputError, match="room for the largest diameter"):
        carom.Scene([[0.5, 5.0]], 10.0, diameter=8.0, obstacles=[obstacle])


def test_what_is_given_boxes_away_is_met_where_its_image_in_the_box_is(plain):
    found = []
    for turns in ((0, 0), (1, 0), (-2, 3)):

        def at(x, y, turns=turns):
            return x + 8.0 * turns[0], y + 8.0 * turns[1]

        obstacles = [
            Ball(at(2.0, 2.0), 0.7),
            Segment(at(5.0, 2.0), at(6.5, 3.0), radius=0.2),
            Cuboid(at(2.0, 5.0), at(4.0, 6.0)),
            Triangle(at(5.5, 5.0), at(7.0, 5.0), at(6.0, 6.5)),
        ]
        scene = carom.Scene([[0.5, 0.5], [4.2, 4.0], [5.0, 7.5]], 8.0, diameter=0.5, obstacles=obstacles)
        sim = carom.Simulation(scene, seed=1)
        sim.run(time=8.0)
        found.append(([each.hits for each in sim.obstacles], sim.frame().unwrapped))
    hits, places = found[0]
    assert min(hits) > 0
    for others, there in found[1:]:
        assert others == hits
        assert there == pytest.approx(places, abs=1e-6)  # each contact magnifies rounding
