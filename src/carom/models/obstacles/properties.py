"""Properties that any obstacle, and a wall of the box, may have: a motion, a loss, a temperature.

Users give them as keywords, in any order (``with_properties`` makes of them what the engine knows).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from carom import checks
from carom.declared import SEED, described, fields_of, number, option, said
from carom.errors import InputError
from carom.models.contacts.losses import Loss
from carom.models.contacts.restitution import Restitution, as_impact
from carom.models.declared_values import Value, vector
from carom.models.obstacles.paths import Path, check_path
from carom.texts import with_article

TEMPERATURE = number(low=0.0, high=checks.HOTTEST, open_low=True)  # of a surface


def _impact(value: Any, name: str) -> Restitution | Loss:
    """Return what contacts at a surface lose."""
    impact = as_impact(value)
    if not isinstance(impact, Restitution | Loss):
        raise InputError(f"{name} must be a number, a Restitution or a Loss, found {checks.describe(value)}.")
    return impact


said(_impact, anyOf=[{"$ref": "#/definitions/impact"}])


@described
@dataclass(frozen=True, kw_only=True, repr=False)
class Properties(Value):
    """What an obstacle may have beside its shape.

    Raises
    ------
    InputError
        If a value is out of range, or two of them exclude each other.
    """

    shake: Path | None = option(
        check_path,
        "How it moves as a whole, as displacement by time: ``Sine``, ``Parabolas`` or a path of your own.",
    )
    direction: tuple[float, ...] | None = option(
        vector,
        "Along which it is displaced, a vector of any length. Planes and walls have their normal, into the "
        "box; other obstacles need it.",
    )
    impact: float | Restitution | Loss | None = option(
        _impact,
        "What a contact loses, in the frame of the surface. A number is the fraction of the normal relative "
        "speed that remains.",
    )
    kT: float | None = option(
        TEMPERATURE,
        "Temperature of the surface [energy]: it reflects particles as if they came from a gas behind it. "
        "The normal speed u has the density ``u exp(-m u^2 / 2 kT)`` of effusion; speeds along it are "
        "Maxwell's.",
    )
    seed: int = option(
        SEED,
        "Seed of the random numbers of a thermal surface; each particle has its own stream. In a scene, a "
        "later surface with the seed of another gets a new one.",
        default=0,
    )

    def __init_subclass__(cls) -> None:
        cls.after = f" of {with_article(vars(cls).get('type', cls.__name__))}"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kT is not None and self.impact is not None:
            raise InputError(
                f"A {type(self).__name__} has impact or kT, found both: what a thermal surface reflects has "
                "its temperature, whatever it lost."
            )
        if self.kT is None and self.seed:
            raise InputError(f"seed{self.after} goes with kT, which is missing.")
        if self.shake is None and self.direction is not None:
            raise InputError(f"direction{self.after} goes with shake, which is missing.")

    @property
    def natural_direction(self) -> tuple[float, ...] | None:
        """Direction in which it is shaken unless another is given; None where it has no normal."""
        return None

    def given(self) -> dict[str, Any]:
        """Return the geometry, and the properties that are not those by default."""
        each = sorted(dataclasses.fields(self), key=lambda part: part.kw_only is True)
        values = {part: getattr(self, part.name) for part in each}
        return {part.name: x for part, x in values.items() if not part.kw_only or x != part.default}

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={x!r}' for name, x in self.given().items())})"


def properties_of(value: Properties) -> dict[str, Any]:
    """Return the properties that are given, by name."""
    return {name: each for name, each in value.unusual().items() if name in fields_of(Properties)}
