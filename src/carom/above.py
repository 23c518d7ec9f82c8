"""Calls of a subpackage to one above it, which it cannot import: the package installs the functions.

``Scene.random`` makes a dense scene by a simulation, a frame or a simulation is shown by the viewer or drawn,
a result draws itself or is loaded, an
observable of frames opens files, and a study of one's own is a command. ``carom/__init__.py`` installs
these functions. Every process that uses a part of Carom runs it first, even a worker that imports only a
scene.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from matplotlib.figure import Figure

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


def view(source: Any, path: Any = None, **options: Any) -> Any:
    """Return the page that shows a source, a scene, a frame, several or a simulation, and write it to a file:
    ``carom.pictures.view.view``.
    """
    return _answers["viewed"]()(source, path, **options)


def picture(scene: Any, path: Any) -> Any:
    """Return the picture of a scene: ``carom.pictures.plots.picture``."""
    return _answers["picture"]()(scene, path)


def plotted(frame: Any, obstacles: Any, path: Any) -> Any:
    """Return a picture of a frame: ``carom.pictures.plots.snapshot``."""
    return _answers["plotted"]()(frame, obstacles=obstacles, path=path)


def drawn(result: Any, path: Any = None) -> Figure:
    """Return the picture of a result, and save it at ``path``: ``carom.pictures.results.draw``."""
    figure: Figure = _answers["drawn"]()(result, path)
    return figure


def name_results() -> None:
    """Import every module that has a kind of result, so that its name is known to ``carom.results``."""
    _answers["name_results"]()


def command(study: Any) -> None:
    """Run the command line of a study: ``carom.cli.study.command``."""
    _answers["command"]()(study)


def opened(path: Any, **given: Any) -> Any:
    """Open the frames of a file or of the folder of a run: ``carom.io.trajectory.open_reader``."""
    return _answers["opened"]()(path, **given)
