"""Scripts run as plain Python: the same bits without the seconds of compiling, for what is small."""

import os
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]
"""From here, ``python -m helpers.faces`` and ``import models.test_ranges`` find what they name."""


def plain_python(*arguments):
    """Run Python in the folder of all tests without compilation; return what it printed."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=TESTS,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
