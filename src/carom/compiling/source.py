"""The syntax trees of functions, and what is known of a function from its tree."""

from __future__ import annotations

import ast
import linecache
import os
import sys
import time
import types
from contextlib import suppress
from typing import Any

from carom.compiling import registry
from carom.compiling.faults import Untranslatable

_trees: dict[str, tuple[str, dict[tuple[str, int], Any]]] = {}
_plans: dict[Any, Plan] = {}

_BEGAN = time.time()


def lines_of(path: str) -> str:
    """Return the text of a file, a cell of a notebook, or of ``python -c``; empty where nobody has it."""
    text = "".join(linecache.getlines(path))
    given = getattr(sys, "orig_argv", [])
    if not text and path == "<string>" and "-c" in given[:-1]:
        text = given[given.index("-c") + 1]
    return text


def _is_current(code: types.CodeType, text: str) -> bool:
    """Tell whether a file that was edited since this process began still says what it imported of it."""
    with suppress(OSError):
        if code.co_filename != "<string>" and os.stat(code.co_filename).st_mtime < _BEGAN:
            return True
        waiting = [compile(text, code.co_filename, "exec", dont_inherit=True)]
        while waiting:
            each = waiting.pop()
            if each == code:
                return True
            waiting += [part for part in each.co_consts if isinstance(part, types.CodeType)]
        return False
    return True  # no file: a cell


def tree_of(code: types.CodeType) -> Any:
    """Return the syntax tree of a function from its code, or None where its source is not to be had."""
    linecache.checkcache(code.co_filename)
    text = lines_of(code.co_filename)
    if not _is_current(code, text):
        return None
    known, found = _trees.get(code.co_filename, ("", {}))
    if known != text:
        found = {}
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                for line in (node.lineno, *(each.lineno for each in node.decorator_list)):
                    found[node.name, line] = node
            elif isinstance(node, ast.Lambda):
                key = ("<lambda>", node.lineno)
                found[key] = None if key in found else node  # which of two in one line is not known
        _trees[code.co_filename] = text, found
    return found.get((code.co_name, code.co_firstlineno))


class Plan:
    """A function, its tree and its names."""

    def __init__(self, function: types.FunctionType):
        code = function.__code__
        self.function, self.path = function, code.co_filename
        node = tree_of(code)
        if node is None:
            raise Untranslatable(
                f"the source of {function.__qualname__} is not to be had, has two lambdas in a line, or was "
                "edited since: write it in a file or a notebook, and start again",
                function,
            )
        given = node.args
        if given.kwonlyargs or given.kwarg or given.posonlyargs:
            raise Untranslatable("only plain parameters are known here", function).at(
                function, self.path, node.lineno
            )
        self.body = (
            node.body if isinstance(node, ast.FunctionDef) else [ast.copy_location(_returned(node), node)]
        )
        self.names = [each.arg for each in given.args]
        self.rest = given.vararg.arg if given.vararg else None
        self.defaults = function.__defaults__ or ()
        self.cells = dict(zip(code.co_freevars, function.__closure__ or (), strict=True))
        self.foreign = not registry.is_ours(function.__globals__.get("__name__"))
        self.assigned: dict[str, int] = {}
        for each in self.body:
            self._count(each, 1)
        self.counters = self._counters()

    def _count(self, node: ast.AST, weight: int) -> None:
        """Count the assignments to names; one in a loop counts twice, as does one that adds."""
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            self.assigned[node.id] = self.assigned.get(node.id, 0) + weight
        if isinstance(node, ast.AugAssign):
            weight = 2
        for name, field in ast.iter_fields(node):
            inside = 2 if isinstance(node, ast.For | ast.While) and name in ("body", "orelse") else weight
            for each in field if isinstance(field, list) else (field,):
                if isinstance(each, ast.AST):
                    self._count(each, inside)

    def _counters(self) -> set[str]:
        """Return the names that loops alone give a value, and that are read within these loops alone."""
        written: dict[str, int] = {}
        read: set[str] = set()

        def visit(node: ast.AST, around: frozenset[str]) -> None:
            if isinstance(node, ast.Name):
                if isinstance(node.ctx, ast.Store):
                    written[node.id] = written.get(node.id, 0) + 1
                elif node.id not in around:
                    read.add(node.id)
            inside = around
            if isinstance(node, ast.For):
                names = {each.id for each in ast.walk(node.target) if isinstance(each, ast.Name)}
                inside = around | names
                for name in names:
                    written[name] = written.get(name, 0) - 1
            for name, field in ast.iter_fields(node):
                for each in field if isinstance(field, list) else (field,):
                    if isinstance(each, ast.AST):
                        visit(each, inside if name in ("body", "target") else around)

        for each in self.body:
            visit(each, frozenset())
        return {name for name, count in written.items() if count == 0} - read - set(self.names)

    def lookup(self, name: str) -> Any:
        """Return what a name that is not local stands for."""
        if name in self.cells:
            return self.cells[name].cell_contents
        scope = self.function.__globals__
        if name in scope:
            return scope[name]
        builtins = scope["__builtins__"]
        known = builtins if isinstance(builtins, dict) else vars(builtins)
        if name in known:
            return known[name]
        raise Untranslatable(f"nothing here is named {name}")


def _returned(node: ast.Lambda) -> ast.Return:
    return ast.Return(node.body)


def plan_of(function: Any) -> Plan:
    """Return the plan of a function, made once."""
    plan = _plans.get(function)
    if plan is None:
        plan = _plans[function] = Plan(function)
    return plan
