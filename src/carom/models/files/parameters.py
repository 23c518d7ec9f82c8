"""What a file keeps of a value of one's own: the name of its class, and its parameters as text.

A file holds no code, so the value is given again where the file is loaded. Its parameters must be those of
the run.
"""

from __future__ import annotations

import hashlib
import numbers
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

LONGEST = 100  # characters above which the digest of a text stands for the text


def class_and_parameters(value: Any) -> dict[str, Any]:
    """Return what a file keeps of a value: the name of its class, and each parameter that has a text."""
    texts = {name: _text(each) for name, each in _parts(value).items()}
    return {
        "class": type(value).__name__,
        "parameters": {name: _short(text) for name, text in texts.items() if text is not None},
    }


def difference(before: Mapping[str, Any], value: Any) -> str | None:
    """Return how a value differs from that of a file's ``before``, where it has parameters; or None."""
    now = class_and_parameters(value)
    if before.get("class") != now["class"]:
        return f"of the class {before.get('class')}, and the value given is of the class {now['class']}"
    for name, text in before.get("parameters", {}).items():
        found = now["parameters"].get(name, text)
        if found != text:
            return f"{now['class']} with {name} = {text}, and the value given has {name} = {found}"
    return None


def _parts(value: Any) -> dict[str, Any]:
    if is_dataclass(value):
        return {each.name: getattr(value, each.name) for each in fields(value)}
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return dict(zip(value._fields, value, strict=True))
    return dict(getattr(value, "__dict__", {}))


def _text(value: Any) -> str | None:
    """Return the same text for equal values in every process, or None where there is none."""
    if value is None or isinstance(value, bool | np.bool_ | str | bytes):
        return repr(value.item() if isinstance(value, np.generic) else value)
    if isinstance(value, numbers.Integral):
        return repr(int(value))
    if isinstance(value, numbers.Real):
        number = float(value)
        return repr(int(number)) if number.is_integer() and abs(number) < 2.0**53 else repr(number)
    if isinstance(value, np.ndarray):
        if value.dtype.hasobject:
            return None
        digest = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return f"array of shape {value.shape}, {value.dtype}, {digest}"
    if isinstance(value, Mapping):
        return _joined({repr(name): each for name, each in value.items()}, "{}")
    if is_dataclass(value) or hasattr(value, "_fields"):
        inside = _joined(_parts(value), "()")
        return None if inside is None else type(value).__name__ + inside
    if isinstance(value, list | tuple):
        texts = [_text(each) for each in value]
        return None if None in texts else f"({', '.join(map(str, texts))})"
    return None


def _joined(parts: Mapping[str, Any], ends: str) -> str | None:
    texts = {name: _text(each) for name, each in parts.items()}
    if None in texts.values():
        return None
    return ends[0] + ", ".join(f"{name}: {text}" for name, text in texts.items()) + ends[1]


def _short(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:24]}... (SHA-256 {_digest(text)})"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
