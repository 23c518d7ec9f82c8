"""All sums of a run, however it is cut, beside the oracle's.

A sum that is forgotten where a run is cut (a chunk, a sample, a checkpoint, a larger array, a refit) is
forgotten in the whole and in its parts alike where both are cut in the same places. The oracle is never cut.
"""

import contextlib
import copy
import math
import tempfile
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import carom
from carom.io.events import read_events
from carom.models import Ball, Plane, SphericalContainer
from carom.models.contacts.losses import Loss
from carom.models.contacts.restitution import Restitution
from carom.models.obstacles.paths import Sine
from carom.simulation.measuring import stretches
from helpers import mixtures
from helpers.oracle_scenes import NUDGE, ROUNDINGS, moving, oracle_of

EPS = np.finfo(float).eps

LISTS, SECTORS = carom.Tuning(neighbors="lists"), carom.Tuning(neighbors="sectors")
SHORT_LISTS = carom.Tuning(neighbors="lists", shell=1.15)

CUTS = 4
"""Parts that a run is cut into."""

SHARP = 1e-5
"""Sums must be comparable to this part, which rounding amplified by the collisions must leave."""


class Case(NamedTuple):
    """A scene in motion, how it is simulated, and how many events are looked at."""

    scene: carom.Scene
    settings: dict[str, Any]
    count: int


def binary(counts, seed, *, masses, box, contact=None, diameters=(1.0, 0.7), speed=1.0, **more):
    """Return two species in motion."""
    scene = mixtures.mixture(
        counts, diameters=diameters, masses=masses, contact=contact, box=box, seed=seed, **more
    )
    scene = moving(scene, seed)
    return scene.replace(velocities=speed * scene.velocities)


def rods():
    """Equal rods on a ring."""
    return Case(moving(carom.Scene.random(6, box=(9.0,), seed=1), 2), {"tuning": LISTS}, 60)


def mixture():
    """Two species with contact distances of their own."""
    scene = binary([4, 4], 3, masses=[1.0, 0.4], box=(6.0, 5.2), contact=[[1.0, 0.75], [0.75, 0.7]])
    return Case(scene, {"tuning": LISTS}, 30)


def furnished():
    """Walls along the first axis, a fixed disk, and contacts that lose energy if they are fast enough."""
    scene = binary(
        [3, 3], 5, masses=[0.5, 2.0], box=(5.0, 6.0), speed=4e7, walls="x",
        obstacles=(Ball((2.5, 3.0), 0.4, "post"), Plane((2.0, 0.0), 0.4)),
    )  # fmt: skip
    return Case(scene.replace(impact=Restitution(0.7, elastic_below=2.5e7)), {"tuning": SECTORS}, 50)


def flask():
    """Spheres in a spherical container."""
    scene = binary(
        [3, 2], 7, masses=[3.0, 1.0], box=(4.0,) * 3, walls=True,
        obstacles=(SphericalContainer((2.0,) * 3, 1.95),),
    )  # fmt: skip
    return Case(scene, {"tuning": LISTS}, 30)


def growing():
    """Two species that grow until the lists are renewed, between walls; contacts lose energy."""
    scene = binary([4, 4], 9, masses=[1.0, 0.3], box=(4.4, 4.0), diameters=(0.4, 0.25), walls="y").replace(
        impact=Restitution(0.8, elastic_below=1.2)
    )
    return Case(scene, {"tuning": SHORT_LISTS, "growth": 0.1 * scene.diameters}, 40)


def live():
    """A shaken floor, a hot ceiling and a ball that takes energy; contacts are elastic below a default speed.

    There is no oracle for all of it together, so that the run that was never cut takes its place.
    """
    obstacles = (
        Plane((0.0, 1.0), 0.4, "floor", shake=Sine(0.2, 1.5)),
        Plane((0.0, -1.0), -5.7, "ceiling", kT=2.0),
        Ball((3.0, 3.0), 0.4, "post", impact=Loss(0.5, elastic_below=1.0)),
    )
    scene = binary([3, 3], 5, masses=[0.5, 2.0], box=(5.0, 6.0), walls="y", obstacles=obstacles)
    return Case(scene.replace(impact=0.9), {"tuning": LISTS}, 30)


