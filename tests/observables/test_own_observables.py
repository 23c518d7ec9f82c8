"""Observables of one's own: one protocol for measure and sample, and sentences for what has it not."""

import numpy as np
import pytest

import carom
from carom.errors import InputError
from carom.models import own


@pytest.fixture
def sim():
    return carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=1)


class Energies:
    """Kinetic energy of every frame."""

    def add(self, frame):
        return 0.5 * np.sum(frame.masses[:, None] * frame.velocities**2)


class Fastest:
    """Largest speed of each frame."""

    def add(self, frame):
        return float(np.sqrt(np.max(np.sum(frame.velocities**2, axis=1))))


class Rates:
    """Collisions and virial by time."""

    def add(self, block):
        return [block.collisions / block.duration, block.virial / block.duration]


class Displacements:
    """Mean square displacement from the first frame, by hand."""

    def __init__(self):
        self.start, self.values = None, []

    def add(self, frame):
        if self.start is None:
            self.start = frame.unwrapped
        self.values.append(np.mean(np.sum((frame.unwrapped - self.start) ** 2, axis=1)))

    def result(self):
        return np.array(self.values)


def test_what_add_returns_gets_an_error_bar(sim):
    energy = sim.measure(Energies(), time=2.0, blocks=8)
    assert energy.mean == pytest.approx(1.5 * 107)  # d (n - 1) / 2 kT, conserved
    assert energy.error < 1e-9 * energy.mean
    rate, virial = sim.measure(Rates(), time=20.0)
    assert rate.blocks >= 16
    assert 0.0 < rate.error < 0.1 * rate.mean
    z = 1.0 + virial.mean / (3 * 108 * sim.kT)
    right = carom.theory.carnahan_starling(0.3)
    assert z == pytest.approx(right, abs=6.0 * virial.error / 324 + 0.02)  # N = 108


def test_measure_and_a_loop_show_an_observable_the_same_frames_and_give_the_same_error_bars(sim):
    measured, energy = sim.measure(Displacements(), Energies(), time=2.0, blocks=8)
    assert len(measured) == 9  # at the start, and after each block
    again = carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=1)
    seen, values = Displacements(), []
    for frame in (again.frame(), *again.sample(every=0.25, count=8)):
        seen.add(frame)
        values.append(Energies().add(frame))
    assert (seen.result() == measured).all()
    assert carom.observables.averages(values) == energy


