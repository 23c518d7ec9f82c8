"""Checkpoints that were changed on purpose, with a digest that fits: refused in a sentence, or run on."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.checkpoints import SCENES, saved
from helpers.plain import uncompiled

import carom
from carom.errors import FileError
from carom.io import checkpoint

TESTS = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def states(tmp_path_factory):
    """The content of a checkpoint of disks in sectors, of one in lists, and of some that count in arrays."""
    folder = tmp_path_factory.mktemp("states")
    with uncompiled():
        return {name: saved(name, folder / "state.h5") for name in dict.fromkeys(row[0] for row in REFUSED)}


def put(index, value):
    """Return a change of one number, or of all with ``...``."""

    def change(array):
        array.reshape(-1)[index] = value
        return array

    return change


def nobody_in_a_sector(members):
    """Put the padding row where the first sector that holds somebody names its first member."""
    members[np.flatnonzero(members[:, -1])[0], 0] = 80
    return members


LAST = -1
REFUSED = [
    ("disks", "state.partner", put(5, 80)),
    ("disks", "state.partner", put(5, -2)),  # a wall, and there is none
    ("disks", "state.partner", put(5, -(2**30))),  # a unit that is woken
    ("disks", "state.crossing_time", put(5, np.nan)),
    ("disks", "state.crossing_time", put(5, -1e300)),
    ("disks", "state.rows.x", put(5, np.nan)),
    ("disks", "state.rows.x", put(5, 1e300)),
    ("disks", "state.rows.v", put(5, 1e200)),
    ("disks", "state.rows.t", put(5, -1.0)),
    ("disks", "state.rows.event_time", put(5, np.nan)),
    ("disks", "state.rows.event_time", put(LAST, 0.0)),  # the padding row's
    ("disks", "state.clock.epoch", put(0, 2**40)),
    ("disks", "state.clock.now", put(0, -1.0)),
    ("disks", "neighbors.members", nobody_in_a_sector),
    ("disks", "neighbors.members", put(7, 8)),  # how many the first sector holds
    ("disks", "neighbors.cell", put(0, 10)),
    ("disks", "neighbors.cell", lambda array: np.ascontiguousarray(array[::-1])),
    ("disks", "neighbors.wraps", put(0, 2**31 - 1)),
    ("disks", "neighbors.exit_face", put(0, 4)),
    ("disks", "tallies.collisions", put(0, -1)),
    ("disks", "tallies.virial", put(0, np.inf)),
    ("disks", "initial_velocities", put(0, np.nan)),
    ("disks in lists", "neighbors.cells", put(0, 2**32 - 1)),
    ("disks in lists", "neighbors.members", put(0, 2**16 - 1)),
    ("disks in lists", "neighbors.members", put(..., 0)),
    ("disks in lists", "neighbors.reference", put(0, 0)),
    ("disks in lists", "neighbors.refs", put(0, 2**32 - 1)),
    ("disks in lists", "neighbors.refs", put(0, 0)),  # itself
    ("disks in lists", "neighbors.refs", put(0, 79)),  # who does not list it
    ("disks in lists", "neighbors.counts", put(0, 2**16 - 1)),
    ("disks in lists", "neighbors.counts", put(0, 0)),
    # Of many counts one is negative.
    ("a gas", "neighbors.contacts.versions", put(LAST, -1)),
    ("a bed", "model.obstacles.hits", put(LAST, -1)),
    ("a bed", "model.obstacles.chain.head.0.spared", put(LAST, -1)),
    ("a column", "model.obstacles.chain.head.0.drawn", put(0, -1)),
]


@pytest.mark.parametrize(
    ("name", "array", "change"), REFUSED, ids=[f"{k}: {each[1]}" for k, each in enumerate(REFUSED)]
)
def test_a_number_that_the_engine_cannot_use_is_refused(states, tmp_path, name, array, change):
    arrays, attributes = states[name]
    changed = change(arrays[array].copy())
    assert changed.tobytes() != arrays[array].tobytes()
    checkpoint.save(tmp_path / "c.h5", {**arrays, array: changed}, attributes)
    with pytest.raises(FileError, match="cannot be loaded as a checkpoint") as caught:
        carom.Simulation.load(tmp_path / "c.h5")
    assert "\n" not in str(caught.value)


def scheme(**changes):
    def change(attributes):
        return {"scheme": json.dumps({**json.loads(attributes["scheme"]), **changes})}

    return change


ATTRIBUTES = [
    lambda _: {"base": "1/0"},
    lambda _: {"base": "1e999999999"},
    lambda _: {"base": "-1/2"},
    lambda _: {"epoch": -1},
    lambda _: {"epoch": 10**30},
    lambda _: {"epoch": 1.5},
    lambda _: {"offset": float("nan")},
    lambda _: {"offset": 1e300},
    lambda _: {"time_unit": 2**40},
    lambda _: {"counted": -1},
    lambda _: {"seconds": "long"},
    lambda _: {"wish": '["everything", null]'},
    lambda _: {"wish": "[]"},
    lambda _: {"scheme": "[]"},
    lambda _: {"scene": "{}"},
    lambda _: {"extra": "[]"},
    lambda _: {"images": False},
    lambda _: {"logged": {"events": -1, "sums": {}}},
    lambda _: {"logged": {"events": 1}},
    lambda _: {"logged": {"events": 0, "sums": {}}, "event_log": "a\0b"},
    scheme(shape=[2**30, 2**30]),
    scheme(shape=[10]),
    scheme(shape=[0, 10]),
    scheme(cell_capacity=2**40),
    scheme(capacity=-1),
    scheme(heap=2**17),
    scheme(epoch=0.0),
    scheme(epoch=3.0),
    scheme(width=float("nan")),
    scheme(kind="pairs", span=float("nan")),
    scheme(kind=[]),
]


@pytest.mark.parametrize("change", ATTRIBUTES, ids=range(len(ATTRIBUTES)))
def test_an_attribute_that_no_run_has_is_refused(states, tmp_path, change):
    arrays, attributes = states["disks"]
    checkpoint.save(tmp_path / "c.h5", arrays, {**attributes, **change(attributes)})
    with pytest.raises(FileError) as caught:
        carom.Simulation.load(tmp_path / "c.h5")
    assert "\n" not in str(caught.value)


def test_what_follows_from_the_scene_is_in_no_file(states):
    for arrays, _ in states.values():
        names = ("state.clock.length", "neighbors.ways", "neighbors.grid.shape", "neighbors.bounds.bounds")
        assert not {*names, "neighbors.found", "neighbors.points", "neighbors.newcomers"} & {*arrays}
        assert not [name for name in arrays if name.startswith("calendar.")]
    assert "neighbors.refs" not in states["disks"][0]


def test_an_array_too_few_or_too_many_or_too_late_is_refused(states, tmp_path):
    arrays, attributes = states["disks"]
    few = {name: array for name, array in arrays.items() if name != "state.crossing_time"}
    late = arrays["state.rows.event_time"].copy()
    late[:-1] = np.nextafter(arrays["state.clock.now"][0], late.dtype.type(0.0))
    for given in (
        few,
        {**arrays, "model.pair.radii": np.ones(81)},
        {**arrays, "state.crossing_time": np.ones(3)},
        {**arrays, "observers.0": np.ones(3)},
        {**arrays, "state.rows.event_time": late},
    ):
        checkpoint.save(tmp_path / "c.h5", given, attributes)
        with pytest.raises(FileError, match=r"crossing_time|pair\.radii|observers\.0|before the present"):
            carom.Simulation.load(tmp_path / "c.h5")


TRY = """
import sys
sys.path.insert(0, {tests!r})
from helpers import checkpoints
sys.exit(bool(checkpoints.faults({name!r}, every={every})))
"""


def tried(name, every):
    script = TRY.format(tests=str(TESTS), name=name, every=every)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr[-2000:]


@pytest.mark.needs("Linux")
def test_a_few_numbers_in_the_place_of_others_end_no_interpreter():
    tried("disks in lists", 211)


@pytest.mark.slow
@pytest.mark.needs("Linux")
@pytest.mark.parametrize("name", SCENES)
def test_any_number_in_the_place_of_another_ends_no_interpreter(name):
    tried(name, 61)  # of each scene about the sixtieth part; `python -m helpers.checkpoints NAME` tries all
