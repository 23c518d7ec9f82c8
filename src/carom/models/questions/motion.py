"""What the engine asks of a motion between two events."""

from __future__ import annotations

from typing import Any, Protocol

from carom.compiling.registry import optional, required
from carom.models.mathematics.double_double import exact_product, exact_sum, with_product
from carom.models.questions.particles import NEVER, Particles


class Motion(Protocol):
    """A motion as users write it.

    It may also have:

    - ``check(scene)``, as an :class:`Interaction`;
    - ``conserves(axis)``, whether it conserves the total momentum along an axis (true if left out);
    - ``straight = False``, if particles do not fly straight and uniformly between two events;
    - ``curved = True``, if they do not fly straight relative to each other either.
    """

    def model(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""


@required
def position(motion, axis, x, v, t):
    """Return the coordinate at a time ``t`` after it was ``x`` with the velocity ``v``.

    The time may be negative.
    """


@required
def velocity(motion, axis, v, t):
    """Return the velocity's coordinate at a time ``t`` after it was ``v``."""


@optional
def exit_time(motion, axis, x, v, low, high):
    """Return the time until a coordinate leaves the interval from ``low`` to ``high``, and at which end.

    Parameters
    ----------
    motion : model
        The motion.
    axis : int
        The axis.
    x, v : float
        Coordinate and velocity now; x is in the interval up to rounding.
    low, high : float
        The ends [length].

    Returns
    -------
    t : float
        The time, not negative; NEVER if the coordinate stays inside.
    up : int
        1 at the upper end, 0 at the lower one.

    Notes
    -----
    The default is for straight, uniform motion, where only the end ahead can be reached. A motion on curved
    paths answers for both ends, and its value has ``straight = False``.
    """
    up = v > 0.0
    end = high if up else low
    return max((end - x) / v, 0.0) if v != 0.0 else NEVER, up


@optional
def carry(motion, x, v, t, there, then):
    """Move all coordinates of a particle at once, if they depend on each other.

    Parameters
    ----------
    motion : model
        The motion.
    x, v : (d,) arrays
        Position [length] and velocity.
    t : float
        Duration of the motion.
    there, then : (d,) arrays
        A curved motion writes position and velocity after that time into them; they may be x and v.

    Returns
    -------
    x, v, t
        State from which :func:`position` and :func:`velocity` continue, axis by axis, and the remaining
        time. By default nothing has moved; a curved motion returns ``there, then, 0.0``.
    """
    return x, v, t


@optional
def push_direction(motion, axis, x, r, rr):
    """Return a coordinate of the direction in which a contact pushes a particle.

    Parameters
    ----------
    motion : model
        The motion.
    axis : int
        The axis.
    x : float
        Coordinate of the particle [length].
    r : float
        Coordinate of the vector to the other particle [length]; by default the direction is that of r.
    rr : float
        Square of the length of that vector [length^2].
    """
    return r


@optional
def meeting_time(motion, me, other, now, contact, rate, limit, span):
    """Return the time from now until two particles touch, for paths that are curved relative to each other.

    Parameters
    ----------
    motion : model
        The motion.
    me, other : records
        The old events of both: fields x and v, (d,), and t.
    now : float
        Time since the beginning of the epoch.
    contact, rate : float
        Distance of contact now [length], and the rate at which it grows.
    limit : float
        Latest time of interest. For a later contact NEVER may be returned.
    span : float
        Time up to which to search. It is the same in all calls, so that a contact has the same bits in all.

    Returns
    -------
    t : float
        The time, not negative, or NEVER.
    clamped : bool
        Whether the two are already in contact, by rounding.
    """
    return NEVER, False


@optional
def rest_speed(model):
    """Return the least speed at which a particle leaves an obstacle after a contact; by default 0.

    It is asked of the motion, and of obstacles. In a uniform field, or on an obstacle that accelerates, a
    particle at rest would stay in contact, and a lasting contact has no next event.
    """
    return 0.0


@optional
def normal_acceleration(motion, normal):
    """Return the acceleration towards a surface with the unit ``normal``."""
    return 0.0


@optional
def rebound_speed(motion, approach):
    """Return the normal velocity that an elastic contact adds, for a normal speed ``approach`` before it."""
    return 2.0 * approach


@optional
def push(motion, change, v, normal):
    """Add ``change`` along a unit normal to the velocity ``v``, in place.

    Parameters
    ----------
    motion : model
        The motion.
    change : float
        What the contact adds to the velocity along the normal.
    v, normal : sequences of d floats
        Velocity before the contact, and the normal.
    """
    # A contact on a circle is found just outside it, and its distance from the center is rounded alike every
    # time: unit normals are too long by 1e-16 on average. What is lost at every bounce in the same direction,
    # be it a part of 1e-17, adds up over millions. So all is computed with twice the digits, and only the new
    # velocity is rounded.
    along = 0.0
    high, low = 0.0, 0.0
    longer, rest = -1.0, 0.0
    for axis in range(len(normal)):
        along += normal[axis] * v[axis]
        high, low = with_product(high, low, normal[axis], v[axis])
        longer, rest = with_product(longer, rest, normal[axis], normal[axis])
    # Of an elastic contact the change is -2 along / normal^2; the caller had -2 along.
    more = -2.0 * ((high - along) + low) - change * (longer + rest)
    for axis in range(len(normal)):
        product, product_error = exact_product(change, normal[axis])
        total, error = exact_sum(v[axis], product)
        v[axis] = total + (error + (product_error + more * normal[axis]))
