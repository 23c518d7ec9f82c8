"""The lattice of images that tilts under shear, at the start of a run and at the ends of epochs.

Where components are at a time, and relative to each other, the motion says (``models.motions.shear``).
"""

from __future__ import annotations

import numpy as np

from carom.engine.boundary import count_images
from carom.models.motions.shear import GRADIENT, Sheared, tilt_at


def tilt_of(motion, now: float) -> float | None:
    """Return the tilt of the lattice at a time of the epoch; None where none tilts."""
    return float(tilt_at(motion, now)) if isinstance(motion, Sheared) else None


def in_lattice(motion, positions: np.ndarray) -> np.ndarray:
    """Return positions (n, d) at the start as coordinates along the axes of the lattice, in the box."""
    if not isinstance(motion, Sheared) or motion.tilt[0] == 0.0:
        return positions
    found = positions.copy()
    found[:, 0] -= motion.tilt[0] * positions[:, 1]
    return found


def remap(motion, state, edges, length):
    """At the end of an epoch lay the lattice anew if it must be; tell whether all must be scheduled again."""
    if not isinstance(motion, Sheared):
        return False
    motion.tilt[0] += motion.rate * length
    turns = np.rint(motion.tilt[0] / motion.ratio)
    if turns == 0.0:
        return False
    motion.tilt[0] -= turns * motion.ratio
    for i in range(len(state.partner)):
        me = state.rows[i]
        x = me.x[0] + turns * motion.ratio * me.x[GRADIENT]
        crossings = np.floor(x / edges[0])
        me.x[0] = x - crossings * edges[0]
        count_images(state.images, i, 0, crossings)
        shift_images(state.images, i, turns)
    return True


def shift_images(images, i, turns):
    """Refer the images of component i to a lattice whose tilt is less by so many boxes."""
    if images is not None:
        images[i, 0] += int(turns) * images[i, 1]
