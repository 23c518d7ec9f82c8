"""Overlaps are measured from distances: a collision that was lost shows in the statistics."""

import math

import numpy as np
import pytest

import carom
from carom.models import Ball, Bonds, Gravity, Plane, Sine, SquareWell, chains, own
from carom.simulation.measuring.depths import MOST, Depths

EPS = float(np.finfo(np.float64).eps)
DEPTH = 0.25
"""Of the overlaps that are planted, in distances of contact: exact in a double."""


def put(sim: carom.Simulation, i: int, place: np.ndarray) -> None:
    """Put a component where no event has brought it, as a lost collision would; nobody has looked yet."""
    sim._state.engine.state.rows["x"][i] = place
    sim._state.depths = Depths()


def planted(scene: carom.Scene, contact: float, i: int = 0, j: int = 1, **options) -> carom.Simulation:
    """Return a simulation in which j is too near to i along the last axis; nothing is compiled."""
    sim = carom.Simulation(scene, seed=1, **options)
    assert sim.statistics.worst_overlap == 0.0
    x = np.array(sim._state.engine.state.rows["x"][i], np.float64)
    x[-1] += (1.0 - DEPTH) * contact
    put(sim, j, x)
    return sim


def in_a_row(d: int, n: int = 4, edge: float = 12.0, **options) -> carom.Scene:
    """Return components 3 apart along the first axis."""
    places = np.full((n, d), 1.0)
    places[:, 0] = 1.0 + (edge / n) * np.arange(n)
    return carom.Scene(places, (edge,) * d, **options)


def test_to_read_statistics_changes_nothing_that_a_checkpoint_holds(unscheduled):
    sim = planted(in_a_row(2), 1.0)
    before = sim._state.engine.tallies.copy()
    assert sim.statistics.worst_overlap == sim.statistics.worst_overlap > 0.0  # also what was seen before
    assert sim._state.engine.tallies.tobytes() == before.tobytes()


@pytest.mark.parametrize("d", [1, 2])
def test_two_that_overlap_across_a_face_are_seen(unscheduled, d):
    sim = planted(in_a_row(d, n=3, edge=3.5, diameter=0.9), 0.9)
    put(sim, 1, np.full(d, 3.0))
    put(sim, 0, np.full(d, 1.0))
    put(sim, 2, [3.0 + 0.75 * 0.9 - 3.5, *np.full(d - 1, 3.0)])
    assert sim.statistics.worst_overlap == pytest.approx(DEPTH, rel=16 * EPS)


FLOOR = Plane((0, 1), 0.375, "floor", shake=Sine(0.25, 4.0))
SPECIES = np.array([0, 0, 1, 1])
SIZES = np.array([1.0, 1.0, 0.5, 0.5])
MATRIX = [[1.0, 0.6], [0.6, 0.5]]


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize(
    ("scene", "i", "j", "contact"),
    [
        *((in_a_row(d), 0, 1, 1.0) for d in (1, 2, 3, 4)),
        (in_a_row(2, diameter=SIZES), 0, 2, 0.75),
        (in_a_row(2, diameter=SIZES), 2, 3, 0.5),
        (in_a_row(2, diameter=SIZES, species=SPECIES, contact=MATRIX), 0, 2, 0.6),
        (in_a_row(2, pinned=[0]), 0, 1, 1.0),
        (in_a_row(3, interaction=SquareWell(1.5, 1.0)), 0, 1, 1.0),
        (in_a_row(3, interaction=Bonds(chains(1, 2), 0.8, 4.0)), 0, 1, 0.8),
        (in_a_row(3, interaction=Bonds(chains(1, 2), 0.8, 4.0, others=SquareWell(1.5, 1.0))), 1, 2, 1.0),
    ],
)
def test_two_that_overlap_are_seen_in_every_dimension_and_whatever_their_cores(scene, i, j, contact):
    assert planted(scene, contact, i, j).statistics.worst_overlap == pytest.approx(DEPTH, rel=16 * EPS)


