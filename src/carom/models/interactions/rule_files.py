"""Range rules of a file: the units as a table, and the rule by its name in a Python file of the user's.

Reading a file runs nothing. The rule is code, and becomes a function only where somebody says that it may.
"""

from __future__ import annotations

import hashlib
import math
import sys
import types
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Self

from carom import checks
from carom.errors import InputError
from carom.models.interactions.ranges import Kind, Ranges

LARGEST = 1 << 20
"""Bytes of a file with a rule: larger ones are something else."""


@dataclass(frozen=True)
class RuleFile:
    """Units whose rule stands in a Python file: what a scene file holds of ``carom.models.Ranges``."""

    kinds: Sequence[Kind]  # one for each species, in their order
    file: str  # relative to the folder of the scene file
    rule: str  # name of the function ``rule(unit, event)``
    seed: int = 0  # of ``carom.models.draw``
    sha256: str | None = None  # hexadecimal; a file edited since is refused
    trust: bool = field(default=False, compare=False)  # whether its code may run; no file can say so

    def __post_init__(self) -> None:
        given = self.kinds
        if not isinstance(given, Sequence) or isinstance(given, str) or not given:
            raise InputError(f"kinds must be a list of tables, found {checks.describe(given)}.")
        object.__setattr__(self, "kinds", tuple(map(_kind, given)))
        for name in ("file", "rule"):
            value = getattr(self, name)
            if not isinstance(value, str) or not value or "\0" in value:
                raise InputError(f"{name} must be a name, found {checks.describe(value)}.")
        if Path(self.file).suffix != ".py":
            raise InputError(f"file must be a Python file, which ends with .py; found {self.file!r}.")
        if not self.rule.isidentifier():
            raise InputError(f"rule must be the name of a function in the file, found {self.rule!r}.")
        if self.sha256 is not None and not _is_digest(self.sha256):
            raise InputError(f"sha256 must be 64 hexadecimal digits, found {checks.describe(self.sha256)}.")
        # All else that can be wrong with the units, without the rule.
        Ranges(self.kinds, _idle, self.seed)

    def to_table(self) -> dict[str, Any]:
        """Return what a file holds; ``trust`` is not among it."""
        kinds = [
            {
                "name": kind.name,
                "circles": list(kind.circles),
                "timer": None if kind.timer == math.inf else kind.timer,
                "memory": list(kind.memory) or None,
            }
            for kind in self.kinds
        ]
        return {
            "type": "ranges",
            "file": self.file,
            "rule": self.rule,
            "seed": self.seed,
            "sha256": self.sha256,
            "kinds": kinds,
        }

    def beside(self, folder: Path) -> Self:
        """Return the same with the path of the file, where it is relative, taken from a folder."""
        return replace(self, file=str((folder / self.file).absolute()))

    def trusted(self) -> Self:
        """Return the same as its file is now, allowed to run."""
        return replace(self, sha256=_digest(self._source()), trust=True)

    def ranges(self) -> Ranges:
        """Return the interaction: run the file, and take the rule out of it."""
        if not self.trust:
            raise InputError(
                f"The rule {self.rule} of this scene is code, in {self.file}, and no scene file runs code by "
                "itself. Read it; if you trust it, say `--trust-code` (in Python, `plan.trusted()`)."
            )
        source = self._source()
        name = f"carom_rules_{_digest(source)[:16]}"
        module = sys.modules.get(name) or _run(name, self.file, source)
        rule = getattr(module, self.rule, None)
        if not isinstance(rule, types.FunctionType):
            known = [each for each, value in vars(module).items() if _defined(value, name)]
            raise InputError(
                f"{self.file} has no function {self.rule}; it has {', '.join(known) or 'no function'}."
            )
        return Ranges(self.kinds, rule, self.seed)

    def _source(self) -> bytes:
        path = Path(self.file)
        try:
            with path.open("rb") as stream:
                source = stream.read(LARGEST + 1)
        except (OSError, ValueError) as problem:
            reason = getattr(problem, "strerror", None) or problem
            raise InputError(f"The rule's file {self.file} cannot be read: {reason}.") from None
        if len(source) > LARGEST:
            raise InputError(f"{self.file} has more than {LARGEST} bytes; expected a file with a rule.")
        if self.sha256 not in (None, _digest(source)):
            raise InputError(
                f"{self.file} was edited since its sha256 was noted, and a run goes on as it began: undo the "
                "edit, or take out sha256 and begin anew."
            )
        return source


def of_table(**table: Any) -> RuleFile:
    """Return the value of :meth:`RuleFile.to_table`, whose code may not run."""
    known = [each.name for each in fields(RuleFile) if each.name != "trust"]
    checks.keys(table, "An interaction of type ranges", known, needed=("kinds", "file", "rule"))
    return RuleFile(**table)


def _kind(value: Any) -> Kind:
    """Return a kind from its table."""
    if isinstance(value, Kind):
        return value
    if not isinstance(value, Mapping):
        raise InputError(f"A kind of units must be a table with a name, found {checks.describe(value)}.")
    checks.keys(value, "A kind of units", [each.name for each in fields(Kind)])
    if "name" not in value:
        raise InputError("A kind of units needs a name, found none.")
    return Kind(**value)


def _idle(unit: Any, event: Any) -> None:
    """Decide nothing."""


def _is_digest(text: Any) -> bool:
    return isinstance(text, str) and len(text) == 64 and set(text) <= set("0123456789abcdef")


def _digest(source: bytes) -> str:
    return hashlib.sha256(source).hexdigest()


def _defined(value: Any, module: str) -> bool:
    return isinstance(value, types.FunctionType) and value.__module__ == module


def _run(name: str, path: str, source: bytes) -> types.ModuleType:
    """Run the source of a file as a module, once in a process: the same source has the same functions.

    What runs are the bytes whose digest was looked at, whatever happens to the file meanwhile.
    """
    module = types.ModuleType(name)
    module.__file__ = path
    sys.modules[name] = module
    try:
        exec(compile(source, path, "exec", dont_inherit=True), module.__dict__)
    except Exception as problem:
        del sys.modules[name]
        at_line = f" in line {problem.lineno}" if isinstance(problem, SyntaxError) and problem.lineno else ""
        what = problem.msg if isinstance(problem, SyntaxError) else problem
        raise InputError(f"{path} cannot be run: {type(problem).__name__}{at_line}: {what}.") from problem
    return module
