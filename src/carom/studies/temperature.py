"""The temperature of pairs with steps, which exchange kinetic for potential energy."""

from __future__ import annotations

from collections.abc import Callable

from carom.block import Block
from carom.simulation.simulation import Simulation

ROUNDS = 8
"""Number of rescalings that bring pairs with steps to a temperature."""


def bring_to_temperature(sim: Simulation, length: float, kT: float, look: Callable[[float], object]) -> None:
    """Equilibrate pairs with steps for ``length`` collisions per particle, the second half undisturbed.

    Pairs that enter wells heat the system, and kT fluctuates. So each round rescales by its own mean kT.
    """
    for _ in range(ROUNDS):
        before = sim.tally
        sim.run(collisions_per_particle=0.5 * length / ROUNDS, progress=look)
        after = sim.tally
        # No time may pass where the length is zero.
        if after.duration > before.duration:
            sim.rescale(sim.kT * kT / kT_between(before, after))
    sim.run(collisions_per_particle=0.5 * length, progress=look)


def kT_between(before: Block, after: Block) -> float:
    """Return the mean kT between two tallies."""
    assert before.kT_time is not None
    assert after.kT_time is not None
    return (after.kT_time - before.kT_time) / (after.duration - before.duration)
