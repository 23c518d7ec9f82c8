"""The four-ball demonstration runs, draws, and tells the story that its text tells."""

import subprocess
import sys
from pathlib import Path

EXAMPLE = Path(__file__).parents[2] / "examples" / "four_balls.py"


def test_four_balls_traces_and_draws_at_smoke_size(tmp_path):
    picture = tmp_path / "balls.png"
    command = [sys.executable, EXAMPLE, "--smoke", "--out", picture]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert picture.read_bytes().startswith(b"\x89PNG")
    with_sectors, without = done.stdout.split("Without sectors")
    # Without sectors the plan of balls 1 and 2 is overruled, and ball 1 is the third party.
    assert "3 meets 2, 1 is left to advance" in without
    assert "left to advance" not in with_sectors
    # Both find the same first two collisions.
    for text in (with_sectors, without):
        assert "2 collisions, " in text
