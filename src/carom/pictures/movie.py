"""Movies of trajectories, MP4 or GIF, with the light and the colours of the viewer."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from carom import checks
from carom.bridges.palette import FACES, rgb
from carom.errors import InputError
from carom.frame import Frame
from carom.io.formats import Reader
from carom.io.paths import replacing, writing
from carom.io.trajectory import open_reader
from carom.models.interface import Obstacle
from carom.notebook import by_count, watchable
from carom.observables.packing import packing_network
from carom.pictures.render import Camera, rendered
from carom.pictures.view import standing_beside
from carom.pictures.viewdata import FAST, psi_6

COLOURS = ("species", "speed", "psi_6", "rattlers")
SUFFIXES = (".mp4", ".gif")

RAMP = np.array([
    [0.231, 0.298, 0.753], [0.435, 0.573, 0.953], [0.667, 0.780, 0.992], [0.867, 0.863, 0.863],
    [0.969, 0.722, 0.612], [0.906, 0.455, 0.357], [0.706, 0.016, 0.149],
])  # fmt: skip
"""Colours from slow to fast: the map "coolwarm" of Moreland (2009), as in the viewer."""


@watchable("Drawing frames", by_count)
def movie(
    source: str | os.PathLike[str] | Reader | Sequence[Frame],
    path: str | os.PathLike[str],
    *,
    fps: int = 24,
    size: int = 480,
    colour: str = "species",
    obstacles: Sequence[Obstacle] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> int:
    """Make a movie of a trajectory; return the number of its frames.

    Parameters
    ----------
    source : path, Reader or sequence of Frames
        Frames in one to three dimensions, with a constant box.
    path : path
        ``.mp4`` (H.264; needs the package imageio-ffmpeg) or ``.gif``.
    fps : int
        Frames per second.
    size : int
        Length of the longer edge [pixels].
    colour : {"species", "speed", "psi_6", "rattlers"}
        Meaning of the colours. psi_6 is that of the six nearest neighbours, for d = 2. Rattlers are those of
        :func:`carom.observables.packing_network` in each frame.
    obstacles : sequence of obstacles, optional
        Obstacles to draw; by default those of the ``scene.toml`` in the same folder.
    progress : callable or True, optional
        Called as ``progress(done, total)`` after each frame; True shows a bar.

    Raises
    ------
    InputError
        If the suffix or the colour is unknown, there are no frames, a frame is no packing and rattlers are
        asked for, or imageio-ffmpeg is not installed.
    FileError
        If a file cannot be read or written.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(f"{target} has the suffix '{target.suffix}'; expected one of {', '.join(SUFFIXES)}.")
    if colour not in COLOURS:
        raise InputError(f"colour is {colour!r}; expected one of {', '.join(COLOURS)}.")
    fps = checks.integer(fps, "fps", low=1)
    size = checks.integer(size, "size", low=16)
    if isinstance(source, str | os.PathLike):
        if obstacles is None:
            obstacles = standing_beside(Path(source))
        source = open_reader(Path(source))
    if len(source) == 0:
        raise InputError("There are no frames to make a movie of; expected at least one.")
    first = source[0]
    if first.dimension > 3 or (colour == "psi_6" and first.dimension != 2):
        raise InputError(f"A movie coloured by {colour} has no frames of {first.dimension} dimensions.")
    camera = Camera.on(first, size)
    top = FAST * math.sqrt(float(np.mean(np.sum(first.velocities**2, axis=1)))) or 1.0

    def pictures() -> Iterator[np.ndarray]:
        for k in range(len(source)):
            frame = source[k]
            colours = _colours(frame, colour, top, obstacles or ())
            yield rendered(frame, camera, obstacles=obstacles or (), colours=colours)
            if progress is not None:
                progress(k + 1, len(source))

    write = _gif if target.suffix.lower() == ".gif" else _mp4
    with replacing(target) as temporary, writing(target):
        write(temporary, pictures(), camera, fps)
    return len(source)


def _colours(frame: Frame, colour: str, top: float, obstacles: Sequence[Obstacle]) -> np.ndarray | None:
    """Return the colours (n, 3) of the spheres of a frame; None for the colours of species."""
    if colour == "species":
        return None
    if colour == "rattlers":
        backbone = packing_network(frame, obstacles=obstacles).backbone
        return np.where(backbone[:, None], rgb(FACES[0]), rgb(FACES[1]))  # as in the viewer
    if colour == "speed":
        at = np.clip(np.linalg.norm(frame.velocities, axis=1) / top, 0.0, 1.0)
        places = np.linspace(0.0, 1.0, len(RAMP))
        return np.stack([np.interp(at, places, RAMP[:, channel]) for channel in range(3)], axis=1)
    angle, modulus = psi_6(frame).T
    turned = 0.5 + 0.42 * np.cos(angle[:, None] - 2.0 * np.pi / 3.0 * np.arange(3))
    return modulus[:, None] * turned + (1.0 - modulus[:, None]) * 0.78


def _mp4(path: Path, pictures: Iterable[np.ndarray], camera: Camera, fps: int) -> None:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError(
            "An .mp4 needs the package imageio-ffmpeg, which is not installed: pip install 'carom[movie]', "
            "or write a .gif."
        ) from None
    settings: dict[str, Any] = {
        "fps": fps,
        "quality": 8,
        "macro_block_size": 2,
        "output_params": ["-f", "mp4"],
    }
    writer = imageio_ffmpeg.write_frames(str(path), (camera.width, camera.height), **settings)
    writer.send(None)
    for picture in pictures:
        writer.send(np.ascontiguousarray(picture))
    writer.close()


def _gif(path: Path, pictures: Iterable[np.ndarray], camera: Camera, fps: int) -> None:
    from PIL import Image

    # One palette for all frames, so that colours do not flicker.
    images = (Image.fromarray(picture) for picture in pictures)
    first = next(iter(images))
    palette = first.quantize(255)
    rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    settings: dict[str, Any] = {"duration": round(1000 / fps), "loop": 0, "optimize": False}
    palette.save(path, format="GIF", save_all=True, append_images=rest, **settings)
