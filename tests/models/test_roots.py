"""The next time at which a function is <= 0 and falling: none missed, to the last bit of the bracket."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, strategies as st

from carom.models.interfaces.particles import NEVER
from carom.models.mathematics.roots import Curve, next_fall


class Cubic(Curve):
    """((a t + b) t + c) t + d."""

    a: float
    b: float
    c: float
    d: float

    def value(self, t):
        return ((self.a * t + self.b) * t + self.c) * t + self.d

    def slope(self, t):
        return (3.0 * self.a * t + 2.0 * self.b) * t + self.c

    def curvature(self, start, end):
        return max(abs(6.0 * self.a * start + 2.0 * self.b), abs(6.0 * self.a * end + 2.0 * self.b))


class Ripple(Curve):
    """h + v t + g t^2 / 2 - A sin(w t + phase)."""

    h: float
    v: float
    g: float
    amplitude: float
    w: float
    phase: float

    def value(self, t):
        return self.h + (self.v + 0.5 * self.g * t) * t - self.amplitude * math.sin(self.w * t + self.phase)

    def slope(self, t):
        return self.v + self.g * t - self.amplitude * self.w * math.cos(self.w * t + self.phase)

    def curvature(self, start, end):
        return abs(self.g) + self.amplitude * self.w**2


def precisely(curve, t):
    """Return a ripple and its slope at a time, with fifty digits."""
    with mpmath.workdps(50):
        h, v, g, a, w, phase, t = map(mpmath.mpf, (*curve, t))
        return (
            h + v * t + g * t * t / 2 - a * mpmath.sin(w * t + phase),
            v + g * t - a * w * mpmath.cos(w * t + phase),
        )


def first_zero(curve, limit):
    """Return the first zero of a ripple that is > 0 now by looking everywhere: an interval is halved until
    the mean value theorem, with fifty digits, says that the function or its slope has no zero in it.
    """
    bend = abs(curve.g) + curve.amplitude * curve.w**2
    intervals = [(0.0, limit)]
    while intervals:
        low, high = intervals.pop()
        middle, half = 0.5 * (low + high), 0.5 * (high - low) * (1.0 + 1e-12)
        height, falling = precisely(curve, middle)
        if height > (abs(falling) + bend * half) * half:
            continue
        if abs(falling) > bend * half or half < 1e-12:
            if precisely(curve, low)[0] > 0 >= precisely(curve, high)[0]:
                return low, high
            continue
        intervals += [(middle, high), (low, middle)]
    return None


parts = st.floats(-2.0, 2.0, allow_subnormal=False).map(lambda x: round(x, 6))


@given(st.tuples(parts, parts, parts, parts))
def test_no_zero_of_a_cubic_is_missed(numbers):
    curve = Cubic(*numbers)
    found = next_fall(curve, 8.0)
    grid = np.linspace(0.0, min(found, 8.0), 4001)[:-1]
    values = curve.value(grid)
    started = bool(values[0] > 0.0)
    # Before the time found, the function does not fall through zero.
    assert not (started and (values < -1e-12).any())
    if NEVER > found > 0.0:
        assert abs(curve.value(found)) < 1e-9 or curve.slope(found) <= 0.0


ripples = st.builds(
    Ripple, st.floats(0.001, 2.0).map(lambda x: round(x, 4)), st.floats(-1.0, 3.0).map(lambda x: round(x, 4)),
    st.floats(-2.0, 0.0).map(lambda x: round(x, 4)), st.floats(0.01, 1.0).map(lambda x: round(x, 4)),
    st.floats(0.1, 30.0).map(lambda x: round(x, 3)), st.floats(0.0, 6.28).map(lambda x: round(x, 3)),
)  # fmt: skip


@given(ripples)
def test_the_zero_of_a_parabola_over_a_sine_is_the_first_one_to_the_last_bit(curve):
    limit = 5.0
    if curve.value(0.0) <= 0.0:
        curve = curve._replace(h=curve.h + curve.amplitude + 0.01)
    found, wanted = next_fall(curve, limit), first_zero(curve, limit)
    if wanted is None:
        # A graze that rounding cannot tell from a miss is the only excuse.
        assert found == NEVER or abs(precisely(curve, found)[0]) < 1e-14
        return
    if not wanted[0] <= found <= wanted[1]:
        f, s = precisely(curve, found)
        assert abs(f) < 1e-14
        assert abs(s) < 1e-5
    # The bracket: > 0 at the double before, and <= 0 there, as doubles compute it.
    before = math.nextafter(found, 0.0)
    assert curve.value(found) <= 0.0 < curve.value(before) or abs(curve.slope(found)) < 1e-6


@given(ripples)
def test_a_contact_that_was_just_processed_is_not_found_again(curve):
    found = next_fall(curve, 5.0)
    if found == NEVER or not curve.value(found) <= 0.0:
        return
    # Thrown back, it moves away; the hair by which it may be inside is no contact.
    away = curve._replace(
        h=curve.h + (curve.v + 0.5 * curve.g * found) * found,
        v=curve.v + curve.g * found - 2.0 * curve.slope(found),
        phase=curve.phase + curve.w * found,
    )
    again = next_fall(away, 5.0)
    if away.slope(0.0) > 1e-3:
        assert again >= away.slope(0.0) / away.curvature(0.0, 5.0)


def test_what_is_inside_and_goes_deeper_falls_now():
    assert next_fall(Cubic(0.0, 0.0, -1.0, 0.0), 9.0) == 0.0
    assert next_fall(Cubic(0.0, 0.0, -1.0, -1e-16), 9.0) == 0.0


def test_what_is_inside_and_turns_round_falls_when_it_turns():
    # -1 + t - t^2 never gets out; its slope changes sign at 1 / 2.
    assert math.isclose(next_fall(Cubic(0.0, -1.0, 1.0, -1.0), 9.0), 0.5, rel_tol=1e-9)


def test_at_rest_on_the_zero_it_falls_at_once():
    t = next_fall(Cubic(0.0, -0.5, 0.0, 0.0), 8.0)
    assert 0.0 <= t < 1e-12


@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_near_graze_is_told_from_a_miss(off):
    # (t - 1)^2 - off meets zero at 1 - sqrt(off); (t - 1)^2 + off never does.
    assert math.isclose(next_fall(Cubic(0.0, 1.0, -2.0, 1.0 - off), 9.0), 1.0 - math.sqrt(off), rel_tol=1e-8)
    assert next_fall(Cubic(0.0, 1.0, -2.0, 1.0 + off), 9.0) == NEVER


def test_the_limit_is_respected():
    assert next_fall(Cubic(0.0, 0.0, -1.0, 2.0), 1.9) == NEVER
    assert next_fall(Cubic(0.0, 0.0, -1.0, 2.0), 2.0) == 2.0


@pytest.mark.parametrize("power", [-300, -40, 0, 40, 300])
def test_a_scaled_function_has_its_zero_scaled(power):
    curve = Ripple(1.0, -0.3, -0.1, 0.2, 4.0, 0.3)
    scale = 2.0**power
    heights = Ripple(scale * 1.0, scale * -0.3, scale * -0.1, scale * 0.2, 4.0, 0.3)
    assert next_fall(heights, 5.0) == next_fall(curve, 5.0)


def test_no_number_ends_the_search():
    assert next_fall(Cubic(0.0, 0.0, math.nan, 1.0), 5.0) == NEVER


def test_compiled_code_finds_the_same_bits():
    from carom.compiling.entry import entry

    compiled, rng = entry(lambda curve, limit: next_fall(curve, limit)), np.random.default_rng(3)
    for _ in range(200):
        curve = Cubic(*rng.normal(size=4).tolist())
        assert compiled(curve, 7.0) == next_fall(curve, 7.0)
