"""Small scenes of every kind beside the oracle, event by event.

The state between every two events is compared, not a log of them: it holds for diameters that grow, too, and
equal velocities before and after mean equal partners.
"""

from typing import Any, NamedTuple

import numpy as np

import carom
from carom.models import Ball, CylindricalContainer, Plane, SphericalContainer
from carom.models.contacts.restitution import Restitution
from carom.models.obstacles.named_walls import axes_without
from carom.simulation.measuring import stretches
from helpers.mixtures import mixture
from helpers.oracle import EPS, NUDGE, ROUNDINGS, moving, oracle_of

PER_PARTICLE = 10

# A comparison goes on to where rounding, amplified, moves a place by this part of the box.
BLURRED = 1e-4


class Case(NamedTuple):
    """A scene with velocities, how it is simulated, and what must be comparable of it."""

    scene: carom.Scene
    settings: dict[str, Any]
    count: int
    """Events to look at."""
    at_least: int
    """Of these must come before rounding hides them."""


class Trajectory(NamedTuple):
    """An oracle's events, and its exact state in the middle between each of them and the next."""

    events: list
    times: np.ndarray
    positions: np.ndarray
    """Without wrapping, (events, n, d)."""
    velocities: np.ndarray
    sums: tuple
    """Virial, and the impulses of walls and obstacles, after each event."""


def trajectory(system, count, times=None):
    """Return what happens to an oracle; between events its components fly straight."""
    following = iter(system)
    events, after = [next(following)], []
    while len(after) < count:
        sums = system.virial, system.impulses.copy()
        after.append((system.time, system.positions, system.velocities, sums))
        events.append(next(following))
    instants = np.array([float(event.time) for event in events])
    times = 0.5 * (instants[1:] + instants[:-1]) if times is None else times
    positions = [x + v * (time - now) for time, (now, x, v, _) in zip(times, after, strict=True)]
    _, _, velocities, sums = zip(*after, strict=True)
    return Trajectory(events[:-1], times, np.array(positions), np.array(velocities), sums)


def check(case, neighbors):
    """Run engine and oracle side by side; return how many events could be compared."""
    scene, growth = case.scene, case.settings.get("growth", 0.0)
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors=neighbors), **case.settings)
    assert sim._state.scheme.kind == neighbors
    threshold = sim._state.system.threshold
    events, times, right, speeds, sums = trajectory(oracle_of(scene, 0.0, growth, threshold), case.count)
    nudged = trajectory(oracle_of(scene, NUDGE, growth, threshold), case.count, times)
    length, speed = max(scene.box), np.abs(scene.velocities).max()
    # What may be off, in boxes: the oracle's own divergence, and as much for flights of some boxes.
    parted = np.abs(nudged.positions - right).astype(float).max(axis=(1, 2)) / (NUDGE * length)
    turned = np.abs(nudged.velocities - speeds).astype(float).max(axis=(1, 2)) / (NUDGE * speed)
    flown = 1.0 + speed * times / length
    bounds = ROUNDINGS * EPS * np.maximum.accumulate(np.maximum(np.maximum(parted, turned), flown))
    horizon = int(np.searchsorted(bounds, BLURRED))
    assert horizon >= case.at_least, f"rounding hides all after {horizon} of {case.count} events"
    n, pairs, hits = scene.n, 0, np.zeros(len(sim.obstacles) if scene.walls or scene.obstacles else 0, int)
    for k, frame in enumerate(sim.sample(times=times[:horizon])):
        event = events[k]
        what = f"after event {k}, {event.i} with {event.j} at {float(event.time):.6g}"
        pairs += event.j < n
        if event.j >= n:
            hits[event.j - n] += 1
        assert frame.step == pairs, what
        assert [impact.hits for impact in sim.obstacles if len(hits)] == hits.tolist(), what
        off = np.abs(frame.unwrapped - right[k].astype(float)).max()
        assert off <= bounds[k] * length, f"{what}: places off by {off:g}, bound {bounds[k] * length:g}"
        off = np.abs(frame.velocities - speeds[k].astype(float)).max()
        assert off <= bounds[k] * speed, f"{what}: velocities off by {off:g}, bound {bounds[k] * speed:g}"
        assert_no_overlap(scene, frame)
    virial, impulses = sums[horizon - 1]
    tolerance = 8 * n * bounds[horizon - 1] * speed * scene.masses.max()
    assert abs(stretches.tally(sim).virial - float(virial)) <= tolerance * length * horizon
    taken = [impact.impulse for impact in sim.obstacles] if len(hits) else []
    np.testing.assert_allclose(taken, impulses.astype(float), rtol=0, atol=tolerance * horizon)
    return horizon


