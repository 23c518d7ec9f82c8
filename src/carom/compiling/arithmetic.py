"""Instructions about numbers: what an operation means, and the text of LLVM that says so."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.compiling.faults import Untranslatable
from carom.compiling.language import (
    BOOL,
    FLOAT32,
    FLOAT64,
    INT64,
    POINTER,
    UINT64,
    Array,
    Known,
    Leaf,
    Lined,
    Number,
    Record,
    Several,
    Slot,
    Type,
    described,
    wrapped,
)

if TYPE_CHECKING:
    from carom.compiling.module import Module

SYMBOLS: dict[type, tuple[str, Callable[[Any, Any], Any], str, str]] = {
    ast.Add: ("+", operator.add, "fadd", "add"),
    ast.Sub: ("-", operator.sub, "fsub", "sub"),
    ast.Mult: ("*", operator.mul, "fmul", "mul"),
    ast.Div: ("/", operator.truediv, "fdiv", ""),
    ast.FloorDiv: ("//", operator.floordiv, "", ""),
    ast.Mod: ("%", operator.mod, "", ""),
    ast.Pow: ("**", operator.pow, "", ""),
    ast.LShift: ("<<", operator.lshift, "", "shl"),
    ast.RShift: (">>", operator.rshift, "", ""),
    ast.BitAnd: ("&", operator.and_, "", "and"),
    ast.BitOr: ("|", operator.or_, "", "or"),
    ast.BitXor: ("^", operator.xor, "", "xor"),
}
"""Operations: how they are written, what they are in Python, the instructions for floats and integers."""

COMPARED: dict[type, tuple[Callable[[Any, Any], Any], str, str]] = {
    ast.Lt: (operator.lt, "olt", "lt"),
    ast.LtE: (operator.le, "ole", "le"),
    ast.Gt: (operator.gt, "ogt", "gt"),
    ast.GtE: (operator.ge, "oge", "ge"),
    ast.Eq: (operator.eq, "oeq", "eq"),
    ast.NotEq: (operator.ne, "une", "ne"),
}

MOST_MULTIPLICATIONS = 64  # of a power whose exponent is known


class Arithmetic:
    """The text of one function of LLVM, and what adds to it."""

    def __init__(self, module: Module, name: str):
        self.module, self.name = module, name
        self.body: list[Any] = []  # lines, and lists of lines that may still grow
        self.entry: list[str] = []  # lines at the function's beginning
        self.count = 0
        self.leaves: dict[int, str] = {}
        self.block, self.dead = "start", False
        self.targets: set[str] = set()  # blocks to which something jumps
        self.flags = ""  # what may be done to floats, as LLVM writes it
        self.careful = False  # whether the function at hand is the user's
        self.faulty = False  # whether something in here may fail
        self.open_loops = 0  # loops around the statement at hand, and those around the function at hand
        self.loops_outside = 0

    # Text.

    def fresh(self) -> str:
        """Return a new name for a number."""
        self.count += 1
        return f"%v{self.count}"

    def label(self) -> str:
        """Return a new name for a block."""
        self.count += 1
        return f"b{self.count}"

    def emit(self, line: str) -> None:
        """Add a line."""
        self.body.append("  " + line)

    def op(self, line: str) -> str:
        """Add an instruction that gives something, and return its name."""
        name = self.fresh()
        self.body.append(f"  {name} = {line}")
        return name

    def start(self, label: str) -> None:
        """Begin a block."""
        self.body.append(f"{label}:")
        self.block, self.dead = label, False

    def jump(self, label: str) -> None:
        """End a block that has not ended."""
        if not self.dead:
            self.targets.add(label)
            self.emit(f"br label %{label}")
            self.dead = True

    def branch(self, condition: str, yes: str, no: str) -> None:
        """End a block in one of two ways."""
        self.targets |= {yes, no}
        self.emit(f"br i1 {condition}, label %{yes}, label %{no}")
        self.dead = True

    def alloca(self, llvm: str, align: int = 0) -> str:
        """Return the address of room on the stack."""
        name = self.fresh()
        self.entry.append(f"  {name} = alloca {llvm}" + (f", align {align}" if align else ""))
        return name

    def leaf(self, leaf: Leaf) -> str:
        """Return the name of a word of the context, read once at the function's beginning."""
        name = self.leaves.get(leaf.place)
        if name is None:
            body, self.body = self.body, self.entry
            name = self.word(leaf.type, self.op(f"getelementptr i64, ptr %context, i64 {leaf.place}")).text
            self.body = body
            self.leaves[leaf.place] = name
        return name

    def word(self, kind: Type, address: str) -> Number:
        """Return a word of the context."""
        llvm = kind.llvm if kind.bits == 64 else "double" if kind.is_float else "i64"
        text = self.op(f"load {llvm}, ptr {address}, align 8, !invariant.load !0")
        if kind.bits < 64:
            text = self.op(f"{'fptrunc' if kind.is_float else 'trunc'} {llvm} {text} to {kind.llvm}")
        return Number(kind, text)

    def place(self, address: Any) -> str:
        """Return the text of an address."""
        if isinstance(address, Leaf):
            return self.leaf(address)
        return self.op(f"load ptr, ptr {address.address}") if isinstance(address, Slot) else address

    def get(self, value: Any) -> Any:
        """Return a value as it is now: what lies in slots and in the context is read."""
        if isinstance(value, Slot):
            return Number(value.type, self.op(f"load {value.type.llvm}, ptr {value.address}"))
        if isinstance(value, Leaf):
            return Number(value.type, self.leaf(value))
        if isinstance(value, Several) and any(_has_slots(each) for each in value.items):
            return Several(value.cls, [self.get(each) for each in value.items])
        if isinstance(value, Array) and (
            isinstance(value.data, Slot) or any(isinstance(each, Slot) for each in value.lengths)
        ):
            data = self.place(value.data) if isinstance(value.data, Slot) else value.data
            return value._replace(data=data, lengths=[self.get(each) for each in value.lengths])
        if isinstance(value, Record) and isinstance(value.address, Slot):
            return Record(value.dtype, self.place(value.address))
        return value

    # Numbers.

    def number(self, value: Any) -> Any:
        """Return a value that must be a number."""
        value = self.get(value)
        if not isinstance(value, Known | Number) or value.type is None or value.type is POINTER:
            loop = ": write a loop over its elements" if isinstance(value, Array | Lined) else ""
            raise Untranslatable(f"a number is expected here, found {described(value)}{loop}")
        return value

    def text(self, value: Any) -> str:
        """Return the text of a number."""
        if isinstance(value, Leaf):
            return self.leaf(value)
        if isinstance(value, Number):
            return value.text
        given, kind = value.value, value.type
        if kind.is_float:
            exact = np.float64(given if kind is FLOAT64 else np.float32(given))
            return f"0x{exact.view(np.uint64):016X}"
        if kind is BOOL:
            return "true" if given else "false"
        if kind is INT64 and abs(given) >> 63 and given != -(1 << 63):
            raise Untranslatable(f"{given} does not fit in 64 bits")
        return str(wrapped(int(given), kind, signed=True))

    def cast(self, value: Any, target: Type) -> Any:
        """Return a number as one of another type."""
        value = self.number(value)
        source = value.type
        if source is target:
            return value
        if target is BOOL:
            return self.truth(value)
        if isinstance(value, Known):
            if target.is_float:
                return Known(float(value.value if target is FLOAT64 else np.float32(value.value)), target)
            if source.is_float and not abs(value.value) < 2.0**63:
                raise Untranslatable(f"{value.value} is no {target}")
            return Known(wrapped(int(value.value), target), target)
        text = self.text(value)
        if source.is_float and target.is_float:
            how = "fpext" if target.bits > source.bits else "fptrunc"
        elif target.is_float:
            how = "sitofp" if source.signed else "uitofp"
        elif source.is_float:
            return self._whole(text, source, target)
        elif source.bits == target.bits:
            return Number(target, text, value.natural if isinstance(value, Number) else False)
        else:
            how = "trunc" if source.bits > target.bits else "sext" if source.signed else "zext"
        natural = how == "zext" or (how == "sext" and isinstance(value, Number) and value.natural)
        return Number(target, self.op(f"{how} {source.llvm} {text} to {target.llvm}"), natural)

    def _whole(self, text: str, source: Type, target: Type) -> Number:
        """Return a float without its fraction. In functions of the user's all floats have an answer."""
        how = "s" if target.signed else "u"
        if not self.careful:
            return Number(target, self.op(f"fpto{how}i {source.llvm} {text} to {target.llvm}"))
        name = f"llvm.fpto{how}i.sat.i{target.bits}.f{source.bits}"
        return self.call_external(name, target, [Number(source, text)])

    def call_external(self, name: str, result: Type, arguments: list[Any], flags: str = "") -> Number:
        """Return the result of an intrinsic of LLVM, or of a function of the C library."""
        kinds = ", ".join(each.type.llvm for each in arguments)
        self.module.declare(name, f"declare {result.llvm} @{name}({kinds}) nounwind")
        given = ", ".join(f"{each.type.llvm} {self.text(each)}" for each in arguments)
        return Number(result, self.op(f"call {flags}{result.llvm} @{name}({given})"))

    def truth(self, value: Any) -> Any:
        """Return a value as a bool."""
        value = self.get(value)
        if isinstance(value, Known):
            return Known(bool(value.value), BOOL)
        if isinstance(value, Several):
            return Known(len(value.items) > 0, BOOL)
        if isinstance(value, Array | Record | Lined):
            raise Untranslatable("the truth of an array has no meaning here: compare its elements")
        if value.type is BOOL:
            return value
        compare = "fcmp une" if value.type.is_float else "icmp ne"
        zero = "0.0" if value.type.is_float else "0"
        return Number(BOOL, self.op(f"{compare} {value.type.llvm} {value.text}, {zero}"))

    def wide(self, value: Any) -> Any:
        """Return a number as arithmetic takes it: integers have 64 bits, and a sign if they had fewer."""
        value = self.number(value)
        if value.type.is_float:
            return value
        return self.cast(value, UINT64 if value.type is UINT64 else INT64)

    def integer(self, value: Any, what: str) -> Any:
        """Return an integer of 64 bits; Untranslatable of a float."""
        value = self.number(value)
        if value.type.is_float:
            raise Untranslatable(f"{what} must be an integer, found a {value.type}: write int(...)")
        return self.wide(value)

    def common(self, a: Any, b: Any) -> tuple[Any, Any, Type]:
        """Return two numbers as numbers of the type in which they are computed, and that type."""
        if a.type is FLOAT32 and b.type is FLOAT32:
            return a, b, FLOAT32
        a, b = self.wide(a), self.wide(b)
        if a.type.is_float or b.type.is_float:
            kind = FLOAT64
        else:
            kind = INT64 if a.type.signed or b.type.signed else UINT64
        return self.cast(a, kind), self.cast(b, kind), kind

    def choose(self, condition: str, yes: str, no: str, llvm: str = "i64") -> str:
        """Return one of two numbers."""
        return self.op(f"select i1 {condition}, {llvm} {yes}, {llvm} {no}")

    def binary(self, kind: type, a: Any, b: Any) -> Any:
        """Return the result of an operation of two values."""
        a, b = self.get(a), self.get(b)
        if isinstance(a, Several) and isinstance(b, Several) and kind is ast.Add:
            return Several(tuple, a.items + b.items)
        if kind not in SYMBOLS:
            raise Untranslatable("this operator is not known here")
        a, b = self.number(a), self.number(b)
        sign, fold, float_name, int_name = SYMBOLS[kind]
        if isinstance(a, Known) and isinstance(b, Known) and FLOAT32 not in (a.type, b.type):
            folded = self._folded(kind, fold, a, b)
            if folded is not None:
                return folded
        bits = kind in (ast.BitAnd, ast.BitOr, ast.BitXor)
        if bits and a.type is BOOL and b.type is BOOL:
            return Number(BOOL, self.op(f"{int_name} i1 {self.text(a)}, {self.text(b)}"))
        if kind is ast.Pow:
            return self._power(a, b)
        if kind is ast.Div and not (a.type is FLOAT32 and b.type is FLOAT32):
            a, b, both = self.cast(self.wide(a), FLOAT64), self.cast(self.wide(b), FLOAT64), FLOAT64
        else:
            a, b, both = self.common(a, b)
        x, y = self.text(a), self.text(b)
        if both.is_float:
            if float_name:
                return Number(both, self.op(f"{float_name} {self.flags}{both.llvm} {x}, {y}"))
            if kind in (ast.FloorDiv, ast.Mod):
                return self._floored(kind, self.cast(a, FLOAT64), self.cast(b, FLOAT64))
            raise Untranslatable(f"{sign} needs integers, found a {both}: write int(...)")
        if kind in (ast.FloorDiv, ast.Mod):
            return self._divided(kind, both, x, y, b, both.signed and not (_is_natural(a) and _is_natural(b)))
        if kind in (ast.LShift, ast.RShift):
            return self._shifted(kind, both, x, y, b)
        natural = both is INT64 and kind in (ast.Add, ast.Mult) and _is_natural(a) and _is_natural(b)
        return Number(both, self.op(f"{int_name} i64 {x}, {y}"), natural)

    def _folded(self, kind: type, fold: Any, a: Known, b: Known) -> Known | None:
        """Return the result of two known numbers; None where Python has none, or one that is too long."""
        if (
            kind in (ast.LShift, ast.Pow)
            and not (a.type.is_float or b.type.is_float)
            and b.value not in range(64)
        ):
            return None
        try:
            value = fold(a.value, b.value)
        except (ArithmeticError, ValueError):
            return None
        except TypeError:
            raise Untranslatable(f"{SYMBOLS[kind][0]} needs integers: write int(...)") from None
        if isinstance(value, complex):
            return None
        if isinstance(value, bool | float):
            return Known(value)
        if a.type.signed or b.type.signed or BOOL in (a.type, b.type):
            return Known(value, INT64)  # exact as in Python, until it is written somewhere
        return Known(wrapped(value, UINT64), UINT64)

    def _divided(self, kind: type, both: Type, x: str, y: str, divisor: Any, signed: bool) -> Number:
        """Return the floor of a quotient of integers, or what is left; 0 if the divisor is."""
        known = isinstance(divisor, Known) and divisor.value not in (0, -1)
        zero = None
        if not known:
            zero = self.op(f"icmp eq i64 {y}, 0")
            y = self.choose(zero, "1", y)
        if not signed:
            found = self.op(f"{'udiv' if kind is ast.FloorDiv else 'urem'} i64 {x}, {y}")
        else:
            negative, dividend = None, x
            if not known:  # the least number over -1 has no quotient: the processor would end the process
                negative = self.op(f"icmp eq i64 {y}, -1")
                y = self.choose(negative, "1", y)
            rest = self.op(f"srem i64 {x}, {y}")
            crossed = self.op(f"icmp slt i64 {self.op(f'xor i64 {rest}, {y}')}, 0")
            floored = self.op(f"and i1 {self.op(f'icmp ne i64 {rest}, 0')}, {crossed}")
            if kind is ast.FloorDiv:
                quotient = self.op(f"sdiv i64 {x}, {y}")
                found = self.op(f"add i64 {quotient}, {self.op(f'sext i1 {floored} to i64')}")
                if negative is not None:
                    found = self.choose(negative, self.op(f"sub i64 0, {dividend}"), found)
            else:
                found = self.op(f"add i64 {rest}, {self.choose(floored, y, '0')}")
        if zero is not None:
            found = self.choose(zero, "0", found)
        return Number(both, found)

    def _shifted(self, kind: type, both: Type, x: str, y: str, by: Any) -> Number:
        """Return a shifted integer. In the user's functions one shifted by 64 or more is all shifted out."""
        name = "shl" if kind is ast.LShift else "ashr" if both.signed else "lshr"
        if isinstance(by, Known):
            if by.value not in range(64):
                raise Untranslatable(f"a shift by {by.value}: integers have 64 bits here")
        elif self.careful:
            out = self.op(f"icmp ugt i64 {y}, 63")
            shifted = self.op(f"{name} i64 {x}, {self.choose(out, '63', y)}")
            return Number(both, shifted if name == "ashr" else self.choose(out, "0", shifted))
        return Number(both, self.op(f"{name} i64 {x}, {y}"))

    def _floored(self, kind: type, a: Any, b: Any) -> Number:
        """Return the floor of a quotient of floats, or what is left, as Python computes them."""
        x, y = self.text(a), self.text(b)
        rest = self.op(f"frem double {x}, {y}")
        crossed = self.op(
            f"xor i1 {self.op(f'fcmp olt double {y}, 0.0')}, {self.op(f'fcmp olt double {rest}, 0.0')}"
        )
        nonzero = self.op(f"fcmp une double {rest}, 0.0")
        moved = self.op(f"and i1 {nonzero}, {crossed}")
        signed_zero = self.call_external("llvm.copysign.f64", FLOAT64, [Known(0.0), Number(FLOAT64, y)]).text
        up = self.choose(moved, self.op(f"fadd double {rest}, {y}"), rest, "double")
        if kind is ast.Mod:
            return Number(FLOAT64, self.choose(nonzero, up, signed_zero, "double"))
        quotient = self.op(f"fdiv double {self.op(f'fsub double {x}, {rest}')}, {y}")
        quotient = self.choose(moved, self.op(f"fsub double {quotient}, 1.0"), quotient, "double")
        floor = self.call_external("llvm.floor.f64", FLOAT64, [Number(FLOAT64, quotient)]).text
        above = self.op(f"fcmp ogt double {self.op(f'fsub double {quotient}, {floor}')}, 5.0e-1")
        floor = self.choose(above, self.op(f"fadd double {floor}, 1.0"), floor, "double")
        ratio = Number(FLOAT64, self.op(f"fdiv double {x}, {y}"))
        zero = self.call_external("llvm.copysign.f64", FLOAT64, [Known(0.0), ratio]).text
        found = self.choose(self.op(f"fcmp une double {quotient}, 0.0"), floor, zero, "double")
        infinite = self.op(f"fcmp oeq double {y}, 0.0")
        return Number(FLOAT64, self.choose(infinite, ratio.text, found, "double"))

    def _power(self, a: Any, b: Any) -> Any:
        """Return a power: products where the exponent is a known whole number, else that of the C library."""
        a = self.wide(a)
        if isinstance(b, Known) and b.type is INT64 and b.value == 0:
            return self.cast(Known(1), a.type)
        if isinstance(b, Known) and float(b.value).is_integer() and 0 < abs(b.value) < MOST_MULTIPLICATIONS:
            if b.value < 0 or b.type.is_float:
                a = a if a.type.is_float else self.cast(a, FLOAT64)
            left, factor, product = int(abs(b.value)), a, None
            while left:
                if left & 1:
                    product = factor if product is None else self.binary(ast.Mult, product, factor)
                left >>= 1
                if left:
                    factor = self.binary(ast.Mult, factor, factor)
            return product if b.value > 0 else self.binary(ast.Div, Known(1.0), product)
        if not (a.type.is_float or b.type.is_float):
            raise Untranslatable(
                "a power of integers needs a float, or a known exponent: write float(...) ** ..."
            )
        x, y = self.cast(a, FLOAT64), self.cast(self.wide(b), FLOAT64)
        return self.call_external("llvm.pow.f64", FLOAT64, [x, y])

    def compare(self, kind: type, a: Any, b: Any) -> Any:
        """Return what a comparison of two values gives."""
        a, b = self.get(a), self.get(b)
        if kind in (ast.Is, ast.IsNot):
            if not any(isinstance(each, Known) and each.type is None for each in (a, b)):
                raise Untranslatable("is compares with None or a class here: write ==")
            one, other = (each.value if isinstance(each, Known) else each for each in (a, b))
            return Known((one is other) is (kind is ast.Is))
        if kind not in COMPARED:
            raise Untranslatable("in is not known here: compare with each")
        fold, float_name, int_name = COMPARED[kind]
        if isinstance(a, Known) and isinstance(b, Known):
            return Known(bool(fold(a.value, b.value)))
        a, b = self.number(a), self.number(b)
        if a.type is BOOL and b.type is BOOL and int_name in ("eq", "ne"):
            both = BOOL
        else:
            a, b, both = self.common(a, b)
        x, y = self.text(a), self.text(b)
        if both.is_float:
            return Number(BOOL, self.op(f"fcmp {self.flags}{float_name} {both.llvm} {x}, {y}"))
        sign = "" if int_name in ("eq", "ne") else "s" if both.signed else "u"
        return Number(BOOL, self.op(f"icmp {sign}{int_name} {both.llvm} {x}, {y}"))

    def negative(self, value: Any) -> Any:
        """Return a number with the other sign."""
        value = self.wide(value)
        if isinstance(value, Known):
            if value.type.is_float:
                return Known(-value.value, value.type)
            return Known(-value.value, INT64)
        if value.type.is_float:
            return Number(value.type, self.op(f"fneg {self.flags}{value.type.llvm} {value.text}"))
        return self.binary(ast.Sub, Known(0), value)

    def inverted(self, value: Any) -> Any:
        """Return an integer with all its bits changed."""
        value = self.number(value)
        if value.type.is_float:
            raise Untranslatable("~ needs an integer: write int(...)")
        if value.type is BOOL:
            raise Untranslatable("~ of a bool is not known here: write not")
        value = self.wide(value)
        if isinstance(value, Known):
            return Known(wrapped(~value.value, value.type), value.type)
        return Number(value.type, self.op(f"xor i64 {value.text}, -1"))

    def viewed(self, value: Any, target: Type) -> Any:
        """Return the bits of a number as a number of another type."""
        value = self.number(value)
        if value.type.bits != target.bits or BOOL in (value.type, target):
            raise Untranslatable(f"the bits of a {value.type} are no {target}")
        if isinstance(value, Known):
            given = np.array([value.value], value.type.name).view(target.name)[0]
            return Known(given.item(), target)
        if value.type.is_float == target.is_float:
            return Number(target, value.text)
        return Number(target, self.op(f"bitcast {value.type.llvm} {value.text} to {target.llvm}"))


def _has_slots(value: Any) -> bool:
    if isinstance(value, Slot):
        return True
    if isinstance(value, Several):
        return any(_has_slots(each) for each in value.items)
    if isinstance(value, Array):
        return isinstance(value.data, Slot) or any(isinstance(each, Slot) for each in value.lengths)
    return isinstance(value, Record) and isinstance(value.address, Slot)


def _is_natural(value: Any) -> bool:
    return value.natural if isinstance(value, Number) else value.value >= 0
