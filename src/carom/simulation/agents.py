"""Units that decide by rules, in the scene's terms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.compiling.compile_errors import comes_from_numba, reason
from carom.errors import InputError

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState


@dataclass(frozen=True)
class UnitsNow:
    """All units at one time: copies, which the run does not change.

    Attributes
    ----------
    kinds : (n,) int64 array
        Kind of each unit: its index in ``Ranges.kinds``.
    present : (n,) bool array
        Which units have not been removed.
    counts : (n, circles, kinds) int64 array
        Units of each kind in each circle of each unit; zero for circles that a unit does not have.
    memory : (n, m) float64 array
        The numbers that the rule keeps for each unit.
    timers : (n,) float64 array
        Time until each unit's timer runs out; infinite for never [time].
    targets : (n,) int64 array
        Target of each unit, or -1.
    asked : dict of str to int
        Number of calls of the rule since the start, by cause.
    """

    kinds: np.ndarray
    present: np.ndarray
    counts: np.ndarray
    memory: np.ndarray
    timers: np.ndarray
    targets: np.ndarray
    asked: dict[str, int]


def present(run_state: RunState) -> UnitsNow:
    """Return the units of a run at the present time."""
    pair = run_state.engine.model.rules
    if pair is None:
        raise InputError(
            "No unit in this scene decides by rules: give it interaction=carom.models.Ranges(...)."
        )
    causes = ("entered", "left", "timer", "changed")
    return UnitsNow(
        kinds=pair.kinds[:-1].copy(),
        present=pair.present[:-1] != 0,
        counts=pair.counts[:-1].copy(),
        memory=pair.memory[:-1].copy(),
        timers=np.asarray(run_state.unit.to_scene(pair.timers[:-1] - run_state.in_epoch(), 1)),
        targets=pair.targets[:-1].copy(),
        asked=dict(zip(causes, pair.asked[1:].tolist(), strict=True)),
    )


def refuse_rule(run_state: RunState, error: Exception) -> None:
    """Raise InputError where an error of the compiler is one about a rule; else do nothing."""
    pair = run_state.engine.model.rules
    if pair is None or not comes_from_numba(error):
        return
    rule = run_state.scene.interaction.rule  # type: ignore[attr-defined]
    why = reason(rule, pair.units[0], pair.told[0])
    if why is not None:
        raise InputError(
            f"Numba cannot compile the rule {rule.__name__}: {why}. Write it with numbers, arrays, tuples, "
            "and functions of math and NumPy."
        ) from None
