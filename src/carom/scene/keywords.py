"""Keywords of a scene that go with every way to begin, and what other words are called here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict

from carom import checks, suggestions
from carom.errors import InputError
from carom.models.obstacles.named_walls import axes_without

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.models.drives import Drive
    from carom.models.interfaces.contact import Impact
    from carom.models.interfaces.interaction import Interaction
    from carom.models.interfaces.motion import Motion
    from carom.models.obstacles import Obstacle
    from carom.models.obstacles.named_walls import Walls


class Keywords(TypedDict, total=False):
    """Keywords of :class:`carom.Scene` that go with every way to begin."""

    walls: Walls
    obstacles: Sequence[Obstacle]
    contact: ArrayLike | None
    pinned: ArrayLike | None
    interaction: Interaction | None
    motion: Motion | None
    impact: float | Impact | None
    drive: Drive | None


KNOWN = tuple(Keywords.__annotations__)

CALLED = {
    "radius": "diameter, twice the radius",
    "restitution": "impact: impact=0.9 is a restitution",
    "elastic_below": "impact: impact=models.Restitution(0.9, elastic_below=...)",
    "gravity": "motion: motion=models.Gravity((0, -1))",
    "shear": "motion: motion=models.Shear(rate)",
    "thermostat": "drive, as drive=models.Andersen(kT=1.0, rate=1.0)",
}
"""What other words are called here."""

ELSEWHERE = {
    **dict.fromkeys(("n", "packing_fraction", "dimension", "density"), "Scene.random and Scene.crystal"),
    **dict.fromkeys(("lattice", "cells", "nearest"), "Scene.crystal"),
    **dict.fromkeys(("positions", "velocities", "box", "diameter", "mass", "species", *KNOWN), "carom.Scene"),
    **dict.fromkeys(("kT", "cores", "seed", "barostat", "swaps", "growth", "tuning"), "carom.Simulation"),
}
"""Keywords of other makers."""


def refuse_unknown(maker: str, keywords: Mapping[str, Any], known: Iterable[str] = ()) -> None:
    """Raise InputError if a keyword is neither of every scene nor ``known``, with the one that is meant."""
    names = [*KNOWN, *known]
    for name in {"periodic", "pbc"} & {*keywords} - {*names}:
        raise InputError(f"{maker} has no keyword {name!r}; {_walls_for(keywords[name])}.")
    suggestions.refuse_unknown(maker, keywords, names, CALLED, ELSEWHERE)


def _walls_for(periodic: Any) -> str:
    """Return what to write in place of ``periodic``."""
    try:
        flags = [bool(each) for each in periodic] if checks.several(periodic) else [bool(periodic)]
    except (TypeError, ValueError):
        flags = []
    if not flags or (periodic is not flags[0] and not checks.several(periodic)):
        return "give walls=: axes without walls are periodic"
    walls = axes_without(flags)
    return f"{f'give walls={walls!r}' if walls else 'leave it out'}: axes without walls are periodic"
