"""Movies of trajectories, MP4 or GIF, with the light and the colors of the viewer."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.bridges.embedding import embed, names_of
from carom.drawing.caption import Caption, decimals_of
from carom.drawing.page import FAST, SIX, psi_6
from carom.drawing.render import Camera, rendered
from carom.errors import InputError
from carom.figures.palette import FACES, SEQUENTIAL, colors_of, rgb
from carom.frame import Frame
from carom.io.formats import Reader
from carom.io.trajectory import open_reader, trajectory_of
from carom.models.interfaces.obstacle import Obstacle
from carom.notebook import by_count, watchable
from carom.observables.packing import network_of
from carom.paths import replacing, writing
from carom.pictures.view import standing_beside

if TYPE_CHECKING:
    from PIL import Image

COLORS = ("species", "speed", "psi_6", "rattlers")
SUFFIXES = (".mp4", ".gif")

MOST_PER_SECOND = 50
"""Frames of a GIF in a second: many programs slow down what lasts less than two hundredths."""

LONGEST = 1920
"""Pixels of the longer edge, which programs that play movies can show."""

LARGEST = 8192
"""Pixels of an edge that H.264 has levels for."""

SHOWN = 16
"""Frames that the palette of a GIF is made from."""

MOST_PIXELS = 1 << 20
"""Pixels that the palette of a GIF is made from."""


@watchable("Drawing frames", by_count)
def movie(
    source: str | os.PathLike[str] | Reader | Sequence[Frame],
    path: str | os.PathLike[str],
    *,
    fps: int = 24,
    size: int = 480,
    color: str = "species",
    obstacles: Sequence[Obstacle] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> int:
    """Make a movie of a trajectory; return the number of its frames.

    Parameters
    ----------
    source : path, Reader or sequence of Frames
        Frames in one to three dimensions. A path leads to a trajectory, or to the folder of a run or packing.
    path : path
        ``.mp4`` (H.264; needs the package imageio-ffmpeg) or ``.gif``.
    fps : int
        Frames per second, at most 50 in a GIF, which counts time in hundredths of a second.
    size : int
        Length of the shorter edge [pixels], at most 8192; less where the longer one would have more than
        1920. The picture has room for the largest box. A strip below has the time, and what the colors mean.
    color : {"species", "speed", "psi_6", "rattlers"}
        Meaning of the colors. Speeds have one scale for all frames. psi_6 is that of the six nearest
        neighbors, for d = 2. Rattlers are those of :func:`carom.observables.packing_network` in each frame.
    obstacles : sequence of obstacles, optional
        Obstacles to draw; by default those of the run in whose folder the trajectory lies.
    progress : callable or True, optional
        Called as ``progress(done, total)`` after each frame; True shows a bar.

    Raises
    ------
    InputError
        If the suffix or the color is unknown, or a GIF is to have more than 50 frames a second. If there are
        no frames. If a frame is no packing and rattlers are asked for, or has
        no seven disks for psi_6. If imageio-ffmpeg is needed and not installed.
    FileError
        If a file cannot be read or written.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(64, 0.3, 2))
    >>> movie(list(sim.sample(every=0.5, count=3)), "disks.gif", size=64)
    3
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(f"{target} has the suffix '{target.suffix}'; expected one of {', '.join(SUFFIXES)}.")
    if color not in COLORS:
        raise InputError(f"color is {color!r}; expected one of {', '.join(COLORS)}.")
    fps = checks.integer(fps, "fps", low=1)
    gif = target.suffix.lower() == ".gif"
    if gif and fps > MOST_PER_SECOND:
        raise InputError(
            f"fps is {fps}, and a GIF shows at most {MOST_PER_SECOND} frames a second; choose fewer, or "
            "write an .mp4."
        )
    size = checks.integer(size, "size", low=16, high=LARGEST)
    if isinstance(source, str | os.PathLike):
        file = trajectory_of(source)
        source = open_reader(file)
        if obstacles is None and len(source):
            obstacles = standing_beside(file, source[0])
    if len(source) == 0:
        raise InputError("There are no frames to make a movie of; expected at least one.")
    first = source[0]
    if first.dimension > 3:
        raise InputError(f"A movie shows up to three dimensions, and these frames have {first.dimension}.")
    if color == "psi_6" and first.dimension != 2:
        raise InputError(
            f"psi_6 colors frames of two dimensions, and these have {first.dimension}; take another color."
        )
    boxes, widest = zip(*((frame.box, frame.diameters.max()) for frame in source), strict=True)
    largest = replace(first, box=np.max(boxes, axis=0), diameters=np.full(first.n, max(widest)))
    camera = Camera.on(largest, size)
    longer, shorter = max(camera.width, camera.height), min(camera.width, camera.height)
    size = max(min(math.ceil(size * longer / shorter), LONGEST), size)
    camera = Camera.on(largest, size)
    top = _top(source) if color == "speed" else 1.0
    decimals = decimals_of(first.time, source[len(source) - 1].time, len(source))
    caption = _caption(first, color, top, camera.width, decimals)

    def picture(k: int) -> np.ndarray:
        frame = source[k]
        try:
            colors = _colors(frame, color, top, obstacles or ())
        except InputError as error:
            raise InputError(f"Frame {k} has no colors by {color}: {error}") from None
        middle = 0.5 * embed(np.asarray(frame.box)[None])[0]
        shown = rendered(frame, replace(camera, middle=middle), obstacles=obstacles or (), colors=colors)
        return caption.under(shown, frame.time)

    with replacing(target) as temporary, writing(target):
        # A GIF has one palette, for which some frames are drawn first.
        drawn = {k: picture(k) for k in _spread(len(source))} if gif else {}
        palette = _palette(list(drawn.values())) if gif else None

        def pictures() -> Iterator[np.ndarray]:
            for k in range(len(source)):
                yield drawn.pop(k) if k in drawn else picture(k)
                if progress is not None:
                    progress(k + 1, len(source))

        if palette is not None:
            _gif(temporary, pictures(), palette, len(source), fps)
        else:
            _mp4(temporary, pictures(), (camera.width, camera.height + caption.height), fps)
    return len(source)


