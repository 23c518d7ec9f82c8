"""The colours of species: the same in pictures, in the viewer, and in files for other programs."""

from __future__ import annotations

FACES = ("#6f9bc8", "#e3a857", "#7fb685", "#c26a77", "#9b8bb4", "#8c8c8c")
"""Colours of the species, in their order; with more species than colours they repeat."""


def rgb(colour: str) -> tuple[float, float, float]:
    """Return ``"#rrggbb"`` as red, green and blue from 0 to 1."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue


def colours_of(count: int) -> list[tuple[float, float, float]]:
    """Return the colours of `count` species."""
    return [rgb(FACES[k % len(FACES)]) for k in range(count)]
