"""Thin systems: paths through many images of the box, beside the oracle, and what is chosen for them."""

import itertools
import json

import numpy as np
import pytest
from helpers.marks import slow
from helpers.mixtures import mixture
from helpers.oracle import assert_equal_to_oracle, moving
from helpers.oracle_scenes import case, check, placed
from helpers.scripts import python

import carom
from carom.engine.constants import LAMBDA
from carom.engine.neighbors import plan as scheme, sizes
from carom.engine.neighbors.contact_cache import CAPACITY, best_of, contact_of, keep, make_contacts
from carom.engine.state import State
from carom.models.interfaces.particles import NEVER
from carom.simulation.system_of_scene import prepare


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(
    ("dimension", "n", "size"),
    [
        (2, 9, {"packing_fraction": 0.01}),
        (2, 7, {"box": (9.0, 47.0), "diameter": 1.0}),
        slow(2, 70, {"packing_fraction": 0.02}),
        (3, 6, {"packing_fraction": 0.01}),
        slow(3, 8, {"packing_fraction": 1e-3}),
        slow(4, 16, {"packing_fraction": 0.01}),
        slow(3, 70, {"packing_fraction": 0.02}),
    ],
)
def test_looking_at_everybody_finds_the_oracle_s_collisions(dimension, n, size, tmp_path):
    scene = moving(carom.Scene.random(n, dimension=dimension, seed=n, **size), n + 100)
    assert_equal_to_oracle(scene, 2 * n, tmp_path, at_least=n, tuning=carom.Tuning(neighbors="all"))


def first_contacts(scene, span):
    """Return {(i, j): time} of the first contact of each pair in all images, if it is within a time."""
    x, v, found = scene.positions, scene.velocities, {}
    images = np.array(list(itertools.product(range(-6, 7), repeat=scene.dimension))) * scene.box
    for i, j in itertools.combinations(range(scene.n), 2):
        r, u = x[j] - x[i] + images, v[j] - v[i]
        b, c = r @ u, np.sum(r * r, axis=1) - scene.diameter**2
        square = b * b - u @ u * c
        times = np.where((b < 0.0) & (square > 0.0), c / (np.sqrt(np.abs(square)) - b), np.inf)
        if times.min() <= span:
            found[i, j] = times.min()
    return found


@pytest.mark.usefixtures("plain")
# In the first some lose their partner to who is asked after them: to ask all once is too few.
@pytest.mark.parametrize(("n", "size"), [(60, {"packing_fraction": 0.1}), (40, {"box": (9.0, 47.0)})])
def test_an_epoch_begins_with_all_its_first_contacts_and_the_earliest_are_taken(n, size):
    scene = moving(carom.Scene.random(n, dimension=2, seed=1, **size), n + 101)
    model, state, everybody, _, tallies, *_ = carom.Simulation(
        scene, tuning=carom.Tuning(neighbors="all")
    )._state.engine
    everybody.begin_epoch(model, state, tallies[0])
    contacts = first_contacts(scene, everybody.span)
    kept = {}
    for i in range(n):
        for k in range(everybody.contacts.counts[i]):
            contact = contact_of(everybody.contacts, i, k)
            kept[i, int(contact.other)] = float(contact.event_time)
    assert kept == pytest.approx({(a, b): t for (i, j), t in contacts.items() for a, b in ((i, j), (j, i))})
    events = {}
    for (i, j), t in sorted(contacts.items(), key=lambda pair: pair[1]):
        if not {i, j} & {*events}:
            events |= {i: (j, t), j: (i, t)}
    assert len(events) > n // 3
    for i in range(n):
        found = int(state.partner[i]), float(state.rows.event_time[i])
        assert found == pytest.approx(events.get(i, (LAMBDA, NEVER)))


@pytest.mark.slow
@pytest.mark.parametrize("box", [(8.0, 9.0), (4.3, 4.9)])
def test_so_it_does_for_sizes_and_masses_of_their_own(box):
    check(case(placed(6, box, 3)), "all")


@pytest.mark.slow
def test_so_it_does_for_a_contact_matrix():
    contact = [[1.0, 0.65], [0.65, 0.6]]
    scene = mixture([4, 4], diameters=[1.0, 0.6], contact=contact, box=(8.0, 9.0), seed=30)
    check(case(moving(scene, 5)), "all")


