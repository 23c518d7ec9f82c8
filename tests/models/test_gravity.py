"""Gravity, shaken floors and losses: beside the oracle, exact balances, files and replays."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from helpers import bed as beds
from helpers.naive.falling import Floor, fall
from helpers.round_things import around_a_ball

import carom
from carom.errors import InputError
from carom.io.events import read_events
from carom.models import Gravity, Loss, Plane, Sine
from carom.models.files.tables import from_table
from carom.models.obstacles.with_properties import Shaken
from carom.scene_file.scene_file import SceneFile
from carom.simulation.replay import Replay
from carom.units import TimeUnit

HEIGHT = 12.0
EDGE = 8.5


def bed(restitution=0.9, *, n=6, amplitude=0.3, period=2.0, contact_time=1e-3, g=1.0, seed=1) -> carom.Scene:
    """Return disks over a shaken floor that loses energy, too: one type of scene for all of these tests."""
    rng = np.random.default_rng(seed)
    columns = 5
    places = np.array([[1.0 + 1.6 * (k % columns), 2.0 + 1.6 * (k // columns)] for k in range(n)])
    loss = Loss(restitution, contact_time=contact_time)
    floor = Plane((0.0, 1.0), 0.5, "floor", shake=Sine(amplitude, period), impact=loss)
    return carom.Scene(
        places, (EDGE, HEIGHT), velocities=rng.normal(size=places.shape), walls="y",
        motion=Gravity((0.0, -g)), obstacles=[floor], impact=loss,
    )  # fmt: skip


def simulation(scene, folder):
    """Return a simulation with an event log."""
    return carom.Simulation(scene, event_log=folder / "log.h5", seed=0)


def test_the_floor_bears_the_weight(plain, tmp_path):
    # Exact: impulse of floor and walls = N m g t + change of momentum, at any density and restitution.
    scene = bed(0.7, n=10, contact_time=0.03)
    with simulation(scene, tmp_path) as sim:
        sim.run(time=10.0)
        frame = sim.frame()
        lower, upper, floor = sim.obstacles
    gained = frame.velocities[:, 1].sum() - scene.velocities[:, 1].sum()
    pushed = lower.impulse - upper.impulse + floor.impulse
    # Sums of some 100 rounded impulses.
    assert math.isclose(pushed, scene.n * 10.0 + gained, rel_tol=1e-12)
    assert floor.hits > 20
    assert floor.spared > 0
    assert sim.statistics.spared_contacts > 0
    assert (frame.positions[:, 1] >= 0.5 + 0.5 - 0.3).all()


def test_contacts_are_spared_by_the_time_since_the_last_one_in_every_epoch(plain, tmp_path):
    scene = bed(contact_time=0.02)
    with simulation(scene, tmp_path) as sim:
        sim.run(time=3.0 * sim._state.epoch_length)
        length, found = sim._state.epoch_length, sim.statistics.spared_contacts
    log = read_events(tmp_path / "log.h5")
    last = np.full(scene.n, -math.inf)
    expected = 0
    for time, i, j in zip(log.epoch * length + log.time, log.i, log.j, strict=True):
        if j < scene.n:
            expected += time - max(last[i], last[j]) < 0.02
            last[i] = last[j] = time
    assert log.epoch[-1] == 2
    assert found == expected > 0


@pytest.mark.parametrize(
    ("g", "amplitude", "period"), [(1e-12, 0.3, 2e6), (1e12, 0.3, 2e-6), (1e-3, 0.04, 0.1)]
)
def test_tiny_and_huge_fields_and_fast_shaking_go_on(plain, tmp_path, g, amplitude, period):
    unit = 1.0 / math.sqrt(g)
    scene = bed(0.8, g=g, amplitude=amplitude, period=period, contact_time=1e-3 * min(unit, period))
    scene = scene.replace(velocities=scene.velocities / unit)
    with simulation(scene, tmp_path) as sim:
        sim.run(time=5.0 * unit)
        frame = sim.frame()
        assert sum(each.hits for each in sim.obstacles) > 0
    assert (frame.positions[:, 1] >= 1.0 - amplitude - 1e-9).all()
    assert np.isfinite(frame.velocities).all()


def test_what_rests_on_the_floor_goes_on_resting(plain, tmp_path):
    # Acceleration of the floor below g: the disk is carried, and never more than t_c's flight above it.
    scene = bed(0.5, n=1, amplitude=0.05, period=2.0, contact_time=1e-2)
    scene = scene.replace(positions=[[1.0, 1.0]], velocities=[[0.0, 0.0]])
    with simulation(scene, tmp_path) as sim:
        for time in np.linspace(0.5, 5.0, 10):
            sim.run(time=0.5)
            height = sim.frame().positions[0, 1] - 1.0 - 0.05 * math.sin(math.pi * time)
            assert -1e-12 < height < 0.05
        assert sim.obstacles[2].hits > 200


@pytest.mark.slow
def test_a_million_bounces_without_one_that_sinks(tmp_path):
    scene = bed(0.8, n=1, amplitude=0.05, period=2.0, contact_time=1e-4)
    floor, period = 1.0, 2.0
    with simulation(scene, tmp_path) as sim:
        time = 0
        while sim.obstacles[2].hits < 1_000_000:
            sim.run(time=7.0)
            time += 7
            height = (
                sim.frame().positions[0, 1]
                - floor
                - 0.05 * math.sin(2.0 * math.pi * (time % period) / period)
            )
            assert height > -1e-12
        assert sim.obstacles[0].hits == 0
        # The floor's force on average is the weight: none was missed.
        gained = sim.frame().velocities[0, 1] - scene.velocities[0, 1]
        pushed = sim.obstacles[2].impulse - sim.obstacles[1].impulse
        assert math.isclose(pushed, time + gained, rel_tol=1e-9)


FLOOR = Plane((0.0, 1.0), 0.0)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: bed().replace(motion=Gravity((0.0, 0.0, -1.0))), "g of Gravity must have 2"),
        (lambda: Gravity((math.nan,)), "g of Gravity must be finite"),
        (lambda: Gravity("down"), "g of Gravity must be"),
        (lambda: Loss(0.5), "contact_time or elastic_below"),
        (lambda: Shaken(FLOOR, (0.0, 0.0), Sine(0.1, 1.0)), "direction"),
        (lambda: Shaken(FLOOR, (0.0, 1.0), 3.0), "must be a path, which has lowest"),
        (lambda: Sine(-1.0, 1.0), "amplitude of a Sine"),
        (lambda: carom.Simulation(bed(), tuning=carom.Tuning(precision="single")), "Single precision"),
        (lambda: carom.Simulation(bed(), growth=0.1), "growth"),
        (lambda: SceneFile.from_toml('[scene]\nmotion = { type = "warp" }'), "must be one of gravity"),
        (lambda: SceneFile.from_toml('[scene]\nmotion = { type = "gravity" }'), "type gravity needs g"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(make, says):
    with pytest.raises(InputError, match=says):
        make()


def test_a_scene_file_holds_field_floor_and_loss():
    text = beds.SCENE.replace("restitution = 0.8\n", "restitution = 0.9\n")
    text = text.replace("offset = 0.0", "offset = 0.5")
    plan = SceneFile.from_toml(text)
    assert SceneFile.from_toml(plan.to_toml()) == plan
    scene = plan.build_scene()
    assert scene.motion == Gravity((0.0, -1.5))
    assert scene.impact == Loss(0.9, contact_time=1e-2)
    law = Loss(0.8, contact_time=1e-2)
    assert scene.obstacles[0] == Plane((0.0, 1.0), 0.5, "floor", shake=Sine(0.2, 2.0), impact=law)


@pytest.mark.parametrize(
    "given",
    [
        {"contact_time": 0.1},
        {"elastic_below": 0.1, "at_speed": 2.0},
        {"contact_time": 0.1, "at_speed": 2.0, "power": 0.5},
    ],
)
def test_a_law_of_losses_is_the_same_from_a_file(given):
    law = Loss(0.8, **given)
    assert law.to_table() == {"type": "loss", "restitution": 0.8, **given} | (
        {"power": law.power} if "at_speed" in given else {}
    )
    assert from_table(law.to_table(), "impact") == law


def test_the_oracle_bounces_as_a_ball_does():
    # From height 1 with restitution 1/2: flights of 2 u / g with u = sqrt(2), halved each time.
    steps = fall([[2.0]], [[0.0]], [-1.0], [Floor((1,), 0.5, restitution=0.5)])
    times = [float(step.time) for step in itertools.islice(steps, 5)]
    first = math.sqrt(2.0)
    wanted = list(itertools.accumulate([first, *(2.0 * first * 0.5**k for k in range(1, 5))]))
    assert np.allclose(times, wanted, rtol=1e-14)


def thermal_column(points=20):
    """Return small disks over a floor of kT = 2 in a field of 1 / 2."""
    places = [(0.5 + 0.9 * (k % 10), 0.5 + 0.4 * (k // 10)) for k in range(points)]
    floor = Plane((0.0, 1.0), 0.25, "floor", kT=2.0, seed=3)  # over the wall of the box
    return carom.Scene(
        places, (10.0, 400.0), diameter=1e-2, walls="y", motion=Gravity((0.0, -0.5)), obstacles=[floor],
    )  # fmt: skip


@pytest.mark.slow
def test_a_thermal_floor_makes_the_barometric_law(tmp_path):
    scene = thermal_column()
    with carom.Simulation(scene, kT=2.0, seed=1, event_log=tmp_path / "log.h5") as sim:
        sim.run(time=100.0)
        sim.save(tmp_path / "early.h5")
        samples = [frame.positions[:, 1] for frame in sim.sample(every=40.0, count=2000)]
        drawn = sim.obstacles[2]
    heights = np.concatenate(samples) - 0.255
    # Ideal but for 20 disks of 1e-2 in an area of 40: n(z) = exp(-z / H) with H = kT / (m g) = 4. Samples are
    # further apart than flights (of 2 sqrt(2 pi) sqrt(kT) / g / 2 = 7 on average): six standard errors.
    six = 6.0 / math.sqrt(len(heights))
    assert abs(heights.mean() / 4.0 - 1.0) < six + 1e-3
    assert abs((heights > 4.0).mean() - math.exp(-1.0)) < six
    assert abs((heights > 8.0).mean() - math.exp(-2.0)) < six
    assert drawn.hits > 10_000
    # The draws are a part of the state: the same run from the checkpoint.
    again = carom.Simulation.load(tmp_path / "early.h5")
    again.run(time=40.0)
    assert (again.frame().positions[:, 1] == samples[0]).all()
    again.close()
    run = Replay(tmp_path / "log.h5")
    run.advance_to(140.0)
    assert (run.frame().positions[:, 1] == samples[0]).all()


@pytest.mark.slow
def test_energy_is_kept_in_a_field_among_round_things():
    # A disk in a round container, around a ball. Normals that are rounded alike let it grow.
    scene = around_a_ball()
    sim = carom.Simulation(scene, seed=0)
    while sum(each.hits for each in sim.obstacles) < 200_000:
        sim.run(time=50_000.0)
    drift = sim.statistics.energy_drift
    # Roundings at random, and six standard deviations.
    assert drift < 6.0 * math.sqrt(200_000) * 2.0**-52
    assert sim.obstacles[4].hits > 20_000
    assert sim.obstacles[5].hits > 1000
    place = sim.frame().positions[0] - 5.0
    assert 1.5 - 1e-12 < np.hypot(*place) < 4.0 + 1e-12


@pytest.mark.parametrize("g", [(0.0, -2.0), (0.0, 2.0), (0.5, -1.5), (-0.25, 0.75, 3.0)])
def test_the_energy_in_a_field_is_mass_times_strength_times_height_over_the_lower_end(g):
    field, masses, edges = Gravity(g), np.array([2.0, 3.0]), (4.0, 8.0, 16.0)[: len(g)]
    places, velocities = np.array([[1.0, 2.0, 3.0], [3.0, 7.0, 5.0]])[:, : len(g)], np.ones((2, len(g)))

    def energy(time):
        x = places + velocities * time + 0.5 * np.array(g) * time**2
        v = velocities + np.array(g) * time
        kinetic = 0.5 * float(np.sum(masses[:, None] * v**2))
        return kinetic + field.potential_energy(masses, x, edges)

    # Binary fractions: exact, wherever the parabola is, in the box or out of it.
    assert energy(0.0) == energy(0.5) == energy(4.0)
    heights = np.where(np.array(g) > 0.0, np.array(edges) - places, places)
    assert field.potential_energy(masses, places, edges) == float(masses @ heights @ np.abs(g)) > 0.0
    down = np.where(np.array(g) > 0.0, edges, 0.0)
    assert field.potential_energy(masses, np.array([down, down]), edges) == 0.0


def test_contacts_slower_than_the_threshold_of_a_loss_are_spared_and_counted():
    particles = SimpleNamespace(unit=TimeUnit(), radii=np.full(2, 0.5))
    law = Loss(0.5, elastic_below=0.1).model(particles)
    for approach, part, spared in ((0.2, 0.75, 0), (0.09, 1.0, 1), (0.11, 0.75, 1)):
        # At a distance of 2, r.v is twice the normal speed.
        assert law.exchanged_part(0, 1, 4.0, -2.0 * approach, 5.0) == part
        assert law.spared[0] == spared
