"""Models of one's own in many ways: compiled they answer as in plain Python."""

import linecache
import math
from typing import NamedTuple

import numpy as np
import pytest
from helpers import falls
from helpers.falls import COEFFICIENTS, Nested, Shape, Side, polynomial
from helpers.scripts import python
from helpers.twins import FINITE, assert_twins
from hypothesis import given

from carom.models import own
from carom.models.questions.obstacle import encounter

CORNERS = (0.0, 0.0), (1.0, 2.0), (3.0, 0.5)
NOTHING = ()
LIMIT = np.float64(2.0)
NESTED = Nested(Shape(0.5, 0.25), ((3.0,), (2.5,)))
falling = lambda x, v: x / v if v > 0.0 else own.NEVER  # noqa: E731


def scaled(model, x, by=1.0):
    return model.factor * x * by


def more_of(radius):
    return radius, 2.0 * radius


class Floor:
    """What all of them share: they are met by what comes down to the height of an encounter at rest."""

    def gap(self, positions, radii, box, periodic):
        return positions[:, 1] - radii + 1e3

    def outward(self, x, axis):
        return 1.0 if axis == 1 else 0.0


@own.obstacle
class WithHelpersOfAnotherModule(Floor):
    height: float

    def encounter(self, x, v, radius, growth):
        return falls.polynomial(x[1]) + polynomial(v[1], (1.0, 2.0)) + falls.square(self.height)


@own.obstacle
class WithLambdas(Floor):
    height: float

    def encounter(self, x, v, radius, growth):
        return falling(x[1], v[1]) + falls.square(radius)


@own.obstacle
class WithConstants(Floor):
    k: int = 1

    def encounter(self, x, v, radius, growth):
        total = falls.TABLE[self.k, -1] + COEFFICIENTS[self.k] + LIMIT
        for row in falls.TABLE:
            for each in row:
                total += each * radius
        for each in COEFFICIENTS[1:]:
            total -= each
        return total


@own.obstacle
class WithEnumerations(Floor):
    side: int = 1

    def encounter(self, x, v, radius, growth):
        side = Side.LEFT if x[0] < 0.5 else Side.RIGHT
        return float(side) if side == self.side else 7.0 + Side.RIGHT


class WithTuples(NamedTuple):
    """As the engine has it, without a decorator: parts may be tuples of any kind."""

    shape: Nested
    limit = 0.25

    def model(self):
        return self

    def doubled(self, x, by=2.0):
        return by * x + self.shape.shape.area() * self.limit


@encounter.register
def _(obstacle: WithTuples, x, v, radius, growth):
    (a, b), rows = obstacle.shape
    made = Shape(a + x[0])
    best = obstacle.shape.shape if a > b else made
    more = NESTED.shape.area() + NESTED.rows[1][0] - obstacle.limit + obstacle.doubled(radius)
    return best.area() + rows[1][0] + made.b + Shape.least(a, x[0]) + falls.SHAPE.area() + more


@own.obstacle
class WithLoops(Floor):
    height: float

    def encounter(self, x, v, radius, growth):
        found, n = falls.root(abs(x[1]) + 0.5)
        return found + n + falls.bisected(0.0, 9.0, abs(x[0]))


@own.obstacle
class WithEarlyReturns(Floor):
    height: float

    def encounter(self, x, v, radius, growth):
        if x[1] < 0.0:
            return own.NEVER
        for k in range(len(x)):
            if x[k] > 3.0:
                if v[k] > 0.0:
                    return float(k)
                break
        else:
            return 0.25
        return 0.5


@own.obstacle
class WithLocalArrays(Floor):
    height: float

    def encounter(self, x, v, radius, growth):
        places, moved = np.zeros(3), x.copy()
        counts = np.zeros(len(x), np.int64)
        for k in range(len(x)):
            moved[k] += v[k] * radius
            counts[k] = int(moved[k]) % 3
            places[counts[k]] += 1.0
        places[-1] *= 0.5
        return places[0] + 10.0 * places[1] + 100.0 * places[2] + moved[-1]


@own.obstacle
class WithArrays(Floor):
    heights: own.Array

    def encounter(self, x, v, radius, growth):
        k = falls.first_above(self.heights, x[0])
        part = self.heights[1:-1]
        return self.heights[k] + len(part) + part[0]


@own.obstacle
class WithArguments(Floor):
    height: float
    factor: float = 2.0

    def encounter(self, x, v, radius, growth):
        more = falls.length_of(), falls.length_of(v[0]), falls.length_of(*more_of(radius), v[1])
        return scaled(self, x[1]) + scaled(by=0.5, model=self, x=x[0]) + more[0] + more[1] + more[2]


@own.obstacle
class WithTuplesOfTuples(Floor):
    weights: tuple

    def encounter(self, x, v, radius, growth):
        best, at = own.NEVER, -1
        for k, ((a, b), weight) in enumerate(zip(CORNERS, self.weights, strict=True)):
            gap = weight * (falls.square(x[0] - a) + falls.square(x[1] - b))
            if gap < best:
                best, at = gap, k
        return best + at


