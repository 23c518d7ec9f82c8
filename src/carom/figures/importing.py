"""A fast import of matplotlib.

In a short run the import would take longer than the pictures.
"""

from __future__ import annotations

import gc
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from carom.figures.figure import Picture

_unread = False


def nobody_reads_docstrings() -> None:
    """State that nobody reads docstrings of matplotlib here, whose composing takes a third of its import."""
    global _unread
    _unread = True


def picture() -> type[Picture]:
    """Return the class of figures, and import matplotlib if needed."""
    # An import leaves no garbage, but its many new objects would trigger full garbage collections.
    collects = gc.isenabled()
    gc.disable()
    try:
        if _unread:
            _leave_docstrings()
        from carom.figures.figure import Picture
    finally:
        if collects:
            gc.enable()
    return Picture


def _leave_docstrings() -> None:
    """Skip the composed docstrings of those classes of matplotlib that are not yet imported."""
    from matplotlib.artist import Artist

    # This name is private: without it, matplotlib composes its docstrings as usual.
    if hasattr(Artist, "_update_set_signature_and_docstring"):
        Artist._update_set_signature_and_docstring = classmethod(lambda cls: None)
