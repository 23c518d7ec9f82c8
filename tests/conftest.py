"""Settings of the whole test session."""

import os

import pytest
from hypothesis import settings

# The same examples in every run: a failure on one machine is a failure on all. Times vary with compilation.
settings.register_profile("carom", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("carom")

MOST = 4
"""Workers: each takes a gigabyte, for all the kernels that it loads."""


def pytest_xdist_auto_num_workers(config):
    """Return how many processes share the tests: all cores for all of them; for a part, this one alone."""
    everything = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    return min(os.cpu_count() or 1, MOST) if everything else 0
