"""What a room asks of a room above it, which it cannot import: the package says who answers.

Two calls of users lead upwards. ``Scene.random`` makes a dense scene by a simulation, and a frame in a
notebook shows itself in the viewer. ``carom/__init__.py`` installs both answers. Every process that uses a
part of Carom runs it first, also a worker that imports nothing but a scene.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

_answers: dict[str, Callable[[], Callable[..., Any]]] = {}


def install(question: str, find: Callable[[], Callable[..., Any]]) -> None:
    """Say who answers: ``find()`` imports and returns the function, when it is asked."""
    _answers[question] = find


def grown(start: Any, diameters: np.ndarray, seed: int | np.random.Generator) -> np.ndarray:
    """Return positions (n, d) after the spheres of a scene have grown: ``carom.simulation.growth.grown``."""
    positions: np.ndarray = _answers["grown"]()(start, diameters, seed)
    return positions


def viewed(frames: Any) -> str:
    """Return the viewer of a frame or of several as HTML: ``carom.pictures.view.view``."""
    page: str = _answers["viewed"]()(frames)._repr_html_()
    return page
