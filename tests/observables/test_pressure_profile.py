"""The pressure by layers: equal where nothing pulls, in a field the weight above."""

import math

import numpy as np
import pytest

import carom
from carom.models import Ball, Gravity
from carom.observables.pressure_profile import LayerFlux, catch_up, fly

ROUNDING = 1e-10
"""Sums of some thousand products, relative to the pressure."""

FIVE = 5.0

POINTS = 20000
"""Places at which a flight is looked at: each layer that it enters or leaves is wrong by one at most."""


def momentum(sim):
    """Return the most momentum along an axis that particles can have in any part of the box."""
    frame = sim.frame()
    squares = (frame.masses[:, None] * frame.velocities**2).sum()
    return math.sqrt(frame.masses.sum() * squares)


@pytest.mark.parametrize("wraps", [False, True])
@pytest.mark.parametrize("pull", [0.0, -2.0, 3.0])
def test_a_flight_adds_to_each_layer_what_many_looks_at_it_add(pull, wraps):
    g = np.array([0.0, pull] if wraps else [pull, 0.7])  # along a periodic axis there is no field
    rng = np.random.default_rng(3)
    edge, bins, mass = 5.0, 8, 1.5
    for _ in range(20):
        x, v = rng.uniform(0.0, edge), rng.normal(size=2) * rng.choice([0.0, 1.0, 6.0])
        time = 4.0 if wraps else 2.0
        times = (np.arange(POINTS) + 0.5) * time / POINTS
        places = x + v[0] * times + 0.5 * g[0] * times**2
        if not wraps:  # until it meets a wall
            met = np.flatnonzero((places < 0.0) | (places > edge))
            if met.size:
                time = times[met[0] - 1] if met[0] else 0.0
                times, places = times[: met[0]], places[: met[0]]
        flux, in_parts = (
            LayerFlux(
                0, edge, wraps, g, np.array([mass]), np.array([0.1, 0.0]), np.array([x]),
                v[None].copy(), np.array([7.0]), np.zeros(bins), *np.zeros((3, bins, 2, 2)),
            )
            for _ in range(2)
        )  # fmt: skip
        fly(flux, 0, 7.0 + time)
        for part in (0.3, 0.3, 1.0):
            catch_up(in_parts, 7.0 + part * time)
        assert in_parts.stays == pytest.approx(flux.stays, abs=ROUNDING)
        end = x + v[0] * time + 0.5 * g[0] * time**2
        assert in_parts.x[0] == pytest.approx(end % edge if wraps else end, abs=ROUNDING)
        assert in_parts.v[0] == pytest.approx(v + g * time, abs=ROUNDING)
        u = v + g * times[:, None] - flux.drift
        which = np.minimum((places % edge / edge * bins).astype(int), bins - 1)
        step = (4.0 if wraps else 2.0) / POINTS
        flown = step * (2.0 + abs(v[0]) * time / edge * bins) * 2.0
        assert flux.stays == pytest.approx(np.bincount(which, minlength=bins) * step, abs=flown)
        assert flux.stays.sum() == pytest.approx(time, rel=ROUNDING, abs=0.0)
        if pull and wraps and abs(v[0]) * time > edge:
            continue  # whole boxes add the same to every layer
        assert in_parts.carried == pytest.approx(flux.carried, abs=ROUNDING * np.abs(flux.carried).max())
        for a in range(2):
            for b in range(2):
                looked = mass * np.bincount(which, u[:, a] * u[:, b], bins) * step
                assert flux.carried[:, a, b] == pytest.approx(looked, abs=flown * mass * np.max(u**2) + 1e-9)


def test_between_walls_the_parts_are_where_spheres_can_be_and_touch_and_in_sum_the_pressure_of_walls(plain):
    sim = carom.Simulation(carom.Scene.random(12, 0.25, 2, seed=1, walls="y"), seed=1)
    found, low, high = sim.measure(
        carom.PressureProfile(axis=1, bins=20), carom.WallPressure("y_low"), carom.WallPressure("y_high"),
        time=20.0, blocks=20,
    )  # fmt: skip
    edge, radius = sim.scene.box[1], 0.5
    # Two layers differ by what the momentum between them changed.
    changed = 2.0 * momentum(sim) / (sim.scene.volume / edge * 20.0)
    assert np.ptp(found.normal) < changed * (1.0 + ROUNDING)
    wall = 0.5 * (low.pressure.mean + high.pressure.mean)
    wall_error = 0.5 * (low.pressure.error + high.pressure.error)
    assert (abs(found.normal - wall) < FIVE * (found.normal_error + wall_error)).all()
    assert 0.0 < found.normal_error.max() < 0.2 * wall
    # The parts differ from layer to layer, as the density does.
    assert np.ptp(found.kinetic[:, 1, 1]) > np.ptp(found.normal)
    empty = (found.edges[1:] <= radius) | (found.edges[:-1] >= edge - radius)
    assert (found.kinetic[empty] == 0.0).all()
    assert (found.collisional[empty] == 0.0).all()
    assert (found.walls[(found.edges[:-1] >= radius) & (found.edges[1:] <= edge - radius)] == 0.0).all()


