"""Uniform shear: against all pairs and images, exact balances, published steady states, and files."""

import itertools
import math

import ase.io
import MDAnalysis
import numpy as np
import pytest
from helpers.marks import slow
from helpers.neighbors import lists_of
from helpers.sheared import Naive

import carom
from carom.engine.neighbors import grid
from carom.engine.neighbors.grid import coordinate_bits
from carom.engine.observers.stream import fly, make_stream_sums
from carom.errors import InputError
from carom.geometry.overlaps import Geometry
from carom.models import Andersen, Ball, Kind, Ranges, Restitution, Rough, Shear
from carom.models.motions.shear import LONGEST_STRAIN, Sheared, start_tilt
from carom.simulation.measuring.readings import momentum_flux


def flux(sim):
    """Return the integral of the pressure tensor times the volume since the start, (d, d)."""
    return sum(momentum_flux(sim._state))


def gas(d, n=100, packing_fraction=0.2, rate=0.7, seed=1, **given):
    return carom.Scene.random(n, packing_fraction, d, seed=seed, motion=Shear(rate), **given)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(("box", "n", "restitution"), [
    ((7.0, 6.0), 16, 1.0), ((12.0, 11.0), 40, 0.9), ((6.0, 5.6, 5.8), 20, 0.9),
    ((5.0, 4.0, 4.5, 4.2), 16, 1.0),
], ids=["images of a small box", "wide box", "space", "four dimensions"])  # fmt: skip
def test_collisions_are_those_of_all_pairs_and_images(box, n, restitution):
    rng, d = np.random.default_rng(5), len(box)
    side = int(np.ceil(n ** (1 / d)))
    places = (np.argwhere(np.ones((side,) * d))[:n] + 0.5) * np.array(box) / side
    places += rng.uniform(-0.05, 0.05, places.shape)
    peculiar = rng.normal(size=places.shape)
    peculiar -= peculiar.mean(axis=0)
    naive = Naive(places, peculiar, box, 0.7, restitution)
    impact = None if restitution == 1.0 else Restitution(restitution, elastic_below=1e-12)
    scene = carom.Scene(places, box, velocities=peculiar, motion=Shear(0.7), impact=impact)
    sim = carom.Simulation(scene)
    for _ in range(4 if d < 4 else 2):
        naive.run(8)
        sim.run(collisions=8)
        # Chaos: an error grows about tenfold with a collision of each, of which there are at most four.
        assert sim.time == pytest.approx(naive.time, rel=1e-9)
        assert sim.frame().velocities == pytest.approx(naive.peculiar, abs=1e-7)
    assert sim.statistics.worst_overlap == 0.0 or sim.statistics.worst_overlap < 1e-13


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(("d", "n", "rate", "law"), [
    (2, 40, -0.4, {"impact": 0.95}), (2, 40, 0.4, {"drive": Andersen(kT=1.0, rate=2.0)}),
    slow(3, 200, 0.4, {}),
], ids=["against the axis", "in a bath", "spheres"])  # fmt: skip
def test_lists_have_the_bits_of_sectors(d, n, rate, law):
    scene = gas(d, n, 0.45, rate, **law)
    lists, sectors = (
        carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors=kind)) for kind in ("lists", "sectors")
    )
    for sim in (lists, sectors):
        sim.run(time=0.6 / abs(rate))
    # Some windows of lists, and the lattice is laid anew.
    assert sectors.collisions == lists.collisions > 3 * n
    assert lists.frame().positions.tobytes() == sectors.frame().positions.tobytes()
    assert flux(lists).tobytes() == flux(sectors).tobytes()


