"""Gas and liquid of spheres with square wells: where they are known to coexist."""

from __future__ import annotations

CRITICAL = {1.5: (1.2172, 0.3079)}
"""Critical kT [depth of the well] and density [1 / diameter^3] by the range of the well [diameter]: Singh,
Kofke and Errington, J. Chem. Phys. 119, 3405 (2003)."""


def gas_and_liquid(well: float, kT: float) -> tuple[float, float] | None:
    """Return the densities [1 / diameter^3] of gas and liquid that coexist, about; None where none are known.

    ``well`` is its range [diameter], ``kT`` is in units of its depth. They follow from the critical point by
    Guggenheim's law of corresponding states, J. Chem. Phys. 13, 253 (1945), that of argon: the liquid of
    wells is 3 to 5 % less dense.
    """
    critical, density = CRITICAL.get(well, (0.0, 0.0))
    if not kT < critical:
        return None
    t = 1.0 - kT / critical
    mean, half = 1.0 + 0.75 * t, 1.75 * t ** (1.0 / 3.0)
    return max(density * (mean - half), 0.0), density * (mean + half)
