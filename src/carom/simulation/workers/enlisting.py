"""How many workers run a system: as many as asked for, or as many as were measured to pay."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING

from carom import checks
from carom.errors import InputError
from carom.simulation.workers.team import Team

if TYPE_CHECKING:
    from carom.simulation.machine import Machine

WORTHWHILE: dict[int, int] = {2: 600_000}
"""Components from which on two workers were measured to be 1.2 times as fast as one or more, by dimension."""

AT_MOST = 2
"""Workers that are chosen without being asked for: the speed of more has not been measured."""

MOST = 1024
"""Workers that may be asked for: beyond any machine that shares its memory."""


def team_of(machine: Machine, workers: int | str) -> Team | None:
    """Return the workers of a machine, or None for a single one.

    Raises
    ------
    InputError
        If ``workers`` is neither a number nor "auto", or several are asked for and the scene cannot be run in
        windows.
    """
    from carom.engine.windows.parts import obstacle_to_windows

    automatic = workers == "auto"
    if isinstance(workers, str) and not automatic:
        raise InputError(f"workers is {workers!r}; expected a number or 'auto'.")
    count = _cores() if automatic else checks.integer(workers, "workers", low=1, high=MOST)
    if automatic and machine.scene.n < WORTHWHILE.get(machine.scene.dimension, math.inf):
        return None
    if count == 1:
        return None
    obstacle = obstacle_to_windows(machine.engine)
    if obstacle is None:
        return Team(machine, min(count, AT_MOST) if automatic else count)
    if automatic:
        return None
    raise InputError(f"This scene runs on one worker only, because of {obstacle}: leave out workers.")


def _cores() -> int:
    """Return the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
