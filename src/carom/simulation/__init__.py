"""A scene in motion: run, sample, measure, save, load, log and replay.

Nothing here knows how an event is found: that is the engine's. Files and observables are handed in.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from carom.simulation.simulation import Simulation

__all__ = ["Simulation"]


def __getattr__(name: str) -> Any:
    """Import the simulation when it is first used: its parts are needed below it."""
    if name == "Simulation":
        from carom.simulation.simulation import Simulation

        return Simulation
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
