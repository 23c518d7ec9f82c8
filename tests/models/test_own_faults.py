"""Faults of models of one's own are named by ``carom.check``, and refused in a sentence before a run."""

import math
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest
from helpers.faulty import (
    OPEN,
    SCENE,
    Bare,
    Beside,
    Bouncy,
    Bounded,
    Clocked,
    Cores,
    Curved,
    Drag,
    DragCores,
    Fades,
    Floor,
    Flying,
    Law,
    Mine,
    Misspelt,
    Parity,
    Shoulder,
    Two,
    conditions,
    modelled,
)

import carom
from carom.errors import CaromWarning, FileError, InputError, OverlapError
from carom.models import Bonds, Gravity, Loss, SquareWell, own
from carom.models.interfaces.interaction import PairModel
from carom.models.interfaces.particles import lanes
from carom.models.obstacles.with_properties import Surface
from carom.scene.storage import from_arrays, to_arrays
from carom.simulation.explanation import explain
from carom.simulation.replay import Replay


def scene_of(field, value):
    """Return a scene with a model of one's own."""
    return OPEN.replace(obstacles=[value]) if field == "obstacles" else SCENE.replace(**{field: value})


def refused(scene, condition):
    """Let a simulation refuse a scene for a condition; nothing is compiled."""
    with pytest.raises(InputError, match=rf"condition of carom\.check, .* {condition}: not so that"):
        carom.Simulation(scene)


WRONG = {
    "interaction": [
        (Mine("unlike times"), "I"),
        (Mine("unlike jumps"), "II"),
        (Mine("late"), "IV"),
        (Mine("soft"), "V"),
        (Mine("backwards"), "V"),
        (Mine("momentum"), "momentum"),
        (Mine("energy"), "energy"),
        (Mine("sign"), "virial"),
        (Mine("size"), "virial"),
        (Mine("core"), "core"),
        (Mine("lost"), "core"),
        (Shoulder("in"), "energy"),
        (Shoulder("out"), "energy"),
        (Shoulder("virial"), "virial"),
        (Shoulder("unlike kinds"), "II"),
        (Shoulder("kind"), "step"),
        (Shoulder("step"), "step"),
    ],
    "motion": [
        (Flying("squared"), "III"),
        (Flying("brakes"), "relative"),
        (Flying("exit"), "exit"),
        (Flying("bends"), "uniform"),
        (Drag(0.1), "relative"),
    ],
    "impact": [(Law(0.4), "part"), (Law(-1.0), "part"), (Law(math.nan), "part")],
    "obstacles": [
        (Floor("late"), "encounter"),
        (Floor("early"), "encounter"),
        (Floor("lost"), "encounter"),
        (Floor("hair"), "touching"),
        (Floor("long"), "outward"),
        (Floor("double"), "outward"),
        (Floor("inwards"), "outward"),
        (Floor("through"), "V"),
    ],
    "drive": [
        (Clocked("drawn anew"), "asked"),
        (Clocked("drawn by the question"), "asked"),
        (Clocked("an age"), "asked"),
        (Clocked("never, until then"), "asked"),
    ],
}


@pytest.mark.parametrize(
    ("field", "value", "condition"), [(field, *row) for field, rows in WRONG.items() for row in rows]
)
def test_a_broken_condition_is_named_by_check_and_refused_by_a_simulation(field, value, condition):
    found = conditions(value)
    assert condition in found
    if field in ("drive", "impact") or ("sense" not in repr(value) and field == "obstacles"):
        assert found == {condition}
    with pytest.raises(InputError, match=r"condition of carom\.check"):
        carom.Simulation(scene_of(field, value))


def test_a_report_names_the_condition_in_every_dimension_with_numbers():
    found = carom.check(Mine("late"))
    assert {failure.dimension for failure in found.failures} == {1, 2, 3, 4}
    assert "FAILS IV" in str(found)
    assert "time = " in str(found)


def test_a_reach_that_is_too_small_and_a_gap_of_the_wrong_sign_are_named():
    assert conditions(Parity(far=0.99999)) == conditions(Parity(far=1e-6)) == {"reach"}
    assert "reach" in conditions(Shoulder(far=0.7))
    assert "encounter" in conditions(Floor(sense=-1.0))


@own.motion
class Strays(Drag):
    exit_time = None


