"""Parameters that are tried in the nightly run alone, mostly because they need a kernel of their own."""

import pytest


def slow(*values, **settings):
    """Return parameters that only ``pytest -m slow`` tries."""
    return pytest.param(*values, marks=pytest.mark.slow, **settings)
