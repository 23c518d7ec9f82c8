"""Errors, each with one sentence: what was found, what was expected, what to do."""

import sys
import warnings

from carom.texts import visible

_INSIDE = frozenset(("carom", *sys.stdlib_module_names))


class CaromError(Exception):
    """Base of every error that Carom raises on purpose; its text is one clear sentence."""

    def __str__(self) -> str:
        return visible(super().__str__())

    def _render_traceback_(self) -> list[str]:
        """Return what a notebook shows: the sentence, and no lines of Carom's source."""
        return [f"{type(self).__name__}: {self}"]


class InputError(CaromError, ValueError):
    """The input cannot be used as it is: a wrong type, value, key, unit or file."""


class OverlapError(InputError):
    """Two particles overlap at the start; the text names the pair and the depth."""


class FileError(InputError):
    """A file is missing, truncated, foreign, or must not be overwritten."""


class BusyError(CaromError, RuntimeError):
    """A simulation is used by two threads at one time, or changed by a callback while it runs."""


class CaromWarning(UserWarning):
    """Something a user should know about a result, e.g. too few samples for an error bar."""

    def __str__(self) -> str:
        return visible(super().__str__())


def warn(sentence: str, kind: type[CaromWarning] = CaromWarning) -> None:
    """Warn at the user's line: the nearest one that is neither Carom's nor Python's.

    Parameters
    ----------
    sentence : str
        What is to be known.
    kind : type
        The class of the warning.
    """
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] in _INSIDE:
        level, frame = level + 1, frame.f_back
    warnings.warn(sentence, kind, stacklevel=level)