def test_a_simulation_tries_a_model_in_its_scene():
    falling = OPEN.replace(motion=Gravity((0.0, -1.0)))
    heavy = np.where(np.arange(SCENE.n) == 17, 2.0, 1.0)
    explain(SCENE.replace(interaction=Mine("unlike")))
    explain(SCENE.replace(interaction=Shoulder("in", keeps=False)))
    explain(OPEN.replace(motion=Flying(part=1.0)))
    for scene, condition in (
        (SCENE.replace(interaction=Mine("unlike"), mass=heavy), "virial"),  # of one component among many
        (SCENE.replace(motion=Drag(0.1), interaction=DragCores(0.2)), "relative"),
        (SCENE.replace(motion=Strays(0.1), interaction=DragCores(0.1)), "exit"),
        (SCENE.replace(motion=Curved(images=False)), "images"),
        (SCENE.replace(motion=Flying("bends")), "uniform"),
        (OPEN.replace(motion=Flying(part=0.5)), "encounter"),
        (OPEN.replace(motion=Flying(part=2.0)), "encounter"),
        (falling.replace(obstacles=[Floor("late")]), "encounter"),
        (OPEN.replace(obstacles=[Surface(Floor("late"), Loss(0.9, contact_time=1e-3))]), "encounter"),
    ):
        refused(scene, condition)


def test_what_adds_energy_says_so_or_a_simulation_warns():
    assert conditions(Law(1.5)) == conditions(Bouncy("gain")) == {"gain"}
    assert conditions(Law(1.5, adds_energy=True)) == set()
    with pytest.warns(CaromWarning, match="Law makes energy. gain: not so that a contact adds no energy"):
        explain(SCENE.replace(impact=Law(1.5)))
    with pytest.warns(CaromWarning, match="floor makes energy"):
        explain(OPEN.replace(obstacles=[Bouncy("gain")]))
    explain(SCENE.replace(impact=Law(1.5, adds_energy=True)))


# --------------------------------------------------------------------------------- models and sentences


class ByRadii(Parity):
    by_radii = True


class Nowhere(Shoulder):
    steps_of = None


class Mute(Shoulder):
    def model(self, particles):
        return Mine().model(particles)


class NoReach:
    def model(self, particles):
        return Parity().model(particles)


class Spelt:
    def modle(self, particles):
        return None


class Half(Curved):
    def model(self, particles):
        return Flying().model(particles)


class Nameless:
    def gap(self, positions, radii, box, periodic):
        return radii

    def model(self):
        return None


class Inside(Floor):
    def gap(self, positions, radii, box, periodic):
        return np.full(len(positions), -1.0)


def changed(**fields):
    """Return cores with other fields of the model."""
    return Parity(change=tuple(fields.items()))


REACHES = [
    (None, "must be a number, found nothing"), ("one", "must be a number, found the string 'one'"),
    (math.nan, "must be finite"), (math.inf, "must be finite"), (0.0, "must be greater than 0"),
    (-1.0, "must be greater than 0"),
]  # fmt: skip
BOTH = [
    *((Parity(far=far), "reach(scene) of Parity " + words) for far, words in REACHES),
    (modelled(lambda r, m, p: Bare(m)), "does not derive from carom.models.interfaces.interaction.PairModel"),
    (modelled(lambda r, m, p: PairModel()), "PairModel does not answer interaction_time"),
    (modelled(lambda r, m, p: None), "model(particles) of Modelled returns None; expected a model"),
    (modelled(lambda r, m, p: Misspelt(r, m), "Odd"), "Odd fails where Carom asks it"),
    (Shoulder("events"), "Ledge has steps, and no array events"),
    (Nowhere(), "Nowhere has steps, and no steps_of: give it both"),
    (Mute(), "Mute has steps, and Cores does not answer step_time"),
]


@pytest.mark.parametrize(("value", "words"), BOTH)
def test_an_interaction_is_refused_in_a_sentence_by_check_and_by_a_simulation(value, words):
    for make in (carom.check, lambda v: carom.Simulation(SCENE.replace(interaction=v))):
        with pytest.raises(InputError, match=re.escape(words)) as caught:
            make(value)
        assert "\n" not in str(caught.value)


