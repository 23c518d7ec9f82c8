"""What a design costs, and what can be reached in a time, as sums that can be done by hand."""

import pytest

from carom import theory
from carom.studies.planner.choice import Costs, Design, design, within
from carom.studies.planner.sizes import OF_CRYSTAL, residual
from carom.studies.planner.system import System


def test_three_replicas_on_two_cores_take_as_long_as_two_of_them():
    plan = Design(100, 3, 10.0, 100.0, 0.01, 0.0, 0.01, cpu_seconds=30.0)
    assert [plan.seconds(cores) for cores in (1, 2, 3, 8)] == [30.0, 20.0, 10.0, 10.0]


@pytest.mark.parametrize("bias", [0.0, 1e-3, 3e-3])
def test_what_is_said_to_be_within_reach_is_reached_in_the_time(bias):
    costs = Costs(
        n=500, variance=10.0, bias=bias, collisions_per_second=1e5, setup_seconds=2.0,
        overhead_seconds=1.0, equilibration=100.0, shortest=10.0,
    )  # fmt: skip
    found = design(costs, within(costs, cores=1, limit=60.0))
    # Equilibration is counted twice at most: as what is needed, and as a part of the run.
    assert 57.0 < found.seconds(1) <= 60.0 * 1.001


def test_a_crystal_is_trusted_to_its_own_part_of_the_shift():
    crystal = System(0.6)
    assert crystal.crystal
    shift = abs(theory.crystal_finite_size_shift(0.6, 500, theory.solid(3)))
    assert residual(crystal, 500) == pytest.approx(OF_CRYSTAL * shift, rel=0.01)
    assert OF_CRYSTAL * shift < residual(crystal, 500)
