"""Small scenes, and the engine's collisions beside the oracle's."""

from itertools import islice

import numpy as np

import carom
from carom.io.events import read_events, read_initial
from carom.models.files.tables import obstacle_to_table
from carom.reference.arithmetic import make_arithmetic
from helpers.naive.oracle import Oracle

EPS = np.finfo(float).eps

# What the oracle's state is moved by, to see how fast neighboring trajectories part: far above its rounding
# of 10^-50, far below what would leave the linear regime within the collisions looked at.
NUDGE = 1e-30

# Roundings of the size of the box or of the speed that enter a trajectory: some 8 at each event, and at each
# epoch, all of them amplified by less than those at the start.
ROUNDINGS = 512


def moving(scene, seed):
    """Return the scene with normal velocities of equal energy; without walls their momentum is zero."""
    rng = np.random.default_rng(seed)
    velocities = rng.normal(size=(scene.n, scene.dimension)) / np.sqrt(scene.masses)[:, None]
    velocities -= scene.masses @ velocities / scene.masses.sum()
    return scene.replace(velocities=velocities)


def engine_collisions(scene, count, folder, **settings):
    """Return a simulation after ``count`` collisions, its event log, and the times of the collisions."""
    path = folder / "events.h5"
    with carom.Simulation(scene, event_log=path, **settings) as sim:
        sim.run(collisions=count)
    events = read_events(path)
    return sim, events, events.epoch * float(read_initial(path)["epoch_length"]) + events.time


def oracle_of(scene, nudge=0.0, growth=0.0, elastic_below=0.0, arithmetic="mpmath"):
    """Return the oracle at the scene's state, moved by ``nudge`` boxes and speeds at random."""
    rng = np.random.default_rng(0)
    exact = make_arithmetic(arithmetic, 50)
    number, shape, speed = exact.number, scene.positions.shape, np.abs(scene.velocities).max()
    return Oracle(
        exact.array(scene.positions, "positions") + number(nudge * max(scene.box)) * rng.normal(size=shape),
        exact.array(scene.velocities, "velocities") + number(nudge * speed) * rng.normal(size=shape),
        scene.box,
        diameter=scene.diameters,
        masses=scene.masses,
        species=None if scene.contact is None else scene.species,
        contact=scene.contact,
        growth=growth,
        periodic=scene.periodic,
        obstacles=[obstacle_to_table(obstacle) for obstacle in scene.obstacles],
        restitution=scene.impact.restitution,
        elastic_below=elastic_below,
        arithmetic=arithmetic,
    )


def divergence(scene, right, count):
    """Return by how much rounding may have moved the time of each collision, from a nudged oracle."""
    nudged = list(islice(oracle_of(scene, nudge=NUDGE), count))
    parted = np.array([float(abs(b.time - a.time)) for a, b in zip(right, nudged, strict=True)]) / NUDGE
    crossing = max(scene.box) / np.abs(scene.velocities).max()
    return ROUNDINGS * EPS * np.maximum.accumulate(np.maximum(parted, crossing))


def assert_equal_to_oracle(scene, count, folder, at_least=None, **settings):
    """Run engine and oracle side by side: order, partners, times and impulses, and the state at the end.

    The comparison goes on to where rounding, amplified, would move a collision by a hundredth of the mean
    time between two of one particle: ``at_least`` so many collisions, all of ``count`` if left out.
    """
    sim, events, times = engine_collisions(scene, count, folder, **settings)
    assert len(times) == count
    oracle = oracle_of(scene)
    right = list(islice(oracle, count))
    mean_free_time = float(right[-1].time) * scene.n / (2 * count)
    bounds = divergence(scene, right, count)
    horizon = int(np.searchsorted(bounds, 1e-2 * mean_free_time))
    assert horizon >= (count if at_least is None else at_least), f"rounding hides all after {horizon}"
    fastest = np.abs(scene.velocities).max() * scene.n**0.5
    for k, collision in enumerate(right[:horizon]):
        time = float(collision.time)
        assert (events.i[k], events.j[k]) == (collision.i, collision.j), f"collision {k} at {time}"
        assert abs(times[k] - time) < bounds[k], f"collision {k}: {times[k]} instead of {time}"
        share = bounds[k] * fastest / scene.diameter  # by which the line of centers may have turned
        assert abs(events.impulse[k] - float(collision.impulse)) < 2 * scene.mass * fastest * share
    # A flight is four boxes long at most before its clock is set back; some 16 roundings of that size add up.
    assert sim.statistics.worst_overlap < 16 * EPS * 4 * max(scene.box) / scene.diameter
    if horizon == count:
        # The end as well: positions without wrapping, hence images, and velocities.
        if sim.time > oracle.time:
            oracle.advance_to(sim.time)
        frame = sim.frame()
        assert np.abs(frame.unwrapped - oracle.positions.astype(float)).max() < 4 * fastest * bounds[-1]
        turned = np.abs(frame.velocities - oracle.velocities.astype(float)).max()
        assert turned < 4 * fastest**2 * bounds[-1] / scene.diameter
    return sim
