"""Functions of numbers that Numba compiles are called by models of one's own."""

import math

import numba
import numpy as np
import pytest
from helpers.twins import FINITE, SMALL, assert_twins, compiled
from hypothesis import given

import carom

pytestmark = pytest.mark.needs("compiled code")


@numba.njit
def doubled(x):
    return 2 * x


@numba.njit
def chosen(flag, a, x):
    return a + x if flag else a - x


@numba.njit
def larger(a, b):
    return a > b


@numba.njit
def four():
    return 4


@numba.njit
def opposite(flag):
    return not flag


@numba.njit
def halved(x):
    return x / np.float32(2.0)


@numba.njit(error_model="python")
def inverse(a):
    return 1 / a


@numba.njit
def both(x):
    return x, x


@numba.njit
def spoken(x):
    return {}[x]


def asked(a, x):
    flags = larger(a, 3), larger(x, a), opposite(a > 0), opposite(larger(2, a))
    return (
        doubled(a), doubled(x), chosen(a > 0, a, x), chosen(True, 1, 2.5), flags, four(),
        float(halved(np.float32(x))),
    )  # fmt: skip


@given(SMALL, FINITE)
def test_arguments_and_results_are_bools_integers_and_floats(a, x):
    assert_twins(asked, a, x)


def test_an_error_of_numba_s_is_raised():
    def inverted(a):
        return inverse(a) + 1.0

    assert compiled(inverted)(2) == 1.5
    with pytest.raises(RuntimeError, match="inverse, which Numba has compiled, has raised an error"):
        compiled(inverted)(0)


def pairs(x):
    return both(x)[0]


def words(x):
    return spoken(x)


def arrays(x):
    return doubled(x)


@pytest.mark.parametrize(
    ("function", "given", "said"),
    [
        (pairs, 1.0, "both gives .*, expected a number"),
        (words, 1.0, "Numba cannot compile spoken"),
        (arrays, np.zeros(2), "a number is expected here, found an array"),
    ],
)
def test_others_are_refused(function, given, said):
    with pytest.raises(carom.InputError, match=said):
        compiled(function)(given)


def test_functions_of_several_numbers_of_arguments_in_a_loop():
    def summed(n):
        total = 0.0
        for k in range(n):
            total += chosen(k % 2 == 0, k, 0.5) + doubled(k) + four()
        return total

    assert_twins(summed, 100)
    assert math.isfinite(compiled(summed)(0))
