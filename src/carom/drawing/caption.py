"""The strip under each picture of a movie: the time, and what the colors mean."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from carom.texts import visible

if TYPE_CHECKING:
    from PIL import ImageDraw

INK = (51, 61, 74)
PIXELS = 26
"""Pixels of a picture for one of the height of its letters, which are at least LEAST high."""

LEAST = 9
GAP = 0.6  # between entries, in heights of letters

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Caption:
    """What is written under all pictures of a movie."""

    width: int  # of the pictures [pixels]
    decimals: int | None  # of the time; None for six digits
    entries: Sequence[tuple[Color, str]] = ()
    scale: np.ndarray | None = None  # colors (m, 3), drawn as a bar
    ends: tuple[str, str] = ("", "")  # what stands before and behind the bar

    @property
    def letter(self) -> int:
        """Height of the letters [pixels]."""
        return max(round(self.width / PIXELS), LEAST)

    @property
    def height(self) -> int:
        """Height of the strip [pixels], even as many codecs need it."""
        return 2 * self.letter

    def under(self, picture: np.ndarray, time: float) -> np.ndarray:
        """Return a picture (height, width, 3) with the strip under it."""
        from matplotlib import get_data_path
        from PIL import Image, ImageDraw, ImageFont

        font = ImageFont.truetype(str(Path(get_data_path(), "fonts/ttf/DejaVuSans.ttf")), self.letter)
        strip = Image.new("RGB", (self.width, self.height), "white")
        pen = ImageDraw.Draw(strip)
        pen.font = font
        words = f"t = {time:.6g}" if self.decimals is None else f"t = {time:.{self.decimals}f}"
        x, y = 0.5 * self.letter, 0.5 * self.height
        pen.text((x, y), words, fill=INK, anchor="lm")
        # What has no room is left out: the time never is.
        self._meaning(pen, x + pen.textlength(words) + self.letter, self.width - 0.5 * self.letter, y)
        return np.concatenate([picture, np.asarray(strip)])

    def _meaning(self, pen: ImageDraw.ImageDraw, left: float, right: float, y: float) -> None:
        """Draw the bar or the named colors, from the right."""
        letter = self.letter
        if self.scale is not None:
            low, high = (pen.textlength(text) for text in self.ends)
            bar = min(6 * letter, right - left - low - high - 2 * GAP * letter)
            if bar < 2 * letter:
                return
            pen.text((right, y), self.ends[1], fill=INK, anchor="rm")
            start = right - high - GAP * letter - bar
            for k in range(int(bar)):
                color = self.scale[int(k / bar * len(self.scale))]
                pen.line([(start + k, y - 0.4 * letter), (start + k, y + 0.4 * letter)], fill=_bytes(color))
            pen.text((start - GAP * letter, y), self.ends[0], fill=INK, anchor="rm")
            return
        x = right
        for color, name in reversed(self.entries):
            text = visible(name)
            start = x - pen.textlength(text) - 1.3 * letter
            if start < left:
                return
            pen.text((x, y), text, fill=INK, anchor="rm")
            dot = (start, y - 0.5 * letter, start + letter, y + 0.5 * letter)
            pen.ellipse(dot, fill=_bytes(color))
            x = start - letter


def _bytes(color: Sequence[float]) -> tuple[int, ...]:
    return tuple(round(255 * float(part)) for part in color)


def decimals_of(first: float, last: float, count: int) -> int | None:
    """Return how many decimals tell the times of ``count`` frames apart; None if six digits serve better."""
    step = (last - first) / max(count - 1, 1)
    return max(1 - math.floor(math.log10(step)), 0) if 1e-6 < step < 1e6 else None
