"""Models from outside of the package: the page docs/models, as it stands, and what is refused."""

import functools
import inspect
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from helpers.magnetic import charges, least_gap
from helpers.scripts import python

import carom
from carom.compiling import registry
from carom.compiling.entry import entry
from carom.compiling.lanes import asked_of, make_lanes
from carom.errors import InputError
from carom.models import Ball, FreeFlight, Gravity, HardCores, Restitution, model_checks
from carom.models.interfaces.contact import ImpactModel
from carom.models.interfaces.interaction import PairModel
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.interfaces.particles import NEVER, lanes
from carom.models.interfaces.steps import SteppedModel
from carom.models.mathematics.contact import elastic, first_contact
from carom.scene.fields import is_simple, is_usual
from carom.simulation.explanation import explain
from carom.simulation.replay import Replay

PAGE = Path(__file__).parents[2] / "docs" / "models.md"
DEPTH = 1e-12
"""Overlap that rounding leaves: places up to 10 diameters, flights of some boxes."""

SCENE = carom.Scene.random(6, 0.1, 2, seed=1)


SLIT = """
import sys

sim, scene = escape, slit
for frame in sim.sample(every=3.0, count=60):
    gaps = [bar.gap(frame.positions, 0.5 * frame.diameters, scene.box, scene.periodic) for bar in bars]
    assert np.min(gaps) >= -1e-12, np.min(gaps)
assert sim.statistics.worst_overlap < 1e-12
assert sim.statistics.energy_drift < 1e-12
assert all(impacts.hits > 10 for impacts in sim.obstacles)
# 20 disks and a slit of four free diameters: a state with all on one side has a probability of 2^-19.
assert 0 < np.count_nonzero(frame.positions[:, 0] > 10.0) < 20
sim.save(sys.argv[1])
try:
    carom.Simulation.load(sys.argv[1])
except carom.FileError as error:
    assert "obstacles=[...]" in str(error), error
again = carom.Simulation.load(sys.argv[1], obstacles=bars)
for each in (sim, again):
    each.run(time=10.0)
assert (sim.frame().positions == again.frame().positions).all()
assert sim.obstacles == again.obstacles
"""
"""What is to hold of the slit of the page: of the bars that it defines, and the disks that escape."""


@pytest.mark.slow
def test_the_page_runs_as_it_stands(tmp_path):
    cells = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(cells) >= 8
    # A file: Numba's cache on disk names the module of every type, and reads its sources.
    script = tmp_path / "own.py"
    script.write_text("\n".join([*cells, SLIT]), encoding="utf-8")
    words = "-W", "ignore::RuntimeWarning", script, tmp_path / "slit.h5"
    lines = python(*words, cwd=tmp_path, NUMBA_CACHE_DIR=str(tmp_path)).splitlines()
    assert lines[0] == "True"
    assert sum(line.startswith("holds") for line in lines) == 8
    assert lines.count("True") == 7
    assert sum(line.endswith("of 20 are on the right") for line in lines) == 4
    assert sum(bool(re.match(r"0\.2\d+ \+- ", line)) for line in lines) == 4  # a quarter, with its error bar
    assert "floor" in lines
    assert lines[-2:] == ["False ['V', 'momentum', 'virial']", "UnlikeCores"]


LENGTHS = {"UnlikeCores": 12, "Well": 20, "Floor": 8, "Bath": 14, "Viscoelastic": 12}


@pytest.mark.parametrize("name", LENGTHS)
def test_a_class_on_the_page_is_short(name):
    page = PAGE.read_text(encoding="utf-8")
    body = re.search(rf"^class {name}:\n(.*?)\n\n\n", page, re.DOTALL | re.MULTILINE).group(1)
    assert len([line for line in body.splitlines() if line.strip()]) <= LENGTHS[name]


