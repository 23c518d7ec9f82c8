"""Functions in plain Python for which compiled code takes instructions of its own.

Memory is asked for before it is needed, by one request to the processor. Of numbers that several threads read
and write each access is whole, and in order with those before it.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from carom.compiling.arrays import element_type
from carom.compiling.calls import Calls
from carom.compiling.functions import compiled_as
from carom.compiling.language import FLOAT64, INT32, INT64, NONE, Array, Number

FIRST_LEVEL, SECOND_LEVEL = 3, 2
"""The caches, as LLVM counts them: how soon something is needed."""

MOST_AXES = 16  # for which there is room in a place


def prefetch(array, index):
    """Ask for the cache line of an element of a contiguous array; nothing without compilation."""


def prefetch_now(array, index):
    """Do so into the first-level cache: for what the next event needs."""


def _request(level: int) -> Any:
    def request(self: Calls, array: Any, index: Any) -> Any:
        address = self.element(array, self.integer(index, "an index"))
        self.module.declare("prefetch", "declare void @llvm.prefetch.p0(ptr, i32, i32, i32)")
        self.emit(f"call void @llvm.prefetch.p0(ptr {address}, i32 0, i32 {level}, i32 1)")
        return NONE

    return request


compiled_as(prefetch)(_request(SECOND_LEVEL))
compiled_as(prefetch_now)(_request(FIRST_LEVEL))


def load(array, index):
    """Return an element of a contiguous array of 64-bit numbers, and see all that was written before it."""
    return array[index]


def store(array, index, value):
    """Write an element of a contiguous array of 64-bit numbers, after all that this thread wrote before."""
    array[index] = value


def take(array, index):
    """Set an element of a contiguous array of int64 to 1, and return what it was."""
    before = array[index]
    array[index] = 1
    return before


def yield_thread():
    """Let another thread have the core, if one waits for it; nothing where the system has no such call."""
    return


@compiled_as(load)
def _load(self: Calls, array: Any, index: Any) -> Any:
    kind, address = element_type(array.dtype), self.element(array, self.integer(index, "an index"))
    bits = self.op(f"load atomic i64, ptr {address} acquire, align 8")
    return Number(kind, self.op(f"bitcast i64 {bits} to double") if kind.is_float else bits)


@compiled_as(store)
def _store(self: Calls, array: Any, index: Any, value: Any) -> Any:
    kind, address = element_type(array.dtype), self.element(array, self.integer(index, "an index"))
    bits = self.text(self.cast(value, kind))
    if kind.is_float:
        bits = self.op(f"bitcast double {bits} to i64")
    self.emit(f"store atomic i64 {bits}, ptr {address} release, align 8")
    return NONE


@compiled_as(take)
def _take(self: Calls, array: Any, index: Any) -> Any:
    address = self.element(array, self.integer(index, "an index"))
    return Number(INT64, self.op(f"atomicrmw xchg ptr {address}, i64 1 acq_rel, align 8"))


@compiled_as(yield_thread)
def _yield_thread(self: Calls) -> Any:
    if hasattr(os, "sched_yield"):
        self.call_external("sched_yield", INT32, [])
    return NONE


def room_for(x):
    """Return room on the caller's stack for a place like x, (d,) float64."""
    return np.zeros(len(x))


@compiled_as(room_for)
def _room_for(self: Calls, x: Any) -> Any:
    room = self.alloca(f"[{MOST_AXES} x {FLOAT64.llvm}]", 64)
    return Array(np.dtype(np.float64), room, [self.get(each) for each in x.lengths])
