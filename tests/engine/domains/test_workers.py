"""Several workers run one system, and its bits are those of one worker."""

import dataclasses
import math

import numpy as np
import pytest
from helpers import refits
from helpers.marks import slow

import carom
from carom.engine.calendar import make_calendar
from carom.engine.domains.decomposition import (
    BORDERS,
    OWN,
    READ_HALO,
    WRITE_HALO,
    interaction_range,
    most_slabs,
    slabs_of,
)
from carom.engine.domains.logical_process import stop
from carom.engine.domains.lp_queue import LpQueue
from carom.engine.domains.lp_state import HISTORY_LENGTH, LATEST, PLACE, TIME, WHOSE
from carom.engine.domains.synchronization import no_straggler, no_straggler_at_border
from carom.engine.neighbors.grid import coordinate_bits
from carom.errors import InputError
from carom.io.events import read_events
from carom.simulation.files import recorder
from carom.simulation.measuring import stretches
from carom.simulation.workers import choose_workers, window_length
from carom.simulation.workers.executive import COMMITS_IN_A_ROW, Executive, Settings


def fluid(cells=12):
    return carom.Scene.crystal(cells=cells, packing_fraction=0.3)


def disks():
    return carom.Scene.crystal(cells=40, dimension=2, packing_fraction=0.7)


def tube():
    """A box with room for twenty-four slabs."""
    return carom.Scene.crystal(cells=(80, 5, 5), packing_fraction=0.3)


def two_sizes_between_walls():
    species = [carom.Species(count=20), carom.Species(count=20, diameter=0.6, mass=0.25)]
    return carom.Scene.random(species=species, packing_fraction=0.4, dimension=2, walls="y", seed=1)


def alone_and_together(
    scene, workers, collisions=1.0, go=None, executive_type=Executive, time_window=8.0, logs=None, **given
):
    """Return a simulation run by one worker, and the same run by several, and what these counted."""
    go = go or (lambda sim: [sim.run(collisions_per_particle=2.3), sim.run(time=0.4)])
    alone, together = (
        carom.Simulation(scene, seed=3, event_log=logs and logs / f"{name}.h5", **given)
        for name in ("one", "other")
    )
    wanted = Settings(collisions=collisions, time_window=time_window, least=0.0, compare=False)
    executive = executive_type(together._state, workers, wanted)
    together._state.executive = executive
    assert go(alone) == go(together)
    executive.close()
    return alone, together, executive.timings


def assert_same_bits(alone, together):
    one, other = alone.frame(), together.frame()
    np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_array_equal(one.velocities, other.velocities)
    np.testing.assert_array_equal(one.images, other.images)
    assert alone.time == together.time
    assert stretches.tally(alone) == stretches.tally(together)
    assert alone.obstacles == together.obstacles
    assert alone.statistics.worst_overlap == together.statistics.worst_overlap


def assert_workers_change_no_bit(scene, workers, *arguments, **settings):
    alone, together, timings = alone_and_together(scene, workers, *arguments, **settings)
    assert_same_bits(alone, together)
    assert timings.windows > 0
    return alone, together, timings


@pytest.mark.parametrize("workers", [1, 2, 3, 7, 16])
def test_any_number_of_workers_gives_the_bits_of_one(workers):
    assert_workers_change_no_bit(tube(), workers, 0.5, lambda sim: sim.run(collisions_per_particle=1.2))


@pytest.mark.parametrize("packing_fraction", [0.05, 0.3, slow(0.49), slow(0.6)])
def test_thin_and_dense_cubes_have_the_same_bits(packing_fraction):
    scene = carom.Scene.crystal(cells=14, packing_fraction=packing_fraction)
    assert_workers_change_no_bit(scene, 2)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2, 5])
def test_lists_in_the_plane_have_the_same_bits(workers):
    scene = carom.Scene.random(n=6000, packing_fraction=0.7, dimension=2, seed=1)
    assert_workers_change_no_bit(scene, workers)


@pytest.mark.slow
@pytest.mark.parametrize("dimension", [1, 4])
def test_lines_and_four_dimensions_have_the_same_bits(dimension):
    box = (2000.0,) if dimension == 1 else (24.0, 6.0, 6.0, 6.0)
    scene = carom.Scene.random(n=900, box=box, dimension=dimension, seed=1)
    assert_workers_change_no_bit(scene, 2)