def mixed_in_lists():
    """Return disks of two sizes in lists of two levels, with shear."""
    species = [carom.Species(count=3, diameter=1.0), carom.Species(count=50, diameter=0.3)]
    scene = carom.Scene.random(None, 0.35, 2, species=species, seed=1, motion=Shear(0.5))
    return carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors="lists"))


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("make", [
    lambda: carom.Simulation(gas(2, 60, 0.4, -0.6), seed=1, tuning=carom.Tuning(neighbors="lists")),
    slow(lambda: carom.Simulation(gas(3, 200, 0.4, 0.6), seed=1, tuning=carom.Tuning(neighbors="lists"))),
    mixed_in_lists,
], ids=["disks", "spheres", "two levels"])  # fmt: skip
def test_lists_hold_everybody_who_comes_near_in_their_window(make):
    sim = make()
    rate, seen = sim.scene.motion.rate, set()
    for _ in range(4):
        sim.run(time=0.13 / abs(rate))
        lists = sim._state.engine.neighbors
        tilt = float(lists.window.middle[0])
        seen.add(tilt)
        assert abs(sim.frame().tilt - tilt) <= lists.window.half
        assert listed_now(sim) == near_in_window(sim)
    assert len(seen) > 2


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(("box", "rate", "neighbors"), [
    ((24.0, 7.0), -4.0, "sectors"), ((24.0, 8.0), 8.0, "lists"), ((7.0, 24.0), 8.0, "sectors"),
])  # fmt: skip
def test_nobody_overlaps_in_a_fast_stream_and_a_long_box(box, rate, neighbors):
    scene = carom.Scene.random(96, box=box, seed=1, motion=Shear(rate))
    sim = carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors=neighbors))
    start = sim.frame().tilt
    sim.run(time=1.2 / abs(rate))
    assert sim.collisions > 2 * 96
    assert sim.statistics.worst_overlap < 1e-12
    # Another look, at all pairs: the lattice has tilted over several epochs.
    frame = sim.frame()
    turns = (frame.tilt - start - math.copysign(1.2, rate)) * box[1] / box[0]  # the lattice may be laid anew
    assert turns == pytest.approx(round(turns), abs=1e-9)
    first, second = np.triu_indices(96, 1)
    up = frame.positions[second] - frame.positions[first]
    turns = np.rint(up[:, 1] / box[1])
    up -= turns[:, None] * np.array([frame.tilt * box[1], box[1]])
    up[:, 0] -= np.rint(up[:, 0] / box[0]) * box[0]
    assert np.hypot(*up.T).min() > 1.0 - 1e-12


def test_a_flight_in_a_tilting_lattice_ends_at_the_end_of_its_cell():
    rng = np.random.default_rng(1)
    for rate in (-8.0, -0.5, 4.0, 8.0):
        motion = Sheared(rate, 3.0, np.array([rng.uniform(-1.5, 1.5)]))
        for axis in (0, 1):
            for _ in range(20):
                row = np.zeros((), [("x", "f8", 2), ("v", "f8", 2), ("t", "f8")]).view(np.recarray)
                row.x, row.v, row.t = rng.uniform(2.0, 3.0, 2), rng.normal(size=2), rng.uniform(0.0, 0.01)
                now = float(row.t) + rng.uniform(0.0, 0.01)
                low, high = row.x[axis] - 0.5, row.x[axis] + 0.5
                t, up = motion.exit_time_at(axis, row, now, low, high)
                times = now + t * np.linspace(0.0, 1.0, 33)
                way = np.array([motion.position_at(axis, row.x, row.v, s - row.t, s) for s in times])
                assert way[-1] == pytest.approx(high if up else low, rel=1e-12)
                assert ((low < way[:-1]) & (way[:-1] < high)).all()


def test_a_lattice_stretches_no_more_than_it_is_told_and_that_much():
    """A way of length 1 in space, in the coordinates of the lattice, at all tilts of an epoch."""
    ways = np.exp(2j * np.pi * np.linspace(0.0, 1.0, 4001))
    for box, rate in itertools.product([(24.0, 7.0), (7.0, 24.0), (6.0, 6.0)], (-4.0, 4.0)):
        tilts = [
            start_tilt(Shear(rate, tilt), box) + LONGEST_STRAIN * part
            for tilt, part in itertools.product(np.linspace(-9.0, 9.0, 2000), (-1, 1))
        ]
        longest = max(np.abs(ways.real - tilt * ways.imag).max() for tilt in (min(tilts), max(tilts)))
        told = Shear(rate).stretch(box)
        assert 0.99 * told[0] < longest <= told[0]
        assert told[1:] == (1.0,)


