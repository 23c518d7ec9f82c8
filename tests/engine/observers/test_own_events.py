"""Observers of one's own: every event as it happens, sums that survive everything, and what is refused."""

import contextlib
import dataclasses
from typing import NamedTuple

import numpy as np
import pytest
from helpers.marks import slow
from helpers.plain import uncompiled

import carom
from carom.errors import FileError, InputError
from carom.io.events import read_events, read_initial
from carom.models import Ball, Shear, SquareWell, own
from carom.models.interfaces.observer import ObserverModel
from carom.models.interfaces.steps import CORE
from carom.models.motions.shear import STAGES
from carom.models.obstacles.named_walls import axes_without
from carom.simulation.explanation import explain
from carom.simulation.measuring import stretches

EPS = np.finfo(float).eps
SIX_SIGMA = 6.0
BINS = 16


@own.observer
class Seen:
    """What is added up of all events."""

    power: float
    """d - 1."""
    fixed: int
    """Number of walls and obstacles."""
    bins: int = BINS
    masses = own.per_particle("masses")
    angles = own.memory(0, "bins")
    """Histogram of (b / sigma)^(d - 1), where b is the impact parameter."""
    kinds = own.memory(0, 4)
    virial = own.memory(0.0, 1)
    defect = own.memory(0.0, 1)
    """Largest momentum that was not kept by a pair, or not along the normal at an obstacle."""
    hits = own.memory(0, "fixed")
    momentum = own.memory(0.0, "fixed")
    energy = own.memory(0.0, "fixed")
    first = own.memory(-1.0)
    """When each component met its first obstacle."""
    last = own.memory(0.0, 2)
    """Time of the last event, and how many came before the one before them."""
    epochs = own.memory(0.0, 3)
    """How many began, the sum of their times, and twice the kinetic energy at the last."""

    def at_pair(self, event):
        along = square = distance = 0.0
        for axis in range(len(event.r)):
            u = event.before[1, axis] - event.before[0, axis]
            along += event.r[axis] * u
            square += u * u
            distance += event.r[axis] ** 2
            gained = self.masses[event.i] * (event.after[0, axis] - event.before[0, axis])
            gained += self.masses[event.j] * (event.after[1, axis] - event.before[1, axis])
            self.defect[0] = max(self.defect[0], abs(gained))
        part = max(1.0 - along * along / (square * distance), 0.0) ** (0.5 * self.power)
        self.angles[min(int(part * self.bins), self.bins - 1)] += 1
        self.kinds[event.kind] += 1
        self.virial[0] += event.virial
        self.last[1] += event.time < self.last[0]
        self.last[0] = event.time

    def at_obstacle(self, event):
        k, m = event.obstacle, self.masses[event.i]
        self.hits[k] += 1
        self.momentum[k] += event.momentum
        self.energy[k] += event.energy
        for axis in range(len(event.normal)):
            change = m * (event.after[axis] - event.before[axis]) - event.momentum * event.normal[axis]
            self.defect[0] = max(self.defect[0], abs(change))
        if self.first[event.i] < 0.0:
            self.first[event.i] = event.time
        self.last[1] += event.time < self.last[0]
        self.last[0] = event.time

    def at_epoch(self, event):
        self.epochs[0] += 1.0
        self.epochs[1] += event.time
        self.epochs[2] = 0.0
        for i in range(len(event.v)):
            for axis in range(event.v.shape[1]):
                self.epochs[2] += self.masses[i] * event.v[i, axis] ** 2


def seen(scene):
    return Seen(scene.dimension - 1.0, 2 * (scene.dimension - sum(scene.periodic)) + len(scene.obstacles))


def gas(d, *, speed=1.0, seed=1, **surface):
    """Return spheres between two walls, around a ball with or without a ``surface``."""
    n, edge = (80, 14.0) if d == 2 else (120, 7.0)
    box = (edge,) * d
    ball = Ball((edge / 2,) * d, 1.2, "ball", **surface)
    scene = carom.Scene.random(
        n, dimension=d, box=box, seed=seed, walls=axes_without((*(d - 1) * [True], False)), obstacles=[ball],
        diameter=1.0,
    )  # fmt: skip
    velocities = np.random.default_rng(seed).normal(size=(n, d))
    return scene.replace(velocities=speed * velocities)


