"""Sphinx: MyST pages and numpydoc docstrings; builds without a network."""

import carom

project = "Carom"
author = "The Carom developers"
copyright = "The Carom developers, BSD-3-Clause"
version = release = carom.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
]
exclude_patterns = ["_build"]
myst_enable_extensions = ["amsmath", "colon_fence", "dollarmath"]
myst_heading_anchors = 3

# Members stand in the order of their source, which is the order they are explained in.
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
# The fields of a record are documented where they are declared.
napoleon_use_ivar = True
# "n" in a type means a length, not one of the attributes of that name.
suppress_warnings = ["ref.python"]

html_theme = "furo"
html_title = f"Carom {release}"
