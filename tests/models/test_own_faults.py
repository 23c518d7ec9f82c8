"""Faults of models of one's own are refused in a sentence when a simulation is made, before anything runs."""

import math
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest
from helpers.faulty import Curved, Drag, DragCores, Parity, Two

import carom
from carom.errors import FileError, InputError, OverlapError
from carom.models.drives import kick, next_time
from carom.models.interactions.wells import SquareWell
from carom.models.mathematics.contact import elastic, first_contact
from carom.models.own import uniform
from carom.models.questions.contact import exchanged_part, transfer
from carom.models.questions.interaction import core_square, interaction_time, jump, mass, record_impulse
from carom.models.questions.memory import copy_state, shift_epoch
from carom.models.questions.motion import position, velocity
from carom.models.questions.particles import NEVER, lanes
from carom.scene.storage import from_arrays, to_arrays
from carom.simulation.explanation import explain
from carom.simulation.replay import Replay
from carom.simulation.run_state import RunState

SCENE = carom.Scene.random(30, 0.3, 2, seed=1)


class Answering(NamedTuple):
    """The same cores, which say how far apart they keep two."""

    core: float
    radii: np.ndarray
    masses: np.ndarray


@interaction_time.register
def _(pair: Answering, i, j, rr, rv, vv, now):
    return first_contact(rr - pair.core, rv, vv) if rr >= pair.core else NEVER


@jump.register
def _(pair: Answering, i, j, rr, rv, now):
    return elastic(pair, i, j, rr, rv)


@core_square.register
def _(pair: Answering, i, j, now):
    return pair.core


@lanes("radii")
class Beside(NamedTuple):
    """Hard cores that name a lane."""

    radii: np.ndarray
    masses: np.ndarray


@interaction_time.register
def _(pair: Beside, i, j, rr, rv, vv, now):
    return first_contact(rr - 1.0, rv, vv)


@jump.register
def _(pair: Beside, i, j, rr, rv, now):
    return elastic(pair, i, j, rr, rv)


class BesideCores:
    def __init__(self, radii):
        self.radii = radii

    def reach(self, scene):
        return 1.0

    def model(self, particles):
        return Beside(self.radii, particles.with_ghost(particles.masses))


class ByRadii(Parity):
    by_radii = True


class Core(Parity):
    def model(self, particles):
        sizes = particles.with_ghost(particles.radii), particles.with_ghost(particles.masses)
        return Answering(self.like**2, *sizes)


def test_a_model_without_fault_is_accepted():
    explain(SCENE.replace(interaction=Parity()))


@pytest.mark.parametrize(("far", "found"), [(0.99999, "1"), (0.5, "0.6"), (1e-6, "0.6")])
def test_a_reach_that_is_too_small_is_refused_with_pair_and_distances(far, found):
    words = rf"Components \d+ and \d+ act on each other {found} apart, .* {far:g}: the engine"
    with pytest.raises(InputError, match=words):
        carom.Simulation(SCENE.replace(interaction=Parity(far=far)))
    failures = carom.check(Parity(far=far)).failures
    assert {failure.condition for failure in failures} == {"reach"}


def test_a_reach_is_too_small_for_the_sum_of_radii_too():
    sizes = np.where(np.arange(30) % 2, 1.0, 0.8)  # like ones touch at 1.0, two small ones at 0.8
    with pytest.raises(InputError, match="act on each other 1 apart, beyond the sum of their radii"):
        carom.Simulation(SCENE.replace(diameter=sizes, interaction=ByRadii()))


@pytest.mark.parametrize(
    ("far", "words"),
    [
        (None, "must be a number, found nothing"),
        ("one", "must be a number, found the string 'one'"),
        (math.nan, "must be finite"),
        (math.inf, "must be finite"),
        (0.0, "must be greater than 0"),
        (-1.0, "must be greater than 0"),
    ],
)
def test_a_reach_that_is_no_length_is_refused(far, words):
    for make in (lambda v: carom.Simulation(SCENE.replace(interaction=v)), carom.check):
        with pytest.raises(InputError, match=re.escape("reach(scene) of Parity " + words)):
            make(Parity(far=far))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.zeros(30, np.int64), "The field kinds of Two has 30 items; expected 31"),
        (np.zeros(5, np.int64), "The field kinds of Two has 5 items; expected 31"),
    ],
)
def test_an_array_without_ghost_is_refused(values, words):
    with pytest.raises(InputError, match=words):
        carom.Simulation(SCENE.replace(interaction=Parity(change=(("kinds", values),))))


