"""What a run adds up to survives every cut: the engine's sums, cut in five ways, beside the oracle's."""

import pytest
import sum_cases
from plain import plain_python


@pytest.mark.parametrize("kind", sum_cases.KINDS)
def test_sums_survive_chunks_samples_checkpoints_refits_and_larger_arrays(kind):
    assert plain_python("sum_cases.py", kind).split() == [kind, str(sum_cases.KINDS[kind]().count)]
