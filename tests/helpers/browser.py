"""What Chromium shows of a page, and what happens when a hand touches it. One browser serves all tests."""

from __future__ import annotations

import atexit
import base64
import functools
import io
import itertools
import json
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from helpers.needs import chromium, skip_without

SIZE = (640, 480)

FLAGS = (
    "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--host-resolver-rules=MAP * ~NOTFOUND", "--hide-scrollbars",
    "--allow-file-access-from-files", "--remote-debugging-pipe",
)  # fmt: skip

READY = "location.protocol === 'file:' && document.body.dataset.drawn === '1'"


class Browser:
    """Headless Chromium without a GPU, driven through its debugging pipe."""

    def __init__(self):
        skip_without("Chromium")
        import fcntl

        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        theirs_in, ours_out = os.pipe()
        ours_in, theirs_out = os.pipe()
        # Chromium reads its commands from 3 and answers on 4.
        high = [fcntl.fcntl(end, fcntl.F_DUPFD, 100) for end in (theirs_in, theirs_out)]
        self.process = subprocess.Popen(
            [chromium(), *FLAGS, f"--user-data-dir={self.profile.name}", "about:blank"],
            preexec_fn=lambda: (os.dup2(high[0], 3), os.dup2(high[1], 4)),
            pass_fds=(3, 4), stderr=subprocess.DEVNULL,
        )  # fmt: skip
        for end in (theirs_in, theirs_out, *high):
            os.close(end)
        self.commands, self.answers = os.fdopen(ours_out, "wb"), os.fdopen(ours_in, "rb")
        self.numbers, self.session, self.rest = itertools.count(1), None, b""
        self.downloads = Path(self.profile.name) / "downloads"
        self.ask("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(self.downloads))
        tab = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.ask("Target.attachToTarget", targetId=tab, flatten=True)["sessionId"]
        self.ask("Page.enable")

    def close(self):
        self.process.terminate()
        self.process.wait(timeout=60)
        self.profile.cleanup()

    def ask(self, method, **values):
        """Send a command of the debugging protocol, and return its answer; events in between are dropped."""
        number = next(self.numbers)
        message = {"id": number, "method": method, "params": values}
        if self.session:
            message["sessionId"] = self.session
        self.commands.write(json.dumps(message).encode() + b"\0")
        self.commands.flush()
        while True:
            while b"\0" not in self.rest:
                part = self.answers.read1(1 << 20)
                assert part, "Chromium has ended"
                self.rest += part
            text, self.rest = self.rest.split(b"\0", 1)
            answer = json.loads(text)
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]

    def run(self, script):
        """Return the value of an expression in the page, awaited if it is a promise."""
        found = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait(self, condition):
        """Wait until an expression in the page is true."""
        self.run(
            "new Promise((done, failed) => { let left = 2000; const look = () => {"
            f" try {{ if ({condition}) return done(); }} catch {{}}"
            " if (!left--) return failed(Error('waited in vain')); setTimeout(look, 10); }; look(); })"
        )

    def open(self, path, state="", size=SIZE, dark=False):
        """Load a page with the part of its address behind #."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=size[0],
            height=size[1],
            deviceScaleFactor=1,
            mobile=False,
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.ask("Emulation.setEmulatedMedia", features=[scheme])
        self.ask("Page.navigate", url="about:blank")
        self.ask("Page.navigate", url=Path(path).as_uri() + "#" + state)
        self.wait(READY)

    def picture(self):
        """Return what is on the screen, (height, width, 3) in 0 to 1."""
        from matplotlib.image import imread

        raw = self.ask("Page.captureScreenshot", format="png")["data"]
        return imread(io.BytesIO(base64.b64decode(raw)), format="png")[..., :3]

    def mouse(self, kind, x, y, **values):
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1, **values)

    def click(self, x, y):
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def touch(self, kind, *points):
        """Put fingers on the screen, move them, or take them away: touchStart, touchMove, touchEnd."""
        fingers = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        self.ask("Input.dispatchTouchEvent", type=kind, touchPoints=fingers)

    def key(self, key):
        for kind in ("keyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=key)


@functools.cache
def browser():
    """Return the browser of this process, started at the first call; skip the test if there is none."""
    started = Browser()
    atexit.register(started.close)
    return started


def shown(page, tmp_path, state="", size=SIZE):
    """Return what Chromium shows of a page, (height, width, 3) in 0 to 1."""
    browser().open(page.save(tmp_path / "page.html"), state, size)
    return browser().picture()


def where(picture, color):
    """Return the middle and the number of the points that have the hue of a color."""
    flat = picture - picture.mean(axis=2, keepdims=True)
    asked = np.array(color) - np.mean(color)
    size = np.linalg.norm(flat, axis=2)
    alike = (flat @ asked > 0.97 * size * np.linalg.norm(asked)) & (size > 0.1)
    alike[: int(0.15 * len(picture))] = alike[int(0.85 * len(picture)) :] = False  # legend and buttons
    rows, columns = np.nonzero(alike)
    return (columns.mean(), rows.mean(), len(rows)) if len(rows) else (np.nan, np.nan, 0)
