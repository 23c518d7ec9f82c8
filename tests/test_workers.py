"""Several workers run one system, and its bits are those of one worker."""

import dataclasses

import numpy as np
import pytest

import carom
from carom.engine.calendar import ENTRIES
from carom.engine.windows.partition import STAGES
from carom.engine.windows.shares import EDGE, OWN, ZONE, home
from carom.errors import InputError
from carom.io.events import read_events
from carom.simulation.workers.rims import STREAK, Rims
from carom.simulation.workers.shares import Settings
from carom.simulation.workers.team import Team


def fluid(cells=12):
    return carom.Scene.fcc(cells=cells, packing_fraction=0.3)


def alone_and_together(scene, workers, collisions=1.0, depth=None, go=None, **settings):
    """Return a simulation run by one worker, and the same run by several, and what these counted."""
    go = go or (lambda sim: [sim.run(collisions_per_particle=2.3), sim.run(time=0.4)])
    alone, together = (carom.Simulation(scene, seed=3, **settings) for _ in range(2))
    team = Team(together.machine, workers, Settings(collisions=collisions, depth=depth, least=0.0))
    together.machine.team = team
    assert go(alone) == go(together)
    team.close()
    return alone, together, team.shares


def assert_same_bits(alone, together):
    one, other = alone.frame(), together.frame()
    np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_array_equal(one.velocities, other.velocities)
    np.testing.assert_array_equal(one.images, other.images)
    assert alone.time == together.time
    assert alone.tally == together.tally
    assert alone.obstacles == together.obstacles


@pytest.mark.parametrize("workers", [1, 2, 3, 4, 7, 16])
def test_any_number_of_workers_gives_the_bits_of_one(workers):
    alone, together, shares = alone_and_together(fluid(), workers, 0.5)
    assert_same_bits(alone, together)
    assert shares.windows > 0


@pytest.mark.parametrize(("collisions", "depth"), [(0.25, 0.0), (3.0, 0.0), (3.0, 2.0)])
def test_rims_that_are_too_shallow_cost_repeats_and_no_bit(collisions, depth):
    alone, together, shares = alone_and_together(fluid(), 4, collisions, depth)
    assert shares.repeats > 0
    assert_same_bits(alone, together)


@pytest.mark.parametrize("what", ["x", "v", "t"])
def test_one_bit_of_a_row_in_the_zone_costs_the_window(what):
    """Wherever it comes from: the row is another one when it enters the digest of its cell."""
    spoilt = []

    class Spoiling(Team):
        def _load(self, k):
            super()._load(k)
            if k == 0 and not spoilt:
                mine, flags = self._parts[0].share, self._partition.flags[0]
                seen = next(
                    i for i in range(len(mine.here)) if flags[home(mine.neighbors, np.uint64(i))] == ZONE
                )
                value = mine.rows[what][seen]
                mine.rows[what][seen] = np.nextafter(value, np.inf)
                spoilt.append(seen)

    alone, together = (carom.Simulation(fluid(), seed=3) for _ in range(2))
    together.machine.team = team = Spoiling(together.machine, 2, Settings(collisions=1.0, least=0.0))
    for sim in (alone, together):
        sim.run(time=0.4)
    assert spoilt
    assert team.shares.repeats > 0
    assert_same_bits(alone, together)


def test_digests_that_differ_in_a_cell_of_the_zone_are_seen():
    sim = carom.Simulation(fluid(), seed=3, workers=2)
    sim.run(time=0.2)
    team = sim.machine.team
    flags, digests = team._partition.flags[0], team._parts[0].digests
    assert team._agree(0)
    seen = np.flatnonzero((flags == ZONE) & (digests != 0))
    assert len(seen) > 100  # most cells had a row that was new
    digests[seen[0]] ^= np.uint64(1)
    assert not team._agree(0)


def test_a_run_saved_by_some_workers_is_resumed_by_others(tmp_path):
    alone = carom.Simulation(fluid(), seed=3)
    alone.run(collisions_per_particle=2.0)
    alone.run(collisions_per_particle=2.0)
    with carom.Simulation(fluid(), seed=3, workers=3) as sim:
        sim.run(collisions_per_particle=2.0)
        assert sim.machine.team.shares.windows > 0
        sim.save(tmp_path / "three.h5")
    with carom.Simulation.load(tmp_path / "three.h5", workers=2) as resumed:
        resumed.run(collisions_per_particle=2.0)
        assert_same_bits(alone, resumed)


def test_the_event_log_of_several_workers_is_that_of_one(tmp_path):
    def logged(name, **settings):
        with carom.Simulation(fluid(), seed=3, event_log=tmp_path / name, **settings) as sim:
            sim.run(collisions_per_particle=4.0)
        return read_events(tmp_path / name)

    for one, other in zip(logged("one.h5"), logged("three.h5", workers=3), strict=True):
        np.testing.assert_array_equal(one, other)