def test_the_usual_models_may_be_given_by_name():
    scene = SCENE.replace(interaction=HardCores(), motion=FreeFlight(), impact=Restitution(0.9, 0.01))
    assert (scene.impact.restitution, scene.impact.elastic_below) == (0.9, 0.01)
    assert is_usual(scene, "interaction")
    assert is_usual(scene, "motion")
    assert not is_simple(scene)
    assert is_simple(SCENE.replace(interaction=HardCores()))


def keep_to_walls_and_balls(wraps, n, box, count, seed=0):
    scene = charges(n, box, wraps, [Ball((0.5 * box[0], 0.5 * box[1]), 1.0)], seed)
    sim = carom.Simulation(scene, seed=seed)
    depth = -min(least_gap(frame, scene) for frame in sim.sample(every=0.1, count=count))
    assert depth < DEPTH
    assert sim.statistics.worst_overlap < DEPTH
    assert sim.statistics.energy_drift < 1e-12
    assert min(each.hits for each in sim.obstacles) > 0


@pytest.mark.parametrize(("wraps", "seed"), [((1, 0), 0), ((0, 0), 1)])
def test_charges_in_a_magnetic_field_keep_to_walls_and_balls(plain, wraps, seed):
    keep_to_walls_and_balls(wraps, 6, (6.0, 5.5), 100, seed)


@pytest.mark.slow
@pytest.mark.parametrize("wraps", [(1, 0), (0, 0)])
def test_many_charges_in_a_magnetic_field_keep_to_walls_and_balls(wraps):
    for seed in range(3):
        keep_to_walls_and_balls(wraps, 20, (10.0, 9.0), 200, seed)


def test_charges_that_grow_keep_to_the_walls(plain):
    growing = charges(4, (5.0, 5.5), (0, 0))
    sim = carom.Simulation(growing, growth=0.05, seed=3)
    assert -min(least_gap(frame, growing) for frame in sim.sample(every=0.25, count=16)) < DEPTH
    assert sim.collisions > 5


def test_a_motion_of_two_axes_is_checked_in_two_dimensions():
    report = carom.check(Gravity((0.0, -1.0)))
    assert report.passed
    assert report.tried["III"] == 2 * 200


# ---------------------------------------------------------------------------------------- indices


class Numbered(PairModel):
    """Hard cores whose distance, radii and masses follow from the numbers of the two."""

    table: np.ndarray
    count: int

    def interaction_time(self, i, j, rr, rv, vv, now):
        return first_contact(rr - self.core_square(i, j, now), rv, vv)

    def contact_time(self, i, j, rr, rv, vv, now):
        return max(first_contact(rr - self.core_square(i, j, now), rv, vv), 0.0), False

    def core_square(self, i, j, now):
        smaller = 0.01 * ((i + j) % 3) + (0.01 if min(i, j) & 1 else 0.0)
        return (
            self.table[i, j] - smaller - 0.001 * ((i ^ j) & 1) - 1e-4 * (int(i) + int(j) < self.count)
        ) ** 2

    def jump(self, i, j, rr, rv, now):
        ours, theirs = self.mass_of(i), self.mass_of(j)
        factor = 2.0 * ours * theirs / (ours + theirs) * rv / rr
        return factor / ours, factor / theirs, -factor * rr

    def mass_of(self, i):
        return 1.0 + ((i & 3) + (i - self.count) % 2)

    def radius_of(self, i, now):
        return 0.5 - 0.01 * (i & 1) - 0.01 * ((i - self.count) & 2)

    def growth_of(self, i):
        return 0.0 * (i & 1)


class NumberedCores:
    def reach(self, scene):
        return 1.0

    def model(self, particles):
        k = np.arange(len(particles.radii) + 1)
        return Numbered(1.0 - 0.05 * np.abs(np.sin(k[:, None] + k)), len(particles.radii))