def _top(frames: Reader | Sequence[Frame]) -> float:
    """Return the speed at the end of the color scale, from all frames, as in the viewer."""
    squares = [float(np.mean(np.sum(frames[k].velocities ** 2, axis=1))) for k in range(len(frames))]
    return FAST * math.sqrt(float(np.mean(squares))) or 1.0


def _spread(count: int) -> list[int]:
    """Return the numbers of at most SHOWN of ``count`` frames, evenly spaced from the first to the last."""
    return sorted({round(k) for k in np.linspace(0, count - 1, SHOWN).tolist()})


def _colors(frame: Frame, color: str, top: float, obstacles: Sequence[Obstacle]) -> np.ndarray | None:
    """Return the colors (n, 3) of the spheres of a frame; None for the colors of species."""
    if color == "species":
        return None
    if color == "rattlers":
        backbone = network_of(frame, obstacles=obstacles).backbone
        if not backbone.any():
            raise InputError("its neighbors hold no component in place, so this is no packing.")
        return np.where(backbone[:, None], rgb(FACES[0]), rgb(FACES[1]))  # as in the viewer
    if color == "speed":
        return _mixed(np.clip(np.linalg.norm(frame.velocities, axis=1) / top, 0.0, 1.0))
    if frame.n <= SIX:
        raise InputError(f"psi_6 needs {SIX + 1} disks at least, found {frame.n}; choose another color.")
    return _wheel(*psi_6(frame).T)


def _caption(frame: Frame, color: str, top: float, width: int, decimals: int | None) -> Caption:
    """Return the strip with the meaning of the colors."""
    if color == "speed":
        ramp = _mixed(np.linspace(0.0, 1.0, 256))
        return Caption(
            width, decimals, scale=ramp, ends=("speed 0", f"\N{GREATER-THAN OR EQUAL TO} {top:.3g}")
        )
    if color == "psi_6":
        turns = np.linspace(0.0, 2.0 * np.pi, 256)
        return Caption(
            width, decimals, scale=_wheel(turns, np.ones(256)), ends=("arg \u03c8\u2086 0\u00b0", "360\u00b0")
        )
    names = (
        ("backbone", "rattlers")
        if color == "rattlers"
        else names_of(frame)
        if frame.species is not None
        else ()
    )
    return Caption(width, decimals, entries=list(zip(colors_of(len(names)), names, strict=True)))


def _mixed(part: Any) -> np.ndarray:
    """Return the colors of speeds, in parts of that at the end of the scale."""
    stops = np.array([rgb(color) for color in SEQUENTIAL])
    places = np.linspace(0.0, 1.0, len(stops))
    return np.stack([np.interp(part, places, stops[:, channel]) for channel in range(3)], axis=-1)


def _wheel(angle: np.ndarray, modulus: np.ndarray) -> np.ndarray:
    """Return the colors of complex numbers, as in the viewer."""
    turned = 0.5 + 0.42 * np.cos(angle[:, None] - 2.0 * np.pi / 3.0 * np.arange(3))
    return modulus[:, None] * turned + (1.0 - modulus[:, None]) * 0.78


def _mp4(path: Path, pictures: Iterable[np.ndarray], size: tuple[int, int], fps: int) -> None:
    imageio_ffmpeg = checks.needed("imageio_ffmpeg", "An .mp4", "'carom[movie]', or write a .gif")
    settings: dict[str, Any] = {
        "fps": fps,
        "quality": None,
        "macro_block_size": 2,
        "output_params": ["-crf", "19", "-preset", "slow", "-movflags", "+faststart", "-f", "mp4"],
    }
    writer = imageio_ffmpeg.write_frames(str(path), size, **settings)
    writer.send(None)
    for picture in pictures:
        writer.send(np.ascontiguousarray(picture))
    writer.close()


def _palette(pictures: Sequence[np.ndarray]) -> Image.Image:
    """Return an image with 255 colors that cover all of ``pictures``, the rare ones included."""
    from PIL import Image

    montage = np.concatenate(pictures)
    stride = math.ceil(math.sqrt(montage.size / 3 / MOST_PIXELS))
    part = np.ascontiguousarray(montage[::stride, ::stride])
    return Image.fromarray(part).quantize(255, method=Image.Quantize.MAXCOVERAGE)


def _gif(path: Path, pictures: Iterable[np.ndarray], palette: Image.Image, count: int, fps: int) -> None:
    from PIL import Image

    # One palette for all frames, so that colors do not flicker.
    images = (
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures
    )
    # Durations are whole hundredths of a second; that of a frame takes up what those before it left.
    ends = [round(100 * k / fps) for k in range(count + 1)]
    durations = [10 * (end - start) for start, end in itertools.pairwise(ends)]
    settings: dict[str, Any] = {"duration": durations, "loop": 0, "optimize": False}
    next(images).save(path, format="GIF", save_all=True, append_images=images, **settings)
