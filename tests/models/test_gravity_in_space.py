"""Gravity in three and four dimensions: the floor's balance, the barometric law; energy at what is round."""

import math
from fractions import Fraction

import numpy as np
import pytest
from helpers.round_things import around_a_ball

import carom
from carom.models import Gravity, Loss, Plane
from carom.models.motions.gravity import Falling
from carom.models.obstacles.containers import Inside
from carom.models.obstacles.named_walls import axes_without
from carom.simulation.replay import Replay


def column(dimension, n, restitution, *, diameter=0.3, edge=6.0, height=60.0, kT=2.0):
    """Return spheres over a floor, in a box that repeats sideways, at the heights of the barometric law."""
    rng = np.random.default_rng(dimension)
    per_side = math.ceil(n ** (1 / dimension)) + 1
    grid = np.stack(np.meshgrid(*[np.arange(per_side)] * dimension, indexing="ij"), -1).reshape(-1, dimension)
    places = (grid[rng.permutation(len(grid))[:n]] + 0.5) * (edge / per_side)
    places[:, -1] = places[:, -1] / edge * 3.0 * kT + 0.5
    loss = Loss(restitution, contact_time=1e-2)  # what lies on the floor hops 2 / t_c times a time
    return carom.Scene(
        places,
        (*[edge] * (dimension - 1), height),
        diameter=diameter,
        velocities=rng.normal(size=(n, dimension)) * math.sqrt(kT),
        walls=axes_without((*[True] * (dimension - 1), False)),
        motion=Gravity((*[0.0] * (dimension - 1), -1.0)),
        obstacles=[Plane((*[0.0] * (dimension - 1), 1.0), 0.2, "floor", impact=loss)],
        impact=loss,
    )


@pytest.mark.slow
@pytest.mark.parametrize("dimension", [3, 4])
def test_the_floor_bears_the_weight_of_spheres_that_lose_energy(dimension):
    n = 40
    scene = column(dimension, n, 0.8)
    sim = carom.Simulation(scene, seed=0)
    sim.run(time=60.0)
    gained = sim.frame().velocities[:, -1].sum() - scene.velocities[:, -1].sum()
    pushed = sum((-1.0 if "upper" in each.name else 1.0) * each.impulse for each in sim.obstacles)
    # Exact at any restitution and density; sums of some 1e5 rounded impulses.
    assert math.isclose(pushed, n * 60.0 + gained, rel_tol=1e-11)
    (floor,) = (each for each in sim.obstacles if each.name == "floor")
    assert floor.hits > 500
    assert sim.frame().positions[:, -1].min() > 0.2 + 0.15 - 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("dimension", [3, 4])
def test_a_column_shares_its_energy_as_the_barometric_law_says(dimension):
    """A nearly ideal gas over a floor at constant energy: U is 1 / (d / 2 + 1) of it, exactly for any N."""
    n = 40
    scene = column(dimension, n, 1.0, edge=3.0)
    sim = carom.Simulation(scene, seed=0)
    sim.run(collisions_per_particle=100)
    floor = 0.2 + 0.15
    parts = []
    for frame in sim.sample(every=4.0, count=600):
        height = frame.positions[:, -1].sum() - n * floor
        kinetic = 0.5 * float((frame.velocities**2).sum())
        parts.append(height / (height + kinetic))
    assert sim.statistics.energy_drift < 1e-12
    parts = np.array(parts).reshape(20, 30).mean(axis=1)  # blocks longer than a free flight
    error = parts.std(ddof=1) / math.sqrt(len(parts))
    # Spheres lift each other: of the order of N v / (A H), the part of the volume that they take.
    lifted = n * math.pi / 6.0 * 0.3**3 / (9.0 * 2.0)
    assert abs(parts.mean() - 1.0 / (0.5 * dimension + 1.0)) < 4.0 * error + 0.4 * 4.0 * lifted


def test_bounces_on_a_circle_keep_their_energy_on_average():
    """Contacts just outside of 4 from the center: unit normals are all rounded alike there, and too long."""
    rng = np.random.default_rng(4)
    motion, body = Falling((0.0, -1.0), 1e-9), Inside(-1, (5.0, 5.0), 4.5)
    plain, even = [], []
    for _ in range(4000):
        turn, far = rng.uniform(0.0, 2.0 * math.pi), 4.0 + rng.uniform(0.0, 2.0**-51)
        x = (5.0 + far * math.cos(turn), 5.0 + far * math.sin(turn))
        normal = [body.outward(x, axis) for axis in (0, 1)]
        if math.hypot(x[0] - 5.0, x[1] - 5.0) < 4.0:
            continue
        v = rng.normal(size=2).tolist()
        change = motion.rebound_speed(-(normal[0] * v[0] + normal[1] * v[1]))
        if change <= 1.0:  # it flies off, or grazes
            continue
        pushed = list(v)
        motion.push(change, pushed, normal)
        for gains, after in (
            (plain, [a + change * b for a, b in zip(v, normal, strict=True)]),
            (even, pushed),
        ):
            gain = sum(Fraction(a) ** 2 for a in after) - sum(Fraction(a) ** 2 for a in v)
            gains.append(float(gain) / (v[0] ** 2 + v[1] ** 2))
    assert len(even) > 500
    # Five standard errors of roundings at random.
    assert abs(np.mean(even)) < 5.0 * np.std(even) / math.sqrt(len(even))
    assert np.mean(plain) > 10.0 * np.std(even) / math.sqrt(len(even))


@pytest.mark.parametrize("turn", [0.1, 0.7, 1.9, 4.0])
def test_what_a_wall_adds_does_not_depend_on_how_nearly_one_glides_along_it(turn):
    """A wall in motion pushes what flies along it: a normal velocity that is all rounding scales nothing."""
    normal = (math.cos(turn), math.sin(turn))
    v = [-1e6 * normal[1], 1e6 * normal[0]]
    Falling((0.0, -1.0), 1e-9).push(1.0, v, normal)
    assert v[0] * normal[0] + v[1] * normal[1] == pytest.approx(1.0, abs=1e6 * 2.0**-50)
    assert v[1] * normal[0] - v[0] * normal[1] == pytest.approx(1e6, rel=2.0**-50)


def test_bounces_on_round_things_in_a_field_are_replayed_bit_for_bit(plain, tmp_path):
    log = tmp_path / "log.h5"
    with carom.Simulation(around_a_ball(), event_log=log, seed=0) as sim:
        sim.run(time=150.0)
        frame = sim.frame()
        assert min(sim.obstacles[4].hits, sim.obstacles[5].hits) > 10
    run = Replay(log)
    run.advance_to(150.0)
    assert (run.frame().positions == frame.positions).all()
    assert (run.frame().velocities == frame.velocities).all()
