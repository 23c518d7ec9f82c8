"""Many obstacles are looked up in cells: the same events as where each is asked, to the last bit."""

import numpy as np
import pytest
from helpers.oracle_scenes import assert_no_overlap

import carom
from carom.engine import obstacles
from carom.engine.obstacle_grid import Spheres, in_reach
from carom.models import Arc, Ball, Cuboid, Plane, Segment, SphericalContainer, Triangle, polygon
from carom.simulation import run_loop


def scattered(count, edge, d, radius):
    places = np.random.default_rng(5).uniform(0.0, edge, (count, d))
    return [Ball(tuple(x), radius * (1.0 + 0.1 * k)) for k, x in enumerate(places)]


def line():
    return carom.Scene([[1.0], [3.5], [6.2], [8.0]], 12.0, velocities=[[1.0], [-0.7], [0.3], [-1.2]],
                       obstacles=[Ball((2.2,), 0.1), Ball((5.0,), 0.2), Ball((11.0,), 0.3)])  # fmt: skip


def plane(**keywords):
    balls = scattered(9, 6.0, 2, 0.2)
    return carom.Scene.random(8, box=(6.0, 7.0), diameter=0.5, seed=3, obstacles=balls, **keywords)


def still():
    # Each at rest, in the cell beside that of a ball into which it will grow.
    places = [(x, y) for x in (2.0, 4.0) for y in np.arange(0.5, 6.0)]
    balls = [Ball((x - 0.25, y), 0.1 + 0.002 * k) for k, (x, y) in enumerate(places)]
    return carom.Scene(np.add(places, [0.1, 0.0]), (6.0, 6.0), diameter=0.1, obstacles=balls,
                       velocities=np.zeros((12, 2)))  # fmt: skip


def tiny():
    return carom.Scene([[1.3, 1.2]], (2.9, 2.7), velocities=[[1.0, 0.37]], diameter=1.0,
                       obstacles=[Ball((0.0, 2.6), 0.2), Ball((2.8, 0.2), 0.15)])  # fmt: skip


def table():
    corners = [(4.5 + 3.9 * np.cos(q), 4.5 + 3.9 * np.sin(q)) for q in np.linspace(0.3, 5.0, 14)]
    bodies = [
        *polygon(corners, closed=False), Arc((7.0, 4.0), 0.7, 20.0, 250.0), Arc((4.2, 1.0), 0.5),
        Cuboid((6.0, 7.0), (6.5, 7.8)), Cuboid((3.5, 7.0), (3.9, 7.4), radius=0.1),
        Triangle((7.0, 6.0), (7.8, 6.2), (7.5, 6.6)), Triangle((2.0, 4.0), (2.3, 4.2), (2.1, 4.6)),
        Plane((1.0, 1.0), 1.0), Ball((0.5, 4.5), 0.3), Ball((2.0, 6.0), 0.2),
    ]  # fmt: skip
    return carom.Scene.random(7, box=(9.0, 9.0), diameter=0.6, seed=2, walls=True, obstacles=bodies)


def space():
    bodies = [*scattered(6, 4.0, 3, 0.2), SphericalContainer((2.0,) * 3, 3.2),
              Segment((1.0,) * 3, (1.5,) * 3), Segment((3.0,) * 3, (2.6,) * 3, 0.1)]  # fmt: skip
    return carom.Scene.random(6, box=(4.0,) * 3, diameter=0.5, seed=2, walls=True, obstacles=bodies)


SCENES = {
    "line": (line, "auto", {}),
    "sectors": (plane, "sectors", {}),
    "lists": (plane, "lists", {}),
    "walls": (lambda: plane(walls="y"), "auto", {}),
    "growth": (plane, "sectors", {"growth": 0.01}),
    "growth in lists": (plane, "lists", {"growth": 0.01}),
    "growth at rest": (still, "sectors", {"growth": 0.2}),
    "tiny": (tiny, "auto", {}),
    "table": (table, "auto", {}),
    "space": (space, "auto", {}),
}


@pytest.mark.parametrize("name", SCENES)
def test_events_are_those_of_a_scene_whose_obstacles_are_all_asked(plain, monkeypatch, name):
    make, neighbors, settings = SCENES[name]
    scene, time, found = make(), 30.0 if name == "tiny" else 4.0, []
    monkeypatch.setattr(run_loop, "CYCLES", 200)
    for crowd in (2, 1000):
        monkeypatch.setattr(obstacles, "CROWD_FROM", crowd)
        sim = carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors=neighbors), **settings)
        for frame in sim.sample(every=time / 4, count=4):
            assert_no_overlap(scene, frame)
        links, grids = sim._state.engine.model.obstacles.chain, 0
        while hasattr(links, "tail"):
            grids += getattr(links, "grid", None) is not None
            links = links.tail
        assert (grids >= 1) == (crowd == 2)
        hits = [impacts.hits for impacts in sim.obstacles]
        found.append((frame.positions.tobytes(), frame.velocities.tobytes(), hits, sim.collisions))
    assert found[0] == found[1]
    assert sum(hits) > 5


def test_who_grows_or_flies_into_a_sphere_before_a_time_is_in_reach_and_few_others_are():
    rng = np.random.default_rng(2)
    outcomes, times = {True: 0, False: 0}, np.linspace(0.0, 1.0, 401)
    for _ in range(2000):
        growth, until = rng.uniform(0.0, 1.0), rng.uniform(0.1, 5.0)
        x, v = rng.uniform(-4.0, 4.0, 2), rng.normal(size=2)
        paths = x + until * times[:, None] * v
        least = (np.linalg.norm(paths, axis=1) - 1.0 - growth * until * times).min()
        found = bool(in_reach(Spheres(np.zeros((1, 2)), np.array([0.7])), 0, x, v, 0.3, growth, until))
        assert found or least > 0.0
        slow = np.linalg.norm(v) <= growth  # of whom it is not asked
        assert not found or slow or least < until / 400 * (np.linalg.norm(v) + growth)
        outcomes[found] += 1
    assert min(outcomes.values()) > 400
