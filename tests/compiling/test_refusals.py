"""What is outside of the language is refused in one sentence: where it stands, what it is, what to write."""

import math
import re
import textwrap
from typing import NamedTuple

import numpy as np
import pytest

import carom
from carom.compiling.entry import entry
from carom.models import own

pytestmark = pytest.mark.needs("compiled code")

TABLE = np.arange(6.0).reshape(2, 3)
WORDS = {"a": 1.0}
COUNT = 0


class Model(NamedTuple):
    x: float
    places: np.ndarray

    def twice(self):
        return 2.0 * self.x


def helper(x, y=1):
    return x + y


def recursion_of_two(m, a):
    return helper_of_two(m, a) if a > 0 else 0


def helper_of_two(m, a):
    return recursion_of_two(m, a - 1) + 1


PLAIN = "only plain parameters are known here"
PLACE = "line ([0-9]+) of (refused|test_refusals).py"

# The body of ``def refused(m, a)``, of a Model and an integer, or all of it; and what is said of it.
REFUSED = [
    ("try:\n    return a\nexcept ValueError:\n    return 0", "try is not known here: test beforehand"),
    ("with np.errstate(all='ignore'):\n    return a", "with is not known here"),
    ("found = [a, 1]\nreturn found[0]", "a list is not known here: write a tuple, or np.array"),
    ("return {'a': a}['a']", "a dictionary is not known here: write fields, or a tuple"),
    ("return WORDS['a']", "a dictionary is not known here: write fields, or a tuple"),
    ("return a in {1, 2}", "a set is not known here: write a tuple"),
    ("return a in (1, 2)", "in is not known here: compare with each"),
    ("return sum([k for k in range(3)])", "a list is not known here: write a loop"),
    ("return sum(k for k in range(3))", "a generator is not known here: write a loop"),
    ("yield a", "yield is not known here"),
    ("square = lambda x: x * x\nreturn square(a)",
     "a function within a function is not known here: define it outside"),
    ("def square(x):\n    return x * x\nreturn square(a)",
     "a function within a function is not known here: define it outside"),
    ("class Own:\n    pass\nreturn a", "a class within a function is not known here: define it outside"),
    ("import math\nreturn math.sin(a)", "import is not known here: write it at the top of the file"),
    ("global COUNT\nCOUNT = COUNT + 1\nreturn COUNT",
     "global is not known here: write to an array that is a field"),
    ("return f'{a}'", "text is not known here"),
    ("return str(a)", "str is not known here"),
    ("b = a\ndel b\nreturn a", "del is not known here: leave it out"),
    ("return b if (b := a) else 0", ":= is not known here: assign before"),
    ("match a:\n    case 0:\n        return 1\nreturn a", "match is not known here: write if"),
    ("print(a)\nreturn a", "print is not known here"),
    ("return math.comb(a, 2)", "comb is not known here"),
    ("return a + nowhere", "nothing here is named nowhere"),
    ("return np.dot(m.places, m.places)", "dot is not known here"),
    ("return m.places @ m.places", "this operator is not known here"),
    ("return (m.places + m.places)[0]", "a number is expected here, found an array"),
    ("return np.sqrt(m.places)[0]", "a number is expected here, found an array"),
    ("return m.places.sum()", ".sum of an array is not known here: write a loop"),
    ("return np.linalg.norm(m.places)", "norm is not known here"),
    ("return m.z", "a Model has no z"),
    ("return a.real", ".real of a number of type int64 is not known here"),
    ("if a > 0:\n    b = a\nreturn b", "b has no value here, or not always: give it one before"),
    ("for k in range(a):\n    last = k\nreturn last",
     "last has no value here, or not always: give it one before"),
    ("b = c + 1\nc = a\nreturn b", "c has no value here, or not always: give it one before"),
    ("return helper(a, a, a)", "helper takes (x, y)"),
    ("return helper()", "helper needs x"),
    ("return helper(a, z=1)", "helper takes (x, y)"),
    ("return math.sin(a, a)", "sin takes 1 number here"),
    ("return max(a, 1, key=abs)", "max does not take these arguments here"),
    ("return refused(m, a - 1) if a > 0 else 0", "refused calls itself: write a loop"),
    ("return recursion_of_two(m, a)", "calls itself: write a loop"),
    ("pair = (a, a)\npair[0] = 1\nreturn pair",
     "a tuple cannot be written to: let it be an array of the model"),
    ("m.x = 1.0\nreturn a",
     "a field of a Model cannot be written: let it be an array, and write its element"),
    ("TABLE[0, 0] = 1.0\nreturn a", "cannot be written to: let it be an array of the model"),
    ("row = TABLE[0]\nrow[1] = 2.0\nreturn a",
     "an array cannot be written to: let it be an array of the model"),
    ("for row in TABLE:\n    row *= 2.0\nreturn a",
     "an array that is known while compiling cannot be written to"),
    ("return m.places[a / 2]", "an index must be an integer, found a float64: write int(...)"),
    ("for k in range(m.x):\n    a += k\nreturn a",
     "the end of a range must be an integer, found a float64: write int(...)"),
    ("b = m.places\nif a > 0:\n    b = 1.0\nreturn b",
     "b was an array, and is a number of type float64 here: give it another name"),
    ("return m.places if a > 0 else a", "this is an array or a number of type int64: let both be alike"),
    ("return (a, a) if a > 0 else (a, a, a)", "this is a tuple or a tuple: let both be alike"),
    ("best = None\nfor k in range(a):\n    best = k\nreturn best",
     "best is None or a number of type int64: give it another name"),
    ("if a > 0:\n    return a", "this is a number of type int64 or None: let both be alike"),
    ("return np.zeros((2, a))[0, 0]", "the size of an array must be known while compiling: write numbers"),
    ("for k in range(a):\n    room = np.zeros(3)\n    room[0] = k\nreturn a",
     "an array cannot be made in a loop: make it before, and fill it here"),
    ("return np.zeros(10**6)[0]", "an array of 1000000 numbers is too large for a function: make it a field"),
    ("return np.zeros(3)[3]", "index 3 of an array of 3"),
    ("return m.places[0, 0]", "2 indices of an array of 1 dimension"),
    ("return 1 if m.places else 2", "the truth of an array has no meaning here: compare its elements"),
    ("return a or 1", "and and or join bools here, found a number of type int64: write a if b else c"),
    ("return ~(a > 0)", "~ of a bool is not known here: write not"),
    ("m.places[::2] = 0.0\nreturn a", "a part of an array is not known here: write a loop"),
    ("room = np.zeros((2, 4))\nroom[0, ::2] = 1.0\nreturn room[0, 1]",
     "these parts of an array are not known here: write a loop"),
    ("for k in range(0, 9, a):\n    a += k\nreturn a", "the step of a range must be a known number, not 0"),
    ("b, c, d = (a, a)\nreturn b", "3 names for a tuple"),
    ("b, *c = (a, a)\nreturn b", "this cannot be assigned to"),
    ("b, c = m.places\nreturn b", "2 names for an array, whose length is not known here: write [0]"),
    ("return a + 2**63", "9223372036854775808 does not fit in 64 bits"),
    ("return int(1e300)", "1e+300 is no int64"),
    ("return m.x & 1", "& needs integers, found a float64: write int(...)"),
    ("return a << 64", "a shift by 64: integers have 64 bits here"),
    ("return a(1)", "a number of type int64 is no function"),
    ("return a is COUNT", "is compares with None or a class here: write =="),
    ("return helper(**{'x': a})", "** is not known here: name the arguments"),
    ("return np.zeros(3)", "a number is expected here, found an array"),
    ("return 'a' + a", "a number is expected here, found 'a'"),
    ("return (a, 1) == (1, a)", "a number is expected here, found a tuple"),
    ("def refused(m, a, *, b=1):\n    return a + b", PLAIN),
    ("def refused(m, a, **b):\n    return a", PLAIN),
]  # fmt: skip


