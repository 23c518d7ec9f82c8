"""Arrays without reference counts, for the inside of the engine.

Numba counts references to every array it takes out of a tuple: hundreds of atomic operations in a main cycle
that owns nothing. An entry point borrows its arguments once; the caller holds them during the call.
"""

from __future__ import annotations

import hashlib
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import models, register_model

from carom.compiling.intrinsics import compiled_as
from carom.compiling.numba_parts import cgutils


class _Known:
    """A type that is compared and named over and over: it keeps its hash and a short name."""

    name: str
    key: Any

    @property
    def mangling_args(self):
        """Return what the names of functions hold of it."""
        return f"b{hashlib.sha256(self.name.encode()).hexdigest()[:16]}", ()

    def __hash__(self):
        known = self.__dict__
        if "hash" not in known:
            known["hash"] = hash(self.key)
        return known["hash"]

    def __eq__(self, other):
        return self is other or (self.__class__ is other.__class__ and self.key == other.key)

    def __getstate__(self):  # another process hashes otherwise
        return {name: value for name, value in self.__dict__.items() if name != "hash"}


class BorrowedArray(_Known, types.Array):
    """An array that somebody else keeps alive."""

    def __init__(self, owned: types.Array):
        self.owned = owned
        super().__init__(
            owned.dtype,
            owned.ndim,
            owned.layout,
            readonly=not owned.mutable,
            aligned=owned.aligned,
            name=f"borrowed({owned.name})",
        )

    def copy(self, *args: Any, **changes: Any) -> BorrowedArray:  # type: ignore[override]
        """Return the type of a view, borrowed as well."""
        return BorrowedArray(self.owned.copy(*args, **changes))


class BorrowedTuple(_Known, types.NamedTuple):
    """A model with nothing inside that is counted."""


class BorrowedUniTuple(_Known, types.NamedUniTuple):
    """The same, of parts of one type."""


class _Whole:
    """Layout of what Numba need not take apart, for reference counts or to hand it to an inlined function."""

    def traverse(self, builder):
        """Return the members in which there may be something to count: none."""
        return []

    def get_argument_type(self):
        """Return the type of a value as it is handed over."""
        return self.get_value_type()  # type: ignore[attr-defined]  # of the model that this is mixed into

    def as_argument(self, builder, value):
        """Return what is handed over."""
        return value

    def from_argument(self, builder, value):
        """Return the value handed over."""
        return value


@register_model(BorrowedTuple)
class _TupleModel(_Whole, models.TupleModel):
    """The layout of a tuple."""


@register_model(BorrowedUniTuple)
class _UniTupleModel(_Whole, models.UniTupleModel):
    """The layout of a tuple of parts of one type."""


@register_model(BorrowedArray)
class _ArrayModel(_Whole, models.StructModel):
    """The layout of an array, with a plain pointer where the reference count was."""

    def __init__(self, manager, kind):
        members = [
            ("meminfo", types.voidptr),
            ("parent", types.voidptr),
            ("nitems", types.intp),
            ("itemsize", types.intp),
            ("data", types.CPointer(kind.dtype)),
            ("shape", types.UniTuple(types.intp, kind.ndim)),
            ("strides", types.UniTuple(types.intp, kind.ndim)),
        ]
        super().__init__(manager, kind, members)


def _borrowed_type(kind):
    if isinstance(kind, types.Array):
        return BorrowedArray(kind)
    if isinstance(kind, types.NamedTuple):
        return BorrowedTuple([_borrowed_type(part) for part in kind.types], kind.instance_class)
    if isinstance(kind, types.NamedUniTuple):
        part = _borrowed_type(kind.dtype)
        return BorrowedUniTuple(part, kind.count, kind.instance_class)
    if isinstance(kind, types.BaseAnonymousTuple):
        return types.Tuple([_borrowed_type(part) for part in kind])  # type: ignore[attr-defined]
    return kind


def _convert(context, builder, source, target, value):
    if source == target:
        context.nrt.incref(builder, source, value)  # the caller counts down what it is given back
        return value
    if isinstance(source, types.Array):
        owned = cgutils.create_struct_proxy(source)(context, builder, value)
        lent = cgutils.create_struct_proxy(target)(context, builder)
        for field in ("nitems", "itemsize", "data", "shape", "strides"):
            setattr(lent, field, getattr(owned, field))
        null = ir.Constant(context.get_value_type(types.voidptr), None)
        lent.meminfo = null
        lent.parent = null
        return lent._getvalue()
    parts = cgutils.unpack_tuple(builder, value, len(source))
    lent = [_convert(context, builder, a, b, part) for a, b, part in zip(source, target, parts, strict=True)]
    return context.make_tuple(builder, target, lent)


def borrowed(value):
    """Return an array, or a tuple of models and arrays, without reference counts (compiled code only)."""
    return value


@compiled_as(borrowed)
def _borrow(typingctx, value):
    target = _borrowed_type(value)

    def codegen(context, builder, signature, args):
        return _convert(context, builder, value, target, args[0])

    return target(value), codegen
