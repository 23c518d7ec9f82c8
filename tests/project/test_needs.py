"""Tests are skipped for the reasons of one list alone, and run where nothing else is installed."""

import re
import tomllib
from pathlib import Path

from helpers.inner import inner_pytest
from helpers.needs import NEEDS
from helpers.scripts import module_of

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
BEYOND = {"MPI", "OVITO", "LAMMPS", "Chromium", "Node", "Sphinx", "physical-validation", "transport-analysis"}
"""Programs and packages that `pip install ".[test]"` does not bring."""

SYSTEM = {
    "a user who is not root", "Unix", "Linux", "/dev/full", "an x86-64 processor", "two idle cores",
    "compiled code",
}  # fmt: skip
"""What no package brings."""


def test_these_needs_are_all():
    assert set(NEEDS) == BEYOND | SYSTEM


def test_tests_name_what_they_need_and_skip_for_nothing_else():
    used = set()
    for path in TESTS.rglob("*.py"):
        text = "" if path == Path(__file__) else path.read_text(encoding="utf-8")
        for names in re.findall(r"\b(?:mark\.needs|skip_without)\(([^)]*)\)", text):
            used |= set(re.findall(r'"([^"]+)"', names))
        skips = re.findall(r"\b(?:pytest\.(?:skip|importorskip)|skipif|skipTest)\(", text)
        assert not skips or path.name == "needs.py", f"{path.name}: {skips[0]}"
    assert used == set(NEEDS)


SKIPS = """
import pytest

@pytest.mark.needs("OVITO")
def test_one(): import ovito_

def test_two(): pytest.skip("no time")

def test_three(): ...
"""


def test_a_skip_that_is_not_on_the_list_is_a_failure(tmp_path):
    said = inner_pytest(tmp_path, SKIPS)
    assert "1 failed, 1 passed, 1 skipped" in said, said
    assert "This was skipped (no time), and tests/helpers/needs.py has no such reason." in said
    assert "\nTests not run: 1 needs OVITO; see Check in CONTRIBUTING.md.\n" in said


def test_what_is_asked_for_is_run_alone_and_not_skipped(tmp_path):
    said = inner_pytest(tmp_path, SKIPS, "--needing", "OVITO,a user who is not root")
    assert "2 deselected" in said, said
    assert "1 failed" in said, said


def test_every_extra_has_its_line_in_the_docs_and_is_tried():
    project = tomllib.loads(ROOT.joinpath("pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = ROOT.joinpath("docs", "quickstart.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `(\w+)` \|", text.partition("## Extras")[2], re.MULTILINE)
    assert sorted(listed) == sorted(project["optional-dependencies"])
    # The README's test command tries `test`.
    assert {*listed} == {*module_of(ROOT / "tests" / "extras.py").EXTRAS, "test"}


def test_ci_runs_the_readme_s_line_first_and_in_an_empty_environment():
    """It once installed all extras before, which hid that `[test]` lacked pandas."""
    (_, *steps) = ROOT.joinpath(".ci", "run").read_text(encoding="utf-8").split("\nstep ")[1:]
    lines = [line for line in steps[0].split("\n")[1:] if line and not line.startswith(("#", "grep"))]
    assert lines == [
        '"$python" -m venv "$work/venv"',
        'source "$work/venv/bin/activate"',
        """test_command='pip install ".[test]" && pytest'""",
        "main_command='pip install . && carom run'",
        'eval "$test_command"',
        *lines[5:],  # what follows the line
    ]
