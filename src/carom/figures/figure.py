"""A matplotlib figure that a notebook shows without a magic command."""

from __future__ import annotations

import io
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from carom.figures.palette import SERIES


class Picture(Figure):
    """A figure that pyplot does not know; a notebook shows it as the last value of a cell."""

    def __init__(self, width: float, height: float, dpi: float):
        super().__init__(figsize=(width, height), dpi=dpi, layout="constrained")
        FigureCanvasAgg(self)

    def add_subplot(self, *places: Any, **settings: Any) -> Any:
        """Add axes whose curves have the colors of the paper."""
        axes = super().add_subplot(*places, **settings)
        axes.set_prop_cycle(color=SERIES)
        return axes

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self.savefig(file, format="png")
        return file.getvalue()