def assert_no_overlap(scene, frame):
    """No two components, and none and an obstacle or wall, overlap by more than rounding."""
    report = carom.check(scene, frames=[frame])
    assert report.passed, report


def placed(n, box, seed, *, diameters=(0.6, 1.4), masses=(0.3, 3.0), **more):
    """Return a scene of n components of random sizes and masses, moving."""
    rng = np.random.default_rng(seed)
    sizes = rng.uniform(*diameters, n) if diameters else np.ones(n)
    sizes[0] = max(sizes)
    heavy = np.exp(rng.uniform(*np.log(masses), n)) if masses else np.ones(n)
    scene = mixture([1] * n, diameters=sizes, masses=heavy, box=box, seed=seed, **more)
    changes = (
        {"diameter": 1.0, "mass": 1.0, "species": None} if not (diameters or masses) else {"species": None}
    )
    return moving(scene.replace(**changes), seed + 1)


def case(scene, count=None, at_least=None, **settings):
    count = PER_PARTICLE * max(scene.n // 2, 2) if count is None else count
    return Case(scene, settings, count, count // 3 if at_least is None else at_least)


BOXES = {1: (14.0,), 2: (6.0, 5.2), 3: (4.6, 4.4, 4.8), 4: (3.1, 3.3, 3.2, 3.0)}
WIDE = {1: (14.0,), 2: (7.3, 6.2), 3: (6.3, 6.6, 6.2), 4: (6.2, 6.3, 6.2, 6.4)}
SMALL = {1: (4.6,), 2: (2.9, 3.1), 3: (2.6, 2.4, 2.8), 4: (2.3, 2.2, 2.4, 2.6)}


def unequal(d):
    return case(placed(6 if d < 3 else 8, BOXES[d], 10 + d))


def in_a_small_box(d):
    return case(placed(3, SMALL[d], 20 + d, diameters=(0.5, 1.0)))


def contact_matrix(d):
    kinds = np.arange(8) % 2
    contact = [[1.0, 0.9], [0.9, 0.6]] if d % 2 else [[1.0, 0.65], [0.65, 0.6]]
    scene = mixture(
        [4, 4], diameters=[1.0, 0.6], masses=[1.0, 0.4], contact=contact, box=BOXES[d], seed=30 + d
    )
    assert (np.sort(scene.species) == np.sort(kinds)).all()
    return case(moving(scene, d))


def contact_beyond_the_sum(d):
    """Unlike ones keep far more apart than their radii, in a box that just has room for lists."""
    contact = [[1.0, 1.1], [1.1, 0.3]]
    scene = mixture([2, 2], diameters=[1.0, 0.3], contact=contact, box=(5.6,) * d, seed=25 + d)
    return case(moving(scene, d))


def boxed(d):
    """Walls along every axis."""
    return case(placed(5, BOXES[d], 40 + d, walls=True))


def channel(d):
    """Walls along the last axis, one size and mass."""
    periodic = [True] * (d - 1) + [False]
    return case(placed(6, BOXES[d], 50 + d, diameters=None, masses=None, walls=axes_without(periodic)))


def lorentz(d):
    """A fixed ball across the corner of a small box, another inside."""
    obstacles = (Ball((0.1,) * d, 0.45), Ball(tuple(0.5 * x for x in SMALL[d]), 0.3, "middle"))
    return case(placed(2, SMALL[d], 60 + d, diameters=(0.2, 0.4), obstacles=obstacles), count=20)


def ball_far_away(d):
    """The center of a ball may be given in another box than the first."""
    center = tuple((3.2 if axis else -4.7) * x for axis, x in enumerate(WIDE[d]))
    return case(placed(5, WIDE[d], 70 + d, obstacles=(Ball(center, 0.8),)))


def roof(d):
    """An oblique plane in a box with walls."""
    normal = (1.0,) + (0.0,) * (d - 2) + (2.0,) if d > 1 else (3.0,)
    return case(placed(5, BOXES[d], 80 + d, walls=True, obstacles=(Plane(normal, 2.5),)))


def flask(d):
    """A spherical container with a ball and a plane in it."""
    box = tuple(5.2 for _ in range(d))
    middle = (2.6,) * d
    normal = (0.0,) * (d - 1) + (1.0,)
    obstacles = (
        Ball((2.6,) * (d - 1) + (1.8,), 0.3),
        SphericalContainer(middle, 2.5),
        Ball((2.6,) * (d - 1) + (3.4,), 0.2, "second"),
        Plane(normal, 0.5, "floor"),
    )
    return case(placed(3, box, 90 + d, diameters=(0.3, 0.8), walls=True, obstacles=obstacles))


def pipe(d):
    box = (4.0,) + (3.0,) * (d - 1)
    periodic = [True] + [False] * (d - 1)
    obstacles = (CylindricalContainer(0, (1.0,) + (1.5,) * (d - 1), 1.45),)
    return case(
        placed(4, box, 100 + d, diameters=(0.4, 0.9), walls=axes_without(periodic), obstacles=obstacles)
    )


def inelastic(d):
    """Restitution of a half; about every third contact is slow enough to be elastic."""
    scene = placed(8, BOXES[d], 110 + d, diameters=None, masses=None)
    return case(scene.replace(impact=Restitution(0.5, elastic_below=0.4)))


def growing(d):
    """Small components of one size, at a common rate."""
    scene = carom.Scene.random(8, box=tuple(0.7 * x for x in BOXES[d]), diameter=0.3, seed=120 + d)
    return case(moving(scene, d), growth=0.08)


def points(d):
    scene = carom.Scene.random(6, box=tuple(0.6 * x for x in BOXES[d]), diameter=1e-7, seed=130 + d)
    return case(moving(scene, d), growth=0.3, count=20)


def growing_apart(d):
    """Rates in proportion to sizes, one of them zero; masses; walls on one axis; contacts lose energy."""
    periodic = [True] * (d - 1) + [False]
    scene = placed(6, BOXES[d], 140 + d, diameters=(0.4, 0.9), walls=axes_without(periodic))
    rates = 0.1 * scene.diameters
    rates[2] = 0.0
    return case(scene.replace(impact=Restitution(0.8, elastic_below=0.1)), growth=rates)


def dilute(d):
    """Flights through many sectors and several epochs between two events."""
    return case(placed(3, (16.0, 14.0, 13.0)[:d], 160 + d, diameters=None, masses=None), count=6, at_least=3)


def meeting_by_growth(d):
    """Centers approach each other more slowly than the threshold, surfaces do not: energy is lost."""
    places, velocities = np.zeros((2, d)), np.zeros((2, d))
    places[:, 0], velocities[:, 0] = (1.0, 3.0), (0.02, -0.02)
    scene = carom.Scene(places, (9.0,) * d, velocities=velocities, impact=Restitution(0.5, elastic_below=0.1))
    return case(scene, growth=0.1, count=2, at_least=1)


def growing_in_a_flask(d):
    box = (4.6,) * d
    obstacles = (SphericalContainer((2.3,) * d, 2.25), Ball((2.3,) * d, 0.3))
    scene = placed(4, box, 150 + d, diameters=(0.3, 0.6), walls=True, obstacles=obstacles)
    return case(scene, growth=0.05 * scene.diameters)


KINDS = {
    unequal: (1, 2, 3, 4),
    in_a_small_box: (1, 2, 3, 4),
    contact_matrix: (1, 2, 3, 4),
    contact_beyond_the_sum: (1, 2, 3),
    boxed: (1, 2, 3, 4),
    channel: (1, 2, 3, 4),
    lorentz: (1, 2, 3),
    ball_far_away: (2, 3),
    roof: (1, 2, 3, 4),
    flask: (2, 3, 4),
    pipe: (2, 3, 4),
    inelastic: (1, 2, 3, 4),
    growing: (1, 2, 3, 4),
    points: (1, 2, 3, 4),
    growing_apart: (1, 2, 3, 4),
    dilute: (2, 3),
    meeting_by_growth: (1,),
    growing_in_a_flask: (1, 2, 3, 4),
}

CASES = {f"{make.__name__}-{d}": (make, d) for make, dimensions in KINDS.items() for d in dimensions}


def compare(name):
    """Check the case ``kind-d-neighbors``."""
    kind, d, neighbors = name.split("-")
    make, dimension = CASES[f"{kind}-{d}"]
    return check(make(dimension), neighbors)