class Density:
    """Number density by slabs, the number of which the size of the system decides."""

    def begin(self, scene):
        self.edges = np.linspace(0.0, scene.box[0], 2 + scene.n // 100)

    def add(self, frame):
        return np.histogram(frame.positions[:, 0], self.edges)[0]


def test_an_observable_of_ones_own_is_measured_of_a_list_and_a_file_which_begin_with_the_first_frame(
    sim, tmp_path
):
    sim.write(tmp_path / "a.h5md", every=0.5, count=128)
    frames = carom.io.read(tmp_path / "a.h5md", ":")
    expected = carom.observables.averages([Fastest().add(frame) for frame in frames])
    for source in (frames, tmp_path / "a.h5md"):
        found = carom.measure(source, Fastest(), Displacements(), Density())
        assert found["Fastest"] == expected
        assert len(found["Displacements"]) == 128
        assert len(found["Density"]) == 2
        assert sum(each.mean for each in found["Density"]) == pytest.approx(sim.n)
    with pytest.raises(InputError, match="Rates is of blocks"):
        carom.measure(frames, Rates())


@own.observer
class Angles:
    """The mean square of the impact parameter in each block."""

    sums = own.memory(0.0, 2)

    def at_pair(self, event):
        along = square = distance = 0.0
        for axis in range(len(event.r)):
            u = event.before[1, axis] - event.before[0, axis]
            along += event.r[axis] * u
            square += u * u
            distance += event.r[axis] ** 2
        self.sums[0] += 1.0
        self.sums[1] += 1.0 - along * along / (square * distance)

    def add(self, block):
        collisions, squares = self.sums
        assert collisions == block.collisions
        self.sums[:] = 0.0
        return squares / collisions


def test_an_observer_of_events_has_an_error_bar(plain):
    gas = carom.Simulation(carom.Scene.random(16, 0.2, 2, seed=1), seed=1)
    angle, rate = gas.measure(Angles(), Rates(), time=24.0, blocks=32)
    assert angle.blocks >= 16
    assert 0.0 < angle.error < 0.05
    assert angle.mean == pytest.approx(1.0 / 3.0, abs=5.0 * angle.error)  # of disks
    assert rate[0].mean > 0.0
    assert gas.measure(Angles(), time=12.0, blocks=16).blocks == 16


@own.observer
class Counts:
    """The number of collisions, and when the last was."""

    contacts = own.memory(0)
    latest = own.memory(0.0)

    def at_pair(self, event):
        self.contacts[event.i] += 1
        self.latest[event.i] = event.time


@pytest.mark.filterwarnings("ignore:Fewer than")
def test_an_observer_of_the_run_is_told_all_before_in_and_after_what_is_measured(plain):
    scene = carom.Scene.random(12, 0.2, 2, seed=1)
    sim = carom.Simulation(scene, seed=1, observers=[Counts(), Counts()])
    alone = carom.Simulation(scene, seed=1)

    def assert_told():
        first, second = sim.observers
        assert first.contacts.sum() == second.contacts.sum() == sim.collisions > 0
        assert (first.latest == second.latest).all()

    sim.run(time=0.25)
    assert_told()
    for observables in (
        [Counts()], [Energies(), Counts()], [carom.PressureTensor(), Counts()],
        [carom.DensityProfile(axis=0, bins=4), Counts()],
    ):  # fmt: skip
        before = sim.collisions
        found = sim.measure(*observables, time=0.75, blocks=4)
        mine = found[-1] if len(observables) > 1 else found
        assert mine.contacts.sum() == sim.collisions - before > 0
        assert_told()
        sim.run(time=0.25)
        assert_told()
    with pytest.raises(ZeroDivisionError):
        sim.measure(Counts(), Fails(), time=1.0)
    sim.run(time=0.25)
    assert_told()
    alone.run(time=sim.time)
    np.testing.assert_array_equal(alone.positions, sim.positions)


class Fails:
    def add(self, block):
        raise ZeroDivisionError


def test_a_number_of_collisions_is_as_good_as_a_time(sim):
    assert len(sim.measure(Displacements(), collisions_per_particle=20, blocks=4)) == 5


class Nothing:
    def add(self, frame):
        return None


class Nameless:
    def add(self, state):
        return 1.0


class Words:
    def add(self, block):
        return "much"


class Counted:
    blocks = 8

    def add(self, frame):
        return 1.0


class Phases:
    def add(self, frame):
        return np.exp(1j * frame.positions[:, 0]).mean()


@pytest.mark.parametrize(
    ("observable", "says"),
    [
        (object(), r"add\(frame\) or add\(block\)"),
        (Energies, "the class Energies"),
        (Nothing(), r"no result\(\)"),
        (Nameless(), "name its one parameter frame or block"),
        (Words(), "expected a number"),
        (Phases(), "real and imaginary part"),
        (Counted(), r"argument of measure\(\.\.\., blocks=\)"),
    ],
)
def test_what_is_no_observable_is_told_what_is_missing(sim, observable, says):
    with pytest.raises(InputError, match=says):
        sim.measure(observable, time=0.5)


def test_no_error_is_asked_of_what_has_none_on_the_way(sim):
    with pytest.raises(InputError, match="name a length"):
        sim.measure(Energies(), relative_error=0.1)


@pytest.mark.parametrize("name", ["RDF", "StructureFactor", "Dynamics", "BondOrder", "DensityProfile",
    "Crystallinity", "Pressure", "PressureProfile", "PressureTensor", "WallPressure", "Energy", "Volume",
    "FreeFlights"])  # fmt: skip
def test_a_keyword_that_does_not_exist_is_named(name):
    with pytest.raises(InputError, match=f"{name} has no keyword 'nosuch'"):
        getattr(carom.observables, name)(nosuch=1)


def test_the_keyword_that_is_meant_is_said():
    with pytest.raises(InputError, match="did you mean bins"):
        carom.RDF(bin=10)
    with pytest.raises(InputError, match="it is called rmax"):
        carom.RDF(cutoff=2.0)


def test_rows_of_unequal_length_have_no_mean():
    with pytest.raises(
        InputError, match=r"add\(\) returned a list of 2 first; expected a number, or an array"
    ):
        carom.observables.averages([[[1.0], [1.0, 2.0]]] * 4)


@pytest.mark.parametrize("shape", [(0,), (0, 3), (0, 0), (0, 2, 2)])
def test_a_mean_of_no_samples_is_one_sentence(shape):
    with pytest.raises(InputError, match="at least one value is needed"):
        carom.observables.averages(np.ones(shape))
