"""The page of HTML that shows frames in a browser, in 3D with light: no network and no server is needed."""

from __future__ import annotations

import base64
import math
import os
import re
from collections.abc import Sequence
from html import escape
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from carom import texts
from carom.bridges.embedding import embed, names_of, upright
from carom.configuration import Configuration
from carom.drawing.shapes import shapes_of
from carom.errors import InputError
from carom.figures.palette import DIVERGING, FACES, SEQUENTIAL
from carom.geometry.neighbors import nearest
from carom.geometry.overlaps import geometry_of_frame
from carom.models.interfaces.obstacle import Obstacle
from carom.paths import write_text
from carom.texts import particles

MARK = '<meta name="generator" content="Carom">'
"""By what a page tells that Carom wrote it."""

SCRIPTS = tuple(
    f"{name}.js"
    for name in (
        "data", "state", "positions", "hexatic", "colors", "camera", "visible", "shaders", "rings", "drawing",
        "overlay", "selection", "saving", "input", "main",
    )
)  # fmt: skip
"""Parts of the script of a page; what a part does at once, it does with those before it."""

LONGEST_HEAD = 1024
"""Bytes at the beginning of a page within which its mark is."""


LARGEST = 300_000
"""Most positions of spheres, 12 bytes each, of a frame or trajectory that shows itself in a notebook."""


MOST_PLACES = 2_000_000
"""Largest number of positions on a page, 24 bytes each with a velocity; of more frames, evenly spaced ones
are kept."""

SIX = 6  # neighbors that psi_6 is computed from

FAST = 2.5
"""Speed at the end of the color scale [root mean square speeds]."""


class View:
    """One self-contained page of HTML, which needs no network and no server.

    Attributes
    ----------
    title : str
        Title of the page.
    data : dict
        Contents of the page, as JSON values.
    """

    def __init__(self, data: dict[str, Any], title: str):
        self.data, self.title = data, title

    @property
    def html(self) -> str:
        """The page."""
        folder = resources.files("carom.drawing") / "viewer"
        template, style, *scripts = (
            (folder / name).read_text(encoding="utf-8") for name in ("template.html", "viewer.css", *SCRIPTS)
        )
        # One scope of its own for all of them.
        script = "\n".join(['"use strict";\n(() => {', *scripts, "})();"])
        title, data = texts.html(self.title), texts.script(self.data)
        parts = {"@TITLE@": title, "@STYLE@": style, "@SCRIPT@": script, "@DATA@": data}
        # In one pass: what is put in may hold such a word itself.
        return re.sub("|".join(parts), lambda found: parts[found[0]], template)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page to the file ``path``.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        path = Path(path)
        write_text(path, self.html)
        return path

    def _repr_html_(self) -> str:
        page = escape(self.html)  # whole: the texts in it are text already
        style = "width:100%;height:480px;border:0"
        return f'<iframe srcdoc="{page}" style="{style}" title="{texts.html(self.title)}"></iframe>'

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        return {"text/html": self._repr_html_(), "text/plain": repr(self)}

    def __repr__(self) -> str:
        return f"<View of {texts.visible(self.title)}: save(path) writes a page of HTML>"


def shown(
    frames: Sequence[Configuration],
    path: str | os.PathLike[str] | None = None,
    *,
    obstacles: Sequence[Obstacle] = (),
    title: str | None = None,
) -> View:
    """Return the page of frames, and write it to a ``path`` if there is one."""
    page = View(of_frames(frames, obstacles), title or title_of(frames[0]))
    if path is not None:
        page.save(path)
    return page


def title_of(frame: Configuration) -> str:
    """Return the title of the page of frames like one: "108 spheres"."""
    return f"{frame.n} {particles(frame.dimension, frame.n)}"


def embedded(frames: Any) -> str | None:
    """Return the viewer of a Frame or of several; None if they are too large for a cell, or not shown."""
    several = [frames] if hasattr(frames, "positions") else frames
    if not len(several) or several[0].dimension > 3 or len(several) * several[0].n > LARGEST:
        return None
    return shown(several)._repr_html_()


def is_page(path: Path) -> bool:
    """Return whether the file ``path`` is a page that :class:`View` wrote."""
    try:
        with path.open("rb") as file:
            return MARK.encode() in file.read(LONGEST_HEAD)
    except OSError:
        return False


