"""What the realised events of one stretch of a run add up to."""

from __future__ import annotations

from typing import NamedTuple


class Block(NamedTuple):
    """Sums over the collisions of one stretch of time.

    Attributes
    ----------
    duration : float
        Length of the stretch [time].
    collisions : int
        Pair collisions in it.
    virial : float
        Sum of ``r_ij . dp_ij`` over them [mass length^2 / time]; ``m sigma |u_n|`` for equal masses. Over a
        time it is an energy.
    impulses : tuple of float
        Momentum that each wall and obstacle took up [mass length / time], in the order of their numbers.
    momentum_changes : tuple of float
        Change of the weighted momentum of the components that belongs to each of them [mass length / time]
        (see :mod:`carom.observables.momentum_balance`); empty where nobody looked.
    """

    duration: float
    collisions: int
    virial: float
    impulses: tuple[float, ...] = ()
    momentum_changes: tuple[float, ...] = ()
