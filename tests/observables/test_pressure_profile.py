"""The pressure by layers: equal where nothing pulls, in a field the weight above, in its mean the whole."""

import json
import math

import numpy as np
import pytest
from helpers.marks import slow
from helpers.plain import plain_python

import carom
from carom.errors import InputError
from carom.models import Gravity, Shear
from carom.models.drives import Andersen
from carom.observables.pressure_profile import LayerFlux, fly

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
        flux = LayerFlux(
            0, edge, wraps, g, np.array([mass]), np.array([0.5]), np.array([0.1, 0.0]), np.array([x]),
            v[None].copy(), np.array([7.0]), np.zeros(bins), *np.zeros((3, bins, 2, 2)),
        )  # fmt: skip
        fly(flux, 0, 7.0 + time)
        u = v + g * times[:, None] - flux.drift
        which = np.minimum((places % edge / edge * bins).astype(int), bins - 1)
        step = (4.0 if wraps else 2.0) / POINTS
        flown = step * (2.0 + abs(v[0]) * time / edge * bins) * 2.0
        assert flux.stays == pytest.approx(np.bincount(which, minlength=bins) * step, abs=flown)
        assert flux.stays.sum() == pytest.approx(time, rel=ROUNDING, abs=0.0)
        if pull and wraps and abs(v[0]) * time > edge:
            continue  # whole boxes add the same to every layer
        for a in range(2):
            for b in range(2):
                looked = mass * np.bincount(which, u[:, a] * u[:, b], bins) * step
                assert flux.carried[:, a, b] == pytest.approx(looked, abs=flown * mass * np.max(u**2) + 1e-9)


MEANS = """
import json
import numpy as np
import carom
from carom.models import SquareWell

species = [carom.Species(count=16), carom.Species(count=8, diameter=0.5, mass=0.25)]
scenes = {
    "a mixture": carom.Scene.random(dimension=2, packing_fraction=0.3, species=species, seed=1),
    "walls": carom.Scene.random(24, 0.3, 2, seed=1, walls=True),
    "walls of an axis": carom.Scene.random(24, 0.3, 2, seed=1, walls="x"),
    "wells": carom.Scene.crystal(32, density=0.3, interaction=SquareWell(1.5, 1.0)),
    "rods": carom.Scene.random(12, 0.5, 1, seed=1),
}
found = {}
for name, scene in scenes.items():
    sim = carom.Simulation(scene, seed=1)
    by_layers = carom.PressureProfile(axis=scene.dimension - 1, bins=7)
    whole, profile = sim.measure(carom.PressureTensor(), by_layers, collisions=100, blocks=8)
    found[name] = [
        [getattr(each, part).tolist() for each in (whole, profile)] for part in ("kinetic", "collisional")
    ] + [profile.density.tolist(), scene.n / scene.volume]
print(json.dumps(found))
"""


def test_the_mean_over_the_layers_is_the_tensor_of_the_box():
    for name, (kinetic, collisional, density, mean) in json.loads(plain_python("-c", MEANS)).items():
        whole, layers = map(np.array, collisional)
        scale = np.abs(whole).max()
        assert layers.mean(axis=0) == pytest.approx(whole, rel=ROUNDING, abs=ROUNDING * scale), name
        assert np.ptp(layers[:, 0, 0]) > 0.0
        whole, layers = map(np.array, kinetic)
        scaled = 0.05 if name == "walls of an axis" else ROUNDING  # 1 / n of it
        assert layers.mean(axis=0) == pytest.approx(whole, abs=scaled * np.trace(whole)), name
        assert np.mean(density) == pytest.approx(mean, rel=ROUNDING)


@pytest.mark.parametrize("dimension", [2, slow(3)])
def test_between_walls_the_normal_component_is_that_on_the_walls_in_every_layer(dimension):
    axis = dimension - 1
    sim = carom.Simulation(carom.Scene.random(64, 0.25, dimension, seed=1, walls="xyz"[axis]), seed=1)
    sim.run(collisions_per_particle=50)
    name = "xyz"[axis]
    time = 2000.0
    profile, low, high = sim.measure(
        carom.PressureProfile(axis=axis, bins=20),
        carom.WallPressure(f"{name}_low"),
        carom.WallPressure(f"{name}_high"),
        time=time,
    )
    edge, radius = sim.scene.box[axis], 0.5
    # Two layers differ by what the momentum between them changed.
    area = sim.scene.volume / edge
    assert np.ptp(profile.normal) < 2.0 * momentum(sim) / (area * time) * (1.0 + ROUNDING)
    wall = 0.5 * (low.pressure.mean + high.pressure.mean)
    wall_error = 0.5 * (low.pressure.error + high.pressure.error)
    error = profile.normal_error
    assert (abs(profile.normal - wall) < FIVE * (error + wall_error)).all()
    assert 0.0 < error.max() < 0.02 * wall
    # The parts differ from layer to layer, as the density does.
    assert np.ptp(profile.kinetic[:, axis, axis]) > 5.0 * np.ptp(profile.normal)
    empty = (profile.edges[1:] <= radius) | (profile.edges[:-1] >= edge - radius)
    assert (profile.kinetic[empty] == 0.0).all()
    assert (profile.collisional[empty] == 0.0).all()
    assert (profile.walls[(profile.edges[:-1] >= radius) & (profile.edges[1:] <= edge - radius)] == 0.0).all()


