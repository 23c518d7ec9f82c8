"""Default number of frames and formats of a run: as many as fit a size."""

from __future__ import annotations

import math

from carom import checks
from carom.errors import InputError, warn
from carom.scene.scene import Scene
from carom.scene_file.scene_file import SceneFile

KEPT = 200e6
"""Largest size of the files of a run [bytes], unless its plan asks for more; the event log does not count."""

OTHERS = 1e6
"""Size of tables and pictures [bytes], which depends little on the scene."""

FRAMES = 100
"""Largest number of frames of a run, unless its plan asks for more."""

SMALL = 60e6
"""Size up to which a trajectory is also written as text [bytes], unless the plan names formats: OVITO and ASE
read the default run, of 2048 spheres.
"""

FORMATS = ("h5md", "extxyz")
"""Formats of small trajectories. Larger ones have only the first, which is smaller and faster."""

BYTES = {"h5md": 20, "extxyz": 65, "gsd": 12}
"""Bytes per coordinate of a component in a frame: position, velocity and image."""

FIXED = 20
"""Bytes per component that a trajectory holds once: mass, diameter and species."""

COORDINATES = 3
"""Least number of coordinates in a format; missing ones are 0."""

LARGEST_EXTENDED = 3
"""Largest dimension that formats other than H5MD can hold."""


def amount(plan: SceneFile, scene: Scene, checkpoint: float) -> tuple[tuple[str, ...], int]:
    """Return the formats of a run's trajectories and its number of frames.

    What the plan says of them holds. Otherwise frames get what ``KEPT`` leaves beside the ``checkpoint``
    [bytes]; if not even one fits, and the plan says nothing, there are no trajectories.
    """
    formats, frames = plan.run.write, plan.run.frames
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


def without_trajectory(
    plan: SceneFile, scene: Scene, formats: tuple[str, ...], checkpoint: float
) -> str | None:
    """Return a sentence on why a run has no trajectories; None if it has some, or its plan asks for none."""
    if formats or plan.run.write is not None:
        return None
    return (
        f"No trajectory: with one frame the files of {scene.n} particles would take more than "
        f"{KEPT / 1e6:.0f} MB; the checkpoint alone takes up to {checkpoint / 1e6:.0f} MB. "
        "It holds the state at the end. Set frames = 1 for a frame."
    )


def holdable(asked: tuple[str, ...], dimension: int) -> tuple[str, ...]:
    """Return the requested formats that can hold a dimension."""
    held = tuple(form for form in asked if form == "h5md" or dimension <= LARGEST_EXTENDED)
    if asked and not held:
        raise InputError(
            f"[run] write {', '.join(asked)} holds at most {LARGEST_EXTENDED} dimensions, and the "
            f'scene has {dimension}; use ["h5md"].'
        )
    for form in sorted({*asked} - {*held}):
        warn(
            f"{form} holds at most {LARGEST_EXTENDED} dimensions, and the scene has {dimension}: "
            f"trajectory.{form} is left out."
        )
    if "gsd" in held:
        checks.needed("gsd", '[run] write "gsd"', "'carom[gsd]', or leave it out")
    return held


def _most(scene: Scene, formats: tuple[str, ...], room: float) -> int:
    """Return the number of frames that fit into ``room`` bytes; negative if ``room`` is."""
    size = scene.n * max(scene.dimension, COORDINATES) * sum(BYTES[form] for form in formats)
    return math.floor(room / size) if size else FRAMES
