"""Run examples at full size and store what the gallery shows: pictures and printed lines.

``python docs/_extensions/pictures.py NAME [NAME ...]``, as ``lorentz_gas``, or ``viewer`` for its two
pictures, which Chromium takes. Each picture gets at most 900 pixels and 256 colours, and as many fewer as
keep it below 150 kB.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
SUFFIXES = {b"\x89PNG": ".png", b"GIF8": ".gif"}
SIZES = ((900, 256), (900, 64), (900, 16), (720, 16), (560, 16), (480, 8))
"""Widths [pixels] and numbers of colours, the finest first."""
MOST = 150_000
"""Bytes of a picture."""


class Failed(Exception):
    """An example that ended with an error."""


def executed(script: Path, folder: Path, *arguments: str) -> tuple[dict[str, Path], str]:
    """Run an example in a folder of its own.

    Returns
    -------
    pictures : dict of str to Path
        What it drew, by the names under which the gallery keeps them.
    printed : str
        What it printed. Paths begin at the folder.

    Raises
    ------
    Failed
        If the example ends with an error.
    """
    folder.mkdir(parents=True)
    command = [sys.executable, str(script), *arguments, "--out", str(folder / "results")]
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise Failed(f"{' '.join(command)} failed:\n{done.stderr[-2000:]}")
    # Told by their first bytes: a script may give the file exactly the name that it was told.
    found = {path: _suffix(path) for path in sorted(folder.rglob("*")) if path.is_file()}
    drawn = [path for path, suffix in found.items() if suffix and "tasks" not in path.parts]
    stem = script.stem.replace("_", "-")
    own = [path.stem.replace("_", "-") for path in drawn]
    names = [stem if len(drawn) == 1 or name == stem else f"{stem}-{name}" for name in own]
    pictures = {f"{name}{found[path]}": path for name, path in zip(names, drawn, strict=True)}
    return pictures, done.stdout.replace(f"{folder}{os.sep}", "").rstrip() + "\n"


def _suffix(path: Path) -> str | None:
    """Return the suffix of a picture, None for other files."""
    with path.open("rb") as file:
        return SUFFIXES.get(file.read(4))


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
    """Run one example and keep its pictures (those that do not move) and its output."""
    with tempfile.TemporaryDirectory() as folder:
        pictures, printed = executed(ROOT / "examples" / f"{name}.py", Path(folder, "run"))
        for own, path in pictures.items():
            if own.endswith(".png"):
                shrink(path, IMAGES / own)
    IMAGES.joinpath(f"{name.replace('_', '-')}.txt").write_text(printed, encoding="utf-8")


def store_viewer() -> None:
    """Store what the viewer shows of a replay of disks, and of a slab of a mixture in the dark theme."""
    import carom

    disks = carom.Scene.random(100, 0.5, dimension=2, seed=1)
    kinds = [carom.Species("large", fraction=0.5), carom.Species("small", fraction=0.5, diameter=0.6)]
    mixture = carom.Simulation(carom.Scene.random(200, 0.25, species=kinds, seed=1), seed=1)
    frames = list(mixture.sample(every=0.1, count=20))
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "events.h5")
        with carom.Simulation(disks, seed=1, event_log=log) as sim:
            sim.run(collisions=2000)
        views = {
            "viewer": (carom.view(log, title="100 disks"), "time=2.3&chosen=12&dark=0"),
            "viewer-dark": (
                carom.view(frames, title="200 spheres of two species"),
                "frame=8&chosen=20&colour=speed&slab=y&thick=0.7&dark=1",
            ),
        }
        for name, (view, look) in views.items():
            picture = Path(folder, f"{name}.png")
            command = ["chromium", "--headless=new", "--no-sandbox", "--use-angle=swiftshader"]
            command += ["--window-size=900,600", "--virtual-time-budget=4000", f"--screenshot={picture}"]
            page = view.save(picture.with_suffix(".html")).as_uri()
            subprocess.run([*command, f"{page}#{look}"], check=True, capture_output=True)
            shrink(picture, IMAGES / picture.name)


if __name__ == "__main__":
    for asked in sys.argv[1:]:
        store_viewer() if asked == "viewer" else store(asked)
        print(asked)
