"""Run examples at full size and store what the gallery shows: pictures and printed lines.

``python docs/_extensions/pictures.py NAME [NAME ...]``, as ``lorentz_gas``. Each picture gets at most
900 pixels and 64 colours, and as many fewer as keep it below 150 kB.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
SIZES = ((900, 64), (900, 16), (720, 16), (560, 16), (480, 8))
"""Widths [pixels] and numbers of colours, the finest first."""
MOST = 150_000
"""Bytes of a picture."""


def shrink(source: Path, target: Path) -> None:
    """Write a picture with the most pixels and colours that fit."""
    picture = Image.open(source).convert("RGB")
    for width, colours in SIZES:
        width = min(width, picture.width)
        height = round(picture.height * width / picture.width)
        small = picture.resize((width, height), Image.Resampling.LANCZOS)
        small.quantize(colours, dither=Image.Dither.NONE).save(target, optimize=True)
        if target.stat().st_size <= MOST:
            return


def store(name: str) -> None:
    """Run one example and keep its pictures and its output."""
    stem = name.replace("_", "-")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "results")
        command = [sys.executable, str(ROOT / "examples" / f"{name}.py"), "--out", str(out)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
        found = sorted(path for path in Path(folder).rglob("*.png") if "tasks" not in path.parts)
        for path in found:
            own = stem if len(found) == 1 else f"{stem}-{path.stem.replace('_', '-')}"
            shrink(path, IMAGES / f"{own}.png")
        lines = [line for line in done.stdout.splitlines() if folder not in line]
    IMAGES.joinpath(f"{stem}.txt").write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    for asked in sys.argv[1:]:
        store(asked)
        print(asked)
