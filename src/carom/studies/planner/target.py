"""The target of a plan, a quantity and its error: ``Z=1e-4``."""

from __future__ import annotations

import re
from dataclasses import dataclass

from carom import checks
from carom.errors import InputError

QUANTITIES = {
    "Z": "Z",
    "P": "P",
    "pressure": "P",
    "g(contact)": "g(contact)",
    "g": "g(contact)",
    "D": "D",
}
"""Names of quantities in a target, and the quantities that they mean."""

UNITS = {"Z": "", "P": " [energy / length^d]", "g(contact)": "", "D": " [length^2 / time]"}

FORM = (
    "Expected QUANTITY=ERROR with Z, P (or pressure), g(contact), D or D(species), and a relative error "
    "(Z=1e-4, Z=0.01%) or an absolute one (Z=+-0.002)."
)


@dataclass(frozen=True)
class Target:
    """A quantity of the infinite system, and the error to which it is to be known.

    Parameters
    ----------
    quantity : str
        "Z", "P", "g(contact)", "D", or "D(A)" for the species with the name or the number A.
    error : float
        One standard error, the bias of the finite size included.
    relative : bool
        Whether the error is relative, or in the unit of the quantity.

    Raises
    ------
    InputError
        If the quantity is not known, or the error is not positive. A relative error must be from 1e-9 to 1.
    """

    quantity: str
    error: float
    relative: bool = True

    def __post_init__(self) -> None:
        if self.quantity not in QUANTITIES.values() and self.species is None:
            raise InputError(f"The target names {checks.describe(self.quantity)}. {FORM}")
        if self.relative:
            checks.number(self.error, "the relative error of the target", low=checks.FINEST_ERROR, high=1.0)
        else:
            checks.number(self.error, "the error of the target", low=0.0, open_low=True)

    @property
    def species(self) -> str | None:
        """Name or number of the species whose D is asked for, or None."""
        found = re.fullmatch(r"D\((.+)\)", self.quantity)
        return found[1].strip() if found else None

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return UNITS["D" if self.species is not None else self.quantity]

    @classmethod
    def parse(cls, text: str) -> Target:
        """Return the target that a ``text`` names, such as ``Z=1e-4``.

        A plain number or one with % is a relative error, as ``relative_error=``; one with +- is absolute.

        Raises
        ------
        InputError
            If the text does not name a target.
        """
        name, sign, error = (part.strip() for part in str(text).partition("="))
        quantity = QUANTITIES.get(name, name)
        if not sign or (name not in QUANTITIES and not re.fullmatch(r"D\(.+\)", name)):
            raise InputError(f"The target is {checks.describe(text)}. {FORM}")
        found = re.fullmatch(r"(\+-|±|\+/-)?\s*([0-9.eE+-]+)\s*(%)?", error)
        try:
            if found is None or (found[1] and found[3]):
                raise ValueError
            value = float(found[2])
        except ValueError:
            raise InputError(f"The target is {checks.describe(text)}. {FORM}") from None
        return cls(quantity, value / 100.0 if found[3] else value, found[1] is None)

    def absolute(self, value: float) -> float:
        """Return the error in the unit of the quantity, whose value is about ``value``."""
        return self.error * abs(value) if self.relative else self.error

    def __str__(self) -> str:
        return f"{self.quantity}={'' if self.relative else '+-'}{float(self.error)!r}"


@dataclass(frozen=True)
class Scale:
    """How a quantity follows from Z: ``(Z - offset) factor``."""

    offset: float = 0.0
    factor: float = 1.0

    def of(self, z: float) -> float:
        """Return the quantity for a value of Z."""
        return (z - self.offset) * self.factor
