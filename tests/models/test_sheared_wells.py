"""Pairs on steps of energy in a shear flow: against all pairs and images, their balance, and their steps."""

import math

import numpy as np
import pytest
from helpers.marks import slow
from helpers.sheared import NaiveSteps

import carom
from carom.engine.pair_steps import read_steps
from carom.geometry.overlaps import Geometry
from carom.models import Andersen, Bonds, Shear, SquareWell, Steps, StepTable, chains
from carom.models.motions.shear import start_tilt
from carom.simulation.measuring.readings import momentum_flux
from carom.simulation.replay import Replay

STAIRS = StepTable(Steps([0.9, 1.1, 1.4, 1.6], [math.inf, -1.0, 0.7, -0.3]))
AB = Steps([0.9, 1.4], [math.inf, -0.8], leaving=[math.inf, -1.2])
SPECIES = StepTable([[Steps([1.0, 1.3], [math.inf, 0.4]), AB], [AB, Steps([1.0], [math.inf])]])
CHAINS = Bonds(chains(4, 6), inner=0.9, outer=1.2, others=SquareWell(1.5, 1.0))


def disks(interaction, rate=0.8, n=24, **more):
    """Return disks in four rows, in a box whose lattice is laid anew when it has tilted by about a half."""
    k = np.arange(n)
    places = np.stack([0.6 + 1.05 * (k % 6), 0.6 + 1.9 * (k // 6) + 0.1 * (k % 2)], axis=1)
    return carom.Scene(places, (7.5, 7.6), interaction=interaction, motion=Shear(rate), **more)


def all_pairs(sim):
    """Return all pairs, and the step on which each is by its entry in the lists, and by its distance."""
    frame, interaction = sim.frame(), sim.scene.interaction
    pairs = np.stack(np.triu_indices(frame.n, 1), axis=1)
    room = Geometry(np.array(frame.box), np.ones(frame.dimension, bool), tilt=frame.tilt or 0.0)
    by_distance = interaction.steps_of(
        pairs, room.distances(frame.positions, pairs), sim.scene.species, sim.scene.diameter
    )
    free = np.ones(len(pairs), bool)
    if isinstance(interaction, Bonds):
        free = ~(pairs[:, None] == np.array(interaction.pairs)).all(axis=2).any(axis=1)
    stored = np.full(len(pairs), -1)  # bonds must be in lists
    far = np.full(free.sum(), 1e3)
    stored[free] = interaction.steps_of(pairs[free], far, sim.scene.species, sim.scene.diameter)
    place = {tuple(pair): k for k, pair in enumerate(pairs.tolist())}
    listed, steps = read_steps(sim._state.engine.neighbors)
    stored[[place[tuple(pair)] for pair in listed.tolist()]] = steps
    return stored, by_distance


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("depth", [1.0, slow(-0.5)], ids=["well", "shoulder"])
def test_events_are_those_of_all_pairs_and_images(depth):
    scene = disks(None, 0.7)
    velocities = np.random.default_rng(5).normal(size=scene.positions.shape)
    velocities -= velocities.mean(axis=0)
    naive = NaiveSteps(scene.positions, velocities, scene.box, 0.7, [1.0, 1.4], [math.inf, -depth])
    sim = carom.Simulation(scene.replace(velocities=velocities, interaction=SquareWell(1.4, depth)))
    assert sim.potential_energy == -depth * len(naive.level) != 0.0
    for _ in range(5):
        naive.run(30)
        sim.run(collisions=30)
        # Chaos: an error grows about tenfold with an event of each, of which there are some twelve.
        assert sim.time == pytest.approx(naive.time, rel=1e-9)
        assert sim.frame().velocities == pytest.approx(naive.peculiar, abs=1e-6)
        pairs, _ = read_steps(sim._state.engine.neighbors)
        assert {*map(tuple, pairs.tolist())} == naive.level.keys()
    assert sim.time * 0.7 > 0.5


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(("interaction", "more"), [
    (SquareWell(1.5, 1.0), {}), (STAIRS, {"drive": Andersen(kT=1.0, rate=2.0)}),
    (SPECIES, {"species": np.arange(24) % 2}), (CHAINS, {}),
], ids=["well", "stairs in a bath", "species", "chains"])  # fmt: skip
def test_the_stored_step_is_where_the_pair_is_when_lists_are_renewed_and_the_lattice_is_laid_anew(
    interaction, more
):
    sim = carom.Simulation(disks(interaction, **more), seed=1, kT=1.2)
    windows, tilts = set(), []
    for _ in range(6):
        sim.run(time=0.28)
        windows.add(float(sim._state.engine.neighbors.window.middle[0]))
        tilts.append(sim.frame().tilt)
        stored, by_distance = all_pairs(sim)
        assert stored.tolist() == by_distance.tolist()
    assert len(windows) > 3
    assert min(np.diff(tilts)) < 0.0
    if interaction in (STAIRS, SPECIES):  # a bath changes the energy, and so do steps that are hysteretic
        assert not sim.statistics.energy_drift < 1e-3
    else:
        assert sim.statistics.energy_drift < 1e-13
    sim._state.enlarge_neighbors()
    sim._state.schedule()
    assert all_pairs(sim)[0].tolist() == stored.tolist()
    sim.rescale(0.9)
    assert all_pairs(sim)[0].tolist() == stored.tolist()
    assert sim.statistics.worst_overlap < 1e-12


@pytest.mark.usefixtures("both_ways")
def test_kinetic_and_potential_energy_grow_by_the_work_of_the_stream():
    sim = carom.Simulation(disks(STAIRS), seed=1, kT=1.2)
    kinetic, potential = 0.5 * sim.degrees_of_freedom * sim.kT, sim.potential_energy
    sim.run(time=1.5)
    grown, risen = 0.5 * sim.degrees_of_freedom * sim.kT - kinetic, sim.potential_energy - potential
    work = -0.8 * (momentum_flux(sim._state).carried + momentum_flux(sim._state).handed_over)[1, 0]
    assert min(abs(work), abs(grown), abs(risen)) > 0.5
    # A random walk of rounding: some 1000 changes of about 1e-16 of the energy.
    assert grown + risen == pytest.approx(work, abs=1e-13 * kinetic)
    assert sim.statistics.energy_drift < 1e-13
    assert sim.statistics.momentum_drift < 1e-13


def test_no_shear_is_free_flight_but_for_rounding(plain):
    # Lists of a lattice that might tilt hold more pairs, which are looked at at other times.
    still = carom.Simulation(disks(STAIRS, 0.0), seed=1, kT=1.2)
    free = carom.Simulation(disks(STAIRS).replace(motion=None), seed=1, kT=1.2)
    for sim in (still, free):
        sim.run(collisions=100)
    assert still.time == pytest.approx(free.time, rel=1e-10)
    assert still.frame().positions == pytest.approx(free.frame().positions, abs=1e-9)
    assert (still.interaction.events == free.interaction.events).all()


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("interaction", [SquareWell(1.5, 1.0), slow(CHAINS)], ids=["well", "chains"])
def test_a_run_goes_on_from_a_frame_a_checkpoint_and_a_log_with_its_steps(interaction, tmp_path):
    first = carom.Simulation(disks(interaction), seed=1, kT=1.2)
    first.run(time=0.75)
    frame = first.frame()
    assert abs(frame.tilt) > 0.3
    scene = carom.Scene.from_frame(frame, motion=Shear(0.8), interaction=interaction)
    whole = carom.Simulation(scene, event_log=tmp_path / "log.h5")
    assert all_pairs(whole)[0].tolist() == all_pairs(first)[0].tolist()
    assert whole.potential_energy == first.potential_energy
    whole.run(time=0.25)
    whole.save(tmp_path / "half.h5")
    whole.run(time=0.5)
    whole.close()
    resumed = carom.Simulation.load(tmp_path / "half.h5", event_log=None)
    resumed.run(time=0.5)
    assert whole.statistics.energy_drift < 1e-13
    assert all_pairs(whole)[0].tolist() != all_pairs(first)[0].tolist()
    replay = Replay(tmp_path / "log.h5")
    replay.advance_to(0.75)
    for other in (resumed, replay):
        assert other.frame().positions.tobytes() == whole.frame().positions.tobytes()
        assert other.frame().velocities.tobytes() == whole.frame().velocities.tobytes()
    assert all_pairs(resumed)[0].tolist() == all_pairs(whole)[0].tolist()


def test_a_start_tilted_by_whole_boxes_has_the_same_pairs(unscheduled):
    tilted = disks(SquareWell(1.5, 1.0), n=6).replace(motion=Shear(0.8, 0.2))
    ratio = tilted.box[0] / tilted.box[1]
    for turns in (-3, 5):
        more = tilted.replace(motion=Shear(0.8, 0.2 + turns * ratio))
        assert start_tilt(more.motion, more.box) == pytest.approx(0.2, rel=1e-14)
        assert carom.Simulation(more).potential_energy == carom.Simulation(tilted).potential_energy
