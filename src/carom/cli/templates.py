"""The scene files of ``carom init``, and the JSON schema by which editors complete and check them.

A template holds values; what a key means is the help of its field, and is written beside it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from importlib.resources import files
from typing import Any, get_args, get_origin

from carom.declared import SpecField, fields_of, schema_of
from carom.scene_file.commands import PlanSpec
from carom.scene_file.sections import RunSpec, SceneSpec
from carom.spec import Spec
from carom.studies.eos.spec import StudySpec
from carom.studies.packings.spec import PackSpec
from carom.studies.shear.spec import ShearSpec
from carom.studies.spherical_codes.spec import CodeSpec
from carom.studies.trade.spec import TradeSpec
from carom.studies.transport.spec import TransportSpec
from carom.texts import typed

SPECS: dict[str, type[Spec]] = {
    spec.section: spec
    for spec in (
        SceneSpec, RunSpec, StudySpec, TransportSpec, ShearSpec, PackSpec, PlanSpec, CodeSpec, TradeSpec,
    )
}  # fmt: skip
"""What each section may hold."""

NAMES = (
    "fluid", "mixture", "walls", "square-well", "bed", "rules", "packing", "study", "transport", "shear",
    "code",
)  # fmt: skip
"""The templates."""

SCHEMA = "carom-schema.json"
"""Name of the file of the schema, in the folder of scene files."""

COLUMN = 40
"""Where the meaning of a key begins, if the line is shorter."""

LONGEST = 110

_HEAD = re.compile(r"\[(\w+)\]")
_KEY = re.compile(r"(?:# )?(\w+)(?:\.\S+)? = [^#]*")


def source(name: str) -> str:
    """Return the text of a template as it is stored."""
    return files("carom").joinpath("templates", f"{name}.toml").read_text(encoding="utf-8")


def title(name: str) -> str:
    """Return what a template is, in one line."""
    return source(name).splitlines()[0].partition(": ")[2]


def template(name: str, path: str = "") -> str:
    """Return a template with the meaning of each key beside it, for a file at a path."""
    first, *lines = source(name).splitlines()
    section, told, done = "", set[str](), list[str]()
    for line in lines:
        if head := _HEAD.fullmatch(line):
            section, told = head[1], set()
        elif line.startswith("["):
            section = ""
        key = _KEY.fullmatch(line)
        if key and section in SPECS and key[1] not in told:
            told.add(key[1])
            line = _told(line, fields_of(SPECS[section])[key[1]])
            if not line.startswith("# "):  # the first choice, not another one
                line = line.replace(" # or: ", " # ")
        done.append(line)
    stem = path.removesuffix(".toml") or name
    text = (
        "\n".join([first.replace(f" {name}.toml", typed("", f"{stem}.toml")), f"#:schema ./{SCHEMA}", *done])
        + "\n"
    )
    return text.replace(f'"{name}.py"', f'"{stem}.py"').replace(f", {name}.py.", f", {stem}.py.")


def code(name: str) -> str | None:
    """Return the Python file that belongs to a template; None if there is none."""
    there = files("carom").joinpath("templates", f"{name}.py")
    return there.read_text(encoding="utf-8") if there.is_file() else None


def _told(line: str, field: SpecField) -> str:
    """Return a line with the meaning of its key."""
    text = _meaning(field)
    told = f"{line:<{COLUMN - 1}} # {text[0].lower() + text[1:] if text[1:2].islower() else text}"
    while len(told) > LONGEST and (cut := max(told.rfind(". "), told.rfind("; "))) > len(line):
        told = told[:cut]
    return told


def _meaning(field: SpecField) -> str:
    """Return what a key means, without what its option looks like."""
    assert field.opt is not None
    return field.opt.help.partition("; as an option")[0].rstrip(".")


def schema() -> dict[str, Any]:
    """Return the JSON schema of scene files: sections, keys, types, limits, defaults and meanings."""
    from carom.models.files import tables

    sections = {name: _section(kind) for name, kind in SPECS.items()}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Scene file of Carom",
        "type": "object",
        "properties": sections,
        "additionalProperties": False,
        "definitions": tables.definitions(),
    }


def _section(kind: type[Spec]) -> dict[str, Any]:
    """Return the schema of a section."""
    fields = {name: field for name, field in fields_of(kind).items() if name not in kind.tables}
    found: dict[str, Any] = {
        "type": "object",
        "description": (kind.__doc__ or "").partition("\n")[0].replace("`", ""),
        "properties": {name: _key(field) for name, field in fields.items()},
        "additionalProperties": False,
    }
    needed = [name for name, field in fields.items() if field.needed]
    return {**found, "required": needed} if needed else found


def _key(field: SpecField) -> dict[str, Any]:
    """Return the schema of a key: what its check accepts, or else its type."""
    found = schema_of(field.check) or _type(field.kind)
    if field.opt is not None:
        found["description"] = field.opt.help
    default = list(field.default) if isinstance(field.default, tuple) else field.default
    if not field.needed and default not in (None, []) and not isinstance(default, Mapping):
        found["default"] = default
    return found


def _type(hint: Any) -> dict[str, Any]:
    """Return the schema of a type; a list may be one value as well."""
    words = {int: "integer", float: "number", str: "string", bool: "boolean"}
    if hint in words:
        return {"type": words[hint]}
    if get_origin(hint) is tuple:
        one = _type(get_args(hint)[0])
        return {"anyOf": [one, {"type": "array", "items": one}]}
    kinds = [_type(each) for each in get_args(hint) if each is not type(None)]
    return kinds[0] if len(kinds) == 1 else {"anyOf": kinds} if kinds else {}


def table(name: str) -> str:
    """Return the keys of a section as a table in Markdown."""
    kind = SPECS[name]
    rows = []
    for key, field in fields_of(kind).items():
        if field.opt is not None and key not in kind.tables:
            default = _key(field).get("default", "")
            shown = f"`{json.dumps(default)}`" if default != "" else ""
            rows.append(
                f"| `{key}` | {field.opt.help.partition('; as an option')[0].rstrip('.')} | {shown} |"
            )
    return "\n".join(["| key | meaning | default |", "|---|---|---|", *rows])
