"""What files hold of models: interactions, motions, impacts, paths and obstacles as plain values.

A value that a file can hold has ``to_table()``. ``carom.models.files.tables`` makes it again.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from carom.errors import InputError
from carom.models import obstacles
from carom.models.questions.obstacle import Obstacle


def holds(value: Any) -> bool:
    """Tell whether a file can hold a value, and all that it is made of."""
    if not hasattr(value, "to_table"):
        return False
    body = getattr(value, "obstacle", None)
    if body is not None and obstacle_to_table(body)["kind"] == "own":
        return False
    return not hasattr(value, "path") or hasattr(value.path, "to_table")


def to_table(value: Any, what: str) -> dict[str, Any]:
    """Return what a file holds of a value.

    Raises
    ------
    InputError
        If it is of a class of one's own.
    """
    if not hasattr(value, "to_table"):
        raise InputError(
            f"The {what} {type(value).__name__} is of a class of one's own, which no file can hold."
        )
    return dict(value.to_table())


def obstacle_to_table(obstacle: Obstacle) -> dict[str, Any]:
    """Return an obstacle as values that JSON and TOML hold; of a class of one's own only its name."""
    for kind, known in obstacles.KINDS.items():
        if type(obstacle) is known:
            return {"kind": kind, **asdict(obstacle)}  # type: ignore[call-overload]
    if hasattr(obstacle, "to_table") and holds(obstacle):
        return to_table(obstacle, "obstacle")
    return {"kind": "own", "class": type(obstacle).__name__, "name": obstacle.name}
