"""Models from outside of the package: the page docs/models, as it stands, and what is refused."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import carom
from carom.errors import InputError
from carom.models.contact import exchange, first_contact
from carom.models.free_flight import FreeFlight
from carom.models.growing_cores import Growing
from carom.models.hard_cores import HardCores
from carom.models.interface import (
    exit_time,
    interaction_time,
    jump,
    position,
    transfer,
    velocity,
)
from carom.models.restitution import Restitution

PAGE = Path(__file__).parents[1] / "docs" / "models.md"
SCENE = carom.Scene.random(6, 2, packing_fraction=0.1, seed=1)


def test_the_page_runs_as_it_stands(tmp_path):
    cells = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(cells) >= 8
    # A file: Numba's cache on disk names the module of every type, and reads its sources.
    script = tmp_path / "own.py"
    script.write_text("\n".join(cells), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "ignore::RuntimeWarning", script],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == "True"
    assert sum(line.startswith("holds") for line in lines) == 8
    assert lines[-4:] == ["False ['V', 'momentum', 'virial']", "True", "True", "UnlikeCores"]


def test_a_definition_on_the_page_is_short():
    cells = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
    for cell in cells:
        if "register" in cell and "def model" in cell:
            lines = [line for line in cell.splitlines() if line.strip() and "import" not in line]
            assert len(lines) < 40, lines[0]


@pytest.mark.parametrize(
    "value",
    [HardCores(), Growing(), FreeFlight(), Restitution(0.7, 0.1), HardCores([[1.0, 0.7], [0.7, 0.8]])],
)
def test_the_models_of_the_package_keep_all_conditions(value):
    found = carom.check(value, pairs=100)
    assert found.passed, str(found)
    assert min(found.tried.values()) >= 100


class Bad(NamedTuple):
    """Hard cores with one thing wrong."""

    wrong: str
    radii: np.ndarray
    masses: np.ndarray


@interaction_time.register
def _(pair: Bad, i, j, rr, rv, vv, now):
    contact = 1.0 + (0.1 if pair.wrong == "I" and i < j else 0.0)
    t = first_contact(rr - contact, rv, vv)
    return 1.5 * t if pair.wrong == "IV" else t


@jump.register
def _(pair: Bad, i, j, rr, rv, now):
    a, b, virial = exchange(pair, i, j, rr, rv)
    if pair.wrong == "II" and i < j:
        return 1.5 * a, 1.5 * b, 1.5 * virial
    if pair.wrong == "momentum":
        return a, 2.0 * b, virial
    if pair.wrong == "V":
        return 0.1 * a, 0.1 * b, 0.1 * virial
    return a, b, virial


class BadCores:
    def __init__(self, wrong):
        self.wrong = wrong

    def reach(self, scene):
        return 1.05

    def model(self, particles):
        return Bad(self.wrong, particles.with_ghost(particles.radii), particles.with_ghost(particles.masses))


@pytest.mark.parametrize("condition", ["I", "II", "IV", "V", "momentum"])
def test_a_broken_condition_of_a_pair_is_named_with_its_numbers(condition):
    found = carom.check(BadCores(condition))
    assert condition in {failure.condition for failure in found.failures}
    assert {failure.dimension for failure in found.failures} == {1, 2, 3, 4}
    assert f"FAILS {condition}" in str(found)
    assert "time = " in str(found)


def test_a_pair_without_fault_passes():
    assert carom.check(BadCores("nothing")).passed


class BadFlight(NamedTuple):
    """Free flight with one thing wrong."""

    wrong: str


@position.register
def _(motion: BadFlight, axis, x, v, t):
    if motion.wrong == "III":
        return x + v * t * t
    if motion.wrong == "relative":
        return x + v * (1.0 - np.exp(-t))
    return x + v * t


@velocity.register
def _(motion: BadFlight, axis, v, t):
    return v * np.exp(-t) if motion.wrong == "relative" else v


@exit_time.register
def _(motion: BadFlight, axis, x, v, low, high):
    up = int(v > 0.0)
    t = ((high if up else low) - x) / v
    return (2.0 * t if motion.wrong == "exit" else t), up


class BadMotion:
    def __init__(self, wrong):
        self.wrong = wrong

    def model(self, particles):
        return BadFlight(self.wrong)


@pytest.mark.parametrize("condition", ["III", "relative", "exit"])
def test_a_broken_condition_of_a_motion_is_named(condition):
    found = carom.check(BadMotion(condition))
    assert condition in {failure.condition for failure in found.failures}


class Gain(NamedTuple):
    """A contact law that makes energy."""

    part: float


@transfer.register
def _(impact: Gain, rr, rv):
    return impact.part


class Gaining:
    def model(self, particles):
        return Gain(1.2)


def test_a_contact_that_makes_energy_is_named():
    assert {failure.condition for failure in carom.check(Gaining()).failures} == {"gain"}


class Silent(NamedTuple):
    """A model that answers nothing."""

    masses: np.ndarray


class SilentCores:
    def reach(self, scene):
        return 1.0

    def model(self, particles):
        return Silent(particles.with_ghost(particles.masses))


def test_a_model_without_its_required_answers_is_refused_in_a_sentence():
    scene = SCENE.with_(interaction=SilentCores())
    with pytest.raises(InputError, match=r"Silent does not answer interaction_time: register a function"):
        carom.Simulation(scene)
    with pytest.raises(InputError, match="does not answer"):
        carom.check(SilentCores())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"interaction": SilentCores}, "found the class SilentCores, not a value of it"),
        ({"interaction": 3}, "interaction must be a value with reach and model"),
        ({"motion": object()}, "which has no model"),
        ({"impact": "soft"}, "impact must be a value with model"),
        ({"impact": Gaining(), "restitution": 0.5}, "impact and restitution say the same thing in two ways"),
    ],
)
def test_what_is_no_model_is_refused_in_a_sentence(arguments, words):
    with pytest.raises(InputError, match=re.escape(words)):
        SCENE.with_(**arguments)


def test_the_usual_models_may_be_given_by_name():
    scene = SCENE.with_(interaction=HardCores(), motion=FreeFlight(), impact=Restitution(0.9, 0.01))
    assert (scene.restitution, scene.elastic_below) == (0.9, 0.01)
    assert scene.usual("interaction")
    assert scene.usual("motion")
    assert not scene.simple
    assert SCENE.with_(interaction=HardCores()).simple


class Bent:
    """A motion of which only the value is looked at."""

    straight = False

    def model(self, particles):
        return BadFlight("nothing")


def test_a_motion_that_bends_meets_no_walls_and_has_no_lists():
    walled = carom.Scene.random(6, 2, packing_fraction=0.1, seed=1, periodic=[True, False])
    with pytest.raises(InputError, match="met in straight flight only, and Bent bends"):
        carom.Simulation(walled.with_(motion=Bent()))
    with pytest.raises(InputError, match="Neighbour lists are for straight flight"):
        carom.Simulation(SCENE.with_(motion=Bent()), neighbors="lists")


def test_nothing_else_is_checked():
    for wrong in (3, HardCores, SCENE):
        with pytest.raises(InputError, match="check\\(\\) needs the value of an interaction"):
            carom.check(wrong)


def test_a_motion_of_two_axes_is_checked_in_two_dimensions():
    from carom.models.gravity import Gravity

    report = carom.check(Gravity((0.0, -1.0)))
    assert report.passed
    assert report.tried["III"] == 2 * 200
