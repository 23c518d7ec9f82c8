"""What the digest of a compiled kernel covers: all that it is compiled of, and nothing else."""

import importlib
import json
import pkgutil
import shutil
from pathlib import Path

import pytest
from helpers.scripts import python

import carom
import carom.engine
import carom.models
from carom.compiling import registry

KERNELS = """
import numba
import carom
from carom import Scene
from carom.compiling.code_digest import Walk
from carom.engine import cycle
from carom.models.motions.gravity import Gravity
from carom.models import Ball
from carom.models.interactions.wells import SquareWell
from carom.simulation.run_state import RunState

fluid = Scene.crystal(cells=2, packing_fraction=0.3)
bumper = Ball((1.0, 3.0), 0.3)
disks = Scene.random(12, 0.3, 2, walls="y", obstacles=[bumper], seed=1)
RunState.schedule = lambda machine: None  # which would compile
SCENES = {
    "fluid": (fluid, "lists"),
    "well": (fluid.replace(interaction=SquareWell(1.5, 1.0)), "lists"),
    "disks": (disks, "sectors"),
    "falling": (disks.replace(motion=Gravity((0.0, -1.0))), "sectors"),
    "gas": (Scene.random(64, dimension=3, packing_fraction=1e-6, seed=1), "all"),
}

def kernels(name):
    scene, neighbors = SCENES[name]
    engine = carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors=neighbors))._state.engine
    for function in (cycle.schedule, cycle.run):
        arguments = (*engine, 0, 1) if function is cycle.schedule else (*engine, 0, 0.0, 1, 1)
        yield numba.njit(function.__wrapped__), tuple(map(numba.typeof, arguments))
"""
DIGESTS = """
import json
print(json.dumps({
    name: [Walk(*kernel).digest.hexdigest() for kernel in kernels(name)] for name in SCENES
}))
"""
EVERYTHING = """
import importlib, pkgutil
import carom
for each in sorted((each.name for each in pkgutil.walk_packages(carom.__path__, "carom.")), reverse=True):
    if not each.endswith("__main__"):
        importlib.import_module(each)
"""
ANSWER = """
from carom.models.questions.interaction import growth
from carom.models.interactions.hard_cores import EqualCores
@growth.register
def _(pair: EqualCores, i):
    return 0.0
"""
COVERED = """
import sys
from numba.core import event

compiled = set()

class Listener(event.Listener):
    def on_start(self, begun):
        compiled.add(begun.data["dispatcher"].py_func)

    def on_end(self, ended):
        pass

for function, kinds in kernels(sys.argv[1]):
    with event.install_listener("numba:compile", Listener()):
        function.compile(kinds)
    walk = Walk(function, kinds)
    ours = {each for each in compiled if each.__module__.startswith("carom.")}
    ours = {each for each in ours if not each.__module__.startswith("carom.compiling.")}
    assert len(ours) > 50
    print(sorted(each.__module__ + "." + each.__qualname__ for each in ours - walk.functions.keys()))
    compiled.clear()
"""


def said(program, *words, source=None):
    """Return what a process of its own prints, with the package of a folder."""
    path = {"PYTHONPATH": str(source)} if source else {}
    return python("-B", "-c", program, *words, **path)


@pytest.fixture(scope="module")
def digests():
    return json.loads(said(KERNELS + DIGESTS))


def test_what_is_a_question_somebody_answers():
    for room in (carom.models, carom.engine):
        for each in pkgutil.walk_packages(room.__path__, f"{room.__name__}."):
            importlib.import_module(each.name)
    questions = [each for each, _ in registry._noted if hasattr(each, "registry")]
    unanswered = {each.__qualname__ for each in questions if len(each.registry) < 2}
    assert unanswered <= {"at_pair", "at_obstacle", "at_epoch", "call_rule"}  # which the user answers


def test_every_kind_of_scene_has_kernels_of_its_own(digests):
    assert len({digest for pair in digests.values() for digest in pair}) == 2 * len(digests)


ALL = {"fluid", "well", "disks", "falling", "gas"}
EDITS = {
    "models of some, what scenes are described with, and a comment": (
        {
            "models/interactions/step_pairs.py": ("change = 2.0 *", "change = 2.5 *"),
            "models/interactions/wells.py": ("low=1.0", "low=0.5"),
            "engine/search.py": ("# what follows", "# What follows"),
        },
        {"well"},
    ),
    "the model of the others": (
        {"models/interactions/hard_cores.py": ("factor = rv / rr", "factor = rr / rv")},
        ALL - {"well"},
    ),
    "the search of lists and sectors": (
        {"engine/search.py": ("best = earliest", "best = earliest - 1")},
        ALL - {"gas"},
    ),
    "a number that is imported": (
        {"models/mathematics/contact.py": ("= 32.0", "= 64.0")},
        {"disks", "falling"},
    ),
    "what makes code": ({"compiling/simd.py": ("from llvmlite", "# Vectors.\nfrom llvmlite")}, ALL),
}


@pytest.mark.parametrize("what", EDITS)
def test_an_edit_changes_the_digests_of_the_kernels_that_it_reaches(digests, tmp_path, what):
    edits, reached = EDITS[what]
    package = Path(carom.__file__).parent
    shutil.copytree(package, tmp_path / "carom", ignore=shutil.ignore_patterns("__pycache__"))
    for file, (old, new) in edits.items():
        target = tmp_path / "carom" / file
        text = target.read_text()
        assert old in text
        target.write_text(text.replace(old, new))
    edited = json.loads(said(KERNELS + DIGESTS, source=tmp_path))
    assert {name for name in ALL if edited[name] != digests[name]} == reached


def test_an_answer_that_is_registered_elsewhere_is_seen_and_imports_are_not(digests):
    before, after = map(json.loads, said(EVERYTHING + KERNELS + DIGESTS + ANSWER + DIGESTS).splitlines())
    assert before == digests
    assert {name for name in ALL if after[name] != digests[name]} == ALL - {"well"}


@pytest.mark.slow
@pytest.mark.parametrize("scene", sorted(ALL))
def test_all_that_is_compiled_is_covered(scene):
    assert said(KERNELS + COVERED, scene).split() == ["[]", "[]"]
