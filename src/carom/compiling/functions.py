"""What compiled code has in the place of functions of Python, ``math`` and NumPy."""

from __future__ import annotations

import ast
import builtins
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from carom.compiling.calls import FUNCTIONS, Calls
from carom.compiling.faults import Untranslatable
from carom.compiling.language import (
    FLOAT32,
    FLOAT64,
    INT32,
    INT64,
    UINT64,
    Array,
    Known,
    Lined,
    Number,
    Several,
    described,
)

Handler = Callable[..., Any]


def compiled_as(*functions: Any) -> Callable[[Handler], Handler]:
    """Let compiled code have the decorated translation in the place of functions."""

    def decorate(handler: Handler) -> Handler:
        for each in functions:
            FUNCTIONS[each] = handler
        return handler

    return decorate


def several(self: Calls, value: Any) -> list[Any]:
    """Return the parts of a tuple, or of an array whose length is known."""
    value = self.whole(value)
    if isinstance(value, Several):
        return value.items
    if isinstance(value, Array) and isinstance(value.lengths[0], Known):
        return [self.item(value, Known(k)) for k in range(value.lengths[0].value)]
    raise Untranslatable(f"a tuple is expected here, found {described(value)}: write a loop")


def _extreme(kind: type) -> Handler:
    def handler(self: Calls, *given: Any) -> Any:
        values = [self.number(each) for each in (several(self, given[0]) if len(given) == 1 else given)]
        if not values:
            raise Untranslatable("there is no least and no largest of nothing")
        best = values[0]
        for each in values[1:]:
            if isinstance(best, Known) and isinstance(each, Known):
                best = each if self.compare(kind, each, best).value else best
                continue
            a, b, both = self.common(best, each)
            better = self.compare(kind, b, a)
            natural = all(isinstance(x, Number) and x.natural for x in (a, b))
            best = Number(
                both, self.choose(self.text(better), self.text(b), self.text(a), both.llvm), natural
            )
        return best

    return handler


FUNCTIONS[max], FUNCTIONS[min] = _extreme(ast.Gt), _extreme(ast.Lt)


def _of_both(kind: type) -> Handler:
    """NumPy's maximum and minimum: NaN where one is."""

    def handler(self: Calls, x: Any, y: Any) -> Any:
        a, b, both = self.common(self.number(x), self.number(y))
        first = self.text(self.compare(kind, a, b))
        if both.is_float:
            first = self.op(f"or i1 {first}, {self.text(self.compare(ast.NotEq, a, a))}")
        return Number(both, self.choose(first, self.text(a), self.text(b), both.llvm))

    return handler


FUNCTIONS[np.maximum], FUNCTIONS[np.minimum] = _of_both(ast.GtE), _of_both(ast.LtE)


def _intrinsic(name: str, fold: Callable[[float], float]) -> Handler:
    """A function of a float for which the processor has instructions."""

    def handler(self: Calls, value: Any) -> Any:
        value = self.number(value)
        if not value.type.is_float and name in ("floor", "ceil", "trunc"):
            return self.wide(value)
        if (
            isinstance(value, Known)
            and value.type is not FLOAT32
            and not (name == "sqrt" and value.value < 0)
        ):
            return Known(float(fold(float(value.value))), FLOAT64)
        if not value.type.is_float:
            value = self.cast(self.wide(value), FLOAT64)
        return self.call_external(f"llvm.{name}.f{value.type.bits}", value.type, [value], self.flags)

    return handler


floor = _intrinsic("floor", np.floor)
absolute_float = _intrinsic("fabs", abs)
FUNCTIONS[np.floor], FUNCTIONS[np.ceil] = floor, _intrinsic("ceil", np.ceil)
FUNCTIONS[np.trunc], FUNCTIONS[np.rint] = _intrinsic("trunc", np.trunc), _intrinsic("rint", np.rint)
FUNCTIONS[np.sqrt] = _intrinsic("sqrt", np.sqrt)
for _python, _numpy in ((math.sqrt, FUNCTIONS[np.sqrt]), (math.fabs, absolute_float)):
    FUNCTIONS[_python] = lambda self, x, of=_numpy: of(self, self.cast(self.wide(x), FLOAT64))
for _whole, _numpy in ((math.floor, np.floor), (math.ceil, np.ceil), (math.trunc, np.trunc)):
    FUNCTIONS[_whole] = lambda self, value, whole=FUNCTIONS[_numpy]: self.cast(whole(self, value), INT64)


@compiled_as(round)
def _round(self: Calls, value: Any) -> Any:
    value = self.wide(value)
    return self.cast(FUNCTIONS[np.rint](self, value), INT64) if value.type.is_float else value


@compiled_as(abs, np.abs)
def _absolute(self: Calls, value: Any) -> Any:
    value = self.wide(value)
    if value.type.is_float:
        return absolute_float(self, value)
    if isinstance(value, Known):
        return Known(abs(value.value), value.type)
    if value.type is UINT64:
        return value
    below = self.op(f"icmp slt i64 {value.text}, 0")
    return Number(INT64, self.choose(below, self.negative(value).text, value.text))


