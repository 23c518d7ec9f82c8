"""Statements of the language: loops, branches, names, tuples and calls do compiled what they do in Python."""

import enum
from typing import NamedTuple

import numpy as np
import pytest
from helpers.twins import FINITE, LARGEST, LEAST, SMALL, assert_twins, bits, compiled
from hypothesis import given, strategies as st

from carom.compiling import registry

pytestmark = pytest.mark.needs("compiled code")

NAME = "far"
TABLE = (3, 1, 4, 1, 5)
ROWS = ((1.0, 2.0), (3.0, 4.0))
FIELD = np.array([[0.5, 1.5], [2.5, 3.5], [4.5, 5.5]])


class Kind(enum.IntEnum):
    SOFT = 2
    HARD = 5


class Mode(enum.Enum):
    ON = 1
    OFF = 2


class Point(NamedTuple):
    x: float
    y: float = 2.0

    def norm(self):
        return self.x * self.x + self.y * self.y

    def moved(self, by, times=1):
        return Point(self.x + by * times, self.y)

    @staticmethod
    def least(a, b):
        return a if a < b else b


class Pair(NamedTuple):
    first: Point
    second: Point
    count: int = 0


ORIGIN = Pair(Point(0.5), Point(0.25, -0.0), 3)


def break_and_else(a, b):
    found = -1
    for k in range(a, b):
        if k % 7 == 3:
            found = k
            break
    else:
        found = -2
    return found


def continues(a, b):
    total = 0
    for k in range(a):
        if k % 3 == 0:
            continue
        if k > b:
            continue
        total += k
    return total


def whiles(a, b):
    steps = 0
    while a != 1 and steps < 50:
        a = a // 2 if a % 2 == 0 else 3 * a + 1
        steps += 1
        if steps % 5 == 4:
            continue
        if steps == b:
            break
    else:
        steps = -steps
    return steps, a


def nested(a, b):
    count = 0
    for i in range(a):
        for j in range(i, b):
            if i * j > 30:
                break
            if (i + j) % 2:
                continue
            count += i - j
        else:
            count += 1000
    return count


def early(a, b):
    for i in range(a):
        for j in range(3):
            if i * j == b:
                return i, j, True
        if i > 15:
            return i, -1, False
    return -1, -1, False


def backwards(a, b):
    total = 0
    for k in range(a, b, -3):
        total = total * 2 + k
    for k in range(b, a, 4):
        total = total * 3 - k
    return total


def few_rounds(a, b):
    total = 0
    for k in range(4):
        if k == a:
            continue
        if k == b:
            break
        total += 10**k
    else:
        total = -total
    return total


def tuples_in_loops(a, b):
    best = (a, b, 0.0)
    for k in range(5):
        if (a * k) % 5 > best[0] % 5:
            best = (a + k, b, 0.5 * k)
        x, (y, z) = best[0], best[1:]
        a, b = b, int(x + y + z) % 11
    return best, a, b


def swaps(a, b):
    c = a
    for _ in range(3):
        a, b, c = b, c, a + b
    return a, b, c


def loop_names(a, b):
    last = -1
    for k in range(a):
        last = k
        k = k * 2
        if k > b:
            break
    for name in (a, 2.5, b):
        kept = name
    return last, kept


def over_tuples(a, b):
    total = 0.0
    for x, y in zip((a, b, 3), (1.0, 2.0, 0.5), strict=True):
        total += x * y
    for k, (x, y) in enumerate(((a, 1), (b, 2)), 5):
        total = total * k + x - y
    for x in reversed((a, b)):
        total = 2 * total - x
    for row in ROWS:
        for x in row:
            total += x
    for x in TABLE[1:-1]:
        total -= x * a
    return total + sum((a, b)) + sum(TABLE) + len(TABLE)


def over_arrays(a, b):
    places = np.array([a, b, 7])
    total = 0.0
    for x in places:
        total = 2 * total + x
    for row in FIELD:
        for x in row:
            total += x * a
    return total, any((a > 0, b > 0)), all((a > 0, b > 0, True)), places[-1]


def branches(a, b):
    if a > b:
        sign, size = 1, 0.5
    elif a == b:
        sign, size = 0, 2.0
    else:
        sign, size = -1, float(b)
    if NAME == "far":  # a text that is known
        size = -size
    return sign, size


def nothing_and_something(a, b):
    chosen = None if TABLE[2] == 4 else a
    if chosen is None:  # noqa: SIM108
        other = b
    else:
        other = chosen
    return other, None is chosen, chosen is not None


def enums(a, b):
    kind = Kind.HARD if a > b else Kind.SOFT
    return kind, kind == Kind.SOFT, a * Kind.HARD, Mode.ON is Mode.OFF, Mode.ON.value


def indexed(a, b):
    k = a % 5
    return TABLE[k], TABLE[-1], ROWS[k % 2], ROWS[1][0], FIELD[k % 3, b % 2], FIELD[-1, -2], (a, b, 2)[b % 3]


