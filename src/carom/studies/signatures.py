"""The signature and the docstring of a function that takes the fields of a specification."""

from __future__ import annotations

import functools
import inspect
import re
import textwrap
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from typing import Any, TypeVar, get_args, get_origin

from carom.declared import SpecField, fields_of
from carom.scene.keywords import ELSEWHERE
from carom.spec import Spec
from carom.studies.study import Study
from carom.suggestions import refuse_unknown

R = TypeVar("R")

WIDTH = 106
"""Letters of a line of a docstring."""

HOW = ("executor", "cores", "out", "progress", "look")
"""Arguments of :meth:`carom.studies.study.Study.run`."""

HOW_TEXT = inspect.getdoc(Study.run) or ""


def documented(
    kind: type[Study[Any]] | type[Spec], *, hidden: Container[str] = (), **said: str
) -> Callable[[Callable[..., R]], Callable[..., R]]:
    """Return a decorator of a function ``f(..., **given)`` whose ``given`` are the fields of a spec.

    Signature and docstring then name them, but for those ``hidden``, with ``@`` for their description; of a
    study also the arguments of :meth:`Study.run`, as ``how``, and what is ``said`` of others.
    """
    spec: type[Spec] = kind if issubclass(kind, Spec) else kind.Spec
    run = {} if issubclass(kind, Spec) else dict(inspect.signature(Study.run).parameters)

    def decorate(function: Callable[..., R]) -> Callable[..., R]:
        fields = fields_of(spec)
        own = [
            p for p in inspect.signature(function).parameters.values()
            if p.kind is not p.VAR_KEYWORD and p.name != "how"
        ]  # fmt: skip
        taken = {p.name for p in own}
        keyword = inspect.Parameter.KEYWORD_ONLY
        more = [
            inspect.Parameter(name, keyword, default=None, annotation=_optional(field.kind))
            for name, field in fields.items()
            if name not in taken and name not in hidden
        ]
        how = [run[name] for name in HOW if name in run and name != "look"]
        known = (*taken, *fields, *(HOW if run else ()))

        def _lines(parameters: Iterable[inspect.Parameter]) -> str:
            return "\n".join(
                f"{p.name} : {_type(p.annotation, p.default is p.empty)}\n"
                + textwrap.fill(said.get(p.name) or _said(fields[p.name]), WIDTH, initial_indent="    ",
                                subsequent_indent="    ")
                for p in parameters
            )  # fmt: skip

        @functools.wraps(function)
        def called(*arguments: Any, **given: Any) -> R:
            refuse_unknown(f"{function.__name__}()", given, known, elsewhere=ELSEWHERE)
            ways = {"how": {name: given.pop(name) for name in HOW if name in given}} if run else {}
            given = {k: v for k, v in given.items() if v is not None}
            return function(*arguments, **ways, **given)

        head, _, rest = (inspect.getdoc(function) or "").partition("@\n")
        if run:
            parameters, _, ends = HOW_TEXT.partition("----------\n")[2].partition("\n\n")
            parameters = parameters.partition("\nlook : ")[0]  # the last one
            # Sections in the order of numpydoc: what is returned, raised and warned, then notes and examples.
            returns, mark, notes = rest.partition("\nNotes\n" if "\nNotes\n" in rest else "\nExamples\n")
            called.__doc__ = "\n".join(
                [
                    head + "Parameters", "----------", _lines((*own, *more)), parameters,
                    "", returns.rstrip(), "", ends.rstrip(), mark + notes.rstrip(), "",
                ]
            )  # fmt: skip
            order = [*own, *more, *how]
        else:
            called.__doc__ = f"{head}{_lines(more)}\n{rest}"
            order = sorted([*own, *more], key=lambda p: (p.kind, p not in more))
        called.__signature__ = inspect.Signature(order)  # type: ignore[attr-defined]
        return called

    return decorate


def _said(field: SpecField) -> str:
    """Return what a field is, and its default."""
    assert field.opt is not None
    default = field.default
    if default in (None, (), "auto") or isinstance(default, Mapping) or field.needed:
        return field.opt.help
    if isinstance(default, bool):
        return f"{field.opt.help} {default} if left out."
    shown = ", ".join(map(str, default)) if isinstance(default, tuple) else f"{default:g}"
    return f"{field.opt.help} {shown} if left out."


def _optional(kind: Any) -> Any:
    """Return the annotation of an argument that may be left out, or be one value instead of several."""
    if get_origin(kind) is tuple:
        return get_args(kind)[0] | Sequence[get_args(kind)[0]] | None  # type: ignore[misc]
    return kind | None


def _type(hint: Any, needed: bool) -> str:
    """Return an annotation as numpydoc has it: ``float, optional``, unless it is needed."""
    if isinstance(hint, str):
        hint = hint.replace("str | PathLike[str]", "path")
        parts = [part.strip() for part in hint.split("|")]
        names = [re.sub(r"(\w+)\[(.*)\]", lambda m: f"{m[1].lower()} of {m[2]}", part) for part in parts]
    else:
        kinds = get_args(hint) or (hint,)
        names = [
            f"sequence of {get_args(kind)[0].__name__}" if get_origin(kind) in (Sequence, tuple)
            else "None" if kind is type(None)
            else "mapping" if get_origin(kind) is Mapping
            else str(kind.__name__)
            for kind in kinds
        ]  # fmt: skip
    return " or ".join(name for name in names if name != "None") + ", optional" * (not needed)
