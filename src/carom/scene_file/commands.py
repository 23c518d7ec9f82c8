"""The sections of a scene file for ``carom pack`` and ``carom plan``: their options."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from carom.errors import InputError
from carom.spec import Opt, Spec, described, integer, number, said, switch

SEED = integer(low=0, high=2**63 - 1)


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


def _stages(value: Any, name: str) -> tuple[tuple[Any, ...], ...]:
    """Check stages, each a rate and a Z."""
    from carom import checks

    if not isinstance(value, list | tuple) or not all(isinstance(row, list | tuple) for row in value):
        raise InputError(
            f"{name} must be a list of [rate, Z], such as [[0.02, 1e3], [1e-3, 1e10]]; found "
            f"{checks.describe(value)}."
        )
    return tuple(map(tuple, value))


said(
    _stages, type="array", items={"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
)


@described
@dataclass(frozen=True)
class PackSpec(Beside):
    """How to compress a scene: the section ``[pack]``.

    Raises
    ------
    InputError
        If a value has the wrong type or is out of range.
    """

    section: ClassVar[str] = "pack"
    within: ClassVar[str] = "[pack] "
    rivals: ClassVar[tuple[tuple[str, ...], ...]] = (("stages", "rate"), ("stages", "until_Z"))

    seed: Annotated[int, SEED, Opt("Seed of all random numbers.")] = 1
    rate: Annotated[
        float | None,
        number(low=0, open_low=True),
        Opt("Growth of the mean diameter over the thermal speed; 0.02, then 1e-3."),
    ] = None
    until_Z: Annotated[float | None, number(low=1), Opt("Z = PV/NkT at the end; 1e10.")] = None
    stages: Annotated[
        tuple[tuple[float, ...], ...] | None, _stages, Opt("Instead of both: [rate, Z] of each stage.")
    ] = None
    collisions: Annotated[int | None, integer(low=1), Opt("Number of collisions after which to stop.")] = None
    common: Annotated[bool, switch, Opt("One rate for all, not in proportion to size.")] = False
    pictures: Annotated[bool, switch, Opt("Three PNG files.")] = True


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
    """For what accuracy to plan, and with which means: the section ``[plan]``.

    Raises
    ------
    InputError
        If a value has the wrong type or is out of range.
    """

    section: ClassVar[str] = "plan"
    within: ClassVar[str] = "[plan] "

    target: Annotated[
        str,
        _target,
        Opt("Z=1e-4: relative error of Z, P, g(contact) or D; Z=+-0.002: absolute."),
    ] = "Z=1e-3"
    n: Annotated[int | None, integer(low=8, high=10**7), Opt("Plan with this number of particles only.")] = (
        None
    )
    seed: Annotated[int | None, SEED, Opt("Seed of all random numbers; 1.")] = None
    cores: Annotated[int | str | None, _cores, Opt("Number of cores; by default all of this machine.")] = None
    walltime: Annotated[
        float | None,
        number(low=0, open_low=True),
        Opt("Available wall time in seconds; by default no limit."),
    ] = None
    pilot: Annotated[
        float | None,
        number(low=0, open_low=True),
        Opt("CPU seconds that each of two pilots may take; 15."),
    ] = None
