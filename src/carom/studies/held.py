"""What files of results hold, said once: dataclasses whose fields have types, and limits in annotations."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import NoneType
from typing import Any, get_args, get_origin

from carom.declared import Check, fields_of
from carom.io import records
from carom.observables.statistics import Estimate

Measured = Estimate | None  # in the file mean, error and n_eff, each of which may be null

_PARTS = {"mean": -math.inf, "error": 0.0, "n_eff": 0.0}  # of an estimate in the file, and their least values
_ESTIMATE = records.table({k: records.optional(records.number(low=low)) for k, low in _PARTS.items()})

_PLAIN: dict[Any, Check] = {
    int: records.integer(), float: records.number(), str: records.text, bool: records.switch,
    Any: records.anything,
}  # fmt: skip
COUNT = records.integer(low=1)
AT_LEAST_ZERO, POSITIVE = records.number(low=0.0), records.number(low=0.0, open_low=True)


def _measured(value: Any, name: str) -> Measured:
    """Return the estimate in a file; an error or a number of samples that is null is not finite."""
    mean, error, n_eff = map(({} if value is None else _ESTIMATE(value, name)).get, _PARTS)
    if mean is None:
        return None
    return Estimate(
        mean, math.inf if error is None else error, math.nan if n_eff is None else n_eff, math.nan, 0
    )


def check_of(hint: Any) -> Check:
    """Return the check of what a file holds of a type; that of a record returns it."""
    kinds, marks = get_args(hint), getattr(hint, "__metadata__", ())
    if hint == Measured:
        return _measured
    if marks or NoneType in kinds:
        return marks[0] if marks else records.optional(check_of(kinds[0]))
    if kinds:
        several = records.mapping if issubclass(get_origin(hint), Mapping) else records.listed
        check = several(check_of(next(kind for kind in reversed(kinds) if kind is not ...)))
        return (lambda value, name: tuple(check(value, name))) if get_origin(hint) is tuple else check
    if hint in _PLAIN:
        return _PLAIN[hint]
    fields = fields_of(hint).values()
    every = {field.name: field.check or check_of(field.kind) for field in fields}
    table = records.table({field.name: every[field.name] for field in fields if field.needed}, later=every)
    return lambda value, name: hint(**{k: v for k, v in table(value, name).items() if k in every})


def held(value: Any, hint: Any = None) -> Any:
    """Return what a file holds of a value of a type."""
    if hint == Measured or isinstance(value, Estimate):
        return {name: getattr(value, name, None) for name in _PARTS}
    if dataclasses.is_dataclass(value):
        found = {k: held(getattr(value, k), field.kind) for k, field in fields_of(type(value)).items()}
        return {k: v for k, v in found.items() if k != "errors" or v is not None}
    if isinstance(value, dict):
        return {k: held(each) for k, each in value.items()}
    return [held(each) for each in value] if isinstance(value, list | tuple) else value
