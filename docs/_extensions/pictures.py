"""Run examples at full size and store what the gallery shows: pictures and printed lines.

``python docs/_extensions/pictures.py NAME [NAME ...]``, as ``lorentz_gas``, or ``viewer`` for its
pictures, which Chromium takes. Each picture gets at most 900 pixels and 256 colors, and as many fewer as
keep it below 150 kB. Thumbnails for cards, and beside each picture one for the dark theme, are made of them:
``pictures.py dark`` makes those of all again.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
SUFFIXES = {b"\x89PNG": ".png", b"GIF8": ".gif"}
SIZES = ((900, 256), (900, 64), (900, 16), (720, 16), (560, 16), (480, 8))
"""Widths [pixels] and numbers of colors, the finest first."""
MOST = 150_000
"""Bytes of a picture."""


DARK = np.array([19.0, 20.0, 22.0])
"""The dark theme's ground."""
STYLE = Path(__file__).with_name("dark.mplstyle")
"""The same for matplotlib."""
RENDERED = ("viewer", "crystal", "fluid-in-ten-lines", "caps-on-a-sphere")
"""Beginnings of names of pictures with light and shade: for the dark theme they are drawn again."""


class Failed(Exception):
    """An example that ended with an error."""


def executed(script: Path, folder: Path, *arguments: str) -> tuple[dict[str, Path], str]:
    """Run an example in a folder of its own.

    Returns
    -------
    pictures : dict of str to Path
        What it drew, by the names under which the gallery keeps them; if it is rendered, on both grounds.
    printed : str
        What it printed. Paths begin at the folder.

    Raises
    ------
    Failed
        If the example ends with an error.
    """
    pictures, printed = _executed(script, folder, arguments)
    if script.stem.replace("_", "-").startswith(RENDERED):
        dark, _ = _executed(script, folder / "dark", arguments, {"MATPLOTLIBRC": str(STYLE)})
        pictures |= {
            f"{Path(name).stem}-dark.png": path for name, path in dark.items() if name.endswith(".png")
        }
    return pictures, printed


def _executed(
    script: Path, folder: Path, arguments: tuple[str, ...], variables: dict[str, str] | None = None
) -> tuple[dict[str, Path], str]:
    """Return what an example drew with environment variables, and what it printed."""
    folder.mkdir(parents=True)
    command = [sys.executable, str(script), *arguments, "--out", str(folder / "results")]
    environment = {**os.environ, "MPLBACKEND": "Agg", **(variables or {})}
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
    """Write a picture with the most pixels and colors that fit."""
    picture = Image.open(source).convert("RGB")
    for width, colors in SIZES:
        width = min(width, picture.width)
        height = round(picture.height * width / picture.width)
        small = picture.resize((width, height), Image.Resampling.LANCZOS)
        small.quantize(colors, dither=Image.Dither.NONE).save(target, optimize=True)
        if target.stat().st_size <= MOST:
            return


def darkened(picture: Image.Image) -> Image.Image:
    """Return a picture on the dark theme's ground: white paper is taken off, black ink turns white.

    What has a color keeps its hue, as no filter that inverts a picture does.
    """
    shown = np.asarray(picture.convert("RGB"), float)
    high, low = shown.max(axis=2, keepdims=True), shown.min(axis=2, keepdims=True)
    cover = 1.0 - low / 255.0  # of the ink
    ink = (shown - 255.0 * (1.0 - cover)) / np.maximum(cover, 1e-9)
    # Gray is turned, a color made lighter: dark blue becomes light blue.
    color = np.minimum(3.0 * (high - low) / np.maximum(255.0 * cover, 1e-9), 1.0)
    light = 230.0 - 0.35 * ink
    lighter = ink + (255.0 - ink) * 0.65 * (1.0 - ink.mean(axis=2, keepdims=True) / 255.0)
    ink = color * lighter + (1.0 - color) * light
    mixed = cover * ink + (1.0 - cover) * DARK
    return Image.fromarray(np.clip(mixed, 0.0, 255.0).round().astype(np.uint8))


def store_dark(folder: Path = IMAGES) -> None:
    """Store the dark one beside every figure of a folder."""
    for path in folder.rglob("*.png"):
        if not path.stem.startswith(RENDERED) and not path.stem.endswith("-dark"):
            dark = darkened(Image.open(path))
            dark.quantize(128, dither=Image.Dither.NONE).save(
                path.with_name(f"{path.stem}-dark.png"), optimize=True
            )


def store(name: str) -> None:
    """Run one example and keep its pictures (those that do not move) and its output."""
    with tempfile.TemporaryDirectory() as folder:
        pictures, printed = executed(ROOT / "examples" / f"{name}.py", Path(folder, "run"))
        for own, path in pictures.items():
            if own.endswith(".png"):
                shrink(path, IMAGES / own)
    IMAGES.joinpath(f"{name.replace('_', '-')}.txt").write_text(printed, encoding="utf-8")


def store_viewer() -> None:
    """Store what the viewer shows of a replay of disks, and of a slab of a mixture, in both themes."""
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
            "viewer": (carom.view(log, title="100 disks"), "time=2.3&chosen=12"),
            "viewer-slab": (
                carom.view(frames, title="200 spheres of two species"),
                "frame=8&chosen=20&color=speed&slab=y&thick=0.7",
            ),
        }
        for name, (view, look) in views.items():
            page = view.save(Path(folder, f"{name}.html")).as_uri()
            for dark, ending in enumerate(("", "-dark")):
                picture = Path(folder, f"{name}{ending}.png")
                command = ["chromium", "--headless=new", "--no-sandbox", "--use-angle=swiftshader"]
                command += ["--window-size=900,600", "--virtual-time-budget=4000", f"--screenshot={picture}"]
                subprocess.run([*command, f"{page}#{look}&dark={dark}"], check=True, capture_output=True)
                shrink(picture, IMAGES / picture.name)


if __name__ == "__main__":
    for asked in sys.argv[1:]:
        {"viewer": store_viewer, "dark": lambda: None}.get(asked, lambda name=asked: store(name))()
        print(asked)
    from thumbnails import store_thumbnails

    store_thumbnails()
    store_dark()
