"""The sections of a scene file that stand beside ``[scene]``; that of ``carom plan``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from carom.declared import SEED, described, integer, number, option, said
from carom.errors import InputError
from carom.spec import Spec

SYSTEM, BUDGET = "The system, without a scene file", "Available cores and time"


@dataclass(frozen=True)
class Beside(Spec):
    """A section that stands beside ``[scene]``, which is read apart.

    Raises
    ------
    InputError
        If a value has the wrong type or is out of range.
    """

    tables: ClassVar[tuple[str, ...]] = ("scene",)

    @classmethod
    def of_sections(cls, words: dict[str, Any], others: dict[str, Any]) -> dict[str, Any]:
        """Return the keys of the section alone."""
        return words


def _target(value: Any, name: str) -> str:
    """Check that a target is text; the planner reads it."""
    from carom import checks

    if not isinstance(value, str):
        raise InputError(f'{name} must be a text such as "Z=1e-4", found {checks.describe(value)}.')
    return value


said(_target, type="string")


def _cores(value: Any, name: str) -> Any:
    """Check a number of cores, or "auto"."""
    return value if isinstance(value, str) else integer(low=1, high=10**6)(value, name)


said(_cores, anyOf=[{"type": "integer", "minimum": 1}, {"const": "auto"}])


@described
@dataclass(frozen=True)
class PlanSpec(Beside):
    """For what accuracy to plan, and with which means: the section ``[plan]``."""

    section: ClassVar[str] = "plan"

    target: str = option(
        _target,
        "Z=1e-4: relative error of Z, P, g(contact) or D; Z=+-0.002: absolute.",
        "",
        ("--target", "-t"),
        default="Z=1e-3",
    )
    n: int | None = option(integer(low=8, high=10**7), "Plan with this number of particles only.", SYSTEM)
    seed: int | None = option(SEED, "Seed of all random numbers; 1.", SYSTEM)
    cores: int | str | None = option(
        _cores, "Number of cores; by default all of this machine.", BUDGET, read=str
    )
    walltime: float | None = option(
        number(low=0, open_low=True), "Available wall time in seconds; by default no limit.", BUDGET
    )
    pilot: float | None = option(
        number(low=0, open_low=True), "CPU seconds that each of two pilots may take; 15.", BUDGET
    )