KINDS = {make.__name__: make for make in (rods, mixture, furnished, flask, growing, live)}


# What a run adds up to: {name: numbers}; counts are integers.


def sums_of(sim) -> dict[str, np.ndarray]:
    """Return all that a simulation says of what happened so far."""
    found = {
        "collisions": stretches.tally(sim).collisions,
        "collisions of the frame": sim.frame().step,
        "virial": stretches.tally(sim).virial,
        "energy": 0.5 * sim.kT * sim.degrees_of_freedom,
        "places without wrapping": sim.frame().unwrapped,
        "hits": np.array([impact.hits for impact in sim.obstacles]),
        "impulses": np.array([impact.impulse for impact in sim.obstacles]),
        "spared": sim.statistics.spared_contacts,
        "work": np.array([impact.work for impact in sim.obstacles]),
        "contacts that surfaces spared or lifted": np.array(
            [(impact.spared, impact.lifted) for impact in sim.obstacles], int
        ).ravel(),
        "threshold": sim._state.unit.to_scene(sim._state.system.threshold, -1),
    }
    if sim.scene.species is not None:
        found["collisions by species"] = sim.collisions_by_species
    return {name: np.atleast_1d(values) for name, values in found.items()}


def machinery_of(sim) -> dict[str, float]:
    """Return what a simulation says of how it came there."""
    names = ("transits", "advancements", "third_party_first", "clamped_roots", "worst_overlap")
    return {name: getattr(sim.statistics, name) for name in names}


def expected(case: Case, nudge: float = 0.0) -> tuple[float, dict[str, np.ndarray]]:
    """Return the oracle's time between its last event and the next, and its sums until then."""
    scene, growth = case.scene, case.settings.get("growth", 0.0)
    oracle = oracle_of(scene, nudge, growth, scene.impact.elastic_below or 0.0)
    n = scene.n
    kinds = np.zeros(n, int) if scene.species is None else scene.species
    counts = np.zeros((kinds.max() + 1,) * 2, int)
    spared = 0
    for event in islice(oracle, case.count):
        if event.j >= n:
            continue
        a, b = sorted((kinds[event.i], kinds[event.j]))
        counts[a, b] += 1
        spared += scene.impact.restitution < 1.0 and is_elastic(oracle, event)
    last, end = oracle.time, coming(oracle)
    mirror = np.triu(np.ones(counts.shape, bool), 1)
    found = {
        "collisions": oracle.collisions,
        "collisions of the frame": oracle.collisions,
        "virial": oracle.virial,
        "energy": oracle.energy,
        "places without wrapping": oracle.positions + oracle.velocities * (end - last),
        "hits": oracle.hits.copy(),
        "impulses": oracle.impulses.copy(),
        "spared": spared,
        "work": np.zeros(oracle.hits.shape),
        "contacts that surfaces spared or lifted": np.zeros(2 * oracle.hits.size, int),
        "threshold": scene.impact.elastic_below or 0.0,
        "collisions by species": counts + (counts * mirror).T,
    }
    if scene.species is None:
        del found["collisions by species"]
    return end, {name: np.atleast_1d(values) for name, values in found.items()}


def coming(oracle) -> float:
    """Return a time between the last event and the next, which does not happen."""
    return float(0.5 * (oracle.time + copy.deepcopy(oracle).step().time))


def is_elastic(oracle, event) -> bool:
    """Tell whether the collision just realized lost no energy in the frame of the surfaces."""
    i, j = event.i, event.j
    r = oracle.positions[j] + np.array(event.image) * oracle.box - oracle.positions[i]
    r = r / oracle.arithmetic.sqrt(sum(r * r))
    parting = (
        sum(r * (oracle.velocities[j] - oracle.velocities[i])) - (oracle.growth[i] + oracle.growth[j]) / 2
    )
    passed = event.impulse * (1 / oracle.masses[i] + 1 / oracle.masses[j])
    return bool(abs(2 * parting - passed) < 1e-20 * passed)


