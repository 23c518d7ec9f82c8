"""What catalogues, conda and the workflow files say about the project agrees with pyproject.toml."""

import json
import re
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest
from helpers.scripts import module_of
from packaging.requirements import Requirement

import carom

ROOT = Path(__file__).parents[2]
PACKAGING = ROOT / "docs" / "packaging"
PROJECT = tomllib.loads(ROOT.joinpath("pyproject.toml").read_text(encoding="utf-8"))["project"]
CODEMETA = json.loads(PACKAGING.joinpath("codemeta.json").read_text(encoding="utf-8"))
RECIPE = PACKAGING.joinpath("conda", "meta.yaml").read_text(encoding="utf-8")
WORKFLOWS = [ROOT / ".github" / "workflows" / "tests.yml", ROOT / ".gitlab-ci.yml"]


def test_versions_and_descriptions_agree():
    assert f"\nversion: {carom.__version__}\n" in ROOT.joinpath("CITATION.cff").read_text(encoding="utf-8")
    assert CODEMETA["version"] == carom.__version__
    assert f'set version = "{carom.__version__}"' in RECIPE
    assert CODEMETA["description"] == PROJECT["description"]
    assert f"summary: {PROJECT['description']}\n" in RECIPE
    assert CODEMETA["license"].endswith(PROJECT["license"])


def release():
    return module_of(ROOT / "tests" / "release.py")


def test_a_release_sets_the_version_everywhere_and_dates_the_changelog():
    texts = {path.name: text for path, text in release().changed("7.8.9", "2030-01-02").items()}
    assert set(texts) == {"version.py", "CITATION.cff", "codemeta.json", "meta.yaml", "CHANGELOG.md"}
    assert all(text.count("7.8.9") == 1 for text in texts.values())
    assert "## [7.8.9] - 2030-01-02\n" in texts["CHANGELOG.md"]
    assert json.loads(texts["codemeta.json"])["programmingLanguage"] == CODEMETA["programmingLanguage"]
    assert release().dated(texts["CHANGELOG.md"], "7.8.9", "2030-01-02") == texts["CHANGELOG.md"]
    with pytest.raises(SystemExit, match="unreleased"):
        release().dated(texts["CHANGELOG.md"], "7.9.0", "2030-01-02")


def test_dependencies_agree():
    assert CODEMETA["softwareRequirements"] == PROJECT["dependencies"]
    run = RECIPE.split("  run:\n")[1].split("\ntest:")[0]
    listed = dict(re.findall(r"- ([\w-]+) >=([\d.,<]+)", run))
    assert listed.pop("python") == PROJECT["requires-python"].removeprefix(">=")
    # On conda the package without Qt is matplotlib-base.
    listed["matplotlib"] = listed.pop("matplotlib-base")
    assert listed == dict(dependency.lower().split(">=") for dependency in PROJECT["dependencies"])


def test_every_dependency_has_bounds_around_what_is_installed():
    for dependency in map(Requirement, PROJECT["dependencies"]):
        assert {one.operator for one in dependency.specifier} == {">=", "<"}, dependency
        assert dependency.specifier.contains(version(dependency.name)), dependency


def test_workflows_test_the_floors():
    floors = dict(dependency.partition(",")[0].split(">=") for dependency in PROJECT["dependencies"])
    for workflow in WORKFLOWS:
        text = workflow.read_text(encoding="utf-8")
        assert f"numba=={floors['numba']}.*" in text
        assert f"numpy=={floors['numpy']}.*" in text
        assert f'"{PROJECT["requires-python"].removeprefix(">=")}"' in text


def test_figures_and_references_of_the_paper_exist():
    paper = PACKAGING.joinpath("paper.md").read_text(encoding="utf-8")
    figures = re.findall(r"\]\(([^)]+\.png)\)", paper)
    assert len(figures) == 3
    assert [figure for figure in figures if not (PACKAGING / figure).exists()] == []
    known = set(re.findall(r"@\w+\{(\w+),", PACKAGING.joinpath("paper.bib").read_text(encoding="utf-8")))
    cited = set(re.findall(r"@([A-Z]\w+\d{4})", paper))
    assert cited == known


def test_citation_names_the_paper_whose_algorithm_is_used():
    citation = ROOT.joinpath("CITATION.cff").read_text(encoding="utf-8")
    doi = CODEMETA["referencePublication"]["identifier"].removeprefix("https://doi.org/")
    assert f"doi: {doi}\n" in citation
