"""How much of a run is kept where its plan does not say: as many frames and formats as fit a size."""

from __future__ import annotations

import math
import warnings

from carom.errors import CaromWarning, InputError
from carom.plan.plan import Plan
from carom.scene.scene import Scene

KEPT = 200e6
"""Bytes that the files of a run take at most, unless its plan asks for more; the event log is not counted."""

OTHERS = 1e6
"""Bytes of tables and pictures, which are as large whatever the scene."""

FRAMES = 100
"""Frames of a run at most, unless its plan asks for more."""

SMALL = 20e6
"""Bytes up to which a trajectory is written as text, too, unless the plan says which formats."""

FORMATS = ("h5md", "extxyz")
"""What is written of small trajectories; of others the first alone, which is smaller and faster."""

BYTES = {"h5md": 20, "extxyz": 65, "gsd": 12}
"""Bytes for a coordinate of a component in a frame: its place, its velocity and its image."""

FIXED = 20
"""Bytes for a component in a trajectory, once: its mass, diameter and species."""

COORDINATES = 3
"""Coordinates that a format holds at least; the missing ones are 0."""

LARGEST_EXTENDED = 3
"""Dimensions that formats other than H5MD can hold."""


def amount(plan: Plan, scene: Scene, checkpoint: float) -> tuple[tuple[str, ...], int]:
    """Return the formats of a run's trajectories and its number of frames.

    Parameters
    ----------
    plan : Plan
        What it says about ``[output] trajectory`` and ``[run] frames`` holds, whatever the size.
    scene : Scene
        Its n and d say how large a frame is.
    checkpoint : float
        Bytes of a checkpoint. What it leaves of ``KEPT`` is for frames. If that is less than one, and the
        plan says neither which formats nor how many frames, there are no trajectories.
    """
    formats, frames = plan.output.trajectory, plan.run.frames
    left_open = formats is None and frames is None
    if formats is None:
        fits = (frames or FRAMES) <= _most(scene, FORMATS, SMALL)
        formats = FORMATS if fits else FORMATS[:1]
    if frames is None:
        room = KEPT - OTHERS - checkpoint - FIXED * scene.n * len(formats)
        frames = min(FRAMES, _most(scene, formats, room))
        if frames < 1:
            formats, frames = () if left_open else formats, 1
    return formats, frames


def without_trajectory(plan: Plan, scene: Scene, formats: tuple[str, ...], checkpoint: float) -> str | None:
    """Return why a run whose plan leaves it open has no trajectories, a sentence; None if it has some.

    Parameters
    ----------
    formats : tuple of str
        Of the trajectories.
    checkpoint : float
        Bytes of a checkpoint.
    """
    if formats or plan.output.trajectory is not None:
        return None
    return (
        f"No trajectory: with one frame the files of {scene.n} particles would take more than "
        f"{KEPT / 1e6:.0f} MB; the checkpoint alone takes up to {checkpoint / 1e6:.0f} MB. "
        "It holds the state at the end. Set frames = 1 for a frame."
    )


def holdable(asked: tuple[str, ...], dimension: int) -> tuple[str, ...]:
    """Return those of the formats asked for that can hold so many dimensions.

    Raises
    ------
    InputError
        If none of the formats asked for can, or GSD is asked for and not installed.
    """
    held = tuple(form for form in asked if form == "h5md" or dimension <= LARGEST_EXTENDED)
    if asked and not held:
        raise InputError(
            f"[output] trajectory {', '.join(asked)} holds at most {LARGEST_EXTENDED} dimensions, and the "
            f'scene has {dimension}; use ["h5md"].'
        )
    for form in sorted({*asked} - {*held}):
        warnings.warn(
            f"{form} holds at most {LARGEST_EXTENDED} dimensions, and the scene has {dimension}: "
            f"trajectory.{form} is left out.",
            CaromWarning,
            stacklevel=4,
        )
    if "gsd" in held:
        from importlib.util import find_spec

        if find_spec("gsd") is None:
            raise InputError(
                '[output] trajectory "gsd" needs the package gsd; pip install "carom[gsd]", or leave it out.'
            )
    return held


def _most(scene: Scene, formats: tuple[str, ...], room: float) -> int:
    """Return how many frames fit into so many bytes, negative where there are less than none."""
    size = scene.n * max(scene.dimension, COORDINATES) * sum(BYTES[form] for form in formats)
    return math.floor(room / size) if size else FRAMES