def listed_now(sim):
    """Return the pairs in lists, which are in both."""
    found = lists_of(sim)
    assert all(i in found[j] for i, mine in enumerate(found) for j in mine)
    return {(i, int(j)) for i, mine in enumerate(found) for j in mine if i < j}


def near_in_window(sim):
    """Return the pairs whose reference points are within the range of lists at that tilt of the window which
    brings them nearest.
    """
    lists, n, d = sim._state.engine.neighbors, sim.scene.n, sim.scene.dimension
    size = coordinate_bits(d)
    steps = lists.reference[:, None] >> (np.uint64(size) * np.arange(d, dtype=np.uint64))
    points = (steps & np.uint64(2**size - 1)).astype(float) * np.array(lists.grid_step)
    apart = points[None] - points[:, None]
    apart -= np.rint(apart / sim.scene.box) * sim.scene.box
    middle, half = lists.window.middle[0], lists.window.half
    up = apart[..., 1]
    best = np.divide(-apart[..., 0], up, out=np.zeros_like(up), where=up != 0.0)
    best = np.clip(best, middle - half, middle + half)
    square = (apart[..., 0] + best * up) ** 2 + (apart[..., 1:] ** 2).sum(axis=-1)
    within = np.array([[lists.bounds.list_range_sq(i, j) for j in range(n)] for i in range(n)])
    return {(i, j) for i, j in np.argwhere(square <= within).tolist() if i < j}