class Losing(ImpactModel):
    """A contact law that follows from the numbers of the two."""

    least: float

    def transfer(self, rr, rv):
        return self.least

    def exchanged_part(self, i, j, rr, rv, now):
        return self.least + 0.01 * ((i * j + (i - j)) & 3)


class NumberedLoss:
    def model(self, particles):
        return Losing(0.95)


class Lower(ObstacleModel):
    """A floor that throws components back by their numbers."""

    height: float

    def encounter(self, x, v, radius, growth):
        return max((x[1] - self.height - radius) / -v[1], 0.0) if v[1] < 0.0 else NEVER

    def outward(self, x, axis):
        return 1.0 if axis == 1 else 0.0

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        v[1] = -v[1] * (1.0 - 0.1 * ((i & 1) + (i - 7) % 2))


class Floor:
    name = "floor"

    def __init__(self, height=1.0):
        self.height = height

    def check(self, box, periodic):
        pass

    def gap(self, positions, radii, box, periodic):
        return positions[:, 1] - self.height - radii

    def model(self):
        return Lower(self.height)


SEEN = set()
"""Types of the indices that models have been asked with, as plain Python."""


def noting(function):
    """Return a function that notes the types of its indices."""
    places = [k for k, name in enumerate(inspect.signature(function).parameters) if name in ("i", "j")]

    @functools.wraps(function)
    def asked(*args):
        SEEN.update((function, type(args[k])) for k in places)
        return function(*args)

    return asked


OF_PAIRS = "interaction_time", "contact_time", "core_square", "jump", "mass_of", "radius_of", "growth_of"
QUESTIONS = {
    Numbered: OF_PAIRS,
    Losing: ("transfer", "exchanged_part"),
    Lower: ("encounter", "outward", "recoil"),
}

BY_NUMBERS = {
    "lists": {"tuning": carom.Tuning(neighbors="lists")},
    "everybody": {"tuning": carom.Tuning(neighbors="all")},
    "a small box": {},
    "a floor": {"tuning": carom.Tuning(neighbors="sectors")},
}


def run_by_numbers(kind, path, cores, loss, floor):
    """Run a scene whose models answer by indices, and replay it: in Python, with every impulse compared."""
    scene = carom.Scene.random(20, 0.2, 2, seed=1).replace(interaction=cores)
    if kind == "lists":
        scene = scene.replace(impact=loss)
    elif kind == "a small box":
        scene = carom.Scene([[0.5, 0.5], [1.6, 1.7]], (2.3, 2.3), interaction=cores)
    elif kind == "a floor":
        k = np.arange(6.0)
        scene = carom.Scene(np.stack([2.0 * k + 1.0, 1.6 * k + 2.5], axis=1), 12.0, walls="y")
        scene = scene.replace(interaction=cores, obstacles=[floor])
    velocities = np.random.default_rng(1).normal(size=scene.positions.shape)
    numbers = np.arange(scene.n)
    masses = 1.0 + (numbers & 3) + (numbers - scene.n) % 2  # those that the model answers
    scene = scene.replace(velocities=velocities, mass=masses)
    with carom.Simulation(scene, event_log=path, **BY_NUMBERS[kind]) as sim:
        sim.run(collisions=25)
    run = Replay(path, interaction=cores, impact=scene.impact, obstacles=scene.obstacles or None)
    while run.step():
        pass
    assert run.collisions == 25
    np.testing.assert_array_equal(run.frame().velocities, sim.frame().velocities)


def test_indices_are_whole_numbers_for_every_model(plain, tmp_path, monkeypatch):
    for model, names in QUESTIONS.items():
        for name in names:
            monkeypatch.setattr(model, name, noting(getattr(model, name)))
    for kind in BY_NUMBERS:
        run_by_numbers(kind, tmp_path / f"{kind}.h5", NumberedCores(), NumberedLoss(), Floor())
    assert {kind for _, kind in SEEN} <= {int, np.int64}
    # transfer, encounter and outward are asked without an index.
    assert len({function for function, _ in SEEN}) == sum(map(len, QUESTIONS.values())) - 3


