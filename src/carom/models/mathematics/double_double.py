"""Sums and products with the rounding that they leave: twice the digits of a double, in doubles.

Dekker, Numer. Math. 18 (1971) 224; Knuth, The Art of Computer Programming 2, 4.2.2. They hold in any order
of magnitude whose products are doubles, and only where the compiler contracts and reorders nothing.
"""

from __future__ import annotations

SPLITTER = 134217729.0
"""2^27 + 1: it cuts the 53 bits of a double into two halves, whose products are exact."""


def exact_sum(a, b):
    """Return the rounded sum of two doubles, and what rounding took from it."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def exact_product(a, b):
    """Return the rounded product of two doubles, and what rounding took from it."""
    product = a * b
    cut = SPLITTER * a
    a_high = cut - (cut - a)
    a_low = a - a_high
    cut = SPLITTER * b
    b_high = cut - (cut - b)
    b_low = b - b_high
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def with_product(high, low, a, b):
    """Return ``high + low + a b``, in two doubles as well."""
    product, rest = exact_product(a, b)
    total, error = exact_sum(high, product)
    return exact_sum(total, error + (low + rest))