BALANCES = """
import json
import numpy as np
import carom
from carom.models import Ball

class Impulses:
    def prepare(self, scene):
        pass

    def of_scene(self, blocks, scene, *, kT):
        return np.sum([block.impulses for block in blocks], axis=0)


species = [carom.Species(count=1), carom.Species(count=2, diameter=0.4, mass=0.3)]
found = {}
for d, obstacles in ((1, ()), (2, ()), (3, ()), (2, (Ball((1.5, 1.5), 0.3),))):
    axis, bins = d - 1, 10
    walls, box = "xyz"[axis], [3.0] * d
    scene = carom.Scene.random(species=species, box=box, walls=walls, obstacles=obstacles, seed=1)
    sim = carom.Simulation(scene, seed=1)
    start = sim.frame()
    profile, (low, high, *_) = sim.measure(carom.PressureProfile(axis, bins), Impulses(), time=8.0, blocks=2)
    end = sim.frame()
    # The momentum of what lies below a plane, averaged over the planes of each layer.
    below = [
        [
            (
                each.masses * each.velocities[:, axis]
                * np.clip((up - each.positions[:, axis]) / (up - down), 0, 1)
            ).sum()
            for down, up in zip(profile.edges[:-1], profile.edges[1:])
        ]
        for each in (start, end)
    ]
    total = [(each.masses * each.velocities[:, axis]).sum() for each in (start, end)]
    scale = scene.volume / scene.box[axis] * (end.time - start.time)
    found[f"{d} {len(obstacles)}"] = [
        (np.array(below) / scale).tolist(), (np.array(total) / scale).tolist(), profile.normal.tolist(),
        low / scale, high / scale,
    ]
print(json.dumps(found))
"""


def test_a_layer_of_a_mixture_has_the_pressure_of_a_wall_and_what_the_momentum_between_changed():
    for name, found in json.loads(plain_python("-c", BALANCES)).items():
        below, total, normal, low, high = map(np.array, found)
        gained = below[1] - below[0]
        from_below, from_above = low - gained, high + (total[1] - total[0]) - gained
        rounding = ROUNDING * normal.max()
        if name == "2 1":  # a ball takes up momentum in the middle
            assert normal[:4] == pytest.approx(from_below[:4], rel=0.0, abs=rounding)
            assert normal[6:] == pytest.approx(from_above[6:], rel=0.0, abs=rounding)
            assert np.abs(from_below - from_above).max() > 0.01 * low
        else:
            assert normal == pytest.approx(from_below, rel=0.0, abs=rounding), name
            assert normal == pytest.approx(from_above, rel=0.0, abs=rounding), name


RODS = """
import numpy as np
import carom
places = np.linspace(1.0, 15.0, 8)
sim = carom.Simulation(carom.Scene(places[:, None], (16.0,), walls=True), seed=1)
frame = sim.frame()
profile = sim.measure(carom.PressureProfile(bins=16), time=400.0, blocks=16)
print(sim.kT, abs(frame.velocities).sum(), *profile.normal)
"""


def test_rods_between_walls_have_the_pressure_of_tonks_in_every_layer():
    kT, speeds, *normal = (float(text) for text in plain_python("-c", RODS).split())
    tonks = 8 * kT / (16.0 - 8.0)
    # Rods hand their velocities on: a wall is met as by points in the free length, up to one more or fewer
    # contact of each, and a layer differs from it by the momentum in between.
    assert normal == pytest.approx([tonks] * 16, abs=4.0 * speeds / 400.0)
    assert 4.0 * speeds / 400.0 < 0.1 * tonks


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


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize(
    ("change", "settings", "asked", "says"),
    [
        ({"pinned": [0]}, {}, {}, "pinned"),
        ({"motion": Shear(1.0)}, {}, {}, "motion Shear"),
        ({"motion": Gravity((0.0, -1.0))}, {}, {}, "fall for ever"),
        ({"drive": Andersen(1.0, rate=1.0)}, {}, {}, "drive"),
        ({}, {"growth": 0.1}, {}, "do not grow"),
        ({}, {}, {"axis": 2}, "axis is 2"),
    ],
)
def test_it_is_refused_where_events_do_not_tell_it(change, settings, asked, says):
    scene = carom.Scene([[2.0, 5.0], [6.0, 5.0]], (8.0, 8.0)).replace(**change)
    with pytest.raises(InputError, match=says):
        carom.Simulation(scene, **settings).measure(carom.PressureProfile(**asked), time=1.0)
