"""Which equation of state for which dimension and phase, and where the phases end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from carom.theory.arithmetic import Equation
from carom.theory.fluid import carnahan_starling, henderson, pieprzyk, tonks
from carom.theory.solid import CLOSE_PACKING, almarza, free_volume
from carom.theory.virial import virial_coefficients, virial_pade

FREEZING = {2: 0.70, 3: 0.4917, 4: 0.288, 5: 0.174, 6: 0.105}
"""Packing fraction where the stable fluid ends. 2D: Bernard and Krauth, Phys. Rev. Lett. 107, 155704 (2011);
3D: :func:`carom.theory.coexistence`; 4D to 6D: van Meel, Charbonneau, Fortini and Charbonneau, Phys. Rev. E
80, 061110 (2009)."""

NEAR_FREEZING = 0.93
"""Fraction of the freezing density from which the arrangement of a fluid relaxes slowly, and order is
measured. At 0.92 (spheres at 0.45, disks at 0.65) error bars of 200 collisions a particle are still right.
"""

MELTING = {2: 0.72, 3: 0.5433, 4: 0.337, 5: 0.206, 6: 0.138}
"""Packing fraction where the stable crystal begins; same sources."""


def is_stable_fluid(dimension: int, packing_fraction: float) -> bool:
    """Tell whether a fluid of equal particles is stable: below freezing, which itself is coexistence.

    Parameters
    ----------
    dimension : int
        d. On a line there is no freezing, and beyond 6 dimensions none is known: the answer is yes.
    packing_fraction : float
        Packing fraction; taken to nine decimals, so that 0.7 is the same however it was computed.
    """
    return round(packing_fraction, 9) < FREEZING.get(dimension, 1.0)


def best(dimension: int) -> Equation:
    """Best equation of state in Carom for the fluid in `dimension` dimensions.

    Returns
    -------
    callable
        :func:`tonks` (exact) in 1D, :func:`pieprzyk` in 3D, otherwise :func:`virial_pade` in that dimension.

    Raises
    ------
    InputError
        If the dimension is not 1 to 6.
    """
    virial_coefficients(dimension)
    if dimension == 1:
        return tonks
    if dimension == 3:
        return pieprzyk
    return _in_dimension(virial_pade, dimension)


def solid(dimension: int) -> Equation:
    """Best equation of state in Carom for the crystal in `dimension` dimensions.

    Returns
    -------
    callable
        :func:`almarza` in 3D, otherwise :func:`free_volume` in that dimension, which is accurate only near
        close packing (and exact in 1D).

    Raises
    ------
    InputError
        If the dimension is not 1 to 6.
    """
    virial_coefficients(dimension)
    if dimension == 3:
        return almarza
    return _in_dimension(free_volume, dimension)


def _in_dimension(equation: Callable[[Any, int], Any], dimension: int) -> Equation:
    """Return an equation of state for one dimension, of the same name."""

    def fixed(packing_fraction: Any) -> Any:
        return equation(packing_fraction, dimension)

    fixed.__name__ = equation.__name__
    return fixed


def equations(dimension: int) -> dict[str, Equation]:
    """Equations of state of the fluid to compare a result with, by name, the best one last.

    Parameters
    ----------
    dimension : int
        d. Beyond 6 there are none.
    """
    if dimension == 1:
        return {"Tonks (exact)": tonks}
    if dimension == 2:
        return {"Henderson": henderson, "Padé of ten virials": best(2)}
    if dimension == 3:
        return {"Carnahan-Starling": carnahan_starling, "Pieprzyk et al.": pieprzyk}
    return {"Padé of the virials": best(dimension)} if 3 < dimension <= 6 else {}


__all__ = ["CLOSE_PACKING", "FREEZING", "MELTING", "best", "equations", "is_stable_fluid", "solid"]
