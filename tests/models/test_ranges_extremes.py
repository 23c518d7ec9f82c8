"""Range rules at their limits: very many circles, units at rest, everybody removed, runaways."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import carom
from carom.errors import InputError
from carom.models import ENTERED, TIMER, Kind, Ranges, draw
from carom.simulation import run_loop
from carom.simulation.measuring import readings, stall_detector
from carom.units import TimeUnit

EDGE = 10.0


def idle(unit, event):
    pass


def goes(unit, event):
    unit.removed = True


def doubles(unit, event):
    for axis in range(len(unit.velocity)):
        unit.velocity[axis] = 2.0 * unit.velocity[axis]


def dithers(unit, event):
    for axis in range(len(unit.velocity)):
        unit.velocity[axis] = (1.0 if event.cause == ENTERED else -1.0) * event.toward[axis]


def turns(unit, event):
    """The first kind flees from whom it sees, at twice the speed of the others."""
    if unit.kind == 0 and event.cause == ENTERED:
        for axis in range(len(unit.velocity)):
            unit.velocity[axis] = -2.0 * event.toward[axis]


def starts(unit, event):
    if event.cause == TIMER:
        for axis in range(len(unit.velocity)):
            unit.velocity[axis] = draw(unit) - 0.5


def remembers(unit, event):
    unit.memory[0 if event.cause == ENTERED else 1] = event.time


def answers(unit, event):
    return 1.0


def overflows(unit, event):
    unit.velocity = np.zeros(3)


def scene(rule, *circles, n=12, d=2, positions=None, velocities=None, **kind):
    rng = np.random.default_rng(1)
    kinds = [Kind(str(k), radii, **kind) for k, radii in enumerate(circles)]
    return carom.Scene(
        rng.uniform(0.0, EDGE, (n, d)) if positions is None else positions, (EDGE,) * d,
        velocities=rng.normal(size=(n, d)) if velocities is None else velocities,
        species=np.arange(n) % len(kinds), diameter=1e-3, interaction=Ranges(kinds, rule, seed=1),
    )  # fmt: skip


def assert_counters(sim):
    """Every counter is what distances say; 1e-9 of a radius from a circle nobody can tell."""
    units, x = sim.interaction, sim.frame().positions
    r = x[None] - x[:, None]
    apart = np.linalg.norm(r - EDGE * np.rint(r / EDGE), axis=2)
    np.fill_diagonal(apart, np.inf)
    for i in range(len(x)):
        kinds = sim.scene.interaction.kinds
        for c, radius in enumerate(kinds[units.kinds[i]].circles):
            low, high = (
                np.bincount(units.kinds[who & units.present & units.present[i]], minlength=len(kinds))
                for who in (apart[i] < radius * (1.0 - 1e-9), apart[i] < radius * (1.0 + 1e-9))
            )
            assert (low <= units.counts[i, c]).all()
            assert (units.counts[i, c] <= high).all()


def counted(sim, time=1.0):
    for _ in range(3):
        sim.run(time=time / 3.0)
        assert_counters(sim)
    return sim.interaction


@pytest.mark.slow
def test_units_at_their_limits_are_counted_right_and_runaways_end_in_a_sentence(plain):
    half = 0.5 * EDGE
    still = np.zeros((12, 2))
    # As far as a circle can reach, sixty of them, and one far smaller than any distance.
    assert counted(carom.Simulation(scene(idle, [0.49 * EDGE]), seed=0)).asked["entered"] > 5
    assert counted(carom.Simulation(scene(idle, np.linspace(0.1, 4.0, 60)), seed=0), 0.3).asked["left"] > 60
    assert counted(carom.Simulation(scene(idle, [1e-12, 3.0], [1.0]), seed=0)).asked["left"] > 5
    # Of two kinds with equal radii.
    assert counted(carom.Simulation(scene(idle, [1.0, 3.0], [1.0, 3.0]), seed=0)).asked["left"] > 5
    # At rest: nobody crosses anything, until timers say so.
    asked = counted(carom.Simulation(scene(idle, [3.0], velocities=still, timer=0.0), seed=0)).asked
    assert asked == {"entered": 0, "left": 0, "timer": 12, "changed": 0}
    assert (
        counted(carom.Simulation(scene(starts, [3.0], velocities=still, timer=0.1), seed=0), 3.0).asked[
            "entered"
        ]
        > 0
    )
    # Everybody at one place, and one alone.
    counted(carom.Simulation(scene(idle, [3.0], n=4, positions=np.full((4, 2), half), timer=0.1), seed=0))
    assert counted(carom.Simulation(scene(idle, [3.0], n=1, timer=0.1), seed=0)).asked["timer"] == 1
    # Coincident crossings: rows of units that meet at the same times.
    grid = np.stack(np.meshgrid(*[np.arange(4) * 2.5] * 2), axis=-1).reshape(-1, 2)
    along = np.array([[1.0, 0.0], [-1.0, 0.0]])[np.arange(16) % 2]
    rows = carom.Simulation(scene(idle, [1.0, 2.0], n=16, positions=grid, velocities=along), seed=0)
    rows.run(time=0.6)
    assert_counters(rows)
    # All are removed, and the rest of the time passes with nobody.
    gone = carom.Simulation(scene(goes, [3.0], timer=0.5), seed=0)
    assert counted(gone, 2.0).present.sum() == 0
    assert not gone.interaction.counts.any()
    assert gone.time == 2.0
    # Who turns round at every crossing goes on.
    assert counted(carom.Simulation(scene(dithers, [3.0]), seed=0), 0.5).asked["entered"] > 5
    # Who doubles its speed at every crossing does so infinitely often in a finite time.
    with pytest.raises(InputError, match=r"velocity|rule"):
        carom.Simulation(scene(doubles, [3.0]), seed=0).run(time=5.0)


def test_a_rule_is_told_the_time_since_the_start_in_every_epoch(plain):
    """One flies round the box and crosses the circle of one at rest: 2.2 after each round of 10, for 1.6."""
    flights = {"positions": [[5.0, 5.0], [2.0, 5.6]], "velocities": [[0.0, 0.0], [1.0, 0.0]]}
    sim = carom.Simulation(scene(remembers, [1.0], [1e-12], n=2, memory=(0.0, 0.0), **flights), seed=0)
    sim.run(time=475.0)
    assert sim._state.epoch_length < 40.0
    assert sim.interaction.memory[0] == pytest.approx([472.2, 473.8], rel=1e-12)


def test_a_unit_that_turns_ever_more_often_between_two_ends_the_run_in_a_sentence(plain):
    """Two walk at a unit between them, which turns round whenever it sees one: ever more often, up to 2."""
    places, velocities = np.full((3, 2), 0.5 * EDGE), np.zeros((3, 2))
    places[:, 0] = 5.3, 2.0, 8.0
    velocities[:, 0] = 2.0, 1.0, -1.0
    sim = carom.Simulation(
        carom.Scene(
            places,
            (EDGE, EDGE),
            velocities=velocities,
            species=[0, 1, 1],
            diameter=1e-3,
            interaction=Ranges([Kind("turner", (1.0,)), Kind("walker", ())], turns, seed=1),
        ),
        seed=0,
    )
    run_loop.CYCLES, stall_detector.WINDOW = 200, 20  # as plain Python, cycles take long
    sim.run(time=2.0 - 1e-9)
    assert sim.interaction.asked["entered"] > 15  # the gap falls to a third from one to the next: 3^19 is 1e9
    with pytest.raises(
        InputError, match=r"infinitely many crossings .* turns round whenever somebody enters"
    ):
        sim.run(time=3.0)
    assert abs(sim.time - 2.0) < 8 * 2.0**-52


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: carom.Simulation(scene(idle, [0.55 * EDGE]), seed=0), "box edges above"),
        (lambda: carom.Simulation(scene(idle, [100.0 * EDGE]), seed=0), "box edges above"),
        (lambda: scene(answers, [1.0]), "must return nothing"),
        (lambda: scene(overflows, [1.0]), "ValueError"),
        (lambda: scene(idle, [1.0], [1.0 + 2.0**-50]), "equal"),
        (lambda: scene(idle, [math.inf]), "circles"),
        (lambda: scene(idle, np.linspace(1.0, 2.0, 1001)), "at most"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(make, words):
    with pytest.raises(InputError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_timers_are_the_time_that_is_left_in_the_unit_of_the_scene():
    nobody = np.zeros(3, np.int64)
    rules = SimpleNamespace(
        kinds=nobody, present=nobody + 1, counts=np.zeros((3, 1, 1), np.int64), memory=np.zeros((3, 0)),
        timers=np.array([2.5, np.inf, 7.0]), targets=nobody - 1, asked=np.zeros(5, np.int64),
    )  # fmt: skip
    machine = SimpleNamespace(
        engine=SimpleNamespace(model=SimpleNamespace(rules=rules)), unit=TimeUnit(3), in_epoch=lambda: 2.0
    )
    assert readings.units_now(machine).timers.tolist() == [4.0, np.inf]
