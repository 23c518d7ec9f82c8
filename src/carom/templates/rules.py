"""Hares run from the fox that comes near; foxes go for the hare that they saw last."""

import math

from carom.models import ENTERED, TIMER, draw

HARE, FOX = 0, 1


def behave(unit, event):
    """Decide for one unit after an event."""
    if unit.kind == HARE and event.cause == ENTERED and event.kind == FOX:
        for axis in range(2):
            unit.velocity[axis] = -2.0 * event.toward[axis] / event.distance
        unit.timer = 3.0
    elif unit.kind == HARE and event.cause == TIMER and unit.counts[0, FOX] == 0:
        angle = 2.0 * math.pi * draw(unit)
        unit.velocity[0], unit.velocity[1] = 0.3 * math.cos(angle), 0.3 * math.sin(angle)
    elif unit.kind == FOX and event.cause == ENTERED and event.kind == HARE and event.circle == 1:
        unit.target = event.other
        unit.timer = 0.1
    elif unit.kind == FOX and event.cause == TIMER and event.other >= 0:
        for axis in range(2):
            unit.velocity[axis] = 1.5 * event.toward[axis] / event.distance
        unit.timer = 0.5
