"""What is outside of the language is refused in one sentence: where it stands, what it is, what to write."""

# ruff: noqa: C416, E731, F841, PIE804, RET503, RUF059

import math
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


def a_try(m, a):
    try:
        return a
    except ValueError:
        return 0


def a_with(m, a):
    with np.errstate(all="ignore"):
        return a


def a_list(m, a):
    found = [a, 1]
    return found[0]


def a_dictionary(m, a):
    return {"a": a}["a"]


def a_dictionary_outside(m, a):
    return WORDS["a"]


def a_set(m, a):
    return a in {1, 2}


def membership(m, a):
    return a in (1, 2)


def a_comprehension(m, a):
    return sum([k for k in range(3)])


def a_generator(m, a):
    return sum(k for k in range(3))


def a_yield(m, a):
    yield a


def a_lambda(m, a):
    square = lambda x: x * x
    return square(a)


def a_function_within(m, a):
    def square(x):
        return x * x

    return square(a)


def a_class_within(m, a):
    class Own:
        pass

    return a


def an_import(m, a):
    import math

    return math.sin(a)


def a_global(m, a):
    global COUNT
    COUNT = COUNT + 1
    return COUNT


def a_text(m, a):
    return f"{a}"


def a_text_made(m, a):
    return str(a)


def a_deletion(m, a):
    b = a
    del b
    return a


def a_walrus(m, a):
    return b if (b := a) else 0


def a_match(m, a):
    match a:
        case 0:
            return 1
    return a


def a_print(m, a):
    print(a)
    return a


def an_unknown_function(m, a):
    return math.comb(a, 2)


def an_unknown_name(m, a):
    return a + nowhere  # noqa: F821


def a_product_of_arrays(m, a):
    return np.dot(m.places, m.places)


def a_matrix_product(m, a):
    return m.places @ m.places


def a_sum_of_arrays(m, a):
    return (m.places + m.places)[0]


def a_function_of_an_array(m, a):
    return np.sqrt(m.places)[0]


def a_method_of_an_array(m, a):
    return m.places.sum()


def a_norm(m, a):
    return np.linalg.norm(m.places)


def an_attribute(m, a):
    return m.z


def an_attribute_of_a_number(m, a):
    return a.real


def no_value(m, a):
    if a > 0:
        b = a
    return b


def no_value_after_a_loop(m, a):
    for k in range(a):
        last = k
    return last


def no_value_yet(m, a):
    b = c + 1  # noqa: F821
    c = a
    return b


def too_many_arguments(m, a):
    return helper(a, a, a)


def too_few_arguments(m, a):
    return helper()


def an_unknown_argument(m, a):
    return helper(a, z=1)


def helper(x, y=1):
    return x + y


def too_many_for_a_function(m, a):
    return math.sin(a, a)


def a_keyword_of_a_function(m, a):
    return max(a, 1, key=abs)


def recursion(m, a):
    return recursion(m, a - 1) if a > 0 else 0


def recursion_of_two(m, a):
    return helper_of_two(m, a) if a > 0 else 0


def helper_of_two(m, a):
    return recursion_of_two(m, a - 1) + 1


def writing_to_a_tuple(m, a):
    pair = (a, a)
    pair[0] = 1
    return pair


def writing_to_a_field(m, a):
    m.x = 1.0
    return a


def writing_to_a_constant(m, a):
    TABLE[0, 0] = 1.0
    return a


def writing_to_a_row_of_a_constant(m, a):
    row = TABLE[0]
    row[1] = 2.0
    return a


def adding_to_a_row_of_a_constant(m, a):
    for row in TABLE:
        row *= 2.0
    return a


def a_float_as_an_index(m, a):
    return m.places[a / 2]


def a_float_as_a_length(m, a):
    for k in range(m.x):
        a += k
    return a


def two_kinds_of_a_name(m, a):
    b = m.places
    if a > 0:
        b = 1.0
    return b


def two_kinds_in_branches(m, a):
    return m.places if a > 0 else a


def two_lengths_in_branches(m, a):
    return (a, a) if a > 0 else (a, a, a)


