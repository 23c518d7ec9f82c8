"""What Carom uses of Numba that Numba promises to nobody, and what is left out where it is missing.

Each such part only saves time; without it the public way is taken, which gives the same bits. A part is left
out where it cannot be set up, and, with a version of Numba that Carom has not been tested with, where a trial
of it fails before the first thing is compiled.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numba

TESTED = ((0, 62), (0, 68))
"""The first and the last version of Numba with which every part is known to work."""

MISSING: dict[str, str] = {}
"""Why a part is left out, by its name."""

TRIALS: list[tuple[str, Callable[[], bool]]] = []
"""Functions that use a part, and tell whether it did what it should."""

_TOLD: set[str] = set()


def has(part: str) -> bool:
    """Tell whether a part is used."""
    return part not in MISSING


def leave_out(part: str, reason: Exception | str) -> None:
    """Do without a part."""
    what = f"{type(reason).__name__}: {reason}" if isinstance(reason, Exception) else reason
    MISSING.setdefault(part, (what.strip() or "no reason given").splitlines()[0])


def trial(part: str):
    """Add a function to the trials of a part."""

    def decorate(function):
        TRIALS.append((part, function))
        return function

    return decorate


def tested() -> bool:
    """Tell whether Carom has been tested with this version of Numba."""
    version = tuple(int("".join(filter(str.isdigit, word)) or 0) for word in numba.__version__.split(".")[:2])
    return TESTED[0] <= version <= TESTED[1]


def try_out(*parts: str) -> None:
    """Try parts, or all, where that has not been done, and leave out what fails."""
    if tested():
        return
    for part, function in [each for each in TRIALS if not parts or each[0] in parts]:
        TRIALS.remove((part, function))
        if has(part):
            try:
                if not function():
                    leave_out(part, "its trial gave a wrong result")
            except Exception as error:  # whatever a Numba of tomorrow raises
                leave_out(part, error)


def warn_of_missing() -> None:
    """Say once what is left out."""
    missing = sorted(MISSING.keys() - _TOLD)
    if missing:
        _TOLD.update(missing)
        warnings.warn(
            f"Numba {numba.__version__} lacks what Carom uses of it to save time: "
            + "; ".join(f"{part} ({MISSING[part]})" for part in missing)
            + ". Results are the same without; compiling or running takes longer. "
            + "With Numba {}.{} to {}.{} all is there.".format(*TESTED[0], *TESTED[1]),
            numba.NumbaPerformanceWarning,
            stacklevel=2,
        )