def test_simultaneous_collisions_of_two_parts_are_logged_by_their_components(tmp_path):
    # The same half twice, with coordinates of few bits: all happens in both at the same times, at first. Two
    # parts of a cube are its halves along the last axis.
    half = carom.Scene.fcc(cells=(12, 12, 6), packing_fraction=0.3)
    box = np.ldexp(np.rint(np.ldexp(half.box, 20)), -20)
    x = np.ldexp(np.rint(np.ldexp(half.positions, 20)), -20)
    up, v = np.array([0.0, 0.0, box[2]]), np.random.default_rng(3).standard_normal(x.shape)
    twice = carom.Scene(
        np.concatenate([x, x + up]), box * np.array([1.0, 1.0, 2.0]), velocities=np.concatenate([v, v])
    )
    logs, frames = [], []
    for workers in (1, 2):
        with carom.Simulation(twice, event_log=tmp_path / f"{workers}.h5", workers=workers) as sim:
            sim.run(collisions_per_particle=1.0)
            frames.append(sim.frame())
            assert workers == 1 or sim.machine.team.shares.windows > 0
        log = read_events(tmp_path / f"{workers}.h5")
        equal = np.flatnonzero(np.diff(log.time) == 0.0)
        assert len(equal) > 500
        # By the lower component; but for the few that the calendar knows by the name of the other.
        assert np.mean(log.i[equal] < log.i[equal + 1]) > 0.95
        order = np.lexsort((log.i, log.time, log.epoch))
        logs.append([field[order] for field in log])
    for one, other in zip(*logs, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(frames[0].positions, frames[1].positions)


def test_ctrl_c_leaves_a_true_state(monkeypatch):
    alone = carom.Simulation(fluid(), seed=3)
    alone.run(time=1.0)
    sim = carom.Simulation(fluid(), seed=3, workers=2)
    step, calls = Team._agree, []

    def interrupted(self, k):
        calls.append(k)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return step(self, k)

    monkeypatch.setattr(Team, "_agree", interrupted)
    with pytest.raises(KeyboardInterrupt):
        sim.run(time=1.0)
    sim.run(time=1.0 - sim.time)
    np.testing.assert_array_equal(alone.frame().positions, sim.frame().positions)


def test_lists_in_the_plane_have_the_same_bits():
    scene = carom.Scene.random(n=4000, packing_fraction=0.7, dimension=2, seed=1)
    for workers in (2, 7):
        alone, together, shares = alone_and_together(scene, workers, 0.5)
        assert_same_bits(alone, together)
        assert shares.windows > 0


@pytest.mark.slow
def test_mixtures_between_walls_have_the_same_bits():
    scene = carom.Scene.mixture(
        counts=(3000, 3000), diameters=(1.0, 1.4), packing_fraction=0.5, periodic=(True, False, True), seed=1
    )
    alone, together, shares = alone_and_together(scene, 3, 0.5)
    assert_same_bits(alone, together)
    np.testing.assert_array_equal(alone.virial_by_species, together.virial_by_species)
    assert shares.windows > 0


@pytest.mark.parametrize("workers", [0, 1.5, "two"])
def test_workers_are_a_number_or_auto(workers):
    with pytest.raises(InputError):
        carom.Simulation(fluid(3), workers=workers)


def test_what_one_worker_alone_can_run_is_said():
    with pytest.raises(InputError, match="growing diameters"):
        carom.Simulation(fluid(6), growth=0.1, workers=2)
    assert carom.Simulation(fluid(6), growth=0.1, workers="auto").machine.team is None


def test_parts_go_over_into_the_next_epoch_themselves():
    def go(sim):
        return sim.run(collisions_per_particle=40)

    alone, together, shares = alone_and_together(fluid(8), 3, 2.0, go=go)
    assert together.machine.engine.state.clock.epoch[0] >= 2
    assert shares.turn > 0.0
    assert 2 * shares.collisions > 0.97 * 40 * alone.machine.scene.n
    assert_same_bits(alone, together)


def test_lists_that_run_out_of_room_in_a_part_cost_no_bit():
    def go(sim):
        machine = sim.machine
        machine.scheme = dataclasses.replace(machine.scheme, capacity=1)
        machine.enlarge_neighbors()
        machine.schedule()  # with just enough room for the lists of the lattice
        lattice = machine.scheme.capacity
        block = sim.run(collisions_per_particle=4)
        assert machine.scheme.capacity > lattice
        return block, machine.scheme.capacity

    scene = carom.Scene.triangular(40, packing_fraction=0.7)
    alone, together, shares = alone_and_together(scene, 3, 1.0, go=go)
    assert shares.repeats > 0
    assert shares.windows > 0
    assert_same_bits(alone, together)


def test_rims_become_deeper_where_they_were_too_thin_and_thinner_again(monkeypatch):
    monkeypatch.setattr("carom.simulation.workers.rims.FRONT", (0.5, 0.1))

    def go(sim):
        return sim.run(collisions_per_particle=12)

    alone, together, shares = alone_and_together(fluid(), 2, 1.0, go=go)
    assert shares.repeats > 0
    assert together.machine.team._rims.factor > 1.0
    assert_same_bits(alone, together)
    rims = Rims(factor=1.25)
    for _ in range(STREAK):
        rims.kept()
    assert 1.0 < rims.factor < 1.25


def test_what_is_far_away_is_given_up_as_a_window_goes_on():
    long = carom.Scene.fcc(cells=(40, 5, 5), packing_fraction=0.3)
    alone, together, _ = alone_and_together(long, 2, 2.0, depth=8.0)
    assert_same_bits(alone, together)
    stages = together.machine.team._partition.stages
    assert set(np.unique(stages)) == {0, *range(1, STAGES + 1)}
    row = together.machine.team._parts[0].engine.state.rows["x"][:-1, 0]
    assert np.isnan(row).any()
    assert np.isfinite(together.frame().positions).all()


def test_all_who_are_due_at_the_beginning_of_a_window_fit_into_the_calendar_of_a_part():
    sim = carom.Simulation(fluid(8), seed=3, workers=2)
    sim.run(time=0.2)
    part, flags = sim.machine.team._parts[0], sim.machine.team._partition.flags[0]
    loose = np.count_nonzero(flags == EDGE) / np.count_nonzero(flags >= OWN)
    room = ENTRIES * len(part.engine.calendar.lines)
    assert loose > 0.25  # more than the calendar of one worker holds at one time
    assert room > sim.scene.n > ENTRIES * len(sim.machine.engine.calendar.lines)
