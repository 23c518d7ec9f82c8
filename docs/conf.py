"""Sphinx: MyST pages and numpydoc docstrings; builds without a network."""

import sys
from pathlib import Path

import carom

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

from execution import KEPT, package_digest

project = "Carom"
author = "The Carom developers"
copyright = "The Carom developers, BSD-3-Clause"
version = release = carom.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx-mathjax-offline",
    "sphinx_copybutton",
    "sphinx_design",
    "api",
    "commands",
    "gallery",
    "themes",
]
exclude_patterns = ["_build", "packaging"]
# A build runs the notebook and the gallery's examples, and keeps their results until they or Carom change.
# `sphinx-build -t stored` runs nothing: it shows the results that are committed (decision 16).
# Sphinx puts `tags` into the names of this file.
nb_execution_mode = "off" if tags.has("stored") else "cache"  # noqa: F821
nb_execution_cache_path = str(KEPT / f"notebooks-{package_digest()[:16]}")
nb_execution_raise_on_error = True
nb_execution_timeout = 600  # seconds a cell
autosummary_generate = False
myst_enable_extensions = ["amsmath", "colon_fence", "dollarmath"]
myst_heading_anchors = 3

# Members stand in the order of their source, which is the order they are explained in.
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
# Every reference must lead somewhere. The type of an argument is prose ("(n, d) array"): a link where it is a
# name of Carom, plain text elsewhere.
nitpicky = True
nitpick_ignore_regex = [("py:class", r"(?!carom\.).*")]
# The fields of a record are documented where they are declared.
napoleon_use_ivar = True
# "n" in a type means a length, not one of the attributes of that name.
suppress_warnings = ["ref.python"]

# Quotes are set; two hyphens stay as they are, since they begin options.
smartquotes_action = "qe"

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["carom.css"]
# Prompts and output are not copied.
copybutton_prompt_text = "$ "
html_title = f"Carom {release}"
