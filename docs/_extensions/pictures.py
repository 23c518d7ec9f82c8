"""Run examples at full size and store what the gallery shows: pictures and printed lines.

``python docs/_extensions/pictures.py NAME [NAME ...]``, as ``lorentz_gas``. Each picture is scaled to
900 pixels and 64 colours, which keeps it below some 150 kB.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
WIDTH, COLOURS = 900, 64


def store(name: str) -> None:
    """Run one example and keep its pictures and its output."""
    stem = name.replace("_", "-")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "results")
        command = [sys.executable, str(ROOT / "examples" / f"{name}.py"), "--out", str(out)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
        found = sorted(path for path in Path(folder).rglob("*.png") if "tasks" not in path.parts)
        for path in found:
            picture = Image.open(path).convert("RGB")
            if picture.width > WIDTH:
                height = round(picture.height * WIDTH / picture.width)
                picture = picture.resize((WIDTH, height), Image.Resampling.LANCZOS)
            own = stem if len(found) == 1 else f"{stem}-{path.stem.replace('_', '-')}"
            picture.quantize(COLOURS, dither=Image.Dither.NONE).save(IMAGES / f"{own}.png", optimize=True)
        lines = [line for line in done.stdout.splitlines() if folder not in line]
    IMAGES.joinpath(f"{stem}.txt").write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    for asked in sys.argv[1:]:
        store(asked)
        print(asked)
