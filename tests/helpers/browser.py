"""What Chromium shows of a page."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest

SIZE = (640, 480)


def browser():
    """Return the path of a Chromium, or skip the test."""
    names = ("chromium", "chromium-browser", "google-chrome", "chrome")
    path = next((path for name in names if (path := shutil.which(name))), None)
    if path is None:
        pytest.skip("no Chromium is installed")
    return path


def shown(page, tmp_path, state="", size=SIZE):
    """Return what Chromium shows of a page, (height, width, 3) in 0 to 1."""
    from matplotlib.image import imread

    page.save(tmp_path / "page.html")
    picture = tmp_path / "page.png"
    done = subprocess.run(
        [browser(), "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--ignore-gpu-blocklist", "--host-resolver-rules=MAP * ~NOTFOUND", "--hide-scrollbars",
         f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={size[0]},{size[1]}",
         "--virtual-time-budget=2000", f"--screenshot={picture}",
         (tmp_path / "page.html").as_uri() + "#" + state],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return imread(picture)[..., :3]


def where(picture, colour):
    """Return the middle and the number of the points that have the hue of a colour."""
    flat = picture - picture.mean(axis=2, keepdims=True)
    asked = np.array(colour) - np.mean(colour)
    size = np.linalg.norm(flat, axis=2)
    alike = (flat @ asked > 0.97 * size * np.linalg.norm(asked)) & (size > 0.1)
    alike[: int(0.15 * len(picture))] = alike[int(0.85 * len(picture)) :] = False  # legend and buttons
    rows, columns = np.nonzero(alike)
    return (columns.mean(), rows.mean(), len(rows)) if len(rows) else (np.nan, np.nan, 0)
