"""What a Simulation promises: the same bits however it is cut, sampled, saved; and an end to every run."""

import math

import numpy as np
import pytest
from helpers.marks import slow

import carom
from carom.errors import InputError
from carom.models.motions.gravity import Gravity
from carom.simulation.measuring import stretches
from carom.simulation.run_state import RunState

SCENES = {
    "rods": lambda: carom.Scene.random(20, 0.6, 1, seed=1),
    "disks": lambda: carom.Scene.random(60, 0.5, 2, seed=2),
    "spheres": lambda: carom.Scene.crystal(cells=3, packing_fraction=0.45),
    "few spheres": lambda: carom.Scene.random(5, 0.2, seed=3),
    "dilute": lambda: carom.Scene.random(12, 0.05, 2, seed=4),
    "d = 4": lambda: carom.Scene.random(12, 0.1, 4, seed=5),
}


OWN_KINDS = ("rods", "few spheres", "dilute")
"""Short runs of these are plain Python by default, and long ones compiled under ``-m slow``."""


@pytest.fixture(params=["disks", "spheres", "d = 4", *OWN_KINDS, *map(slow, OWN_KINDS)])
def scene(request):
    return SCENES[request.param]()


@pytest.fixture
def count(request, scene):
    """Return a number of collisions for a run of the scene."""
    is_slow = request.node.get_closest_marker("slow") is not None
    if request.node.callspec.params["scene"] not in OWN_KINDS or is_slow:
        return 400
    request.getfixturevalue("plain")
    return 20


def bits(sim):
    frame = sim.frame()
    parts = (frame.positions, frame.velocities, frame.images)
    return sim.collisions, sim.time, b"".join(part.tobytes() for part in parts)