def assert_equal(one, two):
    for name, a, b in zip(one._fields, one, two, strict=True):
        assert np.array_equal(a, b), name


@pytest.fixture(scope="module", params=[2, slow(3)])
def observed(request):
    """The plane as plain Python; a histogram of some thousand collisions tells one power from another."""
    scene = gas(request.param)
    with uncompiled() if request.param == 2 else contextlib.nullcontext():
        sim = carom.Simulation(scene, observers=[seen(scene)])
        sim.run(collisions=1500 if request.param == 2 else 40_000)
    return sim


def test_squared_impact_parameters_of_spheres_are_uniform_and_those_of_disks_as_they_are(observed):
    # The flux of partners through a ring of radius b is proportional to b^(d-2) db: (b / sigma)^(d-1) is
    # uniform, at every density.
    counts = observed.observers[0].angles
    assert counts.sum() == observed.collisions
    mean = counts.sum() / BINS
    assert (np.abs(counts - mean) < SIX_SIGMA * np.sqrt(mean)).all()


def test_sums_over_events_are_those_of_the_run(observed):
    found = observed.observers[0]
    assert found.kinds[CORE] == observed.collisions
    assert found.virial[0] == stretches.tally(observed).virial
    assert found.hits.tolist() == [each.hits for each in observed.obstacles]
    assert found.momentum.tolist() == [each.impulse for each in observed.obstacles]
    assert found.last[1] == 0.0
    assert found.last[0] <= observed.time
    fastest = np.abs(observed.frame().velocities).max()
    assert found.defect[0] < 64 * EPS * fastest  # of some velocities that add up
    assert np.abs(found.energy).max() < observed.collisions * EPS * fastest**2


def test_epochs_begin_at_equal_times_with_all_components(observed):
    count, times, twice = observed.observers[0].epochs
    length = observed._state.epoch_length
    assert count == observed.time // length > 2
    assert times == length * count * (count + 1) / 2
    degrees = observed.degrees_of_freedom
    assert twice == pytest.approx(degrees * observed.kT, rel=observed.collisions * EPS)


@pytest.mark.usefixtures("both_ways")
def test_the_first_passage_of_each_component_is_in_the_log(tmp_path):
    scene = gas(2)
    path = tmp_path / "events.h5"
    with carom.Simulation(scene, observers=[seen(scene)], event_log=path) as sim:
        sim.run(collisions=300)
        first = sim.observers[0].first
    events = read_events(path)
    times = events.epoch * float(read_initial(path)["epoch_length"]) + events.time
    for i in range(scene.n):
        met = np.flatnonzero((events.i == i) & (events.j >= scene.n))
        assert first[i] == (times[met[0]] if len(met) else -1.0)
    assert (first >= 0.0).any()


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("d", [2, slow(3)])
def test_a_run_that_is_saved_loaded_and_resumed_has_the_same_sums(tmp_path, d):
    scene = gas(d)
    whole, cut = (carom.Simulation(scene, observers=[seen(scene)]) for _ in range(2))
    whole.run(collisions=400)
    cut.run(collisions=150)
    cut.save(tmp_path / "run.h5")
    again = carom.Simulation.load(tmp_path / "run.h5", obstacles=scene.obstacles, observers=[seen(scene)])
    assert_equal(again.observers[0], cut.observers[0])
    again.run(collisions=250)
    assert_equal(again.observers[0], whole.observers[0])


def test_an_observer_changes_no_bit_of_a_run(plain):
    scene = gas(2)
    frames = []
    for observers in ([], [seen(scene)]):
        sim = carom.Simulation(scene, observers=observers)
        sim.run(collisions=150)
        frames.append(sim.frame())
    assert (frames[0].positions == frames[1].positions).all()
    assert (frames[0].velocities == frames[1].velocities).all()


