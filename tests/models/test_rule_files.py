"""Range rules of scene files: the rule is code of the user's, which runs only where somebody says so."""

import os
import pickle
import sys
from pathlib import Path

import pytest
from helpers.scripts import python
from typer.testing import CliRunner

import carom
from carom import cli
from carom.errors import InputError
from carom.models.interactions import ranges
from carom.models.interactions.rule_files import RuleFile
from carom.scene_file.scene_file import SceneFile

RULES = """
import math
import os

from carom.models import ENTERED, TIMER, draw

HARE, FOX = 0, 1
os.environ["CAROM_RULES_RAN"] = "yes"


def stroll(unit):
    angle = 2.0 * math.pi * draw(unit)
    unit.velocity[0], unit.velocity[1] = 0.3 * math.cos(angle), 0.3 * math.sin(angle)
    unit.memory[0] = 0.0
    unit.timer = 5.0


def behave(unit, event):
    if event.cause == TIMER:
        stroll(unit)
    elif event.cause == ENTERED and event.kind != unit.kind:
        if unit.kind == HARE and event.circle == 0:
            unit.removed = True
        elif unit.memory[0] == 0.0:
            for axis in range(2):
                speed = 1.0 if unit.kind == FOX else -0.8
                unit.velocity[axis] = speed * event.toward[axis] / event.distance
            unit.memory[0] = 1.0
            unit.timer = 1.0
"""

SCENE = """
[scene]
box = [20.0, 20.0]
walls = "y"
species.hare = { count = 16, diameter = 0.1 }
species.fox = { count = 4, diameter = 0.1 }

[scene.interaction]
type = "ranges"
file = "rules.py"
rule = "behave"
seed = 1
kinds = [
    { name = "hare", circles = [0.3, 3.0], timer = 0.0, memory = [0.0] },
    { name = "fox", circles = [6.0], timer = 0.0, memory = [0.0] },
]

[run]
equilibration = 0
collisions_per_particle = 20
frames = 4
event_log = true
pictures = false
"""


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A scene file and the rule beside it."""
    monkeypatch.delenv("CAROM_RULES_RAN", raising=False)
    (tmp_path / "rules.py").write_text(RULES)
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


def forget():
    """Let the next who trusts a file run it once more."""
    for name in [name for name in sys.modules if name.startswith("carom_rules_")]:
        del sys.modules[name]


def test_reading_a_scene_file_runs_no_code_and_building_it_is_refused(files):
    forget()
    plan = SceneFile.load(files / "scene.toml")
    assert SceneFile.from_toml(plan.to_toml()) == plan
    with pytest.raises(InputError, match=r"no scene file runs code by itself.*--trust-code"):
        plan.build_scene()
    done = CliRunner().invoke(cli.app, ["run", str(files / "scene.toml"), "--out", str(files / "out")])
    assert done.exit_code == 2
    assert "--trust-code" in done.output
    assert not (files / "out").exists()
    assert "CAROM_RULES_RAN" not in os.environ


def test_who_trusts_the_file_gets_its_rule_and_the_digest_of_what_was_read(files):
    forget()
    plan = SceneFile.load(files / "scene.toml").trusted()
    scene = plan.build_scene()
    assert os.environ["CAROM_RULES_RAN"] == "yes"
    assert isinstance(scene.interaction, carom.models.Ranges)
    assert [kind.name for kind in scene.interaction.kinds] == ["hare", "fox"]
    assert scene.interaction.kinds[0].circles == (0.3, 3.0)
    # The same source is the same function: it is compiled once.
    assert plan.build_scene().interaction.rule is scene.interaction.rule
    again = SceneFile.from_toml(plan.to_toml())
    assert again == plan
    assert len(again.scene.interaction.sha256) == 64
    with pytest.raises(InputError, match="--trust-code"):  # no file can say that it is to be trusted
        again.build_scene()


def test_a_rule_that_was_edited_is_refused_where_a_run_goes_on(files):
    plan = SceneFile.from_toml(SceneFile.load(files / "scene.toml").trusted().to_toml())
    (files / "rules.py").write_text(RULES + "\n# edited\n")
    with pytest.raises(InputError, match="was edited since"):
        plan.trusted()


def test_another_process_finds_the_type_of_a_rule_under_its_name(files):
    """Code from disk was read again at every call: the type of the rule was a copy."""
    rule = SceneFile.load(files / "scene.toml").trusted().build_scene().interaction.rule
    tag = ranges._tag(rule)
    assert pickle.loads(pickle.dumps(tag)) is tag

    def behave(unit, event):
        pass

    behave.__module__, behave.__qualname__ = rule.__module__, rule.__qualname__
    other = ranges._tag(behave)
    assert other is not tag
    assert other.__name__.rpartition("_")[0] == tag.__name__.rpartition("_")[0]


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("def behave(unit, event:\n", "SyntaxError in line 1"),
        ("1 / 0\n", "ZeroDivisionError: division by zero"),
        ("import no_such_module_at_all\n", "ModuleNotFoundError"),
        ("from textwrap import dedent\ndef other(unit, event):\n    pass\n", r"it has other\."),
        ("behave = 3\n", "has no function behave; it has no function"),
        ("def behave(unit):\n    pass\n", "rule must be a function rule"),
        ("def behave(unit, event):\n    unit.memory[7] = 1.0\n", "IndexError"),
    ],
)
def test_a_file_without_a_rule_that_works_is_refused_in_a_sentence(files, source, words):
    (files / "rules.py").write_text(source)
    plan = SceneFile.load(files / "scene.toml").trusted()
    with pytest.raises(InputError, match=words) as caught:
        plan.build_scene()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('file = "rules.py"', 'file = "rules.txt"', "ends with .py"),
        ('file = "rules.py"', "file = 3", "file must be a name"),
        ('file = "rules.py"', "", "needs file"),
        ('rule = "behave"', 'rule = "os.remove"', "name of a function"),
        ("seed = 1", "seed = -1", "seed"),
        ("seed = 1", "sha256 = 'abc'", "64 hexadecimal digits"),
        ("seed = 1", "trust = true", "has no 'trust'"),
        ("circles = [6.0]", "circles = [-6.0]", "rise"),
        ("circles = [6.0]", "range = [6.0]", "has no 'range'"),
        ('name = "fox", circles', "circles", "needs name"),
        ("[0.3, 3.0]", "[3.0, 0.3]", "rise"),
    ],
)
def test_bad_tables_are_refused_in_a_sentence(old, new, words):
    assert SCENE.count(old) == 1 or old == 'name = "fox", circles'
    with pytest.raises(InputError, match=words) as caught:
        SceneFile.from_toml(SCENE.replace(old, new))
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_refused_in_a_sentence(files):
    (files / "rules.py").unlink()
    with pytest.raises(InputError, match="cannot be read: No such file"):
        SceneFile.load(files / "scene.toml").trusted()
    with pytest.raises(InputError, match="or of their tables"):
        RuleFile((), "rules.py", "behave")


SCRIPT = """
import numpy as np, sys
import carom
from carom.scene_file.scene_file import SceneFile
from carom.pictures.view import rules_beside
from pathlib import Path

