"""The kinds of models of one's own: which methods are compiled, and which a class must have."""

from __future__ import annotations

import inspect
from dataclasses import dataclass, field, replace
from typing import Any

from carom.models.drives import DriveModel
from carom.models.mathematics.parabolas import time_to_moving
from carom.models.questions import (
    interaction,
    memory,
    observer,
    obstacle,
    steps,
)
from carom.models.questions.contact import ImpactModel
from carom.models.questions.motion import MotionModel
from carom.models.questions.path import PathModel


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
    ghost: bool = False  # its arrays have an item for the ghost
    converted: bool = True  # to the engine's unit of time

    @property
    def decorator(self) -> str:
        """Name of the decorator that makes it."""
        return {"contact law": "impact", "interaction with steps": "interaction"}.get(self.name, self.name)


def _named(*questions: Any) -> dict[str, Any]:
    return {question.__name__: question for question in questions}


def signature(name: str, question: Any) -> tuple[str, ...]:
    """Return the parameters of the method that answers a question."""
    code = inspect.unwrap(question).__code__
    return "self", *code.co_varnames[1 : code.co_argcount]


REMEMBERED = (memory.shift_epoch, memory.copy_state)

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

INTERACTION = Kind(
    "interaction",
    _named(
        interaction.interaction_time,
        interaction.jump,
        interaction.contact_time,
        interaction.core_square,
        interaction.radius,
        interaction.growth,
        interaction.mass,
        interaction.record_impulse,
        memory.error_message,
        *REMEMBERED,
    ),
    ("interaction_time", "jump"),
    {"reach": ("self", "scene")},
    OF_PAIRS,
    ghost=True,
)
STEPPED = Kind(
    "interaction with steps",
    _named(
        steps.step_time,
        steps.step_jump,
        steps.step_core_square,
        steps.start_steps,
        interaction.radius,
        interaction.mass,
        interaction.record_impulse,
        memory.error_message,
        *REMEMBERED,
    ),
    ("step_time", "step_jump"),
    {"reach": ("self", "scene"), "energies": ("self",), "step_of": ("self", "distance")},
    OF_PAIRS,
    ghost=True,
)
MOTION = Kind(
    "motion",
    _named(
        MotionModel.position,
        MotionModel.velocity,
        MotionModel.exit_time,
        MotionModel.carry,
        MotionModel.push_direction,
        MotionModel.meeting_time,
        MotionModel.rest_speed,
        MotionModel.normal_acceleration,
        MotionModel.rebound_speed,
        MotionModel.push,
        MotionModel.meeting,
        MotionModel.wall_meeting,
    ),
    ("position", "velocity"),
    base=MotionModel,
    may={**OF_SCENES, "conserves": ("self", "axis"), "straight": (), "curved": ()},
)
IMPACT = Kind(
    "contact law",
    _named(ImpactModel.transfer, ImpactModel.exchanged_part, *REMEMBERED),
    ("transfer",),
    base=ImpactModel,
    may={**OF_SCENES, "elastic": (), "adds_energy": ()},
    ghost=True,
)
OBSTACLE = Kind(
    "obstacle",
    _named(
        obstacle.closest,
        obstacle.rounding,
        obstacle.encounter,
        obstacle.outward,
        obstacle.is_periodic,
        obstacle.anchor,
        obstacle.arrival,
        obstacle.fall,
        obstacle.recoil,
        obstacle.surface_speed,
        obstacle.surface_velocity,
        obstacle.at_time,
        obstacle.rest_speed,
        time_to_moving,
        *REMEMBERED,
    ),
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
    ghost=True,
)
CONVEX = replace(OBSTACLE, required=("closest",))
"""All else follows from the closest point."""
DRIVE = Kind(
    "drive",
    _named(DriveModel.next_time, DriveModel.kick),
    ("next_time", "kick"),
    base=DriveModel,
    may={**OF_SCENES, "pace": ("self", "scene"), "conserves_momentum": ()},
    converted=False,
)
OBSERVER = Kind(
    "observer",
    _named(observer.at_pair, observer.at_obstacle, observer.at_epoch),
    (),
    may={"add": ("self", "block"), "result": ("self",), "begin": ("self", "scene")},
    converted=False,
)
PATH = Kind(
    "path",
    _named(PathModel.place, PathModel.pace),
    ("place", "pace"),
    base=PathModel,
    asked={"lowest": (), "highest": (), "period": (), "acceleration": ()},
)
