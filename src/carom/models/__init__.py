"""What a keyword of ``Scene`` takes: interactions, motions, contact laws, obstacles and drives, on one shelf.

``from carom.models import Gravity, SquareWell`` imports what is named here, when it is first used. Each is a
value that users write, in one file with the type that the engine compiles for it. A model of one's own
imports all that it needs from ``carom.models.own``.

No model imports the engine. What the engine asks of models is in ``interfaces``, and what several of
them compute with in ``mathematics``.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from carom.models import own as own
    from carom.models.active import Active as Active
    from carom.models.contacts.losses import Loss as Loss
    from carom.models.contacts.restitution import Restitution as Restitution
    from carom.models.contacts.rough import Rough as Rough
    from carom.models.drives import Andersen as Andersen, Brownian as Brownian, Langevin as Langevin
    from carom.models.interactions.bonds import Bonds as Bonds, chains as chains, rings as rings
    from carom.models.interactions.hard_cores import HardCores as HardCores
    from carom.models.interactions.ranges import Kind as Kind, Ranges as Ranges
    from carom.models.interactions.steps import Steps as Steps
    from carom.models.interactions.units import (
        CHANGED as CHANGED,
        ENTERED as ENTERED,
        LEFT as LEFT,
        TIMER as TIMER,
        draw as draw,
    )
    from carom.models.interactions.wells import (
        SquareWell as SquareWell,
        StepTable as StepTable,
        from_potential as from_potential,
    )
    from carom.models.motions.free_flight import FreeFlight as FreeFlight
    from carom.models.motions.gravity import Gravity as Gravity
    from carom.models.motions.great_circles import GreatCircles as GreatCircles
    from carom.models.motions.shear import Shear as Shear
    from carom.models.obstacles.arcs import Arc as Arc
    from carom.models.obstacles.balls import Ball as Ball
    from carom.models.obstacles.blocks import Cuboid as Cuboid
    from carom.models.obstacles.containers import (
        CylindricalContainer as CylindricalContainer,
        SphericalContainer as SphericalContainer,
    )
    from carom.models.obstacles.named_walls import Wall as Wall
    from carom.models.obstacles.paths import Parabolas as Parabolas, Sine as Sine
    from carom.models.obstacles.planes import Plane as Plane
    from carom.models.obstacles.segments import Segment as Segment, polygon as polygon
    from carom.models.obstacles.triangles import Triangle as Triangle
    from carom.models.white_noise import WhiteNoise as WhiteNoise

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
    "WhiteNoise": "white_noise",
    "Active": "active",
}

__all__ = list(_SHELF)


def __getattr__(name: str) -> Any:
    from carom.suggestions import corrected, nearest

    if name in _SHELF:
        found = getattr(importlib.import_module(f"carom.models.{_SHELF[name]}"), name)
        globals()[name] = corrected()(found) if isinstance(found, type) else found
        return found

    alike = nearest(name, __all__)
    hint = f"; did you mean {alike}" if alike else ""
    raise AttributeError(f"module 'carom.models' has no attribute {name!r}{hint}")


def __dir__() -> list[str]:
    return sorted([*__all__, "own"])
