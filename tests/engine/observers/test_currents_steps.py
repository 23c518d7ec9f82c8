"""Helfand's moments of pairs with steps: exact against positions, velocities and pair energies."""

import math

import numpy as np
import pytest

import carom
from carom.engine.observers.currents import Currents
from carom.errors import InputError
from carom.models import Steps, StepTable
from carom.observables import HelfandCurrents
from carom.simulation.measuring import stretches
from carom.studies.scenes import scene_spec
from carom.studies.start import start
from carom.studies.transport.spec import TransportSpec

EPS = np.finfo(float).eps

LADDER = Steps([1.0, 1.25, 1.6], [math.inf, 0.5, -1.0])


def cluster(dimension=2, seed=3):
    """Return unlike particles with steps in the middle of a box that nobody leaves, with a drift."""
    rng = np.random.default_rng(seed)
    n, wide, box = 12, 5.5, 80.0
    small = carom.Scene.random(n, dimension=dimension, box=(wide,) * dimension, diameter=1.0, seed=seed)
    return carom.Scene(
        small.positions + 0.5 * (box - wide),
        box,
        mass=rng.uniform(0.5, 3.0, n),
        velocities=rng.standard_normal((n, dimension)) + 0.7 - 2.0 * (small.positions - 0.5 * wide),
        interaction=StepTable(LADDER),
    )


def halves(r):
    """Return half of the energies of each component's pairs, counted from positions."""
    gaps = r[:, None] - r
    distances = np.sqrt(np.sum(gaps**2, axis=2))
    np.fill_diagonal(distances, np.inf)
    energies = np.array([*LADDER.energies, 0.0])[np.searchsorted(LADDER.distances, distances)]
    return 0.5 * energies.sum(axis=1)


def position_moments(frame, drift):
    """Return sum x_a p_b and sum x_a e, in the frame that drifts."""
    x, m = frame.unwrapped - drift * frame.time, frame.masses
    v = frame.velocities - drift
    energies = 0.5 * m * np.sum(v * v, axis=1) + halves(x)
    return np.einsum("i,ia,ib->ab", m, x, v), energies @ x


@pytest.mark.usefixtures("both_ways", "short_epochs")
def test_the_moments_with_steps_are_those_of_positions_and_pair_energies():
    scene = cluster()
    drift = scene.masses @ scene.velocities / scene.masses.sum()
    sim = carom.Simulation(scene, observers=[HelfandCurrents()], seed=0)
    frames = []
    found = sim.helfand(every=0.05, count=21, look=frames.append, look_every=5)
    assert (sim.interaction.events[1:3, 1:3].sum(axis=1) > 5).all()  # crossings in and out of both steps
    assert sim._state.clock.epoch > 8
    before = position_moments(frames[0], drift)
    tolerance = 1000 * EPS * 80.0 * 12 * 10.0  # coordinates, components and energies of some 80, 12 and 10
    for k, frame in enumerate(frames):
        after = position_moments(frame, drift)
        assert found.stress[:, 5 * k].sum(axis=0) == pytest.approx(after[0] - before[0], abs=tolerance)
        assert found.heat[:, 5 * k].sum(axis=0) == pytest.approx(after[1] - before[1], abs=tolerance)


def fluid(**settings):
    scene = carom.Scene.crystal(dimension=2, cells=(6, 6), packing_fraction=0.3).replace(
        interaction=StepTable(LADDER)
    )
    return carom.Simulation(scene, seed=2, kT=2.0, **settings)


@pytest.mark.usefixtures("both_ways")
def test_currents_leave_no_trace_in_a_run_with_steps():
    plain, counted = fluid(), fluid(observers=[HelfandCurrents()])
    counted.helfand(every=0.01, count=10)
    plain.run(time=counted.time)
    assert (plain.frame().velocities == counted.frame().velocities).all()
    assert plain.collisions == counted.collisions > 30


