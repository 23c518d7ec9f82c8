"""What is small, run as plain Python: the same bits without the seconds of compiling."""

import contextlib
import io
import runpy
import sys
import warnings

import numpy as np
import pytest


@contextlib.contextmanager
def uncompiled():
    """Let simulations of this process run as plain Python."""
    from carom.engine import advance, cycle, obstacles
    from carom.simulation import run_loop
    from carom.simulation.measuring import stall_detector

    # Compiled code divides by zero without a word.
    with pytest.MonkeyPatch.context() as patch, np.errstate(all="ignore"):
        for module, name in ((cycle, "schedule"), (cycle, "run"), (advance, "project")):
            compiled = getattr(module, name)
            patch.setattr(module, name, getattr(compiled, "__wrapped__", compiled))
        for module, name in (
            (run_loop, "CYCLES"),
            (obstacles, "CROWD_FROM"),
            (stall_detector, "WINDOW"),
            (stall_detector, "CLUSTER"),
        ):
            patch.setattr(module, name, getattr(module, name))  # as it was, whatever a program makes of it
        yield


def plain_python(option, program, *arguments):
    """Run ``-c`` a program or ``-m`` a module in this process without compilation; return what it printed."""
    printed = io.StringIO()
    with uncompiled(), contextlib.redirect_stdout(printed), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", [option, *map(str, arguments)])
            if option == "-c":
                exec(compile(program, "<program>", "exec"), {"__name__": "__main__"})
            else:
                runpy.run_module(program, run_name="__main__", alter_sys=True)
    return printed.getvalue()
