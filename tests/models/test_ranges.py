"""Range rules: counters, rules, timers, removal; against counting, the naive algorithm, replay and resume."""

import base64
import contextlib
import math
import os
import re

import numpy as np
import pytest
from helpers.browser import shown, where
from helpers.marks import slow
from helpers.naive.rules import NaiveRules
from helpers.plain import uncompiled

import carom
from carom.compiling.entry import Translated
from carom.compiling.faults import Untranslatable
from carom.errors import InputError
from carom.figures.palette import FACES, rgb
from carom.io.events import read_events
from carom.models import CHANGED, ENTERED, LEFT, TIMER, Kind, Ranges, draw
from carom.pictures import viewdata
from carom.simulation.replay import Replay
from carom.simulation.system_of_scene import prepare
from carom.studies.runs.report import _units

CIRCLES = ((2.0, 3.0), (2.5,))
TIMERS = (0.5, 0.0)
MEMORY = ((1.0, 2.0), (0.0, 0.0))


def turn(unit):
    """A random direction in the plane of the first axis and the others' diagonal."""
    angle = 2.0 * math.pi * draw(unit)
    for axis in range(len(unit.velocity)):
        unit.velocity[axis] = math.cos(angle) if axis == 0 else math.sin(angle)


def restless(unit, event):
    """Does everything that a rule can do."""
    unit.memory[0] += event.distance
    unit.memory[1] += event.time
    if event.cause == ENTERED and unit.counts[0, 1] > 2:
        unit.target = event.other
        turn(unit)
    if event.cause == LEFT and draw(unit) < 0.1:
        unit.kind = 1 - unit.kind
    if event.cause == TIMER:
        turn(unit)
        unit.timer = 0.3 + draw(unit)
        if event.other >= 0:
            for axis in range(len(unit.velocity)):
                unit.velocity[axis] = event.toward[axis] / event.distance
    if event.cause == CHANGED and draw(unit) < 0.1:
        unit.removed = True


def ranges(rule=restless, **more):
    names = zip(("hawk", "dove"), CIRCLES, TIMERS, MEMORY, strict=True)
    return Ranges([Kind(*each) for each in names], rule, **more)


def scattered(n=40, d=2, edge=11.0, seed=1, **more):
    rng = np.random.default_rng(seed)
    return carom.Scene(
        rng.uniform(0.0, edge, (n, d)), (edge,) * d, velocities=rng.normal(size=(n, d)),
        species=np.arange(n) % 2, diameter=0.1, interaction=ranges(), **more,
    )  # fmt: skip


def assert_counters(sim):
    """Every counter is what the distances of a frame say."""
    scene, x, units = sim.scene, sim.frame().positions, sim.interaction
    r = x[None] - x[:, None]
    r -= np.array(scene.box) * np.rint(r / np.array(scene.box)) * np.array(scene.periodic)
    apart = np.sqrt((r**2).sum(axis=-1))
    np.fill_diagonal(apart, np.inf)
    for i in range(scene.n):
        for c in range(units.counts.shape[1]):
            radii = CIRCLES[units.kinds[i]]
            seen = units.present & units.present[i] & (apart[i] < (radii[c] if c < len(radii) else 0.0))
            expected = np.bincount(units.kinds[seen], minlength=2)
            assert (units.counts[i, c] == expected).all()
    left = units.kinds[units.present].tolist()
    assert _units(sim) == {"hawk": left.count(0), "dove": left.count(1)}


def note(unit, event):
    """Writes down all that it is told of a crossing."""
    if event.cause == ENTERED and unit.memory[0] == 0.0:
        unit.memory[0], unit.memory[1], unit.memory[2] = 1.0, event.time, event.distance
        unit.memory[3], unit.memory[4], unit.memory[5] = event.other, event.kind, event.circle
        for axis in range(2):
            unit.memory[6 + axis] = event.toward[axis]
            unit.memory[8 + axis] = event.velocity[axis]
            unit.memory[10 + axis] = unit.velocity[axis]
            unit.memory[12 + axis] = unit.position[axis]


