"""States at a sample time: the paper's projecting. Nothing of the run is changed."""

from __future__ import annotations

import numpy as np

from carom.compiling.dispatch import entry
from carom.engine.boundary import count_images
from carom.engine.lattice import position_at, velocity_at
from carom.models.questions.motion import carry


@entry
def project(motion, boundary, state, time, positions, velocities, images):
    """Write everybody's state at ``time`` (in the epoch) to the arrays given, positions in the box."""
    for i in range(np.uint64(len(state.partner))):
        me = state.rows[i]
        x0, v0, t = carry(motion, me.x, me.v, time - me.t, positions[i], velocities[i])
        for axis in range(len(boundary.edges)):
            edge = boundary.edges[axis]
            x = position_at(motion, axis, x0, v0, t, time)
            crossings = np.floor(x * boundary.inverse[axis])
            x -= crossings * edge
            if x >= edge:
                x -= edge
                crossings += 1.0
            elif x < 0.0:  # a division that rounded up: x is a hair below the face
                x = 0.0
            positions[i, axis] = x
            velocities[i, axis] = velocity_at(motion, axis, v0, t)
            count_images(images, i, axis, np.int64(crossings))
