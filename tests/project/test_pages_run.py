"""The Python of every page and the commands of some run, as typed, and print what the page shows.

Some blocks need what a page does not show: a simulation, a file, a cluster. ``BEFORE`` makes it. What only
has to be small for the test is made small there, too.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from carom.cli import app
from carom.scene_file.scene_file import SceneFile
from carom.studies import CodeSpec, StudySpec

ROOT = Path(__file__).parents[2]
EVERY = [ROOT / "README.md", *sorted(ROOT.joinpath("docs").rglob("*.md"))]
EVERY = [page for page in EVERY if not {"_build", "classes", "gallery"} & set(page.parts)]

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
    "architecture.md": "from carom.compiling.registry import required\n",
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


def blocks(page: Path, language: str) -> list[str]:
    """Return the blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)


PAGES = [page for page in EVERY if page.name not in ELSEWHERE and blocks(page, "python")]

LONG = (
    "gravity.md", "measuring.md", "obstacles.md", "packings.md", "range-rules.md", "driven.md", "studies.md",
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
    [
        pytest.param(page, id=page.name, marks=[pytest.mark.slow] if page.name in LONG else [])
        for page in PAGES
    ],
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
    done = subprocess.run(
        [sys.executable, "page.py"],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    said = {int(k): v for k, v in json.loads((tmp_path / "said.json").read_text()).items()}
    for lines, output in shown:
        assert not output or "".join(said.get(k, "") for k in lines) == output
    for at, line in enumerate(code.splitlines(), 1):
        if comment := re.search(r"^ *print\(.*\)  # (-?\d+\.\d+|\(.*?\))(?=[ ,:;]|$)", line):
            assert agrees(said[at], comment[1]), (line, said[at])


MADE = {
    "files.md": """
carom run
carom export carom-run start.data
cut -d " " -f -4 carom-run/trajectory.extxyz | sed 2~34s/.*// > argon.xyz
carom export carom-run dump.lammpstrj
gzip -k dump.lammpstrj
""",
    "quickstart.md": "",
    "range-rules.md": "carom init hunt.toml --template rules",
}
"""Pages whose commands run, and what makes the files of which they speak."""

SMALLER = {
    "run": "--n 32 --equilibration 2 -c 5 --frames 9",
    "run hunt.toml": "--equilibration 0 --time 0.1 --frames 9",
    "run start": "--equilibration 2 -c 5 --frames 9 --out again",
}
"""What is added to a command that begins so, the longest fit: a size that plain Python does in seconds."""

SHELL = """
set -e
carom() { python -m carom "$@"; }
export NUMBA_DISABLE_JIT=1 BROWSER=true
"""


def smaller(line: str) -> str:
    """Return a command of a page, at a size that takes seconds."""
    line = re.split(" +#", line)[0]
    fits = [begin for begin in SMALLER if re.match(f"carom {begin}", line)]
    return re.sub("(?= > |$)", f" {SMALLER[max(fits, key=len)]}", line, count=1) if fits else line


@pytest.mark.ci
@pytest.mark.parametrize("name", MADE)
def test_the_commands_of_a_page_run_in_turn_and_print_what_the_page_shows(name, tmp_path):
    page = ROOT / "docs" / name
    lines = "\n".join([MADE[name], *blocks(page, "bash")]).splitlines()
    # The first block of the first page installs Carom, as CI does.
    script = SHELL + "".join(f"{smaller(line)}\n" for line in lines if not line.startswith("pip install"))
    done = subprocess.run(
        ["bash", "-xc", script], cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    # A smaller size has other numbers. What Python prints, and an error, have tests of their own.
    printed = re.sub(r"\d[\d.e-]*", "#", done.stdout)
    for output in blocks(page, "text"):
        if not output.startswith(("Error", "from")):
            for line in output.splitlines():
                assert re.sub(r"\d[\d.e-]*", "#", line) in printed


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