@pytest.mark.parametrize("power", [0, -30, 30])
def test_both_units_of_a_crossing_are_told_of_each_other(plain, power):
    """One stands at 2, the other comes from 4 with speed s along axis 0: it is 1.5 away after 0.5 / s."""
    s = 2.0**power
    kinds = [Kind("post", [1.0, 1.5], memory=np.zeros(14)), Kind("scout", [1.5], memory=np.zeros(14))]
    scene = carom.Scene(
        [[2.0, 3.0], [4.0, 3.0]], (9.0, 9.0), velocities=[[0.0, 0.125 * s], [-s, 0.125 * s]],
        species=[1, 0], diameter=0.1, interaction=Ranges(kinds, note),
    )  # fmt: skip
    sim = carom.Simulation(scene)
    sim.run(time=0.75 / s)
    y = 3.0 + 0.0625
    assert sim.interaction.memory[0].tolist() == [
        1.0, 0.5 / s, 1.5, 1, 0, 0, 1.5, 0.0, -s, 0.125 * s, 0.0, 0.125 * s, 2.0, y,
    ]  # fmt: skip
    assert sim.interaction.memory[1].tolist() == [
        1.0, 0.5 / s, 1.5, 0, 1, 1, -1.5, 0.0, 0.0, 0.125 * s, -s, 0.125 * s, 3.5, y,
    ]  # fmt: skip


STRETCHES = np.random.default_rng(2).exponential(0.15, 24).tolist()


@pytest.fixture(scope="module", params=["plain", slow("compiled")])
def run(request, tmp_path_factory):
    """A run with a log, looked at on the way and saved in the middle."""
    folder = tmp_path_factory.mktemp("ranges")
    with uncompiled() if request.param == "plain" else contextlib.nullcontext():
        sim = carom.Simulation(scattered(), event_log=folder / "log.h5", seed=0)
        for k, time in enumerate(STRETCHES):
            if k == 12:
                sim.save(folder / "checkpoint.h5")
            sim.run(time=time)
            assert_counters(sim)
        sim._state.flush_log()
    return sim, folder


def test_counters_are_what_distances_say_at_any_time(run):
    sim, _ = run
    # Not an empty truth: everything that can happen has happened often, and some are left.
    assert min(sim.interaction.asked.values()) > 20
    assert 0 < sim.interaction.present.sum() < sim.scene.n
    assert (np.bincount(sim.interaction.kinds) > 3).all()


def test_a_replay_asks_the_rules_again_bit_for_bit(run):
    sim, folder = run
    again = Replay(folder / "log.h5", interaction=ranges())
    again.advance_to(sim.time)
    for name in ("positions", "velocities"):
        assert (getattr(again.frame(), name) == getattr(sim.frame(), name)).all()


def test_the_viewer_flies_units_as_they_decided_and_shows_what_they_became(run):
    sim, folder = run
    data = viewdata.of_replay(Replay(folder / "log.h5", interaction=ranges()), 10**6)
    records = data["replay"]
    starts, times, places, velocities, kinds = (
        np.frombuffer(base64.b64decode(text), kind)
        for text, kind in [
            (records["starts"], "<i4"),
            (records["times"], "<f8"),
            (records["places"], "<f4"),
            (records["velocities"], "<f4"),
            (records["units"]["kinds"], "u1"),
        ]
    )
    places, velocities = places.reshape(-1, 3), velocities.reshape(-1, 3)
    assert records["units"]["names"] == ["hawk", "dove"]
    assert records["units"]["circles"] == [list(each) for each in CIRCLES]
    again, box = Replay(folder / "log.h5", interaction=ranges()), np.array([*sim.scene.box, 1.0])
    for time in np.linspace(0.0, sim.time, 9):
        again.advance_to(float(time))
        frame, decided = again.frame(), again.decided
        for k in range(frame.n):
            r = starts[k] + np.searchsorted(times[starts[k] : starts[k + 1]], time, side="right") - 1
            off = places[r] + velocities[r] * (time - times[r]) - np.append(frame.positions[k], 0.0)
            # float32 places up to the box, and velocities of order one over at most the run's time.
            assert np.abs(off - box * np.rint(off / box)).max() < 2.0**-21 * (box.max() + sim.time)
            assert kinds[r] == (decided[k] if decided[k] >= 0 else 255)
    assert (decided == np.where(sim.interaction.present, sim.interaction.kinds, -1)).all()


@pytest.mark.slow
def test_circles_and_kinds_are_seen_in_the_browser(run, tmp_path):
    page = carom.view(run[1] / "log.h5", interaction=ranges())
    plain = shown(page, tmp_path, "time=0&rings=0")
    ringed = shown(page, tmp_path, "time=0")
    late = shown(page, tmp_path, f"time={run[0].time}&rings=0")
    for kind in (0, 1):  # a ring of radius 2 to 3 has many more points than a disk of diameter 0.1
        assert where(ringed, rgb(FACES[kind]))[2] > 10 * max(where(plain, rgb(FACES[kind]))[2], 1)
    gray = np.abs(late - [0.62, 0.62, 0.62]).max(axis=2) < 0.03
    assert gray[80:400].sum() > np.abs(plain - [0.62, 0.62, 0.62]).max(axis=2)[80:400].__lt__(0.03).sum()