def none_or_a_number(m, a):
    best = None
    for k in range(a):
        best = k
    return best


def nothing_or_a_number(m, a):
    if a > 0:
        return a


def a_size_that_is_not_known(m, a):
    return np.zeros((2, a))[0, 0]


def an_array_in_a_loop(m, a):
    for k in range(a):
        room = np.zeros(3)
        room[0] = k
    return a


def an_array_that_is_too_large(m, a):
    return np.zeros(10**6)[0]


def an_index_that_is_too_large(m, a):
    return np.zeros(3)[3]


def too_many_indices(m, a):
    return m.places[0, 0]


def the_truth_of_an_array(m, a):
    return 1 if m.places else 2


def or_of_numbers(m, a):
    return a or 1


def a_bool_inverted(m, a):
    return ~(a > 0)


def a_step_of_a_part(m, a):
    m.places[::2] = 0.0
    return a


def a_step_along_a_row(m, a):
    room = np.zeros((2, 4))
    room[0, ::2] = 1.0
    return room[0, 1]


def a_step_that_is_not_known(m, a):
    for k in range(0, 9, a):
        a += k
    return a


def too_many_names(m, a):
    b, c, d = (a, a)
    return b


def a_rest_of_names(m, a):
    b, *c = (a, a)
    return b


def names_for_an_array(m, a):
    b, c = m.places
    return b


def a_number_too_large(m, a):
    return a + 2**63


def an_infinite_integer(m, a):
    return int(1e300)


def bits_of_a_float(m, a):
    return m.x & 1


def a_shift_too_far(m, a):
    return a << 64


def a_number_called(m, a):
    return a(1)


def an_identity(m, a):
    return a is COUNT


def two_stars(m, a):
    return helper(**{"x": a})


def an_array_given_back(m, a):
    return np.zeros(3)


def words_for_a_number(m, a):
    return "a" + a


def a_comparison_of_tuples(m, a):
    return (a, 1) == (1, a)


