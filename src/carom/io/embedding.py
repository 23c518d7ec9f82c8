"""A frame of one, two or three dimensions in the three that other programs assume.

Missing coordinates are 0, and a missing edge is the longest one there is: a positive placeholder along an
axis that is not periodic.
"""

from __future__ import annotations

import numpy as np

from carom.errors import InputError


def embed(vectors: np.ndarray) -> np.ndarray:
    """Return (n, d) vectors, d <= 3, as (n, 3) with zeros in the missing columns."""
    n, dimension = vectors.shape
    result = np.zeros((n, 3), dtype=vectors.dtype)
    result[:, :dimension] = vectors
    return result


def edges(box: tuple[float, ...]) -> tuple[float, ...]:
    """Return the box's edges [length], at least three of them, with placeholders where d < 3."""
    return tuple(box) + (max(box),) * (3 - len(box))


def periodic(dimension: int) -> tuple[bool, ...]:
    """Return which of the (at least three) axes are periodic."""
    return (True,) * dimension + (False,) * (3 - dimension)


def require_at_most_three(dimension: int, format_name: str) -> None:
    """Refuse what does not fit into three columns.

    Raises
    ------
    InputError
        If ``dimension > 3``.
    """
    if dimension > 3:
        raise InputError(
            f"{format_name} holds at most 3 dimensions, and these frames have {dimension}; "
            "write .h5md instead."
        )


def momenta(velocities: np.ndarray, masses: np.ndarray) -> np.ndarray:
    """Momenta whose quotient by the mass is the velocity again, bit for bit where that is possible.

    ASE keeps momenta and divides. ``(m * v) / m`` can miss v by one unit in the last place; one of the two
    neighbours of ``m * v`` then often gives v exactly. Where the significands of m and v multiply to 2 or
    more, the momentum is coarser than the velocity and some v have no momentum at all: those stay one unit
    off, and the velocity itself is kept beside. With masses that are powers of two every velocity is exact.
    """
    mass = masses[:, np.newaxis]
    result = velocities * mass
    # Towards a finite bound, which no finite momentum can overflow.
    for towards in (np.finfo(np.float64).max, np.finfo(np.float64).min):
        neighbour = np.nextafter(velocities * mass, towards)
        better = (result / mass != velocities) & (neighbour / mass == velocities)
        result = np.where(better, neighbour, result)
    return result