@pytest.mark.parametrize("neighbors", ["lists", slow("sectors")])
def test_falling_spheres_have_the_same_bits(neighbors):
    scene = tube().replace(motion=carom.models.Gravity((0.0, 0.5, -3.0)))
    assert_workers_change_no_bit(scene, 2, tuning=carom.Tuning(neighbors=neighbors))


def test_thousands_collide_at_the_same_instant_in_all_parts():
    # As a checkerboard whose colors move against each other.
    shape = (32, 12, 12)
    cells = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 3)
    velocities = np.zeros(cells.shape)
    velocities[:, 0] = np.where(cells.sum(axis=1) % 2, 1.0, -1.0)
    scene = carom.Scene(cells * 1.5 + 0.5, tuple(1.5 * size for size in shape), velocities=velocities)
    _, together, _ = assert_workers_change_no_bit(scene, 2, go=lambda sim: sim.run(time=1.5))
    assert together.collisions == 3 * scene.n // 2


def test_parts_keep_the_width_of_their_buckets():
    # All lay out their windows at the same times: one whose lines run out gets more of them.
    plain = make_calendar(10, 0.25)
    part = LpQueue(*plain, *[None] * (len(LpQueue._fields) - len(plain)))
    assert not part.narrow(8.0)
    assert plain.control.width[0] == 0.25
    assert plain.narrow(8.0)
    assert plain.control.width[0] == 0.125


def test_workers_count_what_one_counts():
    alone, together, timings = alone_and_together(
        fluid(), 2, go=lambda sim: sim.run(time=0.5), time_window=0.0
    )
    one, two = alone.statistics, together.statistics
    assert timings.repeats == 0
    assert (one.transits, one.advancements) == (two.transits, two.advancements)


def test_parts_at_rest_have_told_the_others_that_nothing_is_due():
    sim = carom.Simulation(fluid(), seed=3)
    executive = Executive(sim._state, 2, Settings(collisions=1.0, least=0.0, compare=False))
    sim._state.executive = executive
    for _ in range(20):
        sim.run(time=0.1)
        assert np.all(
            executive._processes[0].engine.calendar.channels.published_time[:, 0] > sim._state.clock.offset
        )
    executive.close()


def test_parts_far_ahead_of_each_other_lose_windows_and_no_bit():
    far = {"go": lambda sim: sim.run(collisions_per_particle=8), "time_window": 1e9}
    _, _, timings = assert_workers_change_no_bit(fluid(), 2, 0.5, **far)
    assert timings.repeats > 0


def test_a_window_that_is_given_up_is_run_again_from_its_beginning():
    class Giving(Executive):
        given = 0

        def _wait_for_others(self, k):
            if k == 0 and self.given < 3:
                self.given += 1
                stop(self._processes)
            return super()._wait_for_others(k)

    alone, together, timings = alone_and_together(fluid(), 2, executive_type=Giving, time_window=0.0)
    assert timings.repeats >= 3
    assert_same_bits(alone, together)


def part_of(sim):
    """Return the calendar of the first of two parts, after some windows."""
    sim.run(time=0.2)
    return sim._state.executive._processes[0].engine.calendar


