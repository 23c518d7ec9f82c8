"""Where fluid and crystal of hard spheres coexist, from their equations of state."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom.errors import InputError
from carom.theory.arithmetic import Equation
from carom.theory.fluid import pieprzyk
from carom.theory.solid import almarza

# Excess free energy per particle of the fcc crystal [kT] at this density (number in sigma^3), from a
# lattice-switch free energy: Schultz and Kofke, doi:10.1063/1.4818990, N -> infinity.
REFERENCE_DENSITY = 1.0409
REFERENCE_FREE_ENERGY = 5.91901


@dataclass(frozen=True)
class Coexistence:
    """Two phases in equilibrium.

    Attributes
    ----------
    pressure : float
        Pressure, P sigma^3 / kT.
    freezing, melting : float
        Packing fraction of the fluid, and of the crystal.
    chemical_potential : float
        Chemical potential, mu / kT, with a thermal wavelength of one diameter.
    """

    pressure: float
    freezing: float
    melting: float
    chemical_potential: float


def coexistence(
    fluid: Equation = pieprzyk,
    solid: Equation = almarza,
    *,
    free_energy: float = REFERENCE_FREE_ENERGY,
    density: float = REFERENCE_DENSITY,
) -> Coexistence:
    """Pressure at which fluid and crystal of hard spheres (d = 3) have the same chemical potential.

    Parameters
    ----------
    fluid, solid : callable
        Z as a function of the packing fraction. That of the fluid is needed from 0 to 0.53, that of the
        crystal from 0.51 to 0.60.
    free_energy : float
        Excess free energy per particle of the crystal at `density` [kT]. It is needed because an equation of
        state gives differences only.
    density : float
        Number density of the crystal to which `free_energy` belongs [sigma^-3].

    Raises
    ------
    InputError
        If the two do not cross between the pressures 10.5 and 12.5.

    Notes
    -----
    ``beta mu = ln rho - 1 + A_ex + Z`` with ``A_ex = int (Z - 1) / rho d rho``: from 0 for the fluid, from
    `density` for the crystal.
    """
    from scipy.integrate import quad
    from scipy.optimize import brentq

    volume = math.pi / 6.0

    def excess(equation: Equation, start: float, end: float) -> float:
        """Return the difference of excess free energies between two packing fractions."""
        # The integrand is finite at zero density, where quad does not evaluate it.
        return float(quad(lambda eta: (equation(eta) - 1.0) / eta, start, end, epsabs=1e-10)[0])

    def density_at(equation: Equation, pressure: float, low: float, high: float) -> float:
        """Return the packing fraction at a pressure."""

        def surplus(eta: float) -> float:
            return float(eta / volume * equation(eta)) - pressure

        if surplus(low) > 0.0 or surplus(high) < 0.0:
            raise InputError(
                f"An equation of state has no pressure of {pressure:g} kT/sigma^3 between packing fractions "
                f"{low} and {high}; coexistence needs the fluid's there and the crystal's."
            )
        return float(brentq(surplus, low, high, xtol=1e-14))

    def potentials(pressure: float) -> tuple[float, float, float, float]:
        """Return packing fractions and chemical potentials of both phases at a pressure."""
        liquid = density_at(fluid, pressure, 0.40, 0.53)
        crystal = density_at(solid, pressure, 0.51, 0.60)
        # A / N kT = ln rho - 1 + A_ex.
        below = math.log(liquid / volume) - 1.0 + excess(fluid, 0.0, liquid) + fluid(liquid)
        start = density * volume
        own = free_energy + excess(solid, start, crystal)
        above = math.log(crystal / volume) - 1.0 + own + solid(crystal)
        return liquid, crystal, float(below), float(above)

    def difference(pressure: float) -> float:
        _, _, below, above = potentials(pressure)
        return below - above

    low, high = 10.5, 12.5
    if difference(low) * difference(high) > 0.0:
        raise InputError(
            f"The two equations of state do not cross between the pressures {low} and {high} kT/sigma^3; "
            "check that one is a fluid's and one a crystal's, and the free energy."
        )
    pressure = float(brentq(difference, low, high, xtol=1e-10))
    liquid, crystal, potential, _ = potentials(pressure)
    return Coexistence(pressure, liquid, crystal, potential)


CRITICAL = {1.5: (1.2172, 0.3079)}
"""Critical kT [depth of the well] and density [1 / diameter^3] by the range of the well [diameter]: Singh,
Kofke and Errington, J. Chem. Phys. 119, 3405 (2003)."""


def gas_and_liquid(well: float, kT: float) -> tuple[float, float] | None:
    """Return the densities [1 / diameter^3] of gas and liquid that coexist, about; None where none are known.

    ``well`` is its range [diameter], ``kT`` is in units of its depth. They follow from the critical point by
    Guggenheim's law of corresponding states, J. Chem. Phys. 13, 253 (1945), that of argon: the liquid of
    wells is somewhat less dense.
    """
    critical, density = CRITICAL.get(well, (0.0, 0.0))
    if not kT < critical:
        return None
    t = 1.0 - kT / critical
    mean, half = 1.0 + 0.75 * t, 1.75 * t ** (1.0 / 3.0)
    return max(density * (mean - half), 0.0), density * (mean + half)