@pytest.mark.parametrize(("code", "sentence"), REFUSED, ids=[code for code, _ in REFUSED])
def test_what_is_outside_of_the_language_is_refused(code, sentence, tmp_path):
    text = code if code.startswith("def refused") else "def refused(m, a):\n" + textwrap.indent(code, "    ")
    path, scope = tmp_path / "refused.py", {"math": math, **globals()}
    path.write_text(text)
    exec(compile(text, path, "exec"), scope)
    with pytest.raises(carom.InputError) as refused:
        entry(scope["refused"])(Model(1.0, np.zeros(4)), 3)
    said = str(refused.value)
    assert sentence in said
    assert said.endswith(".")
    assert "\n" not in said
    if sentence is not PLAIN:  # which is said of no line
        line, file = re.search(PLACE, said).groups()
        assert 1 <= int(line) <= text.count("\n") + 1 or file != "refused"
    for inside in ("%", "i64", "phi ", "getelementptr", "Traceback", "carom/compiling", "self.", "NoneType"):
        assert inside not in said, said


@own.interaction
class Cores:
    contact: float

    def reach(self, scene):
        return self.contact

    def interaction_time(self, i, j, rr, rv, vv, now):
        return own.first_contact(rr - self.contact**2, rv, vv)

    def jump(self, i, j, rr, rv, now):
        found = [own.elastic(self, i, j, rr, rv)]
        return found[0]


def test_a_model_of_ones_own_is_refused_with_its_class_and_its_line():
    scene = carom.Scene.random(20, 0.3, 2, seed=1, interaction=Cores(1.0))
    with pytest.raises(carom.InputError) as refused:
        carom.Simulation(scene, seed=1).run(time=1.0)
    said = str(refused.value)
    line = Cores.jump.__code__.co_firstlineno + 1
    assert said == (
        f"jump of Cores cannot be compiled: line {line} of test_refusals.py, "
        "`found = [own.elastic(self, i, j, rr, rv)]`: "
        "a list is not known here: write a tuple, or np.array([...])."
    )


def test_what_a_model_of_ones_own_raises_is_raised():
    def refusing(m, a):
        if a > 2:
            raise ValueError(f"found {a}, expected 2 at most")
        return m.twice()

    assert entry(refusing)(Model(1.5, np.zeros(4)), 2) == 3.0
    with pytest.raises(ValueError, match=r"found \(a\), expected 2 at most"):
        entry(refusing)(Model(1.5, np.zeros(4)), 3)
