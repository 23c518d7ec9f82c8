"""Great circles: components on a sphere, beside the naive algorithm in 50 digits and the laws of motion."""

import itertools
import math

import numpy as np
import pytest
from helpers.goes_on import assert_goes_on
from helpers.marks import slow
from helpers.naive import great_circles as oracle

import carom
from carom.errors import InputError, OverlapError
from carom.models import SquareWell
from carom.models.motions.great_circles import GreatCircles, cosine_and_sine
from carom.scene.velocities import temperature
from carom.simulation.explanation import explain

EPS = float(np.finfo(float).eps)


def on_sphere(n, k=3, diameter=0.4, seed=0, **arguments):
    """Return n caps at random places, apart from each other."""
    rng = np.random.default_rng(seed)
    points = []
    while len(points) < n:
        x = rng.standard_normal(k)
        x /= np.linalg.norm(x)
        if all(np.linalg.norm(x - p) > 1.05 * diameter for p in points):
            points.append(x)
    return carom.Scene(
        4.0 + np.array(points), box=(8.0,) * k, diameter=diameter, motion=GreatCircles(), **arguments
    )


def arms(sim):
    """Return places about the center of the sphere."""
    return sim.frame().positions - 4.0


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("growth", [None, slow(0.02)])
def test_contacts_are_those_of_the_naive_algorithm_in_fifty_digits(growth):
    sim = carom.Simulation(on_sphere(5), seed=2, growth=growth)
    start = sim.frame()
    steps = oracle.caps(start.positions - 4.0, start.velocities, 0.4, growth=growth or 0.0)
    for k, step in enumerate(itertools.islice(steps, 10)):
        sim.run(collisions=1)
        assert sim.collisions == k + 1
        # Rounding begins at some eps. Between two contacts of one cap it grows by some free paths over the
        # diameter, less than ten: five caps share the contacts, so it is 10^(2 / 5) a contact.
        tolerance = 64 * EPS * 10 ** (0.4 * k)
        assert abs(sim.time - float(step.time)) < tolerance * (1.0 + sim.time)
        found = arms(sim)
        assert np.abs(found - np.array(step.positions, float)).max() < 10 * tolerance


@pytest.mark.slow
def test_energy_and_angular_momentum_are_kept_and_nobody_leaves_the_sphere():
    sim = carom.Simulation(on_sphere(8, seed=3, mass=np.linspace(0.5, 2.0, 8)), seed=3)

    def spin():
        frame = sim.frame()
        return np.sum(frame.masses[:, None] * np.cross(arms(sim), frame.velocities), axis=0)

    before = spin()
    sim.run(collisions=5000)
    # A random walk of roundings: sqrt(5000) eps, with some room.
    assert sim.statistics.energy_drift < 1e4 * EPS
    assert np.abs(spin() - before).max() < 1e5 * EPS
    assert np.abs(np.linalg.norm(arms(sim), axis=1) - 1.0).max() < 8 * EPS
    out = np.einsum("ij,ij->i", arms(sim), sim.frame().velocities)
    assert np.abs(out).max() < 64 * EPS
    assert sim.statistics.worst_overlap < 1e-12


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("growth", [None, 0.02])
def test_on_a_sphere_of_twice_the_radius_all_ways_and_times_are_twice_as_long(growth):
    unit = on_sphere(5)
    wide = carom.Scene(2.0 * unit.positions, box=(16.0,) * 3, diameter=0.8, motion=GreatCircles(2.0))
    one, other = (carom.Simulation(scene, seed=2, growth=growth) for scene in (unit, wide))
    for sim in (one, other):
        sim.run(collisions=10)
    assert other.packing_fraction == pytest.approx(one.packing_fraction, rel=8 * EPS)
    assert other.time == 2.0 * one.time
    assert (other.positions == 2.0 * one.positions).all()
    assert (other.velocities == one.velocities).all()


def test_caps_have_a_degree_of_freedom_for_every_direction_on_the_sphere_and_no_fewer():
    # Collisions keep no momentum on a sphere: a single cap has (d - 1) kT = m v^2.
    for k in (2, 3, 4):
        place, speed = np.full((1, k), 4.0), np.zeros((1, k))
        place[0, 0], speed[0, 1] = 5.0, 3.0
        scene = carom.Scene(place, box=(8.0,) * k, diameter=0.2, mass=2.0, motion=GreatCircles())
        assert temperature(scene, speed) == pytest.approx(2.0 * 9.0 / (k - 1), rel=EPS)


def test_caps_cover_their_part_of_a_sphere_in_any_dimension():
    angle = math.asin(0.4)
    parts = {2: angle, 3: 0.5 * math.pi * (1.0 - math.cos(angle)), 4: angle - 0.5 * math.sin(2.0 * angle)}
    for k, part in parts.items():
        found = GreatCircles(2.0).packing_fraction(np.array([1.6, 1.6]), (16.0,) * k)
        assert found == pytest.approx(2.0 * part / math.pi, rel=1e-13)


def test_two_points_on_one_great_circle_swap_their_speeds(plain):
    scene = carom.Scene(
        [[5.0, 4.0, 4.0], [4.0, 5.0, 4.0]], box=8.0, diameter=0.2,
        velocities=[[0.0, 1.0, 0.0], [0.0, 0.0, 0.0]], motion=GreatCircles(),
    )  # fmt: skip
    sim = carom.Simulation(scene, seed=0)
    touch = math.pi / 2 - 2.0 * math.asin(0.1)
    sim.run(collisions=1)
    assert sim.time == pytest.approx(touch, rel=8 * EPS)
    speeds = np.linalg.norm(sim.frame().velocities, axis=1)
    assert speeds == pytest.approx([0.0, 1.0], abs=16 * EPS)
    sim.run(collisions=1)  # the other way round the sphere
    assert sim.time == pytest.approx(touch + 2 * math.pi - 4.0 * math.asin(0.1), rel=8 * EPS)