def chosen(n, dimension, packing_fraction, **more):
    scene = carom.Scene.random(n, packing_fraction, dimension, seed=1, **more)
    return scheme.choose(prepare(scene, np.ones_like(scene.positions)), dimension**0.5)


@pytest.mark.parametrize(("n", "dimension"), [(500, 3), (100, 2), (10, 3), (10, 2)])
def test_where_flights_cross_the_box_everybody_is_looked_at(n, dimension):
    assert chosen(n, dimension, 1e-6).kind == "all"


def test_wider_sectors_where_flights_are_long():
    for n, dimension in ((2000, 2), (10_000, 3)):
        found = chosen(n, dimension, 1e-4)
        members = n / np.prod(found.shape)
        assert found.kind == "sectors"
        assert members > 1.5 * sizes.SECTOR**dimension


@pytest.mark.parametrize(("dimension", "packing_fraction"), [(2, 0.05), (2, 0.3), (3, 0.05), (3, 0.2)])
def test_ordinary_densities_keep_their_sectors(dimension, packing_fraction):
    n = 1000
    found = chosen(n, dimension, packing_fraction)
    scene = carom.Scene.random(n, packing_fraction, dimension, seed=1)
    side = max(sizes.SECTOR * (scene.volume / n) ** (1.0 / dimension), 1.0 + 2.0**-40)
    assert found.shape == tuple(int(edge / side) for edge in scene.box)


@pytest.mark.parametrize(
    ("dimension", "packing_fraction", "listed"), [(2, 0.54, 10), (2, 0.55, 8), (2, 0.7, 8), (3, 0.49, 14)]
)
def test_lists_are_as_long_as_runs_fastest(dimension, packing_fraction, listed, unscheduled):
    scene = carom.Scene.crystal(dimension=dimension, cells=10, packing_fraction=packing_fraction)
    shell = carom.Simulation(scene, tuning=carom.Tuning(neighbors="lists"))._state.scheme.list_range
    assert 2.0**dimension * packing_fraction * shell**dimension - 1.0 == pytest.approx(listed, rel=1e-6)


def test_a_box_in_whose_images_a_collision_takes_seconds_is_refused_with_what_it_costs(unscheduled):
    # 3^12 sectors are searched at each crossing, some 500 crossings for a collision: 2.7 s by estimate. Its
    # flight is V / (n sqrt(2) c) = 36, c = 1.88 the ball of eleven dimensions; the speed is a mean square.
    says = r"about 2\.7 s: there is one in 36 length .* 3\^12 .* edges of at least 3 times"
    with pytest.raises(carom.errors.InputError, match=says):
        carom.Simulation(carom.Scene.random(3, box=(1.6,) * 12, seed=1))
    carom.Simulation(carom.Scene.random(3, box=(4.0,) * 12, seed=1))
    carom.Simulation(carom.Scene.random(3, box=(1.6,) * 8, seed=1))


def test_what_everybody_needs_is_said():
    scene = carom.Scene.random(5, 0.01, 2, seed=1, walls=True)
    with pytest.raises(carom.InputError, match="needs a box that is periodic"):
        carom.Simulation(scene, tuning=carom.Tuning(neighbors="all"), seed=0)
    with pytest.raises(carom.InputError, match="3 times the largest diameter"):
        carom.Simulation(carom.Scene.random(2, 0.3, 2, seed=1), tuning=carom.Tuning(neighbors="all"), seed=0)


@pytest.mark.slow
def test_a_few_in_a_box_of_a_thousand_diameters_collide_at_once():
    scene = carom.Scene.random(6, dimension=3, box=(1000.0,) * 3, diameter=1.0, seed=1)
    sim = carom.Simulation(scene, seed=1)
    block = sim.run(collisions=10)
    assert block.collisions == 10
    # A collision takes 3e4 boxes of flight: sectors were crossed a hundred thousand times for it.
    assert sim.statistics.transits < 10 * 6 * 1000


