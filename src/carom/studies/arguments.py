"""The number of cores that all studies take."""

from __future__ import annotations

from carom import checks


def processes(cores: int | str | None) -> int | None:
    """Return a number of processes or threads; None, for as many as there are cores, of "auto" and None."""
    if cores is None or cores == "auto":
        return None
    return checks.integer(cores, "cores", low=1)
