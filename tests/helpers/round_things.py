"""A scene of several tests of fields: a disk between round things."""

import carom
from carom.models import Ball, SphericalContainer
from carom.models.motions.gravity import Gravity


def around_a_ball():
    """Return one disk between a round container and a ball in its middle."""
    return carom.Scene(
        [[6.0, 2.0]], (10.0, 10.0), velocities=[[3.0, 1.0]], walls=True, motion=Gravity((0.1, -1.0)),
        obstacles=[SphericalContainer((5.0, 5.0), 4.5), Ball((5.0, 5.0), 1.0)],
    )  # fmt: skip