LANE = "The field radii of Beside is named by lanes, and is"
SIZES = np.where(np.arange(30) % 2, 1.0, 0.8)  # like ones touch at 1.0, two small ones at 0.8
SENTENCES = [
    *(
        ({"interaction": Parity(far=far)}, rf"\d+ act on each other {found} apart, .* {far:g}: the engine")
        for far, found in ((0.99999, "1"), (0.5, "0.6"), (1e-6, "0.6"))
    ),
    ({"diameter": SIZES, "interaction": ByRadii()},
     "act on each other 1 apart, beyond the sum of their radii"),
    ({"interaction": Shoulder(far=0.7)}, "act on each other 1 apart, beyond reach"),
    ({"interaction": Shoulder("short")}, r"energy of Ledge has the shape \(3,\); expected \(4,\)"),
    ({"interaction": changed(kinds=np.zeros(30, np.int64))}, "kinds of Two has 30 items; expected 31"),
    ({"interaction": changed(kinds=np.zeros(5, np.int64))}, "kinds of Two has 5 items; expected 31"),
    ({"interaction": changed(masses=[1.0] * 31)}, r"masses of Two, .* is a list of 31, .* an array"),
    ({"interaction": changed(radii=np.full(31, 0.5), kinds=np.zeros(30, np.int64))},
     "kinds of Two has 30 items; expected 31"),
    *(
        ({"interaction": modelled(lambda r, m, p, values=values: Beside(values, m))}, LANE + ".* contiguous")
        for values in (
            np.zeros((31, 2)),
            np.zeros((31, 2))[:, 0],
            np.zeros(62)[::2],
            np.asfortranarray(np.zeros((31, 31))),
        )
    ),
    ({"motion": Half(True)}, "Flight does not answer carry"),
    ({"impact": Law(1.0, length=29)}, "The field asked of Part has 29 items; expected 31"),
]  # fmt: skip


@pytest.mark.parametrize(("fields", "words"), SENTENCES)
def test_a_scene_with_a_fault_is_refused_in_a_sentence(fields, words):
    with pytest.raises(InputError, match=words):
        carom.Simulation(SCENE.replace(**fields))


GROWTH = "growth is of Carom's hard cores, and the interaction is a Mine"
ANSWERS = "NoReach is an interaction, as its model answers interaction_time, and has no reach(scene)"


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: carom.check(3), "check() needs the value of an interaction"),
        (lambda: carom.check(Mine), "check() needs the value of an interaction"),
        (lambda: carom.check(NoReach()), ANSWERS),
        (lambda: carom.check(Spelt()), "which has no model, but modle."),
        (lambda: carom.check(Nameless()), "Nameless is an obstacle, as it has gap, and has no name"),
        (lambda: carom.check(Inside()), "No component near floor and outside of it was found"),
        (lambda: carom.check(changed(kinds=np.zeros(8, np.int64))), "of Two has 8 items; expected 9"),
        (lambda: carom.check(Parity(), dimensions="2"), "dimensions must be a tuple of integers, found the"),
        (lambda: carom.check(Parity(), dimensions=(0,)), "dimensions must be at least 1, found 0"),
        (lambda: carom.check(Parity(), pairs=0), "pairs must be at least 1, found 0"),
        (lambda: carom.check(Drag(0.2), motion=Drag(0.2)), "motion= goes with an interaction or an obstacle"),
        (lambda: SCENE.replace(motion=Spelt()), "which has no model, but modle."),
        (lambda: SCENE.replace(motion=Parity()), "found Parity, an interaction: it has reach."),
        (lambda: SCENE.replace(motion=object()), "which has no model"),
        (lambda: SCENE.replace(interaction=Mine), "found the class Mine, not a value of it"),
        (lambda: SCENE.replace(interaction=3), "interaction must be a value with reach and model"),
        (lambda: SCENE.replace(impact="soft"), "impact must be a value with model"),
        (lambda: carom.Simulation(SCENE.replace(interaction=Mine()), growth=0.1), GROWTH),
        (lambda: carom.Simulation(SCENE.replace(impact=Fades()), growth=0.1), "Fading has a memory"),
        (
            lambda: carom.Simulation(OPEN.replace(motion=Flying(straight=False))),
            "met in straight flight only, and Flying bends",
        ),
        (
            lambda: carom.Simulation(OPEN.replace(motion=type("Bent", (Curved,), {"straight": True})(True))),
            "Bent has curved = True: give it straight = False, too",
        ),
        (
            lambda: carom.Simulation(
                SCENE.replace(motion=Flying(straight=False)), tuning=carom.Tuning(neighbors="lists")
            ),
            "acceleration has a bound, which Flying does not tell",
        ),
    ],
)
def test_what_is_no_value_is_refused_in_a_sentence(call, words):
    with pytest.raises(InputError, match=re.escape(words)):
        call()


@pytest.mark.parametrize(
    "value",
    [Parity(1.5, 1.5, 1.5), modelled(lambda r, m, p: Bounded(2.25, r, m), like=1.5, unlike=1.5, far=1.5)],
)
def test_an_overlapping_start_is_refused_though_components_are_penetrable(value):
    with pytest.raises(OverlapError, match=r"Components \d+ and \d+ overlap by .* keeps them 1.5 apart"):
        carom.Simulation(SCENE.replace(interaction=value))


def test_a_lane_must_be_a_field():
    with pytest.raises(InputError, match="Lined has no field 'kind' for a lane; known are kinds"):

        @lanes("kind")
        class Lined(NamedTuple):
            kinds: np.ndarray


