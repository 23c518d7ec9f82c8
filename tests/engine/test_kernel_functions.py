"""The basic functions: conditions (I) to (V) of the paper, in every dimension; models of other types."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from helpers.oracle import EPS, moving
from helpers.scripts import python
from hypothesis import given, strategies as st

import carom
from carom.engine.build import arrays
from carom.errors import CaromError
from carom.models.interactions.hard_cores import EqualCores
from carom.models.interfaces.particles import NEVER
from carom.models.motions.free_flight import Inertial

SIGMA = 1.0
CORES = EqualCores(SIGMA**2, 0.5 * SIGMA, 1.5)
FLIGHT = Inertial()
coordinate = st.floats(-8.0, 8.0, allow_subnormal=False).filter(lambda x: x == 0.0 or abs(x) > 1e-6)


@st.composite
def pairs(draw):
    """Two spheres outside each other: places and velocities, (2, d) each."""
    d = draw(st.integers(1, 4))
    numbers = draw(st.lists(coordinate, min_size=4 * d, max_size=4 * d))
    x, v = np.array(numbers).reshape(2, 2, d)
    distance = np.linalg.norm(x[1] - x[0])
    if distance < SIGMA:
        x[1, 0] += 2.0 * SIGMA + distance
    return x, v


def invariants(x, v, order=(0, 1)):
    """Return r.r, r.v and v.v of the second relative to the first."""
    i, j = order
    r, u = x[j] - x[i], v[j] - v[i]
    rr = rv = vv = 0.0
    for a, b in zip(r.tolist(), u.tolist(), strict=True):
        rr, rv, vv = rr + a * a, rv + a * b, vv + b * b
    return rr, rv, vv


def advanced(x, v, time):
    d = x.shape[1]
    return np.array(
        [[FLIGHT.position(k, x[i, k], v[i, k], time) for k in range(d)] for i in range(2)]
    ), np.array([[FLIGHT.velocity(k, v[i, k], time) for k in range(d)] for i in range(2)])


def meeting(x, v, order=(0, 1)):
    with np.errstate(all="ignore"):
        return float(CORES.interaction_time(*order, *map(np.float64, invariants(x, v, order)), 0.0))


def jumped(x, v, order=(0, 1)):
    i, j = order
    rr, rv, _ = invariants(x, v, order)
    a, b, _ = CORES.jump(i, j, rr, rv, 0.0)
    after = v.copy()
    after[i] = v[i] + a * (x[j] - x[i])
    after[j] = v[j] - b * (x[j] - x[i])
    return after


@given(pairs())
def test_condition_1_interaction_time_commutes(pair):
    assert meeting(*pair) == meeting(*pair, order=(1, 0))


@given(pairs())
def test_condition_2_jump_commutes(pair):
    np.testing.assert_array_equal(jumped(*pair), jumped(*pair, order=(1, 0)))


@given(pairs(), st.floats(0.0, 10.0), st.floats(0.0, 10.0))
def test_condition_3_advance_is_a_semigroup(pair, first, second):
    x, v = pair
    in_two, _ = advanced(*advanced(x, v, first), second)
    in_one, same = advanced(x, v, first + second)
    # Three roundings of numbers as large as the place or the way.
    assert (np.abs(in_two - in_one) <= 4 * EPS * (np.abs(x) + np.abs(v) * (first + second))).all()
    np.testing.assert_array_equal(same, v)


def time_error(x, v):
    """Return what rounding may do to a meeting time: c is off by that of r.r, and falls as 2 sqrt(disc)."""
    rr, rv, vv = invariants(x, v)
    root = math.sqrt(max(rv * rv - vv * (rr - SIGMA**2), 0.0))
    size = (np.abs(x).max() ** 2) * x.shape[1] * 4 + SIGMA**2
    return 32 * EPS * size / root if root > 0.0 else math.inf


@given(pairs(), st.floats(0.0, 1.0))
def test_condition_4_a_flight_brings_a_meeting_nearer_by_its_time(pair, share):
    x, v = pair
    t = meeting(x, v)
    if t == NEVER or time_error(x, v) * np.abs(v).max() > 1e-6 * SIGMA:
        return  # grazing: rounding may decide whether they meet at all
    near = advanced(x, v, share * t)
    bound = time_error(x, v) + time_error(*near) + 8 * EPS * t
    assert abs(share * t + meeting(*near) - t) <= bound


@given(pairs())
def test_condition_5_nobody_is_stuck(pair):
    x, v = pair
    t = meeting(x, v)
    if t == NEVER:
        return
    x, v = advanced(x, v, t)
    rr, rv, vv = invariants(x, v)
    if abs(rv) < 1e-9 * math.sqrt(rr * vv):
        return  # grazing within rounding: the cycle forbids a second collision at the same time
    assert meeting(x, jumped(x, v)) == NEVER


@given(pairs())
def test_a_jump_keeps_energy_and_momentum(pair):
    x, v = pair
    after = jumped(x, v)
    scale = np.abs(v).max() + np.abs(v[1] - v[0]).max()
    assert np.abs(after.sum(axis=0) - v.sum(axis=0)).max() <= 16 * EPS * scale
    assert abs((after**2).sum() - (v**2).sum()) <= 64 * EPS * x.shape[1] * scale**2


@given(pairs())
def test_meetings_are_at_contact_and_found_again_to_the_bit(pair):
    x, v = pair
    t = meeting(x, v)
    if t == NEVER:
        return
    again, clamped = CORES.contact_time(0, 1, *map(np.float64, invariants(x, v)), 0.0)
    assert again == t
    assert not clamped
    distance = math.sqrt(invariants(*advanced(x, v, t))[0])
    way = np.abs(x).max() + np.abs(v).max() * t
    assert abs(distance - SIGMA) <= 64 * EPS * way**2 / SIGMA


@pytest.mark.parametrize("overlap", [0.0, 1e-15, 1e-12])
def test_an_overlap_by_rounding_meets_now_if_it_approaches_and_is_let_go_if_not(overlap):
    rr = (1.0 - overlap) ** 2
    for rv, expected in ((-1.0, 0.0), (1.0, NEVER)):
        with np.errstate(all="ignore"):
            assert (
                CORES.interaction_time(0, 1, np.float64(rr), np.float64(rv), np.float64(1.0), 0.0) == expected
            )
    t, clamped = CORES.contact_time(0, 1, np.float64(rr), np.float64(-1.0), np.float64(1.0), 0.0)
    assert t == 0.0
    assert clamped == (rr < 1.0)
    assert CORES.core_square(0, 1, 0.0) / rr >= 1.0


CLAY = """
import carom
from carom.models.mathematics.contact import first_contact
from carom.models.interfaces.interaction import PairModel

