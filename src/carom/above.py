"""Calls of a subpackage to one above it, which it cannot import: the package installs the functions.

There are three such calls. ``Scene.random`` makes a dense scene by a simulation; a frame or a simulation is
shown by the viewer, or drawn. ``carom/__init__.py`` installs the functions. Every process that uses a part of
Carom runs it first, even a worker that imports only a scene.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

_answers: dict[str, Callable[[], Callable[..., Any]]] = {}


def install(question: str, find: Callable[[], Callable[..., Any]]) -> None:
    """Install the function for a question; ``find()`` imports and returns it at each call."""
    _answers[question] = find


def grown(
    start: Any, diameters: np.ndarray, seed: int | np.random.Generator
) -> tuple[np.ndarray | None, float]:
    """Return positions (n, d) after the spheres of a scene have grown: ``carom.simulation.growth.grown``."""
    found: tuple[np.ndarray | None, float] = _answers["grown"]()(start, diameters, seed)
    return found


def viewed(source: Any, path: Any = None) -> Any:
    """Return the page that shows a frame, several, or a simulation: ``carom.pictures.view.view``."""
    return _answers["viewed"]()(source, path)


def plotted(frame: Any, obstacles: Any, path: Any) -> Any:
    """Return a picture of a frame: ``carom.pictures.plots.snapshot``."""
    return _answers["plotted"]()(frame, obstacles=obstacles, path=path)