def test_the_diameters_of_the_present_count(unscheduled):
    sim = planted(in_a_row(2, velocities=np.zeros((4, 2))), 1.0, growth=0.1)
    sim._state.clock.offset = float(sim._state.unit.to_kernel(2.0, 1))  # diameters of 1.2
    assert sim.diameters[0] == pytest.approx(1.2)
    assert sim.statistics.worst_overlap == pytest.approx(1.0 - (1.0 - DEPTH) / 1.2, rel=16 * EPS)


def test_overlaps_of_two_pinned_ones_are_none(unscheduled):
    sim = planted(in_a_row(2, pinned=[0, 1]), 1.0)
    assert sim.statistics.worst_overlap == 0.0


def test_a_pinned_one_may_be_inside_an_obstacle_and_others_may_not(unscheduled):
    sim = carom.Simulation(in_a_row(2, pinned=[0], obstacles=[Ball((6.0, 6.0), 1.0)]), seed=1)
    put(sim, 0, [6.0, 6.25])
    assert sim.statistics.worst_overlap == 0.0
    put(sim, 1, [6.0, 7.25])
    assert sim.statistics.worst_overlap == pytest.approx(0.25, rel=1e-12)


def test_single_precision_is_no_overlap(unscheduled):
    scene = in_a_row(2)
    sim = carom.Simulation(scene, seed=1, tuning=carom.Tuning(precision="single"))
    x = np.array(sim._state.engine.state.rows["x"][0], np.float64)
    put(sim, 1, x + np.array([1.0 - 2.0**-21, 0.0]))
    assert sim.statistics.worst_overlap == 0.0
    put(sim, 1, x + np.array([1.0 - DEPTH, 0.0]))
    assert sim.statistics.worst_overlap == pytest.approx(DEPTH, rel=1e-6)


@pytest.mark.parametrize(
    ("options", "place", "depth"),
    [
        ({"walls": "y"}, [6.0, 0.25], 0.25),
        ({"walls": "y"}, [6.0, 12.125], 0.625),
        ({"walls": "x"}, [-5.0, 6.0], 1.0),
        ({"obstacles": [Ball((6.0, 6.0), 1.0)]}, [6.0, 7.25], 0.25),
        ({"obstacles": [FLOOR], "walls": "y", "time": 1.0}, [6.0, 0.875], 0.25),
        ({"motion": Gravity((0.0, -1.0)), "walls": "y"}, [6.0, 0.25], 0.25),
    ],
)
def test_who_is_inside_a_wall_or_an_obstacle_is_seen(unscheduled, options, place, depth):
    time = options.get("time", 0.0)
    scene = in_a_row(2, velocities=np.zeros((4, 2)), **{k: v for k, v in options.items() if k != "time"})
    sim = carom.Simulation(scene, seed=1)
    assert sim.statistics.worst_overlap == 0.0
    put(sim, 2, place)
    sim._state.clock.offset = float(sim._state.unit.to_kernel(time, 1))
    assert sim.statistics.worst_overlap == pytest.approx(depth, rel=1e-12)


def test_states_at_the_end_of_runs_are_kept_until_somebody_asks(unscheduled):
    sim = carom.Simulation(in_a_row(2), seed=1)
    x = sim._state.engine.state.rows["x"]
    before = np.array(x[1])
    put(sim, 1, x[0] + np.array([0.0, 1.0 - DEPTH]))
    sim._state.depths.keep(sim._state)
    x[1] = before
    assert sim.statistics.worst_overlap == pytest.approx(DEPTH, rel=16 * EPS)
    assert sim.statistics.worst_overlap == pytest.approx(DEPTH, rel=16 * EPS)


