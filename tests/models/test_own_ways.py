"""Models of one's own in many ways: compiled they answer as in plain Python.

What the language knows within one function: ``tests/compiling/test_language_*.py``.
"""

import numpy as np
import pytest
from helpers import falls
from helpers.falls import COEFFICIENTS, Nested, Shape, Side, polynomial
from helpers.scripts import python, run_cell
from helpers.twins import FINITE, assert_twins
from hypothesis import given

from carom.models import own
from carom.models.interfaces.obstacle import ObstacleModel

CORNERS = (0.0, 0.0), (1.0, 2.0), (3.0, 0.5)
LIMIT = np.float64(2.0)
NESTED = Nested(Shape(0.5, 0.25), ((3.0,), (2.5,)))
falling = lambda x, v: x / v if v > 0.0 else own.NEVER  # noqa: E731


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


class WithTuples(ObstacleModel):
    """As the engine has it, without a decorator: parts may be tuples of any kind."""

    shape: Nested
    limit = 0.25

    def model(self):
        return self

    def doubled(self, x, by=2.0):
        return by * x + self.shape.shape.area() * self.limit

    def encounter(self, x, v, radius, growth):
        (a, b), rows = self.shape
        made = Shape(a + x[0])
        best = self.shape.shape if a > b else made
        more = NESTED.shape.area() + NESTED.rows[1][0] - self.limit + self.doubled(radius)
        return best.area() + rows[1][0] + made.b + Shape.least(a, x[0]) + falls.SHAPE.area() + more


@own.obstacle
class WithArrays(Floor):
    heights: own.Array

    def encounter(self, x, v, radius, growth):
        k = falls.first_above(self.heights, x[0])
        part = self.heights[1:-1]
        return self.heights[k] + len(part) + part[0]


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


class WithText(ObstacleModel):
    """One kind of code for each text."""

    kind: str = "soft"

    def model(self):
        return self

    def encounter(self, x, v, radius, growth):
        factor = 2.0 if self.kind == "soft" else 3.0
        return factor * radius if self.kind != "none" else own.NEVER


WAYS = (
    WithHelpersOfAnotherModule(1.5), WithLambdas(1.0), WithConstants(), WithEnumerations(),
    WithTuples(Nested(Shape(1.0, 0.5), ((1.0,), (2.5,)))), WithArrays(np.array([0.0, 0.5, 1.0, 4.0])),
    WithTuplesOfTuples((1.0, 2.0, 0.5)), WithText(), WithText("hard"), WithText("none"),
)  # fmt: skip


def asked(obstacle, x, v, radius):
    return float(obstacle.encounter(x, v, radius, 0.0))


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


def test_a_model_in_a_cell_in_a_command_and_in_a_file_is_the_same(tmp_path):
    scope = {"__name__": "__main__"}
    run_cell(MODEL, "<ipython-input-7-0123456789ab>", scope)
    time = scope["sim"].time
    (tmp_path / "study.py").write_text(MODEL)
    assert time == float(python("study.py", cwd=tmp_path)) == float(python("-c", MODEL, cwd=tmp_path))