def test_check_finds_an_array_without_ghost():
    with pytest.raises(InputError, match="The field kinds of Two has 8 items; expected 9"):
        carom.check(Parity(change=(("kinds", np.zeros(8, np.int64)),)))


def test_a_list_for_masses_is_refused():
    with pytest.raises(InputError, match=r"The field masses of Two, .* is a list of 31, .* an array"):
        carom.Simulation(SCENE.replace(interaction=Parity(change=(("masses", [1.0] * 31),))))


@pytest.mark.parametrize(
    "values",
    [np.zeros((31, 2)), np.zeros((31, 2))[:, 0], np.zeros(62)[::2], np.asfortranarray(np.zeros((31, 31)))],
)
def test_a_lane_must_be_one_value_a_component_side_by_side(values):
    with pytest.raises(
        InputError, match=r"The field radii of Beside is named by lanes, and is .* contiguous"
    ):
        carom.Simulation(SCENE.replace(interaction=BesideCores(values)))


def test_a_lane_must_be_a_field():
    with pytest.raises(InputError, match="Lined has no field 'kind' for a lane; known are kinds"):

        @lanes("kind")
        class Lined(NamedTuple):
            kinds: np.ndarray


@pytest.mark.parametrize("value", [Parity(1.5, 1.5, 1.5), Core(1.5, 1.5, 1.5)])
def test_an_overlapping_start_is_refused_though_components_are_penetrable(value):
    with pytest.raises(OverlapError, match=r"Components \d+ and \d+ overlap by .* keeps them 1.5 apart"):
        carom.Simulation(SCENE.replace(interaction=value))


def test_penetrable_pairs_may_overlap():
    explain(SCENE.replace(interaction=Parity(like=1e-3, unlike=1.0, far=3.0)))


def test_a_motion_that_is_not_uniform_is_refused():
    with pytest.raises(InputError, match="relative: not so that relative to each other two components fly"):
        carom.Simulation(SCENE.replace(motion=Drag(0.1)))
    with pytest.raises(InputError, match="relative: not so"):
        carom.Simulation(SCENE.replace(motion=Drag(0.1), interaction=DragCores(0.2)))


def test_a_motion_that_is_not_uniform_needs_an_interaction_that_knows_it():
    explain(SCENE.replace(motion=Drag(0.1), interaction=DragCores(0.1)))


def test_the_check_of_a_motion_that_is_not_uniform_says_what_to_give():
    found = carom.check(Drag(0.1), pairs=20)
    assert [each.condition for each in found.failures] == ["relative"] * 4
    assert "with an interaction that computes its times along this motion" in str(found)
    assert carom.check(DragCores(0.1), motion=Drag(0.1), pairs=20).passed


class Clock(NamedTuple):
    """Events at random times: ``kind`` says of which fault."""

    kind: str
    due: np.ndarray
    drawn: np.ndarray

    def draw(self, i, time):
        return -math.log(uniform(1, i, self.drawn[i]))


@next_time.register
def _(clock: Clock, i, x, v, time):
    if clock.kind == "kept":
        return clock.due[i]
    if clock.kind == "kept from the first question":
        if clock.due[i] <= time:
            clock.due[i] = time + clock.draw(i, time)
        return clock.due[i]
    if clock.kind == "a place ahead":  # moves towards it at the same speed
        return time + ((7.0 - x[0]) / v[0]) % (20.0 / abs(v[0]))
    if clock.kind == "a turn":
        return 0.25 * (math.floor(time / 0.25 + 1e-9) + 1.0)
    if clock.kind == "drawn by the question":
        clock.drawn[i] += 1
    if clock.kind == "an age":
        return time + 1.0 / np.linalg.norm(v)
    if clock.kind == "never, until then":
        return NEVER if time < 0.3 else clock.due[i] + 0.3
    return time + clock.draw(i, time)


