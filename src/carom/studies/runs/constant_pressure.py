"""What a run with a barostat reports: the mean volume, Z, the pressure from collisions, moves accepted."""

from __future__ import annotations

import dataclasses
from typing import Any

from carom.observables.statistics import Estimate
from carom.observables.volume import Volume, VolumeResult
from carom.simulation.measuring import stretches
from carom.simulation.moves.barostat import VolumeMoves
from carom.simulation.simulation import Simulation


def volume_of(sim: Simulation, blocks: list[Any]) -> VolumeResult | None:
    """Return the mean volume, and the pressure from collisions; None without a barostat."""
    if sim._state.volume_moves is None:
        return None
    found: VolumeResult = stretches.estimate(sim, Volume(), blocks)
    return found


def numbers(found: VolumeResult, moves: VolumeMoves, diameter: float) -> dict[str, Estimate]:
    """Return the numbers of the summary with their errors, by name; Z has the pressure of the barostat."""
    return {
        "volume": found.volume,
        "Z": found.volume.scaled(moves.barostat.pressure / (found.n * found.kT)),
        "reduced_pressure": found.pressure.scaled(diameter**found.dimension / found.kT),
    }


def settings(moves: VolumeMoves) -> dict[str, Any]:
    """Return the barostat, and the moves that were tried and accepted since the start."""
    counts = {"tried": moves.tried, "accepted": moves.accepted}
    return {**dataclasses.asdict(moves.barostat), **counts}
