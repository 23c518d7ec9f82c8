"""The look of figures: colors, sizes, a pair of axes, titles, and how a figure is saved."""

from __future__ import annotations

import gc
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom.errors import FileError
from carom.figures.palette import SERIES
from carom.paths import replacing
from carom.texts import particles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from carom.figures.figure import Picture

DPI = 160
PIXELS = 100  # per inch, for pictures in 3D, which are drawn pixel by pixel
TITLE = 10.5
DIGIT = 0.09  # width of a digit of a tick label, in inches
TOP = 1.0  # height of a title in units of the axes; given, so that matplotlib does not search for it

# Level of zlib: half of the time of its default, and files that differ by a tenth in size.
PNG_LEVEL = 3


def use() -> None:
    """Take the colors of Carom's figures for all figures of this process: ``C0``, ``C1``, ... are theirs."""
    from matplotlib import rcParams
    from matplotlib.rcsetup import cycler

    rcParams["axes.prop_cycle"] = cycler(color=SERIES)


def shade(number: int) -> str:
    """Return the color of a curve by its number."""
    return SERIES[number % len(SERIES)]


def figure_of(width: float, height: float) -> Figure:
    """Return a figure of a size in inches, without axes."""
    return picture()(width, height, DPI)


def sheet(width: float, height: float, dpi: float = DPI) -> tuple[Figure, Axes]:
    """Return a figure of a size in inches with one pair of axes."""
    figure = picture()(width, height, dpi)
    axes = figure.add_subplot()
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def panels(width: float, height: float, rows: int = 1, columns: int = 1, **how: Any) -> tuple[Figure, Any]:
    """Return a figure [inches], and its panels, each without the frame above it and to the right."""
    figure = figure_of(width, height)
    found = figure.subplots(rows, columns, **how)
    for axes in found.ravel():
        axes.spines[["top", "right"]].set_visible(False)
    return figure, found


def lay_out(figure: Figure, axes: Axes) -> None:
    """Leave room for a title, the labels of both axes and the longest number at the left.

    A layout engine would draw all text twice, which takes as long as the picture.
    """
    figure.set_layout_engine("none")
    width, height = figure.get_size_inches()
    numbers = axes.yaxis.get_major_formatter().format_ticks(axes.get_yticks().tolist())
    # The powers of a logarithmic axis are commands of mathematics, which are longer than what is seen.
    left = 0.5 + max(len(re.sub(r"\\mathdefault|[$^{}]", "", text)) for text in numbers) * DIGIT
    axes.set_position((left / width, 0.55 / height, 1.0 - (left + 0.2) / width, 1.0 - 0.9 / height))


def state(n: int, dimension: int, packing_fraction: float) -> str:
    """Return number, kind and packing fraction, if they have one, of the particles, for a title."""
    count = f"{n:,}".replace(",", "\u202f") if n >= 10_000 else str(n)
    eta = f", η = {packing_fraction:.4g}" if packing_fraction else ""  # points fill nothing
    return f"{count} {particles(dimension, n)}{eta}"


def finished(figure: Figure, axes: Axes, title: str, path: str | os.PathLike[str] | None) -> Figure:
    """Return a figure of curves with its title and, if there are names, a legend, and save it."""
    axes.set_title(title, fontsize=TITLE, y=TOP)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best", fontsize=8.5, framealpha=0.92, edgecolor="none")
    lay_out(figure, axes)
    return saved(figure, path)


def saved(figure: Figure, path: str | os.PathLike[str] | None) -> Figure:
    """Save a ``figure`` whole, if a ``path`` is given, and return it; FileError if it cannot be written."""
    if path is None:
        return figure
    with replacing(Path(path)) as temporary:
        try:
            if temporary.suffix.lower() == ".png":
                _write_png(figure, temporary)
            else:
                from matplotlib import rc_context

                # Text stays text in vector files: journals refuse fonts of Type 3, and words can be found.
                with rc_context({"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none"}):
                    figure.savefig(temporary)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise FileError(
                f"The picture {path} cannot be written ({reason}); choose another place."
            ) from error
    return figure


def _write_png(figure: Figure, path: Path) -> None:
    """Write a figure after a single drawing, and without the constant opacity: a quarter less data."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = canvas.buffer_rgba()
    height, width, _ = pixels.shape
    paper = Image.frombuffer("RGBA", (width, height), pixels, "raw", "RGBA", 0, 1)
    resolution = (figure.dpi, figure.dpi)
    paper.convert("RGB").save(path, format="png", compress_level=PNG_LEVEL, dpi=resolution)


_unread = False


def nobody_reads_docstrings() -> None:
    """State that nobody reads docstrings of matplotlib here, whose composing takes a third of its import."""
    global _unread
    _unread = True


def picture() -> type[Picture]:
    """Return the class of figures, and import matplotlib if needed."""
    # An import leaves no garbage, but its many new objects would trigger full garbage collections.
    collects = gc.isenabled()
    gc.disable()
    try:
        if _unread:
            _leave_docstrings()
        from carom.figures.figure import Picture
    finally:
        if collects:
            gc.enable()
    return Picture


def _leave_docstrings() -> None:
    """Skip the composed docstrings of those classes of matplotlib that are not yet imported."""
    from matplotlib.artist import Artist

    # This name is private: without it, matplotlib composes its docstrings as usual.
    if hasattr(Artist, "_update_set_signature_and_docstring"):
        Artist._update_set_signature_and_docstring = classmethod(lambda cls: None)