@compiled_as(len)
def _length(self: Calls, value: Any) -> Any:
    return self.length(value)


@compiled_as(isinstance)
def _is_instance(self: Calls, value: Any, cls: Any) -> Any:
    if not isinstance(value, Several) and not (isinstance(value, Known) and value.type is None):
        raise Untranslatable("isinstance looks at models here")
    wanted = tuple(each.value for each in cls.items) if isinstance(cls, Several) else cls.value
    return Known(issubclass(value.cls if isinstance(value, Several) else type(value.value), wanted))


@compiled_as(getattr)
def _attribute(self: Calls, value: Any, name: Any) -> Any:
    if not isinstance(name, Known) or not isinstance(name.value, str):
        raise Untranslatable("getattr needs a name that is known while compiling")
    return self.attribute(value, name.value)


@compiled_as(zip)
def _zip(self: Calls, *given: Any, strict: Any = None) -> Any:
    rows = [several(self, each) for each in given]
    if strict is not None and strict.value and len({len(each) for each in rows}) > 1:
        raise Untranslatable("these tuples are not equally long")
    return Several(tuple, [Several(tuple, list(each)) for each in zip(*rows, strict=False)])


@compiled_as(enumerate)
def _enumerate(self: Calls, given: Any, start: Any = None) -> Any:
    first = 0 if start is None else start.value
    return Several(
        tuple, [Several(tuple, [Known(k), each]) for k, each in enumerate(several(self, given), first)]
    )


@compiled_as(reversed)
def _reversed(self: Calls, given: Any) -> Any:
    return Several(tuple, several(self, given)[::-1])


@compiled_as(sum)
def _sum(self: Calls, given: Any, start: Any = None) -> Any:
    total: Any = Known(0) if start is None else start
    for each in several(self, given):
        total = self.binary(ast.Add, total, each)
    return total


def _of_all(is_and: bool) -> Handler:
    """Whether all parts of a tuple hold, or any."""

    def handler(self: Calls, given: Any) -> Any:
        values = several(self, given) or [Known(is_and)]
        return self.decided(is_and, [partial(self.get, each) for each in values])

    return handler


FUNCTIONS[all], FUNCTIONS[any] = _of_all(True), _of_all(False)


@compiled_as(divmod)
def _divmod(self: Calls, x: Any, y: Any) -> Any:
    return Several(tuple, [self.binary(ast.FloorDiv, x, y), self.binary(ast.Mod, x, y)])


@compiled_as(pow, np.power)
def _pow(self: Calls, x: Any, y: Any) -> Any:
    return self.binary(ast.Pow, x, y)


@compiled_as(math.pow)
def _float_pow(self: Calls, x: Any, y: Any) -> Any:
    return self.binary(ast.Pow, self.cast(self.wide(x), FLOAT64), self.cast(self.wide(y), FLOAT64))


def _of_library(name: str, count: int = 1) -> Handler:
    """A function of floats of the C library."""

    def handler(self: Calls, *given: Any) -> Any:
        if len(given) != count:
            raise Untranslatable(f"{name} takes {count} number{'s' * (count > 1)} here")
        return self.call_external(name, FLOAT64, [self.cast(self.wide(each), FLOAT64) for each in given])

    return handler


_LIBRARY = (
    "acos acosh asin asinh atan atanh cbrt cos cosh erf erfc exp exp2 expm1 log log10 log1p log2 sin sinh"
)
for _name in f"{_LIBRARY} tan tanh".split():
    for _place in (math, np):
        if hasattr(_place, _name):
            FUNCTIONS[getattr(_place, _name)] = _of_library(_name)
FUNCTIONS[math.gamma], FUNCTIONS[math.lgamma] = _of_library("tgamma"), _of_library("lgamma")
for _name, _there in (("arccos", "acos"), ("arcsin", "asin"), ("arctan", "atan")):
    FUNCTIONS[getattr(np, _name)] = _of_library(_there)
    FUNCTIONS[getattr(np, f"{_name}h")] = _of_library(f"{_there}h")
FUNCTIONS[math.atan2] = FUNCTIONS[np.arctan2] = _of_library("atan2", 2)
FUNCTIONS[math.hypot] = FUNCTIONS[np.hypot] = _of_library("hypot", 2)
FUNCTIONS[math.fmod] = FUNCTIONS[np.fmod] = _of_library("fmod", 2)
FUNCTIONS[math.nextafter] = FUNCTIONS[np.nextafter] = _of_library("nextafter", 2)


@compiled_as(math.copysign, np.copysign)
def _copysign(self: Calls, x: Any, y: Any) -> Any:
    both = [self.cast(self.wide(each), FLOAT64) for each in (x, y)]
    return self.call_external("llvm.copysign.f64", FLOAT64, both)