def test_contacts_that_are_kept_pass_through_a_checkpoint(plain, tmp_path):
    """Between two collisions of an epoch the contacts kept are all that is known of the next ones."""
    scene = carom.Scene.random(20, dimension=2, packing_fraction=0.02, seed=2)
    straight = carom.Simulation(scene, seed=3, tuning=carom.Tuning(neighbors="all"))
    straight.run(collisions=13)
    straight.save(tmp_path / "on_the_way.h5")
    resumed = carom.Simulation.load(tmp_path / "on_the_way.h5")
    blocks = [sim.run(collisions=40) for sim in (straight, resumed)]
    assert blocks[0] == blocks[1]
    one, other = (sim.frame() for sim in (straight, resumed))
    np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_array_equal(one.velocities, other.velocities)


def known(contacts, dues):
    """Return which of the contacts of component 0 is first, where others are due at the times given."""
    rows = np.zeros(len(dues), [("event_time", "f8")]).view(np.recarray)
    rows.event_time = dues
    k, complete = best_of(contacts, State(rows, None, None, None, None), 0, False)
    return (contact_of(contacts, 0, k).other if k >= 0 else None), complete


def test_the_next_contact_is_the_earliest_with_whom_nothing_has_happened_to():
    contacts = make_contacts(4, np.float64)
    for j, event_time in ((1, 3.0), (2, 1.0), (3, 2.0)):
        keep(contacts, 0, j, event_time - 0.5, event_time)
    later = [NEVER] * 4
    assert known(contacts, later) == (2, True)
    contacts.versions[2] += 1  # it has collided
    assert known(contacts, later) == (3, True)
    assert known(contacts, [NEVER, NEVER, NEVER, 1.5]) == (1, True)  # it has an earlier event
    assert known(contacts, [NEVER, 2.5, NEVER, 1.5]) == (None, True)
    keep(contacts, 0, 2, 0.5, 4.0)  # found again, in the place of the contact of before
    assert contacts.counts[0] == 3


@pytest.mark.parametrize("sense", [1, -1])
def test_who_has_too_many_contacts_knows_until_when_they_are_complete(sense):
    n = CAPACITY + 3
    contacts = make_contacts(n, np.float64)
    for j in range(1, n)[::sense]:
        keep(contacts, 0, j, 0.0, float(j))
    dues = np.full(n, NEVER)
    assert known(contacts, dues) == (1, True)
    dues[1:CAPACITY] = 0.5
    assert known(contacts, dues) == (CAPACITY, True)
    dues[CAPACITY] = 0.5  # the next one found no room
    assert known(contacts, dues) == (None, False)
    dues[1] = NEVER
    for event_time, complete in ((CAPACITY + 0.5, True), (CAPACITY + 1.5, False)):
        keep(contacts, 0, 1, 0.0, event_time)
        assert known(contacts, dues) == (1, complete)


CROWDED = """
import sys
import carom.engine.neighbors.contact_cache as contacts
contacts.CAPACITY = int(sys.argv[1])
import carom
sim = carom.Simulation(carom.Scene.random(8, 0.03, 2, seed=2), seed=3, tuning=carom.Tuning(neighbors="all"))
sim.run(collisions=25)
print([sim.statistics.advancements, sim.time, *sim.frame().positions.ravel().tolist()])
"""


@pytest.mark.slow
def test_contacts_that_find_no_room_are_found_again():
    """The engine as Python, because compiled code holds the room as a constant.

    A contact that is found again is computed from a later moment, and rounded otherwise. Free paths of twenty
    diameters multiply that by forty in each of the six collisions that a disk has: 1e-16 becomes 1e-6.
    """
    told = []
    for room in (16, 1):
        told.append(np.array(json.loads(python("-W", "ignore", "-c", CROWDED, room, NUMBA_DISABLE_JIT="1"))))
    np.testing.assert_allclose(told[1][1:], told[0][1:], rtol=0.0, atol=1e-5)
    assert told[1][0] > told[0][0]  # who has lost one searches again, by an advancement


def test_what_is_thin_costs_what_the_mean_free_path_says():
    assert sizes.crossings(2) == pytest.approx(4 / np.pi)
    assert sizes.crossings(3) == pytest.approx(1.5)


def test_in_high_dimension_sectors_are_small_enough_to_tell_most_images_apart():
    # One sector would be seen in 3^10 images, with all 100 in each of them.
    scene = carom.Scene.random(100, box=(2.3,) * 10, diameter=1.0, seed=1)
    found = scheme.choose(prepare(scene, np.ones_like(scene.positions)), 10**0.5)
    assert (found.kind, found.shape) == ("sectors", (2,) * 10)
