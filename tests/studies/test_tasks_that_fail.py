"""A task of a study of one's own that fails, in whatever way, costs itself alone."""

import math
import signal
import sys
from dataclasses import dataclass

import numpy as np
import pytest
from helpers.roots import Roots, RootSpec
from helpers.workers import odd, run_all

from carom.errors import CaromWarning, InputError
from carom.studies import executors, own
from carom.studies.signals import stoppable


def _round():
    found = []
    found.append(found)
    return found


FAULTS = {
    "nan": (lambda: {"root": math.nan}, "result['root'] is nan, and a file holds finite numbers"),
    "infinity of NumPy": (lambda: {"root": [0.0, np.float32("inf")]}, r"result['root'][1] is inf"),
    "array": (lambda: {"root": np.ones(2)}, "result['root'] is a ndarray"),
    "set": (lambda: {"roots": {"all": {1, 2}}}, "result['roots']['all'] is a set"),
    "key": (lambda: {"roots": {1: 2}}, "result['roots'] has the key 1, and keys in a file are texts"),
    "circle": (lambda: {"root": _round()}, "RecursionError"),
    "digits": (lambda: {"root": 10**5000}, "result['root'] is an integer of more than 18 digits"),
    "timings": (lambda: {"root": 1, "timings": {"cpu": math.inf}}, "result['timings']['cpu'] is inf"),
    "nothing": (lambda: None, "measure must return a dictionary, found nothing"),
    "exit": (lambda: sys.exit("no root"), "SystemExit: no root"),
    "error": (lambda: 1 // 0, "ZeroDivisionError"),
}


NUMBERS = RootSpec(x=(-1.0, 1.0, 4.0))


def study_of(fault):
    """Return the class of a study in which the task of a negative number has a fault."""

    def measure(task, look):
        return Roots.measure(task, look) if task["x"] >= 0.0 else fault()

    return type("Faulty", (Roots,), {"measure": staticmethod(measure)})


def test_of_several_tasks_that_fail_the_first_one_is_named(tmp_path):
    with pytest.warns(CaromWarning, match="2 of 4 runs failed, the first one at x -2.0: ZeroDivisionError"):
        study = study_of(lambda: 1 // 0)(RootSpec(x=(-2.0, -1.0, 1.0, 4.0))).run(
            executor="serial", out=tmp_path
        )
    assert [failure.task["x"] for failure in study.failures] == [-2.0, -1.0]


@pytest.mark.parametrize("executor", ["serial", "threads"])
@pytest.mark.parametrize(("fault", "said"), FAULTS.values(), ids=FAULTS)
def test_a_task_that_fails_costs_itself_alone(tmp_path, executor, fault, said):
    kind = study_of(fault)
    with pytest.warns(CaromWarning, match="1 of 3 runs failed, the first one at x -1"):
        study = kind(NUMBERS).run(executor=executor, out=tmp_path)
    assert [row.root for row in study.table] == [1.0, 2.0]
    assert [failure.task["x"] for failure in study.failures] == [-1.0]
    assert study.failures[0].reason.startswith(said)
    # Both are on the disk, and a study without the fault runs the third.
    assert len(kind.load(tmp_path).records) == 2
    assert study_of(lambda: {"root": 0})(NUMBERS).run(executor=executor, out=tmp_path).complete


def in_two_parts(task, look):
    """Stand for a long task, which is killed when it has kept its state for the first time."""
    if not look.kept.exists():
        look.kept.write_text("half")
        raise RuntimeError("the machine was switched off")
    return {"root": 1.0, "from": look.kept.read_text()}


def test_a_long_task_goes_on_where_it_kept_its_state(tmp_path):
    study = type("Long", (Roots,), {"long": True, "measure": staticmethod(in_two_parts)})(RootSpec(x=(1.0,)))
    with pytest.warns(CaromWarning, match="switched off"):
        study.run(executor="serial", out=tmp_path)
    assert len(list(tmp_path.glob("tasks/*.h5"))) == 1
    assert study.run(executor="serial", out=tmp_path).records[0]["result"] == {"root": 1.0, "from": "half"}
    assert not list(tmp_path.glob("tasks/*.h5"))


def test_a_study_without_a_table_says_how_far_it_is():
    bare = type("Bare", (Roots,), {"table": own.Study.table})
    assert str(bare(RootSpec()).run(executor="serial")).startswith("Roots of numbers: 2 runs")


def test_an_error_that_no_other_process_can_make_again_costs_its_own_task_only():
    with executors.opened("processes", 1) as where:
        ended, done, failed = run_all(odd, [1, 2, 3], where)
    assert (ended, done) == (True, [(2, 2)])
    assert sorted(failed) == [(1, "Odd: 1 is odd"), (3, "Odd: 3 is odd")]  # whoever ends first


def test_a_result_is_the_same_before_and_after_it_was_a_file(tmp_path):
    result = {"root": np.int64(3), "pair": (np.float32(0.5), True, None), "text": "σ"}
    kind = study_of(lambda: dict(result))
    records = kind(NUMBERS).run(executor="serial", out=tmp_path).records
    assert records == kind.load(tmp_path).records
    assert records[0]["result"] == {"root": 3, "pair": [0.5, True, None], "text": "σ"}
    assert type(records[0]["result"]["root"]) is int


def test_tasks_are_what_a_file_can_hold():
    @dataclass(frozen=True)
    class Endless(RootSpec):
        study = "endless"

        def tasks(self):
            return [{**task, "until": math.inf} for task in super().tasks()]

    @dataclass(frozen=True, repr=False)
    class Study(own.Study[Endless]):
        Spec, name, measure = Endless, "endless", staticmethod(lambda task, look: {})

    with pytest.raises(InputError, match=r"task\['until'\] is inf, and a file holds finite numbers"):
        Study(Endless()).run(executor="serial")


def test_signals_that_a_process_ignores_stay_ignored():
    """A study begun by ``python mine.py &`` in a script hears no Ctrl-C; SIGTERM stops it."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with stoppable() as stop:
            stop.deferred = True
            signal.raise_signal(signal.SIGINT)
            assert not stop.asked
            signal.raise_signal(signal.SIGTERM)
            assert stop.asked
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
