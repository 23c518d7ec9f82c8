"""Jobs: a task that is killed at any moment goes on inside, and its record has the same bits."""

import random
from dataclasses import dataclass, field

import pytest

import carom
from carom.errors import FileError, InputError
from carom.models import own
from carom.studies import Codes, EquationOfState, Packings, ShearFlow, StudySpec, Transport, job as jobs
from carom.studies.job import Job, Look, Stopped
from carom.studies.planner.diffusion import DiffusionMethod
from carom.studies.planner.pressure import PressureMethod
from carom.studies.planner.system import System
from carom.studies.trade import trade

WELL = {"interaction": carom.models.SquareWell(1.5, 1.0)}
PAIR = {"species": [{"fraction": 0.5}, {"fraction": 0.5, "diameter": 0.5, "mass": 4.0}]}
SHORT = {"n": (108,), "equilibration": 20.0, "replicas": 1, "blocks": 32}
THIN, FLUID = {"packing_fraction": (0.2,)}, {"packing_fraction": (0.3,)}


class Killed(BaseException):
    """The process was killed."""


class Dangerous(Look):
    """A look of a process that is killed at one of so many moments, some time after a state was written."""

    def __init__(self, kept, dice, moments):
        super().__init__(None, kept)
        self.dice, self.left = dice, dice.randrange(1, moments)

    def __call__(self, *_):
        self.due = 0.0 if self.dice.random() < 0.1 else float("inf")
        super().__call__()
        self.glance()

    def glance(self, *_):
        self.left -= 1
        if not self.left:
            raise Killed


def moments(measure, task):
    """Return the result of a task that nobody disturbs, and at how many moments it can be killed."""
    seen = []
    look = Look(lambda: seen.append(1))
    return measure(task, look), len(seen)


def killed_again_and_again(measure, task, kept, kills=5, seed=1):
    """Kill a task at random moments of what is left of it; return the whole result and the killed one."""
    whole, count = moments(measure, task)
    dice, landed = random.Random(seed), 0
    for _ in range(kills):
        try:
            measure(task, Dangerous(kept, dice, max(count // 2, 2)))
            break
        except Killed:
            landed += 1
    assert landed >= min(kills, 3)
    assert kept.exists(), "no state was written before a kill"
    found = measure(task, Look(None, kept))
    for each in (whole, found):
        each.pop("timings", None)
    return whole, found


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        (EquationOfState, SHORT | {"packing_fraction": (0.45,), "collisions_per_particle": 200.0}),
        (EquationOfState, SHORT | {"packing_fraction": (0.49,), "relative_error": 0.02}),
        (EquationOfState, SHORT | THIN | {"collisions_per_particle": 50.0, "scene": WELL}),
        (EquationOfState, SHORT | FLUID | {"collisions_per_particle": 50.0, "scene": PAIR}),
        (Transport, SHORT | THIN | {"collisions_per_particle": 1500.0}),
        (Transport, SHORT | THIN | {"collisions_per_particle": 1500.0, "scene": WELL}),
        (ShearFlow, SHORT | FLUID | {"rate": (1.0,), "strains": 4.0}),
        (ShearFlow, SHORT | FLUID | {"rate": (1.0,), "relative_error": 0.3}),
        (ShearFlow, SHORT | FLUID | {"rate": (1.0,), "strains": 4.0, "restitution": 0.8}),
        (Codes, {"n": 9, "dimension": 3, "tries": 1, "starts": 4, "hops": 8}),
        (Packings, {"n": 30, "dimension": 2, "rate": 0.05, "until_Z": 1e4, "seeds": 1}),
    ],
    ids=[
        "hard", "near freezing, to an error", "wells", "mixture", "transport", "transport of wells", "flow",
        "flow, to an error", "inelastic flow", "a try of a search for a code", "packing",
    ],
)  # fmt: skip
def test_a_task_of_a_study_goes_on_inside(tmp_path, kind, given):
    (task,) = kind.Spec(**given).tasks()
    whole, found = killed_again_and_again(kind.measure, task, tmp_path / "state.h5")
    assert whole == found


@own.observer
class Count:
    """Counts collisions."""

    one: int
    counts = own.memory(0, "one")

    def at_pair(self, event):
        self.counts[0] += 1


class Counted(Job):
    """A job with a model of one's own, of which a file holds the numbers and no code."""

    @classmethod
    def begin(cls, task):
        return cls(task, carom.Simulation(carom.Scene.crystal(32, 0.2), seed=1, observers=[Count(1)]))

    def step(self, look):
        self.sim.run(collisions=10)
        return self.sim.collisions < 100

    def result(self):
        return {"counted": int(self.sim.observers[0].counts[0])}


def test_a_job_with_a_model_of_ones_own_goes_on_inside(tmp_path):
    kept, stop, seen = tmp_path / "state.h5", iter([False] * 5), []
    with pytest.raises(Stopped):
        Counted.measure({"seed": 1}, Look(lambda: next(stop, True), kept))
    look = Look(lambda: seen.append(1), kept)
    assert Counted.measure({"seed": 1}, look) == {"counted": 100}
    assert len(seen) == 5, "it began anew"


@dataclass
class Keyed(Job):
    """A job that counts by numbers, which a file would give back as texts."""

    counts: dict = field(default_factory=lambda: {"by size": {1: 0}})


def test_a_state_that_would_come_back_as_another_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"Keyed\.counts\.by size has the key 1, .* give a text"):
        Keyed({}).save(tmp_path / "state.h5")
    assert not [*tmp_path.iterdir()]


