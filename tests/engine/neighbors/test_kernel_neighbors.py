"""Sectors and lists against a search among all pairs, while a run goes on."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from helpers.marks import slow
from helpers.mixtures import mixture
from helpers.neighbors import check_invariants, check_lists, go, present
from helpers.oracle import moving

import carom
from carom.engine.neighbors import build, lists, plan as scheme
from carom.engine.neighbors.prefetch import HUGE, LARGE
from carom.scene import lattices
from carom.simulation.autotune import Pace


def check_sectors(sim):
    """Everyone is a member of one sector, and no further from where it lies than its slack."""
    sectors, n, edges = sim._state.engine.neighbors, sim.scene.n, np.array(sim.scene.box)
    shape = np.array(sectors.shape)
    slacks = np.broadcast_to(sectors.slacks, (n + 1, len(edges)))
    if sectors.extra_slack is not None:
        slacks = np.where(slacks > 0.0, slacks + sectors.extra_slack[:, None], 0.0)
    members = [(int(i), cell) for cell, row in enumerate(sectors.members) for i in row[: row[-1]]]
    assert sorted(i for i, _ in members) == list(range(n))
    # Two that touch are in neighboring sectors, however far beyond theirs: from the scene's diameters.
    sides = np.array(sim.scene.box) / shape
    most = np.where(slacks[:n] > 0.0, slacks[:n] + 0.5 * sim.scene.diameters[:, None], 0.5 * sides)
    assert (2.0 * most <= sides).all()
    x, v, now = present(sim)
    leave = sim._state.engine.state.crossing_time
    for i, cell in members:
        place = sectors.cell[i].astype(int)
        assert ((place >= 0) & (place < shape)).all()
        assert np.ravel_multi_index(place, shape) == cell
        low = (place + sectors.wraps[i] * shape) * np.array(sectors.sides)
        # By rounding, a component may be on either side of a face.
        slack = slacks[i] + 1e-12 * edges
        assert (x[i] >= low - slack).all()
        assert (x[i] <= low + sides + slack).all()
        ahead = x[i] + v[i] * (leave[i] - now)
        assert (ahead >= low - slack).all()
        assert (ahead <= low + sides + slack).all()


CASES = [
    (1, 12, 0.4, "sectors"), (1, 20, 0.4, "lists"), (2, 30, 0.5, "sectors"), (2, 40, 0.5, "lists"),
    (2, 5, 0.4, "sectors"), (3, 40, 0.3, "sectors"), (3, 60, 0.4, "lists"), (3, 4, 0.2, "sectors"),
    (4, 12, 0.1, "sectors"), (2, 60, 0.1, "sectors"), slow(3, 130, 0.1, "sectors"),
]  # fmt: skip


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(("dimension", "n", "packing_fraction", "kind"), CASES)
def test_invariants_hold_after_every_cycle(dimension, n, packing_fraction, kind):
    scene = moving(carom.Scene.random(n, packing_fraction, dimension, seed=n), n)
    sim = carom.Simulation(
        scene,
        tuning=carom.Tuning(neighbors=kind, shell=1.2 if kind == "lists" else None),
    )
    assert sim._state.scheme.kind == kind
    for _ in range(120):
        check_invariants(sim)
        go(sim, 1)
    assert sim.collisions >= n // 5


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(("dimension", "n"), [slow(1, 40), (2, 60), slow(3, 150), slow(4, 160)])
def test_lists_stay_symmetric_and_complete(dimension, n):
    eta = {1: 0.5, 2: 0.5, 3: 0.4, 4: 0.1}[dimension]
    scene = moving(carom.Scene.random(n, eta, dimension, seed=1), 2)
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="lists", shell=1.15))
    for _ in range(6):
        check_lists(sim)
        go(sim, 4 * n)
    check_lists(sim)
    assert sim.statistics.transits > n


def test_a_root_from_above_is_at_most_six_per_cent_too_large():
    x = np.append(np.geomspace(1e-300, 1e300, 4001), 4.0 ** np.arange(-20, 20))
    ratio = np.array([lists.root_above(each) for each in x]) / np.sqrt(x)
    assert ratio.min() > 1.0 + 1e-14
    assert 1.05 < ratio.max() < 1.0607


def test_a_list_is_renewed_before_its_surface_leaves_the_bound_though_at_rest_it_only_grows(plain):
    scene = carom.Scene.random(60, 0.3, 2, seed=1)
    velocities = np.random.default_rng(1).normal(size=(60, 2)) * (np.arange(60) % 2)[:, np.newaxis]
    tuning = carom.Tuning(neighbors="lists")
    sim = carom.Simulation(scene.replace(velocities=velocities), growth=0.5, tuning=tuning)
    sim.run(time=1e-9)
    engine = sim._state.engine
    skins, rates = np.array([engine.neighbors.bounds.skin_at(i, 0.0) for i in range(60)]).T
    leaves = skins / (np.linalg.norm(engine.state.rows["v"][:60], axis=1) + rates)
    assert (engine.state.crossing_time <= leaves).all()
    assert (engine.state.crossing_time > 0.49 * leaves).all()
    bounds, half = engine.neighbors.bounds, 0.5 * skins / rates
    for i in range(60):  # half of it is grown over in this time
        assert bounds.skin_at(i, half[i])[0] == pytest.approx((1.0 - 0.5 * bounds.slack) * skins[i], rel=1e-9)
    assert bounds.skin_at(0, 1e9)[0] > 0.0  # outgrown: times are divided by it


@pytest.mark.parametrize("box", [(9.0,), (1.2, 8.0), (5.5, 2.3), (3.4, 1.1, 4.0), (4.5, 2.2, 6.0)])
def test_members_of_sectors_are_where_their_positions_are(plain, box):
    n = max(2, int(0.25 * np.prod(box)))
    sim = carom.Simulation(
        moving(carom.Scene.random(n, box=box, seed=1), 2), tuning=carom.Tuning(neighbors="sectors")
    )
    for _ in range(20):
        check_sectors(sim)
        go(sim, 2 * n)
    assert sim.statistics.transits > 3 * n


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(
    ("dimension", "n", "mixed"),
    [(2, 40, True), (2, 40, False), *(slow(d, n, True) for d, n in ((1, 20), (3, 160), (4, 800)))],
)
def test_a_component_stays_in_its_sector_a_little_beyond_it(dimension, n, mixed, monkeypatch):
    eta = {1: 0.2, 2: 0.1, 3: 0.05, 4: 0.03}[dimension]
    scene = carom.Scene.random(n, eta, dimension, seed=1)
    if mixed:
        sizes = {"diameters": [1.0, 0.5], "masses": [1.0, 0.5**dimension], "dimension": dimension}
        scene = mixture([n // 2, n // 2], packing_fraction=eta, seed=1, **sizes)
    scene = moving(scene, 2)
    loose = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"))
    monkeypatch.setattr(build, "slacks_of", lambda scheme, system: [0.0] * dimension)
    strict = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"))
    sectors = loose._state.engine.neighbors
    sides, slacks = np.array(sectors.sides), np.array(sectors.slacks)
    assert (slacks > 0.0).all()
    # Two that touch are in neighboring sectors.
    most = np.broadcast_to(slacks, (n, dimension))
    if mixed:
        most = most + sectors.extra_slack[:n, None]
        assert (most[scene.diameters == 0.5].min(axis=0) > slacks).all()
    contact = 0.5 * scene.diameters
    assert (sides - (most + contact[:, None])[:, None] - (most + contact[:, None])[None] >= 0.0).all()
    outside = 0
    for _ in range(10):
        for sim in (loose, strict):
            go(sim, 2 * n)
            check_sectors(sim)
        place = np.floor(present(loose)[0] / sides).astype(int) % np.array(sectors.shape)
        outside += int((place != sectors.cell[:n]).any(axis=1).sum())
    assert outside > n
    # The same collisions, found with fewer crossings.
    for sim in (loose, strict):
        sim.run(collisions_per_particle=20)
    assert loose.statistics.transits < 0.7 * strict.statistics.transits


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(
    ("kind", "room"),
    [
        ("lists", {"capacity": 1}),
        # Compiled code alone reads beyond the end of cells for fewer than a register's members.
        slow("lists", {"cell_capacity": 1}),
        # Large sectors, or they could not hold more than fits into the smallest room.
        ("sectors", {"cell_capacity": 1, "shape": (2, 2)}),
    ],
)
def test_arrays_that_are_too_small_grow(kind, room, monkeypatch):
    scene = moving(carom.Scene.random(40, 0.5, 2, seed=1), 2)
    settings = {"tuning": carom.Tuning(neighbors=kind, shell=1.2 if kind == "lists" else None)}
    usual = carom.Simulation(scene, **settings)
    choose = scheme.choose
    monkeypatch.setattr(scheme, "choose", lambda *a: dataclasses.replace(choose(*a), heap=16, **room))
    small = carom.Simulation(scene, **settings)
    grown = next(iter(room))
    assert getattr(small._state.scheme, grown) > 1, "grown before the first event"
    for sim in (usual, small):
        sim.run(collisions=200)
        (check_lists if kind == "lists" else check_sectors)(sim)
        check_invariants(sim)
    # Room is no physics: the same collisions, up to the rounding of times predicted anew where arrays grew.
    assert small.statistics.energy_drift < 1e-13
    assert small.statistics.worst_overlap < 1e-13


@pytest.mark.parametrize("kind", ["lists", "sectors"])
def test_room_changes_no_collision(plain, kind, monkeypatch):
    # The initial capacities are found too small before the first event: nothing is predicted twice then.
    scene = moving(carom.Scene.random(60, 0.5, 2, seed=1), 2)
    right = carom.Simulation(scene, tuning=carom.Tuning(neighbors=kind))
    choose = scheme.choose
    monkeypatch.setattr(scheme, "choose", lambda *a: dataclasses.replace(choose(*a), heap=1))
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors=kind))
    right.run(collisions=200)
    sim.run(collisions=200)
    np.testing.assert_array_equal(sim.frame().positions, right.frame().positions)


@pytest.mark.parametrize("mixed", [False, slow(True)])
@pytest.mark.parametrize("n", [LARGE, HUGE])
def test_looking_ahead_changes_no_collision(n, mixed, tmp_path, monkeypatch):
    ways = itertools.cycle([True, False])  # sectors look ahead in every other call
    monkeypatch.setattr(Pace, "first", lambda pace: next(ways))
    # Lists and sectors look ahead to other things, and both to more from one size on, and from the next.
    edge = math.ceil(n**0.5)
    assert edge**2 >= n > (edge - 2) ** 2
    block = carom.Scene.crystal(lattice=lattices.cubic(2), cells=edge, packing_fraction=0.3)
    sizes = 1.0 - 0.5 * (np.arange(block.n) % 2) if mixed else 1.0
    scene = moving(carom.Scene(block.positions, block.box, diameter=sizes), 3)
    frames = []
    for kind in ("lists", "sectors"):
        # Lists with a log, which the tests of several workers have: nothing more is to be compiled.
        log = tmp_path / "events.h5" if kind == "lists" else None
        sim = carom.Simulation(scene, event_log=log, tuning=carom.Tuning(neighbors=kind))
        sim.run(collisions=n)
        assert sim.statistics.transits > 20
        frames.append(next(sim.sample(times=[1.001 * sim.time])))
    # Two collisions a particle multiply an error by some hundreds, but by far more after a graze or two.
    one, other = frames
    assert one.step == other.step
    np.testing.assert_allclose(one.unwrapped, other.unwrapped, rtol=1e-7)
    np.testing.assert_allclose(one.velocities, other.velocities, rtol=0.0, atol=1e-7)


@pytest.mark.slow
def test_lists_whose_places_would_be_too_coarse_are_refused():
    # Four axes share 64 bits: 2^16 steps of a box of 1e5 diameters are longer than the margin.
    scene = carom.Scene([[1.0, 2.0, 2.0, 2.0], [5.0, 2.0, 2.0, 2.0]], box=[1e5, 4.0, 4.0, 4.0])
    with pytest.raises(carom.InputError, match="too coarse"):
        carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors="lists", shell=1.4))
    assert carom.Simulation(scene, seed=1, tuning=carom.Tuning(shell=1.4)).run(collisions=10).collisions == 10
