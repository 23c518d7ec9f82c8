"""What a run adds up to survives every cut: the engine's sums, cut in five ways, beside the oracle's."""

import pytest
from helpers import oracle_sums


@pytest.mark.parametrize("kind", oracle_sums.KINDS)
def test_sums_survive_chunks_samples_checkpoints_refits_and_larger_arrays(plain, kind):
    assert oracle_sums.compare(kind) == oracle_sums.KINDS[kind]().count
