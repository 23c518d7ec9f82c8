"""Import what draws, without what costs time and shows nothing.

A short run would spend more on the import of matplotlib than on its pictures.
"""

from __future__ import annotations

import gc
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from carom.pictures.figure import Picture

_unread = False


def nobody_reads_docstrings() -> None:
    """Say that this process is a command, so that nobody will ask for the help of matplotlib's classes.

    Matplotlib composes the docstrings of all its `set` methods, which takes a third of its import.
    """
    global _unread
    _unread = True


def picture() -> type[Picture]:
    """Return the class of figures, imported with matplotlib where it is not yet."""
    # An import leaves no garbage, but makes so many objects that all others are looked through for some.
    collects = gc.isenabled()
    gc.disable()
    try:
        if _unread:
            _leave_docstrings()
        from carom.pictures.figure import Picture
    finally:
        if collects:
            gc.enable()
    return Picture


def _leave_docstrings() -> None:
    """Have the classes of matplotlib that are still to come do without composed docstrings."""
    from matplotlib.artist import Artist

    # Private: a version of matplotlib without it composes its docstrings.
    if hasattr(Artist, "_update_set_signature_and_docstring"):
        Artist._update_set_signature_and_docstring = classmethod(lambda cls: None)