def test_who_comes_late_at_a_border_is_seen():
    calendar = part_of(carom.Simulation(tube(), seed=3, cores=2))
    channels, lp = calendar.channels, calendar.lp[0]
    i, now = 5, 0.5
    channels.border_locks[:, 1] = 0
    assert no_straggler_at_border(calendar, 0, i, now)
    assert no_straggler_at_border(calendar, 0, i, now - 0.1)  # its own order it knows itself
    channels.history[0, 1, WHOSE] = 1  # the part on the other side
    assert no_straggler_at_border(calendar, 0, i, now)
    assert not no_straggler_at_border(calendar, 0, i, now - 0.2)
    channels.history[0, 1, PLACE] += calendar.conflict_range[0] + 1  # elsewhere
    assert no_straggler_at_border(calendar, 0, i, now - 0.2)
    channels.border_locks[0, 1] = HISTORY_LENGTH
    channels.history[0, :, LATEST] = now  # what is about to be forgotten may have been later
    assert not no_straggler_at_border(calendar, 0, i, now - 0.2)
    lp.processed, lp.local_time, calendar.history[:, TIME] = 0, -np.inf, -np.inf
    assert no_straggler(calendar, i, now)
    assert not no_straggler(calendar, i, now - 0.1)
    calendar.history[0, PLACE] += calendar.conflict_range[0] + 1
    assert no_straggler(calendar, i, now - 0.1)


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize("make", [lambda: carom.Scene.random(40, 0.4, 2, seed=1), two_sizes_between_walls])
def test_who_has_moved_by_its_skin_looks_as_far_as_others_are_listed(make):
    scene = make()
    neighbors = carom.Simulation(
        scene, seed=3, tuning=carom.Tuning(neighbors="lists")
    )._state.engine.neighbors
    bounds, everybody = neighbors.bounds, range(scene.n)
    skin = max(bounds.skin_at(i, 0.0)[0] for i in everybody)
    listed = max(bounds.list_range_sq(i, j) for i in everybody for j in everybody) ** 0.5
    assert 0.0 < skin < listed
    for axis in range(scene.dimension):
        touch = interaction_range(neighbors, axis)
        layer = neighbors.grid_step[axis] * 2.0 ** coordinate_bits(scene.dimension) / touch.layers
        assert touch.read * layer >= skin + listed
        assert touch.write * layer >= skin + 2.0 * listed  # partners of these
        assert touch.pair * layer >= listed


@pytest.mark.parametrize(
    "scene", [tube(), carom.Scene.random(n=6000, packing_fraction=0.7, dimension=2, seed=1)]
)
def test_what_two_parts_can_touch_without_a_lock_is_never_the_same(unscheduled, scene):
    neighbors = carom.Simulation(scene, seed=3)._state.engine.neighbors
    axis = int(np.argmax(scene.box))
    touch = interaction_range(neighbors, axis)
    parts = most_slabs(neighbors, scene.box)
    assert parts >= 2
    masks = slabs_of(neighbors, scene.box, scene.periodic, parts).masks
    assert np.array_equal(np.sum(masks & OWN != 0, axis=0), np.ones(touch.layers))

    def around(layers, depth):
        """Return which layers are up to so many away from some."""
        found = np.zeros(touch.layers, bool)
        for way in range(-depth, depth + 1):
            found[(np.flatnonzero(layers) + way) % touch.layers] = True
        return found

    for mask in masks:
        own = mask & OWN != 0
        alone = own & (mask & BORDERS == 0)
        assert not np.any(around(alone, touch.read) & around(~own, touch.write))
        assert not np.any(around(alone, touch.write) & around(~own, touch.read))
        np.testing.assert_array_equal(around(~own, touch.read) & own, (mask & READ_HALO != 0) & own)
        np.testing.assert_array_equal(around(own, touch.write) & ~own, (mask & WRITE_HALO != 0) & ~own)


def test_a_run_saved_by_some_workers_is_resumed_by_others(tmp_path):
    alone = carom.Simulation(fluid(), seed=3)
    alone.run(collisions_per_particle=2.0)
    alone.run(collisions_per_particle=2.0)
    with carom.Simulation(fluid(), seed=3, cores=3) as sim:
        sim.run(collisions_per_particle=2.0)
        assert sim._state.executive.timings.windows > 0
        sim.save(tmp_path / "three.h5")
    with carom.Simulation.load(tmp_path / "three.h5", cores=2) as resumed:
        resumed.run(collisions_per_particle=2.0)
        assert_same_bits(alone, resumed)


def test_the_event_log_of_several_workers_is_that_of_one_though_the_buffer_is_full_in_a_window(
    tmp_path, monkeypatch
):
    """Also in another unit of time, which a scene takes whose speeds are 2^25 times as high."""

    def logged(name, kT, **settings):
        with carom.Simulation(disks(), kT=kT, seed=3, event_log=tmp_path / name, **settings) as sim:
            sim.run(collisions_per_particle=4.0)
            assert (sim._state.unit.exponent != 0) == (kT > 1.0)
        return read_events(tmp_path / name)

    right = logged("one.h5", 1.0)
    monkeypatch.setattr(recorder, "BUFFER", 97)
    found = logged("three.h5", 4.0**25, cores=3)
    for name, one, other in zip(right._fields[:6], right[:6], found[:6], strict=True):
        power = {"time": 1, "impulse": -1}.get(name, 0)
        np.testing.assert_array_equal(refits.scaled(one, -25 * power), other, err_msg=name)