@pytest.mark.usefixtures("both_ways", "short_epochs")
def test_what_components_hold_is_the_potential_energy_after_epochs_rescaling_and_a_checkpoint(tmp_path):
    sim = fluid(observers=[HelfandCurrents()])
    sim.run(collisions_per_particle=2)
    sim.rescale(1.5)
    sim.run(collisions_per_particle=2)
    sim.save(tmp_path / "run.h5")
    again = carom.Simulation.load(tmp_path / "run.h5")
    for each in (sim, again):
        # In the engine's unit of time an energy is another number.
        held = each._state.unit.to_scene(each._state.observer(Currents).held.halves.sum(), -2)
        assert held == pytest.approx(each.potential_energy, rel=1e-11)
        assert each._state.clock.epoch > 0
    one, two = sim.helfand(every=0.05, count=8), again.helfand(every=0.05, count=8)
    assert (one.heat == two.heat).all()


def test_the_trace_of_the_stress_is_the_virial_of_all_events(plain):
    sim = fluid(observers=[HelfandCurrents()])
    found = sim.helfand(every=0.2, count=5)
    assert np.trace(found.stress[1, -1]) == pytest.approx(stretches.tally(sim).virial, rel=1e-11)
    twice = stretches.tally(sim).kT_time * sim.degrees_of_freedom  # kT fluctuates
    assert np.trace(found.stress[0, -1]) == pytest.approx(twice, rel=1e-11)


def test_currents_are_refused_where_steps_lose_energy(unscheduled):
    scene = carom.Scene.crystal(dimension=2, cells=(10, 10), packing_fraction=0.3)
    bridge = Steps([1.0, 1.3], [math.inf, -0.2], leaving=[math.inf, -0.6])
    with pytest.raises(InputError, match="lose no energy"):
        carom.Simulation(scene.replace(interaction=StepTable(bridge)), observers=[HelfandCurrents()], seed=0)


@pytest.mark.slow
def test_a_transport_study_of_steps_comes_to_its_temperature_and_reads_its_own_file():
    settings = {"n": 100, "dimension": 2, "kT": 2.0, "replicas": 1, "equilibration": 200}
    scene = {"interaction": StepTable(LADDER)}
    study = carom.transport(0.3, **settings, collisions_per_particle=5120, scene=scene, executor="serial")
    (row,) = study.points
    for record in study.records:
        # Rounds of 12 collisions a particle know the mean of kT, which fluctuates by sqrt(2 / 200), to 3 %.
        assert record["result"]["kT"] == pytest.approx(2.0, rel=0.1)
        assert record["result"]["U"] < -0.1
    assert row.enskog is None  # it knows of cores only
    assert not row.exists  # in the plane
    d, v = row.self_diffusion[0], row.self_diffusion_by_velocity[0]
    assert d.mean == pytest.approx(v.mean, abs=5.0 * math.hypot(d.error, v.error))
    assert TransportSpec.from_toml(study.spec.to_toml()) == study.spec


def test_a_study_in_space_starts_with_its_interaction_and_is_written_with_it():
    scene = {"interaction": StepTable(LADDER)}
    spec = TransportSpec((0.2,), n=108, kT=2.0, replicas=1, scene=scene)
    (task,) = spec.tasks()
    # Equal hard spheres start as a crystal with vacancies, which knows of cores only.
    assert start(scene_spec(task["scene"]), np.random.default_rng(1)).interaction == StepTable(LADDER)
    assert TransportSpec.from_toml(spec.to_toml()) == spec


def test_a_scene_file_with_a_well_is_a_transport_study(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(
        "[scene]\nn = 100\ndimension = 2\npacking_fraction = 0.3\n"
        "interaction = { type = 'square-well', range = 1.5, depth = 0.5 }\n[transport]\nkT = 1.5\n"
    )
    spec = TransportSpec.of_argument(file).replaced(relative_error=0.1)
    assert spec.scene["interaction"] == {"type": "square-well", "range": 1.5, "depth": 0.5}
    assert spec.kT == 1.5
