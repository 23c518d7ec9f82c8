"""The Python of every page runs, as typed, and prints what the page shows.

Some blocks need what a page does not show: a simulation, a file, a cluster. ``BEFORE`` makes it. What only
has to be small for the test is made small there, too.
"""

import json
import re
from pathlib import Path

import pytest
from helpers.marks import slow
from helpers.pages import EVERY, ROOT, blocks
from helpers.scripts import python
from typer.testing import CliRunner

from carom.cli import app
from carom.scene_file.scene_file import SceneFile
from carom.studies import CodeSpec, StudySpec

ELSEWHERE = {"models.md"}
"""Its test looks at what its models do, too."""

FLUID = """
import carom
scene = carom.Scene.crystal(cells=3, packing_fraction=0.3)
sim = carom.Simulation(scene, seed=1)
sim.run(collisions_per_particle=20)
"""

SMALL_STUDY = """
import carom
from carom.studies.eos import study as _study
_whole = carom.equation_of_state
def _small(etas=(0.1, 0.2), **asked):
    asked |= {"n": 32, "replicas": 2, "relative_error": None, "collisions_per_particle": 50}
    return _whole(list(etas), **asked)
carom.equation_of_state = _small
"""

BEFORE = {
    "architecture.md": "from carom.compiling.registry import Questions\n",
    "files.md": FLUID,
    "layouts.md": FLUID
    + """
with carom.Simulation(scene, seed=2, event_log="events.h5") as logged:
    logged.run(collisions=20)
""",
    "looking.md": FLUID
    + """
from carom.scene_file.scene_file import SceneFile
from carom.studies import CodeSpec, StudySpec
text = "[scene]\\nlattice = 'fcc'\\ncells = 2\\npacking_fraction = 0.3\\n[run]\\nequilibration = 5\\n"
carom.run(SceneFile.from_toml(text + "collisions_per_particle = 20\\nframes = 3\\n"), "carom-run")
""",
    "packings.md": """
import carom
_pack = carom.pack
carom.pack = lambda n, dimension, until_Z, seed: _pack(40, dimension=3, rate=0.05, until_Z=1e4, seed=seed)
""",
    # The script of the last section is a command: here it is only read.
    "studies.md": SMALL_STUDY
    + """
import contextlib, distributed
distributed.Client = lambda address: contextlib.nullcontext(None)
__name__ = "page"
""",
}


PAGES = [page for page in EVERY if page.name not in ELSEWHERE and blocks(page, "python")]

LONG = (
    "coming-from.md", "gravity.md", "measuring.md", "obstacles.md", "packings.md", "range-rules.md",
    "driven.md", "studies.md",
    "transport.md",
)  # fmt: skip
"""Pages whose blocks take more than a quarter of a minute."""

NOTING = """
import atexit, builtins, io, json, sys
said, real = {}, print
def noted(*words, **how):
    file = io.StringIO()
    real(*words, **(how | {"file": file}))
    at = sys._getframe(1)
    if at.f_code.co_filename.endswith("page.py"):
        said[at.f_lineno] = said.get(at.f_lineno, "") + file.getvalue()
builtins.print = noted
atexit.register(lambda: json.dump(said, open("said.json", "w")))
"""
"""Keeps what each line of a page prints."""


def agrees(printed: str, shown: str) -> bool:
    """Tell whether what was printed is the number shown in the comment, to its digits, or has that text."""
    if re.fullmatch(r"-?\d+\.\d+", shown):
        places = len(shown.partition(".")[2])
        return f"{float(re.match(r'[-+.e0-9]+', printed)[0]):.{places}f}" == shown
    return shown in printed


@pytest.mark.ci
@pytest.mark.parametrize(
    "page",
    [slow(page) if page.name in LONG else page for page in PAGES],
    ids=[page.name for page in PAGES],
)
def test_the_python_of_a_page_runs_in_turn_and_prints_what_the_page_shows(page, tmp_path):
    (tmp_path / "noting.py").write_text(NOTING, encoding="utf-8")
    code = f"import noting\n{BEFORE.get(page.name, '')}"
    # Of each block its first line and the one behind it, and the output that the page shows below.
    shown = []
    text = page.read_text(encoding="utf-8")
    for block, output in re.findall(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```)?", text, re.M | re.S):
        first = code.count("\n") + 1
        code += block
        shown.append((range(first, code.count("\n") + 1), output))
    (tmp_path / "page.py").write_text(code, encoding="utf-8")
    python("page.py", cwd=tmp_path, MPLBACKEND="Agg")
    said = {int(k): v for k, v in json.loads((tmp_path / "said.json").read_text()).items()}
    for lines, output in shown:
        assert not output or "".join(said.get(k, "") for k in lines) == output
    for at, line in enumerate(code.splitlines(), 1):
        if comment := re.search(r"^ *print\(.*\)  # (-?\d+\.\d+|\(.*?\))(?=[ ,:;]|$)", line):
            assert agrees(said[at], comment[1]), (line, said[at])


@pytest.mark.parametrize("page", [page for page in EVERY if blocks(page, "toml")], ids=lambda page: page.name)
def test_the_files_of_a_page_are_read(page):
    for text in blocks(page, "toml"):
        spec = {"code": CodeSpec, "study": StudySpec}.get(re.match(r"\[(\w+)", text)[1], SceneFile)
        spec.from_toml(text)


@pytest.mark.parametrize("page", [page for page in EVERY if blocks(page, "bash")], ids=lambda page: page.name)
def test_the_scripts_and_tests_that_a_page_names_are_there(page):
    words = [word for block in blocks(page, "bash") for word in block.split() if re.search(r"/.*\.py$", word)]
    assert [word for word in words if not (ROOT / word).exists()] == []


def test_the_error_that_pages_show_is_printed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("fluid.toml").write_text("[scene]\npacking_fracton = 0.3\n", encoding="utf-8")
    said = CliRunner().invoke(app, ["run", "fluid.toml", "--quiet"]).output
    for name in ("quickstart.md", "scenes.md"):
        assert blocks(ROOT / "docs" / name, "text") == [said]