@own.obstacle
class WithDivisions(Floor):
    count: int

    def encounter(self, x, v, radius, growth):
        cell = math.floor(x[0] / 0.7) % self.count
        other = int(x[1]) // self.count
        return x[0] % 0.7 + cell - other % 3 + (x[1] // 0.3 if abs(x[1]) < 1e3 else 0.0)


@own.obstacle
class WithConditions(Floor):
    height: float

    def encounter(self, x, v, radius, growth):
        inside = 0.0 < x[0] < 2.0 <= x[1] or not (v[0] or v[1])
        sign = 1 if inside else -1
        least = min(x[0], x[1], self.height)
        return sign * max(least, -radius) + (2.0 if inside and x[0] > 1.0 else 3)


@own.obstacle
class WithAccumulators(Floor):
    height: float

    def encounter(self, x, v, radius, growth):
        total = 0
        n = 0
        while n < 5:
            n += 1
            if n == 2:
                continue
            total += x[0] if n % 2 else n
            total *= 0.5
        a, b = 1, 1
        for _ in range(20):
            a, b = b, a + b
        return total + a


@own.obstacle
class WithFunctionsOfNumbers(Floor):
    height: float

    def encounter(self, x, v, radius, growth):
        angle = math.atan2(x[1], x[0] + 0.1)
        size = np.sqrt(x[0] * x[0] + x[1] * x[1])
        return (
            math.sin(angle)
            + np.floor(size % 9.0)
            + math.copysign(radius, v[0])
            + round(angle)
            + np.sign(v[1])
        )


class WithText(NamedTuple):
    """One kind of code for each text."""

    kind: str = "soft"

    def model(self):
        return self


@encounter.register
def _(obstacle: WithText, x, v, radius, growth):
    factor = 2.0 if obstacle.kind == "soft" else 3.0
    return factor * radius if obstacle.kind != "none" else own.NEVER


@own.obstacle
class WithNothing(Floor):
    height: float

    def encounter(self, x, v, radius, growth):
        time = self.height
        for each in NOTHING:
            time += each
        chosen = None if len(NOTHING) == 0 else time
        return time if chosen is None else own.NEVER


WAYS = (
    WithHelpersOfAnotherModule(1.5),
    WithLambdas(1.0),
    WithConstants(),
    WithEnumerations(),
    WithTuples(Nested(Shape(1.0, 0.5), ((1.0,), (2.5,)))),
    WithLoops(1.0),
    WithEarlyReturns(1.0),
    WithLocalArrays(1.0),
    WithArrays(np.array([0.0, 0.5, 1.0, 4.0])),
    WithArguments(1.0),
    WithTuplesOfTuples((1.0, 2.0, 0.5)),
    WithDivisions(5),
    WithConditions(1.0),
    WithAccumulators(1.0),
    WithFunctionsOfNumbers(1.0),
    WithText(),
    WithText("hard"),
    WithText("none"),
    WithNothing(1.0),
)


def asked(obstacle, x, v, radius):
    return float(encounter(obstacle, x, v, radius, 0.0))


@pytest.mark.needs("compiled code")
@pytest.mark.parametrize("way", WAYS, ids=lambda each: type(each).__name__)
@given(FINITE, FINITE, FINITE)
def test_every_way_is_that_of_plain_python(way, a, b, c):
    with np.errstate(all="ignore"):
        assert_twins(asked, way.model(), np.array([a, b]), np.array([b, c]), abs(c))


MODEL = """
import numpy as np
import carom
from carom.models import own

SOFT = {"soft": 1}["soft"]

def contact_of(pair, i, j):
    return pair.contact * (SOFT if pair.species[i] == pair.species[j] else 2 - SOFT)

@own.interaction
class Cores:
    contact: float
    species = own.per_particle("species")

    def reach(self, scene):
        return self.contact

    def interaction_time(self, i, j, rr, rv, vv, now):
        return own.first_contact(rr - contact_of(self, i, j) ** 2, rv, vv)

    def jump(self, i, j, rr, rv, now):
        return own.elastic(self, i, j, rr, rv)

places = carom.Scene.random(12, 0.2, 2, walls=True, seed=1)
sim = carom.Simulation(places.replace(species=np.arange(12) % 2, interaction=Cores(1.0)), seed=1)
sim.run(collisions=50)
print(repr(sim.time))
"""


def cell_of(text, name):
    """Run a cell as a notebook does: its text is where tracebacks look for it."""
    linecache.cache[name] = len(text), None, text.splitlines(keepends=True), name
    scope = {"__name__": "__main__"}
    exec(compile(text, name, "exec"), scope)
    return scope


def test_a_model_in_a_cell_in_a_command_and_in_a_file_is_the_same(tmp_path):
    time = cell_of(MODEL, "<ipython-input-7-0123456789ab>")["sim"].time
    (tmp_path / "study.py").write_text(MODEL)
    assert time == float(python("study.py", cwd=tmp_path)) == float(python("-c", MODEL, cwd=tmp_path))