@kick.register
def _(clock: Clock, i, mass, x, v, time):
    clock.drawn[i] += 1
    if clock.kind == "kept":
        clock.due[i] += clock.draw(i, time)
    if clock.kind not in ("kept", "a place ahead"):
        v *= -1.0


@dataclass(frozen=True)
class Clocked:
    """Kicks at the times of a clock."""

    kind: str

    def model(self, particles):
        n = len(particles.radii)
        return Clock(self.kind, np.full(n, 0.5 * (self.kind == "kept")), np.zeros(n, np.int64))


@pytest.mark.parametrize("kind", ["kept", "kept from the first question", "a place ahead", "a turn"])
def test_a_drive_whose_time_is_the_same_whenever_it_is_asked_passes(kind):
    found = carom.check(Clocked(kind), pairs=20, dimensions=(1, 3))
    assert found.passed, str(found)


@pytest.mark.parametrize("kind", ["drawn anew", "drawn by the question", "an age", "never, until then"])
def test_a_drive_whose_time_depends_on_when_it_is_asked_is_refused(kind):
    found = carom.check(Clocked(kind), pairs=20)
    assert {each.condition for each in found.failures} == {"asked"}
    assert "next_time is the same whenever it is asked on the way there" in str(found)
    with pytest.raises(InputError, match=r"asked: .* keep in a memory when it is due"):
        carom.Simulation(SCENE.replace(drive=Clocked(kind)))


class Uniform(NamedTuple):
    """A uniform field."""

    g: float


@position.register
def _(motion: Uniform, axis, x, v, t):
    return x + (v + 0.5 * motion.g * t) * t


@velocity.register
def _(motion: Uniform, axis, v, t):
    return v + motion.g * t


class Straight:
    """A field that is said to be none."""

    def model(self, particles):
        return Uniform(-1.0)


def test_a_motion_that_bends_and_does_not_say_so_is_refused():
    assert "uniform" in {failure.condition for failure in carom.check(Straight()).failures}
    with pytest.raises(InputError, match="uniform: not so that without straight = False"):
        carom.Simulation(SCENE.replace(motion=Straight()))


def test_a_curved_motion_must_look_at_images():
    with pytest.raises(
        InputError, match=r"images: not so that components meet across the faces of the box .*, axis = 0"
    ):
        carom.Simulation(SCENE.replace(motion=Curved(images=False)))
    explain(SCENE.replace(motion=Curved(images=True)))


class Half(NamedTuple):
    """A curve that nobody meets on."""


@position.register
def _(motion: Half, axis, x, v, t):
    return x


@velocity.register
def _(motion: Half, axis, v, t):
    return v


class HalfCurved(Curved):
    def model(self, particles):
        return Half()


def test_a_curved_motion_must_say_when_components_meet():
    with pytest.raises(InputError, match="Half does not answer carry"):
        carom.Simulation(SCENE.replace(motion=HalfCurved(True)))


class Plain(NamedTuple):
    """A contact law."""

    part: float


@transfer.register
def _(impact: Plain, rr, rv):
    return impact.part


@dataclass(frozen=True)
class Plastic:
    loss: float
    table: np.ndarray | None = None

    def model(self, particles):
        return Plain(1.0 - 0.5 * self.loss)


@pytest.mark.parametrize(
    ("before", "given", "words"),
    [
        (Plastic(0.5), Plastic(0.9), "Plastic with loss = 0.5, and the value given has loss = 0.9"),
        (Plastic(0.5, np.arange(3)), Plastic(0.5, np.arange(3) + 1), "Plastic with table = array of shape"),
        (Plastic(0.5), Straight(), "of the class Plastic, and the value given is of the class Straight"),
    ],
)
def test_a_file_is_not_loaded_with_another_value(before, given, words):
    arrays, attributes = to_arrays(SCENE.replace(impact=before))
    with pytest.raises(InputError, match="The impact of the file is " + re.escape(words)):
        from_arrays(arrays, attributes, impact=given)
    again = Plastic(before.loss, None if before.table is None else before.table.copy())
    from_arrays(arrays, attributes, impact=again)
    del attributes["impact"]["parameters"]  # a file of before
    if isinstance(given, Plastic):
        from_arrays(arrays, attributes, impact=given)