def test_a_way_is_multiplied_with_a_move_as_in_space_at_every_tilt_of_a_window(monkeypatch):
    """In lattice coordinates the product of a way r and a move s is r . (M^T M s), with M of the tilt."""
    monkeypatch.setattr(grid, "grid_difference", lambda move, to, since, axis: move[axis])
    pull = getattr(grid.pull, "py_func", grid.pull)
    rng, closest = np.random.default_rng(4), 0.0
    for _ in range(200):
        middle, half, move = rng.uniform(-0.6, 0.6), rng.uniform(0.05, 0.2), rng.normal(size=3)
        window = grid.TiltWindow(np.array([middle]), half)
        found = np.array([pull(window, move, 1, 0, axis) for axis in range(3)])
        for tilt in middle + half * np.linspace(-1.0, 1.0, 9):
            shear = np.array([[1.0, tilt, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
            apart = np.abs(shear.T @ shear @ move - found[:, 0])
            assert (apart <= found[:, 1] + 1e-14).all()
            assert tilt != middle or apart.max() < 1e-14
            closest = max(closest, (apart[:2] / found[:2, 1]).min())
    assert closest > 0.9  # no wider than needed


@pytest.mark.parametrize(("box", "n"), [((7.0, 6.0), 16), ((12.0, 11.0), 40)])
def test_collisions_of_growing_disks_are_those_of_all_pairs_and_images(plain, box, n):
    rng, side = np.random.default_rng(5), int(np.ceil(n**0.5))
    places = (np.argwhere(np.ones((side, side)))[:n] + 0.5) * np.array(box) / side
    peculiar = rng.normal(size=places.shape)
    peculiar -= peculiar.mean(axis=0)
    naive = Naive(places, peculiar, box, 0.7, growth=0.05)
    sim = carom.Simulation(carom.Scene(places, box, velocities=peculiar, motion=Shear(0.7)), growth=0.05)
    for _ in range(6):
        naive.run(8)
        sim.run(collisions=8)
        # Chaos: an error grows about tenfold with a collision of each, of which there are at most six.
        assert sim.time == pytest.approx(naive.time, rel=1e-8)
        assert sim.frame().velocities == pytest.approx(naive.peculiar, abs=1e-6)
        assert sim.frame().diameters[0] == pytest.approx(naive.diameter, rel=1e-8)
    assert sim.statistics.worst_overlap < 1e-12
    assert sim.time * 0.7 > 0.5


@pytest.mark.parametrize(("d", "n", "collisions"), [(2, 100, 100), (3, 40, 60)])
def test_no_shear_is_free_flight_to_the_last_bit(plain, d, n, collisions):
    still = carom.Simulation(gas(d, n, rate=0.0), seed=1)
    free = carom.Simulation(
        carom.Scene.random(n, 0.2, d, seed=1), seed=1, tuning=carom.Tuning(neighbors="sectors")
    )
    for sim in (still, free):
        sim.run(collisions=collisions)
    assert still.frame().positions.tobytes() == free.frame().positions.tobytes()


@pytest.mark.filterwarnings("ignore:Fewer than")
@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("law", [{}, {"impact": Rough(tangential=1.0)}], ids=["smooth", "rough"])
@pytest.mark.parametrize(("d", "n"), [(2, 20), slow(2, 300), slow(3, 300)])
def test_energy_grows_by_the_work_of_the_stream(d, n, law):
    sim = carom.Simulation(gas(d, n, **law), seed=1)

    def energy():
        turning = (1 if d == 2 else 3) * n * sim.kT_rotational if law else 0.0
        return 0.5 * (sim.degrees_of_freedom * sim.kT + turning)

    before = energy()
    tensor = sim.measure(carom.PressureTensor(), time=1.5, blocks=16)
    gained = energy() - before
    # The viscosity is the work over the rate's square, the volume and the time, but for 1 / (n - 1).
    work = tensor.viscosity.mean * 0.7**2 * np.prod(sim.scene.box) * 1.5
    assert work == pytest.approx(gained, rel=1.0 / (n - 1))
    assert gained > 0.1 * before
    assert sim.statistics.energy_drift < 1e-12
    assert sim.statistics.momentum_drift < 1e-13
    assert sim.statistics.worst_overlap < 1e-12


@pytest.mark.parametrize("rate", [0.1, -0.1])  # so small that epochs, which count all anew, are long
def test_the_flight_before_a_kick_counts(plain, rate):
    """The integral of the peculiar momentum flux is that over frames; nobody meets anybody here."""
    bath = Andersen(kT=1.0, rate=1.0)
    scene = carom.Scene(
        [[1.0, 1.0], [5.0, 4.0]], (8.0, 6.0), diameter=1e-3, mass=[1.0, 3.0], motion=Shear(rate), drive=bath
    )
    sim, whole = (carom.Simulation(scene, seed=1) for _ in range(2))
    step, moments = 2.0**-7, []
    for frame in itertools.chain([sim.frame()], sim.sample(every=step, count=512)):
        moments.append(np.einsum("i,ia,ib->ab", scene.masses, frame.velocities, frame.velocities))
    moments, kicks = np.array(moments), int(sim.drive.drawn.sum())
    assert sim.collisions == 0
    assert kicks > 4
    integral = step * (moments.sum(axis=0) - 0.5 * (moments[0] + moments[-1]))
    # A kick between two frames is half a step off at most.
    bound = 0.5 * step * kicks * np.ptp(moments, axis=0).max()
    whole.run(time=4.0)  # a stop would count the flight up to it
    found = momentum_flux(whole._state)
    assert np.abs(found.carried - integral).max() < bound
    assert bound < 0.05 * np.abs(integral).max()
    assert not found.handed_over.any()


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("rate", [0.7, -0.7])
def test_sums_over_a_flight_are_those_of_its_velocities(d, rate):
    rng = np.random.default_rng(d)
    masses, u = rng.uniform(0.5, 2.0, 5), rng.normal(size=(5, d)) + 1.0
    sums = make_stream_sums(rate, masses, u, np.full(d, True))
    fly(sums, 0.3)
    fly(sums, 0.8)

    def moments(t):
        v = u.copy()
        v[:, 0] -= rate * t * u[:, 1]
        v -= np.average(v, axis=0, weights=masses)
        return np.einsum("i,ia,ib->ab", masses, v, v)

    assert sums.moments == pytest.approx(moments(0.8), rel=1e-13, abs=1e-13)
    places, weights = np.polynomial.legendre.leggauss(2)  # exact up to cubes of the time
    integral = sum(0.4 * weight * moments(0.4 * (1.0 + x)) for x, weight in zip(places, weights, strict=True))
    assert sums.integral == pytest.approx(integral, rel=1e-13, abs=1e-13)


def mixture_in_shear():
    species = [carom.Species(count=30), carom.Species(count=30, diameter=0.5, mass=0.2)]
    return carom.Scene.random(None, 0.3, 2, species=species, seed=1, motion=Shear(0.5))


@pytest.mark.usefixtures("both_ways")
def test_the_balance_holds_for_mixtures_after_rescaling():
    sim = carom.Simulation(mixture_in_shear(), seed=1)
    sim.run(collisions=200)
    stress = flux(sim)
    sim.rescale(1.0)
    assert flux(sim) == pytest.approx(stress, rel=1e-12)
    before = stress[1, 0]
    energy = 0.5 * sim.degrees_of_freedom * sim.kT
    sim.run(collisions=200)
    gained = 0.5 * sim.degrees_of_freedom * sim.kT - energy
    assert gained == pytest.approx(-0.5 * (flux(sim)[1, 0] - before), rel=1e-11)


@pytest.mark.slow
def test_the_stream_heats_a_mixture_in_a_bath():
    scene = mixture_in_shear()
    bath = carom.Simulation(scene.replace(drive=Andersen(kT=1.0, rate=3.0)), seed=1)
    bath.run(collisions_per_particle=50)
    start, since = flux(bath), bath.time
    block = bath.run(collisions_per_particle=200)
    mean = (flux(bath) - start) / (bath.time - since)
    # The bath takes what the stream gives; kT is above that of the bath, whose kicks are rare.
    assert 1.0 < block.kT < 1.3
    assert mean[0, 1] < 0.0
    assert mean[0, 1] == pytest.approx(mean[1, 0], rel=1e-9)


def test_time_runs_backwards(plain):
    scene = gas(2, 30)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions=40)
    there = sim.frame()
    assert abs(there.time * 0.7) > 0.3
    back = carom.Simulation(
        carom.Scene(there.positions, scene.box, velocities=-there.velocities, motion=Shear(-0.7, there.tilt))
    )
    back.run(time=there.time)
    distance = back.frame().positions - scene.positions
    distance -= np.rint(distance / scene.box) * scene.box
    assert np.abs(distance).max() < 1e-6


def test_unwrapped_paths_are_continuous(plain):
    sim = carom.Simulation(gas(2, 20, 0.05), seed=1)
    before = sim.frame()
    for _ in range(150):
        sim.run(time=0.02)
        frame = sim.frame()
        lab = before.velocities + 0.7 * np.outer(before.unwrapped[:, 1], [1.0, 0.0])
        moved = frame.unwrapped - before.unwrapped
        # Nobody collides twice in so short a time, and a collision changes a velocity by some thermal ones.
        speeds = np.abs(lab).max() + 8.0
        assert np.abs(moved).max() < 0.02 * speeds
        before = frame
    assert sim.time * 0.7 > 1.5


@pytest.mark.slow
def test_uniform_shear_of_inelastic_spheres_has_the_published_rate():
    scene = carom.Scene.random(1372, density=0.5, seed=1, motion=Shear(1.0), impact=0.9)
    sim = carom.Simulation(scene, kT=1.3, seed=1)
    sim.run(time=40.0)
    before = sim.collisions
    tensor, pressure = sim.measure(carom.PressureTensor(), carom.Pressure(), time=300.0)
    # DynamO's own test of this system (shearing_test.cpp) says 0.1132, within 1 %.
    assert 1372 * 300.0 / (2 * (sim.collisions - before)) == pytest.approx(0.1132, rel=0.01)
    # A naive driver had T = 1.312(5), viscosity 0.571(6), p = 2.08(1), N1 / p = 0.043(7), N2 / p = 0.029(4).
    # Here 300 strains, as kT changes over some ten: four errors of both.
    p = tensor.pressure
    for found, told, error in (
        (tensor.viscosity, 0.571, 0.006), (p, 2.08, 0.01),
        (tensor.normal_stresses[0].scaled(1.0 / p.mean), 0.043, 0.007),
        (tensor.normal_stresses[1].scaled(1.0 / p.mean), 0.029, 0.004),
    ):  # fmt: skip
        assert found.mean == pytest.approx(told, abs=4.0 * np.hypot(error, found.error))
    assert pressure.kT == pytest.approx(1.312, abs=0.03)
    assert pressure.pressure.mean == pytest.approx(p.mean, rel=1e-9)


def test_distances_in_a_tilted_cell_are_those_of_the_nearest_image():
    rng = np.random.default_rng(2)
    box, tilt = np.array([6.0, 5.0, 4.0]), 0.55
    room = Geometry(box, np.ones(3, bool), (), tilt)
    places = room.wrapped(rng.uniform(-9.0, 9.0, (60, 3)))
    pairs = np.stack(np.triu_indices(60, 1), axis=1)
    cell = np.diag(box)
    cell[1, 0] = tilt * box[1]
    turns = np.stack(np.meshgrid(*[np.arange(-2, 3)] * 3), axis=-1).reshape(-1, 3) @ cell
    told = np.array([np.linalg.norm(places[j] - places[i] + turns, axis=1).min() for i, j in pairs])
    close = told < 1.5
    assert room.distances(places, pairs)[close] == pytest.approx(told[close], rel=1e-12)
    assert {tuple(sorted(each)) for each in room.near(places, 1.5).tolist()} == {
        tuple(each) for each in pairs[close].tolist()
    }
    found = room.between(places[:30], places[30:], 1.5)
    assert len(found) == sum(1 for i, j in pairs[close] if i < 30 <= j)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(("suffix", "d"), [("h5md", 2), ("extxyz", 2), ("h5md", 3), ("gsd", 3)])
def test_files_hold_the_tilted_cell_and_a_run_goes_on_from_them(suffix, d, tmp_path):
    scene = gas(d, 12)
    sim = carom.Simulation(scene, seed=1)
    path = tmp_path / f"run.{suffix}"
    sim.write(path, every=0.25, count=5)
    with carom.io.open(path) as frames:
        last = frames[-1]
    mine = sim.frame()
    assert last.tilt == mine.tilt != 0.0
    rounding = 0.0 if suffix != "gsd" else 1e-6
    assert last.positions == pytest.approx(mine.positions, abs=rounding * 10.0)
    again = carom.Scene.from_frame(last, motion=Shear(0.7))
    more = carom.Simulation(again)
    more.run(collisions=10)
    assert more.statistics.worst_overlap < 1e-12
    cell = np.diag([*scene.box, *[max(scene.box)] * (3 - d)])
    cell[1, 0] = mine.tilt * scene.box[1]
    if suffix == "extxyz":
        atoms = ase.io.read(path)
        assert atoms.cell[:] == pytest.approx(cell)
        assert carom.io.from_ase(atoms).tilt == mine.tilt
    if suffix == "h5md":
        plain = MDAnalysis.Universe(str(path))
        plain.trajectory[-1]
        assert plain.trajectory.ts.triclinic_dimensions == pytest.approx(cell, abs=1e-5)


def test_overlaps_of_single_precision_are_parted_across_a_tilted_face():
    edge, tilt, u = 4.0, 0.3, np.array([0.6, 0.8])
    here = np.array([2.0, 0.3])
    above = here - (1.0 - 5e-8) * u + edge * np.array([tilt, 1.0])
    frame = carom.Frame(
        0.0, 0, np.array([here, above]), np.zeros((2, 2)), (edge, edge), np.ones(2), np.ones(2), tilt=tilt
    )  # fmt: skip
    with pytest.warns(carom.CaromWarning, match="moved apart"):
        scene = carom.Scene.from_frame(frame, motion=Shear(1.0))
    assert np.abs(scene.positions - frame.positions).max() < 1e-5


@pytest.mark.parametrize(("n", "fraction", "d", "tilt"), [(60, 0.6, 2, 0.3), (60, 0.45, 3, -0.4)])
def test_a_random_start_in_a_tilted_cell_has_no_overlap(n, fraction, d, tilt):
    # A scene refuses overlaps, as it does those of this start with another tilt.
    scene = carom.Scene.random(n, fraction, d, motion=Shear(1.0, tilt), seed=1)
    with pytest.raises(carom.OverlapError):
        carom.Scene(scene.positions, scene.box, motion=Shear(1.0))
    with pytest.raises(InputError, match=r"up to packing fraction 0\.714"):
        carom.Scene.random(n, 0.78, 2, motion=Shear(1.0, tilt))


@pytest.mark.needs("OVITO")
def test_ovito_sees_the_tilted_cell():
    sim = carom.Simulation(gas(3), seed=1)
    sim.run(time=0.5)
    frame = sim.frame()
    cell = np.diag(frame.box)
    cell[1, 0] = frame.tilt * frame.box[1]
    assert np.asarray(frame.to_ovito().cell)[:, :3] == pytest.approx(cell.T)


def nothing(unit, event):
    """A rule that changes nothing."""


@pytest.mark.parametrize(("change", "said"), [
    (lambda: carom.Scene.random(10, 0.2, 1, motion=Shear(1.0)), "found one dimension"),
    (lambda: gas(2, 10, walls="y"), "leave out the walls"),
    (lambda: carom.Scene([[5, 5]], 9.0, motion=Shear(1.0), obstacles=[Ball([1, 1], 0.5)]), "hold the stream"),
    (lambda: carom.Scene([[5, 5]], 9.0, species=[0], motion=Shear(1.0), interaction=Ranges(
        [Kind("one", (2.0,))], nothing)), "and Shear bends"),
    (lambda: carom.Simulation(gas(2, 4), tuning=carom.Tuning(neighbors="lists")), "use neighbors='sectors'"),
    (lambda: carom.Simulation(gas(2), tuning=carom.Tuning(precision="single")), "is for straight flight"),
    (lambda: carom.Scene.from_frame(next(carom.Simulation(gas(2, 9)).sample(every=0.1))), "sheared box"),
    (lambda: Shear(float("nan")), "rate of Shear"),
], ids=range(8))  # fmt: skip
def test_what_cannot_be_sheared_is_one_sentence(plain, change, said):
    with pytest.raises(carom.InputError, match=said) as caught:
        change()
    assert "\n" not in str(caught.value)


def test_pairs_are_counted_in_the_tilted_cell_of_each_frame(plain):
    species = [carom.Species(count=25), carom.Species(count=25, diameter=0.7)]
    scene = carom.Scene.random(None, 0.3, 2, species=species, seed=1, motion=Shear(0.5))
    frames = list(carom.Simulation(scene, seed=1).sample(every=0.3, count=4))
    pairs = carom.RDF(pair=(0, 1), rmax=2.0, width=0.25)
    alone = sum(pairs.over([frame]).counts for frame in frames)
    assert pairs.over(frames).counts.tolist() == alone.tolist()
    assert abs(frames[-1].tilt) > 0.1
