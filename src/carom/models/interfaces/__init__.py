"""What the engine asks of a model: every question, with its default where there is one, and no answer.

A model is a named tuple of numbers, tuples and arrays: what the compiler sees. A question is a method of the
base class of its kind; its body is the answer of models that have no other. The value that users write makes
the model (:class:`Interaction`, :class:`Motion`, :class:`Impact`, and :class:`Obstacle` for what is fixed).

Arrays with one item a particle have n + 1 items: the last is of a padding row, which nobody meets
(:meth:`Particles.with_padding`). Times and speeds are in the engine's unit of time (:meth:`Particles.speed`).

These parameters mean the same everywhere:

motion, walls : model
    The motion of the particles; the walls of the box, or None.
i, j : int
    Particles: indices of the model's arrays.
rr, rv, vv : float
    r.r [length^2], r.v and v.v of j relative to i, at the time ``now``.
now : float
    Time since the beginning of the epoch.
axis : int
    Number of an axis, from 0. A vector is asked for one coordinate at a time.
x, v : float or (d,) float64 arrays
    Position of a center [length] and velocity: one coordinate or all of them.
t : float
    Time from now.
radius, growth : float
    Radius of a particle [length], and the rate at which it grows.
normal : (d,) float64 array
    Unit vector.
scene : Scene
    The scene, already checked but for this value.
particles : Particles
    The particles.
positions, radii : (n, d) and (n,) arrays
    Centers and radii [length].
box : sequence of d floats
    Edges [length].
periodic : sequence of d bools
    Which axes are periodic.
"""