def joined(a, b):
    t = (a, *TABLE[:2], b)
    return t + (b,), len(t), t[1:3], t[::-1], t[-2:]  # noqa: RUF005


def helper(x, y=2, *rest):
    total = x * 100 + y * 10
    for each in rest:
        total += each
    return total


def returns_often(x):
    if x < 0:
        return 1.0
    if x == 0:
        return 2.5
    while x > 10:
        x -= 7
        if x == 11:
            return -1.0
    return x / 2


def calls(a, b):
    t = (a, b)
    return (
        helper(a), helper(a, b), helper(a, y=b), helper(y=a, x=b), helper(*t), helper(a, *t, b),
        returns_often(a),
    )  # fmt: skip


def models(a, b):
    p = Point(a + 0)
    q = Point(y=2.5, x=1)
    origin = ORIGIN.first if ORIGIN.count == 3 else p
    pair = Pair(p, Point(*(a, b + 0.5)), count=3)
    if a > b:
        pair = Pair(q, p, 4)
    x, y = pair.second
    return (
        pair, p.norm(), pair.first.norm() + x * y, pair[1].x, p.moved(b).x, Point.least(a, b), p.least(a, 3),
        origin,
    )  # fmt: skip


def by_names(a, b):
    row, point = (), Point(a + 0.5, b + 0.5)
    for name in ("y", "x"):
        row = (*row, getattr(point, name))
    return row


def asserted(a, b):
    assert a < 1000, "too large"
    return a if a else b


FLOWS = (
    break_and_else, continues, whiles, nested, early, backwards, few_rounds, tuples_in_loops, swaps,
    loop_names, over_tuples, over_arrays, branches, nothing_and_something, enums, indexed, joined, calls,
    models, by_names, asserted,
)  # fmt: skip


@pytest.mark.parametrize("function", FLOWS, ids=lambda each: each.__name__)
@given(SMALL, SMALL)
def test_statements(function, a, b):
    assert_twins(function, a, b)


@given(st.sampled_from([LEAST, LEAST + 1, -3, 0, 2, LARGEST - 3, LARGEST - 1, LARGEST]), st.integers(0, 40))
def test_ranges_at_the_ends_of_the_integers(start, count):
    def visited(start, stop, last):
        total = 0
        for k in range(start, stop):
            total += k
        for k in range(start, last, 2**62):
            total += k >> 3
        for k in range(last, start, -(2**62) - 1):
            total += k >> 5
        return total

    assert_twins(visited, start, min(start + count, LARGEST), LARGEST)


@registry.cold
def several(a, x):
    if a > 3:
        return a, (x, True), None
    return a * 2, (x + 1.0, a == 0), None


@registry.cold
def fills(array, start):
    for k in range(len(array)):
        array[k] = start + k


@registry.cold
def fails(a):
    if a == 7:
        raise ValueError("seven is refused")
    return a


def with_cold(a, x):
    n, (y, flag), nothing = several(a, x)
    m = several(n, y)[0]
    places = np.zeros(3)
    fills(places, x)
    return n, m, y, flag, nothing is None, places[1], fails(a + 100) if a > 0 else fails(-100)


@given(SMALL, FINITE)
def test_cold_functions(a, x):
    assert_twins(with_cold, a, x)


def test_what_is_raised_is_raised_through_all_calls():
    def outer(a):
        return fails(a) + 1

    assert compiled(outer)(6) == 7
    with pytest.raises(ValueError, match="seven is refused"):
        compiled(outer)(7)
    with pytest.raises(AssertionError, match="too large"):
        compiled(asserted)(1000, 0)


def test_an_integer_here_and_a_float_there_make_a_float():
    def either(a):
        return 1 if a > 0 else 2.5

    assert bits(compiled(either)(1)) == bits(1.0)


def test_the_second_is_asked_only_where_it_matters():
    def asked(counts, a):
        return (a > 0 and note(counts, 0)) or note(counts, 1), note(counts, 2) if a > 5 else note(counts, 3)

    for a in (-1, 1, 6):
        assert_twins(asked, np.zeros(4, np.int64), a)


def note(counts, k):
    counts[k] += 1
    return counts[k] > 0


def test_what_stands_left_is_read_before_what_stands_right_changes_it():
    def ordered(counts):
        a = counts[0] + (10 if note(counts, 0) else 0)
        counts[1] += 5 if note(counts, 1) else 0
        counts[2] = counts[2] + 7 * note(counts, 2)
        return a, counts[0], counts[1]

    assert_twins(ordered, np.zeros(4, np.int64))


def test_a_call_by_a_name_that_hides_another():
    def hidden(a):
        total = 0
        for k in twins_range(a):
            total += k
        return total

    assert compiled(hidden)(3) == 6


def twins_range(a):
    return a, a
