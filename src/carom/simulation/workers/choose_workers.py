"""How many workers run a system: as many as asked for, or as many as were measured to pay."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from carom import checks
from carom.errors import InputError
from carom.simulation.workers.executive import Executive
from carom.simulation.workers.thread_pool import cores

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState

TWO_WORKERS_FROM: dict[int, int] = {2: 100_000, 3: 290_000}
"""Components from which on two workers were measured to be faster than one, by dimension."""

AT_MOST = 2
"""Workers that are chosen without being asked for: the speed of more has not been measured."""

MOST = 1024
"""Workers that may be asked for: beyond any machine that shares its memory."""


def executive_of(run_state: RunState, workers: int | str) -> Executive | None:
    """Return the workers of a run, or None for a single one; not more than there can be slabs.

    Raises
    ------
    InputError
        If ``workers`` is neither a number nor "auto", or several are asked for and the scene cannot be run in
        windows.
    """
    from carom.engine.domains.decomposition import most_slabs
    from carom.engine.domains.logical_process import obstacle_to_windows

    automatic = workers == "auto"
    if isinstance(workers, str) and not automatic:
        raise InputError(f"cores is {workers!r}; expected a number or 'auto'.")
    count = cores() if automatic else checks.integer(workers, "cores", low=1, high=MOST)
    if automatic and run_state.scene.n < TWO_WORKERS_FROM.get(run_state.scene.dimension, math.inf):
        return None
    if count == 1:
        return None
    engine: Any = run_state.engine
    obstacle = obstacle_to_windows(engine) if run_state.sweeps is None else "its swaps"
    obstacle = obstacle if run_state.volume_moves is None else "its barostat"
    if obstacle is None:
        most = most_slabs(engine.neighbors, run_state.scene.box)
        if most > 1:
            return Executive(run_state, min(count, most, AT_MOST if automatic else MOST))
        obstacle = "its small box"
    if automatic:
        return None
    raise InputError(f"This scene runs on one core only, because of {obstacle}: leave out cores.")
