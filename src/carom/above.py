"""Calls of a subpackage to one above it, which it cannot import: the package installs the functions.

There are three such calls. ``Scene.random`` makes a dense scene by a simulation, the viewer shows scenes, and
frames in a notebook, and scenes are drawn. ``carom/__init__.py`` installs the functions. Every process that
uses a part of Carom runs it first, even a worker that imports only a scene.
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


def view(source: Any, **options: Any) -> Any:
    """Return the viewer of a source: ``carom.pictures.view.view``."""
    return _answers["viewed"]()(source, **options)


def picture(scene: Any, path: Any) -> Any:
    """Return the picture of a scene: ``carom.pictures.plots.picture``."""
    return _answers["picture"]()(scene, path)


def viewed(frames: Any) -> str:
    """Return the viewer of a frame or of several as HTML: ``carom.pictures.view.view``."""
    page: str = view(frames)._repr_html_()
    return page
