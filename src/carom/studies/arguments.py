"""Arguments that all studies take: unknown ones, and the number of cores."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from carom import checks
from carom.errors import InputError
from carom.scene.keywords import MEANT

RENAMED = {
    "packing_fractions": "packing_fraction",
    "workers": "cores",
    "until_pressure": "until_Z",
    "k": "dimension",
    "initial": "lattice",
    "seeds": "tries",
    "hours": "walltime",
    "max_walltime": "walltime",
}
"""What other programs, and a guess, call the arguments of a study."""


def refuse_unknown(function: str, given: Mapping[str, Any], known: Iterable[str]) -> None:
    """Raise InputError if an argument is none of those known, with the name that is meant."""
    known = tuple(known)
    for name in given:
        if name in known:
            continue
        meant = {**MEANT, **RENAMED}.get(name)
        hint = f"; it is called {meant}" if meant in known else checks.suggestion(name, known)
        raise InputError(f"{function} has no argument {name!r}{hint}.")


def processes(cores: int | str | None) -> int | None:
    """Return a number of processes or threads; None, for as many as there are cores, of "auto" and None."""
    if cores is None or cores == "auto":
        return None
    return checks.integer(cores, "cores", low=1)