def packed(values: Any, kind: Any) -> str:
    """Return an array as base64, little endian."""
    array = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(array.tobytes()).decode("ascii")


def common(frame: Configuration, obstacles: Sequence[Obstacle]) -> dict[str, Any]:
    """Return the data that do not change with time."""
    if not 1 <= frame.dimension <= 3:
        raise InputError(
            f"The viewer shows one to three dimensions, and these frames have {frame.dimension}; "
            "carom.pictures.plots.snapshot shows two of their coordinates."
        )
    shapes = None if frame.dimension == 1 else shapes_of(obstacles, frame.box, frame.periodic)
    kinds = None if frame.species is None else packed(frame.species % 256, "u1")
    names = list(names_of(frame)) if frame.species is not None else []
    reach = 0.5 * float(frame.diameters.max())
    return {
        "n": frame.n,
        "dimension": frame.dimension,
        "box": [*frame.box.tolist(), *[0.0] * (3 - frame.dimension)],
        "boxes": None,
        "periodic": [*frame.periodic, *[False] * (3 - frame.dimension)],
        "reach": reach,
        "radii": packed(0.5 * frame.diameters, "f4"),
        "kinds": kinds,
        "names": names,
        "palette": list(FACES),
        "maps": {"sequential": SEQUENTIAL, "diverging": DIVERGING},
        "positions": None,
        "velocities": None,
        "psi_6": None,
        "top": 1.0,
        "times": [frame.time],
        "marks": None,
        "bonds": None,
        "pairs": None,
        "replay": None,
        "notes": [],
        "subtitle": f"{frame.n} {particles(frame.dimension, frame.n)}",
        "obstacles": {
            "spheres": [] if shapes is None else shapes.spheres.tolist(),
            "lines": [] if shapes is None else shapes.segments.tolist(),
            "triangles": [] if shapes is None else shapes.triangles.tolist(),
        },
    }


def of_frames(frames: Sequence[Configuration], obstacles: Sequence[Obstacle]) -> dict[str, Any]:
    """Return the data of a trajectory; if there are too many frames, evenly spaced ones."""
    if len(frames) == 0:
        raise InputError("There are no frames to show; expected at least one.")
    first = frames[0]
    most = max(MOST_PLACES // first.n, 1)
    stride = math.ceil(len(frames) / most)
    kept = [frames[k] for k in range(0, len(frames), stride)]
    for frame in kept:
        if frame.n != first.n or frame.dimension != first.dimension:
            raise InputError("The frames to show differ in their number of particles or in their dimension.")
    data = common(first, obstacles)
    boxes = np.array([frame.box for frame in kept])
    if (boxes != boxes[0]).any():
        data["boxes"], data["box"] = embed(boxes).tolist(), embed(boxes.max(axis=0)[None])[0].tolist()
        data["notes"].append("the box changes")
    velocities = np.array([frame.velocities for frame in kept])
    diameters = np.array([frame.diameters for frame in kept])
    if (diameters != diameters[0]).any():
        data["radii"], data["reach"] = packed(0.5 * diameters, "f4"), 0.5 * float(diameters.max())
        data["notes"].append("diameters change")
    if stride > 1:
        data["notes"].append(f"one of {stride} of {len(frames)} frames: a page has room for {most}")
    data["positions"] = packed([embed(upright(frame)) for frame in kept], "f4")
    data["times"] = [float(frame.time) for frame in kept]
    data["top"] = FAST * math.sqrt(float(np.mean(np.sum(velocities**2, axis=2)))) or 1.0
    if velocities.any():  # a start has none yet, nor have many files
        data["velocities"] = packed([embed(each) for each in velocities], "f4")
    if first.dimension == 2 and first.n > SIX:
        data["psi_6"] = packed([psi_6(frame) for frame in kept], "f4")
    return data


def psi_6(frame: Configuration) -> np.ndarray:
    """Return argument and modulus of psi_6 of every disk, (n, 2), from its six nearest neighbors."""
    room = geometry_of_frame(frame)
    _, bonds = nearest(room, room.wrapped(frame.positions), SIX)
    x, y = bonds(slice(None)).T
    psi = np.exp(6j * np.arctan2(y, x)).reshape(-1, SIX).mean(axis=1)
    return np.stack([np.angle(psi), np.abs(psi)], axis=1)