@compiled_as(math.ldexp, np.ldexp)
def _ldexp(self: Calls, x: Any, exponent: Any) -> Any:
    x, exponent = self.cast(self.wide(x), FLOAT64), self.integer(exponent, "an exponent")
    exponent = FUNCTIONS[max](self, FUNCTIONS[min](self, exponent, Known(5000)), Known(-5000))
    return self.call_external("ldexp", FLOAT64, [x, self.cast(exponent, INT32)])


@compiled_as(np.spacing)
def _spacing(self: Calls, x: Any) -> Any:
    x = self.cast(self.wide(x), FLOAT64)
    away = _copysign(self, Known(math.inf), x)
    return self.binary(ast.Sub, FUNCTIONS[np.nextafter](self, x, away), x)


@compiled_as(np.sign)
def _sign(self: Calls, x: Any) -> Any:
    x = self.wide(x)
    zero = self.cast(Known(0), x.type)
    one = self.cast(Known(1), x.type)
    up, down = self.text(self.compare(ast.Gt, x, zero)), self.text(self.compare(ast.Lt, x, zero))
    kind = x.type.llvm
    rest = self.text(x) if x.type.is_float else "0"  # NaN stays what it is
    rest = self.choose(self.text(self.compare(ast.Eq, x, zero)), self.text(zero), rest, kind)
    below = self.choose(down, self.text(self.negative(one)), rest, kind)
    return Number(x.type, self.choose(up, self.text(one), below, kind))


@compiled_as(math.isnan, np.isnan)
def _isnan(self: Calls, x: Any) -> Any:
    x = self.wide(x)
    return self.compare(ast.NotEq, x, x)


@compiled_as(math.isinf, np.isinf)
def _isinf(self: Calls, x: Any) -> Any:
    size = _absolute(self, self.cast(self.wide(x), FLOAT64))
    return self.compare(ast.Eq, size, Known(math.inf))


@compiled_as(math.isfinite, np.isfinite)
def _isfinite(self: Calls, x: Any) -> Any:
    size = _absolute(self, self.cast(self.wide(x), FLOAT64))
    return self.compare(ast.Lt, size, Known(math.inf))


def _scaled(factor: float) -> Handler:
    return lambda self, x: self.binary(ast.Mult, self.cast(self.wide(x), FLOAT64), Known(factor))


FUNCTIONS[math.radians] = FUNCTIONS[np.radians] = _scaled(math.pi / 180.0)
FUNCTIONS[math.degrees] = FUNCTIONS[np.degrees] = _scaled(180.0 / math.pi)
FUNCTIONS[np.square] = lambda self, x: self.binary(ast.Mult, x, x)


def _dtype(given: Any) -> np.dtype:
    if given is None:
        return np.dtype(np.float64)
    try:
        return np.dtype(given.value)
    except (TypeError, AttributeError):
        raise Untranslatable("the type of an array must be that of a number") from None


@compiled_as(np.zeros, np.empty)
def _zeros(self: Calls, shape: Any, dtype: Any = None) -> Any:
    return self.local_array(shape, _dtype(dtype), Known(0))


@compiled_as(np.ones)
def _ones(self: Calls, shape: Any, dtype: Any = None) -> Any:
    return self.local_array(shape, _dtype(dtype), Known(1))


@compiled_as(np.full)
def _full(self: Calls, shape: Any, fill: Any, dtype: Any = None) -> Any:
    fill = self.number(fill)
    kind = np.dtype(fill.type.name) if dtype is None else _dtype(dtype)
    return self.local_array(shape, kind, fill)


@compiled_as(np.array)
def _array(self: Calls, values: Any, dtype: Any = None) -> Any:
    given = [self.number(each) for each in several(self, values)]
    names = {each.type.name for each in given}
    kind = np.result_type(*names or {"float64"}) if dtype is None else _dtype(dtype)
    return self.local_array(Known(len(given)), kind, Several(tuple, list(given)))


@compiled_as(np.zeros_like, np.empty_like)
def _zeros_like(self: Calls, array: Any) -> Any:
    if isinstance(array, Lined) or not isinstance(array, Array):
        raise Untranslatable(f"{described(array)} is no array")
    return self.local_array(Several(tuple, list(array.lengths)), array.dtype, Known(0))


@compiled_as(np.copy)
def _copied(self: Calls, array: Any) -> Any:
    return self.call(self.attribute(array, "copy"), [], {})


@compiled_as(np.dtype)
def _a_dtype(self: Calls, given: Any) -> Any:
    return Known(np.dtype(given.value))


_REFUSED = "print open input sorted map filter list dict set str iter next"
for _name in _REFUSED.split():
    FUNCTIONS[getattr(builtins, _name)] = lambda self, *given, _name=_name, **named: _refused(_name)


def _refused(name: str) -> Any:
    raise Untranslatable(f"{name} is not known here")
