"""Checks of the keys of a scene file.

Models, and NumPy with them, are imported when there is a value to check: the help of a command reads only
which keys there are.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from carom.declared import (
    Check,
    fields_of,
    integer,
    positive,
    said,
    schema_of,
    schema_of_several,
    schema_of_table,
    word,
)
from carom.errors import InputError

LATTICES = ("fcc", "triangular", "cubic", "dn")
FORMATS = ("h5md", "extxyz", "gsd")

MOST = 10**8  # most particles of a scene, as in :mod:`carom.scene.lattices`

MOST_DIMENSIONS = 12


def listed(value: Any) -> tuple[Any, ...] | None:
    """Return a list as a tuple, and anything else as None."""
    return tuple(value) if isinstance(value, list | tuple) else None


def tuples(value: Any) -> Any:
    """Return a value with tuples instead of lists, also within tables."""
    if isinstance(value, list | tuple):
        return tuple(map(tuples, value))
    if type(value) is dict:
        return {key: tuples(each) for key, each in value.items()}
    return value


def each_axis(one: Check) -> Check:
    """Return the check of one value, or of a list with a value for each axis."""

    def check(value: Any, name: str) -> Any:
        many = listed(value)
        return one(value, name) if many is None else tuple(one(v, name) for v in _axes(many, name))

    return said(check, **schema_of_several(one))


def edges(value: Any, name: str) -> tuple[float, ...]:
    """Check the edges of a box, a list."""
    from carom import checks
    from carom.scene.box import LONGEST_EDGE

    many = listed(value)
    if many is None:
        raise InputError(f"{name} must be a list of edges, found {checks.describe(value)}.")
    low, high = 1 / checks.MAGNITUDE, LONGEST_EDGE * checks.MAGNITUDE
    return tuple(checks.number(v, name, low=low, high=high) for v in _axes(many, name))


said(edges, type="array", items=schema_of(positive))


def indices(value: Any, name: str) -> int | tuple[int, ...] | None:
    """Check a number of particles, or a list of their indices; an empty one is left out."""
    one, many = integer(low=0, high=MOST), listed(value)
    if many is None:
        return one(value, name)
    return tuple(one(v, name) for v in many) or None


said(indices, anyOf=[{"type": "integer"}, {"type": "array", "items": {"type": "integer"}}])


def file_name(value: Any, name: str) -> str:
    """Check the name of a file."""
    from carom import checks

    if not isinstance(value, str):
        raise InputError(f"{name} must be a string, found {checks.describe(value)}.")
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        value = ""
    if not value or "\0" in value:
        raise InputError(f"{name} must be the name of a file, found something else.")
    return value


said(file_name, type="string")


def formats(value: Any, name: str) -> tuple[str, ...]:
    """Check formats of trajectories, each once."""
    from carom import checks

    many = listed(value)
    if many is None:
        raise InputError(f"{name} must be a list of formats, found {checks.describe(value)}.")
    found = tuple(word(*FORMATS)(each, name) for each in many)
    if len(set(found)) < len(found):
        raise InputError(f"{name} names a format twice: {', '.join(found)}.")
    return found


said(formats, type="array", items={"enum": list(FORMATS)})


def contact(value: Any, name: str) -> tuple[tuple[float, ...], ...]:
    """Check a table of contact distances."""
    from carom import checks

    rows = [listed(row) for row in listed(value) or (None,)]
    if any(row is None for row in rows):
        raise InputError(f"{name} must be a list of lists of numbers, found {checks.describe(value)}.")
    return tuple(tuple(checks.positive(x, name) for x in row or ()) for row in rows)


said(contact, type="array", items={"type": "array", "items": schema_of(positive)})


def walls(value: Any, name: str) -> Any:
    """Check names of axes, or walls by name, as values or as tables."""
    from carom import checks
    from carom.models.files import tables
    from carom.models.obstacles import Wall

    if isinstance(value, Mapping):
        given = {wall: each for wall, each in value.items() if isinstance(each, Wall)}
        read = {wall: tuples(each) for wall, each in value.items() if wall not in given}
        try:
            made = given | tables.walls_from_table(read)
        except InputError as problem:
            raise InputError(f"{name}: {problem}") from problem
        return {wall: made[wall] for wall in value}
    axes = listed(value)
    each = (value,) if axes is None else axes
    if not isinstance(value, bool) and not all(isinstance(axis, str) for axis in each):
        raise InputError(
            f"{name} must name axes, such as 'xy', or be true, or hold walls by name; found "
            f"{checks.describe(value)}."
        )
    return value if axes is None else axes


said(
    walls,
    anyOf=[
        {"type": ["boolean", "string"]},
        {"type": "array", "items": {"type": "string"}},
        {"type": "object", "additionalProperties": {"$ref": "#/definitions/wall"}},
    ],
)


def species(value: Any, name: str) -> tuple[Any, ...]:
    """Check species: tables by name (a number is none), or a list of values or of tables."""
    from carom import checks
    from carom.scene.species import Species

    found = []
    for k, (key, each) in enumerate(_named(value, name, "name = { fraction = 0.2, diameter = 1.0 }")):
        given = dict(each) if isinstance(each, Mapping) else each
        if not isinstance(given, dict | Species):
            raise InputError(f"{name} {key} must be a table, found {checks.describe(each)}.")
        if isinstance(given, Species):
            given = {field: getattr(given, field) for field in _SPECIES}
        checks.keys(given, f"{name} {key}", _SPECIES)
        given.setdefault("name", key if isinstance(key, str) else None)
        if given["name"] == "":
            raise InputError(f"{name} {key} must have a name, found an empty one.")
        given["name"] = None if given["name"] == str(k) else given["name"]
        try:
            found.append(Species(**given))
        except InputError as problem:
            raise InputError(f"{name} {key}: {problem}") from problem
    return tuple(found)


_SPECIES = ("name", "fraction", "count", "diameter", "mass")
said(
    species,
    type="object",
    additionalProperties={
        "type": "object",
        "properties": {
            "fraction": {"type": "number", "minimum": 0},
            "count": {"type": "integer", "minimum": 0},
            "diameter": schema_of(positive),
            "mass": schema_of(positive),
        },
        "additionalProperties": False,
    },
)


def sizes(value: Any, name: str) -> dict[str, Any]:
    """Check a distribution of diameters, a table."""
    from carom import checks, sizes as distributions

    if not isinstance(value, Mapping):
        raise InputError(
            f'{name} must be a table such as {{ type = "power", ratio = 0.45 }}, found '
            f"{checks.describe(value)}."
        )
    try:
        distributions.of_table(value, 1)
    except InputError as problem:
        raise InputError(f"{name}: {problem}") from problem
    return dict(value)


said(
    sizes,
    type="object",
    properties={
        "type": {"enum": ["power", "uniform", "gaussian"]},
        **{name: {"type": "number"} for name in ("ratio", "exponent", "polydispersity")},
    },
    required=["type"],
    additionalProperties=False,
)


def moves(name: str) -> Check:
    """Return the check of what happens between events: a value such as :class:`carom.Swaps`, or its table."""

    def kind() -> Any:
        return getattr(importlib.import_module(f"carom.simulation.moves.{name.lower()}"), name)

    def check(value: Any, what: str) -> Any:
        from carom import checks

        if isinstance(value, kind()):
            return value
        fields = fields_of(kind())
        needed = [each for each, field in fields.items() if field.needed]
        if not isinstance(value, Mapping):
            raise InputError(
                f"{what} must be a table with {', '.join(needed)}, found {checks.describe(value)}."
            )
        try:
            checks.keys(value, "the table", fields, needed=needed)
            return kind()(**value)
        except InputError as problem:
            raise InputError(f"{what}: {problem}") from problem

    check.schema = lambda: schema_of_table(kind())  # type: ignore[attr-defined]
    return check


swaps, barostat = moves("Swaps"), moves("Barostat")


def obstacles(value: Any, name: str) -> tuple[Any, ...]:
    """Check obstacles: tables by name, or a list of values or of tables."""
    from carom import checks
    from carom.models.files import tables
    from carom.models.obstacles import Obstacle

    found = []
    for key, each in _named(value, name, 'name = { type = "ball", center = [5.0, 5.0], radius = 2.0 }'):
        if isinstance(each, Mapping):
            named = {"name": key} if isinstance(key, str) else {}
            try:
                found.append(tables.from_table({**named, **tuples(dict(each))}, "obstacle"))
            except InputError as problem:
                raise InputError(f"{name} {key}: {problem}") from problem
        elif isinstance(each, type) or not isinstance(each, Obstacle):
            raise InputError(f"{name} {key} must be an obstacle, found {checks.describe(each)}.")
        else:
            found.append(each)
    return tuple(found)


said(obstacles, type="object", additionalProperties={"$ref": "#/definitions/obstacle"})


def model(what: str) -> Check:
    """Return the check of an interaction, a motion, an impact or a drive: a value, or its table."""

    def check(value: Any, name: str) -> Any:
        from carom import checks
        from carom.models.files import tables

        table = isinstance(value, Mapping) or (what == "impact" and isinstance(value, int | float))
        if type(value).__module__ in ("builtins", "datetime") and not table:
            # What a file holds instead of a table: no model is of such a type.
            raise InputError(f"{name} must be a table, found {checks.describe(value)}.")
        try:
            return tables.from_table(tuples(value), what) if table else value
        except InputError as problem:
            raise InputError(f"{name}: {problem}") from problem

    return said(check, anyOf=[{"$ref": f"#/definitions/{what}"}])


def _axes(values: tuple[Any, ...], name: str) -> tuple[Any, ...]:
    """Return values, one for each axis, after a check of their number."""
    if not 1 <= len(values) <= MOST_DIMENSIONS:
        raise InputError(f"{name} must have one value an axis, found {len(values)}.")
    return values


def _named(value: Any, name: str, example: str) -> list[tuple[Any, Any]]:
    """Return values with their names, or of a list with their numbers."""
    from carom import checks

    if isinstance(value, Mapping):
        return list(value.items())
    many = listed(value)
    if many is None:
        word = name.rpartition(" ")[2]
        raise InputError(
            f"{name} must be tables with names, such as {word}.{example}; found {checks.describe(value)}."
        )
    return list(enumerate(many))
