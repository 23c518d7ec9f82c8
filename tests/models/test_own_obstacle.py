"""An obstacle from outside of the package: that of the page docs/models, in a process of its own."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"

BEFORE = """
import sys
import numpy as np
import carom
from carom.models import own
"""

AFTER = """
sim, scene = escape, slit
for frame in sim.sample(every=3.0, count=60):
    gaps = [bar.gap(frame.positions, 0.5 * frame.diameters, scene.box, scene.periodic) for bar in bars]
    assert np.min(gaps) >= -1e-12, np.min(gaps)
assert sim.statistics.worst_overlap < 1e-12
assert sim.statistics.energy_drift < 1e-12
assert all(impacts.hits > 10 for impacts in sim.obstacles)
# 20 disks and a slit of four free diameters: a state with all on one side has a probability of 2^-19.
assert 0 < np.count_nonzero(frame.positions[:, 0] > 10.0) < 20
sim.save(sys.argv[1])
try:
    carom.Simulation.load(sys.argv[1])
except carom.FileError as error:
    assert "obstacles=[...]" in str(error), error
again = carom.Simulation.load(sys.argv[1], obstacles=bars)
for each in (sim, again):
    each.run(time=10.0)
assert (sim.frame().positions == again.frame().positions).all()
assert sim.obstacles == again.obstacles
try:
    bars[0].check((20.0, 10.0), (True, False))
except InputError as error:
    print(error)
"""


def run_page(tmp_path):
    """Run the page's own class and its scene, and what is to hold of it."""
    page = DOCS.joinpath("models.md").read_text(encoding="utf-8")
    cells = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    # A file: Numba's cache on disk names the module of every type, and reads its sources.
    script = tmp_path / "slit.py"
    script.write_text(
        BEFORE + "\n".join(cell for cell in cells if "Bar(" in cell or "Bar:" in cell) + AFTER,
        encoding="utf-8",
    )
    done = subprocess.run(
        [sys.executable, "-W", "ignore::RuntimeWarning", script, tmp_path / "slit.h5"],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_slit_of_the_page(tmp_path):
    lines = run_page(tmp_path).splitlines()
    assert all(line.endswith("of 20 are on the right") for line in lines[:4])
    assert lines[4].count("Impacts(") == 2
    assert lines[-1] == "lower bar needs two dimensions, with walls along both."


def test_the_first_cell_of_the_page_runs_as_plain_python(tmp_path):
    cell = re.search(
        r"```python\n(.*?)```", DOCS.joinpath("obstacles.md").read_text(encoding="utf-8"), flags=re.DOTALL
    ).group(1)
    done = subprocess.run(
        [sys.executable, "-W", "ignore::RuntimeWarning", "-c", cell],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("P on y_high = ")
    assert done.stdout.count("Impacts(") == 3
