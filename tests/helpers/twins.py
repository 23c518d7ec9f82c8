"""A function in Python and compiled, on the same values: equal to the last bit."""

import struct

import numpy as np
from hypothesis import strategies as st

from carom.compiling.entry import entry

LEAST, LARGEST = -(2**63), 2**63 - 1
EDGES = [
    0, 1, -1, 2, -2, 7, -7, 62, 63, 64, 2**31 - 1, -(2**31), 2**32, 2**53 + 1, LARGEST, LARGEST - 1, LEAST,
]  # fmt: skip
INTEGERS = st.sampled_from(EDGES) | st.integers(LEAST, LARGEST) | st.integers(-20, 20)
FLOATS = st.sampled_from([0.0, -0.0, 0.5, -0.5, 1.5, 2.5, 1e300, 5e-324]) | st.floats() | st.floats(-9.0, 9.0)
FINITE = st.floats(-1e6, 1e6)
SMALL = st.integers(-20, 20)

_compiled = {}


def compiled(function):
    """Return a function compiled for whatever it is called with; the same one each time a test defines it."""
    return _compiled.setdefault(function.__code__, entry(function))


def wrapped(value):
    """Return what 64 bits with a sign hold of an integer of Python."""
    return (value - LEAST) % 2**64 + LEAST


def bits(value):
    """Return a value as what is compared: its kind, and all of its bits; one NaN is as good as another."""
    if isinstance(value, tuple):
        return tuple(map(bits, value))
    if value is None:
        return None
    if isinstance(value, bool | np.bool_):
        return "bool", bool(value)
    if isinstance(value, int | np.integer):
        return "int", wrapped(int(value))
    return "float", "nan" if value != value else struct.pack("=d", value)


def copied(arguments):
    """Return arguments with arrays of their own."""
    return [each.copy() if isinstance(each, np.ndarray) else each for each in arguments]


def assert_twins(function, *arguments, raised=None):
    """Assert that a function gives the same compiled, and leaves the same in arrays that it is given.

    ``raised`` is what compiled code gives where Python raises an error.
    """
    here, there = copied(arguments), copied(arguments)
    try:
        expected = function(*here)
    except (ArithmeticError, ValueError):
        if raised is None:
            raise
        expected = raised(*arguments)
    found = compiled(function)(*there)
    assert bits(found) == bits(expected), (arguments, found, expected)
    for mine, its in zip(here, there, strict=True):
        if isinstance(mine, np.ndarray):
            assert repr(mine.tolist()) == repr(its.tolist()), (arguments, mine, its)