@pytest.mark.slow
@pytest.mark.parametrize("kind", BY_NUMBERS)
def test_indices_are_whole_numbers_in_compiled_code(kind, tmp_path):
    run_by_numbers(kind, tmp_path / "log.h5", NumberedCores(), NumberedLoss(), Floor())


@lanes("radii")
class Plain(PairModel):
    """Cores in lanes that do with their indices what a number of any type can."""

    radii: np.ndarray
    table: np.ndarray

    def interaction_time(self, i, j, rr, rv, vv, now):
        smaller, larger = (i, j) if i < j else (j, i)
        found = (
            self.table[i, j]
            + 1e4 * self.table[(i + j) % 8, i ^ j]
            + 10.0 * ((i + j) % 3)
            + 100.0 * (larger - smaller)
            + 1000.0 * (j // 2 - i)
        )
        return found + 0.5 * self.radii[i] + self.radii[j]


@lanes("radii")
class Pedantic(PairModel):
    """Cores in lanes that do with their indices what only numbers of one type can."""

    radii: np.ndarray

    def interaction_time(self, i, j, rr, rv, vv, now):
        found = np.sqrt(j) + float(i)
        for k in (i, j):
            found += self.radii[k]
        return found


@lanes("radii")
class Stepped(SteppedModel):
    """Steps in lanes that do arithmetic with their step."""

    radii: np.ndarray

    def step_time(self, i, j, step, rr, rv, vv, now):
        return self.radii[j] + 10.0 * self.radii[step + 1] + 100.0 * ((step + i - j) % 5)


def _ask(pair, lanes, i, j):
    return asked_of("interaction_time", pair, lanes, 3, i, j, (0.0, 0.0, 0.0, 0.0))


def _ask_stepped(pair, lanes, i, j, step):
    return asked_of("step_time", pair, lanes, 3, i, j, (step, 0.0, 0.0, 0.0, 0.0))


def in_lanes(pair, j):
    """Return the lanes of a model in which the third candidate is j, with a radius of its own."""
    found = make_lanes(pair)
    found.scratch[3] = pair.radii[j] + 0.25
    return found


@pytest.mark.parametrize(("i", "j"), [(2, 5), (5, 2)])
def test_indices_are_whole_numbers_in_lanes_too(i, j):
    pair = Plain(np.arange(8.0), np.arange(64.0).reshape(8, 8))
    expected = pair.interaction_time(i, j, 0.0, 0.0, 0.0, 0.0)
    indices = np.uint64(i), np.uint32(j)  # as the engine's are
    assert entry(_ask)(pair, None, *indices) == expected
    assert entry(_ask)(pair, in_lanes(pair, j), *indices) == expected + 0.25  # which the lane holds
    stepped = Stepped(np.arange(8.0))
    expected = stepped.step_time(i, j, 1, 0.0, 0.0, 0.0, 0.0)
    assert entry(_ask_stepped)(stepped, None, *indices, np.int64(1)) == expected
    assert entry(_ask_stepped)(stepped, in_lanes(stepped, j), *indices, np.int64(1)) == expected + 0.25


def test_lanes_serve_a_model_that_does_anything_with_its_indices():
    pair = Pedantic(np.arange(8.0))
    expected = pair.interaction_time(2, 5, 0.0, 0.0, 0.0, 0.0)
    assert entry(_ask)(pair, in_lanes(pair, 5), np.uint64(2), np.uint32(5)) == expected + 0.25


# ---------------------------------------------------------------------------------------- what is no number


class Pocket(NamedTuple):
    thing: object


class Holding(PairModel):
    """A model that holds something."""

    thing: Any
    masses: np.ndarray
    radii: np.ndarray

    def position(self, axis, x, v, t):
        return x + v * t

    def velocity(self, axis, v, t):
        return v

    def transfer(self, rr, rv):
        return 1.0

    def interaction_time(self, i, j, rr, rv, vv, now):
        return first_contact(rr - 1.0, rv, vv)

    def jump(self, i, j, rr, rv, now):
        return elastic(self, i, j, rr, rv)


class Holder:
    """An interaction, a motion or a contact law whose model holds something."""

    def __init__(self, thing):
        self.thing = thing

    def model(self, particles):
        return Holding(
            self.thing, particles.with_padding(particles.masses), particles.with_padding(particles.radii)
        )


class HoldingCores(Holder):
    def reach(self, scene):
        return 1.0


class HoldingFloor(Floor):
    def __init__(self, thing):
        super().__init__()
        self.thing = thing

    def model(self):
        return Holding(self.thing, np.ones(1), np.ones(1))


def holding(kind, thing):
    """Return a scene one of whose models holds something."""
    if kind == "obstacle floor":
        return carom.Scene([[1.0, 5.0]], 10.0, walls="y", obstacles=[HoldingFloor(thing)])
    return SCENE.replace(**{kind: HoldingCores(thing) if kind == "interaction" else Holder(thing)})


@pytest.mark.parametrize("kind", ["interaction", "motion", "impact", "obstacle floor"])
@pytest.mark.parametrize(
    ("thing", "name", "what"),
    [
        (object(), "thing", "a object"),
        ([1.0, 2.0], "thing", "a list of 2"),
        ({"a": 1.0}, "thing", "a table"),
        (np.array([None, 1.0]), "thing", "an array of object"),
        (np.ones(3, ">f8"), "thing", "an array of >f8"),
        (Pocket(Pocket((1.0, SimpleNamespace()))), "thing.thing.thing[1]", "a SimpleNamespace"),
        (2**70, "thing", "an integer of more than 18 digits"),
        (lambda x: x, "thing", "a function"),
    ],
)
def test_a_field_that_no_compiler_knows_is_named(kind, thing, name, what):
    words = (
        f"The field {name} of Holding, the model of the {kind}, is {what}, which the compiler does not know"
    )
    with pytest.raises(InputError, match=re.escape(words)):
        carom.Simulation(holding(kind, thing), seed=1)


@pytest.mark.parametrize(
    "thing", [1, 2.0, True, None, np.float32(1.0), (1, (2.0, None)), np.ones((2, 2), np.int8)]
)
def test_numbers_arrays_and_tuples_of_these_are_known(thing):
    explain(holding("interaction", thing))


def test_a_model_that_is_no_tuple_is_refused():
    class Value(Holder):
        def model(self, particles):
            return SimpleNamespace()

    with pytest.raises(
        InputError, match="The model of the motion is a SimpleNamespace; expected a NamedTuple"
    ):
        carom.Simulation(SCENE.replace(motion=Value(None)), seed=0)


class Misspelt(ObstacleModel):
    """A model one of whose answers reads what it has not."""

    height: float

    def encounter(self, x, v, radius, growth):
        return (x - self.heigth) / -v


def test_what_cannot_be_compiled_is_one_sentence_with_the_name_of_the_model():
    with pytest.raises(InputError) as refused:
        entry(lambda obstacle: obstacle.encounter(0.0, 0.0, 0.0, 0.0))(Misspelt(1.0))
    words = r"encounter of Misspelt cannot be compiled: line \d+ of test_own_models.py, `return \(x - "
    assert re.match(words, str(refused.value))
    assert str(refused.value).endswith("a Misspelt has no heigth.")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("module", "own"),
    [("carom.models.wells", False), ("carom", False), ("carom_models", True), ("caromel.wells", True)],
)
def test_a_model_is_of_the_user_by_the_package_that_its_class_is_in(module, own):
    value = type("Cores", (), {"__module__": module})()
    assert model_checks.is_own(value) == own
    assert registry.is_ours(module) == (not own)