class Impulses:
    """What each obstacle took up."""

    def begin(self, scene):
        pass

    def of_scene(self, blocks, scene, *, kT):
        return np.sum([block.impulses for block in blocks], axis=0)


def momentum_below(frame, edges, axis):
    """Return the momentum of what lies below a plane, averaged over the planes of each layer, and of all."""
    carried = frame.masses * frame.velocities[:, axis]
    below = (edges[1:, None] - frame.positions[:, axis]) / np.diff(edges)[:, None]
    return np.clip(below, 0.0, 1.0) @ carried, carried.sum()


@pytest.mark.filterwarnings("ignore::carom.CaromWarning")
@pytest.mark.parametrize(
    ("d", "obstacles", "swaps"),
    [
        *((d, (), None) for d in (1, 2, 3)),
        (2, (Ball((1.5, 1.5), 0.3),), None),
        (2, (), carom.Swaps(interval=0.5)),
    ],
)
def test_a_layer_of_a_mixture_has_the_pressure_of_a_wall_and_what_the_momentum_between_changed(
    plain, d, obstacles, swaps
):
    axis, species = d - 1, [carom.Species(count=1), carom.Species(count=2, diameter=0.4, mass=0.3)]
    sizes = {"diameter": [1.0, 0.4, 0.4], "dimension": d} if swaps else {"species": species}
    scene = carom.Scene.random(**sizes, box=[3.0] * d, walls="xyz"[axis], obstacles=obstacles, seed=1)
    sim = carom.Simulation(scene, seed=1, swaps=swaps)
    start = sim.frame()
    profile, (low, high, *_) = sim.measure(
        carom.PressureProfile("xyz"[axis], 10), Impulses(), time=8.0, blocks=2
    )
    normal, scale = profile.normal, scene.volume / scene.box[axis] * 8.0
    (below, before), (still_below, after) = (
        momentum_below(frame, profile.edges, axis) for frame in (start, sim.frame())
    )
    gained = (still_below - below) / scale
    from_below, from_above = low / scale - gained, high / scale + (after - before) / scale - gained
    rounding = ROUNDING * normal.max()
    first, last = (4, 6) if obstacles else (10, 0)
    assert normal[:first] == pytest.approx(from_below[:first], rel=0.0, abs=rounding)
    assert normal[last:] == pytest.approx(from_above[last:], rel=0.0, abs=rounding)
    assert bool(sim.statistics.swaps_accepted) == bool(swaps)
    # A ball takes up momentum in the middle.
    assert (np.abs(from_below - from_above).max() > 0.01 * low / scale) == bool(obstacles)


@pytest.mark.slow
def test_in_a_field_a_layer_bears_the_weight_of_what_is_above():
    n, width, height, g, kT = 60, 20.0, 60.0, 0.1, 1.0
    places = [(2.0 + 4.0 * (k % 5), 2.0 + 3.0 * (k // 5)) for k in range(n)]
    scene = carom.Scene(places, (width, height), walls="y", motion=Gravity((0.0, -g)))
    sim = carom.Simulation(scene, kT=kT, seed=1)
    sim.run(time=2000.0)
    time = 30000.0
    found = sim.measure(carom.PressureProfile(axis=1, bins=60), time=time)
    slab = height / 60
    weights = g * slab * found.density
    # From the middle of a layer to that of another, and the curvature of the density within the two.
    above = np.cumsum(weights[::-1])[::-1] - 0.5 * weights
    low, high = 5, 50
    between = above[low:high] - above[high]
    scale_height = kT / g
    curved = slab / scale_height * (weights[low:high] + weights[high]) / 6.0
    changed = 2.0 * momentum(sim) / (width * time)
    assert (abs(found.normal[low:high] - found.normal[high] - between) < changed + curved).all()
    assert changed < 0.01 * between[0]
    # All of it weighs n m g.
    assert found.density.sum() * slab * width == pytest.approx(n, rel=ROUNDING)
    bottom = found.normal[0] + 0.5 * weights[0]
    assert bottom == pytest.approx(n * g / width, abs=changed + weights[0] + FIVE * found.normal_error[0])
    # Where the gas is thin, it is an ideal one at every height.
    thin = found.kinetic[10:30, 0, 0] / found.density[10:30]
    error = found.kinetic_error[10:30, 0, 0] / found.density[10:30]
    assert (abs(thin - thin.mean()) < FIVE * (error + error.mean())).all()