@pytest.mark.usefixtures("both_ways")
def test_events_are_in_the_units_of_the_scene():
    # A ball at which energy is lost: that of a wall which does no work is zero in any unit.
    slow, fast = (gas(2, speed=speed, impact=0.5) for speed in (1.0, 2.0**40))
    one, two = (carom.Simulation(scene, observers=[seen(scene)]) for scene in (slow, fast))
    for sim in (one, two):
        sim.run(collisions=150)
    assert two._state.unit.exponent != one._state.unit.exponent
    a, b = (sim.observers[0] for sim in (one, two))
    assert a.energy[2] < -0.1
    faster = a._replace(
        virial=2.0**40 * a.virial,
        defect=2.0**40 * a.defect,
        momentum=2.0**40 * a.momentum,
        energy=2.0**80 * a.energy,
        first=np.where(a.first < 0.0, -1.0, a.first / 2.0**40),
        last=a.last * [2.0**-40, 1.0],
        epochs=a.epochs * [1.0, 2.0**-40, 2.0**80],
    )
    assert_equal(faster, b)


@pytest.mark.slow
def test_sums_go_on_when_velocities_are_rescaled_and_when_diameters_have_grown(tmp_path):
    scene = gas(2)
    sim = carom.Simulation(scene, observers=[seen(scene)], growth=0.05, tuning=carom.Tuning(shell=1.1))
    sim.run(collisions=500)
    before = sim._state.unit
    sim.rescale(2.0**60, growth=0.05 * 2.0**30)
    assert sim._state.unit != before
    base = sim._state.clock.base
    sim.run(collisions=1500)
    assert sim._state.clock.base > base  # the neighbor scheme was chosen anew, by itself
    sim.save(tmp_path / "run.h5")
    again = carom.Simulation.load(tmp_path / "run.h5", obstacles=scene.obstacles, observers=[seen(scene)])
    for each in (sim, again):
        each.run(collisions=100)
        found = each.observers[0]
        assert found.kinds[CORE] == each.collisions == 2100
        assert found.virial[0] == pytest.approx(stretches.tally(each).virial, rel=1e-12)
        assert found.hits.tolist() == [wall.hits for wall in each.obstacles]
        assert found.momentum == pytest.approx([wall.impulse for wall in each.obstacles], rel=1e-12)
        assert found.last[1] == 0.0
        assert 0.9 * each.time < found.last[0] <= each.time * (1.0 + 4.0 * EPS)  # a sum of three doubles
    assert_equal(sim.observers[0], again.observers[0])


@pytest.mark.usefixtures("both_ways")
def test_events_of_steps_say_which_they_are():
    scene = carom.Scene.random(60, 0.2, 2, seed=1).replace(interaction=SquareWell(1.5))
    sim = carom.Simulation(scene, seed=2, observers=[seen(scene)])
    sim.run(collisions=250)
    assert (sim.observers[0].kinds == sim._state.engine.model.pair.events.sum(axis=0)).all()
    assert (sim.observers[0].kinds > 0).all()


@own.observer
class Ways:
    """Ways between those who meet, the last event of two, and the last beginning of an epoch."""

    time = own.memory(0.0, 2)

    @own.memory
    def squares(self, particles):
        return np.array([np.inf, 0.0])

    @own.memory
    def pair(self, particles):
        return np.zeros((3, len(particles.box)))

    @own.memory
    def all(self, particles):
        return np.zeros((len(particles.radii), len(particles.box)))

    def at_pair(self, event):
        square = 0.0
        for axis in range(len(event.r)):
            square += event.r[axis] * event.r[axis]
            self.pair[0, axis] = event.r[axis]
            self.pair[1, axis] = event.x[0, axis]
            self.pair[2, axis] = event.x[1, axis]
        self.squares[0] = min(self.squares[0], square)
        self.squares[1] = max(self.squares[1], square)
        self.time[0] = event.time

    def at_epoch(self, event):
        self.time[1] = event.time
        self.all[:] = event.x


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("period", [None, 12.0], ids=["steady", "oscillating"])
@pytest.mark.parametrize("d", [2, 3])
def test_places_and_ways_in_a_shear_are_those_in_space(d, period):
    scene = carom.Scene.random(16, 0.2, d, seed=1, motion=Shear(0.7, period=period))
    sim, again = carom.Simulation(scene, seed=1, observers=[Ways()]), carom.Simulation(scene, seed=1)
    sim.run(time=1.9)
    found = sim.observers[0]
    # A way is a difference of places of some diameters at a time that is rounded.
    assert np.sqrt(found.squares) == pytest.approx(1.0, abs=64 * EPS)
    met, began = found.time
    assert met > 0.1
    assert began > 0.1
    r, x, y = found.pair
    turns = (y - x - r) / scene.box
    strain = scene.motion.strain(met, int(met * STAGES / period) if period else 0)
    turns[0] -= strain * turns[1] * scene.box[1] / scene.box[0]
    assert turns == pytest.approx(np.rint(turns), abs=64 * EPS)
    again.run(time=began)
    turns = (found.all - again.frame().positions) / scene.box  # the lattice may be laid anew there
    assert turns == pytest.approx(np.rint(turns), abs=64 * EPS)
    assert not np.rint(turns[:, 1:]).any()


