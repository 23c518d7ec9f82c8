"""Pictures for the dark theme: each beside its light one, of which a page shows the one of its theme.

``NAME-dark.png`` beside ``NAME.png`` is found by itself, in pages and on cards. ``pictures.py`` makes it;
of the figures of a notebook, which a build unpacks, it is made here.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from docutils import nodes
from pictures import darkened
from PIL import Image
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform


class Themes(SphinxTransform):
    """Put the dark one beside every picture that has one."""

    default_priority = 400  # before Sphinx collects the files of pictures

    def apply(self) -> None:
        folder = Path(self.env.doc2path(self.env.docname)).parent
        for image in list(self.document.findall(nodes.image)):
            light = Path(image["uri"])
            dark = light.with_name(f"{light.stem}-dark.png")
            root = Path(self.app.srcdir) if light.is_absolute() else folder
            found = root / str(dark).lstrip("/")
            if light.suffix == ".png" and "jupyter_execute" in light.parts and not found.exists():
                picture = Image.open(found.with_name(light.name))
                if np.mean(np.asarray(picture.convert("L")) > 230) > 0.8:  # lines on white paper
                    darkened(picture).save(found)
            if light.suffix == ".png" and found.exists():
                other = image.deepcopy()
                other["uri"] = dark.as_posix()
                image["classes"].append("only-light")
                other["classes"].append("only-dark")
                image.parent.insert(image.parent.index(image) + 1, other)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.add_transform(Themes)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
