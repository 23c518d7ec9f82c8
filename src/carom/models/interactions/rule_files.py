"""Range rules of a file: the units as a table, and the rule by its name in a Python file of the user's.

Reading a file runs nothing. The rule is code, and becomes a function only where somebody says that it may.
"""

from __future__ import annotations

import hashlib
import sys
import types
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Self

from carom import checks
from carom.declared import SEED, said
from carom.errors import InputError
from carom.models.declared_values import Value
from carom.models.interactions.ranges import Kind, Ranges, kinds

LARGEST = 1 << 20
"""Bytes of a file with a rule: larger ones are something else."""


def _named(value: Any, name: str) -> str:
    """Check a name."""
    if not isinstance(value, str) or not value or "\0" in value:
        raise InputError(f"{name} must be a name, found {checks.describe(value)}.")
    return value


def _python_file(value: Any, name: str) -> str:
    """Check the name of a Python file."""
    if Path(_named(value, name)).suffix != ".py":
        raise InputError(f"{name} must be a Python file, which ends with .py; found {value!r}.")
    return str(value)


def _function(value: Any, name: str) -> str:
    """Check the name of a function."""
    if not _named(value, name).isidentifier():
        raise InputError(f"{name} must be the name of a function in the file, found {value!r}.")
    return str(value)


def _sha256(value: Any, name: str) -> str:
    """Check the digest of a file."""
    if not isinstance(value, str) or len(value) != 64 or not set(value) <= set("0123456789abcdef"):
        raise InputError(f"{name} must be 64 hexadecimal digits, found {checks.describe(value)}.")
    return value


for _check in (_python_file, _function, _sha256):
    said(_check, type="string")


@dataclass(frozen=True)
class RuleFile(Value):
    """Units whose rule stands in a Python file: what a scene file holds of ``carom.models.Ranges``."""

    type = "ranges"
    kinds: Annotated[tuple[Kind, ...], kinds]  # one for each species, in their order
    file: Annotated[str, _python_file]  # relative to the folder of the scene file
    rule: Annotated[str, _function]  # name of the function ``rule(unit, event)``
    seed: Annotated[int, SEED] = 0  # of ``carom.models.draw``
    sha256: Annotated[str | None, _sha256] = None  # hexadecimal; a file edited since is refused
    trust: bool = field(default=False, compare=False)  # whether its code may run; no file can say so

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
            functions = {k: x for k, x in vars(module).items() if isinstance(x, types.FunctionType)}
            known = [each for each, function in functions.items() if function.__module__ == name]
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


def _digest(source: bytes) -> str:
    return hashlib.sha256(source).hexdigest()


def _run(name: str, path: str, source: bytes) -> types.ModuleType:
    """Run the source of a file, the bytes whose digest was looked at, as a module once in a process."""
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
