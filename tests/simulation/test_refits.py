"""The table of refits: whatever remembers something, or has a unit of time, goes through changes of that unit.

Each scene runs at two scales that differ by a power of two. One of them is always near the engine's usual
unit, which it keeps; the other leaves it when it is heated by 10^6, and comes back. All numbers must be equal,
bit for bit, each by the dimension that it declares.
"""

import typing
from typing import Annotated

import numpy as np
import pytest
from helpers import refits
from helpers.marks import slow

import carom
from carom.models.questions.memory import KEPT, fields_of, kept, shift_epoch

SCALE = 15
"""Speeds of the second twin are so many powers of two larger: with kT times 10^6 it is beyond 2^20."""

HEAT = 1e6


def duration(sim, s, hot):
    """Some events of hot or warm particles, with times that are powers of two."""
    return (2.0**-9 if hot and sim.drive is None else 0.5) / s


def stages(name, s, between=lambda sim: sim, stretch=1.0):
    """Yield a simulation before, in, and after a hot stretch."""
    sim = refits.simulation(name, s)
    for hot in (False, True, False):
        if hot or sim.time > 0.0:
            kT = (HEAT if hot else 1.0) * s * s
            growth = {"growth": 0.0625 * s * HEAT ** (0.5 * hot)} if name == "growth" else {}
            sim.rescale(kT, **growth)
            sim = between(sim)
        sim.run(time=stretch * duration(sim, s, hot))
        yield sim
        sim = between(sim)


def compare(one, other):
    """What two twins hold and show is the same, scaled."""
    pairs = [(refits.seen(one), refits.seen(other))]
    mine, its = refits.held(one), refits.held(other)
    assert mine.keys() == its.keys()
    pairs.append(tuple({key: (value, what.power) for key, (value, what) in each.items()} for each in (mine, its)))
    wrong = [
        key
        for first, second in pairs
        for key, (value, power) in first.items()
        if not np.array_equal(
            refits.scaled(value, np.multiply(power, -SCALE)), np.asarray(second[key][0]), equal_nan=True
        )
    ]
    assert not wrong


def parameters(sim):
    return {key: value for key, (value, what) in refits.held(sim).items() if what.role == "parameter"}


def run_twins(name, between=lambda sim: sim, stretch=1.0):
    exponents, first = [], None
    for one, other in zip(
        stages(name, 1.0, stretch=stretch), stages(name, 2.0**SCALE, between, stretch), strict=True
    ):
        compare(one, other)
        exponents.append(other._state.unit.exponent)
        assert one._state.unit.exponent == 0
        first = first or parameters(one)
    assert exponents[0] == exponents[2] == 0
    assert exponents[1] < -20
    assert one.collisions > 4


@pytest.mark.parametrize("name", refits.ROWS)
def test_memory_goes_on_in_another_unit_of_time_grown_arrays_and_from_a_file(name, plain, tmp_path):
    def between(sim):
        sim._state.enlarge_heap()
        sim._state.enlarge_neighbors(full_cell=True)
        sim._state.schedule()
        return refits.loaded(sim, tmp_path / "state.h5")

    run_twins(name, between)
