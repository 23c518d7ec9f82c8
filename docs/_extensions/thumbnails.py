"""Thumbnails of the gallery's cards: one part of a stored picture, with type that reads at 240 pixels.

A curve keeps its data and the names of its axes; numbers and legends stay in the picture itself.
``pictures.py`` makes them again with the pictures they come from.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from example_groups import IMAGES, THUMBNAILS
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from pictures import RENDERED
from PIL import Image, ImageDraw

SIZE = (480, 300)
"""Pixels; a card has about half of them along each side."""
TYPE = 22
"""Height of letters [pixels]."""

Box = tuple[int, int, int, int]


class Part(NamedTuple):
    """What a thumbnail shows of a stored picture."""

    picture: str
    box: Box  # left, top, right, bottom [pixels]
    axes: tuple[str, str] | None = None  # names of both axes of a curve
    legend: Box | None = None  # left out [pixels]


PARTS = {
    "fluid_in_ten_lines": Part("fluid-in-ten-lines", (42, 95, 558, 625)),
    "equation_of_state": Part("equation-of-state", (90, 30, 895, 428), (r"$\eta$", "$Z$"), (92, 0, 400, 150)),
    "finite_size": Part("finite-size", (657, 19, 888, 224), ("$1/N$", "$Z$")),
    "crystal": Part("crystal", (50, 100, 550, 615)),
    "square_well": Part("square-well", (441, 38, 722, 310)),
    "depletion": Part("depletion", (107, 38, 529, 335), ("$r$", "$w/kT$"), (415, 40, 529, 115)),
    "transport": Part(
        "transport", (510, 7, 896, 346), ("time", r"$\langle v(0)v(t)\rangle$"), (740, 8, 894, 60)
    ),
    "melting_of_disks": Part("melting-of-disks-order", (73, 340, 895, 657), (r"$\eta$", "susceptibility")),
    "order_of_disks": Part("order-of-disks", (4, 21, 597, 313)),
    "freezing_of_spheres": Part(
        "freezing-of-spheres", (70, 5, 895, 528), (r"$\eta$", "$P$"), (75, 6, 360, 145)
    ),
    "constant_pressure": Part(
        "constant-pressure", (108, 14, 1114, 658), (r"$\eta$", "$P$"), (110, 14, 490, 235)
    ),
    "disks_27": Part("disks-27", (110, 260, 750, 660)),
    "disks_2000": Part("disks-2000", (300, 53, 543, 205)),
    "caps_on_a_sphere": Part("caps-on-a-sphere", (0, 0, 600, 600)),
    "billiards": Part("billiards", (182, 10, 675, 205)),
    "lorentz_gas": Part("lorentz-gas", (14, 6, 490, 300)),
    "four_balls": Part("four-balls", (18, 30, 307, 318)),
    "cushions_160": Part("cushions-160", (90, 75, 884, 571)),
    "barometric_column": Part(
        "barometric-column", (75, 7, 693, 409), ("height", "density"), (435, 8, 692, 88)
    ),
    "falling_bodies": Part("falling-bodies", (467, 15, 827, 388), ("height", "density"), (640, 14, 826, 118)),
    "shaken_ball": Part("shaken-ball", (64, 27, 698, 409), ("acceleration", "phase")),
    "rosato_bed": Part("rosato-bed", (53, 67, 321, 331)),
    "brazil_nut": Part("brazil-nut", (59, 7, 688, 387), ("cycles", "height")),
    "haffs_law": Part("haffs-law", (75, 7, 698, 406), ("time", "$T$"), (480, 8, 697, 78)),
    "sheared_spheres": Part("sheared-spheres", (64, 7, 437, 365), (r"$\eta$", "viscosity"), (66, 8, 275, 65)),
    "oscillating_shear": Part(
        "oscillating-shear", (72, 5, 612, 385), (r"$\omega$", "modulus"), (78, 8, 440, 85)
    ),
    "brownian_spheres": Part(
        "brownian-spheres", (66, 7, 457, 362), ("time", "displacement²"), (68, 8, 300, 100)
    ),
    "active_disks": Part("active-disks", (307, 22, 560, 275)),
    "swap_liquid": Part("swap-liquid", (377, 29, 893, 351), ("time", "$F_s(k, t)$"), (380, 285, 560, 350)),
    "glassy_relaxation": Part(
        "glassy-relaxation", (87, 38, 529, 335), (r"$\eta$", r"$\tau$"), (90, 40, 265, 115)
    ),
    "two_armies": Part("two-armies", (283, 30, 739, 223)),
}
"""By the name of the example. One whose picture moves has none: its card shows that."""


def bold(pixels: np.ndarray) -> np.ndarray:
    """Return a picture (rows, columns, 3) with lines wider by two pixels: thin ones would not show."""
    padded = np.pad(pixels, ((1, 1), (1, 1), (0, 0)), mode="edge")
    rows, columns, _ = pixels.shape
    around = np.stack([padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3)])
    # The darkest pixel around: the darkest of each channel would mix hues.
    darkest = around.sum(axis=-1, dtype=int).argmin(axis=0)
    return np.take_along_axis(around, darkest[None, ..., None], axis=0)[0]


def thumbnail(part: Part, ending: str = "") -> Image.Image:
    """Return the thumbnail of a part of a stored picture, the dark one if its ``ending`` says so."""
    whole = Image.open(IMAGES / f"{part.picture}{ending}.png").convert("RGB")
    if part.legend:
        ImageDraw.Draw(whole).rectangle(part.legend, fill="white")
    cut = whole.crop(part.box)
    if part.axes is None:
        scale = min(side / length for side, length in zip(SIZE, cut.size, strict=True))
        cut = cut.resize(tuple(round(scale * length) for length in cut.size), Image.Resampling.LANCZOS)
        paper = Image.new("RGB", SIZE, whole.getpixel((0, 0)))
        paper.paste(cut, tuple((side - length) // 2 for side, length in zip(SIZE, cut.size, strict=True)))
        return paper
    figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.imshow(bold(np.asarray(cut)), aspect="auto", interpolation="antialiased")
    axes.set(xticks=[], yticks=[])
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_linewidth(1.5)
    axes.set_xlabel(part.axes[0], fontsize=0.72 * TYPE)
    axes.set_ylabel(part.axes[1], fontsize=0.72 * TYPE)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])


def store_thumbnails() -> None:
    """Store the thumbnail of every card."""
    THUMBNAILS.mkdir(exist_ok=True)
    for name, part in PARTS.items():
        for ending in ("", "-dark") if part.picture.startswith(RENDERED) else ("",):
            path = THUMBNAILS / f"{name.replace('_', '-')}{ending}.png"
            thumbnail(part, ending).quantize(64, dither=Image.Dither.NONE).save(path, optimize=True)