def test_a_checkpoint_goes_on_bit_for_bit(plain, run, tmp_path):
    sim, folder = run
    log = tmp_path / "log.h5"
    log.write_bytes((folder / "log.h5").read_bytes())  # what it holds beyond the checkpoint is dropped
    half = carom.Simulation.load(folder / "checkpoint.h5", interaction=ranges(), event_log=log)
    for time in STRETCHES[12:]:
        half.run(time=time)
    for name in ("positions", "velocities"):
        assert (getattr(half.frame(), name) == getattr(sim.frame(), name)).all()
    for name in ("kinds", "present", "counts", "memory", "timers", "targets"):
        assert (getattr(half.interaction, name) == getattr(sim.interaction, name)).all()
    assert half.interaction.asked == sim.interaction.asked
    half.close()


@pytest.mark.usefixtures("both_ways")
def test_the_events_are_those_of_the_naive_algorithm(tmp_path):
    scene = scattered(n=12, edge=8.0, seed=3)
    oracle = NaiveRules(
        scene.positions.tolist(),
        scene.velocities.tolist(),
        scene.box,
        CIRCLES,
        scene.species.tolist(),
        restless,
        timers=TIMERS,
        memory=MEMORY,
        digits=40,
    )
    expected = [oracle.decide() for _ in range(300)]
    sim = carom.Simulation(scene, event_log=tmp_path / "log.h5", seed=0)
    sim.run(time=float(oracle.time) * (1.0 + 1e-9))
    sim.close()
    log = read_events(tmp_path / "log.h5")
    units = [(i, j) if j < scene.n else (i,) for i, j in zip(log.i.tolist(), log.j.tolist(), strict=True)]
    assert units[:300] == [event.units for event in expected]
    times = log.epoch * sim._state.epoch_length + log.time
    # A rule that turns to a target magnifies rounding, 1e-16 at the start.
    assert times[:300] == pytest.approx([float(event.time) for event in expected], rel=1e-9)
    assert {event.cause for event in expected} == {ENTERED, LEFT, TIMER, CHANGED}
    for i, unit in enumerate(oracle.units):
        found = sim.interaction.counts[i]
        assert not unit.removed or (found == 0).all()
        assert {key: int(found[key]) for key in oracle.counts(i)} == oracle.counts(i)


def test_the_naive_algorithm_waits_for_the_timers_of_units_at_rest():
    """Two at rest, whose timer runs down at 1.5 and is set to infinity: then nothing follows."""

    def once(unit, event):
        unit.timer = math.inf

    still = [[0.0, 0.0], [0.0, 0.0]]
    oracle = NaiveRules([[1, 1], [4, 4]], still, [8, 8], [[1.0]], [0, 0], once, timers=[1.5], memory=[[]])
    assert [(float(each.time), each.units) for each in (oracle.decide(), oracle.decide())] == [
        (1.5, (0,)),
        (1.5, (1,)),
    ]
    with pytest.raises(InputError, match="at rest, and no timer runs"):
        oracle.decide()


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("d", [1, 3, 4])
def test_counters_in_one_three_and_four_dimensions(d):
    sim = carom.Simulation(scattered(n=8, d=d, edge=7.0, seed=d), seed=0)
    for time in STRETCHES[:16]:
        sim.run(time=time)
        assert_counters(sim)
    asked = sim.interaction.asked
    assert min(asked["entered"], asked["left"], asked["timer"]) > 3


def test_conditions_hold():
    report = carom.check(ranges())
    assert report.passed
    assert report.tried["V"] > 500


def test_what_is_compiled_is_told(run):
    sim, _ = run
    assert sim.explain().models["rules"] == "Units"
    assert math.isnan(sim.statistics.energy_drift)


TABLE = {"speed": 1.0}


def looks_up(unit, event):
    unit.velocity[0] = TABLE["speed"]


def asks_another(unit, event):
    if unit.kind == 0:
        looks_up(unit, event)


def mixes(unit, event):
    things = {"a": 1}
    things[3] = [unit.kind, "x"]


def opens(unit, event):
    with open(os.devnull) as file:
        file.read()


