"""Rare moments of the main cycle that no run need come to: each breaks if what guards it is left out."""

import pytest
from helpers import constructed
from helpers.plain import plain_python


@pytest.mark.parametrize("case", constructed.CASES)
def test_rare_moments_of_the_main_cycle(case):
    name, count = plain_python("-m", "helpers.constructed", case).split()
    assert name == case
    assert int(count) > 0
