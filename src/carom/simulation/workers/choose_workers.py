"""How many workers run a system: as many as asked for, or as many as were measured to pay."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from carom import checks
from carom.errors import InputError
from carom.processors import cores

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState
    from carom.simulation.workers.executive import Executive

FEWEST_EACH: dict[int, int] = {2: 50_000, 3: 125_000}
"""Components for each worker from which on several were measured to be faster than one, by dimension."""

SLABS_EACH = 2
"""Of the slabs that there can be, for each worker. With fewer the zones of borders overlap, and more workers
were measured to gain nothing.
"""

MOST = 1024
"""Workers that may be asked for: beyond any machine that shares its memory."""


def automatic(n: int, dimension: int, most: int) -> int:
    """Return how many workers pay: of n components, in a box with room for so many slabs."""
    if dimension not in FEWEST_EACH:
        return 1
    room = max(most // SLABS_EACH, min(most, 2))
    return max(min(cores(), room, n // FEWEST_EACH[dimension]), 1)


def executive_of(run_state: RunState, workers: int | str) -> Executive | None:
    """Return the workers of a run, or None for a single one; not more than there can be slabs."""
    from carom.engine.domains.decomposition import most_slabs
    from carom.engine.domains.logical_process import why_not_parallel

    if isinstance(workers, str) and workers != "auto":
        raise InputError(f"cores is {workers!r}; expected a number or 'auto'.")
    asked = None if isinstance(workers, str) else checks.integer(workers, "cores", low=1, high=MOST)
    if asked == 1:
        return None
    engine: Any = run_state.engine
    obstacle = why_not_parallel(engine) if run_state.sweeps is None else "its swaps"
    obstacle = obstacle if run_state.volume_moves is None else "its barostat"
    if obstacle is None:
        scene, most = run_state.scene, most_slabs(engine.neighbors, run_state.scene.box)
        count = automatic(scene.n, scene.dimension, most) if asked is None else min(asked, most)
        if count > 1:
            from carom.simulation.workers.executive import Executive

            return Executive(run_state, count)
        obstacle = "its small box"
    if asked is None:
        return None
    raise InputError(f"This scene runs on one core only, because of {obstacle}: leave out cores.")