def test_few_of_many_states_are_kept_and_evenly(unscheduled):
    sim, depths = carom.Simulation(in_a_row(2), seed=1), Depths()
    for k in range(1000):
        sim._state.clock.offset = float(k)
        depths.keep(sim._state)
        assert len(depths._kept) <= MOST
    apart = np.diff([0.0, *(float(sim._state.unit.to_kernel(state.instant, 1)) for state in depths._kept)])
    assert len(apart) >= MOST // 2
    assert apart.max() <= 2.0 * 1000.0 / MOST


def test_the_present_counts_where_the_end_of_the_last_run_was_not_kept(unscheduled):
    sim = carom.Simulation(in_a_row(2, velocities=np.zeros((4, 2))))
    for k in range(MOST + 2):
        sim._state.clock.offset = float(k)
        sim._state.depths.keep(sim._state)
    sim._state.clock.offset = MOST + 3.0
    x = sim._state.engine.state.rows["x"]
    x[1] = x[0] + np.array([0.0, 1.0 - DEPTH])
    assert sim.statistics.worst_overlap == pytest.approx(DEPTH, rel=16 * EPS)


@own.interaction
class Forgetful:
    """Hard cores, of which two never tell that they meet."""

    @own.per_particle
    def number(self, particles):
        return np.arange(len(particles.radii))

    def reach(self, scene):
        return 1.0

    def core_square(self, i, j, now):
        return 1.0

    def interaction_time(self, i, j, rr, rv, vv, now):
        t = own.first_contact(rr - 1.0, rv, vv)
        return own.NEVER if self.number[i] * self.number[j] == 2 else t

    def jump(self, i, j, rr, rv, now):
        return own.elastic(self, i, j, rr, rv)


@own.interaction
class Widen:
    """Cores whose diameter grows by a tenth in a unit of the engine's time."""

    def reach(self, scene):
        return 2.0

    def core_square(self, i, j, now):
        return (1.0 + 0.1 * now) ** 2

    def interaction_time(self, i, j, rr, rv, vv, now):
        contact = 1.0 + 0.1 * now
        return own.first_contact(rr - contact * contact, rv - 0.1 * contact, vv - 0.01)

    def jump(self, i, j, rr, rv, now):
        return own.elastic(self, i, j, rr, rv - 0.1 * np.sqrt(rr))

    def growth(self, i):
        return 0.05


def test_cores_are_those_of_the_time_of_the_state(unscheduled):
    sim = carom.Simulation(in_a_row(2, interaction=Widen()), seed=1)
    x = sim._state.engine.state.rows["x"]
    before = np.array(x[1])
    put(sim, 1, x[0] + np.array([0.0, 1.0 - DEPTH]))
    sim._state.depths.keep(sim._state)
    x[1] = before
    sim._state.engine.state.rows["t"] = sim._state.clock.offset = 2.0
    assert sim.statistics.worst_overlap == pytest.approx(DEPTH, rel=16 * EPS)


@pytest.mark.usefixtures("both_ways")
def test_a_lost_collision_shows_though_the_two_have_parted_again():
    # So many that a simulation does not try the two, which are 1 and 2.
    n = 60
    places = np.array([[1.0 + 3.0 * (k % 10), 1.0 + 3.0 * (k // 10)] for k in range(n)])
    velocities = np.zeros((n, 2))
    velocities[1, 0], velocities[2, 0] = 1.0, -1.0
    sim = carom.Simulation(carom.Scene(places, 30.0, velocities=velocities, interaction=Forgetful()))
    for _ in sim.sample(every=0.25, count=12):
        pass
    distance = abs(np.diff(sim.frame().positions[1:3, 0])[0])
    assert distance == pytest.approx(3.0)
    assert sim.statistics.worst_overlap == pytest.approx(1.0)


def test_the_figure_of_a_sound_run_is_that_of_its_collisions():
    sim = carom.Simulation(carom.Scene.random(30, 0.3, 2, seed=1), seed=1)
    for _ in range(5):
        sim.run(collisions=200)
    depth = float(sim._state.engine.tallies[0].depth)
    assert sim.statistics.worst_overlap == max(0.0, 1.0 - 1.0 / math.sqrt(depth))
