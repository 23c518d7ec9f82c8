"""The kinds of models of one's own: which methods are compiled, and which a class must have."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from carom.models.drives import DriveModel
from carom.models.interfaces.contact import ImpactModel
from carom.models.interfaces.convex import ConvexModel
from carom.models.interfaces.interaction import PairModel
from carom.models.interfaces.motion import MotionModel
from carom.models.interfaces.observer import ObserverModel
from carom.models.interfaces.obstacle import ObstacleModel, PathModel
from carom.models.interfaces.steps import SteppedModel


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of model."""

    name: str  # in messages
    questions: dict[str, Any]  # methods that are compiled, and what the engine asks for each
    required: tuple[str, ...]  # those that a class must have
    asked: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """By Carom in Python: parameters of methods, none of facts."""
    may: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """What else is asked in Python where the class has it, as ``asked``."""
    base: Any = None  # the class whose methods answer by default
    padded: bool = False  # its arrays have an item for the padding row
    converted: bool = True  # to the engine's unit of time

    @property
    def decorator(self) -> str:
        """Name of the decorator that makes it."""
        return {"contact law": "impact", "interaction with steps": "interaction"}.get(self.name, self.name)


def _named(base: type, *names: str, **renamed: str) -> dict[str, Any]:
    """Return questions by the names of a user's methods; ``renamed`` are those of another name."""
    return {name: getattr(base, renamed.get(name, name)) for name in (*names, *renamed)}


def signature(question: Any) -> tuple[str, ...]:
    """Return the parameters of the method that answers a question."""
    code = question.__code__
    return "self", *code.co_varnames[1 : code.co_argcount]


REMEMBERED = ("shift_epoch", "copy_state")

OF_SCENES = {"check": ("self", "scene")}

OF_PAIRS = {
    **OF_SCENES,
    "conserves": ("self", "diameter"),
    "steps": ("self", "particles"),
    "steps_of": ("self", "pairs", "distances", "species", "diameter"),
    "penetrable": (),
    "by_radii": (),
    "keeps_momentum": (),
}

SIZES = {"radius": "radius_of", "mass": "mass_of"}
"""Questions, by the names that a user's class writes: it may have fields of these names."""

INTERACTION = Kind(
    "interaction",
    _named(
        PairModel,
        "interaction_time",
        "jump",
        "contact_time",
        "core_square",
        "record_impulse",
        "error_message",
        *REMEMBERED,
        **SIZES,
        growth="growth_of",
    ),
    ("interaction_time", "jump"),
    {"reach": ("self", "scene")},
    OF_PAIRS,
    base=PairModel,
    padded=True,
)
STEPPED = Kind(
    "interaction with steps",
    _named(
        SteppedModel,
        "step_time",
        "step_jump",
        "step_core_square",
        "start_steps",
        "record_impulse",
        "error_message",
        *REMEMBERED,
        **SIZES,
    ),
    ("step_time", "step_jump"),
    {"reach": ("self", "scene"), "energies": ("self",), "step_of": ("self", "distance")},
    OF_PAIRS,
    base=SteppedModel,
    padded=True,
)
MOTION = Kind(
    "motion",
    _named(
        MotionModel,
        "position",
        "velocity",
        "exit_time",
        "carry",
        "push_direction",
        "meeting_time",
        "rest_speed",
        "normal_acceleration",
        "rebound_speed",
        "bend",
        "push",
        "meeting",
        "wall_meeting",
    ),
    ("position", "velocity"),
    base=MotionModel,
    may={**OF_SCENES, "conserves": ("self", "axis"), "straight": (), "curved": ()},
)
IMPACT = Kind(
    "contact law",
    _named(ImpactModel, "transfer", "exchanged_part", *REMEMBERED),
    ("transfer",),
    base=ImpactModel,
    may={**OF_SCENES, "elastic": (), "adds_energy": ()},
    padded=True,
)
OF_OBSTACLES = (
    "encounter", "outward", "is_periodic", "anchor", "arrival", "fall", "recoil", "surface_speed",
    "surface_velocity", "at_time", "rest_speed", "time_to_moving", *REMEMBERED,
)  # fmt: skip

OBSTACLE = Kind(
    "obstacle",
    _named(ObstacleModel, *OF_OBSTACLES),
    ("encounter", "outward"),
    {"gap": ("self", "positions", "radii", "box", "periodic")},
    {
        "check": ("self", "box", "periodic"),
        "glides": ("self", "axis"),
        "area": ("self", "box"),
        "inside": ("self", "box"),
        "confines": ("self", "normal"),
        "outline": ("self", "box", "periodic"),
        "surface": ("self", "box", "periodic"),
        "adds_energy": (),
    },
    base=ObstacleModel,
    padded=True,
)
CONVEX = replace(
    OBSTACLE,
    questions=_named(ConvexModel, "closest", "rounding", *OF_OBSTACLES),
    required=("closest",),
    base=ConvexModel,
)
"""All else follows from the closest point."""
DRIVE = Kind(
    "drive",
    _named(DriveModel, "next_time", "kick"),
    ("next_time", "kick"),
    base=DriveModel,
    may={**OF_SCENES, "pace": ("self", "scene"), "conserves_momentum": ()},
    converted=False,
)
OBSERVER = Kind(
    "observer",
    _named(ObserverModel, "at_pair", "at_obstacle", "at_epoch"),
    (),
    base=ObserverModel,
    may={"add": ("self", "block"), "result": ("self",), "begin": ("self", "scene")},
    converted=False,
)
PATH = Kind(
    "path",
    _named(PathModel, "place", "pace"),
    ("place", "pace"),
    base=PathModel,
    asked={"lowest": (), "highest": (), "period": (), "acceleration": ()},
)
