"""Every page of the documentation in headless Chromium, as wide as a desktop and as a phone.

``pytest -m slow -n 0 tests/project/test_docs_browser.py``; needs chromium (``CHROMIUM`` names another one).
"""

import functools
import http.server
import json
import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from helpers.needs import chromium

DOCS = Path(__file__).parents[2] / "docs"
WIDTHS = (1300, 390)

# Shows each page in a frame of each width and notes what is wrong with it. The result is left in the
# document, which Chromium prints when all is done.
HARNESS = """<!doctype html><meta charset="utf-8"><pre id="found">running</pre><script>
const pages = PAGES, widths = WIDTHS, found = [];
const wait = (ms) => new Promise((go) => setTimeout(go, ms));
async function look(page, width) {
  const frame = document.createElement("iframe");
  frame.style.cssText = `width:${width}px;height:900px;border:0`;
  frame.src = page;
  document.body.append(frame);
  await new Promise((go) => { frame.onload = go; });
  const view = frame.contentWindow, page_ = frame.contentDocument;
  if (view.MathJax && view.MathJax.startup) await view.MathJax.startup.promise;
  await wait(20);
  const say = (what) => found.push(`${page} at ${width}: ${what}`);
  const root = page_.documentElement;
  if (root.scrollWidth > width + 1) say(`the page is ${root.scrollWidth} wide`);
  for (const pre of page_.querySelectorAll("pre"))
    if (pre.scrollWidth > pre.clientWidth + 1 && !(width < 736 && pre.closest("div.highlight-text")))
      say(`code overflows: ${pre.textContent.slice(0, 60)}`);
  for (const image of page_.images)
    if (image.loading !== "lazy" && image.complete && !image.naturalWidth) say(`no picture ${image.src}`);
  const formulas = page_.querySelectorAll(".math").length;
  const set = page_.querySelectorAll("mjx-container").length;
  if (set < formulas) say(`${formulas} formulas, ${set} set`);
  if (page_.querySelector("mjx-merror")) say("a formula is wrong");
  const code = page_.querySelectorAll("div.highlight pre").length;
  if (page_.querySelectorAll("button.copybtn").length < code) say("code without a copy button");
  for (const asked of view.performance.getEntriesByType("resource"))
    if (new URL(asked.name).host !== location.host) say(`asks the network for ${asked.name}`);
  frame.remove();
}
(async () => {
  for (const page of pages) for (const width of widths)
    try { await look(page, width); } catch (error) { found.push(`${page} at ${width}: ${error}`); }
  document.getElementById("found").textContent = "FOUND" + JSON.stringify(found) + "END";
})();
</script>"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    """A server that does not write to the terminal."""

    def log_message(self, *args):
        pass


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    folder = tmp_path_factory.mktemp("html")
    subprocess.run(
        [sys.executable, "-m", "sphinx", "-q", "-t", "stored", "-b", "html", DOCS, folder],
        check=True,
        timeout=300,
    )
    return folder


@pytest.mark.slow
@pytest.mark.needs("Sphinx", "Chromium")
def test_no_page_overflows_asks_the_network_or_lacks_a_formula(html):
    pages = sorted(str(p.relative_to(html)) for p in html.rglob("*.html") if "_static" not in p.parts)
    pages = [page for page in pages if not page.startswith("_modules")]
    assert len(pages) > 40
    harness = HARNESS.replace("PAGES", json.dumps(pages)).replace("WIDTHS", json.dumps(WIDTHS))
    html.joinpath("harness.html").write_text(harness, encoding="utf-8")
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(html)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        command = [chromium(), "--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1400,1000"]
        command += ["--virtual-time-budget=600000", "--dump-dom"]
        command += [f"http://127.0.0.1:{server.server_port}/harness.html"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=400)
    finally:
        server.shutdown()
    report = re.search(r"FOUND(.*?)END", done.stdout, re.DOTALL)
    assert report, done.stdout[-2000:] + done.stderr[-2000:]
    assert json.loads(report[1].replace("&gt;", ">").replace("&lt;", "<").replace("&amp;", "&")) == []
