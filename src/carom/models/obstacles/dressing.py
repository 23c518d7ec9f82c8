"""From an obstacle with keywords to what the engine knows: obstacles that enclose each other.

First comes what moves, around it its surface.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from carom.errors import InputError
from carom.models.contacts.losses import Loss
from carom.models.contacts.restitution import Restitution
from carom.models.obstacles.properties import Properties, properties_of
from carom.models.obstacles.shaken import Shaken
from carom.models.obstacles.surfaces import Surface, Thermal


def dressed(obstacle: Any) -> Any:
    """Return the obstacle that the engine knows: without properties, and enclosed by what stands for them.

    Raises
    ------
    InputError
        If it is shaken, and neither has a normal nor is told a direction.
    """
    if not isinstance(obstacle, Properties) or not properties_of(obstacle):
        return obstacle
    body: Any = replace(obstacle, shake=None, direction=None, impact=None, kT=None, seed=0)
    if obstacle.shake is not None:
        direction = obstacle.natural_direction if obstacle.direction is None else obstacle.direction
        if direction is None:
            raise InputError(
                f"shake of {obstacle.name} needs direction=, one number an axis: a "  # type: ignore[attr-defined]
                f"{type(obstacle).__name__} has no normal."
            )
        body = Shaken(body, direction, obstacle.shake)
    if obstacle.kT is not None:
        return Thermal(body, obstacle.kT, obstacle.seed)
    impact = obstacle.impact
    if isinstance(impact, Loss) or (isinstance(impact, Restitution) and not impact.elastic):
        return Surface(body, impact)
    return body
