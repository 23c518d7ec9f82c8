"""What models of one's own take from another module: functions, constants, an enumeration, tuples."""

import enum
import math
from typing import NamedTuple

import numpy as np


class Side(enum.IntEnum):
    LEFT = 0
    RIGHT = 1


class Shape(NamedTuple):
    a: float
    b: float = 2.0

    def area(self):
        return math.pi * self.a * self.b

    @staticmethod
    def least(x, y):
        return x if x < y else y


class Nested(NamedTuple):
    shape: Shape
    rows: tuple


COEFFICIENTS = (0.5, 0.25, 0.125)
TABLE = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
SHAPE = Shape(1.5)
square = lambda x: x * x  # noqa: E731


def polynomial(x, coefficients=COEFFICIENTS):
    total, power = 0.0, 1.0
    for c in coefficients:
        total += c * power
        power *= x
    return total


def first_above(values, x):
    for k in range(len(values)):
        if values[k] > x:
            return k
    return -1