REFUSED = {
    a_try: "try is not known here: test beforehand",
    a_with: "with is not known here",
    a_list: "a list is not known here: write a tuple, or np.array",
    a_dictionary: "a dictionary is not known here: write fields, or a tuple",
    a_dictionary_outside: "a dictionary is not known here: write fields, or a tuple",
    a_set: "a set is not known here: write a tuple",
    membership: "in is not known here: compare with each",
    a_comprehension: "a list is not known here: write a loop",
    a_generator: "a generator is not known here: write a loop",
    a_yield: "yield is not known here",
    a_lambda: "a function within a function is not known here: define it outside",
    a_function_within: "a function within a function is not known here: define it outside",
    a_class_within: "a class within a function is not known here: define it outside",
    an_import: "import is not known here: write it at the top of the file",
    a_global: "global is not known here: write to an array that is a field",
    a_text: "text is not known here",
    a_text_made: "str is not known here",
    a_deletion: "del is not known here: leave it out",
    a_walrus: ":= is not known here: assign before",
    a_match: "match is not known here: write if",
    a_print: "print is not known here",
    an_unknown_function: "comb is not known here",
    an_unknown_name: "nothing here is named nowhere",
    a_product_of_arrays: "dot is not known here",
    a_matrix_product: "this operator is not known here",
    a_sum_of_arrays: "a number is expected here, found an array",
    a_function_of_an_array: "a number is expected here, found an array",
    a_method_of_an_array: ".sum of an array is not known here: write a loop",
    a_norm: "norm is not known here",
    an_attribute: "a Model has no z",
    an_attribute_of_a_number: ".real of a number of type int64 is not known here",
    no_value: "b has no value here, or not always: give it one before",
    no_value_after_a_loop: "last has no value here, or not always: give it one before",
    no_value_yet: "c has no value here, or not always: give it one before",
    too_many_arguments: "helper takes (x, y)",
    too_few_arguments: "helper needs x",
    an_unknown_argument: "helper takes (x, y)",
    too_many_for_a_function: "sin takes 1 number here",
    a_keyword_of_a_function: "max does not take these arguments here",
    recursion: "recursion calls itself: write a loop",
    recursion_of_two: "calls itself: write a loop",
    writing_to_a_tuple: "a tuple cannot be written to: let it be an array of the model",
    writing_to_a_field: "a field of a Model cannot be written: let it be an array, and write its element",
    writing_to_a_constant: "cannot be written to: let it be an array of the model",
    writing_to_a_row_of_a_constant: "an array cannot be written to: let it be an array of the model",
    adding_to_a_row_of_a_constant: "an array that is known while compiling cannot be written to",
    a_float_as_an_index: "an index must be an integer, found a float64: write int(...)",
    a_float_as_a_length: "the end of a range must be an integer, found a float64: write int(...)",
    two_kinds_of_a_name: "b was an array, and is a number of type float64 here: give it another name",
    two_kinds_in_branches: "this is an array or a number of type int64: let both be alike",
    two_lengths_in_branches: "this is a tuple or a tuple: let both be alike",
    none_or_a_number: "best is None or a number of type int64: give it another name",
    nothing_or_a_number: "this is a number of type int64 or None: let both be alike",
    a_size_that_is_not_known: "the size of an array must be known while compiling: write numbers",
    an_array_in_a_loop: "an array cannot be made in a loop: make it before, and fill it here",
    an_array_that_is_too_large: "an array of 1000000 numbers is too large for a function: make it a field",
    an_index_that_is_too_large: "index 3 of an array of 3",
    too_many_indices: "2 indices of an array of 1 dimension",
    the_truth_of_an_array: "the truth of an array has no meaning here: compare its elements",
    or_of_numbers: "and and or join bools here, found a number of type int64: write a if b else c",
    a_bool_inverted: "~ of a bool is not known here: write not",
    a_step_of_a_part: "a part of an array is not known here: write a loop",
    a_step_along_a_row: "these parts of an array are not known here: write a loop",
    a_step_that_is_not_known: "the step of a range must be a known number, not 0",
    too_many_names: "3 names for a tuple",
    a_rest_of_names: "this cannot be assigned to",
    names_for_an_array: "2 names for an array, whose length is not known here: write [0]",
    a_number_too_large: "9223372036854775808 does not fit in 64 bits",
    an_infinite_integer: "1e+300 is no int64",
    bits_of_a_float: "& needs integers, found a float64: write int(...)",
    a_shift_too_far: "a shift by 64: integers have 64 bits here",
    a_number_called: "a number of type int64 is no function",
    an_identity: "is compares with None or a class here: write ==",
    two_stars: "** is not known here: name the arguments",
    an_array_given_back: "a number is expected here, found an array",
    words_for_a_number: "a number is expected here, found 'a'",
    a_comparison_of_tuples: "a number is expected here, found a tuple",
}


def assert_one_sentence(said, function):
    """Assert that a message is one sentence with a place, and that it shows nothing from inside."""
    assert "\n" not in said
    assert said.endswith(".")
    first = function.__code__.co_firstlineno
    assert first <= int(said.partition("line ")[2].partition(" ")[0]) <= first + 7 or "of_two" in said
    for inside in ("%", "i64", "phi ", "getelementptr", "Traceback", "carom/compiling", "self.", "NoneType"):
        assert inside not in said, said


@pytest.mark.parametrize("function", REFUSED, ids=lambda each: each.__name__)
def test_what_is_outside_of_the_language_is_refused(function):
    with pytest.raises(carom.InputError) as refused:
        entry(function)(Model(1.0, np.zeros(4)), 3)
    said = str(refused.value)
    assert REFUSED[function] in said
    assert "of test_refusals.py" in said
    assert_one_sentence(said, function)


PARAMETERS = "only plain parameters are known here"


def keywords_only(m, a, *, b=1):
    return a + b


def any_keywords(m, a, **b):
    return a


@pytest.mark.parametrize("function", [keywords_only, any_keywords])
def test_other_parameters_are_refused(function):
    with pytest.raises(carom.InputError, match=PARAMETERS):
        entry(function)(Model(1.0, np.zeros(4)), 3)


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
