"""Links within pages of a documentation that was built."""

import re
from pathlib import Path


def dead_links(html: Path) -> list[str]:
    """Return the links within a built documentation that lead to no file or no anchor."""
    anchors, links = {}, []
    for page in html.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        anchors[page.resolve()] = set(re.findall(r'\bid="([^"]+)"', text))
        links += [(page, link) for link in re.findall(r'<a\b[^>]*\bhref="([^"]+)"', text)]
    assert len(links) > 1000
    dead = []
    for page, link in links:
        if re.match(r"[a-z]+:", link):
            continue
        target, _, anchor = link.partition("#")
        to = (page.parent / target).resolve() if target else page.resolve()
        if not to.exists() or (anchor and to in anchors and anchor not in anchors[to]):
            dead.append(f"{page.relative_to(html)} -> {link}")
    return dead