def how(method):
    return method(System(0.3), *(["Z"] if method is PressureMethod else []))


@pytest.mark.parametrize("method", [PressureMethod, DiffusionMethod])
def test_a_run_of_a_plan_goes_on_inside(tmp_path, method):
    (task,) = how(method).tasks(64, 1, 20.0, 2000.0, 1)
    whole, found = killed_again_and_again(how(method).run.measure, task, tmp_path / "state.h5", seed=2)
    assert whole == found


@pytest.mark.parametrize("method", [PressureMethod, DiffusionMethod])
def test_a_pilot_of_a_plan_goes_on_inside(tmp_path, monkeypatch, method):
    monkeypatch.setattr("carom.studies.planner.diffusion.OF_PILOT", 16)
    monkeypatch.setattr("carom.studies.planner.measures.COLLISIONS", 300)
    task = how(method).pilot(64, seed=1, seconds=600.0, equilibration=None)
    whole, found = killed_again_and_again(how(method).trial.measure, task, tmp_path / "state.h5", seed=2)
    assert whole == found
    assert 50.0 < whole["equilibration"] < 1000.0


def test_a_row_of_a_comparison_keeps_its_parts(tmp_path, monkeypatch):
    done = []

    def part(row, look):
        done.append(len(done))
        if len(done) == 2:
            raise Killed
        return {f"number {done[-1]}": 1}

    monkeypatch.setattr(jobs, "EVERY", 0.0)
    monkeypatch.setattr(jobs, "PART", 0.0)
    for name in ("moved", "timed", "faithful"):
        monkeypatch.setattr(trade.TradeRow, name, part)
    task = {"row": "method", "scene": {}, "seed": 1, "seconds": 1.0}
    measure, kept = trade.TradeRow.measure, tmp_path / "state.h5"
    with pytest.raises(Killed):
        measure(task, Look(None, kept, due=0.0))
    found = measure(task, Look(None, kept))
    assert found == {"number 0": 1, "number 2": 1, "number 3": 1, "timings": {}}


def test_a_state_on_a_full_disk_is_written_later(tmp_path, monkeypatch):
    (task,) = StudySpec(**SHORT, **FLUID, collisions_per_particle=20.0).tasks()
    look = Look(None, tmp_path / "nowhere" / "state.h5")
    monkeypatch.setattr(jobs, "EVERY", 0.0)
    look.due = 0.0
    assert EquationOfState.measure(task, look)["n"] == 108
    with pytest.raises(FileError):
        look.job.save(look.kept)


def test_a_damaged_state_begins_anew(tmp_path):
    (task,) = StudySpec(**SHORT, **FLUID, collisions_per_particle=20.0).tasks()
    kept, stop = tmp_path / "state.h5", iter([False] * 20)
    with pytest.raises(Stopped):
        EquationOfState.measure(task, Look(lambda: next(stop, True), kept))
    kept.write_bytes(kept.read_bytes()[:1000])
    whole, found = (EquationOfState.measure(task, Look(None, path)) for path in (None, kept))
    assert whole | {"timings": 0} == found | {"timings": 0}
