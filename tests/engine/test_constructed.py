"""Rare moments of the main cycle that no run need come to: each breaks if what guards it is left out."""

import pytest
from helpers import constructed


@pytest.mark.parametrize("case", constructed.CASES)
def test_rare_moments_of_the_main_cycle(plain, case):
    assert constructed.CASES[case]() > 0