class Clay(PairModel):
    square: float
    weight: float
    restitution: float

    def interaction_time(self, i, j, rr, rv, vv, now):
        return first_contact(rr - self.square, rv, vv)

    def jump(self, i, j, rr, rv, now):
        factor = 0.5 * (1.0 + self.restitution) * rv / rr
        return factor, factor, -self.weight * factor * rr

    def mass_of(self, i):
        return self.weight

class Sticky:
    def reach(self, scene):
        return 1.0
    def model(self, particles):
        return Clay(1.0, 1.0, 0.5)

scene = carom.Scene([[0.0], [3.0]], 40.0, velocities=[[1.0], [-1.0]], interaction=Sticky())
sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"))
sim.run(collisions=3)
print(sorted(sim.frame().velocities[:, 0].tolist()))
"""


@pytest.mark.slow
def test_a_model_from_outside_the_package_is_chosen_by_its_type(tmp_path):
    # In a process and with a cache of its own: the index of Numba's cache names the module of every model and
    # cannot be read where one of them cannot be imported.
    # Each collision halves the relative velocity, 2 at the start.
    assert python("-c", CLAY, NUMBA_CACHE_DIR=str(tmp_path)).strip() == "[-0.125, 0.125]"


def test_a_model_of_an_unknown_type_does_not_compile(unscheduled):
    from carom.engine import cycle

    class Unknown(NamedTuple):
        square: float

    sim = carom.Simulation(carom.Scene([[0.0], [3.0]], 40.0, velocities=[[1.0], [-1.0]]), seed=0)
    engine = sim._state.engine._replace(model=sim._state.engine.model._replace(pair=Unknown(1.0)))
    with pytest.raises(CaromError, match="a Unknown has no interaction_time"):
        cycle.schedule(*engine, 0, len(engine.state.partner))


def test_what_a_scene_has_not_is_none(unscheduled):
    scene = moving(carom.Scene.random(5, dimension=2, seed=1), 1)
    sim = carom.Simulation(scene, tuning=carom.Tuning(images=False), seed=0)
    assert sim._state.engine.state.images is None
    assert sim._state.log is None
    assert not any("images" in name for name in arrays(sim._state.engine))
    assert sim.frame().images is None