# The ways to cut a run: each takes a simulation at its start to the end, and returns it.


def instants(end):
    return [*(end * k / CUTS for k in range(1, CUTS)), end]


def go_to(sim, instant):
    """Run to exactly an instant."""
    next(sim.sample(times=[instant]))
    assert sim.time == instant


@contextlib.contextmanager
def nothing_lost(sim, but=()):
    """Compare what there was before a cut with what there is after it, to the bit."""
    sums, machinery = sums_of(sim), machinery_of(sim)
    yield
    for name, values in sums_of(sim).items():
        if name not in but:
            np.testing.assert_array_equal(values, sums[name], err_msg=name)
    for name, value in machinery_of(sim).items():
        # What is scheduled anew may bring a root to be clamped.
        assert value == machinery[name] or (name == "clamped_roots" and value > machinery[name]), name


def in_chunks(sim, end, folder):
    """Stretches by time and by collisions; their blocks add up to the whole."""
    blocks = [sim.run(collisions=2, time=end / CUTS) for _ in range(CUTS - 1)]
    while sim.time < end:
        blocks.append(sim.run(time=end - sim.time))
    whole = stretches.tally(sim)
    assert sum(block.collisions for block in blocks) == whole.collisions
    assert math.isclose(sum(block.virial for block in blocks), whole.virial, rel_tol=1e-12)
    assert math.isclose(sum(block.duration for block in blocks), end, rel_tol=1e-12)
    for k, impact in enumerate(sim.obstacles):
        assert math.isclose(sum(block.impulses[k] for block in blocks), impact.impulse, rel_tol=1e-12)
    return sim


def with_samples(sim, end, folder):
    for frame in sim.sample(times=instants(end)):
        assert frame.step == sim.collisions
    return sim


def with_checkpoints(sim, end, folder):
    """Every part ends in a checkpoint, and goes on beyond it before it is thrown away."""
    for k, instant in enumerate(instants(end)):
        go_to(sim, instant)
        path = folder / f"{k}.h5"
        sim.save(path)
        sums, machinery = sums_of(sim), machinery_of(sim)
        sim.run(collisions=1)
        sim.close()
        sim = carom.Simulation.load(path)
        for name, values in sums_of(sim).items():
            np.testing.assert_array_equal(values, sums[name], err_msg=f"{name}, loaded")
        assert machinery_of(sim) == machinery
    return sim


def with_larger_arrays(sim, end, folder):
    for instant in instants(end):
        go_to(sim, instant)
        with nothing_lost(sim):
            sim._state.enlarge_heap()
            sim._state.enlarge_neighbors()
            sim._state.schedule()
    return sim


def with_refits(sim, end, folder):
    for instant in instants(end)[:-1]:
        go_to(sim, instant)
        with nothing_lost(sim):
            sim._state.refit()
    next(sim.sample(times=[end]))
    return sim


WAYS: tuple[Callable[..., carom.Simulation], ...] = (
    in_chunks, with_samples, with_checkpoints, with_larger_arrays, with_refits,
)  # fmt: skip
EXACT = (in_chunks, with_samples, with_checkpoints)
"""These give the bits of the uncut run, and its transits and advancements as well."""


