"""The paper's ``advance``, the old event of a component brought to a later time, and its projecting."""

from __future__ import annotations

import numpy as np

from carom.compiling.entry import entry
from carom.engine.boundary import count_images


def advance(model, state, neighbors, i, now):
    """Bring the old event of component i to the time now, its position into the box."""
    old_event = state.rows[i]
    t = now - old_event.t
    old_event.t = now
    x0, v0, t = model.motion.carry(old_event.x, old_event.v, t, old_event.x, old_event.v)
    for axis in range(len(model.boundary.edges)):
        x = model.motion.position_at(axis, x0, v0, t, now)
        crossings = np.floor(x * model.boundary.inverse[axis])
        if crossings != 0.0:
            x -= crossings * model.boundary.edges[axis]
            count_images(state.images, i, axis, crossings)
            neighbors.on_wrap(i, axis, crossings)
        old_event.x[axis] = x
        old_event.v[axis] = model.motion.velocity_at(axis, v0, t)


def place_at(model, state, i, now, x, v):
    """Write position, in the box, and velocity of component i at the time now into ``x`` and ``v``."""
    old_event = state.rows[i]
    x0, v0, t = model.motion.carry(old_event.x, old_event.v, now - old_event.t, x, v)
    for axis in range(len(model.boundary.edges)):
        x[axis] = model.boundary.in_box(i, axis, model.motion.position_at(axis, x0, v0, t, now))
        v[axis] = model.motion.velocity_at(axis, v0, t)


@entry
def project(motion, boundary, state, time, positions, velocities, images):
    """Write everybody's state at ``time`` (in the epoch) to the arrays given; nothing else changes."""
    for i in range(len(state.partner)):
        old_event = state.rows[i]
        x0, v0, t = motion.carry(old_event.x, old_event.v, time - old_event.t, positions[i], velocities[i])
        for axis in range(len(boundary.edges)):
            edge = boundary.edges[axis]
            x = motion.position_at(axis, x0, v0, t, time)
            crossings = np.floor(x * boundary.inverse[axis])
            x -= crossings * edge
            if x >= edge:
                x -= edge
                crossings += 1.0
            elif x < 0.0:  # a division that rounded up: x is a hair below the face
                x = 0.0
            positions[i, axis] = x
            velocities[i, axis] = motion.velocity_at(axis, v0, t)
            count_images(images, i, axis, crossings)
