"""What a run with a barostat reports: the mean volume, Z, the pressure from collisions, moves accepted."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

from carom import theory
from carom.observables.statistics import Estimate
from carom.observables.volume import Volume, VolumeResult
from carom.simulation import stretches
from carom.simulation.barostat import VolumeMoves
from carom.simulation.simulation import Simulation
from carom.studies.phase import Phase, finite_size_shift, usual_equation


class MeanBox(NamedTuple):
    """The box of the mean volume."""

    n: int
    dimension: int
    packing_fraction: float

    @classmethod
    def of(cls, found: VolumeResult) -> MeanBox:
        """Return that of a measured volume."""
        return cls(found.n, found.dimension, found.packing_fraction.mean)


def volume_of(sim: Simulation, blocks: list[Any]) -> VolumeResult | None:
    """Return the mean volume, and the pressure from collisions; None without a barostat."""
    if sim._state.volume_moves is None:
        return None
    found: VolumeResult = stretches.estimate(sim, Volume(), blocks)
    return found


def compressibility_factor(found: VolumeResult, moves: VolumeMoves) -> Estimate:
    """Return ``Z = P <V> / n kT`` with the pressure P of the barostat."""
    return found.volume.scaled(moves.barostat.pressure / (found.n * found.kT))


def shift(box: MeanBox, phase: Phase, equation: theory.Equation) -> float:
    """Return Z of n particles at constant pressure less that of infinitely many, by theory."""
    eta, n = box.packing_fraction, box.n
    return finite_size_shift(phase.name, eta, n, equation) + float(
        theory.constant_pressure_shift(eta, n, equation)
    )


def infinite(Z: Estimate, box: MeanBox, phase: Phase | None) -> Estimate | None:
    """Return Z of infinitely many particles; None where no theory gives the correction."""
    if phase is None or (phase.name != "fluid" and not phase.equations):
        return None
    best = usual_equation(box.dimension, phase.name)
    if best is None:
        return None
    return Z.scaled(1.0, offset=-shift(box, phase, best))


def numbers(found: VolumeResult, moves: VolumeMoves, diameter: float) -> dict[str, Estimate]:
    """Return the numbers of the summary with their errors, by name."""
    return {
        "volume": found.volume,
        "Z": compressibility_factor(found, moves),
        "reduced_pressure": found.pressure.scaled(diameter**found.dimension / found.kT),
    }


def settings(moves: VolumeMoves) -> dict[str, Any]:
    """Return the barostat, and the moves that were tried and accepted since the start."""
    return {**dataclasses.asdict(moves.barostat), "tried": moves.tried, "accepted": moves.accepted}