class Nothing(Parity):
    def model(self, particles):
        return None


class NoReach:
    def model(self, particles):
        return Parity().model(particles)


class Misspelt:
    def modle(self, particles):
        return None


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: carom.check(Nothing()), "model(particles) of Nothing returns None; expected a NamedTuple"),
        (
            lambda: carom.Simulation(SCENE.replace(interaction=Nothing())),
            "model(particles) of Nothing returns None; expected a NamedTuple",
        ),
        (
            lambda: carom.check(NoReach()),
            "NoReach is an interaction, as its model answers interaction_time, and has no reach(scene)",
        ),
        (lambda: carom.check(Misspelt()), "which has no model, but modle."),
        (lambda: SCENE.replace(motion=Misspelt()), "which has no model, but modle."),
        (lambda: SCENE.replace(motion=Parity()), "found Parity, an interaction: it has reach."),
        (lambda: carom.check(Parity(), dimensions="2"), "dimensions must be a tuple of integers, found the"),
        (lambda: carom.check(Parity(), dimensions=(0,)), "dimensions must be at least 1, found 0"),
        (lambda: carom.check(Parity(), pairs=0), "pairs must be at least 1, found 0"),
    ],
)
def test_what_is_no_value_is_refused_in_a_sentence(call, words):
    with pytest.raises(InputError, match=re.escape(words)):
        call()


def test_a_replay_says_when_a_model_is_only_rounded_otherwise():
    run = object.__new__(Replay)
    run._path, run._own, run._read_so_far = "events.h5", ["Drag"], 3
    run._compare(1.0, 1.0, "1 and 2")
    with pytest.raises(FileError, match=r"rounding alone; Drag is computed otherwise .* call math.exp"):
        run._compare(1.0 + 2.0**-52, 1.0, "1 and 2")
    with pytest.raises(FileError, match="the log is damaged"):
        run._compare(1.0 + 2.0**-20, 1.0, "1 and 2")


@pytest.mark.slow
def test_functions_of_math_replay_bit_for_bit(tmp_path):
    scene = SCENE.replace(motion=Drag(0.02), interaction=DragCores(0.02))
    run = carom.Simulation(scene, seed=1, event_log=tmp_path / "events.h5")
    run.run(time=2.0)
    run.save(tmp_path / "checkpoint.h5")
    run.close()
    assert run.collisions > 50
    own = {"motion": Drag(0.03), "interaction": DragCores(0.02)}
    for load in (carom.Simulation.load, Replay):
        with pytest.raises(FileError, match=r"Drag with g = 0.02, and the value given has g = 0.03"):
            load(tmp_path / ("events.h5" if load is Replay else "checkpoint.h5"), **own)
    again = Replay(tmp_path / "events.h5", motion=Drag(0.02), interaction=DragCores(0.02))
    again.advance_to(2.0)
    assert (again.frame().velocities == run.frame().velocities).all()
    assert (again.frame().positions == run.frame().positions).all()


@pytest.mark.slow
def test_a_curved_motion_that_looks_at_images_meets_across_the_faces():
    still = SCENE.replace(velocities=carom.Simulation(SCENE, seed=1).frame().velocities)
    straight, curved = carom.Simulation(still), carom.Simulation(still.replace(motion=Curved(True)))
    for k in range(60):  # rounding differs, and grows by a digit in ten collisions or so
        straight.run(collisions=1)
        curved.run(collisions=1)
        assert abs(straight.time - curved.time) < 1e-6, k
    curved.run(collisions=2000)
    assert curved.statistics.worst_overlap < 1e-9


def test_an_answer_must_have_the_parameters_of_its_question():
    with pytest.raises(InputError, match=r"An answer to interaction_time takes 7 parameters .* found 6 in "):

        @interaction_time.register
        def _(pair: NoReach, i, j, rr, rv, vv):
            return NEVER

    with pytest.raises(InputError, match=r"annotate its first parameter, def _\(pair: YourModel, ...\)"):

        @interaction_time.register
        def _(pair, i, j, rr, rv, vv, now):
            return NEVER

    assert NoReach not in interaction_time.registry