def test_simultaneous_collisions_of_two_parts_are_logged_by_their_components(tmp_path):
    # The same half twice, with coordinates of few bits: all happens in both at the same times, at first. Two
    # parts are its halves along the last axis.
    half = carom.Scene.crystal(dimension=2, cells=(36, 12), packing_fraction=0.7)
    box = np.ldexp(np.rint(np.ldexp(half.box, 20)), -20)
    x = np.ldexp(np.rint(np.ldexp(half.positions, 20)), -20)
    up, v = np.array([0.0, box[1]]), np.random.default_rng(3).standard_normal(x.shape)
    twice = carom.Scene(
        np.concatenate([x, x + up]), box * np.array([1.0, 2.0]), velocities=np.concatenate([v, v])
    )
    logs, frames = [], []
    for workers in (1, 2):
        with carom.Simulation(twice, event_log=tmp_path / f"{workers}.h5", cores=workers, seed=0) as sim:
            sim.run(collisions_per_particle=1.0)
            frames.append(sim.frame())
            assert workers == 1 or sim._state.executive.timings.windows > 0
        log = read_events(tmp_path / f"{workers}.h5")
        equal = np.flatnonzero(np.diff(log.time) == 0.0)
        assert len(equal) > 200
        # By the lower component; but for the few that the calendar knows by the name of the other.
        assert np.mean(log.i[equal] < log.i[equal + 1]) > 0.95
        order = np.lexsort((log.i, log.time, log.epoch))
        logs.append([field[order] for field in log[:6]])
    for one, other in zip(*logs, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(frames[0].positions, frames[1].positions)


def test_ctrl_c_leaves_a_true_state(monkeypatch):
    alone = carom.Simulation(fluid(), seed=3)
    alone.run(time=1.0)
    sim = carom.Simulation(fluid(), seed=3)
    sim._state.executive = Executive(sim._state, 2, Settings(compare=False))
    rest, calls = Executive._wait_for_others, []

    def interrupted(self, k):
        calls.append(k)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return rest(self, k)

    monkeypatch.setattr(Executive, "_wait_for_others", interrupted)
    with pytest.raises(KeyboardInterrupt):
        sim.run(time=1.0)
    sim.run(time=1.0 - sim.time)
    np.testing.assert_array_equal(alone.frame().positions, sim.frame().positions)


def test_one_worker_goes_on_where_a_refit_takes_neighbors_that_several_cannot_share():
    edge = math.sqrt(200 * math.pi / 4.0 / 0.0015 / 4.0)
    sims = [carom.Simulation(carom.Scene.random(200, box=(4.0 * edge, edge), seed=1), seed=1) for _ in "12"]
    executive = Executive(sims[1]._state, 2, Settings(collisions=0.5, least=0.0, compare=False))
    sims[1]._state.executive = executive
    for sim in sims:
        sim.run(collisions_per_particle=3.0)
        assert sim._state.scheme.kind == "sectors"
        sim.rescale(1.9)
        assert sim._state.scheme.kind == "all"
        for _ in range(5):
            sim.run(time=sim.time)
    executive.close()
    assert_same_bits(*sims)


@pytest.mark.slow
def test_mixtures_between_walls_have_the_same_bits():
    alone, together, _ = assert_workers_change_no_bit(refits.species_between_walls(), 2, 0.5)
    np.testing.assert_array_equal(alone.collisions_by_species, together.collisions_by_species)


@pytest.mark.parametrize("workers", [0, 1.5, "two"])
def test_workers_are_a_number_or_auto(unscheduled, workers):
    with pytest.raises(InputError):
        carom.Simulation(fluid(3), cores=workers, seed=0)


def test_what_one_worker_alone_can_run_is_said(unscheduled):
    with pytest.raises(InputError, match="growing diameters"):
        carom.Simulation(fluid(6), growth=0.1, cores=2, seed=0)
    assert carom.Simulation(fluid(6), growth=0.1, cores="auto", seed=0)._state.executive is None


@pytest.mark.usefixtures("unscheduled")
def test_boxes_without_room_for_two_slabs_have_one_worker_and_long_ones_as_many_as_there_is_room_for():
    with pytest.raises(InputError, match="small box"):
        carom.Simulation(fluid(6), cores=2, seed=0)
    assert carom.Simulation(fluid(6), cores="auto", seed=0)._state.executive is None
    assert carom.Simulation(tube(), cores=100, seed=0)._state.executive.workers == 24


@pytest.mark.parametrize(
    ("n", "dimension", "most", "there", "chosen"),
    [
        (99_999, 2, 50, 16, 1),
        (100_000, 2, 50, 16, 2),
        (1_000_000, 2, 180, 16, 16),
        (1_000_000, 2, 180, 1, 1),
        (249_999, 3, 11, 16, 1),
        (250_000, 3, 11, 16, 2),
        (1_000_000, 3, 16, 16, 8),
        (4_000_000, 3, 26, 16, 13),
        (4_000_000, 3, 3, 16, 2),  # spheres in a flat box, or some of them large
        (4_000_000, 3, 1, 16, 1),
        (10_000_000, 4, 50, 16, 1),  # never measured
    ],
)
def test_as_many_workers_are_chosen_as_were_measured_to_pay(monkeypatch, n, dimension, most, there, chosen):
    monkeypatch.setattr(choose_workers, "cores", lambda: there)
    assert choose_workers.automatic(n, dimension, most) == chosen


def test_workers_go_over_into_the_next_epoch_themselves():
    alone, together, timings = alone_and_together(
        fluid(), 2, 2.0, go=lambda sim: sim.run(collisions_per_particle=40)
    )
    assert together._state.engine.state.clock.epoch[0] >= 2
    assert timings.epochs > 0.0
    assert 2 * timings.collisions > 0.9 * 40 * alone._state.scene.n
    assert_same_bits(alone, together)


def test_lists_that_run_out_of_room_in_a_part_cost_no_bit(tmp_path):
    def go(sim):
        machine = sim._state
        machine.scheme = dataclasses.replace(machine.scheme, capacity=1)
        machine.enlarge_neighbors()
        machine.schedule()  # with just enough room for the lists of the lattice
        lattice = machine.scheme.capacity
        # A window lost for another reason makes all lists anew: it can take a while until one is full.
        block = sim.run(collisions_per_particle=60)
        assert machine.scheme.capacity > lattice
        return block

    _, _, timings = assert_workers_change_no_bit(disks(), 3, go=go, logs=tmp_path)
    assert timings.repeats > 0


def test_parts_stay_closer_together_after_a_window_was_lost_and_less_so_after_many_were_kept():
    executive = Executive(carom.Simulation(fluid(), seed=3)._state, 2)
    time_window = executive._time_window
    executive._after_rollback([0, 0], 0, 1.0, 0.5, good=False)
    assert executive._time_window == 0.5 * time_window
    for _ in range(COMMITS_IN_A_ROW):
        executive._after_commit()
    assert executive._time_window == time_window


def test_windows_become_longer_while_they_are_kept_and_shorter_where_they_are_lost():
    held = Executive(carom.Simulation(fluid(), seed=3)._state, 2)._window_length
    assert held.share == window_length.FIRST
    for _ in range(window_length.COMMITS_IN_A_ROW):
        held.commit()
    assert held.share == 2.0 * window_length.FIRST == 1.0
    for _ in range(window_length.COMMITS_IN_A_ROW - 1):
        held.commit()
    for part in (0.5, 0.25, 0.25):
        held.rollback()
        assert held.share == part
    for _ in range(window_length.COMMITS_IN_A_ROW - 1):  # those before do not count
        held.commit()
    assert held.share == 0.25


def test_the_first_window_of_disks_at_random_has_room_for_their_many_collisions(tmp_path):
    scene = carom.Scene.random(n=4000, dimension=2, packing_fraction=0.7, seed=1)
    sim = carom.Simulation(scene, seed=3, event_log=tmp_path / "events.h5")
    sim._state.executive = Executive(sim._state, 1, Settings(compare=False))
    sim.run(collisions_per_particle=12)
    timings = sim._state.executive.timings
    assert timings.windows > 2
    assert timings.repeats == 0
    sim.close()