def check(case: Case) -> int:
    """Compare the sums of every way with the oracle's; return how many events there were."""
    end, right = expected(case)
    if case.scene.impact.restitution < 1.0:
        assert 0 < right["spared"] < right["collisions"], "both kinds of contacts"
    assert right["hits"].size == 0 or right["hits"].sum() > 5
    _, nudged = expected(case, NUDGE)
    # By how much rounding may have changed sums, relative to their size: by the oracle's own divergence, and
    # by as much as one collision.
    sizes = {name: float(np.abs(values).sum()) for name, values in right.items()}
    parted = [
        float(np.abs(nudged[name] - right[name]).max()) / (sizes[name] * NUDGE)
        for name in right
        if right[name].dtype == object and sizes[name]
    ]
    rounding = ROUNDINGS * EPS * max(1.0, *parted)
    assert rounding < SHARP, f"rounding hides what is below {rounding:.1g}"

    def compare(sim, way):
        found = sums_of(sim)
        assert found.keys() == right.keys()
        for name, values in right.items():
            what = f"{name}, {way}"
            if values.dtype == object:
                tolerance = rounding * sizes[name]
                np.testing.assert_allclose(
                    found[name], values.astype(float), rtol=0, atol=tolerance, err_msg=what
                )
            else:
                np.testing.assert_array_equal(found[name], values, err_msg=what)
        return found

    whole = carom.Simulation(case.scene, **case.settings)
    next(whole.sample(times=[end]))
    once = compare(whole, "uncut")
    machinery = machinery_of(whole)
    for way in WAYS:
        with tempfile.TemporaryDirectory() as folder:
            sim = way(carom.Simulation(case.scene, **case.settings), end, Path(folder))
        found = compare(sim, way.__name__)
        if way in EXACT:
            for name, values in once.items():
                if way is in_chunks and name == "places without wrapping":
                    continue  # stretches of a rounded length end within a rounding of the same instant
                np.testing.assert_array_equal(found[name], values, err_msg=f"{name}, {way.__name__}")
            assert machinery_of(sim) == machinery, way.__name__
    if "growth" in case.settings:
        assert whole._state.clock.base > 0, "the neighbor scheme was renewed"
    else:
        check_log(case, end, right)
    unit = whole._state.unit
    with nothing_lost(whole, but=["energy"]):  # in another unit of time
        whole.rescale(1e15 * whole.kT)
    assert whole._state.unit != unit
    return case.count


def check_live(case: Case) -> int:
    """Compare the sums of every way with those of a run that was never cut; all begin with a rescaling."""

    def begun():
        sim = carom.Simulation(case.scene, **case.settings)
        before = sums_of(sim)["threshold"]
        sim.rescale(16.0 * sim.kT)
        assert math.isclose(sums_of(sim)["threshold"][0], 4.0 * before[0], rel_tol=1e-12)
        return sim

    whole = begun()
    whole.run(collisions=case.count)
    end = math.floor(whole.time * 256.0) / 256.0
    whole = begun()
    next(whole.sample(times=[end]))
    once, machinery = sums_of(whole), machinery_of(whole)
    assert (np.abs(once["work"][2:]) > 0.1).all(), "all three exchange energy"
    assert once["contacts that surfaces spared or lifted"].any()
    for way in WAYS:
        with tempfile.TemporaryDirectory() as folder:
            sim = way(begun(), end, Path(folder))
        found = sums_of(sim)
        for name, values in once.items():
            what = f"{name}, {way.__name__}"
            if way in (with_samples, with_checkpoints):
                np.testing.assert_array_equal(found[name], values, err_msg=what)
            else:
                np.testing.assert_allclose(found[name], values, rtol=SHARP, atol=SHARP, err_msg=what)
        if way in (with_samples, with_checkpoints):
            assert machinery_of(sim) == machinery, way.__name__
    unit = whole._state.unit
    with nothing_lost(whole, but=["energy", "threshold"]):
        whole.rescale(1e15 * whole.kT)
    assert whole._state.unit != unit
    return case.count


def check_log(case: Case, end: float, right: dict[str, np.ndarray]) -> None:
    """A log that is cut by checkpoints holds every event once, those with walls and obstacles too."""
    scene, n = case.scene, case.scene.n
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "events.h5"
        sim = with_checkpoints(carom.Simulation(scene, event_log=path, **case.settings), end, Path(folder))
        logged = sim._state.log.mark()["events"]
        sim.close()
        events = read_events(path, 0, logged)  # of a run that was only loaded, the log is left as it is
    pairs = events.j < n
    assert pairs.sum() == right["collisions"]
    hits = np.bincount(events.j[~pairs] - n, minlength=len(right["hits"]))
    np.testing.assert_array_equal(hits, right["hits"])
    taken = np.bincount(events.j[~pairs] - n, events.impulse[~pairs], len(right["hits"]))
    np.testing.assert_allclose(taken, right["impulses"].astype(float), rtol=SHARP)


def compare(name):
    """Check the case of this name."""
    return check_live(live()) if name == "live" else check(KINDS[name]())
