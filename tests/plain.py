"""Scripts run as plain Python: the same bits without the seconds of compiling, for what is small."""

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent


def plain_python(*arguments):
    """Run a script without compilation; return what it printed."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=HERE,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
