"""What a keyword of ``Scene`` takes: interactions, motions, contact laws, obstacles and drives, on one shelf.

``from carom.models import Gravity, SquareWell`` imports what is named here, when it is first used. Each is a
value that users write, in one file with the type that the engine compiles for it. A model of one's own
imports all that it needs from ``carom.models.own``.

No model imports the engine or Numba. What the engine asks of models is in ``questions``, and what several of
them compute with in ``mathematics``.
"""

from __future__ import annotations

import importlib
from typing import Any

# Name -> module below this one; imported when first used, so that `import carom.models` stays fast.
_SHELF = {
    # interaction=
    "HardCores": "interactions.hard_cores",
    "SquareWell": "interactions.wells",
    "StepTable": "interactions.wells",
    "from_potential": "interactions.wells",
    "Steps": "interactions.steps",
    "Bonds": "interactions.bonds",
    "chains": "interactions.bonds",
    "rings": "interactions.bonds",
    "Ranges": "interactions.ranges",
    "Kind": "interactions.ranges",
    "CHANGED": "interactions.units",
    "ENTERED": "interactions.units",
    "LEFT": "interactions.units",
    "TIMER": "interactions.units",
    "draw": "interactions.units",
    # motion=
    "FreeFlight": "motions.free_flight",
    "Gravity": "motions.gravity",
    "GreatCircles": "motions.great_circles",
    "Shear": "motions.shear",
    # impact=
    "Restitution": "contacts.restitution",
    "Loss": "contacts.losses",
    "Rough": "contacts.rough",
    # walls=
    "Wall": "obstacles.named_walls",
    # obstacles=
    "Plane": "obstacles.planes",
    "Ball": "obstacles.balls",
    "Cuboid": "obstacles.blocks",
    "Segment": "obstacles.segments",
    "polygon": "obstacles.segments",
    "Arc": "obstacles.arcs",
    "Triangle": "obstacles.triangles",
    "SphericalContainer": "obstacles.containers",
    "CylindricalContainer": "obstacles.containers",
    # shake= of walls and obstacles
    "Sine": "obstacles.paths",
    "Parabolas": "obstacles.paths",
    # drive=
    "Andersen": "drives",
    "Langevin": "drives",
    "Brownian": "drives",
    "WhiteNoise": "drives",
}

__all__ = list(_SHELF)


def __getattr__(name: str) -> Any:
    if name in _SHELF:
        return getattr(importlib.import_module(f"carom.models.{_SHELF[name]}"), name)
    raise AttributeError(f"module 'carom.models' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "own"])