@pytest.mark.usefixtures("both_ways")
def test_a_run_goes_on_from_a_checkpoint_and_from_its_log(tmp_path):
    assert_goes_on(on_sphere(8, seed=5), tmp_path, 45)


@pytest.mark.slow
def test_growth_is_resumed_bit_for_bit(tmp_path):
    sim = carom.Simulation(on_sphere(8, diameter=0.2, seed=5), seed=1, growth=0.01)
    sim.run(collisions=300)
    sim.save(tmp_path / "growing.h5")
    again = carom.Simulation.load(tmp_path / "growing.h5")
    for each in (sim, again):
        each.run(collisions=300)
    assert (again.frame().positions == sim.frame().positions).all()
    assert (again.diameters == sim.diameters).all()
    assert sim.packing_fraction == pytest.approx(8 * 0.5 * (1 - math.sqrt(1 - 0.25 * sim.diameters[0] ** 2)))


@pytest.mark.usefixtures("both_ways")
def test_caps_at_rest_grow_until_they_touch():
    # Two a quarter of a great circle apart, and one far from both that moves.
    places = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-math.sqrt(0.5), -math.sqrt(0.5), 0.0]]
    speeds = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.01]]
    scene = carom.Scene(
        4.0 + np.array(places), box=(8.0,) * 3, diameter=0.4, velocities=speeds, motion=GreatCircles()
    )
    sim = carom.Simulation(scene, growth=0.25, seed=0)
    sim.run(collisions=1)
    assert sim.time == pytest.approx((math.sqrt(2.0) - 0.4) / 0.25, rel=16 * EPS)


def test_cosine_and_sine_are_right_to_the_last_digit():
    angles = np.concatenate([np.linspace(-40.0, 40.0, 4001), np.pi / 4 * np.arange(-20, 21), [1e5]])
    for angle in angles:
        c, s = cosine_and_sine(angle)
        assert abs(c - math.cos(angle)) <= EPS
        assert abs(s - math.sin(angle)) <= EPS


@pytest.mark.slow
def test_in_the_dilute_limit_collisions_come_at_the_rate_of_kinetic_theory():
    n, sigma, count = 24, 0.02, 20_000
    sim = carom.Simulation(on_sphere(n, diameter=sigma, seed=7), seed=7)
    block = sim.run(collisions=count)
    # N (N - 1) / 2 pairs on an area of 4 pi, each sweeping a width of 2 sigma at a mean relative speed of
    # sqrt(pi kT / m). Of the 2 n coordinates of velocity three are a common rotation, which meets nobody:
    # 1.5 / n of the speed, if it has nothing or twice its share. Counts scatter by 0.7 %.
    rate = 0.5 * n * (n - 1) * 2.0 * sigma * math.sqrt(math.pi * sim.kT) / (4.0 * math.pi)
    assert count / block.duration == pytest.approx(rate, rel=1.5 / n + 3.0 / math.sqrt(count))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"box": 4.0}, "needs edges of more than 4"),
        ({"positions": [[5.0, 4.0, 4.0], [4.0, 5.2, 4.0]]}, "Component 1 is 1.2 from the middle"),
        ({"velocities": [[0.1, 1.0, 0.0], [0.0, 0.0, 1.0]]}, "velocity of component 0 points out"),
        ({"walls": "z"}, "components meet no walls or obstacles"),
    ],
)
def test_what_does_not_fit_on_the_sphere_is_refused_in_a_sentence(change, sentence):
    given = {"positions": [[5.0, 4.0, 4.0], [4.0, 5.0, 4.0]], "box": 8.0, "diameter": 0.2, **change}
    if change.get("box"):
        given["positions"] = [[3.0, 2.0, 2.0], [2.0, 3.0, 2.0]]
    with pytest.raises(InputError, match=sentence):
        carom.Scene(motion=GreatCircles(), **given)


def test_what_a_sphere_cannot_have_is_refused_in_a_sentence():
    scene = on_sphere(4)
    with pytest.raises(InputError, match="use neighbors='auto'"):
        carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"), seed=0)
    with pytest.raises(InputError, match="precision='single' is for straight flight"):
        carom.Simulation(scene, tuning=carom.Tuning(precision="single"), seed=0)
    with pytest.raises(InputError, match="radius of the sphere"):
        GreatCircles(0.0)
    with pytest.raises(InputError, match="two dimensions or more"):
        carom.Scene([[5.0]], box=8.0, diameter=0.1, motion=GreatCircles())
    with pytest.raises(InputError, match="hard cores meet, found the interaction SquareWell"):
        scene.replace(interaction=SquareWell(1.5, 1.0))
    with pytest.raises(OverlapError):
        scene.replace(diameter=1.9)


def test_a_plain_scene_is_told_nothing_of_spheres():
    found = explain(on_sphere(4))
    assert found.models["motion"] == "Circles"
    assert found.neighbors.startswith("all pairs")
    plain = explain(carom.Scene.crystal(cells=2, packing_fraction=0.3))
    assert "Circles" not in plain.models.values()