plan = SceneFile.load("scene.toml").trusted()
whole = carom.run(plan, "whole")

def stop(fraction, stage):
    if stage == "Measuring" and fraction > 0.3:
        import signal
        signal.raise_signal(signal.SIGINT)

try:
    carom.run(plan, "half", progress=stop)
    raise SystemExit("not stopped")
except KeyboardInterrupt:
    pass
try:
    carom.resume("half")
    raise SystemExit("not refused")
except carom.errors.InputError as refusal:
    assert "--trust-code" in str(refusal)
parts = carom.resume("half", trust_code=True)
for name in ("collisions", "time", "units", "momentum_drift"):
    assert whole.summary[name] == parts.summary[name], name
assert sum(whole.summary["units"].values()) <= 20
assert whole.summary["energy_drift"] is None and whole.summary["remarks"] == []
assert "equilibrium" in whole.summary["without_rdf"]
one, other = (carom.io.read(f"{name}/trajectory.h5md", -1) for name in ("whole", "half"))
assert (one.positions == other.positions).all() and (one.velocities == other.velocities).all()
page = carom.view("whole", interaction=rules_beside(Path("whole")))
assert page.data["replay"]["units"]["names"] == ["hare", "fox"]
"""


@pytest.mark.slow
def test_a_run_of_a_rule_file_resumes_bit_for_bit_and_is_shown(files):
    # In plain Python: twenty units need no compiler.
    python("-c", SCRIPT, cwd=files, NUMBA_DISABLE_JIT="1")
    assert Path(files / "whole" / "scene.toml").read_text().count("sha256") == 1
