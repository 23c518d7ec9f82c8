"""Helfand's moments on the way: the method :meth:`carom.Simulation.helfand`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.frame import Frame
from carom.observables.analysis.moments import HelfandCurrents, HelfandMoments
from carom.simulation.run_loop import advance

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.simulation.run_state import RunState
    from carom.simulation.simulation import Simulation


def taken_out(observers: Sequence[Any]) -> tuple[Sequence[Any], bool]:
    """Return observers without :class:`carom.observables.HelfandCurrents`, and whether it was there."""
    if not isinstance(observers, list) and type(observers) is not tuple:
        return observers, False
    others = [each for each in observers if not isinstance(each, HelfandCurrents)]
    return others, len(others) < len(observers)


def check(system: System) -> None:
    """Raise InputError where currents would not be what Helfand's moments need."""
    conserves = getattr(system.interaction, "conserves", None)
    needed = {
        "all axes periodic and no obstacles": all(system.periodic) and not system.obstacles,
        "elastic contacts": system.elastic,
        "steps that lose no energy": conserves is None or conserves(system.diameter),
        "diameters that do not grow": system.rates is None,
        "straight flight": system.straight,
        "double precision": not system.single,
        "at least two components": system.n > 1,
    }
    if all(needed.values()):
        needed["conserved momentum, so no pinned components, range rules or drive"] = all(system.still)
    wrong = [name for name, right in needed.items() if not right]
    if wrong:
        raise InputError(f"HelfandCurrents needs {' and '.join(wrong)}; leave it out, or change the scene.")


def helfand(
    sim: Simulation,
    *,
    every: float,
    count: int,
    look: Callable[[Frame], object] | None = None,
    look_every: int = 1,
) -> HelfandMoments:
    """Continue the run and return Helfand's moments at equal times; does not affect the trajectory.

    Parameters
    ----------
    every : float
        Time between two samples [time]; the first one is the present.
    count : int
        Number of samples; the run ends at the last one.
    look : callable, optional
        Called with a frame at the first sample, and at every ``look_every``-th after it. It may save the
        run: a checkpoint holds no samples.
    look_every : int
        Samples from one such frame to the next.

    Returns
    -------
    HelfandMoments
        Exact, since every current is constant between two collisions; see ``observables.analysis.moments``.

    Raises
    ------
    InputError
        If the simulation was made without :class:`carom.observables.HelfandCurrents`.
    """
    run_state = sim._state
    if not run_state.system.currents:
        raise InputError(
            "helfand() needs currents, and this simulation has none: make it with "
            "observers=[carom.observables.HelfandCurrents()]."
        )
    step = Fraction(checks.number(every, "every", low=0.0, open_low=True))
    count = checks.integer(count, "count", low=2)
    stride = checks.integer(look_every, "look_every", low=1) if look is not None else count
    start = run_state.clock.instant
    with run_state.alone.changing():
        _ask(run_state, count, float(run_state.unit.to_kernel(step, 1)))
    try:
        for k in range(0, count, stride):
            advance(run_state, None, start + k * step)
            if look is not None:
                look(sim.frame())
        advance(run_state, None, start + (count - 1) * step)
        rows = _taken(run_state)
    finally:
        _ask(run_state, 0, np.inf)
    return _moments(rows, float(step), run_state)


def _ask(run_state: RunState, count: int, step: float) -> None:
    """Have the engine write so many samples, the first of them at the present."""
    from carom.engine.observers.currents import Currents
    from carom.engine.observers.interface import chained, listed

    currents = run_state.observer(Currents)
    currents.used[0] = 0
    currents.upcoming[:] = run_state.in_epoch() if count else np.inf, step
    asked = currents._replace(samples=np.zeros((count, currents.samples.shape[1])))
    run_state.observe(
        chained(asked if each is currents else each for each in listed(run_state.engine.model.observers))
    )


def _taken(run_state: RunState) -> np.ndarray:
    """Return the samples, those since the last collision included."""
    from carom.engine.observers.currents import Currents, observe

    currents, now = run_state.observer(Currents), run_state.in_epoch()
    while currents.used[0] < len(currents.samples):
        currents.upcoming[0] = min(currents.upcoming[0], now)  # by rounding it may be a hair behind the end
        observe(currents, now)
    return currents.samples


def _moments(rows: np.ndarray, every: float, run_state: RunState) -> HelfandMoments:
    """Return samples in the scene's units."""
    d, unit = run_state.scene.dimension, run_state.unit
    s = d * (d + 1) // 2
    species = rows.shape[1] - 2 * (s + d)
    upper = np.triu_indices(d)
    ends = np.cumsum([s, d, species, s, d])
    tensors, vectors = [], []
    for part in (0, 3):
        tensor = np.zeros((len(rows), d, d))
        packed = rows[:, ends[part] - s : ends[part]]
        tensor[:, upper[0], upper[1]] = packed
        tensor[:, upper[1], upper[0]] = packed
        tensors.append(tensor)
        vectors.append(rows[:, ends[part + 1] - d : ends[part + 1]])
    displaced = rows[:, ends[1] : ends[2]].reshape(len(rows), -1, d)
    return HelfandMoments(
        every,
        unit.to_scene(np.array(tensors), -1),
        unit.to_scene(np.array(vectors), -2),
        np.ascontiguousarray(np.moveaxis(displaced, 1, 0)),
    )