def test_cutting_sampling_and_progress_leave_no_trace(scene, count):
    whole = carom.Simulation(scene, seed=1)
    whole.run(collisions=count)
    end = whole.time + 0.2
    list(whole.sample(times=[end]))  # run(time=0.2) would end at the exact sum, a rounding away from ``end``

    cut = carom.Simulation(scene, seed=1)
    for _ in range(count // 10):
        cut.run(collisions=10, progress=lambda fraction: None)
    for frame in cut.sample(times=[cut.time + k * 0.01 for k in range(10)]):
        assert np.all((frame.positions >= 0) & (frame.positions < np.asarray(scene.box)))
    (last,) = cut.sample(times=[end])
    assert last.time == end
    assert bits(cut) == bits(whole)


def test_a_loaded_simulation_goes_on_bit_for_bit(scene, count, tmp_path):
    sim = carom.Simulation(scene, seed=7)
    sim.run(collisions=count // 3)
    sim.run(time=0.01)
    sim.save(tmp_path / "checkpoint.h5")
    loaded = carom.Simulation.load(tmp_path / "checkpoint.h5")
    assert bits(loaded) == bits(sim)
    for other in (sim, loaded):
        other.run(collisions=count)
        other.run(time=0.1)
    assert bits(loaded) == bits(sim)
    assert loaded.statistics.advancements == sim.statistics.advancements


def test_energy_momentum_and_hard_cores_are_kept(scene, count):
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions=2 * count)
    found = sim.statistics
    assert found.collisions == 2 * count
    assert found.energy_drift < 1e-12
    assert found.momentum_drift < 1e-12
    assert found.worst_overlap < 1e-12


def test_an_end_at_a_time_stays_the_present():
    sim = carom.Simulation(SCENES["disks"](), seed=1)
    sim.run(collisions=100)
    for _ in range(100):
        sim.run(time=0.001)
        present = sim.time
        assert sim.run(collisions=0).duration == 0
        assert sim.time == present


def test_a_scene_at_rest_ends_at_once():
    sim = carom.Simulation(SCENES["spheres"](), kT=0.0)
    assert sim.run(time=5.0) == carom.Block(5.0, 0, 0.0)
    with pytest.warns(carom.CaromWarning, match="Nothing moves"):
        sim.run(collisions=1)


def test_equal_velocities_end_with_a_warning():
    scene = SCENES["spheres"]()
    moving = carom.Scene(scene.positions, scene.box, velocities=np.full((scene.n, 3), 0.25))
    with pytest.warns(carom.CaromWarning, match="No collision"):
        assert carom.Simulation(moving).run(collisions=10).collisions == 0


def test_a_crystal_at_a_billionth_from_close_packing_runs():
    eta = math.pi / math.sqrt(18) * (1 - 1e-9)
    sim = carom.Simulation(carom.Scene.crystal(cells=4, packing_fraction=eta), seed=1)
    sim.run(collisions_per_particle=20)
    assert sim.statistics.worst_overlap < 1e-12


def test_scaling_by_powers_of_two_scales_the_bits():
    scene = SCENES["spheres"]()
    velocities = carom.Simulation(scene, seed=1).frame().velocities
    small = carom.Scene(scene.positions, scene.box, velocities=velocities)
    large = carom.Scene(
        scene.positions * 2.0**20, tuple(edge * 2.0**20 for edge in scene.box), diameter=2.0**20,
        mass=2.0**-9, velocities=velocities * 2.0**-30,
    )  # fmt: skip
    frames = []
    for one in (small, large):
        sim = carom.Simulation(one)
        sim.run(collisions=2000)
        frames.append(sim.frame())
    assert np.array_equal(frames[1].positions, frames[0].positions * 2.0**20)
    assert np.array_equal(frames[1].velocities, frames[0].velocities * 2.0**-30)
    assert frames[1].time == frames[0].time * 2.0**50


def test_without_images_there_is_no_array_for_them(plain):
    sim = carom.Simulation(carom.Scene.random(12, 0.3, 2), seed=1, tuning=carom.Tuning(images=False))
    sim.run(collisions=20)
    assert sim.frame().images is None
    with pytest.raises(ValueError, match="images=True"):
        _ = sim.frame().unwrapped


@pytest.mark.parametrize(
    ("change", "settings", "will_move"),
    [
        ({}, {}, False),
        ({}, {"growth": 0.1}, True),
        ({"motion": Gravity((0.0, 0.0, -1.0)), "walls": "z"}, {}, True),
    ],
)
def test_a_scene_that_starts_from_rest_may_collide_later(change, settings, will_move, monkeypatch):
    monkeypatch.setattr(RunState, "schedule", lambda machine: None)  # nothing is to run
    asked = []
    monkeypatch.setattr(carom.Simulation, "run", lambda sim, **limits: asked.append(limits))
    scene = carom.Scene(np.random.default_rng(1).uniform(1.0, 39.0, (8, 3)), 40.0, **change)
    sim = carom.Simulation(scene.replace(velocities=np.zeros((8, 3))), **settings)
    with pytest.raises(InputError, match="Nothing collides"):
        stretches.time_for(sim, 10)
    assert asked == [{"collisions": 1000}] * will_move


def test_there_is_no_drift_of_a_momentum_that_is_not_conserved(monkeypatch):
    monkeypatch.setattr(RunState, "schedule", lambda machine: None)
    scene = carom.Scene.crystal(cells=3, packing_fraction=0.1)
    falling = carom.Simulation(scene.replace(motion=Gravity((0.0, 0.0, -20.0))))
    assert np.isnan(falling.statistics.momentum_drift)
    assert carom.Simulation(scene).statistics.momentum_drift == 0.0


@pytest.mark.parametrize("changed", [{"walls": True}, {"drive": carom.models.Andersen(1.0, 1.0)}])
def test_a_drift_that_is_none_is_left_out(plain, changed):
    sim = carom.Simulation(carom.Scene.random(4, 0.1, 2, seed=1, **changed), seed=1)
    sim.run(time=0.1)
    assert "nan" not in f"{sim.statistics} {sim.statistics._repr_html_()}"
    assert "momentum drift" not in str(sim.statistics)
    assert ("energy drift" in str(sim.statistics)) == ("walls" in changed)