# ------------------------------------------------------------------------------------ what is accepted


class Equal(PairModel):
    """Cores of one mass, which is no array."""

    masses: float

    def interaction_time(self, i, j, rr, rv, vv, now):
        return Cores("", None, None).interaction_time(i, j, rr, rv, vv, now)

    def jump(self, i, j, rr, rv, now):
        return rv / rr, rv / rr, -rv * self.masses

    def mass_of(self, i):
        return self.masses


class DeepWell(SquareWell):
    """A value of one's own with steps."""


def test_models_without_fault_are_accepted():
    assert carom.check(Bonds([(0, 1), (2, 3)], outer=1.5)).passed
    explain(carom.Scene([[1.0, 1.0]], 4.0, interaction=Parity()))  # one component alone
    for fields in (
        {"interaction": Parity()},
        {"interaction": Parity(like=1e-3, unlike=1.0, far=3.0)},  # penetrable pairs may overlap
        {"interaction": Mine()},
        {"interaction": Mine("clay")},  # contacts may lose energy
        {"interaction": Shoulder()},
        {"interaction": modelled(lambda r, m, p: Equal(1.0))},
        {"interaction": DeepWell(1.5, 1.0)},
        {"motion": Drag(0.1), "interaction": DragCores(0.1)},
        {"motion": Curved(images=True)},
        {"impact": Law(1.0)},
    ):
        explain(SCENE.replace(**fields))


def test_the_check_of_a_motion_that_is_not_uniform_says_what_to_give():
    found = carom.check(Drag(0.1), pairs=20)
    assert [each.condition for each in found.failures] == ["relative"] * 4
    assert "with an interaction that computes its times along this motion" in str(found)


@pytest.mark.parametrize("kind", ["kept", "kept from the first question", "a place ahead", "a turn"])
def test_a_drive_whose_time_is_the_same_whenever_it_is_asked_passes(kind):
    assert conditions(Clocked(kind), dimensions=(1, 3)) == set()


def test_a_drive_whose_time_depends_on_when_it_is_asked_is_told_what_to_keep():
    assert "next_time is the same whenever it is asked on the way there" in str(
        carom.check(Clocked("an age"))
    )
    with pytest.raises(InputError, match=r"asked: .* keep in a memory when it is due"):
        carom.Simulation(SCENE.replace(drive=Clocked("an age")))


# --------------------------------------------------------------------------- files, replays and memories


@dataclass(frozen=True)
class Plastic:
    loss: float
    table: np.ndarray | None = None

    def model(self, particles):
        return Law(1.0 - 0.5 * self.loss).model(particles)


@pytest.mark.parametrize(
    ("before", "given", "words"),
    [
        (Plastic(0.5), Plastic(0.9), "Plastic with loss = 0.5, and the value given has loss = 0.9"),
        (Plastic(0.5, np.arange(3)), Plastic(0.5, np.arange(3) + 1), "Plastic with table = array of shape"),
        (Plastic(0.5), Flying(), "of the class Plastic, and the value given is of the class Flying"),
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


def test_a_replay_says_when_a_model_is_only_rounded_otherwise():
    run = object.__new__(Replay)
    run._path, run._own, run._read_so_far = "events.h5", ["Drag"], 3
    run._compare(1.0, 1.0, "1 and 2")
    with pytest.raises(FileError, match=r"rounding alone; Drag is computed otherwise .* write math.exp"):
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


class Counted(Two):
    """Cores that count."""

    def record_impulse(self, i, j, momentum):
        self.radii[i] += momentum


class Aged(Two):
    """Cores that know how old they are, and can say so."""

    def shift_epoch(self, duration):
        self.radii[0] += duration

    def copy_state(self, before, instant, passed, slower):
        self.radii[:] = before.radii


def remembering(kind):
    return modelled(lambda r, m, p: kind(*Parity().model(p)))


class Grown(Two):
    """Cores that say that they grow."""

    def growth_of(self, i):
        return 0.0


@pytest.mark.parametrize("kind", [Counted, Aged, Grown])
def test_a_pair_model_with_a_memory_runs_on_one_worker(kind):
    scene = carom.Scene.crystal(cells=20, dimension=2, packing_fraction=0.4)
    with pytest.raises(InputError, match="one core only, because of a pair model with a memory"):
        carom.Simulation(scene.replace(interaction=remembering(kind)), cores=2)


def test_a_memory_that_cannot_be_copied_is_refused_where_models_are_made_anew(unscheduled):
    sim = carom.Simulation(SCENE.replace(interaction=remembering(Counted)))
    with pytest.raises(InputError, match=r"Counted has a memory, and rescale\(\) .* a method copy_state"):
        sim._state.refit()