def test_an_answer_may_be_registered_for_a_class_that_is_given():
    class Given(NamedTuple):
        part: float

    @transfer.register(Given)
    def _(impact, rr, rv):
        return impact.part

    assert transfer(Given(0.75), 1.0, -1.0) == 0.75


def test_a_short_array_that_no_lane_names_is_found_by_asking():
    short = (("radii", np.full(31, 0.5)), ("kinds", np.zeros(30, np.int64)))
    with pytest.raises(InputError, match="The field kinds of Two has 30 items; expected 31"):
        explain(SCENE.replace(interaction=Parity(change=short)))


class Worn(NamedTuple):
    """The part exchanged, of each component."""

    parts: np.ndarray


@transfer.register
def _(impact: Worn, rr, rv):
    return 1.0


@exchanged_part.register
def _(impact: Worn, i, j, rr, rv, now):
    return min(impact.parts[i], impact.parts[j])


class Wearing:
    def __init__(self, length):
        self.length = length

    def model(self, particles):
        return Worn(np.ones(self.length))


def test_a_contact_law_with_a_short_array_is_refused():
    explain(SCENE.replace(impact=Wearing(31)))
    with pytest.raises(InputError, match="The field parts of Worn has 29 items; expected 31"):
        explain(SCENE.replace(impact=Wearing(29)))


class Counted(Two):
    """Cores that count."""


class Aged(Two):
    """Cores that know how old they are, and can say so."""


for question in (interaction_time, jump):
    for kind in (Counted, Aged):
        question.register(kind, question.registry[Two])


@record_impulse.register
def _(pair: Counted, i, j, momentum):
    pair.radii[i] += momentum


@shift_epoch.register
def _(pair: Aged, duration):
    pair.radii[0] += duration


@copy_state.register
def _(pair: Aged, before, instant, passed, slower):
    pair.radii[:] = before.radii


@dataclass(frozen=True)
class Remembering(Parity):
    kind: type = Counted

    def model(self, particles):
        return self.kind(*super().model(particles))


@pytest.mark.parametrize("kind", [Counted, Aged])
def test_a_pair_model_with_a_memory_runs_on_one_worker(kind):
    scene = carom.Scene.crystal(cells=20, dimension=2, packing_fraction=0.4).replace(
        interaction=Remembering(kind=kind)
    )
    with pytest.raises(InputError, match="one core only, because of a pair model with a memory"):
        carom.Simulation(scene, cores=2)


def test_a_memory_that_cannot_be_copied_is_refused_where_models_are_made_anew(monkeypatch):
    monkeypatch.setattr(RunState, "schedule", lambda machine: None)  # nothing is to run
    sim = carom.Simulation(SCENE.replace(interaction=Remembering()))
    with pytest.raises(InputError, match=r"Counted has a memory, and rescale\(\) .* a method copy_state"):
        sim._state.refit()
    with pytest.raises(InputError, match="Fading has a memory"):
        carom.Simulation(SCENE.replace(impact=Fades()), growth=0.1)


class Fading(NamedTuple):
    """A contact law that knows the time, and forgets it."""

    last: np.ndarray


@transfer.register
def _(impact: Fading, rr, rv):
    return 1.0


@shift_epoch.register
def _(impact: Fading, duration):
    impact.last[0] -= duration


class Fades:
    def model(self, particles):
        return Fading(np.zeros(1))


def test_one_component_alone_is_accepted():
    explain(carom.Scene([[1.0, 1.0]], 4.0, interaction=Parity()))


class Equal(NamedTuple):
    """Cores of one mass, which is no array."""

    masses: float


@interaction_time.register
def _(pair: Equal, i, j, rr, rv, vv, now):
    return first_contact(rr - 1.0, rv, vv)


@jump.register
def _(pair: Equal, i, j, rr, rv, now):
    return rv / rr, rv / rr, -rv * pair.masses


@mass.register
def _(pair: Equal, i):
    return pair.masses


class EqualCores(Parity):
    def model(self, particles):
        return Equal(1.0)


class DeepWell(SquareWell):
    """A value of one's own with steps."""


def test_what_needs_no_array_needs_none():
    explain(SCENE.replace(interaction=EqualCores()))
    explain(SCENE.replace(interaction=DeepWell(1.5, 1.0)))