@pytest.mark.slow
def test_a_rule_that_cannot_be_compiled_is_refused_in_a_sentence():
    with pytest.raises(InputError) as caught:
        carom.Simulation(scattered(n=12).replace(interaction=ranges(asks_another)), seed=0).run(time=1.0)
    assert re.fullmatch(
        r"looks_up cannot be compiled: line \d+ of test_ranges.py, "
        r"`unit.velocity\[0\] = TABLE\[\"speed\"\]`: "
        r"a dictionary is not known here: write fields, or a tuple\.",
        str(caught.value),
    )


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        (looks_up, "`unit.velocity\\[0\\] = TABLE.*: a dictionary is not known here"),
        (mixes, "a dictionary is not known here: write fields, or a tuple"),
        (opens, "with is not known here"),
        (restless, None),
    ],
)
def test_the_reason_why_a_rule_cannot_be_compiled_is_short(rule, words, run):
    model = ranges(rule).model(run[0]._state.system.particles)

    def told(units, events):
        rule(units[0], events[0])

    if words is None:
        Translated(told, (model.units, model.told), "tried")
        return
    with pytest.raises(Untranslatable, match=words) as caught:
        Translated(told, (model.units, model.told), "tried")
    why = str(caught.value)
    assert "\n" not in why
    assert len(why) < 240


def past_the_end(unit, event):
    unit.memory[99] = 1.0


def fast(unit, event):
    unit.velocity[0] = math.nan


def unknown(unit, event):
    unit.kind = 7


def early(unit, event):
    unit.timer = 0.0


def aimless(unit, event):
    unit.target = 1000


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Kind("", [1.0]), "name of a kind"),
        (lambda: Kind("a", [2.0, 1.0]), "rise"),
        (lambda: Kind("a", [0.0]), "rise"),
        (lambda: Kind("a", "12"), "list of numbers"),
        (lambda: Kind("a", [1.0], timer=-1.0), "timer of 'a'"),
        (lambda: Kind("a", [1.0], memory=[math.nan]), "memory of 'a'"),
        (lambda: Ranges([Kind("a", [1.0], memory=[0.0] * 1001)], restless), "numbers at most; found 1001"),
        (lambda: Ranges([], restless), "kinds must be"),
        (lambda: Ranges([Kind("a")], restless), "No kind has a circle"),
        (lambda: Ranges([Kind("a", [1.0]), Kind("a", [1.0])], restless), "same name"),
        (lambda: Ranges([Kind("a", [1.0])], "restless"), "rule must be a function"),
        (lambda: Ranges([Kind("a", [1.0])], lambda unit: None), "rule must be a function"),
        (lambda: Ranges([Kind("a", [1.0])], restless, seed=-1), "seed"),
        (lambda: scattered().replace(interaction=Ranges([Kind("a", [1.0])], restless)), "2 species"),
        (lambda: scattered().replace(interaction=ranges(past_the_end)), "IndexError"),
        (lambda: carom.Simulation(scattered().replace(impact=0.9), seed=0), "impact is not for"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(make, words):
    with pytest.raises(InputError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_a_unit_forgets_a_target_that_is_gone_when_its_timer_is_due():
    from carom.models.interactions.units import cause_of

    scene = scattered()
    pair = scene.interaction.model(prepare(scene, np.zeros_like(scene.positions)).particles)
    for present, told in ((1, 5), (0, -1)):
        pair.targets[3], pair.present[5] = 5, present
        assert cause_of(pair, 3, 0.25) == (TIMER, told)
        assert pair.targets[3] == told
        assert pair.timers[3] == math.inf


@pytest.mark.parametrize(
    ("rule", "words"), [(fast, "velocity"), (unknown, "kind"), (early, "timer"), (aimless, "target")]
)
def test_a_wrong_answer_of_a_rule_ends_the_run_in_a_sentence(rule, words, run):
    # What the rule leaves is looked at by apply(), compiled or not.
    from carom.models.interactions.units import apply, fill_agent, fill_event

    pair = scattered().interaction.model(run[0]._state.system.particles)
    pair = pair._replace(rule=ranges(rule).model(run[0]._state.system.particles).rule)
    x, v = np.zeros(2), np.ones(2)
    fill_agent(pair, 0, 3, x, v, 0.25)
    fill_event(pair, 0, TIMER, -1, -1, 0.25)
    pair.rule.call_rule(pair.units[0], pair.told[0])
    assert apply(pair, 0, 3, v, 0.25) == -1
    assert (v == 1.0).all()
    assert pair.error_message().startswith("The rule gave unit 3")
    assert words in pair.error_message()
