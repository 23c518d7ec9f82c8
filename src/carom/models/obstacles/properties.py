"""Properties that any obstacle, and a wall of the box, may have: a motion, a loss, a temperature.

Users give them as keywords, in any order (``dressing`` makes of them what the engine knows).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from carom import checks
from carom.errors import InputError
from carom.models.contacts.losses import Loss
from carom.models.contacts.restitution import Restitution, as_impact
from carom.models.fields import vector
from carom.models.obstacles.paths import check_path


@dataclass(frozen=True, kw_only=True, repr=False)
class Properties:
    """What an obstacle may have beside its shape.

    Parameters
    ----------
    shake : Path, optional
        How it moves as a whole, as displacement by time: ``Sine``, ``Parabolas`` or a path of your own.
    direction : d floats, optional
        Along which it is displaced, a vector of any length. Planes and walls have their normal; other
        obstacles need it.
    impact : float, Restitution or Loss, optional
        What a contact loses, in the frame of the surface. A number is the fraction of the normal relative
        speed that remains.
    kT : float, optional
        Temperature of the surface [energy]: it reflects particles as if they came from a gas behind it.
    seed : int
        Seed of the random numbers of a thermal surface; each particle has its own stream. In a scene, a later
        surface with the seed of another gets a new one.

    Raises
    ------
    InputError
        If a value is out of range, or two of them exclude each other.
    """

    shake: Any = None
    direction: tuple[float, ...] | None = None
    impact: float | Restitution | Loss | None = None
    kT: float | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        what = type(self).__name__
        impact = as_impact(self.impact)
        object.__setattr__(self, "impact", impact)
        if impact is not None and not isinstance(impact, Restitution | Loss):
            raise InputError(
                f"impact of a {what} must be a number, a Restitution or a Loss, found "
                f"{checks.describe(self.impact)}."
            )
        if self.kT is not None:
            kT = checks.number(self.kT, f"kT of a {what}", low=0.0, high=checks.HOTTEST, open_low=True)
            object.__setattr__(self, "kT", kT)
        object.__setattr__(
            self, "seed", checks.integer(self.seed, f"seed of a {what}", low=0, high=2**63 - 1)
        )
        if self.kT is not None and impact is not None:
            raise InputError(
                f"A {what} has impact or kT, found both: what a thermal surface reflects has its "
                "temperature, whatever it lost."
            )
        if self.kT is None and self.seed:
            raise InputError(f"seed of a {what} goes with kT, which is missing.")
        if self.shake is None and self.direction is not None:
            raise InputError(f"direction of a {what} goes with shake, which is missing.")
        if self.direction is not None:
            direction = vector(self.direction, f"direction of a {what}")
            object.__setattr__(self, "direction", direction)
        if self.shake is not None:
            check_path(self.shake)

    @property
    def natural_direction(self) -> tuple[float, ...] | None:
        """Direction in which it is shaken unless another is given; None where it has no normal."""
        return None

    def __repr__(self) -> str:
        each = sorted(fields(self), key=lambda part: part.kw_only is True)
        values = ((part, getattr(self, part.name)) for part in each)
        given = (f"{part.name}={x!r}" for part, x in values if not part.kw_only or x != part.default)
        return f"{type(self).__name__}({', '.join(given)})"


def properties_of(value: Properties) -> dict[str, Any]:
    """Return the properties that are given, by name."""
    found = {each.name: (getattr(value, each.name), each.default) for each in fields(Properties)}
    return {name: given for name, (given, default) in found.items() if given != default}
