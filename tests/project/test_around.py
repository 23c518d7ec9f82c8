"""What surrounds the engine takes no longer than it must."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import stats

from carom.observables.analysis import quantiles


def test_quantiles_and_tails_are_those_of_scipy_bit_for_bit():
    degrees = np.arange(40, 0, -1)
    np.testing.assert_array_equal(quantiles.chi_squared_below(0.95, degrees), stats.chi2.ppf(0.95, degrees))
    for tail in (0.7, 0.3, 0.025, 1e-3, 1e-10, 1e-300):
        assert quantiles.normal_above(tail) == stats.norm.isf(tail)
        for count in (1.0, 2.5, 7.0, 100.0, np.inf):
            assert quantiles.student_above(tail, count) == stats.t.isf(tail, count)
    for bound in (0.0, 0.5, 3.0, 20.0, 1e3):
        for count in (1.0, 2.0, 5.0, 30.0):
            assert quantiles.student_tail(bound, count) == stats.t.sf(bound, count)
            assert quantiles.chi_squared_tail(bound, count) == stats.chi2.sf(bound, count)


DRAWN = """
import sys
import numpy as np
from carom.block import Block
from carom.observables import Pressure
from carom.observables.analysis.equilibrium import doubts_about
from carom.figures import style
from carom.pictures import plots
if {command}:
    style.nobody_reads_docstrings()
rng = np.random.default_rng(1)
blocks = [Block(1.0, 200, float(rng.normal(300.0, 9.0))) for _ in range(256)]
found = Pressure.estimate(blocks, n=50, dimension=3, volume=100.0, diameter=1.0, kT=1.0)
doubts_about(found)
plots.pressure(found, path=sys.argv[1])
from matplotlib.lines import Line2D
print({{"scipy.stats", "matplotlib.pyplot"}} & {{*sys.modules}}, "linewidth" in (Line2D.set.__doc__ or ""))
"""


@pytest.mark.parametrize("command", [True, False])
def test_error_bars_and_a_picture_import_no_more_than_they_need(command, tmp_path):
    """A program keeps the help of matplotlib's classes; a command does not make it."""
    words = [sys.executable, "-c", DRAWN.format(command=command), str(tmp_path / "p.png")]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[0] == f"set() {not command}"