@own.observer
class Result:
    """Collisions of a stretch, as a number."""

    count = own.memory(0, 1)

    def at_pair(self, event):
        self.count[0] += 1

    def result(self):
        return int(self.count[0])


@pytest.mark.usefixtures("plain")
def test_measure_observes_a_stretch():
    scene = gas(2)
    sim = carom.Simulation(scene, observers=[seen(scene)])
    plain = carom.Simulation(scene)
    found = plain.measure(seen(scene), time=1.0)
    sim.run(time=1.0)
    assert_equal(found, sim.observers[0])
    assert plain.observers == ()
    before = plain.collisions
    fractions = []
    counted = plain.measure(Result(), time=0.5, progress=fractions.append)
    assert counted == plain.collisions - before > 0
    assert fractions[-1] == 1.0
    assert (plain.frame().velocities != sim.frame().velocities).any()


@own.observer
class Wrong:
    """An observer of more components than there are."""

    counts = own.memory(0, 3)

    def at_pair(self, event):
        self.counts[event.i] += 1


class Deaf(NamedTuple):
    """No observer: it answers nothing."""

    counts: np.ndarray


class Holding(ObserverModel):
    """An observer of what compiled code does not know."""

    counts: list

    def at_pair(self, event):
        return


SMALL = carom.Scene.random(20, 0.2, 2, seed=1)


@pytest.mark.parametrize(
    ("observers", "says"),
    [
        ([Deaf(np.zeros(1))], "a class with @own.observer"),
        ([Wrong], "the class Wrong"),
        (Wrong(), "a list of observers"),
        ([Wrong()], "Wrong fails where Carom asks it in plain Python: IndexError"),
        ([Holding(["a"])], "The field counts"),
    ],
)
def test_what_is_no_observer_is_refused_in_a_sentence(observers, says):
    with pytest.raises(InputError, match=says):
        carom.Simulation(SMALL, observers=observers)


def test_check_tells_an_observer_of_events():
    with pytest.raises(
        InputError, match=r"Wrong fails where .* Python: IndexError.* says dimensions=\(2,\)\."
    ):
        carom.check(Wrong())


def test_several_workers_do_not_observe(unscheduled):
    scene = carom.Scene.crystal(cells=7, packing_fraction=0.3)
    observer = Result()
    with pytest.raises(InputError, match="because of Result, which observes every event when it happens"):
        carom.Simulation(scene, observers=[observer], cores=2)
    with carom.Simulation(scene, cores=2) as sim, pytest.raises(InputError, match="make it with cores=1"):
        sim.measure(observer, time=0.1)


def test_observers_of_a_file_are_given_again(unscheduled, tmp_path):
    scene = gas(2)
    sim = carom.Simulation(scene, observers=[seen(scene)])
    sim.save(tmp_path / "run.h5")
    for given, says in (
        ([], "are Seen, which no file holds"),
        ([Result()], "of the class Seen, and the value given is of the class Result"),
        ([dataclasses.replace(seen(scene), power=3.0)], "Seen with power = 1"),
        ([dataclasses.replace(seen(scene), bins=3)], "Seen with bins = 16"),
    ):
        with pytest.raises(FileError, match=says):
            carom.Simulation.load(tmp_path / "run.h5", obstacles=scene.obstacles, observers=given)


def test_explain_names_the_observers_and_their_arrays(unscheduled):
    scene = gas(2)
    found = carom.Simulation(scene, observers=[seen(scene)]).explain()
    assert found.models["observers"] == "Seen"
    assert "observers.Seen.observer.angles" in {array.name for array in found.arrays}
    assert "observers" not in explain(SMALL).models
