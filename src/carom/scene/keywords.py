"""Keywords of a scene that go with every way to begin, and what other words are called here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict

from carom import checks
from carom.errors import InputError
from carom.models.obstacles.named_walls import axes_without

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.models.drives import Drive
    from carom.models.obstacles import Obstacle
    from carom.models.obstacles.named_walls import Walls
    from carom.models.questions.contact import Impact
    from carom.models.questions.interaction import Interaction
    from carom.models.questions.motion import Motion


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

MEANT = {
    "eta": "packing_fraction",
    "phi": "packing_fraction",
    "rho": "density",
    "sigma": "diameter",
    "d": "dimension",
    "N": "n",
    "L": "box",
    "wall": "walls",
    "restitution": "impact: impact=0.9 is a restitution",
    "gravity": "motion: motion=models.Gravity((0, -1))",
    "shear": "motion: motion=models.Shear(rate)",
    "thermostat": "drive, as drive=models.Andersen(kT=1.0, rate=1.0)",
    "kT": "kT of carom.Simulation",
    "elastic_below": "impact: impact=models.Restitution(0.9, elastic_below=...)",
}
"""What other words, and letters of formulas, are called here."""


def refuse_unknown(maker: str, keywords: Mapping[str, Any], known: Iterable[str] = KNOWN) -> None:
    """Raise InputError if a keyword is none that is known, with the name that is meant."""
    known = list(known)
    for name, value in keywords.items():
        if name in known:
            continue
        if name == "periodic":
            hint = f"; {_walls_for(value)}"
        elif name in MEANT:
            hint = f"; it is called {MEANT[name]}"
        else:
            hint = checks.suggestion(name, known)
        raise InputError(f"{maker} has no keyword {name!r}{hint}.")


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
