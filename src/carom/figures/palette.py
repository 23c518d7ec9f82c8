"""The colors of species, quantities and curves: the same in figures, the viewer and other programs."""

from __future__ import annotations

FACES = ("#6f9bc8", "#e3a857", "#7fb685", "#c26a77", "#9b8bb4", "#8c8c8c")
"""Colors of the species, in their order; with more species than colors they repeat."""

SEQUENTIAL = (
    "#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725",
)  # fmt: skip
"""From zero up: the map "viridis" of van der Walt and Smith (2015)."""

DIVERGING = ("#3b4cc0", "#6f92f3", "#aac7fd", "#dddcdc", "#f7b89c", "#e7745b", "#b40426")
"""On both sides of zero: the map "coolwarm" of Moreland (2009)."""

INK = "#1f4e79"
SERIES = (INK, "#b8651b", "#2e7d4f", "#8e3b6f", "#5b5fb0", "#6b6b6b")
"""Of several curves, in their order; with more curves they repeat. They are also readable without color."""
PALE = "#9dbbd8"
GRAY = "#555555"
WARM = "#c0392b"
THEORIES = ((WARM, "-"), ("#14888c", "--"), (GRAY, ":"), ("#7a3ea8", "-."))
"""Color and line of each of several theories in one picture."""


def rgb(color: str) -> tuple[float, float, float]:
    """Return ``"#rrggbb"`` as red, green and blue from 0 to 1."""
    red, green, blue = (int(color[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue


def colors_of(count: int) -> list[tuple[float, float, float]]:
    """Return the colors of `count` species."""
    return [rgb(FACES[k % len(FACES)]) for k in range(count)]
