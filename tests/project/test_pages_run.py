"""Every Python block of every page runs: the blocks of a page one after the other, as a reader types them.

Some blocks need what a page does not show: a simulation, a file, a cluster. ``BEFORE`` makes it. What only
has to be small for the test is made small there, too.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"

# Pages with tests of their own, which also look at what they print.
ELSEWHERE = {"measuring.md", "models.md", "obstacles.md"}

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


def python_blocks(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


PAGES = sorted(
    page
    for page in DOCS.rglob("*.md")
    if page.name not in ELSEWHERE and not {"_build", "classes", "gallery"} & set(page.parts) and python_blocks(page)
)

LONG = (
    "gravity.md", "packings.md", "range-rules.md", "driven.md", "studies.md",
    "transport.md",
)  # fmt: skip
"""Pages whose blocks take more than a quarter of a minute."""


@pytest.mark.ci
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=page.name, marks=[pytest.mark.slow] if page.name in LONG else [])
        for page in PAGES
    ],
)
def test_the_blocks_of_a_page_run_in_turn(page, tmp_path):
    code = BEFORE.get(page.name, "") + "\n".join(python_blocks(page))
    script = tmp_path / "page.py"
    script.write_text(code, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, script],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
